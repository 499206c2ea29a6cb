//! Stand measures against textbooks' own relations.

use nemoral_mensuration::{Plot, StandMeasures, StandRow, stand_csv};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{ChunkCoord, ObjectId, TreeRecord};
use proptest::prelude::*;

fn tree(item: u16, dbh_m: f64, height_m: f64, alive: bool) -> TreeRecord {
    TreeRecord {
        object: ObjectId::new(ChunkCoord::new(0, 0), item).expect("in range"),
        species: "beech".to_owned(),
        position_m: DVec3::ZERO,
        dbh_m,
        height_m,
        crown_base_m: 0.5 * height_m,
        crown_radius_m: 2.0,
        leaf_area_m2: if alive { 100.0 } else { 0.0 },
        stem_volume_m3: 0.4 * dbh_m * dbh_m * height_m,
        lean_rad: 0.0,
        age_class: "mature".to_owned(),
        alive,
        field_id: String::new(),
    }
}

fn hectare() -> Plot {
    Plot {
        area_m2: 10_000.0,
        min_dbh_m: 0.07,
    }
}

#[track_caller]
fn near(found: impl Into<Option<f64>>, wanted: f64) {
    let found = found.into().expect("there are trees");
    assert!((found - wanted).abs() <= 1e-9 * wanted, "{found}: {wanted}");
}

#[test]
fn of_equal_trees_every_mean_is_theirs() {
    let trees: Vec<_> = (1..=400).map(|i| tree(i, 0.254, 20.0, true)).collect();
    let m = StandMeasures::of(&trees, &hectare()).expect("valid");
    near(m.trees_per_ha, 400.0);
    near(m.quadratic_mean_dbh_m, 0.254);
    near(m.lorey_height_m, 20.0);
    near(m.dominant_dbh_m, 0.254);
    near(m.dominant_height_m, 20.0);
    // Reineke's index is the number of trees where they have 25.4 cm.
    near(m.stand_density_index, 400.0);
    near(m.leaf_area_index, 4.0);
    near(m.basal_area_m2_ha, 400.0 * 0.050_670_747_909_749_77);
    near(m.stem_volume_m3_ha, 400.0 * trees[0].stem_volume_m3);
}

#[test]
fn dominant_trees_are_the_thickest_hundred_of_a_hectare() {
    // Diameters of 10 to 39.9 cm; heights fall with them, so that the tallest are not dominant.
    let trees: Vec<_> = (0..300)
        .map(|i| {
            tree(
                i + 1,
                0.1 + 0.001 * f64::from(i),
                40.0 - 0.1 * f64::from(i),
                true,
            )
        })
        .collect();
    let m = StandMeasures::of(&trees, &hectare()).expect("valid");
    near(m.dominant_dbh_m, 0.1 + 0.001 * 249.5);
    near(m.dominant_height_m, 40.0 - 0.1 * 249.5);
    // A plot of 150 m² has one and a half of them.
    let small = Plot {
        area_m2: 150.0,
        ..hectare()
    };
    let m = StandMeasures::of(&trees, &small).expect("valid");
    near(m.dominant_dbh_m, (0.399 + 0.5 * 0.398) / 1.5);
    // One of 10 m² has one, and three trees on a hectare are all.
    let tiny = Plot {
        area_m2: 10.0,
        ..hectare()
    };
    near(
        StandMeasures::of(&trees, &tiny)
            .expect("valid")
            .dominant_dbh_m,
        0.399,
    );
    near(
        StandMeasures::of(&trees[..3], &hectare())
            .expect("valid")
            .dominant_dbh_m,
        0.101,
    );
}

#[test]
fn thin_and_dead_trees_count_apart() {
    let trees = [
        tree(1, 0.3, 20.0, true),
        tree(2, 0.069, 8.0, true),
        tree(3, 0.2, 12.0, false),
        tree(4, 0.05, 4.0, false),
    ];
    let m = StandMeasures::of(&trees, &hectare()).expect("valid");
    assert_eq!((m.trees_per_ha, m.dead_trees_per_ha), (1.0, 1.0));
    near(m.dead_stem_volume_m3_ha, trees[2].stem_volume_m3);
    near(m.lorey_height_m, 20.0);
    // Nothing that lives has no means, and its cells are empty.
    let bare = StandMeasures::of(&trees[1..], &hectare()).expect("valid");
    assert_eq!(bare.quadratic_mean_dbh_m, None);
    let text = stand_csv(
        (&["species"], &["cover"]),
        &[StandRow {
            key: vec!["a,b".to_owned()],
            measures: bare,
            more: vec!["0.5".to_owned()],
        }],
    );
    let row = text.lines().nth(1).expect("a row");
    assert!(
        row.starts_with("\"a,b\",0.0000,0.0000,,,,,,0.0000"),
        "{row}"
    );
}

#[test]
fn a_plot_without_area_is_refused() {
    for (area_m2, min_dbh_m, told) in [
        (0.0, 0.07, "area_m2"),
        (f64::NAN, 0.07, "area_m2"),
        (1.0, -0.1, "min_dbh_m"),
        // As foresters write it, in centimetres.
        (1.0, 7.0, "min_dbh_m"),
    ] {
        let plot = Plot { area_m2, min_dbh_m };
        let refused = StandMeasures::of(&[], &plot).expect_err(told);
        assert!(refused.to_string().contains(told), "{refused}");
    }
}

proptest! {
    #[test]
    fn order_is_no_matter_and_halves_add_up(
        sizes in prop::collection::vec((0.01..1.0_f64, 1.3..45.0_f64, prop::bool::ANY), 1..60),
    ) {
        let trees: Vec<_> = sizes.iter().zip(1..)
            .map(|(&(dbh_m, height_m, alive), item)| tree(item, dbh_m, height_m, alive))
            .collect();
        let all = StandMeasures::of(&trees, &hectare()).expect("valid");
        prop_assert_eq!(all, StandMeasures::of(trees.iter().rev(), &hectare()).expect("valid"));
        let (a, b) = trees.split_at(trees.len() / 2);
        let [a, b] = [a, b].map(|half| StandMeasures::of(half, &hectare()).expect("valid"));
        let close = |x: f64, y: f64| (x - y).abs() <= 1e-9 * (1.0 + x.abs());
        prop_assert!(close(all.basal_area_m2_ha, a.basal_area_m2_ha + b.basal_area_m2_ha));
        prop_assert!(close(all.stem_volume_m3_ha, a.stem_volume_m3_ha + b.stem_volume_m3_ha));
        // Dominant trees are no thinner than the mean.
        if let (Some(mean_m), Some(top_m)) = (all.quadratic_mean_dbh_m, all.dominant_dbh_m) {
            let few = Plot { area_m2: 500.0, ..hectare() };
            let few = StandMeasures::of(&trees, &few).expect("valid").dominant_dbh_m;
            prop_assert!(mean_m >= 0.07 && few >= Some(top_m));
            prop_assert!(few.is_some_and(|few_m| few_m >= mean_m * 0.5));
        }
    }
}
