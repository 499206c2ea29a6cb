//! Crowns answer to competition as the trees of an inventory do.

use nemoral_assets::{AssetParams, Competition, Competitors, Species, StandParams, StandSpecies};
use proptest::prelude::*;

use crate::common::key;

/// Diameter and height, m; crown ratios of a dominant tree where crowns just meet, of the mean tree
/// in a closed stand, and of a small one in a crowded stand.
type Expected = (&'static str, [f64; 2], [f64; 3]);

/// By the formula of Hasenauer and Monserud (1996) with the coefficients of Hasenauer (2000), in
/// another language, with its terms of the site: 500 m above the sea, level.
const PUBLISHED: [Expected; 5] = [
    (
        "norway_spruce",
        [0.30, 24.0],
        [0.681494, 0.544529, 0.444485],
    ),
    ("scots_pine", [0.30, 22.0], [0.446792, 0.331834, 0.254172]),
    ("beech", [0.30, 24.0], [0.719684, 0.643531, 0.601108]),
    ("english_oak", [0.30, 20.0], [0.625669, 0.547945, 0.490195]),
    ("silver_birch", [0.22, 20.0], [0.584611, 0.53091, 0.494155]),
];

const COMPETITION: [[f64; 2]; 3] = [[0.0, 100.0], [20.0, 250.0], [40.0, 400.0]];

fn competition([larger_m2_ha, crown_factor]: [f64; 2]) -> Competition {
    Competition {
        larger_m2_ha,
        crown_factor,
    }
}

#[test]
fn crown_ratios_are_the_published_ones() {
    for (name, [dbh_m, height_m], expected) in PUBLISHED {
        let species = Species::built_in(name).expect("a species");
        for (of, expected) in COMPETITION.map(competition).iter().zip(expected) {
            let got = species.mean_crown_ratio(dbh_m, height_m, of);
            assert!((got - expected).abs() < 2e-6, "{name} {of:?}: {got}");
        }
    }
}

#[test]
fn drawn_crowns_have_the_mean_ratio() {
    for (name, [dbh_m, _], _) in PUBLISHED {
        let species = Species::built_in(name).expect("a species");
        for of in COMPETITION.map(competition) {
            let mut off = 0.0;
            let mut leaves = [0.0; 2];
            for i in 0..400 {
                let size = species.draw_size_among(dbh_m, &of, key(i));
                let ratio = 1.0 - size.crown_base_m / size.height_m;
                let mean = |of| species.mean_crown_ratio(dbh_m, size.height_m, of);
                off += ratio - mean(&of);
                // Leaves are in proportion.
                let closed = species.draw_size(dbh_m, key(i));
                leaves[0] += size.leaf_area_m2 / closed.leaf_area_m2;
                leaves[1] += mean(&of) / mean(&Competition::default());
            }
            assert!((leaves[0] / leaves[1] - 1.0).abs() < 1e-9, "{leaves:?}");
            assert!(
                (off / 400.0).abs() < 0.012,
                "{name} {of:?}: {}",
                off / 400.0
            );
        }
    }
}

#[test]
fn a_species_without_a_model_keeps_its_mean() {
    let pine = Species::maritime_pine();
    let ratios = COMPETITION.map(|of| pine.mean_crown_ratio(0.3, 18.0, &competition(of)));
    assert_eq!(ratios, [pine.allometry.crown_ratio[0]; 3]);
}

#[test]
fn competition_of_two_cohorts_is_the_closed_form() {
    let (spruce, beech) = (Species::norway_spruce(), Species::beech());
    let all = Competitors::new([(&beech, 0.2, 300.0), (&spruce, 0.4, 250.0)]);
    let disc = |d: f64| std::f64::consts::FRAC_PI_4 * d * d;
    let factor = (300.0 * disc(beech.open_crown_width_m(0.2))
        + 250.0 * disc(spruce.open_crown_width_m(0.4)))
        / 100.0;
    for (dbh_m, larger) in [
        (0.5, 0.0),
        (0.4, 0.0),
        (0.3, 250.0 * disc(0.4)),
        (0.2, 250.0 * disc(0.4)),
        (0.1, 250.0 * disc(0.4) + 300.0 * disc(0.2)),
    ] {
        let of = all.of(dbh_m);
        assert!((of.larger_m2_ha - larger).abs() < 1e-9, "{dbh_m}: {of:?}");
        assert!((of.crown_factor - factor).abs() < 1e-9, "{of:?}, {factor}");
    }
    // Nothing at all competes with a tree alone.
    assert_eq!(Competitors::default().of(0.3), competition([0.0, 0.0]));
}

fn stand(trees_per_ha: f64, dbh_mean_m: f64) -> AssetParams {
    AssetParams {
        species: vec![StandSpecies {
            species: Species::norway_spruce(),
            dbh_mean_m,
            trees_per_ha,
        }],
        stand: StandParams {
            shape: 3.0,
            dbh_min_m: 0.1,
            dbh_max_m: 0.6,
        },
        ..AssetParams::default()
    }
}

/// The basal area of all trees of a stand is what the thinnest one has above it.
#[test]
fn a_stands_trees_are_counted_once() {
    let all = stand(600.0, 0.28).competitors();
    let basal_area = all.of(0.0).larger_m2_ha;
    // A Weibull distribution of shape 3 and mean 0.28 has a mean square of 0.0889 before it is cut.
    let expected = 600.0 * std::f64::consts::FRAC_PI_4 * 0.0889;
    assert!(
        (basal_area / expected - 1.0).abs() < 0.03,
        "{basal_area}, {expected}"
    );
}

proptest! {
    #[test]
    fn denser_stands_have_shorter_crowns_and_thinner_trees_too(
        per_ha in 50.0..1500.0_f64,
        more in 1.2..4.0_f64,
        dbh_mean_m in 0.15..0.4_f64,
        dbh_m in 0.12..0.5_f64,
    ) {
        let (sparse, dense) = (stand(per_ha, dbh_mean_m), stand(more * per_ha, dbh_mean_m));
        for species in Species::all() {
            let height_m = species.mean_height_m(dbh_m);
            let ratio = |of: &Competition| species.mean_crown_ratio(dbh_m, height_m, of);
            let [few, many] = [&sparse, &dense].map(|s| s.competitors());
            prop_assert!(ratio(&many.of(dbh_m)) <= ratio(&few.of(dbh_m)));
            // The same tree with larger neighbours.
            prop_assert!(ratio(&many.of(0.5 * dbh_m)) <= ratio(&many.of(dbh_m)));
        }
    }
}
