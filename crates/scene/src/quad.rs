//! Quads of a mesh that are cards: leaves of imported plants.

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::{Card, MaterialLibrary, Mesh, TextureWindow};

/// Two triangles of a mesh that together are one card: casters intersect the card, which is
/// quicker, and name, shade and draw the triangles.
///
/// [`Prototype::new`](crate::Prototype::new) finds them. The triangles share a material with a
/// mask, and an edge at whose ends positions and texture coordinates are equal to the bit. They
/// are wound alike, form a parallelogram, and their texture coordinates are affine over it. Each
/// corner may be off by 1/2048 of the shorter side, and its texture coordinate by 1/64 of a texel
/// of the mask: by so much a card's hits may differ from the triangles'. Quads that touch other
/// triangles along an edge stay triangles, lest rays pass between, as do those that blend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quad {
    /// The numbers of the triangles, ascending.
    pub triangles: [u32; 2],
    /// The vertices at the card's corners, in the order of [`Card::corners`].
    pub corners: [u32; 4],
    /// The card's corners at which those of the triangles are.
    places: [[u8; 3]; 2],
}

/// How far the fourth corner may be from where the other three have it, in shorter sides. Each
/// corner is then off by a quarter of it.
const SKEW: f64 = 1.0 / 512.0;

/// The same for texture coordinates, in texels of the mask.
const SKEW_TEXELS: f64 = 1.0 / 16.0;

/// Edges of more triangles are no leaves' diagonals, and would take long.
const MOST_AT_EDGE: usize = 16;

/// The least sine of the angle between the sides.
const LEAST_SINE: f64 = 1e-3;

impl Quad {
    /// The card that the quad is in its mesh, and the part of the texture that it shows: the
    /// parallelogram nearest to the four corners.
    #[must_use]
    pub fn card(&self, mesh: &Mesh) -> (Card, TextureWindow) {
        let p = self.corners.map(|i| mesh.positions[i as usize].as_dvec3());
        let uv = self.corners.map(|i| mesh.uv(i).as_dvec2());
        let ([corner, edge_u, edge_v], _) = parallelogram(p);
        let ([origin, along_u, along_v], _) = parallelogram(uv);
        let material = mesh.triangles[self.triangles[0] as usize].material;
        let card = Card {
            corner: corner.as_vec3(),
            edge_u: edge_u.as_vec3(),
            edge_v: edge_v.as_vec3(),
            material,
        };
        let window = TextureWindow {
            origin: origin.as_vec2(),
            along_u: along_u.as_vec2(),
            along_v: along_v.as_vec2(),
        };
        (card, window)
    }

    /// The triangle at the place (s, t) of the card, with the weights of its second and third
    /// corner there.
    #[must_use]
    pub fn triangle_at(&self, s: f64, t: f64) -> (u32, f64, f64) {
        const PLACES: [DVec2; 4] = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
        let point = DVec2::new(s, t);
        let weights = |i: usize| {
            let [a, b, c] = self.places[i].map(|corner| PLACES[usize::from(corner)]);
            let area = (b - a).perp_dot(c - a);
            let u = (point - a).perp_dot(c - a) / area;
            let v = (b - a).perp_dot(point - a) / area;
            (self.triangles[i], u, v)
        };
        let [first, second] = [0, 1].map(weights);
        // The one that the point is farther inside of.
        let inside = |(_, u, v): (u32, f64, f64)| u.min(v).min(1.0 - u - v);
        if inside(first) >= inside(second) {
            first
        } else {
            second
        }
    }
}

/// A corner and two edges, in f64.
trait Point: Copy {
    fn fit(points: [Self; 4]) -> ([Self; 3], Self);
}

macro_rules! point {
    ($vector:ty) => {
        impl Point for $vector {
            fn fit([a, b, c, d]: [Self; 4]) -> ([Self; 3], Self) {
                let skew = (a - b) + (c - d);
                let edge_u = ((b - a) + (c - d)) / 2.0;
                let edge_v = ((d - a) + (c - b)) / 2.0;
                ([a - skew / 4.0, edge_u, edge_v], skew)
            }
        }
    };
}
point!(DVec2);
point!(DVec3);

