//! Lianas and resin on grown trees.

use std::sync::{Arc, LazyLock};

use nemoral_assets::{AssetParams, ClimberParams, Library, Species, StandSpecies, StemMoss};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{Prototype, Semantic};
use nemoral_seed::Key;

static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let of = |name: &str| StandSpecies {
        species: Species::built_in(name).expect("a built-in species"),
        dbh_mean_m: 0.25,
        // Where trees stand so far apart, lianas reach their crowns.
        trees_per_ha: 60.0,
    };
    let params = AssetParams {
        species: ["english_oak", "scots_pine"].map(of).to_vec(),
        individuals_per_species: 2,
        snags_per_species: 1,
        climbers: Some(ClimberParams {
            moss: StemMoss {
                amount: 1.0,
                height_m: 1.0,
            },
            lianas: true,
            resin: true,
        }),
        textures: false,
        ..AssetParams::default()
    };
    Library::grow(&params, Key::world(11)).expect("valid")
});

/// The distance of a point from the nearest of a tree's triangles that it lies before, metres.
fn off_bark_m(tree: &Prototype, at: Vec3) -> f32 {
    let mesh = tree.mesh();
    let distances = mesh.triangles.iter().filter_map(|t| {
        let [a, b, c] = t.corners.map(|i| mesh.positions[i as usize]);
        let normal = (b - a).cross(c - a);
        let inside = |from: Vec3, to: Vec3| (to - from).cross(at - from).dot(normal) >= 0.0;
        let is_before = inside(a, b) && inside(b, c) && inside(c, a);
        is_before.then(|| (at - a).dot(normal.normalize_or(Vec3::Z)).abs())
    });
    distances.fold(f32::INFINITY, f32::min)
}

/// The distance of a point from the middle of the nearest of a tree's leaf cards, metres.
fn off_leaves_m(tree: &Prototype, at: Vec3) -> f32 {
    let middles = (tree.cards().iter()).map(|c| c.corner + 0.5 * c.edge_u + 0.5 * c.edge_v);
    middles.fold(f32::INFINITY, |least, p| least.min(p.distance(at)))
}

#[test]
fn living_conifers_alone_have_resin_and_it_is_on_their_bark() {
    let climbers = &LIBRARY.climbers;
    for (tree, on) in LIBRARY.trees.iter().zip(&climbers.trees) {
        assert_eq!(on.resin.is_some(), tree.species == "scots_pine");
        for card in on.resin.iter().flat_map(|shape| shape.cards()) {
            let material = LIBRARY.materials.get(card.material);
            assert_eq!(
                (material.semantic, material.support),
                (Semantic::Stem, None)
            );
            let wound = card.corner + 0.5 * card.edge_u;
            assert!(wound.z > 0.2 && wound.z < 4.1, "{wound}");
            let off_m = off_bark_m(&tree.prototype, wound);
            assert!(off_m < 0.02, "{wound}: {off_m}");
            assert!(card.edge_v.z < 0.0, "it runs down");
        }
    }
    assert!(climbers.snags.iter().all(|on| on.resin.is_none()));
}

#[test]
fn a_veil_of_clematis_lies_on_leaves_that_are_there() {
    let mut found = 0;
    for (tree, on) in LIBRARY.trees.iter().zip(&LIBRARY.climbers.trees) {
        let Some(shape) = &on.clematis else { continue };
        found += 1;
        let supports = shape
            .cards()
            .iter()
            .map(|c| LIBRARY.materials.get(c.material).support);
        assert!(supports.into_iter().all(|s| s == Some(Semantic::Branch)));
        let feet = shape.cards().iter().map(|c| c.corner + 0.5 * c.edge_u);
        let near = feet
            .filter(|&p| off_leaves_m(&tree.prototype, p) < 0.3)
            .count();
        // The others are of shoots that hang.
        assert!(
            2 * near > shape.cards().len(),
            "{near} of {}",
            shape.cards().len()
        );
    }
    assert!(found >= 2);
    // Dead trees have no leaves that it could lie on.
    assert!(
        LIBRARY
            .climbers
            .snags
            .iter()
            .all(|on| on.clematis.is_none())
    );
}

#[test]
fn value_stability() {
    let on = &LIBRARY.climbers.trees[0];
    let of = |shape: &Option<Arc<Prototype>>| {
        let shape = shape.as_ref().expect("an oak has it");
        let last = shape.cards()[shape.cards().len() - 1].corner;
        (
            shape.mesh().positions.len(),
            shape.cards().len(),
            last.to_array(),
        )
    };
    assert_eq!(
        of(&on.honeysuckle),
        (1066, 223, [0.051_757_37, -0.072_294_96, 4.635_193_3])
    );
    assert_eq!(
        of(&on.clematis),
        (1640, 587, [2.175_913, -1.299_444_1, 7.236_348_6])
    );
}
