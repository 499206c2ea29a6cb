//! The light that plants, stems and logs leave to the ground around them.

use nemoral_realism::World;
use nemoral_render::SkyVisibility;
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{ChunkCoord, ObjectKind};
use nemoral_stand::GroundOcclusion;

const AT: ChunkCoord = ChunkCoord { x: 0, y: 0 };

fn world(settings: &[&str]) -> World {
    let few = ["assets.individuals=1", "chunks.visible_radius_m=100"];
    let all = [&few, settings].concat();
    World::without_cameras("beech", &all)
}

fn map(world: &World) -> GroundOcclusion {
    let map = world.runner(2).get(world.forest.ground_occlusion, AT);
    map.expect("a map")
        .as_ref()
        .clone()
        .expect("something stands")
}

/// The mean share over the chunk.
fn mean(map: &GroundOcclusion) -> f32 {
    let places = (0..2500).map(|i| DVec2::new(f64::from(i % 50), f64::from(i / 50)) + 0.5);
    places.map(|p| map.at(p)).sum::<f32>() / 2500.0
}

#[test]
fn what_stands_and_lies_shades_the_ground_beside_it() {
    let world = world(&[]);
    let map = map(&world);
    let mean = mean(&map);
    let objects = world
        .runner(2)
        .get(world.forest.objects, AT)
        .expect("objects");
    let beside = |kind: ObjectKind, off_m: f64| {
        let of_kind = objects.0.iter().filter(|object| object.kind == kind);
        let shares: Vec<f32> = of_kind
            .flat_map(|object| {
                let way_m = DVec2::X * (object.radius_m + off_m);
                let foot_m = object.position_m.truncate();
                [foot_m + way_m, foot_m - way_m].map(|p| map.at(p))
            })
            .collect();
        assert!(!shares.is_empty(), "no {kind:?}");
        shares.iter().sum::<f32>() / shares.len() as f32
    };
    let [at_stems, farther] = [0.05, 1.2].map(|off_m| beside(ObjectKind::Tree, off_m));
    println!("mean {mean:.2}, at stems {at_stems:.2}, farther {farther:.2}");
    assert!((0.5..0.97).contains(&mean), "{mean}");
    assert!(
        at_stems < 0.85 * mean && farther > 0.9 * mean,
        "{at_stems} {farther}"
    );
    let logs = objects
        .0
        .iter()
        .filter(|object| object.kind == ObjectKind::Log);
    let under: Vec<f32> = logs.map(|log| map.at(log.position_m.truncate())).collect();
    let dark = under.iter().filter(|&&share| share < 0.6).count();
    println!("under logs: {under:.2?}");
    assert!(!under.is_empty() && 2 * dark >= under.len(), "{under:?}");
}

#[test]
fn it_goes_on_from_chunk_to_chunk() {
    let world = world(&["chunks.undergrowth_radius_m=60"]);
    let runner = world.runner(2);
    let corner_m = DVec2::splat(50.0);
    let scene = world.forest.scene_around(&runner, corner_m, 60.0, true);
    let scene = scene.expect("a scene");
    let origin_m = scene.origin_m.truncate();
    let share = |world_m: DVec2| {
        let point = (world_m - origin_m).as_vec2().extend(0.0);
        scene.ground_occlusion(point)
    };
    let (mut shaded, mut most) = (0, 0.0_f32);
    for i in 0..200 {
        let along_m = 40.0 + 0.1 * f64::from(i);
        for (before, after) in [
            (DVec2::new(49.995, along_m), DVec2::new(50.005, along_m)),
            (DVec2::new(along_m, 49.995), DVec2::new(along_m, 50.005)),
        ] {
            let (before, after) = (share(before), share(after));
            most = most.max((before - after).abs());
            shaded += usize::from(before < 0.9);
        }
    }
    println!("{shaded} of 400 places are shaded, and differ by {most:.3} at most");
    assert!(shaded > 40 && most < 0.05, "{shaded} {most}");
    assert_eq!(scene.ground_occlusion(Vec3::new(1e4, 0.0, 0.0)), 1.0);
}

#[test]
fn snow_buries_what_shades() {
    let [bare, deep] = ["weather.snow_depth_m=0", "weather.snow_depth_m=0.5"];
    let [bare, deep] = [bare, deep].map(|snow| mean(&map(&world(&[snow]))));
    println!("bare {bare:.3}, snow {deep:.3}");
    assert!(deep > bare + 0.02, "{bare} {deep}");
}