/// The parallelogram nearest to four points in turn: a corner and its edges, and by how much the
/// points fail to be one. Each point is off by a quarter of that.
fn parallelogram<P: Point>(points: [P; 4]) -> ([P; 3], P) {
    P::fit(points)
}

/// Welds the vertices: those whose positions are equal to the bit get the same number. Both zeros
/// are one.
fn weld(mesh: &Mesh) -> Vec<u32> {
    let bits = |p: &Vec3| (*p + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut vertices: Vec<_> = mesh.positions.iter().map(bits).zip(0_u32..).collect();
    vertices.sort_unstable();
    let mut welded = vec![0; vertices.len()];
    for (number, same) in (0..).zip(vertices.chunk_by(|a, b| a.0 == b.0)) {
        for &(_, vertex) in same {
            welded[vertex as usize] = number;
        }
    }
    welded
}

/// An edge between two welded vertices, the lower number first.
type Edge = [u32; 2];

/// The edges of a polygon of welded vertices.
fn edges<const N: usize>(corners: [u32; N]) -> [Edge; N] {
    std::array::from_fn(|k| {
        let (a, b) = (corners[k], corners[(k + 1) % N]);
        [a.min(b), a.max(b)]
    })
}

/// The quads of a mesh whose indices and materials are valid, in order of their first triangles.
pub(crate) fn find(mesh: &Mesh, library: &MaterialLibrary) -> Vec<Quad> {
    let masked = |i: usize| {
        let material = library.get(mesh.triangles[i].material);
        let blends = mesh.blends.get(i).is_some_and(|b| !b.is_uniform());
        material.mask.is_some() && !blends
    };
    let count = mesh.triangles.len();
    if mesh.uvs.is_empty() || !(0..count).any(masked) {
        return Vec::new();
    }
    let welded = weld(mesh);
    let corners = |i: usize| mesh.triangles[i].corners.map(|v| welded[v as usize]);
    // Candidates at one edge follow each other.
    let candidates = (0..count).filter(|&i| masked(i));
    let at_edges = candidates.flat_map(|i| edges(corners(i)).map(|edge| (edge, i as u32)));
    let mut at_edges: Vec<_> = at_edges.collect();
    at_edges.sort_unstable();
    let mut pairs = Vec::new();
    for run in at_edges.chunk_by(|a, b| a.0 == b.0) {
        if run.len() <= MOST_AT_EDGE {
            for (k, &(_, first)) in run.iter().enumerate() {
                let others = run[k + 1..].iter().map(|&(_, other)| other);
                pairs.extend(others.filter(|&o| o > first).map(|o| [first, o]));
            }
        }
    }
    pairs.sort_unstable();
    // A triangle takes the first later one that makes a parallelogram of it.
    let mut taken = vec![false; count];
    let mut quads = Vec::new();
    for [i, k] in pairs {
        if taken[i as usize] || taken[k as usize] {
            continue;
        }
        if let Some(quad) = join(mesh, library, i, k) {
            for t in quad.triangles {
                taken[t as usize] = true;
            }
            quads.push(quad);
        }
    }
    alone(mesh, &welded, quads)
}

/// The quad of two triangles, if they are one.
fn join(mesh: &Mesh, library: &MaterialLibrary, i: u32, k: u32) -> Option<Quad> {
    let [first, second] = [i, k].map(|t| mesh.triangles[t as usize]);
    if first.material != second.material {
        return None;
    }
    let at = |v: u32| (mesh.positions[v as usize], mesh.uv(v));
    // Of the three ways round each, one in which the second goes back along the edge that the
    // first goes along: a, b, c and d, c, b.
    let turns = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b]];
    for [a, b, c] in turns(first.corners) {
        for [d, e, f] in turns(second.corners) {
            if at(b) == at(f) && at(c) == at(e) {
                // Which corner is the first decides nothing but how few windows there are: the one
                // with the lowest texture coordinate, which makes a whole texture one.
                let round = [a, b, d, c];
                let lowest = (0..4).min_by(|&x, &y| {
                    let [x, y] = [x, y].map(|k: usize| mesh.uv(round[k]));
                    (x.x.total_cmp(&y.x)).then(x.y.total_cmp(&y.y))
                })?;
                let corners = [0, 1, 2, 3].map(|k| round[(lowest + k) % 4]);
                let position = |v: u32| mesh.positions[v as usize];
                let place = |v: u32| {
                    let corner = corners.iter().position(|&c| position(c) == position(v));
                    corner.unwrap_or(0) as u8
                };
                let quad = Quad {
                    triangles: [i, k],
                    corners,
                    places: [first.corners.map(place), second.corners.map(place)],
                };
                return quad.is_card(mesh, library).then_some(quad);
            }
        }
    }
    None
}

