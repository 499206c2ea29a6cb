//! Makes triangles from axes and radii.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use nemoral_scene::glam::{DVec3, Vec2};
use nemoral_scene::{MaterialId, Mesh, Triangle};
use nemoral_seed::{Domain, Draw};

use super::flare::Flare;
use super::materials::TreeMaterials;
use super::skeleton::{Axis, BREAST_M, beside};

const BARK: Domain = Domain::new("assets.tree.bark");

/// The size of one repetition of bark on stems of 0.2 to 0.8 m, metres: across and along.
const TILE_M: [f64; 2] = [1.0, 2.0];
/// Least and most of the spiral grain: u per v.
const SPIRAL: [f64; 2] = [0.17, 0.24];
/// The greatest distance between a polygon's side and its circle, metres.
const CHORD_M: f64 = 0.004;

/// Thinner branches have no collar, as it would not be visible.
const COLLAR_RADIUS_M: f64 = 0.008;

/// The wood of a tree that is drawn.
#[derive(Clone, Debug)]
pub(super) struct DrawnWood {
    /// How finely it is drawn.
    pub(super) tessellation: Tessellation,
    /// For every axis, whether it is drawn.
    pub(super) drawn: Vec<bool>,
    /// For every axis, whether it ends in a point. Living twigs that bear no others do.
    pub(super) pointed: Vec<bool>,
}

/// How finely to sweep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tessellation {
    /// Where stems and limbs end and branches begin.
    pub(super) trunk_radius_m: f64,
    /// Factor on all tolerances: above 1 for trees that would be over their budget.
    pub(super) tolerance: f64,
}

/// A ring of vertices that is still to be made.
#[derive(Clone, Copy, Debug)]
struct Ring {
    centre: DVec3,
    radius: f64,
}

/// Sides of the polygon round an axis of this greatest radius.
fn sides(order: usize, radius: f64, tolerance: f64) -> usize {
    if order == 0 {
        return if radius < 0.06 { 12 } else { 20 };
    }
    let n = PI / libm::acos(1.0 - (CHORD_M * tolerance / radius).min(0.9));
    (n.ceil() as usize).clamp(3, 12)
}

/// A polygon of n sides has the circle's area if its corners are this much farther out.
fn equal_area(n: usize) -> f64 {
    let step = TAU / n as f64;
    (step / libm::sin(step)).sqrt()
}

/// Sweeps every axis that is drawn. The stem's triangles come first: their range is returned.
pub(super) fn sweep(
    axes: &[Axis],
    radii: &[Vec<f64>],
    flare: &Flare,
    materials: &TreeMaterials,
    upper_from_m: f64,
    wood: &DrawnWood,
) -> (Mesh, Range<usize>) {
    let mut mesh = Mesh::default();
    let mut stem = 0..0;
    let tessellation = wood.tessellation;
    for (i, (axis, r)) in axes.iter().zip(radii).enumerate() {
        if !wood.drawn[i] {
            continue;
        }
        let rings = rings(axis, r, parent_radius(axis, radii), tessellation);
        let tube = Tube {
            axis,
            pointed: wood.pointed[i],
            flare: (axis.order == 0).then_some(flare),
            snag: axes[0].dead,
            upper_from_m,
            materials,
            tessellation,
        };
        tube.mesh(&rings, &mut mesh);
        if axis.order == 0 {
            stem = 0..mesh.triangles.len();
        }
    }
    (mesh, stem)
}

/// An upper bound of the triangles that [`sweep`] makes of the `i`-th axis.
pub(super) fn cost(
    axes: &[Axis],
    radii: &[Vec<f64>],
    i: usize,
    pointed: bool,
    tessellation: Tessellation,
) -> usize {
    let axis = &axes[i];
    let rings = rings(axis, &radii[i], parent_radius(axis, radii), tessellation);
    let greatest = rings.iter().fold(0.0_f64, |m, r| m.max(r.radius));
    let n = sides(axis.order, greatest, tessellation.tolerance);
    // A stem's change of bark takes two rings more.
    let rings = rings.len() + if axis.order == 0 { 2 } else { 0 };
    n * (2 * rings - if pointed { 3 } else { 1 })
}

