//! The same world in summer and in winter: nothing grows or stands elsewhere, and what leaves hid
//! is seen.

use std::sync::Arc;

use nemoral_pipeline::plan::Node;
use nemoral_realism::World;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, LidarPoint, Semantic};
use nemoral_stand::SkyViewFactor;

const AT: ChunkCoord = ChunkCoord { x: 0, y: 0 };

/// A beech stand of few individuals on a day; high summer on day 0.
fn world(day: u32) -> World {
    let day = format!("season.day_of_year={day}");
    let few = [
        "assets.individuals=2",
        "chunks.visible_radius_m=150",
        "chunks.delete_radius_m=250",
        &day,
    ];
    World::without_cameras("beech", &few)
}

/// The mean of a sky view factor 1.5 m above the ground of the chunk.
fn open(world: &World, node: Node<ChunkCoord, SkyViewFactor>) -> f64 {
    let runner = world.runner(2);
    let factor = runner.get(node, AT).expect("a sky view factor");
    let ground = runner.get(world.forest.ground, AT).expect("a ground");
    // Half a metre above snow of its greatest depth.
    let place = |i: i32| DVec2::new(f64::from(i % 10) * 5.0 + 2.5, f64::from(i / 10) * 5.0 + 2.5);
    let at = |p: DVec2| -> DVec3 {
        let height_m = nemoral_scene::Surface::height_m(&*ground, p);
        p.extend(height_m + 1.5)
    };
    let sum: f64 = (0..100).map(|i| f64::from(factor.at(at(place(i))))).sum();
    sum / 100.0
}

/// What grows, stands and lies in the chunk, in full.
fn grown(world: &World) -> String {
    let (runner, f) = (world.runner(2), &world.forest);
    let low = runner.get(f.undergrowth, AT).expect("low plants");
    let young = runner.get(f.seedlings, AT).expect("seedlings");
    let objects = runner.get(f.objects, AT).expect("objects");
    let litter = runner.get(f.litter, AT).expect("litter");
    format!("{low:?} {young:?} {objects:?} {litter:?}")
}

/// The points of the LiDAR at frame 0.
fn scan(world: &World) -> Arc<Vec<Vec<LidarPoint>>> {
    let scans = world.runner(2).get(world.forest.scans, 0);
    scans.expect("a scan")
}