impl Quad {
    fn is_card(&self, mesh: &Mesh, library: &MaterialLibrary) -> bool {
        let p = self.corners.map(|i| mesh.positions[i as usize].as_dvec3());
        let ([_, u, v], skew) = parallelogram(p);
        let (lu, lv) = (u.length(), v.length());
        let flat = u.cross(v).length() > LEAST_SINE * lu * lv && skew.length() <= SKEW * lu.min(lv);
        let material = mesh.triangles[self.triangles[0] as usize].material;
        let Some(mask) = &library.get(material).mask else {
            return false;
        };
        let size = DVec2::new(mask.width() as f64, mask.height() as f64);
        let uv: [Vec2; 4] = self.corners.map(|i| mesh.uv(i));
        let (_, uv_skew) = parallelogram(uv.map(Vec2::as_dvec2));
        let affine = (uv_skew * size).abs().max_element() <= SKEW_TEXELS;
        // What became infinite or NaN fails every comparison.
        let (card, window) = self.card(mesh);
        let sound = card.edge_u.as_dvec3().cross(card.edge_v.as_dvec3()) != DVec3::ZERO;
        flat && affine && sound && window.is_finite()
    }
}

/// Those quads of which no edge is an edge of anything but quads with the same four corners (the
/// back of the same leaf, or copies).
fn alone(mesh: &Mesh, welded: &[u32], quads: Vec<Quad>) -> Vec<Quad> {
    if quads.is_empty() {
        return quads;
    }
    let corners = |vertices: &[u32; 4]| vertices.map(|v| welded[v as usize]);
    let mut is_corner = vec![false; welded.len()];
    let mut in_quad = vec![false; mesh.triangles.len()];
    // Each edge with the number of its quad; with none, if it is a triangle's.
    let mut all = Vec::with_capacity(4 * quads.len());
    for (number, quad) in quads.iter().enumerate() {
        let corners = corners(&quad.corners);
        all.extend(edges(corners).map(|edge| (edge, Some(number))));
        for corner in corners {
            is_corner[corner as usize] = true;
        }
        for t in quad.triangles {
            in_quad[t as usize] = true;
        }
    }
    for (triangle, _) in (mesh.triangles.iter().zip(in_quad)).filter(|(_, in_quad)| !in_quad) {
        // Most are nowhere near a quad.
        let touches = |edge: &Edge| edge.iter().all(|&v| is_corner[v as usize]);
        let edges = edges(triangle.corners.map(|v| welded[v as usize]));
        all.extend(edges.into_iter().filter(touches).map(|edge| (edge, None)));
    }
    all.sort_unstable();
    let sorted_corners = |number: usize| {
        let mut corners = corners(&quads[number].corners);
        corners.sort_unstable();
        corners
    };
    let mut is_alone = vec![true; quads.len()];
    for run in all.chunk_by(|a, b| a.0 == b.0) {
        let mut corners = run.iter().map(|(_, quad)| quad.map(sorted_corners));
        let first = corners.next();
        if corners.any(|others| Some(others) != first) {
            for quad in run.iter().filter_map(|(_, quad)| *quad) {
                is_alone[quad] = false;
            }
        }
    }
    let alone = quads.into_iter().zip(is_alone);
    alone
        .filter_map(|(q, is_alone)| is_alone.then_some(q))
        .collect()
}

#[cfg(test)]
mod tests;