/// Radius of the parent where an axis leaves it.
fn parent_radius(axis: &Axis, radii: &[Vec<f64>]) -> Option<f64> {
    axis.parent
        .map(|(p, s)| super::radii::at_param(&radii[p], s))
}

/// The rings of an axis: a collar where it leaves its parent, no ring that bend and taper do not
/// need, and one exactly where the trunk threshold is crossed.
fn rings(
    axis: &Axis,
    radii: &[f64],
    parent_radius: Option<f64>,
    tessellation: Tessellation,
) -> Vec<Ring> {
    let trunk_radius_m = tessellation.trunk_radius_m;
    let all: Vec<Ring> = axis
        .points
        .iter()
        .zip(radii)
        .map(|(&centre, &radius)| Ring { centre, radius })
        .collect();
    let mut kept = simplify(&all, axis.order == 0, tessellation.tolerance);
    let thick = kept[0].radius > COLLAR_RADIUS_M * tessellation.tolerance;
    if let Some(parent_radius) = parent_radius.filter(|_| axis.order == 1 && thick) {
        collar(&mut kept, parent_radius);
    }
    let mut out: Vec<Ring> = Vec::with_capacity(kept.len() + 1);
    for ring in kept {
        if let Some(&last) = out.last() {
            let (a, b) = (last.radius - trunk_radius_m, ring.radius - trunk_radius_m);
            if a * b < 0.0 {
                let t = a / (a - b);
                if t > 1e-3 && t < 1.0 - 1e-3 {
                    out.push(Ring {
                        centre: last.centre.lerp(ring.centre, t),
                        radius: trunk_radius_m,
                    });
                }
            }
        }
        out.push(ring);
    }
    out
}

/// Widens a branch where it comes out of its parent's bark.
fn collar(rings: &mut Vec<Ring>, parent_radius: f64) {
    let Ring {
        centre: base,
        radius,
    } = rings[0];
    let along = rings[1].centre - base;
    let length = along.length();
    let (bark, end) = (parent_radius, parent_radius + 2.5 * radius);
    if end < 0.8 * length {
        let at = |s: f64| base + along * (s / length);
        let r = |s: f64| radius + (rings[1].radius - radius) * (s / length);
        let new = [
            Ring {
                centre: at(bark),
                radius: 1.3 * r(bark),
            },
            Ring {
                centre: at(end),
                radius: r(end),
            },
        ];
        rings[0].radius *= 1.3;
        rings.splice(1..1, new);
    }
}

/// Drops points that a straight, evenly tapering piece replaces within a fraction of the radius.
fn simplify(all: &[Ring], is_stem: bool, tolerance: f64) -> Vec<Ring> {
    let last = all.len() - 1;
    let mut kept = vec![all[0]];
    let mut from = 0;
    while from < last {
        let mut to = from + 1;
        while to < last
            && fits(&all[from..=to + 1], is_stem, tolerance)
            && !(is_stem && all[from].centre.z < 1.5 * BREAST_M)
        {
            to += 1;
        }
        kept.push(all[to]);
        from = to;
    }
    kept
}

fn fits(piece: &[Ring], is_stem: bool, tolerance: f64) -> bool {
    // The limit keeps leaves from hanging visibly beside their twigs.
    let most_m = (0.02 * tolerance).min(0.03);
    // The taper of stems is measured by foresters, that of branches is not.
    let thinner = if is_stem { 0.01 } else { 0.12 * tolerance };
    let (a, b) = (piece[0], piece[piece.len() - 1]);
    let chord = b.centre - a.centre;
    let length_squared = chord.length_squared().max(1e-12);
    piece[1..piece.len() - 1].iter().all(|p| {
        let t = ((p.centre - a.centre).dot(chord) / length_squared).clamp(0.0, 1.0);
        let off = p.centre.distance(a.centre + chord * t);
        let radius = a.radius + (b.radius - a.radius) * t;
        off < (0.25 * tolerance * p.radius).clamp(0.008, most_m)
            && (p.radius - radius).abs() < (thinner * p.radius).max(0.001)
    })
}

