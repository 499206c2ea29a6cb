//! Ivy, lianas, moss and resin: on whom they are, how often, and that they hold on to something.

use std::collections::BTreeMap;

use nemoral_pipeline::config::Climbers;
use nemoral_realism::{World, config};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{ChunkCoord, Instance, ObjectId, ObjectKind};

fn world(preset: &str, settings: &[&str]) -> World {
    let few = ["assets.individuals=2", "trails.spawn_probability=0"];
    World::without_cameras(preset, &[&few, settings].concat())
}

/// What is on trees.
#[derive(Debug, Default)]
struct Found {
    trees: usize,
    /// By kind, the last word of their shapes' names but for numbers.
    climbers: BTreeMap<String, Vec<(Instance, String)>>,
}

/// What is on the trees of some chunks, each with the name of the tree's shape.
fn on_trees(world: &World, side: i32) -> Found {
    let runner = world.runner(2);
    let mut found = Found::default();
    for i in 0..side * side {
        let at = ChunkCoord::new(i % side, i / side);
        let objects = runner.get(world.forest.objects, at).expect("objects");
        found.trees += (objects.0.iter())
            .filter(|o| o.kind == ObjectKind::Tree)
            .count();
        let geometry = (runner.get(world.forest.undergrowth_geometry, at)).expect("plants");
        let instances = geometry.0.iter().flat_map(|group| group.instances());
        for (instance, _) in instances {
            let name = instance.prototype.name();
            for kind in ["ivy", "honeysuckle", "clematis", "resin", "moss"] {
                if let Some((tree, _)) = name.split_once(&format!(".{kind}")) {
                    let of = (instance.clone(), tree.to_owned());
                    found.climbers.entry(kind.to_owned()).or_default().push(of);
                }
            }
        }
    }
    found
}

impl Found {
    fn of(&self, kind: &str) -> &[(Instance, String)] {
        self.climbers.get(kind).map_or(&[], Vec::as_slice)
    }

    fn share(&self, kind: &str) -> f64 {
        self.of(kind).len() as f64 / self.trees as f64
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn as_many_trees_are_climbed_as_asked() {
    let world = world(
        "oak-mixed",
        &[
            "climbers.honeysuckle=0.3",
            "climbers.clematis=0.2",
            "climbers.ivy=0.25",
            "climbers.resin=0.5",
            "placement.regeneration.saplings=0",
            "assets.snags=0",
        ],
    );
    let found = on_trees(&world, 6);
    let share = |kind: &str| found.share(kind);
    println!(
        "{} trees: ivy on {:.3}, honeysuckle on {:.3}, clematis on {:.3}, resin on {:.3}",
        found.trees,
        share("ivy"),
        share("honeysuckle"),
        share("clematis"),
        share("resin")
    );
    assert!(found.trees > 300);
    // Patches and diameters vary; carpets of ivy are not on trees.
    assert!((0.20..0.40).contains(&share("honeysuckle")));
    assert!((0.12..0.26).contains(&share("clematis")));
    // Only conifers have resin, and they are some of the trees.
    assert!((0.01..0.25).contains(&share("resin")));
    for (_, tree) in found.of("resin") {
        assert!(tree.starts_with("scots_pine."), "{tree}");
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn resin_and_moss_are_the_trees_and_plants_are_their_own() {
    let world = world(
        "maritime-pine",
        &["climbers.moss=1", "climbers.honeysuckle=0.4"],
    );
    let found = on_trees(&world, 2);
    for (kind, is_plant) in [("resin", false), ("moss", false), ("honeysuckle", true)] {
        let all = found.of(kind);
        assert!(!all.is_empty(), "{kind}");
        for (instance, tree) in all {
            assert_eq!(instance.object.is_none(), is_plant, "{kind} of {tree}");
        }
    }
    let objects: Vec<ObjectId> = found.of("resin").iter().map(|(i, _)| i.object).collect();
    let mut once = objects.clone();
    once.sort_unstable();
    once.dedup();
    assert_eq!(once.len(), objects.len());
}

/// The middle of each card and vertex of a shape.
fn points(instance: &Instance) -> Vec<Vec3> {
    let shape = &instance.prototype;
    let cards = shape.cards().iter().map(|c| c.corner + 0.5 * c.edge_u);
    cards
        .chain(shape.mesh().positions.iter().copied())
        .collect()
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn lianas_hold_on_to_their_tree() {
    let world = world(
        "oak-mixed",
        &["climbers.honeysuckle=1", "climbers.clematis=1"],
    );
    let found = on_trees(&world, 2);
    let runner = world.runner(2);
    let assets = runner.get(world.forest.assets, ()).expect("assets");
    for kind in ["honeysuckle", "clematis"] {
        assert!(found.of(kind).len() > 3, "{kind}");
        for (instance, name) in found.of(kind) {
            let tree = (assets.standing.iter())
                .find(|s| s.tree.prototype.name() == name)
                .expect("the tree that it is on");
            let bounds = tree.tree.prototype.bounds();
            let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
            for p in points(instance) {
                (low, high) = (low.min(p.z), high.max(p.z));
                // Nothing beyond the crown but leaves that hang from its outermost twigs.
                let near = Vec3::new(0.9, 0.9, 0.5);
                let inside = p.cmpgt(bounds.min - near) & p.cmplt(bounds.max + near);
                assert!(inside.all(), "{kind} of {name}: {p} {bounds:?}");
            }
            // Rooted, and up on the stem or in the crown.
            assert!(low < -0.1 && high > 1.0, "{kind} of {name}: {low} {high}");
        }
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn more_clematis_hangs_at_meadows() {
    let world = world("meadow-edge", &["climbers.clematis=0.15"]);
    let found = on_trees(&world, 5);
    let at_edge = |name: &str| name.contains(".edge.");
    let (edge, inside): (Vec<_>, Vec<_>) = (found.of("clematis").iter())
        .map(|(_, name)| name.as_str())
        .partition(|name| at_edge(name));
    let runner = world.runner(2);
    let assets = runner.get(world.forest.assets, ()).expect("assets");
    let mut trees = [0_usize; 2];
    for i in 0..25 {
        let at = ChunkCoord::new(i % 5, i / 5);
        for o in &runner.get(world.forest.objects, at).expect("objects").0 {
            if o.kind == ObjectKind::Tree {
                let name = assets.standing[o.asset].tree.prototype.name();
                trees[usize::from(at_edge(name))] += 1;
            }
        }
    }
    let share = |n: usize, of: usize| n as f64 / of as f64;
    let [inside, edge] = [share(inside.len(), trees[0]), share(edge.len(), trees[1])];
    println!(
        "clematis on {edge:.3} of {} at meadows, {inside:.3} inside",
        trees[1]
    );
    // Within the wood, many crowns begin too high for it.
    assert!(edge > 3.0 * inside && inside > 0.005, "{edge} {inside}");
}

#[test]
fn presets_of_the_paper_have_no_lianas_and_the_demo_bare_stems() {
    for preset in ["low", "medium", "high"] {
        let of = config(preset, &[]).climbers;
        assert_eq!(
            (of.honeysuckle, of.clematis, of.resin),
            (0.0, 0.0, 0.0),
            "{preset}"
        );
        assert!(of.ivy > 0.0);
    }
    assert_eq!(config("demo", &[]).climbers, Climbers::none());
}
