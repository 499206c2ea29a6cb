//! Use of `nemoral-stand` alone: the edge of a meadow, with a forest of uniform crowns.

use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{ChunkCoord, FlatSurface, Hit, MaterialId, ObjectKind, Ray, RayCaster};
use nemoral_seed::Key;
use nemoral_stand::{
    FloorComposition, FloorCover, InstanceVariation, ObjectSite, ObjectSize, PatchSite,
    SceneObjects, Seedlings, SkyViewArea, SkyViewFactor, Undergrowth, UndergrowthParams,
};

/// Crowns at 15 m, east of x = 25 m.
struct Crowns;

impl RayCaster for Crowns {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let distance_m = (15.0 - ray.origin.z) / ray.direction.z;
        let x = ray.origin.x + distance_m * ray.direction.x;
        let hits = x > 25.0 && ray.reaches(distance_m);
        hits.then(|| Hit::new(distance_m, Vec3::NEG_Z, MaterialId(0)))
    }
}

fn waves(p: DVec2) -> f64 {
    0.5 + 0.25 * ((p.x * 0.7).sin() + (p.y * 0.9).sin())
}

#[test]
fn more_grows_in_the_meadow() {
    let area = SkyViewArea {
        origin_m: DVec2::ZERO,
        side_m: 50.0,
        canopy_height_m: 15.0,
    };
    let sky = SkyViewFactor::measure(&area, &FlatSurface::default(), &Crowns);
    let (meadow, forest) = (DVec2::new(2.0, 25.0), DVec2::new(48.0, 25.0));
    let light = |p: DVec2| sky.at(p.extend(0.3));
    assert!(light(meadow) > 0.7 && light(forest) < 0.1);
    let even = |_: DVec2| 0.5;
    let undergrowth = Undergrowth {
        params: UndergrowthParams {
            cover: 0.9,
            litter: 0.1,
            grass: 1.0,
            herbs: 0.5,
            ferns: 0.5,
        },
        clumps: even,
        ferns: even,
    };
    let chance = |p: DVec2| undergrowth.chance(p, &PatchSite::neutral(light(p)));
    assert!(chance(meadow) > 2.0 * chance(forest));
    let seedlings = Seedlings { per_m2: 1.0 };
    assert!(seedlings.chance(true, light(meadow)) > seedlings.chance(true, light(forest)));
}

#[test]
fn a_floor_of_two_covers() {
    let floor = FloorComposition::new([1.0, 0.0, 1.0], waves).expect("shares");
    let covers: Vec<FloorCover> = (0..400)
        .map(|i| floor.cover(DVec2::new(f64::from(i % 20), f64::from(i / 20)) * 3.3, 0.0))
        .collect();
    let leaves = covers
        .iter()
        .filter(|&&c| c == FloorCover::LeafLitter)
        .count();
    assert!((120..280).contains(&leaves), "{leaves}");
    assert!(!covers.contains(&FloorCover::NeedleLitter));
}

#[test]
fn trees_with_ids_that_differ() {
    let chunk = ChunkCoord::new(2, -1);
    let site = |i: u64| ObjectSite {
        kind: ObjectKind::Tree,
        position_m: DVec2::new(101.0 + 4.0 * i as f64, -20.0),
        radius_m: 0.2,
        asset: 0,
        size: ObjectSize::Grown,
        key: Key::world(7).item(i),
        on_trail: false,
        facing_rad: None,
        lying: None,
    };
    let sites: Vec<ObjectSite> = (0..10).map(site).collect();
    let variation = InstanceVariation::new(Key::world(7));
    let ground = FlatSurface::default();
    let trees = SceneObjects::place_on_ground(chunk, &sites, &ground, &variation)
        .expect("ids")
        .0;
    for (i, a) in trees.iter().enumerate() {
        assert_eq!(a.object.chunk(), chunk);
        assert_eq!(a.position_m, DVec3::new(101.0 + 4.0 * i as f64, -20.0, 0.0));
        assert!(
            trees[..i]
                .iter()
                .all(|b| a.object != b.object && a.linear != b.linear)
        );
    }
}
