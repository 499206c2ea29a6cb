//! This crate makes endless terrain, and the one watertight ground mesh of each chunk.
//!
//! ```
//! use nemoral_scene::{ChunkCoord, MaterialId, Surface};
//! use nemoral_seed::Key;
//! use nemoral_terrain::{GroundMesher, MeshParams, NoZones, NoiseTerrain, TerrainParams};
//!
//! let params = TerrainParams {
//!     octaves: 5,
//!     scale_m: 80.0,
//!     lacunarity: 2.0,
//!     persistence: 0.4,
//!     max_height_m: 20.0,
//! };
//! let terrain = NoiseTerrain::new(params, Key::world(7))?;
//! let ground = terrain.sample([12.5, -80.0].into());
//! assert!((0.0..=20.0).contains(&ground.height_m));
//! let mesher = GroundMesher::new(MeshParams::default())?;
//! let mesh = mesher.mesh(ChunkCoord::new(0, -2), &terrain, &NoZones, &|_, _| MaterialId(0));
//! assert!(mesh.triangles.len() > 5000);
//! # Ok::<(), nemoral_terrain::ParamError>(())
//! ```
//!
//! # Terrain
//! [`NoiseTerrain`] sums octaves of gradient noise, controlled by the five parameters of Nunes,
//! Ferreira and Peixoto (section IV-B): number of octaves, scale, lacunarity, persistence and
//! maximum height. It is a pure function of the world position, so chunks have no seams, and its
//! gradient is exact. We differ from the paper in normalising by variance and squashing smoothly:
//! heights are always in range, use most of it, are never cut off, and roughness rises with
//! persistence and lacunarity. [`PerlinTerrain`] is the same on the `noise` crate's generator.
//! Other grounds implement [`Surface`](nemoral_scene::Surface).
//! [`HeightField`] lays measured heights over any of them, exact at every post.
//!
//! [`NoiseTerrain::shaped`] has ridges, winding valleys and terraces besides, and
//! [`ErodedSurface`] carves gullies into any ground, along its slopes. Both are functions of the
//! position alone, with exact gradients.
//!
//! # Mesh
//! [`GroundMesher`] turns any `Surface` into triangles. It follows break-lines, the zero contour of
//! a [`GroundZones`]' signed distance, with edges of the mesh, so that a class border is where it
//! is and no two surfaces overlap. The error against a contour of curvature radius r is at most
//! `fine_cell_m`² / (4 r) (1.6 cm for 0.25 m and 1 m), plus 1 mm. Colours have no such borders: a
//! [`Blend`](nemoral_scene::Blend) says how each triangle's colour blends into those of its
//! neighbours.
//!
//! All lengths are metres, z is up.

mod erosion;
mod gradient_noise;
mod height_field;
mod lattice;
mod mesher;
mod noise_terrain;
mod octave;
mod params;
mod perlin;
mod relief;
mod terraces;
mod zones;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

pub use erosion::{ErodedSurface, ErosionParams};
pub use height_field::{HeightField, HeightPosts};
pub use mesher::{GroundMesher, MeshParams};
pub use nemoral_scene::ParamError;
pub use noise_terrain::NoiseTerrain;
pub use params::TerrainParams;
pub use perlin::PerlinTerrain;
pub use relief::ReliefParams;
pub use zones::{GroundZones, NoZones, ZoneSample};
