//! Every species in all the forms that a forest contains: individuals of three size classes,
//! saplings, standing dead trees, and dead branches below the crown if the species keeps them.

use super::*;
use crate::common::{DEAD, corners, key, materials};
use nemoral_assets::{GrownTree, GrowthParams, SizeClass, TreeAsset, TreeSize, grow};
use nemoral_scene::Semantic;

/// One species as foresters know it.
struct Expected {
    name: &'static str,
    /// Diameters from which it is middle-aged and mature, metres.
    classes_m: [f64; 2],
    /// Whether dead branches stay on the stem for years, as on conifers.
    keeps_dead_branches: bool,
}

const fn of(name: &'static str, classes_m: [f64; 2], keeps_dead_branches: bool) -> Expected {
    Expected {
        name,
        classes_m,
        keeps_dead_branches,
    }
}

const ALL: [Expected; 9] = [
    of("maritime_pine", [0.18, 0.34], true),
    of("eucalyptus", [0.12, 0.24], false),
    of("english_oak", [0.22, 0.45], false),
    of("scots_pine", [0.16, 0.30], true),
    of("norway_spruce", [0.16, 0.32], true),
    of("douglas_fir", [0.20, 0.42], true),
    of("cork_oak", [0.25, 0.45], false),
    of("beech", [0.20, 0.38], false),
    of("silver_birch", [0.13, 0.24], false),
];

fn expected() -> impl Iterator<Item = (&'static Expected, Species)> {
    assert!(ALL.iter().map(|e| e.name).eq(Species::names()));
    ALL.iter().zip(Species::all())
}

fn grown(species: &Species, size: &TreeSize, params: &GrowthParams, i: u64) -> GrownTree {
    let tree = grow(species, size, &materials(), params, key(i));
    tree.unwrap_or_else(|e| panic!("{}: {e}", species.name))
}

/// Eight individuals of an uneven-aged stand, the fewest that a preset grows: all are different,
/// and they are of three classes.
#[test]
fn eight_individuals_of_three_classes() {
    let params = GrowthParams {
        wood_triangles_max: 3_000,
        cards_max: 200,
        ..GrowthParams::default()
    };
    for (e, species) in expected() {
        let [middle_m, mature_m] = e.classes_m;
        let mut found = [0; 3];
        let mut trees: Vec<GrownTree> = Vec::new();
        for i in 0..8 {
            let limits = [0.07, 1.0];
            let dbh_m = species.dbh_of_individual(mature_m, 1.7, limits, [i, 8], key(5));
            let tree = grown(&species, &species.draw_size(dbh_m, key(5)), &params, 5);
            let (wanted, class) = if dbh_m < middle_m {
                (SizeClass::Young, 0)
            } else if dbh_m < mature_m {
                (SizeClass::Middle, 1)
            } else {
                (SizeClass::Mature, 2)
            };
            assert_eq!(species.size_class(dbh_m), wanted, "{} {dbh_m}", e.name);
            found[class] += 1;
            assert!(tree.alive && !tree.cards.is_empty());
            for other in &trees {
                let taller = tree.size.height_m / other.size.height_m;
                let thicker = tree.size.dbh_m / other.size.dbh_m;
                assert!(taller > 1.0 && thicker > 1.02, "{}: {thicker}", e.name);
                assert!(tree.mesh.positions != other.mesh.positions);
            }
            trees.push(tree);
        }
        assert!(found.iter().all(|n| *n > 0), "{}: {found:?}", e.name);
    }
}

fn one_of<'a>(trees: &'a [TreeAsset], name: &str) -> impl Iterator<Item = &'a TreeAsset> {
    trees.iter().filter(move |t| t.species == name)
}

/// The materials of a tree of the library.
fn made_of(tree: &TreeAsset) -> Vec<&'static Material> {
    let shape = &tree.prototype;
    let wood = shape.mesh().triangles.iter().map(|t| t.material);
    let mut all: Vec<_> = wood
        .chain(shape.cards().iter().map(|c| c.material))
        .collect();
    all.sort();
    all.dedup();
    all.into_iter()
        .map(|id| LIBRARY.materials.get(id))
        .collect()
}

#[test]
fn saplings_and_snags_are_of_their_species() {
    for (e, _) in expected() {
        let own = |m: &&Material| m.name.starts_with(&format!("{}.", e.name));
        assert_eq!(one_of(&LIBRARY.saplings, e.name).count(), 2, "{}", e.name);
        for sapling in one_of(&LIBRARY.saplings, e.name) {
            let size = &sapling.size;
            assert!(sapling.alive && sapling.class == SizeClass::Sapling);
            assert!((1.9..4.6).contains(&size.height_m) && size.dbh_m < e.classes_m[0]);
            let parts = made_of(sapling);
            assert!(parts.iter().all(own), "{}", e.name);
            let green = |m: &&Material| m.semantic == foliage_of(e.name);
            assert!(parts.iter().any(green), "{}: no leaves", e.name);
        }
        assert_eq!(one_of(&LIBRARY.snags, e.name).count(), 1, "{}", e.name);
        for snag in one_of(&LIBRARY.snags, e.name) {
            assert!(!snag.alive && snag.prototype.cards().is_empty());
            assert!(snag.size.leaf_area_m2 == 0.0 && snag.size.height_m > 1.9);
            let parts = made_of(snag);
            assert!(parts.iter().all(own), "{}", e.name);
            assert!(parts.iter().any(|m| m.semantic == Semantic::Snag));
        }
    }
}

/// The semantic of its foliage: needles or leaves.
fn foliage_of(species: &str) -> Semantic {
    let needles = [
        "maritime_pine",
        "scots_pine",
        "norway_spruce",
        "douglas_fir",
    ];
    if needles.contains(&species) {
        Semantic::Needle
    } else {
        Semantic::Leaf
    }
}

/// Triangles of dead branches below the crown of a tree.
fn dead_below(species: &Species, size: &TreeSize, i: u64) -> usize {
    let tree = grown(species, size, &GrowthParams::default(), i);
    let dead = tree.mesh.triangles.iter().filter(|t| t.material == DEAD);
    let height_m = |t| corners(&tree.mesh, t).map(|p| p.z).iter().sum::<f64>() / 3.0;
    dead.filter(|t| height_m(t) < size.crown_base_m).count()
}

#[test]
fn conifers_keep_dead_branches_and_broadleaves_shed_them() {
    for (e, mut species) in expected() {
        let sizes: Vec<TreeSize> = (0..4)
            .map(|i| species.draw_size(1.4 * e.classes_m[0], key(i)))
            .collect();
        let of_all = |species: &Species| -> Vec<usize> {
            let sizes = (0..).zip(&sizes);
            sizes
                .map(|(i, size)| dead_below(species, size, i))
                .collect()
        };
        let found = of_all(&species);
        let (least, sum) = (found.iter().min(), found.iter().sum::<usize>());
        // Each conifer has some; a broadleaved tree has a stub here and there.
        let sound = if e.keeps_dead_branches {
            least > Some(&200)
        } else {
            sum > 20 && found.iter().all(|n| *n < 300)
        };
        assert!(sound, "{}: {found:?} triangles of dead branches", e.name);
        species.dead.persistence = 0.0;
        assert_eq!(of_all(&species), [0; 4], "{}", e.name);
    }
}