/// The share of points that are leaves of trees.
fn leaves(points: &[LidarPoint]) -> f64 {
    let leaves = points.iter().filter(|p| p.semantic == Semantic::Leaf);
    leaves.count() as f64 / points.len() as f64
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn winter_takes_leaves_and_moves_nothing() {
    let [summer, autumn, winter] = [0, 303, 20].map(world);
    let of_summer = grown(&summer);
    for world in [&autumn, &winter] {
        assert!(
            grown(world) == of_summer,
            "something stands or grows elsewhere"
        );
        let near_ground = |world: &World| open(world, world.forest.ground_sky_view_factor);
        let difference = near_ground(&summer) - near_ground(world);
        assert_eq!(difference, 0.0, "plants grow in another light");
    }
    let light = |world: &World| open(world, world.forest.sky_view_factor);
    let [s, a, w] = [&summer, &autumn, &winter].map(light);
    println!("open sky: summer {s:.2}, autumn {a:.2}, winter {w:.2}");
    assert!(s < a && a < w && w > s + 0.2, "{s} {a} {w}");
    let [s, a, w] = [&summer, &autumn, &winter].map(|world| leaves(&scan(world)[0]));
    println!("points on leaves: summer {s:.3}, autumn {a:.3}, winter {w:.3}");
    assert!(s > 0.1 && a < s && w < 0.2 * s, "{s} {a} {w}");
}

#[test]
fn wet_weather_changes_materials_alone() {
    let rain = |wetness: &str| {
        let settings = ["assets.individuals=1", "weather.rain_mm_per_h=0", wetness];
        World::without_cameras("demo", &settings)
    };
    let (dry, wet) = (rain("weather.wetness=0"), rain("weather.wetness=1"));
    let materials = |world: &World| world.runner(2).get(world.forest.materials, ());
    let (a, b) = (
        materials(&dry).expect("materials"),
        materials(&wet).expect("materials"),
    );
    let darker = a.materials().iter().zip(b.materials()).filter(|(a, b)| {
        assert_eq!((&a.name, a.semantic), (&b.name, b.semantic));
        b.albedo.mean().y < a.albedo.mean().y
    });
    assert!(darker.count() > a.materials().len() / 2);
    let plan = |world: &World| world.forest.plan().key(world.forest.object_geometry, AT);
    assert_eq!(plan(&dry), plan(&wet), "nothing grows anew");
    let (a, b) = (scan(&dry), scan(&wet));
    let weaker = a[0]
        .iter()
        .zip(&b[0])
        .filter(|(a, b)| b.intensity < a.intensity);
    assert!(weaker.count() > a[0].len() / 3);
}

/// Snow lies on the mesh of the ground, as deep as it should, and chunks meet without a gap.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn snow_raises_the_ground_and_hides_litter() {
    let world = |depth: &str| {
        let settings = [
            "assets.individuals=1",
            "placement.shrubs=0",
            "trails.spawn_probability=0.4",
            "weather.wetness=1",
            depth,
        ];
        World::without_cameras("meadow-edge", &settings)
    };
    let bare = world("weather.snow_depth_m=0");
    let snowy = world("weather.snow_depth_m=0.6");
    assert!(grown(&bare) == grown(&snowy), "snow moves what grows");
    let light = |world: &World| open(world, world.forest.sky_view_factor);
    let (above_ground, above_snow) = (light(&bare), light(&snowy));
    println!("open sky {above_ground:.3}, over snow {above_snow:.3}");
    assert!((above_snow - above_ground).abs() < 0.05);
    let materials = snowy
        .runner(2)
        .get(snowy.forest.materials, ())
        .expect("materials");
    let covers = materials
        .materials()
        .iter()
        .filter(|m| m.name.ends_with(".snow"));
    assert!(covers.clone().count() > 10);
    for cover in covers {
        assert_eq!(
            cover.optics.nm905.reflectance, 0.81,
            "{} is wet",
            cover.name
        );
    }
    let ground = |world: &World, at: ChunkCoord| {
        let solid = world.runner(2).get(world.forest.object_geometry, at);
        Arc::clone(solid.expect("a chunk").group.instances()[0].1.prototype())
    };
    let assets = snowy
        .runner(2)
        .get(snowy.forest.assets, ())
        .expect("assets");
    let (mut depths, mut on_trails) = (Vec::new(), Vec::new());
    for at in (0..4).map(|i| ChunkCoord::new(i % 2, i / 2)) {
        let snow = ground(&snowy, at);
        let surface = snowy
            .runner(2)
            .get(snowy.forest.ground, at)
            .expect("a ground");
        for t in &snow.mesh().triangles {
            let corners = t
                .corners
                .map(|i| snow.mesh().positions[i as usize].as_dvec3());
            let middle = corners.into_iter().sum::<DVec3>() / 3.0;
            let p = at.origin_m(50.0) + middle.truncate();
            let depth_m = middle.z - nemoral_scene::Surface::height_m(&*surface, p);
            match assets.library.materials.get(t.material) {
                m if m.semantic == Semantic::Snow => depths.push(depth_m),
                m if m.name.ends_with(".snow") => on_trails.push(depth_m),
                _ => {}
            }
        }
        let litter = snowy.runner(2).get(snowy.forest.litter_geometry, at);
        assert!(
            litter.expect("litter").0.is_none(),
            "litter lies on the snow"
        );
    }
    let litter = snowy.runner(2).get(snowy.forest.litter, AT);
    assert!(!litter.expect("litter").is_empty(), "there is some below");
    let range = |depths: &mut Vec<f64>| {
        depths.sort_unstable_by(f64::total_cmp);
        [0.02, 0.5, 0.98].map(|q| depths[(q * depths.len() as f64) as usize])
    };
    let [low, middle, high] = range(&mut depths);
    println!("snow: {low:.3} {middle:.3} {high:.3} m");
    assert!((0.2..0.62).contains(&middle) && high < 0.75 && low > -0.05);
    let [_, trodden, _] = range(&mut on_trails);
    println!("on trails {trodden:.3} m");
    assert!(on_trails.len() > 100 && trodden < 0.7 * middle, "{trodden}");
    // The vertices on the border of two chunks are the same points.
    let border = |at: ChunkCoord, x: f32| {
        let snow = ground(&snowy, at);
        let on = snow
            .mesh()
            .positions
            .iter()
            .filter(|p| (p.x - x).abs() < 1e-4);
        let mut on: Vec<(u32, u32)> = on.map(|p| (p.y.to_bits(), p.z.to_bits())).collect();
        on.sort_unstable();
        on.dedup();
        on
    };
    let (west, east) = (border(AT, 50.0), border(ChunkCoord::new(1, 0), 0.0));
    assert!(west.len() > 20 && west == east);
}
