//! This crate is the vocabulary that all nemoral crates share: chunks, surfaces, meshes, materials,
//! ids, classes, rays, cameras and point clouds. It holds data and its invariants, no algorithms.
//!
//! # Conventions, said once
//! - **World:** right-handed, metres, **z up**, x east, y north (REP-103, ENU). The ground plane
//!   that the paper calls X and Z is our x and y.
//! - **Sensors:** LiDAR and body frames have x forward, y left, z up; a camera's optical frame has
//!   x right, y down, z forward. A transform that takes points of frame `a` to frame `b` is called
//!   `b_from_a`.
//! - **Units** are in names (`_m`, `_rad`) or in types. World positions are f64; geometry is f32,
//!   local to a chunk or to a frame's scene.
//! - **A frame's scene** has its origin at the south-west corner of the robot's chunk, at height 0.
//! - **Every surface has one fine [`Semantic`]**; what is written to disk is an [`Ontology`]'s
//!   view.
//!
//! # Example
//! ```
//! use nemoral_scene::{ChunkCoord, ObjectId, Ontology, Semantic};
//!
//! let chunk = ChunkCoord::containing([-12.0, 130.0].into(), 50.0);
//! assert_eq!(chunk, ChunkCoord::new(-1, 2));
//! let tree = ObjectId::new(chunk, 17).expect("in range");
//! assert_eq!((tree.chunk(), tree.item()), (chunk, 17));
//! let paper = Ontology::paper();
//! assert_eq!(paper.class(Semantic::RootFlare).name, "Trunks");
//! ```

mod ambient_occlusion;
mod annotations;
mod bounds;
mod camera;
mod chunk;
mod code_table;
mod deep_stack;
mod direction_cone;
mod distortion;
mod dual;
mod echo;
mod excerpt;
mod hit;
mod hydrometeor;
mod image;
mod instance;
mod instanced_scene;
mod inventory;
mod mask;
mod material;
mod mesh;
mod motion;
mod object;
mod ontology;
mod optics;
mod param_error;
mod plant_community;
mod points;
mod prototype;
mod quad;
mod ray;
mod ray_caster;
mod semantic;
mod specular;
mod surface;
mod texture;
mod texture_window;
mod trail_surface;
mod transform;
mod visibility;

pub use ambient_occlusion::{AmbientOcclusion, Occluder};
pub use annotations::{AnnotationKinds, Annotations, Flow, ObjectBox, PixelBox};
pub use bounds::Bounds;
pub use camera::Intrinsics;
pub use chunk::ChunkCoord;
pub use code_table::CodeTable;
pub use deep_stack::on_deep_stack;
pub use direction_cone::DirectionCone;
pub use distortion::Distortion;
pub use dual::Dual;
pub use echo::EchoObservation;
pub use excerpt::excerpt;
pub use glam;
pub use hit::{Hit, Shading, SurfaceHit};
pub use hydrometeor::{Hydrometeor, SizeDistribution};
pub use image::{Image, TruthImages};
pub use instance::{Instance, InstanceError, InstancePlace};
pub use instanced_scene::{InstanceGroup, InstancedScene, PlacedGroup};
pub use inventory::{DeadwoodRecord, DecayStage, ObjectKind, ObjectRecord, TreeRecord};
pub use mask::{AlphaMask, MaskError};
pub use material::{Liquid, Material, MaterialId, MaterialLibrary};
pub use mesh::{Blend, Card, GroundMixture, Mesh, Triangle};
pub use motion::{Shutter, Twist, rotation_vector};
pub use object::ObjectId;
pub use ontology::{Class, Ontology};
pub use optics::{LaserBand, Optics};
pub use param_error::ParamError;
pub use plant_community::PlantCommunity;
pub use points::{LidarPoint, PointFlags};
pub use prototype::{Prototype, PrototypeError};
pub use quad::Quad;
pub use ray::Ray;
pub use ray_caster::RayCaster;
pub use semantic::Semantic;
pub use specular::{SPECULAR_F0, gloss, specular_reflectance};
pub use surface::{FlatSurface, Surface, SurfaceSample};
pub use texture::{Texture, TextureError};
pub use texture_window::TextureWindow;
pub use trail_surface::TrailSurfaceKind;
pub use transform::RigidTransform;
pub use visibility::{extinction_per_m, visibility_m};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