/// One axis on its way to the mesh.
struct Tube<'a> {
    axis: &'a Axis,
    /// Does it end in a point?
    pointed: bool,
    flare: Option<&'a Flare>,
    /// Is the whole tree dead?
    snag: bool,
    /// Height at which the upper bark begins.
    upper_from_m: f64,
    materials: &'a TreeMaterials,
    tessellation: Tessellation,
}

impl Tube<'_> {
    fn mesh(&self, rings: &[Ring], mesh: &mut Mesh) {
        let bark = BarkMap::new(self, rings);
        let rings = &bark.with_borders(rings);
        let greatest = rings.iter().fold(0.0_f64, |m, r| m.max(r.radius));
        let n = sides(self.axis.order, greatest, self.tessellation.tolerance);
        let first = mesh.positions.len() as u32;
        let columns = n as u32 + 1;
        let grid = self.grid(rings, n);
        let along = self.vertices(rings, n, &grid, &bark, mesh);
        // A pointed twig has no last ring.
        let drawn = along.len();
        for (i, pair) in rings[..drawn].windows(2).enumerate() {
            let v = 0.5 * (along[i] + along[i + 1]);
            let material = self.material(pair[0], pair[1], bark.zone(v));
            for j in 0..n as u32 {
                let a = first + i as u32 * columns + j;
                let (b, d) = (a + 1, a + columns);
                mesh.triangles.push(Triangle {
                    corners: [a, b, d + 1],
                    material,
                });
                mesh.triangles.push(Triangle {
                    corners: [a, d + 1, d],
                    material,
                });
            }
        }
        let zone = bark.zone(along[drawn - 1]);
        let start = first + (drawn as u32 - 1) * columns;
        self.end(rings, n, start, zone, mesh);
    }

    /// Positions by ring and side, n + 1 for each ring, as the seam is stored twice. Frames are
    /// carried along without twist (rotation-minimising frames, Wang et al. 2008; here by
    /// projection, which suffices for short joints).
    fn grid(&self, rings: &[Ring], n: usize) -> Vec<DVec3> {
        let widen = equal_area(n);
        let mut grid = Vec::with_capacity(rings.len() * (n + 1));
        let mut side = beside(tangent(rings, 0));
        for (i, ring) in rings.iter().enumerate() {
            let along = tangent(rings, i);
            side = (side - along * side.dot(along))
                .try_normalize()
                .unwrap_or_else(|| beside(along));
            let other = along.cross(side);
            for j in 0..=n {
                let angle = TAU * (j % n) as f64 / n as f64;
                let (sin, cos) = libm::sincos(angle);
                let flare = self.flare.map_or(1.0, |f| f.factor(angle, ring.centre.z));
                grid.push(ring.centre + (side * cos + other * sin) * (ring.radius * widen * flare));
            }
        }
        grid
    }

    /// Pushes the vertices of the rings that are drawn; returns v of each.
    fn vertices(
        &self,
        rings: &[Ring],
        n: usize,
        grid: &[DVec3],
        bark: &BarkMap,
        mesh: &mut Mesh,
    ) -> Vec<f64> {
        let mut v = bark.v0;
        let mut vs = Vec::with_capacity(rings.len());
        let columns = n + 1;
        let drawn = rings.len() - usize::from(self.pointed);
        for (i, ring) in rings.iter().enumerate().take(drawn) {
            if i > 0 {
                v += ring.centre.distance(rings[i - 1].centre) * bark.per_m;
            }
            vs.push(v);
            for j in 0..columns {
                let at = |i: usize, j: usize| grid[i * columns + j % n];
                let across = at(i, j + 1) - at(i, j + n - 1);
                let along = at((i + 1).min(rings.len() - 1), j) - at(i.saturating_sub(1), j);
                let radial = (at(i, j) - ring.centre).normalize_or(DVec3::Z);
                let normal = across
                    .cross(along)
                    .try_normalize()
                    .filter(|m| m.dot(radial) > 0.05)
                    .unwrap_or(radial);
                mesh.positions.push(grid[i * columns + j].as_vec3());
                mesh.normals.push(normal.as_vec3());
                let u = bark.u0 + bark.wraps * j as f64 / n as f64 + bark.spiral * (v - bark.v0);
                mesh.uvs.push(Vec2::new(u as f32, v as f32));
            }
        }
        vs
    }

    /// Closes the far end: a living twig with a point, a broken branch with a flat cut.
    fn end(&self, rings: &[Ring], n: usize, first: u32, zone: Zone, mesh: &mut Mesh) {
        let last = rings[rings.len() - 1];
        let along = tangent(rings, rings.len() - 1);
        let material = self.material(last, last, zone);
        let uv = mesh.uvs[first as usize];
        let beyond = if self.axis.dead || self.pointed {
            0.0
        } else {
            last.radius
        };
        let tip = last.centre + along * beyond;
        if self.pointed {
            // A point has no normal of its own: every side has its own.
            for j in 0..n as u32 {
                let [a, b] = [first + j, first + j + 1].map(|k| mesh.normals[k as usize]);
                let apex = mesh.positions.len() as u32;
                mesh.positions.push(tip.as_vec3());
                mesh.normals.push((a + b).normalize_or(a));
                mesh.uvs.push(uv);
                mesh.triangles.push(Triangle {
                    corners: [first + j, first + j + 1, apex],
                    material,
                });
            }
            return;
        }
        let mut ring = first;
        if self.axis.dead {
            ring = mesh.positions.len() as u32;
            for j in 0..=n {
                mesh.positions.push(mesh.positions[first as usize + j]);
                mesh.normals.push(along.as_vec3());
                mesh.uvs.push(mesh.uvs[first as usize + j]);
            }
        }
        let apex = mesh.positions.len() as u32;
        mesh.positions.push(tip.as_vec3());
        mesh.normals.push(along.as_vec3());
        mesh.uvs.push(uv);
        for j in 0..n as u32 {
            mesh.triangles.push(Triangle {
                corners: [ring + j, ring + j + 1, apex],
                material,
            });
        }
    }

    /// The material of a piece, by its order and the radius of its thicker end.
    fn material(&self, a: Ring, b: Ring, zone: Zone) -> MaterialId {
        let m = self.materials;
        if a.radius.max(b.radius) <= self.tessellation.trunk_radius_m {
            if self.axis.dead { m.dead } else { m.branch }
        } else if self.snag {
            m.snag
        } else if let Some(flare) = self.flare {
            if 0.5 * (a.centre.z + b.centre.z) < flare.top_m() && zone != Zone::Upper {
                m.flare
            } else {
                match zone {
                    Zone::Lower => m.stem,
                    Zone::Change => m.change,
                    Zone::Upper => m.upper,
                }
            }
        } else {
            m.limb
        }
    }
}

