//! This crate casts rays at forests of instanced, alpha-masked shapes.
//!
//! It answers for every sensor what the paper's LiDAR asks of its engine (section V-B, Fig. 5): where
//! does a ray meet a surface, and is the texture opaque there? Shapes are made once ([`Blas`]),
//! placed many times ([`Group`], one for a chunk), and groups are put together for a frame
//! ([`Forest`]). [`BruteForce`] answers the same without any acceleration, to the bit.
//!
//! ```
//! use std::sync::Arc;
//! use glam::{Mat3, Vec3};
//! use nemoral_raycast::{Blas, Forest, Group};
//! use nemoral_scene::*;
//!
//! let mut materials = MaterialLibrary::new();
//! let material = materials.add(Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.2)));
//! let card = Card { corner: Vec3::ZERO, edge_u: Vec3::X, edge_v: Vec3::Y, material };
//! let prototype = Arc::new(Prototype::new("one leaf", Mesh::default(), vec![card], &materials)?);
//!
//! let blas = Arc::new(Blas::build(Arc::clone(&prototype), &materials));
//! let (position_m, linear, object) = (Vec3::Z * 2.0, Mat3::IDENTITY, ObjectId::NONE);
//! let leaf = Instance { prototype, position_m, linear, object, variation: 0.0 };
//! let forest = Forest::new(vec![(Vec3::ZERO, Arc::new(Group::build(vec![(leaf, blas)])))]);
//!
//! // One shape as it is needs no more than `Forest::of_shape(prototype, &materials)`.
//! let hit = forest.closest_hit(&Ray::new(Vec3::new(0.25, 0.5, 0.0), Vec3::Z));
//! assert_eq!(hit.map(|h| h.distance_m), Some(2.0));
//! # Ok::<(), PrototypeError>(())
//! ```
//!
//! # What is hit
//! - Triangles and cards from both sides, borders included. A masked one only where
//!   [`AlphaMask::is_opaque`](nemoral_scene::AlphaMask::is_opaque) says so at the texture
//!   coordinate of the hit. What has no area is never hit.
//! - Hits count from `t_min_m` to `t_max_m`, both included. At equal `distance_m` the lowest object
//!   id wins, then the lowest number of group, instance, primitive.
//! - No ray passes between triangles that share an edge, nor between those of neighbouring groups
//!   that share it exactly (unturned and unscaled, offsets in whole metres).
//!
//! # How
//! Three trees, eight boxes a node: groups, instances, primitives. Eight-wide f32 arithmetic only
//! proposes, always loosened by a bound on its own rounding error; whatever it proposes is decided
//! in f64, without fused operations. So a result is a function of the ray and the scene alone: not
//! of the tree, the order of the rays, the threads, or the processor's instructions. (AVX2 and FMA
//! are used where the processor has them; the same kernels over arrays elsewhere.)
//!
//! A batch ([`closest_hits`](nemoral_scene::RayCaster::closest_hits)) is sorted by direction, and
//! neighbours walk the trees above the instances together, as a beam that bounds them: half of a
//! ray's steps are made once for dozens. Give a sensor's rays in large batches.
//!
//! Trees are built by the surface area heuristic (Wald 2007, "On fast construction of SAH-based
//! bounding volume hierarchies"), bettered by reinsertion (Meister and Bittner 2018, "Parallel
//! reinsertion for bounding volume hierarchy optimization") and collapsed to eight children; cards
//! are bounded by the hull of their opaque texels; a shape is cut at one height (a trunk under its
//! crown) where that spares rays the empty room beside the trunk. Lengths are metres, coordinates
//! f32. `docs/raycast.md` in the repository compares with Embree and parry.

mod answer;
mod binary;
mod blas;
mod block;
mod brute;
mod bundle;
mod exact;
mod forest;
mod grid;
mod group;
mod hull;
mod lanes;
mod nearest;
mod node;
mod order;
mod packet;
mod simd;
mod stack;
mod surface;
mod tree;
mod turns;

pub use blas::{Blas, Quality};
pub use brute::BruteForce;
pub use forest::Forest;
pub use group::Group;
