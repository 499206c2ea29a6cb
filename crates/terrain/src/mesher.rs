//! skeleton
use glam::DVec2;
use nemoral_scene::{ChunkCoord, MaterialId, Mesh, Surface};

use crate::{GroundZones, ParamError};

/// Sizes of a ground mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshParams {
    /// Side of a chunk, metres.
    pub chunk_size_m: f64,
    /// Cell where nothing asks for more, metres.
    pub cell_m: f64,
    /// Smallest cell, metres.
    pub fine_cell_m: f64,
    /// Cells are refined where the mesh would miss the surface by more than this, metres.
    pub tolerance_m: f64,
}

impl Default for MeshParams {
    fn default() -> Self {
        Self {
            chunk_size_m: 50.0,
            cell_m: 1.0,
            fine_cell_m: 0.25,
            tolerance_m: 0.05,
        }
    }
}

/// Makes ground meshes.
#[derive(Clone, Debug)]
pub struct GroundMesher;

impl GroundMesher {
    /// New.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(_params: MeshParams) -> Result<Self, ParamError> {
        Ok(Self)
    }

    /// The mesh of a chunk.
    pub fn mesh(
        &self,
        _coord: ChunkCoord,
        _surface: &dyn Surface,
        _zones: &dyn GroundZones,
        _material: &dyn Fn(DVec2, bool) -> MaterialId,
    ) -> Mesh {
        unimplemented!("skeleton")
    }
}