/// Which of the species' barks a piece of a stem has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Zone {
    Lower,
    Change,
    Upper,
}

/// How bark is mapped to an axis: a whole number of repetitions around it, and the picture's
/// proportions along it. On a stem v is 0 at the ground, so that moss is at the foot, and the lower
/// bark turns into the upper one within one repetition of the picture.
struct BarkMap {
    wraps: f64,
    u0: f64,
    v0: f64,
    /// u per v: a spiral grain of 5 to 7 degrees. Without it one picture would repeat straight
    /// above itself.
    spiral: f64,
    /// v per metre.
    per_m: f64,
    /// v where the change of bark begins; a whole number.
    change: f64,
    is_stem: bool,
}

impl BarkMap {
    fn new(tube: &Tube<'_>, rings: &[Ring]) -> Self {
        let is_stem = tube.axis.order == 0;
        let reference = rings[if is_stem { rings.len() / 3 } else { 0 }].radius;
        let around = TAU * reference;
        // With three repetitions around the stem, two would be visible at once.
        let wraps = (around / TILE_M[0]).round().clamp(1.0, 2.0);
        // The bark of thin wood is finer and that of old trees coarser, so the picture keeps its
        // proportions within these limits.
        let finer = (wraps * TILE_M[0] / around).clamp(0.4, 4.0);
        let per_m = finer / TILE_M[1];
        let mut rng = tube.axis.key.domain(BARK).rng();
        let (mut u0, mut v0) = (0.0, rng.unit_f64());
        let side = if rng.chance(0.5) { 1.0 } else { -1.0 };
        let spiral = side * rng.range_f64(SPIRAL[0], SPIRAL[1]);
        if is_stem {
            u0 = v0;
            v0 = rings[0].centre.z * per_m;
        }
        Self {
            wraps,
            u0,
            v0,
            spiral,
            per_m,
            change: (tube.upper_from_m * per_m).round(),
            is_stem,
        }
    }

