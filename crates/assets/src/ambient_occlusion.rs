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
mod tests {
    use std::sync::Arc;

    use glam::Vec2;
    use nemoral_scene::{Material, MaterialId, Semantic, Triangle};
    use nemoral_seed::{Draw, Key};

    use super::*;

    const NEAR: OcclusionParams = OcclusionParams {
        cell_m: 0.1,
        reach_m: 6.0,
        directions: 500,
        among_leaves: None,
    };

    fn library() -> MaterialLibrary {
        let mut library = MaterialLibrary::new();
        library.add(Material::plain("leaf", Semantic::Leaf, Vec3::ONE));
        library
    }

    fn card(middle: Vec3, edge_u: Vec3, edge_v: Vec3) -> Card {
        Card {
            corner: middle - 0.5 * (edge_u + edge_v),
            edge_u,
            edge_v,
            material: MaterialId(0),
        }
    }

    fn shares(mesh: Mesh, cards: Vec<Card>, near: &OcclusionParams) -> AmbientOcclusion {
        let library = library();
        let shape = Prototype::new("grid", mesh, cards, &library).expect("sound");
        bake(&shape, &MaskCoverage::of(&library), near)
    }

    /// The share of light that cards leave a level speck at the origin.
    fn speck(cards: Vec<Card>) -> f32 {
        let mesh = Mesh {
            positions: [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * 1e-3).to_vec(),
            normals: vec![Vec3::Z; 3],
            uvs: vec![Vec2::ZERO; 3],
            triangles: vec![Triangle {
                corners: [0, 1, 2],
                material: MaterialId(0),
            }],
            blends: Vec::new(),
        };
        AmbientOcclusion::decode(shares(mesh, cards, &NEAR).vertices[0])
    }

    /// Leaves behind leaves, which nothing passes.
    fn wall(across: Vec3) -> Vec<Card> {
        let (u, v) = across.any_orthonormal_pair();
        let middle = |k: i32| across * (0.3 + 0.01 * k as f32);
        (0..50)
            .map(|k| card(middle(k), 14.0 * u, 14.0 * v))
            .collect()
    }

    #[test]
    fn leaves_of_a_mesh_are_as_dark_as_cards() {
        let mut library = MaterialLibrary::new();
        let mask = AlphaMask::from_fn(8, 8, |c, r| c != r).expect("a size");
        library.add(Material {
            mask: Some(Arc::new(mask)),
            ..Material::plain("leaf", Semantic::Leaf, Vec3::ONE)
        });
        let mut rng = Key::world(4).rng();
        let mut number = |most: f64| rng.range_f64(-most, most) as f32;
        let cards: Vec<Card> = (0..600)
            .map(|_| {
                let middle = Vec3::new(number(1.0), number(1.0), number(1.0));
                let way = Vec3::new(number(1.0), number(1.0), number(1.0)).normalize_or(Vec3::X);
                let (u, v) = way.any_orthonormal_pair();
                card(middle, 0.3 * u, 0.3 * v)
            })
            .collect();
        let mut mesh = Mesh::default();
        for card in &cards {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(card.corners());
            let normal = card.edge_u.cross(card.edge_v).normalize_or(Vec3::Z);
            mesh.normals.extend([normal; 4]);
            mesh.uvs.extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
            for corners in [[0, 1, 2], [0, 2, 3]] {
                mesh.triangles.push(Triangle {
                    corners: corners.map(|c| first + c),
                    material: MaterialId(0),
                });
            }
        }
        let shares = |mesh: Mesh, cards: Vec<Card>| {
            let shape = Prototype::new("leaves", mesh, cards, &library).expect("sound");
            let shape = with_occlusion(shape, &library, ShapeKind::Tree, 1.0);
            shape.ambient_occlusion().cloned().expect("baked")
        };
        let of_cards = bake(
            &Prototype::new("leaves", Mesh::default(), cards, &library).expect("sound"),
            &MaskCoverage::of(&library),
            &OcclusionParams::TREE,
        );
        let of_mesh = shares(mesh, Vec::new());
        let of_cards: Vec<f32> = of_cards
            .cards
            .iter()
            .flatten()
            .map(|&s| AmbientOcclusion::decode(s))
            .collect();
        let of_mesh: Vec<f32> = of_mesh
            .vertices
            .iter()
            .map(|&s| AmbientOcclusion::decode(s))
            .collect();
        let mean = |shares: &[f32]| shares.iter().sum::<f32>() / shares.len() as f32;
        assert!((mean(&of_cards) - mean(&of_mesh)).abs() < 0.01);
        let off = of_cards.iter().zip(&of_mesh).map(|(a, b)| (a - b).abs());
        let off: f32 = off.sum::<f32>() / of_cards.len() as f32;
        let spread = of_cards
            .iter()
            .map(|s| (s - mean(&of_cards)).abs())
            .sum::<f32>();
        let spread = spread / of_cards.len() as f32;
        assert!(spread > 0.05 && off < 0.2 * spread, "{off} {spread}");
    }

