//! Gaps of a canopy, from its leaves' positions and areas, and from rays cast at their pictures.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_scene::glam::{DVec2, DVec3, Mat3, Vec3};
use nemoral_scene::{
    AlphaMask, Card, InstancePlace, MaterialId, MaterialLibrary, Mesh, ObjectId, Prototype, Ray,
    RayCaster,
};
use nemoral_seed::{Draw, Key};
use rayon::prelude::*;

use crate::leaf_area::projection;

/// The zenith angle at which the projection of leaves hardly depends on their inclination: 0.93 is
/// 1 / (2 cos 57.5°).
pub const HINGE_DEG: f64 = 57.5;
/// Number of sectors of a photograph by azimuth, 15° each.
const SECTORS: usize = 24;
/// Width of the ring around the hinge that is evaluated, degrees.
const RING_DEG: f64 = 10.0;
/// Number of lines in each sector.
const SECTOR_LINES: usize = 256;
/// Height at which lines begin, that of an instrument, metres.
const FROM_M: f64 = 1.3;
/// Number of parts along each side of a card. A part is about as large as a leaf, as leaf area is
/// not uniform over a card.
const PARTS: usize = 8;

/// A height above all trees, metres.
const TOP_M: f64 = 80.0;

/// A tree that stands on level ground.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Shape of the tree.
    pub shape: Arc<Prototype>,
    /// Position of the foot, metres.
    pub foot_m: DVec2,
    /// Rotation and scale.
    pub linear: Mat3,
    /// One-sided leaf area by the inventory, m².
    pub leaf_area_m2: f64,
}

/// Projected leaf area along the hinge, in voxels.
#[derive(Clone, Debug)]
pub struct LeafField {
    low: DVec3,
    voxel_m: f64,
    counts: [usize; 3],
    /// Projected leaf area of each voxel, m².
    projected_m2: Vec<f32>,
}

/// The gaps of a canopy along the hinge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaps {
    /// The leaf area index above the lines, by the inventory.
    pub leaf_area_index: f64,
    /// Silhouette of the pictures over leaf area, which is lower the more the leaves of a shoot
    /// hide each other.
    pub shoots: f64,
    /// Mean projection of a unit of silhouette along the hinge, over ½.
    pub projection: f64,
    /// Ω above the shoot: of crowns and of stem positions.
    pub crowns: f64,
    /// The expected share of lines without a leaf, by the leaves' positions and areas.
    pub expected: f64,
}

impl Gaps {
    /// Ω of all levels, with which gaps are exp(-0.93 Ω LAI).
    #[must_use]
    pub fn clumping(&self) -> f64 {
        self.shoots * self.projection * self.crowns
    }
}

impl LeafField {
    /// An empty field over a square from `low_m`, of this height.
    #[must_use]
    pub fn new(low_m: DVec2, edge_m: f64, height_m: f64, voxel_m: f64) -> Self {
        let across = (edge_m / voxel_m).ceil() as usize;
        let counts = [across, across, (height_m / voxel_m).ceil() as usize + 1];
        Self {
            low: low_m.extend(0.0),
            voxel_m,
            counts,
            projected_m2: vec![0.0; counts.iter().product()],
        }
    }

    fn index(&self, at: DVec3) -> Option<usize> {
        let cell = ((at - self.low) / self.voxel_m).floor();
        if cell.min_element() < 0.0 {
            return None;
        }
        let [nx, ny, nz] = self.counts;
        let (x, y, z) = (cell.x as usize, cell.y as usize, cell.z as usize);
        (x < nx && y < ny && z < nz).then_some((z * ny + y) * nx + x)
    }

    /// Adds projected leaf area at a place; area outside of the field is left out.
    pub fn add(&mut self, at: DVec3, projected_m2: f64) {
        if let Some(i) = self.index(at) {
            self.projected_m2[i] += projected_m2 as f32;
        }
    }

    /// Projected leaf area along a line per cross-section, which is the mean number of leaves that
    /// it meets.
    #[must_use]
    pub fn along(&self, origin: DVec3, direction: DVec3) -> f64 {
        let step_m = 0.5 * self.voxel_m;
        let top_m = self.counts[2] as f64 * self.voxel_m;
        let steps = ((top_m - origin.z) / direction.z / step_m).ceil().max(0.0) as usize;
        let sum: f64 = (0..steps)
            .filter_map(|i| self.index(origin + direction * (step_m * (i as f64 + 0.5))))
            .map(|i| f64::from(self.projected_m2[i]))
            .sum();
        sum * step_m / self.voxel_m.powi(3)
    }

