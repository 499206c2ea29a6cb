//! Any tree of any species grows within its budgets and is as large as was asked for.
//!
//! This is measured on the results: triangles, cards and the opaque parts of their pictures.

use crate::common::{cut_dbh_m, key, library, materials, silhouette_m2, top_m};
use nemoral_assets::{GrowthParams, Species, TreeSize, grow, grow_snag};
use nemoral_scene::Prototype;

/// The species' whole range of diameters, ends included.
fn diameters(species: &Species, count: u32) -> impl Iterator<Item = f64> {
    let [low, high] = species.allometry.dbh_range_m;
    (0..count).map(move |i| low + (high - low) * f64::from(i) / f64::from(count - 1))
}

fn grows_as_asked(species: &Species, size: &TreeSize, params: &GrowthParams, seed: u64) {
    let name = format!("{} of {:.2} m, {params:?}", species.name, size.dbh_m);
    let tree = grow(species, size, &materials(), params, key(seed));
    let tree = tree.unwrap_or_else(|e| panic!("{name}: {e}"));
    let (wood, cards) = (tree.mesh.triangles.len(), tree.cards.len());
    assert!(
        wood <= params.wood_triangles_max,
        "{name}: {wood} triangles"
    );
    assert!(
        (1..=params.cards_max).contains(&cards),
        "{name}: {cards} cards"
    );
    let near = |what: &str, got: f64, wanted: f64, share: f64| {
        let off = got / wanted - 1.0;
        assert!(off.abs() < share, "{name}: {what} {got} for {wanted}");
    };
    near("diameter", cut_dbh_m(&tree.mesh), size.dbh_m, 0.02);
    let wood = tree.mesh.positions.iter().copied();
    let top = wood.map(|p| p.z).chain(tree.cards.iter().map(top_m));
    let top = top.fold(0.0, f32::max);
    near("height", f64::from(top), size.height_m, 0.01);
    let silhouette = silhouette_m2(&tree.cards);
    let factor = species.foliage.silhouette_factor;
    near("leaf area", silhouette / factor, size.leaf_area_m2, 0.03);
    near(
        "leaf area as told",
        tree.size.leaf_area_m2,
        size.leaf_area_m2,
        0.03,
    );
    let prototype = Prototype::new("tree", tree.mesh, tree.cards, &library());
    assert!(prototype.is_ok(), "{name}: {:?}", prototype.err());
}

#[test]
fn every_size_of_every_species_grows_within_its_budgets() {
    for species in Species::all() {
        for (i, dbh_m) in diameters(&species, 7).enumerate() {
            for seed in 0..2 {
                let seed = 10 * i as u64 + seed;
                let size = species.draw_size(dbh_m, key(seed));
                // The thinnest stems count as trunk too, so that the calipers find them.
                let params = GrowthParams {
                    trunk_radius_m: 0.02,
                    ..GrowthParams::default()
                };
                grows_as_asked(&species, &size, &params, seed);
            }
        }
    }
}

/// The least budgets simplify even the largest trees and refuse none.
#[test]
fn least_budgets_are_kept_too() {
    let params = GrowthParams {
        wood_triangles_max: 3_000,
        cards_max: 50,
        trunk_radius_m: 0.02,
        shaded_base_m: None,
    };
    for species in Species::all() {
        for (i, dbh_m) in diameters(&species, 3).enumerate() {
            let size = species.draw_size(dbh_m, key(i as u64));
            grows_as_asked(&species, &size, &params, i as u64);
            let snag = grow_snag(&species, &size, &materials(), &params, key(i as u64));
            let snag = snag.unwrap_or_else(|e| panic!("{}: {e}", species.name));
            assert!(snag.mesh.triangles.len() <= params.wood_triangles_max);
        }
    }
}