    fn zone(&self, v: f64) -> Zone {
        if !self.is_stem || v >= self.change + 1.0 {
            Zone::Upper
        } else if v >= self.change {
            Zone::Change
        } else {
            Zone::Lower
        }
    }

    /// The rings, with two more on a stem where the zones meet.
    fn with_borders(&self, rings: &[Ring]) -> Vec<Ring> {
        let mut out = vec![rings[0]];
        let mut v = self.v0;
        for pair in rings.windows(2) {
            let next = v + pair[1].centre.distance(pair[0].centre) * self.per_m;
            for border in [self.change, self.change + 1.0] {
                let t = (border - v) / (next - v).max(1e-12);
                if self.is_stem && t > 1e-3 && t < 1.0 - 1e-3 {
                    out.push(Ring {
                        centre: pair[0].centre.lerp(pair[1].centre, t),
                        radius: pair[0].radius + (pair[1].radius - pair[0].radius) * t,
                    });
                }
            }
            out.push(pair[1]);
            v = next;
        }
        out
    }
}

/// The direction of a ring's axis: the mean of the pieces that meet in it.
fn tangent(rings: &[Ring], i: usize) -> DVec3 {
    let piece = |k: usize| (rings[k + 1].centre - rings[k].centre).normalize_or(DVec3::Z);
    match i {
        0 => piece(0),
        i if i == rings.len() - 1 => piece(i - 1),
        i => (piece(i - 1) + piece(i)).normalize_or(DVec3::Z),
    }
}

/// Diameter of the circle with the area of a level cut through closed walls, metres: the shoelace
/// sum over the pieces in which the triangles meet the plane.
pub(super) fn diameter_at(mesh: &Mesh, triangles: Range<usize>, z: f64) -> f64 {
    let mut twice_area = 0.0;
    for triangle in &mesh.triangles[triangles] {
        let p = triangle
            .corners
            .map(|c| mesh.positions[c as usize].as_dvec3());
        // Entry and exit of the plane, in the triangle's sense of turning.
        let crossing = |rising: bool| {
            (0..3).find_map(|k| {
                let (a, b) = (p[k], p[(k + 1) % 3]);
                let crosses = if rising {
                    a.z < z && b.z >= z
                } else {
                    a.z >= z && b.z < z
                };
                crosses.then(|| a.lerp(b, (z - a.z) / (b.z - a.z)))
            })
        };
        if let (Some(a), Some(b)) = (crossing(false), crossing(true)) {
            twice_area += a.x * b.y - a.y * b.x;
        }
    }
    (2.0 * twice_area.abs() / PI).sqrt()
}

#[cfg(test)]
mod tests {
    use nemoral_seed::Key;

    use super::*;
    use crate::tree::{FoliageCard, GrownTree, GrowthParams, Species, TreeSize, grow};

    fn key(i: u64) -> Key {
        Key::world(7).domain(Domain::new("test.sweep")).item(i)
    }

    /// Each part of a tree has its own material.
    fn materials() -> TreeMaterials {
        TreeMaterials {
            stem: MaterialId(0),
            change: MaterialId(1),
            upper: MaterialId(2),
            flare: MaterialId(3),
            limb: MaterialId(4),
            branch: MaterialId(5),
            dead: MaterialId(6),
            snag: MaterialId(7),
            foliage: vec![FoliageCard {
                material: MaterialId(8),
                width_m: 0.4,
                height_m: 0.42,
                opaque_fraction: 0.5,
            }],
        }
    }