    /// The same leaves in voxels of twice the size.
    #[must_use]
    pub fn coarser(&self) -> Self {
        let counts = self.counts.map(|n| n.div_ceil(2));
        let mut projected_m2 = vec![0.0; counts.iter().product()];
        let [nx, ny, _] = self.counts;
        for (i, v) in self.projected_m2.iter().enumerate() {
            let (x, y, z) = (i % nx / 2, i / nx % ny / 2, i / nx / ny / 2);
            projected_m2[(z * counts[1] + y) * counts[0] + x] += v;
        }
        Self {
            low: self.low,
            voxel_m: 2.0 * self.voxel_m,
            counts,
            projected_m2,
        }
    }

    /// Edge of a voxel, metres.
    #[must_use]
    pub fn voxel_m(&self) -> f64 {
        self.voxel_m
    }

    /// The mean of L over lines, and the mean of exp(-L).
    #[must_use]
    pub fn over(&self, lines: &[(DVec3, DVec3)]) -> (f64, f64) {
        let n = lines.len() as f64;
        let (mut sum, mut gaps) = (0.0, 0.0);
        for &(origin, direction) in lines {
            let depth = self.along(origin, direction);
            sum += depth;
            gaps += (-depth).exp();
        }
        (sum / n, gaps / n)
    }
}

/// Trees on level ground, and lines up through the middle of them.
#[derive(Debug)]
pub struct Canopy {
    /// Lines along the hinge, each from its own place.
    pub lines: Vec<(DVec3, DVec3)>,
    square: (DVec2, f64),
    trees: Vec<Tree>,
    leaves: RayScene,
    everything: RayScene,
}

/// A tree that lines are tested against.
#[derive(Debug)]
struct Tree {
    foot: DVec3,
    linear: Mat3,
    inverse: Mat3,
    scale: f64,
    leaf_area_m2: f64,
    leaves: Arc<Leaves>,
}

impl Canopy {
    /// A canopy of the trees in a square. Lines begin at least `margin_m` inside of the border,
    /// which should be 1.6 times the height of the trees.
    ///
    /// # Panics
    /// If a card has no mask.
    #[must_use]
    pub fn new(
        standing: &[Standing],
        materials: &MaterialLibrary,
        (low_m, edge_m): (DVec2, f64),
        margin_m: f64,
        lines: usize,
    ) -> Self {
        let mut shapes: BTreeMap<*const Prototype, Arc<Leaves>> = BTreeMap::new();
        let mut trees = Vec::new();
        for tree in standing {
            let leaves = shapes
                .entry(Arc::as_ptr(&tree.shape))
                .or_insert_with(|| Arc::new(Leaves::of(&tree.shape, materials)));
            trees.push(Tree {
                foot: tree.foot_m.extend(0.0),
                linear: tree.linear,
                inverse: tree.linear.inverse(),
                scale: f64::from(tree.linear.z_axis.length()),
                leaf_area_m2: tree.leaf_area_m2,
                leaves: Arc::clone(leaves),
            });
        }
        let mut rng = Key::world(12).rng();
        let (sin, cos) = HINGE_DEG.to_radians().sin_cos();
        let lines = (0..lines)
            .map(|_| {
                let mut place = || rng.range_f64(margin_m, edge_m - margin_m);
                let foot = low_m + DVec2::new(place(), place());
                let (s, c) = rng.range_f64(0.0, TAU).sin_cos();
                (foot.extend(FROM_M), DVec3::new(sin * c, sin * s, cos))
            })
            .collect();
        Self {
            lines,
            square: (low_m, edge_m),
            trees,
            leaves: forest(standing, materials, true),
            everything: forest(standing, materials, false),
        }
    }

    /// Gaps by the leaves' positions and areas, without casting rays at masks.
    ///
    /// A line passes each part of a card that it crosses with probability 1 - q, where q is the
    /// part's share of leaf (Nilson's positive binomial within the shoot, 1971). The probability
    /// that a line is free is the product of these, and the canopy's gaps are its mean over lines.
    /// It contains all clumping above the size of a leaf: of shoots, of crowns and of stem
    /// positions.
    #[must_use]
    pub fn gaps(&self) -> Gaps {
        let along: Vec<(f64, f64)> = self.lines.par_iter().map(|l| self.along(*l)).collect();
        let mean =
            |of: fn(&(f64, f64)) -> f64| along.iter().map(of).sum::<f64>() / along.len() as f64;
        let (mean, expected) = (mean(|a| a.0), mean(|a| a.1));
        let (mut projected, mut silhouette, mut area) = (0.0, 0.0, 0.0);
        for tree in &self.trees {
            projected += tree.scale * tree.scale * tree.leaves.projected_m2;
            silhouette += tree.scale * tree.scale * tree.leaves.silhouette_m2;
            area += tree.leaf_area_m2;
        }
        let (shoots, projection) = (silhouette / area, 2.0 * projected / silhouette);
        Gaps {
            leaf_area_index: mean * HINGE_DEG.to_radians().cos() / (0.5 * shoots * projection),
            shoots,
            projection,
            crowns: -expected.ln() / mean,
            expected,
        }
    }