    #[test]
    fn a_lone_card_is_in_the_open() {
        for (u, v) in [
            (Vec3::X, Vec3::Y),
            (Vec3::X, Vec3::Z),
            (Vec3::new(0.3, -0.2, 0.1), Vec3::new(0.1, 0.5, 0.7)),
        ] {
            for cell_m in [0.02, 0.1, 0.7] {
                let near = OcclusionParams { cell_m, ..NEAR };
                let alone = shares(
                    Mesh::default(),
                    vec![card(Vec3::new(0.4, -0.1, 0.23), u, v)],
                    &near,
                );
                assert_eq!(alone.cards, [[255; 4]], "{u} {v} {cell_m}");
            }
        }
    }

    #[test]
    fn walls_hide_what_they_hide_of_the_sky() {
        assert_eq!(speck(Vec::new()), 1.0);
        // Weighted by the cosine, one wall at the side hides a half of the light, and two in a
        // corner leave a quarter.
        let beside = speck(wall(Vec3::X));
        assert!((beside - 0.5).abs() < 0.03, "{beside}");
        let corner = speck([wall(Vec3::X), wall(Vec3::Y)].concat());
        assert!((corner - 0.25).abs() < 0.03, "{corner}");
    }

    #[test]
    fn a_layer_of_leaves_passes_what_it_does_by_beer_and_lambert() {
        // A layer of leaves of every orientation with an area index of 1 passes twice the third
        // exponential integral of a half.
        let layer = speck(vec![card(Vec3::Z * 0.65, 14.0 * Vec3::X, 14.0 * Vec3::Y)]);
        assert!((layer - 0.443).abs() < 0.02, "{layer}");
        // Each of two parallel cards gets half of its light, on its outer side; more comes from
        // above than from below.
        let at = |z: f32| card(Vec3::Z * z, 14.0 * Vec3::X, 14.0 * Vec3::Y);
        let middle = |z: f32| card(Vec3::Z * z, 0.1 * Vec3::X, 0.1 * Vec3::Y);
        let two = shares(
            Mesh::default(),
            vec![at(0.05), middle(0.05), at(0.65), middle(0.65)],
            &NEAR,
        );
        let [low, high] = [1, 3].map(|card| AmbientOcclusion::decode(two.cards[card][0]));
        let expected = |above: f32, below: f32| (above + FROM_BELOW * below) / (1.0 + FROM_BELOW);
        assert!((low - expected(0.443, 1.0)).abs() < 0.03, "{low}");
        assert!((high - expected(1.0, 0.443)).abs() < 0.03, "{high}");
    }

    fn grid(cards: u64) -> Vec<Card> {
        let mut rng = Key::world(11).rng();
        let mut point =
            |size: f32| Vec3::from_array(std::array::from_fn(|_| rng.range_f32(-size, size)));
        (0..cards)
            .map(|_| card(point(0.5), point(0.2), point(0.2)))
            .collect()
    }

    #[test]
    fn taking_leaves_away_never_darkens() {
        let all = grid(400);
        let of = |cards: &[Card]| shares(Mesh::default(), cards.to_vec(), &NEAR).cards;
        let (before, after) = (of(&all), of(&all[..250]));
        for (before, after) in before.iter().zip(&after) {
            assert!(
                before.iter().zip(after).all(|(b, a)| a >= b),
                "{before:?} {after:?}"
            );
        }
        assert!(before[..250] != after[..]);
    }

    #[test]
    fn shares_among_leaves_are_told_from_their_mean() {
        let near = OcclusionParams {
            among_leaves: Some(0.4),
            ..NEAR
        };
        let cards = shares(Mesh::default(), grid(400), &near).cards;
        let mean = cards
            .iter()
            .flatten()
            .map(|&c| AmbientOcclusion::decode(c))
            .sum::<f32>()
            / 1600.0;
        assert!((mean - 0.4).abs() < 0.01, "{mean}");
    }

    #[test]
    fn a_thread_a_kilometre_long_has_few_cells() {
        let long = OcclusionParams::LOW.for_size(Vec3::new(1e-3, 1e3, 1e-3));
        assert!(1e3 / long.cell_m <= grid::MOST_ALONG as f32);
        let card = card(Vec3::ZERO, 1e-3 * Vec3::X, 1e3 * Vec3::Y);
        assert_eq!(shares(Mesh::default(), vec![card], &long).cards, [[255; 4]]);
    }

    #[test]
    fn value_stability() {
        let cards = shares(Mesh::default(), grid(400), &OcclusionParams::LOW).cards;
        let sum: u32 = cards.iter().flatten().map(|&c| u32::from(c)).sum();
        assert_eq!((cards[0], sum), ([107, 40, 71, 60], 167_588));
    }
}
