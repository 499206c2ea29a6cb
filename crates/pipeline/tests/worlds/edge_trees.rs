//! Trees at the edges of meadows: they are the wood's own, and their crowns face the open.

use std::sync::Arc;

use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_realism::World;
use nemoral_scene::{ChunkCoord, ObjectKind};
use nemoral_stand::SceneObject;

/// A world of few plants and many edges.
fn world(settings: &[&str]) -> World {
    let few = [
        "assets.individuals=1",
        "trails.spawn_probability=0",
        "placement.meadows.scale_m=90",
    ];
    World::without_cameras("meadow-edge", &[&few, settings].concat())
}

fn chunks() -> impl Iterator<Item = ChunkCoord> {
    (0..25).map(|i| ChunkCoord::new(i % 5, i / 5))
}

fn assets(world: &World) -> Arc<WorldAssets> {
    let assets = world.runner(2).get(world.forest.assets, ());
    assets.expect("assets")
}

/// The trees of a chunk that are no saplings.
fn trees(world: &World, assets: &WorldAssets, at: ChunkCoord) -> Vec<SceneObject> {
    let objects = world.runner(2).get(world.forest.objects, at);
    let objects = objects.expect("objects").0.clone().into_iter();
    objects
        .filter(|o| o.kind == ObjectKind::Tree && o.asset < assets.first_sapling)
        .collect()
}

/// Whether a tree is one of the edge's.
fn is_of_edge(tree: &SceneObject, assets: &WorldAssets) -> bool {
    let tree = &assets.standing[tree.asset].tree;
    tree.prototype.name().contains(".edge.")
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn trees_at_meadows_face_the_open() {
    let world = world(&["placement.meadows.edge_trees=1"]);
    let (runner, assets) = (world.runner(2), assets(&world));
    let (mut near, mut of_edge, mut faces, mut inside) = (0, 0, 0, 0);
    for at in chunks() {
        let ground = runner.get(world.forest.ground, at).expect("ground");
        for tree in trees(&world, &assets, at) {
            let p = tree.position_m.truncate();
            let open_m = ground.open_m(p);
            if open_m < -9.0 {
                inside += 1;
                assert!(!is_of_edge(&tree, &assets), "{p}: {open_m}");
            }
            if open_m > -4.0 && assets.standing[tree.asset].tree.alive {
                near += 1;
                assert!(is_of_edge(&tree, &assets), "{p}: {open_m}");
            }
            if is_of_edge(&tree, &assets) {
                of_edge += 1;
                let ahead = tree.linear.x_axis.truncate().as_dvec2().normalize();
                let [ahead_m, behind_m] = [5.0, -5.0].map(|m| ground.open_m(p + m * ahead));
                faces += i32::from(ahead_m > behind_m);
            }
        }
    }
    println!(
        "{near} trees near the edge, {of_edge} grew there, {faces} face the open; {inside} inside"
    );
    assert!(near > 50 && of_edge > near && inside > 50);
    assert!(faces * 10 > of_edge * 9, "{faces} of {of_edge}");
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn how_many_grew_there_changes_no_place() {
    let [none, some] =
        ["0", "0.5"].map(|share| world(&[&format!("placement.meadows.edge_trees={share}")]));
    let [of_none, of_some] = [&none, &some].map(assets);
    assert_eq!(of_some.library.trees.len(), 2 * of_none.library.trees.len());
    let (mut count, mut of_edge) = (0, 0);
    for at in chunks() {
        let [a, b] = [trees(&none, &of_none, at), trees(&some, &of_some, at)];
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(&b) {
            assert_eq!(a.position_m, b.position_m);
            let [species, other] = [(a, &of_none), (b, &of_some)]
                .map(|(tree, assets)| assets.standing[tree.asset].tree.species.clone());
            assert_eq!(species, other);
            assert!(!is_of_edge(a, &of_none));
            count += 1;
            of_edge += i32::from(is_of_edge(b, &of_some));
        }
    }
    println!("{of_edge} of {count}");
    assert!(of_edge > 10 && of_edge * 2 < count);
}

#[test]
fn woods_without_meadows_grow_none() {
    let forest = World::without_cameras("oak-mixed", &["assets.individuals=1"]);
    let trees = &assets(&forest).library.trees;
    assert_eq!(trees.len(), assets(&forest).shares.len());
}
