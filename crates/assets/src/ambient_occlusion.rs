//! Ambient occlusion: the share of the light from all around that near parts of a shape block. It
//! is baked once for all instances of the shape.
//!
//! Leaves and wood are averaged over a grid of cubes, as if they hung there at random and with
//! every orientation: of the light that goes s metres through a cube with a m² of one-sided area in
//! each m³, a share of exp(−a s / 2) passes (Beer and Lambert; Ross 1981). From each vertex, and
//! from each corner of each card, a few fixed directions are followed over a short distance. The
//! cubes are wider than leaves are thick and stalks are long. Therefore whatever is nearer to a
//! surface than a cube's side, above all the surface itself, is left out, and a lone card or ball
//! is not darkened at all.
//!
//! The ground is of no shape, so what shapes hide from it is known only where they stand: for that,
//! the surface near their foot is kept as a few points ([`Occluder`](nemoral_scene::Occluder)).

mod grid;
mod occluders;
mod pieces;

use glam::Vec3;
use nemoral_scene::{
    AlphaMask, AmbientOcclusion, Card, MaterialId, MaterialLibrary, Mesh, Prototype,
};

use self::grid::{AreaDensityGrid, SurfacePoint, directions};
pub(crate) use self::occluders::{Thickness, occluders};
use self::pieces::size_of_most;

/// How far occluders are looked for, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OcclusionParams {
    /// The side of a cube, metres.
    pub(crate) cell_m: f32,
    /// The distance beyond which occluders do not count, metres.
    pub(crate) reach_m: f32,
    /// The number of directions that are followed, evenly over the sphere.
    pub(crate) directions: u32,
    /// For shapes whose own leaves are already counted in the light of the place where they stand:
    /// the mean share of that light that reaches their leaves, 0..=1. The baked shares are scaled
    /// to this mean.
    pub(crate) among_leaves: Option<f32>,
}

impl OcclusionParams {
    /// For patches of low plants and for seedlings, where all of a tuft is within reach.
    pub(crate) const LOW: Self = Self {
        cell_m: 0.02,
        reach_m: 0.6,
        directions: 26,
        among_leaves: None,
    };
    /// For patches of litter, which are as thin as a few leaves.
    pub(crate) const LITTER: Self = Self {
        cell_m: 0.01,
        reach_m: 0.15,
        directions: 26,
        among_leaves: None,
    };
    pub(crate) const SHRUB: Self = Self {
        cell_m: 0.04,
        reach_m: 0.6,
        directions: 26,
        among_leaves: None,
    };
    /// For trees. The light of a place already accounts for the crowns around it, so only the
    /// differences between the leaves of a tree count here.
    pub(crate) const TREE: Self = Self {
        cell_m: 0.1,
        reach_m: 0.6,
        directions: 20,
        among_leaves: Some(0.8),
    };
}

/// The most cells of a grid and pieces in them, which are coarser for what is larger.
const MOST_CELLS: f32 = 3e7;

impl OcclusionParams {
    /// The same with cells so large that a shape has few of them, and few pieces.
    fn for_shape(self, shape: &Prototype) -> Self {
        let pieces = size_of_most(shape, f32::INFINITY, MOST_CELLS);
        let bounds = shape.bounds();
        Self {
            cell_m: self.cell_m.max(pieces),
            ..self
        }
        .for_size(bounds.max - bounds.min)
    }

    fn for_size(self, size: Vec3) -> Self {
        let volume = size.max(Vec3::splat(self.cell_m)).element_product();
        let least = libm::cbrtf(volume / MOST_CELLS);
        let longest = size.max_element() / grid::MOST_ALONG as f32;
        let cell_m = self.cell_m.max(least).max(longest);
        Self {
            cell_m,
            reach_m: self.reach_m.max(cell_m),
            ..self
        }
    }
}

/// What a user's shape is, by which light goes through it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShapeKind {
    /// Its leaves are counted in the light of the place where it stands.
    Tree,
    /// All of its leaves may be within reach of each other.
    Shrub,
    /// Wood or stone without leaves.
    Solid,
}

/// A user's shape with its ambient occlusion and its [`Occluder`](nemoral_scene::Occluder)s, as
/// grown ones have them: the materials are those of `library`, and its copies are about `scale`
/// times as large.
///
/// Only plants have ambient occlusion, and of these not those whose vertices have no normals or
/// that blend.
#[must_use]
pub fn with_occlusion(
    shape: Prototype,
    library: &MaterialLibrary,
    kind: ShapeKind,
    scale: f32,
) -> Prototype {
    let (near, thickness) = match kind {
        ShapeKind::Tree => (Some(OcclusionParams::TREE), Thickness::Thick),
        ShapeKind::Shrub => (Some(OcclusionParams::SHRUB), Thickness::Thin),
        ShapeKind::Solid => (None, Thickness::Thick),
    };
    let masks = MaskCoverage::of(library);
    let occluders = occluders(&shape, (library, &masks), thickness, scale);
    let shape = shape.with_occluders(occluders);
    let can_be_baked = !shape.mesh().normals.is_empty() && shape.mesh().blends.is_empty();
    let Some(near) = near.filter(|_| can_be_baked) else {
        return shape;
    };
    let occlusion = bake(&shape, &masks, &near.for_shape(&shape));
    (shape.with_ambient_occlusion(occlusion)).expect("one share of each vertex and corner")
}

