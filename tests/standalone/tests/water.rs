//! nemoral-water alone: a pond in a plain.

use std::sync::Arc;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, FlatSurface, MaterialId, Surface, SurfaceSample};
use nemoral_seed::Key;
use nemoral_water::{GroundWithoutWays, Puddle, PuddleSite, Water, WaterParams};

#[test]
fn a_plain_with_ponds() {
    let plain = FlatSurface {
        height_m: 3.0,
        gradient: DVec2::ZERO,
    };
    let params = WaterParams {
        ponds: 0.02,
        ..WaterParams::default()
    };
    let ways = Arc::new(GroundWithoutWays(plain));
    let water = Water::new(params, 40.0, Key::world(1), Arc::new(plain), ways).expect("valid");
    let near = ChunkCoord::new(0, 0).square(3).map(|c| water.near(c, 0.0));
    let near = near
        .into_iter()
        .find(|near| near.ponds().next().is_some())
        .expect("a pond");
    let pond = near.ponds().next().expect("a pond");
    let middle = pond.middle_m();
    let bed = near.carve(middle, plain.sample(middle));
    assert!(bed.height_m < pond.level_m() && pond.level_m() < 3.0);
    let mesh = near.surface_mesh(&plain, &|_| MaterialId(0));
    assert_eq!(mesh.positions.len(), mesh.uvs.len());
}

#[test]
fn a_puddle_of_ones_own() {
    let flat = FlatSurface::default();
    let site = PuddleSite {
        middle_m: DVec2::new(1.0, 2.0),
        along: DVec2::X,
        half_m: [1.0, 0.4],
        depth_m: 0.06,
        key: Key::world(3),
    };
    let puddle = Puddle::dig(site, &flat).expect("it is level");
    let mut bottom: SurfaceSample = flat.sample(site.middle_m);
    puddle.carve(site.middle_m, &mut bottom);
    assert!((bottom.height_m + 0.06).abs() < 1e-12 && puddle.level_m() < 0.0);
}
