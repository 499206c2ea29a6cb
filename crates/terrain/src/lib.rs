//! This crate makes endless terrain and the one watertight ground mesh of each chunk.

mod error;
mod mesher;
mod noise_terrain;
mod params;
mod perlin;
mod zones;

pub use error::ParamError;
pub use mesher::{GroundMesher, MeshParams};
pub use noise_terrain::Terrain;
pub use params::TerrainParams;
pub use perlin::PerlinTerrain;
pub use zones::{GroundZones, NoZones, ZoneSample};
