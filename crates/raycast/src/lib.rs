//! This crate casts rays at scenes of instanced, alpha-masked shapes.
//!
//! It finds, for every sensor, where a ray first hits a surface whose texture is opaque there
//! (section V-B and Fig. 5 of the paper). Shapes are prepared once ([`Blas`]), placed many times
//! ([`Group`], one for a chunk), and groups are put together for a frame ([`RayScene`]).
//! [`BruteForce`] gives the same results without any acceleration, to the bit.
//!
//! ```
//! use std::sync::Arc;
//! use glam::Vec3;
//! use nemoral_raycast::{Blas, Group, RayScene};
//! use nemoral_scene::*;
//!
//! let mut materials = MaterialLibrary::new();
//! let material = materials.add(Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.2)));
//! let card = Card { corner: Vec3::ZERO, edge_u: Vec3::X, edge_v: Vec3::Y, material };
//! let prototype = Arc::new(Prototype::new("one leaf", Mesh::default(), vec![card], &materials)?);
//!
//! let blas = Arc::new(Blas::build(Arc::clone(&prototype), &materials));
//! let group = Group::build(vec![(InstancePlace::at(Vec3::Z * 2.0), blas)]);
//! let scene = RayScene::new(vec![(Vec3::ZERO, Arc::new(group))]);
//!
//! // For one shape as it is, `RayScene::of_shape(prototype, &materials)` is enough.
//! let hit = scene.closest_hit(&Ray::new(Vec3::new(0.25, 0.5, 0.0), Vec3::Z));
//! assert_eq!(hit.map(|h| h.surface.distance_m), Some(2.0));
//! # Ok::<(), PrototypeError>(())
//! ```
//!
//! # What is hit
//! - Triangles and cards are hit from both sides, borders included. A masked one is hit only where
//!   [`AlphaMask::is_opaque`](nemoral_scene::AlphaMask::is_opaque) says so at the texture
//!   coordinate of the hit. A primitive without area is never hit. Two triangles that form a leaf
//!   are one card: [`Quad`](nemoral_scene::Quad) says when, and how far its hits may be off theirs.
//! - Hits count from `t_min_m` to `t_max_m`, both included. At equal `distance_m` the lowest object
//!   id wins, then the lowest number of group, instance, primitive.
//! - No ray passes between triangles that share an edge, nor between those of neighbouring groups
//!   that share it exactly (unturned and unscaled, offsets in whole metres).
//!
//! # How
//! There are three nested trees of eight boxes a node: over groups, instances and primitives.
//! Eight-wide f32 arithmetic is only a filter, always loosened by a bound on its own rounding
//! error; whatever passes it is decided in f64, without fused operations. So a result is a function
//! of the ray and the scene alone. It does not depend on the tree, the order of the rays, the
//! threads, or the processor's instructions. (AVX2 and FMA are used where the processor has them,
//! and the same kernels over arrays elsewhere.)
//! That is so for coordinates up to ±1e9 m, which [`Prototype`](nemoral_scene::Prototype) demands
//! of shapes; [`RayScene`] says more.
//!
//! A batch ([`closest_hits`](nemoral_scene::RayCaster::closest_hits)) is sorted by direction, and
//! neighbouring rays traverse the trees above the instances together, as a beam that bounds them,
//! so half of a ray's steps are taken once for dozens of rays. Give a sensor's rays in large
//! batches.
//!
//! Trees are built by the surface area heuristic (Wald 2007, "On fast construction of SAH-based
//! bounding volume hierarchies"), improved by reinsertion (Meister and Bittner 2018, "Parallel
//! reinsertion for bounding volume hierarchy optimization") and collapsed to eight children; cards
//! are bounded by the hull of their opaque texels; a shape is cut at one height (a trunk under its
//! crown) where that spares rays the empty space beside the trunk. Lengths are metres, coordinates
//! f32. `docs/measurements/casting.md` in the repository compares with Embree and parry.

mod blas;
mod block;
mod brute_force;
mod bvh2_build;
mod bvh8;
mod group;
mod hit;
mod hit_record;
mod hull;
mod interleaved_traversal;
mod intersection;
mod nearest;
mod nearest_hits;
mod node;
mod packet;
mod quantization_grid;
mod quantized_node;
mod ray_bundle;
mod ray_mask;
mod ray_scene;
mod ray_soa;
mod ray_sort;
mod shape_surfaces;
mod simd;
mod tlas;
mod traversal;

pub use blas::{Blas, BuildQuality};
pub use brute_force::BruteForce;
pub use group::Group;
pub use hit_record::{HitRecord, Primitive};
pub use ray_scene::RayScene;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
