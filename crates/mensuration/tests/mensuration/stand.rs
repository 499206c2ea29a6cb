//! Stand measures against textbooks' own relations.

use nemoral_mensuration::{
    LyingDeadwood, Plot, StandMeasures, StandRow, deadwood_stand_csv, stand_csv,
};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{ChunkCoord, DeadwoodRecord, DecayStage, ObjectId, ObjectKind, TreeRecord};
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
        wood_volume_m3: Some(0.5 * dbh_m * dbh_m * height_m),
        merchantable_volume_m3: Some(0.45 * dbh_m * dbh_m * height_m),
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
        min_deadwood_diameter_m: 0.1,
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
    near(m.wood_volume_m3_ha, 500.0 * trees[0].stem_volume_m3);
    near(m.merchantable_volume_m3_ha, 450.0 * trees[0].stem_volume_m3);
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
    // Of 20 cm; the other dead one is too thin.
    near(m.dead_basal_area_m2_ha, 0.031_415_926_535_897_934);
    near(m.basal_area_m2_ha, 0.070_685_834_705_770_35);
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
    let head = text.lines().next().expect("a head");
    // One is in the name.
    assert_eq!(row.matches(',').count(), head.matches(',').count() + 1);
}

/// A model of a user, of which all wood is not known.
#[test]
fn volumes_that_are_not_known_are_not_taken_for_nothing() {
    let mut trees = [tree(1, 0.3, 20.0, true), tree(2, 0.4, 22.0, true)];
    trees[1].merchantable_volume_m3 = None;
    let m = StandMeasures::of(&trees, &hectare()).expect("valid");
    assert_eq!(m.merchantable_volume_m3_ha, None);
    let wood_m3: f64 = trees.iter().filter_map(|t| t.wood_volume_m3).sum();
    near(m.wood_volume_m3_ha, wood_m3);
    // What does not count has no say.
    for (dbh_m, alive) in [(0.06, true), (0.4, false)] {
        (trees[1].dbh_m, trees[1].alive) = (dbh_m, alive);
        let m = StandMeasures::of(&trees, &hectare()).expect("valid");
        assert_eq!(m.merchantable_volume_m3_ha, trees[0].merchantable_volume_m3);
    }
}

/// A log or a root plate that is so thick at its thick end.
fn piece(item: u16, kind: ObjectKind, thick_end_m: f64, decay: DecayStage) -> DeadwoodRecord {
    DeadwoodRecord {
        object: ObjectId::new(ChunkCoord::new(0, 0), item).expect("in range"),
        kind,
        species: "beech".to_owned(),
        position_m: DVec3::ZERO,
        azimuth_deg: 90.0,
        length_m: 4.0,
        diameter_m: [thick_end_m, 0.4 * thick_end_m],
        decay,
        volume_m3: 2.0 * thick_end_m * thick_end_m,
        is_thrown: kind == ObjectKind::RootPlate,
    }
}

#[test]
fn logs_count_by_their_thick_ends_and_stages() {
    let pieces = [
        piece(1, ObjectKind::Log, 0.1, DecayStage::Fresh),
        piece(2, ObjectKind::Log, 0.099, DecayStage::Fresh),
        piece(3, ObjectKind::Log, 0.3, DecayStage::Soft),
        piece(4, ObjectKind::Log, 0.5, DecayStage::Soft),
        piece(5, ObjectKind::RootPlate, 1.5, DecayStage::Soft),
    ];
    let plot = Plot {
        area_m2: 500.0,
        ..hectare()
    };
    let lying = LyingDeadwood::of(&pieces, &plot).expect("valid");
    for (stage, pieces_per_ha, volume_m3_ha) in [
        (DecayStage::Fresh, 20.0, 20.0 * 0.02),
        (DecayStage::Loosening, 0.0, 0.0),
        (DecayStage::Bare, 0.0, 0.0),
        (DecayStage::Soft, 40.0, 20.0 * (0.18 + 0.5)),
        (DecayStage::Rotten, 0.0, 0.0),
    ] {
        let found = lying.of_stage(stage);
        near(found.pieces_per_ha, pieces_per_ha);
        near(found.volume_m3_ha, volume_m3_ha);
    }
    near(lying.all().pieces_per_ha, 60.0);
    near(lying.all().volume_m3_ha, 20.0 * 0.7);
    assert_eq!(
        deadwood_stand_csv(&lying),
        "decay,pieces_per_ha,volume_m3_ha\nall,60.0000,14.0000\n1,20.0000,0.4000\n\
         2,0.0000,0.0000\n3,0.0000,0.0000\n4,40.0000,13.6000\n5,0.0000,0.0000\n"
    );
    // The order in which they are given does not matter, and the limit does.
    let turned = LyingDeadwood::of(pieces.iter().rev(), &plot).expect("valid");
    assert_eq!(turned, lying);
    for (min_deadwood_diameter_m, count) in [(0.0, 4.0), (0.07, 4.0), (0.3, 2.0), (0.51, 0.0)] {
        let plot = Plot {
            min_deadwood_diameter_m,
            ..hectare()
        };
        let lying = LyingDeadwood::of(&pieces, &plot).expect("valid");
        assert_eq!(lying.all().pieces_per_ha, count);
    }
}

#[test]
fn a_plot_without_area_is_refused() {
    for (area_m2, min_dbh_m, min_deadwood_diameter_m, told) in [
        (0.0, 0.07, 0.1, "area_m2"),
        (f64::NAN, 0.07, 0.1, "area_m2"),
        (1.0, -0.1, 0.1, "min_dbh_m"),
        // As foresters write it, in centimetres.
        (1.0, 7.0, 0.1, "min_dbh_m"),
        (1.0, 0.07, 10.0, "min_deadwood_diameter_m = 10"),
        (1.0, 0.07, f64::NAN, "min_deadwood_diameter_m"),
    ] {
        let plot = Plot {
            area_m2,
            min_dbh_m,
            min_deadwood_diameter_m,
        };
        let refused = StandMeasures::of(&[], &plot).expect_err(told);
        assert!(refused.to_string().contains(told), "{refused}");
        let refused = LyingDeadwood::of(&[], &plot).expect_err(told);
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
