//! The inventory's sizes of a tree are those that a forester would measure on its triangles and
//! leaves.
//!
//! They are measured here on trees of a library with their own pictures, by methods that the
//! generator does not use: the height over wood and the opaque texels of cards, the diameter by
//! calipers and tape around a slice.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::LazyLock;

use nemoral_assets::{
    AssetParams, Library, SizeClass, Species, StandParams, StandSpecies, TreeAsset,
};
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{Card, MaterialLibrary, Semantic};
use nemoral_seed::Key;

/// Height above the ground where foresters measure diameters.
const BREAST_M: f64 = 1.3;

static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    // Wide enough for every species' size classes.
    let stand = StandParams {
        shape: 1.2,
        dbh_min_m: 0.07,
        dbh_max_m: 1.2,
    };
    let species = Species::all().into_iter();
    let params = AssetParams {
        species: species
            .map(|s| StandSpecies {
                dbh_mean_m: s.class_dbh_m(SizeClass::Middle),
                trees_per_ha: 300.0,
                species: s,
            })
            .collect(),
        individuals_per_species: 6,
        stand,
        // The thinnest stems count as trunk too, so that the calipers find them.
        trunk_radius_m: 0.02,
        textures: false,
        ..AssetParams::default()
    };
    Library::grow(&params, Key::world(11)).expect("the default grows")
});

#[test]
fn all_species_and_size_classes_are_measured() {
    for name in Species::names() {
        for class in [SizeClass::Young, SizeClass::Middle, SizeClass::Mature] {
            let there = |t: &&TreeAsset| t.species == name && t.class == class;
            assert!(
                LIBRARY.trees.iter().any(|t| there(&t)),
                "no {} {name}",
                class.name()
            );
        }
    }
}

/// The highest point of wood, or of a texel of a card that can be hit.
fn height_m(tree: &TreeAsset, materials: &MaterialLibrary) -> f64 {
    let wood = tree.prototype.mesh().positions.iter();
    let mut top_m = wood.fold(0.0, |m, p| f64::max(m, f64::from(p.z)));
    for card in tree.prototype.cards() {
        if card.corners().iter().all(|c| f64::from(c.z) <= top_m) {
            continue;
        }
        let material = materials.get(card.material);
        let mask = material.mask.as_deref().expect("leaves are cut out");
        let (columns, rows) = (mask.width(), mask.height());
        for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
            let u = (column as f32 + 0.5) / columns as f32;
            let v = (row as f32 + 0.5) / rows as f32;
            if mask.is_opaque(u, v) {
                let z = card.corner.z + u * card.edge_u.z + v * card.edge_v.z;
                top_m = top_m.max(f64::from(z));
            }
        }
    }
    top_m
}

/// The points where edges of the stem cross breast height, seen from above.
fn slice(tree: &TreeAsset, materials: &MaterialLibrary) -> Vec<DVec2> {
    let mesh = tree.prototype.mesh();
    let mut points = Vec::new();
    for triangle in &mesh.triangles {
        let semantic = materials.get(triangle.material).semantic;
        if ![Semantic::Stem, Semantic::RootFlare].contains(&semantic) {
            continue;
        }
        let p: [DVec3; 3] = triangle
            .corners
            .map(|c| mesh.positions[c as usize].as_dvec3());
        for k in 0..3 {
            let (a, b) = (p[k], p[(k + 1) % 3]);
            if (a.z < BREAST_M) != (b.z < BREAST_M) {
                points.push(a.lerp(b, (BREAST_M - a.z) / (b.z - a.z)).truncate());
            }
        }
    }
    points
}

/// The girth around the slice over pi. A diameter tape is taut, so it lies on the convex hull.
fn tape_m(mut points: Vec<DVec2>) -> f64 {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut hull: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = hull[..]
                && (b - a).perp_dot(p - b) <= 0.0
            {
                hull.pop();
            }
            hull.push(p);
        }
        hull
    };
    let lower = half(&mut points.iter().copied());
    let upper = half(&mut points.iter().rev().copied());
    let ring: Vec<DVec2> = [&lower[..lower.len() - 1], &upper[..upper.len() - 1]].concat();
    let girth = |i: usize| ring[i].distance(ring[(i + 1) % ring.len()]);
    (0..ring.len()).map(girth).sum::<f64>() / PI
}

#[test]
fn a_tape_around_a_ring_reads_its_diameter() {
    let ring = (0..64).map(|i| {
        let a = 2.0 * PI * f64::from(i) / 64.0;
        DVec2::new(3.0 + 0.2 * a.cos(), 0.2 * a.sin())
    });
    let read = tape_m(ring.collect());
    assert!((read / 0.4 - 1.0).abs() < 1e-3, "{read}");
}

/// The largest relative error, and a line that describes it.
fn worst(
    written: impl Fn(&TreeAsset) -> f64,
    measured: impl Fn(&TreeAsset) -> f64,
) -> (f64, String) {
    let off = LIBRARY.trees.iter().map(|tree| {
        let (says, is) = (written(tree), measured(tree));
        let line = format!("{}: {is:.4} m for {says:.4} m", tree.prototype.name());
        ((is / says - 1.0).abs(), line)
    });
    off.max_by(|a, b| a.0.total_cmp(&b.0))
        .expect("it has trees")
}

#[test]
fn heights_are_within_one_per_cent_of_what_is_written() {
    let (off, line) = worst(|t| t.size.height_m, |t| height_m(t, &LIBRARY.materials));
    assert!(off < 0.01, "{line}");
}

#[test]
fn diameters_are_within_two_per_cent_of_what_is_written() {
    let (off, line) = worst(|t| t.size.dbh_m, |t| tape_m(slice(t, &LIBRARY.materials)));
    assert!(off < 0.02, "{line}");
}

/// The area of all texels of leaves that can be hit, by counting them, m².
fn opaque_leaf_m2(tree: &TreeAsset, materials: &MaterialLibrary) -> f64 {
    let opaque = |card: &Card| {
        let material = materials.get(card.material);
        let mask = material.mask.as_deref().expect("leaves are cut out");
        let (columns, rows) = (mask.width(), mask.height());
        let all = (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c)));
        let hit = all.filter(|&(r, c)| {
            let u = (c as f32 + 0.5) / columns as f32;
            mask.is_opaque(u, (r as f32 + 0.5) / rows as f32)
        });
        hit.count() as f64 / (columns * rows) as f64
    };
    let mut shares = BTreeMap::new();
    let cards = tree.prototype.cards().iter();
    cards
        .map(|card| {
            let share = *shares.entry(card.material).or_insert_with(|| opaque(card));
            share * f64::from(card.edge_u.cross(card.edge_v).length())
        })
        .sum()
}

#[test]
fn what_can_be_hit_is_the_silhouette_of_the_leaf_area() {
    for tree in &LIBRARY.trees {
        let species = Species::built_in(&tree.species).expect("a built-in species");
        let demanded = species.foliage.silhouette_factor * tree.size.leaf_area_m2;
        let share = opaque_leaf_m2(tree, &LIBRARY.materials) / demanded;
        let name = tree.prototype.name();
        assert!(
            (share - 1.0).abs() < 0.05,
            "{name}: {share:.3} of {demanded:.1} m²"
        );
    }
}
