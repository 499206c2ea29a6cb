//! Use of `nemoral-terrain` alone: ground for a game.

use std::collections::BTreeSet;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, MaterialId, Mesh, Surface, SurfaceSample};
use nemoral_seed::Key;
use nemoral_terrain::{GroundMesher, MeshParams, NoZones, NoiseTerrain, ParamError, TerrainParams};

fn mesh(x: i32, surface: &dyn Surface) -> Result<Mesh, ParamError> {
    let mesher = GroundMesher::new(MeshParams {
        chunk_size_m: 50.0,
        ..MeshParams::default()
    })?;
    let chunk = ChunkCoord::new(x, -1);
    Ok(mesher.mesh(chunk, surface, &NoZones, &|_, _| MaterialId(0)))
}

/// Northings and heights, to the bit, of the vertices at an easting.
fn border(mesh: &Mesh, x_m: f32) -> BTreeSet<[u32; 2]> {
    let there = mesh.positions.iter().filter(|p| p.x == x_m);
    there.map(|p| [p.y.to_bits(), p.z.to_bits()]).collect()
}

#[test]
fn neighbours_meet() -> Result<(), ParamError> {
    let terrain = NoiseTerrain::new(TerrainParams::default(), Key::world(7))?;
    let (west, east) = (mesh(3, &terrain)?, mesh(4, &terrain)?);
    let seam = border(&west, 50.0);
    assert!(seam.len() > 10, "{} vertices", seam.len());
    assert_eq!(seam, border(&east, 0.0));
    Ok(())
}

/// A bowl, not made of noise.
struct Bowl;

impl Surface for Bowl {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        SurfaceSample {
            height_m: world_m.length_squared() / 500.0,
            gradient: world_m / 250.0,
        }
    }
}

#[test]
fn any_surface_can_be_meshed() -> Result<(), ParamError> {
    let bowl = mesh(-2, &Bowl)?;
    assert!(!bowl.triangles.is_empty());
    for p in &bowl.positions {
        let world = DVec2::new(-100.0, -50.0) + p.truncate().as_dvec2();
        let error_m = Bowl.height_m(world) - f64::from(p.z);
        assert!(error_m.abs() < 1e-4, "{p}: {error_m}");
    }
    Ok(())
}

#[test]
fn nonsense_is_refused_by_name() {
    let params = TerrainParams {
        persistence: -1.0,
        ..TerrainParams::default()
    };
    let error = NoiseTerrain::new(params, Key::world(7)).expect_err("nonsense");
    let message = error.to_string();
    assert!(
        message.contains("persistence") && message.contains("-1"),
        "{message}"
    );
}