    /// The mean number of leaves that a line meets, and the probability that it meets none.
    fn along(&self, (origin, direction): (DVec3, DVec3)) -> (f64, f64) {
        let level = direction.truncate().normalize();
        let (mut met, mut free) = (0.0, 1.0);
        for tree in &self.trees {
            let to = (tree.foot - origin).truncate();
            let reach_m = tree.scale * tree.leaves.reach_m;
            if to.perp_dot(level).abs() > reach_m || to.dot(level) < -reach_m {
                continue;
            }
            let from = tree.inverse * (origin - tree.foot).as_vec3();
            // The direction is not of unit length, as the tree's own frame is scaled.
            let along = tree.inverse * direction.as_vec3();
            tree.leaves.cross(from, along, |q| {
                met += q;
                free *= 1.0 - q;
            });
        }
        (met, free)
    }

    /// Ω as photographs of the sky measure it, from the feet of this many lines. For each
    /// photograph it is ln(mean P) / mean(ln P) (Lang and Xiang 1986), with the share P of sky in
    /// each sector of the ring at the hinge, where wood hides the sky too and a sector without sky
    /// counts as half a line; the result is the mean over photographs. It misses clumping inside of
    /// a sector and from one photograph to the next, so it is nearer to 1 than [`Gaps::clumping`]
    /// (as Woodgate et al. 2017 found in a virtual forest, the more the lower one looks).
    #[must_use]
    pub fn clumping_as_photographed(&self, photographs: usize) -> f64 {
        let mut rng = Key::world(14).rng();
        let mut lines = Vec::new();
        for (foot, _) in self.lines.iter().take(photographs) {
            for line in 0..SECTORS * SECTOR_LINES {
                let azimuth = (line / SECTOR_LINES) as f64 + rng.unit_f64();
                let (s, c) = (TAU * azimuth / SECTORS as f64).sin_cos();
                let zenith_deg = HINGE_DEG + RING_DEG * (rng.unit_f64() - 0.5);
                let (sin, cos) = zenith_deg.to_radians().sin_cos();
                lines.push((*foot, DVec3::new(sin * c, sin * s, cos)));
            }
        }
        let sky = free(&self.everything, &lines);
        let share = |s: &[bool]| {
            let seen = s.iter().filter(|s| **s).count() as f64;
            seen.max(0.5) / s.len() as f64
        };
        let of_photograph = |s: &[bool]| {
            let sectors = s.chunks(SECTOR_LINES);
            let logs: f64 = sectors.map(|s| share(s).ln()).sum();
            share(s).ln() / (logs / SECTORS as f64)
        };
        let each = sky.chunks(SECTORS * SECTOR_LINES).map(of_photograph);
        each.sum::<f64>() / photographs as f64
    }

    /// Ω of silhouettes at random places inside of voxels, -ln(mean exp(-L)) / mean L over lines,
    /// for octaves of voxel sizes from `voxel_m` up: it shows what each scale contributes.
    #[must_use]
    pub fn clumping_by_scale(&self, voxel_m: f64, octaves: usize) -> Vec<(f64, f64)> {
        let top_m = |t: &Tree| t.scale * t.leaves.top_m;
        let height_m = self.trees.iter().map(top_m).fold(1.0, f64::max);
        let mut field = LeafField::new(self.square.0, self.square.1, height_m, voxel_m);
        for tree in &self.trees {
            for (at, projected_m2) in &tree.leaves.points {
                let at = tree.foot + (tree.linear * *at).as_dvec3();
                field.add(at, projected_m2 * tree.scale * tree.scale);
            }
        }
        let mut out = Vec::new();
        for _ in 0..octaves {
            let (mean, expected) = field.over(&self.lines);
            out.push((field.voxel_m(), -expected.ln() / mean));
            field = field.coarser();
        }
        out
    }

    /// The share of the lines that meet no leaf, through the masks.
    #[must_use]
    pub fn leafless(&self) -> f64 {
        open(&self.leaves, &self.lines)
    }

    /// The share of the lines that meet nothing of a tree.
    #[must_use]
    pub fn openness(&self) -> f64 {
        open(&self.everything, &self.lines)
    }

