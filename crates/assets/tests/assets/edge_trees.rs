//! Trees of a wood's edge: the stand's own trees, whose crowns reach down on the side of the light.

use std::sync::LazyLock;

use nemoral_assets::{AssetParams, Library, Species, StandSpecies, TreeAsset};
use nemoral_seed::Key;
use proptest::prelude::*;

const NAMES: [&str; 3] = ["english_oak", "norway_spruce", "maritime_pine"];
const INDIVIDUALS: usize = 2;

fn params(edge_trees: bool) -> AssetParams {
    AssetParams {
        species: (NAMES.iter())
            .map(|name| StandSpecies {
                species: Species::built_in(name).expect("a built-in species"),
                dbh_mean_m: 0.3,
                trees_per_ha: 300.0,
            })
            .collect(),
        individuals_per_species: INDIVIDUALS as u32,
        edge_trees,
        textures: false,
        ..AssetParams::default()
    }
}

static LIBRARY: LazyLock<Library> =
    LazyLock::new(|| Library::grow(&params(true), Key::world(5)).expect("valid"));

/// Each tree inside the wood, and the same one at the edge.
fn pairs() -> impl Iterator<Item = (&'static TreeAsset, &'static TreeAsset)> {
    let (inside, edge) = LIBRARY.trees.split_at(NAMES.len() * INDIVIDUALS);
    assert_eq!(inside.len(), edge.len());
    inside.iter().zip(edge)
}

/// The share of the leaf cards' area that is below a height, on the sunny and on the shaded side.
fn low_leaves(tree: &TreeAsset, below_m: f32) -> [f32; 2] {
    let (mut low, mut all) = ([0.0; 2], [0.0; 2]);
    for card in tree.prototype.cards() {
        let middle = card.corner + 0.5 * (card.edge_u + card.edge_v);
        let area_m2 = card.edge_u.cross(card.edge_v).length();
        let side = usize::from(middle.x < 0.0);
        all[side] += area_m2;
        if middle.z < below_m {
            low[side] += area_m2;
        }
    }
    [low[0] / all[0], low[1] / all[1]]
}

#[test]
fn their_crowns_reach_down_in_the_light_alone() {
    let mut compared = 0;
    for (inside, edge) in pairs() {
        let name = &edge.prototype.name();
        assert!(name.contains(".edge."), "{name}");
        assert_eq!((&edge.species, edge.alive), (&inside.species, true));
        let (a, b) = (&inside.size, &edge.size);
        assert!(
            (b.dbh_m / a.dbh_m - 1.0).abs() < 0.02,
            "{name}: {a:?} {b:?}"
        );
        assert!((0.88..0.98).contains(&(b.height_m / a.height_m)), "{name}");
        assert!(
            b.crown_base_m < 0.75 * a.crown_base_m,
            "{name}: {a:?} {b:?}"
        );
        // A crown that reaches down in the shade, too, has no more leaves.
        assert!(b.leaf_area_m2 >= a.leaf_area_m2, "{name}");
        // Leaves below where the crown begins in the shade, if that is not the ground in any case.
        if b.crown_base_m < 0.5 * a.crown_base_m {
            let [sunny, shaded] = low_leaves(edge, 0.85 * a.crown_base_m as f32);
            assert!(sunny > 0.1, "{name}: {sunny} {shaded}");
            // A third of the circle is half in the light.
            assert!(sunny > 1.8 * shaded, "{name}: {sunny} {shaded}");
            compared += 1;
        }
        let foot = edge.radius_m / inside.radius_m;
        assert!((foot - 1.0).abs() < 0.05, "{name}: {foot}");
    }
    assert!(compared > 4, "{compared}");
}

#[test]
fn the_stand_is_the_same_without_them() {
    let without = Library::grow(&params(false), Key::world(5)).expect("valid");
    assert_eq!(without.trees.len(), NAMES.len() * INDIVIDUALS);
    for (a, b) in without.trees.iter().zip(&LIBRARY.trees) {
        assert_eq!(a.size, b.size);
        assert_eq!(a.prototype.mesh(), b.prototype.mesh());
        assert_eq!(a.prototype.cards(), b.prototype.cards());
    }
}

proptest! {
    #[test]
    fn any_size_has_one_at_the_edge(
        species in 0_usize..9, dbh_m in 0.01_f64..2.0, item in any::<u64>(),
        share in prop::option::of(0.02_f64..=0.6),
    ) {
        let mut species = Species::all().swap_remove(species);
        species.allometry.edge_crown_base = share;
        let inside = species.draw_size(dbh_m, Key::world(1).item(item));
        let edge = species.size_at_edge(&inside);
        let shaded_m = species.shaded_base_m(&inside);
        prop_assert!(edge.crown_base_m > 0.1 && edge.crown_base_m <= shaded_m);
        prop_assert!(shaded_m < 0.9 * edge.height_m);
        prop_assert!(edge.leaf_area_m2 >= inside.leaf_area_m2.min(5_000.0));
        prop_assert!(edge.crown_radius_m <= 15.0 && edge.dbh_m == inside.dbh_m);
    }
}
