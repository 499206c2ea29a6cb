//! Meadows and clearings, and what the lie of the ground does: trees end where the wood does, a
//! mantle closes its edge, grass covers what is kept, moss is where it is wet.

use nemoral_pipeline::world::chunk_ground::ChunkGround;
use nemoral_placement::Site;
use nemoral_realism::World;
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_stand::PatchKind;

/// A world of few plants.
fn world(preset: &str, settings: &[&str]) -> World {
    World::without_cameras(
        preset,
        &[
            &["assets.individuals=1", "trails.spawn_probability=0"],
            settings,
        ]
        .concat(),
    )
}

/// Calls with the ground of each chunk of a square.
fn each_chunk(world: &World, side: i32, mut f: impl FnMut(ChunkCoord, &ChunkGround)) {
    let runner = world.runner(2);
    for i in 0..side * side {
        let at = ChunkCoord::new(i % side, i / side);
        f(at, &runner.get(world.forest.ground, at).expect("ground"));
    }
}

/// Numbers by distance from the edge of the wood, in strips of 4 m from 24 m within the wood.
#[derive(Default)]
struct Strips([f64; 12]);

impl Strips {
    fn add(&mut self, open_m: f64, number: f64) {
        let strip = open_m / 4.0 + 6.0;
        if (0.0..12.0).contains(&strip) {
            self.0[strip as usize] += number;
        }
    }

    /// Numbers on a hectare, by the areas of strips in square metres.
    fn per_hectare(&self, areas: &Self) -> [f64; 12] {
        std::array::from_fn(|i| 10_000.0 * self.0[i] / areas.0[i].max(1.0))
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_wood_ends_in_a_mantle_and_its_meadow_is_grass() {
    let world = world("meadow-edge", &[]);
    let runner = world.runner(2);
    let mut areas = Strips::default();
    let mut found: [Strips; 4] = Default::default();
    let [mut grass, mut thickets, mut others] = [(); 3].map(|()| Strips::default());
    each_chunk(&world, 9, |at, ground| {
        for i in 0..25 * 25 {
            let p = DVec2::new(f64::from(i % 25) + 0.5, f64::from(i / 25) + 0.5) * 2.0;
            areas.add(ground.open_m(at.origin_m(50.0) + p), 4.0);
        }
        let sites: Vec<Site> = runner.get(world.forest.woody, at).expect("sites").to_vec();
        for site in sites {
            found[usize::from(site.layer)].add(ground.open_m(site.position_m), 1.0);
        }
    });
    // Low plants need the light under crowns, which takes long.
    for i in 0..9 {
        let at = ChunkCoord::new(i % 3 * 3, i / 3 * 3);
        let ground = runner.get(world.forest.ground, at).expect("ground");
        let patches = runner.get(world.forest.undergrowth, at).expect("patches");
        for patch in patches.iter() {
            let open_m = ground.open_m(patch.point.position_m);
            match patch.kind {
                PatchKind::Closed(of) if of.is_grass() => grass.add(open_m, 1.0),
                PatchKind::Closed(_) => thickets.add(open_m, 1.0),
                _ => others.add(open_m, 1.0),
            }
        }
    }
    let [trees, stumps, shrubs, saplings] = found.map(|of| of.per_hectare(&areas));
    println!("trees {trees:.0?}\nshrubs {shrubs:.0?}\nsaplings {saplings:.0?}");
    println!(
        "grass {:?}\nthickets {:?}\nothers {:?}",
        grass.0, thickets.0, others.0
    );
    // Trees stand on one side only, and as densely as asked for.
    assert!(trees[7..].iter().all(|n| *n == 0.0), "{trees:?}");
    let in_wood = trees[..4].iter().sum::<f64>() / 4.0;
    assert!((150.0..290.0).contains(&in_wood), "{in_wood}");
    assert!(stumps[7..].iter().all(|n| *n == 0.0), "{stumps:?}");
    // The mantle is denser than the wood behind it, and the meadow has no woody plants.
    let mantle = |of: &[f64; 12]| (of[5] + of[6]) / (of[0] + of[1]).max(1.0);
    assert!(mantle(&shrubs) > 2.5, "{shrubs:?}");
    assert!(mantle(&saplings) > 1.5, "{saplings:?}");
    assert!(
        shrubs[10..]
            .iter()
            .chain(&saplings[10..])
            .all(|n| *n == 0.0)
    );
    // It is grass, and there are no thickets.
    let far = |of: &Strips| of.0[10..].iter().sum::<f64>();
    assert!(far(&grass) > 100.0 && far(&thickets) == 0.0);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_clearing_is_overgrown_among_stumps() {
    let world = world("rank-clearing", &[]);
    let runner = world.runner(2);
    let mut areas = [0.0; 2];
    let mut found = [[0.0; 2]; 4];
    each_chunk(&world, 8, |at, ground| {
        let side = |p: DVec2| match ground.open_m(p) {
            open_m if open_m > 6.0 => Some(1),
            open_m if open_m < -6.0 => Some(0),
            _ => None,
        };
        for i in 0..25 * 25 {
            let p = DVec2::new(f64::from(i % 25) + 0.5, f64::from(i / 25) + 0.5) * 2.0;
            if let Some(side) = side(at.origin_m(50.0) + p) {
                areas[side] += 4.0;
            }
        }
        let sites: Vec<Site> = runner.get(world.forest.woody, at).expect("sites").to_vec();
        for site in sites {
            if let Some(side) = side(site.position_m) {
                found[usize::from(site.layer)][side] += 1.0;
            }
        }
    });
    let density = found.map(|of| [0, 1].map(|i| 10_000.0 * of[i] / areas[i]));
    println!("{areas:?} {density:.0?}");
    let [trees, stumps, shrubs, saplings] = density;
    assert!(trees[0] > 150.0 && trees[1] == 0.0, "{trees:?}");
    assert!(stumps[1] > 3.0 * stumps[0], "{stumps:?}");
    assert!(shrubs[1] > 0.5 * shrubs[0], "{shrubs:?}");
    assert!(saplings[1] > 2.0 * saplings[0], "{saplings:?}");
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn plants_follow_the_lie_of_the_ground() {
    let hills = [
        "terrain.gully_depth_m=3",
        "terrain.max_height_m=40",
        "water.puddles=0",
    ];
    let world = world("oak-mixed", &hills);
    let runner = world.runner(2);
    // Of single patches: how many are ferns or herbs, and how many grass, where it is wet or dry.
    let mut counts = [[0.0; 2]; 2];
    for i in 0..16 {
        let at = ChunkCoord::new(i % 4, i / 4);
        let ground = runner.get(world.forest.ground, at).expect("ground");
        let patches = runner.get(world.forest.undergrowth, at).expect("patches");
        for patch in patches.iter() {
            let wetness = ground.conditions(patch.point.position_m).wetness;
            let side = match wetness {
                w if w > 0.3 => 1,
                w if w < -0.3 => 0,
                _ => continue,
            };
            match patch.kind {
                PatchKind::Ferns | PatchKind::Herbs => counts[side][0] += 1.0,
                PatchKind::Grass => counts[side][1] += 1.0,
                _ => {}
            }
        }
    }
    let [dry, wet] = counts.map(|[moist, grass]| moist / f64::max(grass, 1.0));
    println!("{counts:?}");
    assert!(counts.iter().flatten().all(|n| *n > 50.0), "{counts:?}");
    assert!(wet > 1.6 * dry, "{wet} {dry}");
}
