//! Use of `nemoral-trails` alone: a hiking map.

use std::sync::Arc;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, FlatSurface, MaterialId, Surface};
use nemoral_seed::Key;
use nemoral_terrain::{GroundMesher, GroundZones, MeshParams, ZoneSample};
use nemoral_trails::{DressingKind, ParamError, TrailGround, TrailParams, Trails};

#[test]
fn a_trail_is_found_carved_and_dressed() -> Result<(), ParamError> {
    let slope = FlatSurface {
        height_m: 5.0,
        gradient: [0.2, 0.0].into(),
    };
    let trails = Trails::new(TrailParams::default(), 50.0, Key::world(7), Arc::new(slope))?;
    let (trail, s_m) = trails
        .nearest([0.0, 0.0].into(), 500.0)
        .expect("there are trails within 500 m");
    let middle = trail.position_m(s_m);
    let chunk = ChunkCoord::containing(middle, 50.0);
    let through = trails.in_chunk(chunk);
    assert!(through.iter().any(|t| t.id() == trail.id()));

    let ground = trails.ground_near(chunk, 5.0);
    assert!(ground.edge_m(middle) < 0.0, "on a trail");
    // In some places of the chunk the slope is unchanged, in others it is cut or filled.
    let corner = chunk.origin_m(50.0);
    let changes = (0..2500).map(|i| {
        let at = corner + DVec2::new(f64::from(i % 50), f64::from(i / 50));
        (ground.edge_m(at), ground.height_m(at) - slope.height_m(at))
    });
    let (far, near): (Vec<_>, Vec<_>) = changes.partition(|(edge_m, _)| *edge_m > 11.0);
    assert!(far.len() > 100, "{} places", far.len());
    assert!(far.iter().all(|(_, change_m)| *change_m == 0.0));
    assert!(near.iter().any(|(_, change_m)| change_m.abs() > 0.05));

    let grass = trails.dressing(chunk);
    let grass = grass.iter().filter(|d| d.kind == DressingKind::Grass);
    assert!(grass.clone().count() > 10);
    for tuft in grass {
        assert!(ground.edge_m(tuft.position_m) < 0.5, "{tuft:?}");
    }
    Ok(())
}

/// The README's adapter: the borders of a trail's parts are break-lines.
struct Borders<'a>(&'a TrailGround);

impl GroundZones for Borders<'_> {
    fn sample(&self, world_m: DVec2) -> ZoneSample {
        let border_m = self.0.border_m(world_m);
        let is_fine = border_m < self.0.fine_m();
        ZoneSample {
            // In rounded corners it changes by up to 1.42 per metre, and a mesh relies on 1.1.
            edge_m: border_m / 1.3,
            detail_m: if is_fine { 0.0 } else { f64::INFINITY },
        }
    }
}

#[test]
fn its_ground_is_meshed_along_its_borders() -> Result<(), ParamError> {
    let flat = Arc::new(FlatSurface::default());
    let trails = Trails::new(TrailParams::default(), 50.0, Key::world(7), flat)?;
    let (trail, s_m) = trails
        .nearest([0.0, 0.0].into(), 500.0)
        .expect("there are trails within 500 m");
    let chunk = ChunkCoord::containing(trail.position_m(s_m), 50.0);
    let ground = trails.ground_near(chunk, 5.0);
    let mesher = GroundMesher::new(MeshParams {
        chunk_size_m: 50.0,
        ..MeshParams::default()
    })?;
    let mesh = mesher.mesh(chunk, &ground, &Borders(&ground), &|_, _| MaterialId(0));
    let places = mesh.positions.iter().map(|p| p.truncate().as_dvec2());
    let on_borders = places.filter(|p| ground.border_m(chunk.origin_m(50.0) + *p).abs() < 5e-3);
    let count = on_borders.count();
    assert!(count > 100, "{count} vertices");
    Ok(())
}