    /// Heights above ground of the first returns of pulses straight down at the feet of the lines,
    /// metres.
    #[must_use]
    pub fn first_returns_m(&self) -> Vec<f64> {
        let ray = |(foot, _): &(DVec3, DVec3)| Ray::new(foot.with_z(TOP_M).as_vec3(), Vec3::NEG_Z);
        let rays: Vec<Ray> = self.lines.iter().map(ray).collect();
        let mut hits = vec![None; rays.len()];
        self.everything.closest_hits(&rays, &mut hits);
        hits.iter()
            .map(|h| h.map_or(0.0, |h| TOP_M - f64::from(h.surface.distance_m)))
            .collect()
    }

    /// The share of lines to the zenith, from where the others begin, that meet nothing of a tree.
    #[must_use]
    pub fn openness_above(&self) -> f64 {
        let up = self.lines.iter().map(|(origin, _)| (*origin, DVec3::Z));
        open(&self.everything, &up.collect::<Vec<_>>())
    }
}

/// The share of lines that meet nothing.
fn open(forest: &RayScene, lines: &[(DVec3, DVec3)]) -> f64 {
    let free = free(forest, lines);
    free.iter().filter(|f| **f).count() as f64 / lines.len() as f64
}

/// Whether each line meets nothing.
fn free(forest: &RayScene, lines: &[(DVec3, DVec3)]) -> Vec<bool> {
    let ray = |(o, d): &(DVec3, DVec3)| Ray::new(o.as_vec3(), d.as_vec3());
    let rays: Vec<Ray> = lines.iter().map(ray).collect();
    let mut hits = vec![None; rays.len()];
    forest.closest_hits(&rays, &mut hits);
    hits.iter().map(Option::is_none).collect()
}

/// Side of the squares by which trees are grouped, metres.
const GROUP_M: f64 = 25.0;

fn forest(trees: &[Standing], materials: &MaterialLibrary, leaves_only: bool) -> RayScene {
    let mut shapes: BTreeMap<*const Prototype, Arc<Blas>> = BTreeMap::new();
    let mut groups: BTreeMap<[i64; 2], Vec<(InstancePlace, Arc<Blas>)>> = BTreeMap::new();
    for tree in trees {
        let blas = shapes
            .entry(Arc::as_ptr(&tree.shape))
            .or_insert_with(|| {
                let shape = if leaves_only {
                    let cards = tree.shape.cards().to_vec();
                    let leaves = Prototype::new("leaves", Mesh::default(), cards, materials);
                    Arc::new(leaves.expect("they are a tree's"))
                } else {
                    Arc::clone(&tree.shape)
                };
                Arc::new(Blas::build(shape, materials))
            })
            .clone();
        let cell = (tree.foot_m / GROUP_M).floor();
        let instance = InstancePlace {
            position_m: (tree.foot_m - cell * GROUP_M).as_vec2().extend(0.0),
            linear: tree.linear,
            object: ObjectId::NONE,
            variation: 0.0,
        };
        let at = [cell.x as i64, cell.y as i64];
        groups.entry(at).or_default().push((instance, blas));
    }
    let placed = groups.into_iter().map(|([x, y], instances)| {
        let origin = DVec2::new(x as f64, y as f64) * GROUP_M;
        let origin: Vec3 = origin.as_vec2().extend(0.0);
        (origin, Arc::new(Group::build(instances)))
    });
    RayScene::new(placed.collect())
}

/// A shape's leaves, as areas at places.
#[derive(Debug)]
struct Leaves {
    /// The middle of each part of each card, and its projection along the hinge, m².
    points: Vec<(Vec3, f64)>,
    cards: Vec<(Card, Arc<Shares>)>,
    /// Horizontal distance of the farthest card corner from the foot, metres.
    reach_m: f64,
    /// Height of the highest card corner, metres.
    top_m: f64,
    projected_m2: f64,
    silhouette_m2: f64,
}

/// The share of leaf in each part of a picture.
type Shares = [f64; PARTS * PARTS];