    #[test]
    fn a_ring_has_the_area_of_its_circle() {
        let ends = [DVec3::ZERO, DVec3::new(0.4, -0.3, 1.2)];
        let axis = Axis {
            order: 1,
            dead: false,
            points: ends.to_vec(),
            parent: None,
            leafy_from: 2.0,
            key: key(0),
        };
        let tube = Tube {
            axis: &axis,
            pointed: false,
            flare: None,
            snag: false,
            upper_from_m: f64::INFINITY,
            materials: &materials(),
            tessellation: Tessellation {
                trunk_radius_m: 0.04,
                tolerance: 1.0,
            },
        };
        let radii = [0.31, 0.02];
        let rings = [0, 1].map(|i| Ring {
            centre: ends[i],
            radius: radii[i],
        });
        for n in 3..=20 {
            let grid = tube.grid(&rings, n);
            for (corners, ring) in grid.chunks(n + 1).zip(rings) {
                // The last corner is the first one again.
                let twice: DVec3 = corners
                    .windows(2)
                    .map(|w| (w[0] - ring.centre).cross(w[1] - ring.centre))
                    .sum();
                let circle = PI * ring.radius * ring.radius;
                let share = 0.5 * twice.length() / circle;
                assert!((share - 1.0).abs() < 1e-5, "{n} sides: {share}");
            }
        }
    }

    /// Upright trees of species with one stem to the top, because a level cut of a leaning stem is
    /// an ellipse.
    fn upright() -> impl Iterator<Item = (Species, TreeSize, Flare, GrownTree)> {
        let species = [
            Species::maritime_pine(),
            Species::norway_spruce(),
            Species::eucalyptus(),
            Species::douglas_fir(),
            Species::silver_birch(),
        ];
        species.into_iter().zip(0..).map(|(species, i)| {
            let size = TreeSize {
                lean_rad: 0.0,
                ..species.draw_size(0.34, key(i))
            };
            let params = GrowthParams::default();
            let tree = grow(&species, &size, &materials(), &params, key(i)).expect("grows");
            let flare = Flare::new(&species.stem, &size, key(i));
            (species, size, flare, tree)
        })
    }

    #[test]
    fn stems_taper_as_their_species() {
        for (species, size, _, tree) in upright() {
            let of_stem = |t: &Triangle| t.material <= materials().flare;
            let end = tree.mesh.triangles.iter().rposition(of_stem);
            let stem = 0..end.expect("a stem") + 1;
            for x in [0.3, 0.5, 0.7] {
                let z = x * size.height_m;
                let taper_m = 2.0 * species.stem.taper.radius_m(&size, z);
                let share = diameter_at(&tree.mesh, stem.clone(), z) / taper_m;
                // Between two rings a stem is a cone, which lies inside of the curve.
                assert!(
                    (0.98..1.01).contains(&share),
                    "{} at {x}: {share}",
                    species.name
                );
            }
        }
    }

    #[test]
    fn stems_have_the_volume_of_their_taper() {
        const STEPS: u32 = 2000;
        const AROUND: u32 = 90;
        for (species, size, flare, tree) in upright() {
            let step = size.height_m / f64::from(STEPS);
            let slice = |i: u32| {
                let z = (f64::from(i) + 0.5) * step;
                let r = species.stem.taper.radius_m(&size, z);
                let azimuth = |k: u32| TAU * f64::from(k) / f64::from(AROUND);
                let squares = (0..AROUND).map(|k| (r * flare.factor(azimuth(k), z)).powi(2));
                step * PI * squares.sum::<f64>() / f64::from(AROUND)
            };
            let share = tree.stem.volume_m3() / (0..STEPS).map(slice).sum::<f64>();
            assert!((share - 1.0).abs() < 0.03, "{}: {share}", species.name);
        }
    }
}