/// Light from below, which ground and lower leaves reflect, relative to the light from above.
const FROM_BELOW: f32 = 0.2;

/// Number of parts along a mask's side for which opaque shares are kept.
const PARTS: usize = 16;

/// The opaque shares of the masks of a library's materials.
pub(crate) struct MaskCoverage(Vec<Option<Box<[[f32; PARTS + 1]; PARTS + 1]>>>);

impl MaskCoverage {
    pub(crate) fn of(library: &MaterialLibrary) -> Self {
        let materials = library.materials().iter();
        Self(materials.map(|m| m.mask.as_deref().map(summed)).collect())
    }

    fn cuts_out(&self, material: MaterialId) -> bool {
        self.0[usize::from(material.0)].is_some()
    }

    /// The opaque share of a material between two parts of the way along u, and two along v.
    fn opaque(&self, material: usize, [u0, u1]: [usize; 2], [v0, v1]: [usize; 2]) -> f32 {
        let Some(sums) = &self.0[material] else {
            return 1.0;
        };
        let sum = sums[v1][u1] - sums[v0][u1] - sums[v1][u0] + sums[v0][u0];
        sum / ((u1 - u0) * (v1 - v0)) as f32
    }
}

/// Sums of the opaque shares of all parts below a row and left of a column.
fn summed(mask: &AlphaMask) -> Box<[[f32; PARTS + 1]; PARTS + 1]> {
    let mut sums = Box::new([[0.0; PARTS + 1]; PARTS + 1]);
    // Parts of masks that are no multiple of them have texels in common.
    let range = |part: usize, of: usize| part * of / PARTS..((part + 1) * of).div_ceil(PARTS);
    for row in 0..PARTS {
        let mut line = 0.0;
        for column in 0..PARTS {
            let (us, vs) = (range(column, mask.width()), range(row, mask.height()));
            let texels = us.len() * vs.len();
            let opaque = vs.flat_map(|v| us.clone().map(move |u| (u, v)));
            let opaque = opaque.filter(|&(u, v)| mask.texel(u, v)).count();
            line += opaque as f32 / texels as f32;
            sums[row + 1][column + 1] = sums[row][column + 1] + line;
        }
    }
    sums
}

/// Bakes the ambient occlusion of a shape whose materials are those of `masks`.
pub(crate) fn bake(
    prototype: &Prototype,
    masks: &MaskCoverage,
    near: &OcclusionParams,
) -> AmbientOcclusion {
    let grid = AreaDensityGrid::of(prototype, masks, near.cell_m);
    let directions = directions(near.directions);
    let steps = (near.reach_m / near.cell_m).round() as u32;
    let (mesh, cards) = (prototype.mesh(), prototype.cards());
    let cut_out = cut_out(mesh, masks);
    let of_mesh = mesh.positions.iter().zip(&mesh.normals).zip(&cut_out);
    let point =
        |((&at, &normal), &both): ((&Vec3, &Vec3), &bool)| SurfacePoint { at, normal, both };
    let points: Vec<SurfacePoint> = of_mesh.map(point).collect();
    let mut vertices = grid.lights(&points, &directions, steps);
    let corners = |card: &Card| {
        let normal = card.edge_u.cross(card.edge_v).normalize_or(Vec3::Z);
        card.corners().map(|at| SurfacePoint {
            at,
            normal,
            both: true,
        })
    };
    let points: Vec<SurfacePoint> = cards.iter().flat_map(corners).collect();
    let mut leaves = grid.lights(&points, &directions, steps);
    let of_mesh =
        || (vertices.iter().zip(&cut_out)).filter_map(|(v, &is_leaf)| is_leaf.then_some(v));
    let of_leaves = leaves.len() + of_mesh().count();
    if let (Some(among), true) = (near.among_leaves, of_leaves > 0) {
        let sum = leaves.iter().chain(of_mesh()).sum::<f32>();
        let mean = sum / of_leaves as f32;
        // The leaves hide as much of the sky from the wood as from each other, and the light of the
        // place accounts for that already.
        for (share, &is_leaf) in vertices.iter_mut().zip(&cut_out) {
            if is_leaf {
                *share *= among / mean;
            } else {
                *share /= mean;
            }
        }
        leaves.iter_mut().for_each(|share| *share *= among / mean);
    }
    AmbientOcclusion {
        vertices: vertices.into_iter().map(AmbientOcclusion::encode).collect(),
        cards: (leaves.as_chunks().0.iter())
            .map(|corners| corners.map(AmbientOcclusion::encode))
            .collect(),
    }
}

/// Which vertices are of surfaces that a mask cuts out, as leaves of imported plants are.
fn cut_out(mesh: &Mesh, masks: &MaskCoverage) -> Vec<bool> {
    let mut cut_out = vec![false; mesh.positions.len()];
    for triangle in &mesh.triangles {
        if masks.cuts_out(triangle.material) {
            for corner in triangle.corners {
                cut_out[corner as usize] = true;
            }
        }
    }
    cut_out
}

#[cfg(test)]
mod tests;