impl Leaves {
    fn of(shape: &Prototype, materials: &MaterialLibrary) -> Self {
        let mut shares: BTreeMap<MaterialId, Arc<Shares>> = BTreeMap::new();
        let mut out = Self {
            points: Vec::new(),
            cards: Vec::new(),
            reach_m: 0.0,
            top_m: 0.0,
            projected_m2: 0.0,
            silhouette_m2: 0.0,
        };
        for card in shape.cards() {
            let of = shares.entry(card.material).or_insert_with(|| {
                let mask = materials.get(card.material).mask.as_deref();
                Arc::new(opaque_parts(mask.expect("leaves are cut out")))
            });
            let part_m2 = f64::from(card.area_m2()) / (PARTS * PARTS) as f64;
            let g = hinge_projection(card);
            for (i, share) in of.iter().enumerate().filter(|(_, s)| **s > 0.0) {
                let part = |k: usize| (k as f32 + 0.5) / PARTS as f32;
                let (u, v) = (part(i % PARTS), part(i / PARTS));
                let at = card.corner + u * card.edge_u + v * card.edge_v;
                out.silhouette_m2 += share * part_m2;
                out.projected_m2 += share * part_m2 * g;
                out.points.push((at, share * part_m2 * g));
            }
            for corner in card.corners() {
                out.reach_m = out.reach_m.max(f64::from(corner.truncate().length()));
                out.top_m = out.top_m.max(f64::from(corner.z));
            }
            out.cards.push((*card, Arc::clone(of)));
        }
        out
    }

    /// Calls `met` with the share of leaf in each part that a line crosses.
    fn cross(&self, from: Vec3, along: Vec3, mut met: impl FnMut(f64)) {
        for (card, shares) in &self.cards {
            // This is Cramer's rule for from + t along = corner + u edge_u + v edge_v.
            let normal = card.edge_u.cross(card.edge_v);
            let steep = along.dot(normal);
            let to = from - card.corner;
            let aside = to.cross(along);
            let (u, v) = (
                card.edge_v.dot(aside) / -steep,
                card.edge_u.dot(aside) / steep,
            );
            if !(0.0..1.0).contains(&u) || !(0.0..1.0).contains(&v) || to.dot(normal) / steep > 0.0
            {
                continue;
            }
            let part = |x: f32| ((x * PARTS as f32) as usize).min(PARTS - 1);
            let share = shares[part(v) * PARTS + part(u)];
            if share > 0.0 {
                met(share);
            }
        }
    }
}

/// The mean projection of a card along the hinge over all azimuths.
fn hinge_projection(card: &Card) -> f64 {
    let normal = card.edge_u.cross(card.edge_v).as_dvec3();
    let inclination = (normal.z.abs() / normal.length()).min(1.0).acos();
    projection(HINGE_DEG.to_radians(), inclination)
}

/// The opaque share of each part of a mask.
fn opaque_parts(mask: &AlphaMask) -> Shares {
    let mut out = [0.0; PARTS * PARTS];
    let (columns, rows) = (mask.width(), mask.height());
    for row in 0..rows {
        for column in (0..columns).filter(|c| mask.texel(*c, row)) {
            out[row * PARTS / rows * PARTS + column * PARTS / columns] += 1.0;
        }
    }
    let texels = (columns * rows / (PARTS * PARTS)).max(1) as f64;
    out.map(|n| n / texels)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random leaves have an Ω of 1. In half of the columns, Ω is that of two kinds of columns.
    #[test]
    fn fields_of_known_clumping() {
        const VOXEL_M: f64 = 0.5;
        let lines: Vec<(DVec3, DVec3)> = (0..400)
            .map(|i| {
                let at = DVec2::new(f64::from(i % 20), f64::from(i / 20)) + 0.25;
                (at.extend(0.0), DVec3::Z)
            })
            .collect();
        let fill = |mut leaves: Box<dyn FnMut(usize, usize) -> f64>| {
            let mut field = LeafField::new(DVec2::ZERO, 20.0, 3.0, VOXEL_M);
            for (x, y) in (0..40).flat_map(|x| (0..40).map(move |y| (x, y))) {
                let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * VOXEL_M;
                for z in 0..4 {
                    let share = leaves(x, y) / 4.0 * VOXEL_M * VOXEL_M;
                    field.add(at.extend((f64::from(z) + 0.5) * VOXEL_M), share);
                }
            }
            field
        };
        let (mean, gaps) = fill(Box::new(|_, _| 2.0)).over(&lines);
        assert!((mean - 2.0).abs() < 1e-6, "{mean}");
        assert!((gaps - (-2.0_f64).exp()).abs() < 1e-6, "{gaps}");
        let halves = fill(Box::new(|x, _| if x / 2 % 2 == 0 { 4.0 } else { 0.0 }));
        let (mean, gaps) = halves.over(&lines);
        assert!((mean - 2.0).abs() < 1e-6, "{mean}");
        assert!((gaps - 0.5 * (1.0 + (-4.0_f64).exp())).abs() < 1e-6);
        // Voxels larger than the columns do not show the clumping.
        let (_, gaps) = halves.coarser().coarser().over(&lines);
        assert!((gaps - (-2.0_f64).exp()).abs() < 1e-6, "{gaps}");
    }
}
