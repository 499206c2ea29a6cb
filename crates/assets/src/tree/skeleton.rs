//! The course of the wood: axes of every order, without thickness.

mod branching;
mod centre_line;

use std::f64::consts::TAU;

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_seed::{Domain, Draw, Key};

use self::branching::{bent_up, insertion, nodes, walk};
use self::centre_line::CentreLine;
use super::edge::CrownBase;
use super::envelope::Envelope;
use super::{BranchLevel, Species, TreeSize};

const BRANCH: Domain = Domain::new("assets.tree.branch");
const LEADER: Domain = Domain::new("assets.tree.leader");
const DEAD: Domain = Domain::new("assets.tree.dead");

/// Breast height. The stem is not bent or stretched below it, so that its diameter stays as
/// demanded.
pub(super) const BREAST_M: f64 = 1.3;

/// A stem, branch or twig.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// The order: 0 for the stem, 1 for its branches, and so on.
    pub(super) order: usize,
    pub(super) dead: bool,
    /// The points from the base to the tip; a branch starts on its parent's centre line.
    pub(super) points: Vec<DVec3>,
    /// The parent and the position on it: points counted from its base, with a fraction.
    pub(super) parent: Option<(usize, f64)>,
    /// The share of its length beyond which it bears leaves.
    pub(super) leafy_from: f64,
    pub(super) key: Key,
}

impl Axis {
    /// The point at `s`, points counted from the base, with a fraction.
    pub(super) fn at(&self, s: f64) -> DVec3 {
        let i = (s as usize).min(self.points.len() - 2);
        self.points[i].lerp(self.points[i + 1], s - i as f64)
    }

    /// The unit direction at `s`.
    pub(super) fn direction(&self, s: f64) -> DVec3 {
        let i = (s as usize).min(self.points.len() - 2);
        (self.points[i + 1] - self.points[i]).normalize_or(DVec3::Z)
    }

    /// Arc length from the base to each point.
    pub(super) fn arcs(&self) -> Vec<f64> {
        let mut arc = 0.0;
        let mut arcs = vec![0.0];
        arcs.extend(self.points.windows(2).map(|w| {
            arc += w[0].distance(w[1]);
            arc
        }));
        arcs
    }
}

/// The position (points with a fraction) of an arc length.
pub(super) fn param_of_arc(arcs: &[f64], arc: f64) -> f64 {
    let i = arcs.partition_point(|&a| a <= arc).clamp(1, arcs.len() - 1);
    let (a, b) = (arcs[i - 1], arcs[i]);
    let t = if b > a { (arc - a) / (b - a) } else { 0.0 };
    (i - 1) as f64 + t.clamp(0.0, 1.0)
}

/// `v` turned by `angle` about the unit vector `axis` (Rodrigues), with libm's sine and cosine.
pub(super) fn turn(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = libm::sincos(angle);
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

/// A level unit vector perpendicular to a direction; for a vertical direction, east.
pub(super) fn beside(direction: DVec3) -> DVec3 {
    direction
        .cross(DVec3::Z)
        .try_normalize()
        .unwrap_or(DVec3::X)
}

/// Grows axes of one tree.
pub(super) struct Grower<'a> {
    species: &'a Species,
    size: &'a TreeSize,
    base: CrownBase,
    envelope: Envelope,
    /// Nodes per metre relative to the species' spacing; below 1 to keep within a triangle budget.
    density: f64,
    axes: Vec<Axis>,
}

/// The species' form at this size: young trees keep their leading shoot, and saplings' shoots are
/// short.
fn grown_so_far(species: &Species, size: &TreeSize) -> Species {
    let mut form = species.clone();
    let young = 1.0 - species.maturity(size.dbh_m);
    form.stem.apical_dominance += 0.6 * young * (0.9 - form.stem.apical_dominance).max(0.0);
    let short = (size.height_m / FULL_SHOOTS_M).clamp(0.25, 1.0);
    if short < 1.0 {
        form.stem.apical_dominance = form.stem.apical_dominance.max(0.9);
        for level in &mut form.levels {
            level.node_spacing_m = (level.node_spacing_m * short).max(0.08);
            level.length_min_m = (level.length_min_m * short).max(0.05);
            level.joint_m = (level.joint_m * short).max(0.08);
        }
    }
    form
}

/// The height of trees, metres, from which on their shoots have the length that the species gives.
const FULL_SHOOTS_M: f64 = 6.0;

/// The tree's axes; parents come before their children, the stem first. `sunk_m` is the depth of
/// its foot, `shaded_base_m` where the crown begins on the side of -x, if that is another height.
pub(super) fn skeleton(
    species: &Species,
    (size, shaded_base_m): (&TreeSize, Option<f64>),
    margin_m: f64,
    sunk_m: f64,
    density: f64,
    lean: DVec2,
    key: Key,
) -> Vec<Axis> {
    let crown = species.young_crown.map_or(species.crown, |young| {
        species
            .crown
            .grown_from(young, species.maturity(size.dbh_m))
    });
    let base = CrownBase::new(size, shaded_base_m);
    let envelope = Envelope::new((size, &base), crown, margin_m, lean, key);
    let species = &grown_so_far(species, size);
    let mut grower = Grower {
        species,
        size,
        base,
        envelope,
        density,
        axes: Vec::new(),
    };
    grower.stem(margin_m, sunk_m, lean, key);
    grower.limbs(key);
    grower.dead(key);
    grower.axes
}

impl Grower<'_> {
    fn stem(&mut self, margin_m: f64, sunk_m: f64, lean: DVec2, key: Key) {
        let (size, stem) = (self.size, &self.species.stem);
        // A stem forks where it would in the wood.
        let base = self.base.highest_m();
        let crown = size.height_m - base;
        let top = base + stem.apical_dominance * crown;
        let top = top.min(size.height_m - margin_m);
        let line = CentreLine::new(self.species, top, lean, key);
        let foot = [-sunk_m, -0.12, 0.0, 0.12, 0.28, 0.5, 0.85, BREAST_M];
        let rest = ((top - BREAST_M) / (size.height_m / 18.0).max(0.4))
            .ceil()
            .max(1.0);
        let heights = foot
            .into_iter()
            .chain((1..=rest as u32).map(|i| BREAST_M + (top - BREAST_M) * f64::from(i) / rest));
        self.axes.push(Axis {
            order: 0,
            dead: false,
            points: heights.map(|z| line.at(z)).collect(),
            parent: None,
            leafy_from: if stem.leafy > 0.0 {
                1.0 - stem.leafy * crown / (top + sunk_m)
            } else {
                2.0
            },
            key,
        });
    }

    /// First-order branches, node by node up the crown.
    fn limbs(&mut self, key: Key) {
        let Some(&level) = self.species.levels.first() else {
            return;
        };
        let stem = &self.axes[0];
        let (base, top) = (self.base.lowest_m(), stem.points[stem.points.len() - 1].z);
        let [from, to] = level.zone.map(|t| base + t * (top - base));
        for (node, z, azimuth) in nodes(&level, to - from, self.limb_density(), key.domain(BRANCH))
        {
            let (z, t) = (from + z, z / (to - from));
            let (level, t) = self.base.limb(&level, z, top).unwrap_or((level, t));
            let s = self.stem_param(z);
            let (origin, along) = (self.axes[0].at(s), self.axes[0].direction(s));
            let branch_key = key.domain(BRANCH).item(node);
            let mut rng = branch_key.rng();
            let direction = insertion(&level, along, t, azimuth, &mut rng);
            if z < self.base.towards_m(direction.truncate()) {
                continue;
            }
            // The branch bends, so its mean heading is that half-way through the bend.
            let heading = bent_up(direction, level.curve_deg[0].to_radians());
            let share = rng.range_f64(level.length[0], level.length[1]);
            let length = share * self.envelope.reach(origin, heading);
            if length >= level.length_min_m {
                self.branch(0, (0, s), direction, length, branch_key);
            }
        }
        if self.species.stem.apical_dominance < 1.0 {
            self.leader(key);
        }
    }

    /// Twigs are thinned out first, limbs only when few twigs are left.
    fn limb_density(&self) -> f64 {
        (self.density / 0.35).min(1.0)
    }

    /// The limb that continues the stem of a decurrent tree where the stem ends.
    fn leader(&mut self, key: Key) {
        let key = key.domain(LEADER);
        let mut rng = key.rng();
        let s = (self.axes[0].points.len() - 1) as f64;
        let (origin, along) = (self.axes[0].at(s), self.axes[0].direction(s));
        let side = turn(beside(along), along, rng.range_f64(0.0, TAU));
        let direction = turn(along, side, rng.range_f64(0.05, 0.2));
        let length = self.envelope.reach(origin, direction);
        self.branch(
            0,
            (0, s),
            direction,
            length.max(self.species.levels[0].length_min_m),
            key,
        );
    }

    /// The parameter of the stem's point at a height.
    fn stem_param(&self, z: f64) -> f64 {
        let heights: Vec<f64> = self.axes[0].points.iter().map(|p| p.z).collect();
        param_of_arc(&heights, z)
    }

    /// A living branch of order `index + 1`, and all that springs from it.
    fn branch(
        &mut self,
        index: usize,
        parent: (usize, f64),
        direction: DVec3,
        length: f64,
        key: Key,
    ) {
        let level = self.species.levels[index];
        let start = self.axes[parent.0].at(parent.1);
        let mut points = walk(&level, start, direction, length, key);
        // A crooked branch may leave the crown earlier than computed, and ends there.
        let inside = points
            .iter()
            .take_while(|&&p| self.envelope.contains(p))
            .count();
        points.truncate(inside.max(3));
        let me = self.axes.len();
        self.axes.push(Axis {
            order: index + 1,
            dead: false,
            points,
            parent: Some(parent),
            leafy_from: level.leafy_from,
            key,
        });
        let Some(&child) = self.species.levels.get(index + 1) else {
            return;
        };
        let arcs = self.axes[me].arcs();
        let length = arcs[arcs.len() - 1];
        let span = (child.zone[1] - child.zone[0]) * length;
        for (node, arc, azimuth) in nodes(&child, span, self.density, key) {
            let arc = child.zone[0] * length + arc;
            let s = param_of_arc(&arcs, arc);
            let (origin, along) = (self.axes[me].at(s), self.axes[me].direction(s));
            let child_key = key.item(node);
            let mut rng = child_key.rng();
            let t = arc / length;
            let direction = insertion(&child, along, t, azimuth, &mut rng);
            let heading = bent_up(direction, child.curve_deg[0].to_radians());
            // Weber and Penn: the farther out on the parent, the shorter.
            let share = rng.range_f64(child.length[0], child.length[1]) * (1.0 - 0.6 * t);
            let wanted = share * length;
            let child_length = wanted.min(self.envelope.reach(origin, heading).max(0.4 * wanted));
            if child_length >= child.length_min_m {
                self.branch(index + 1, (me, s), direction, child_length, child_key);
            }
        }
    }

    /// Dead branches at the nodes below the living crown.
    fn dead(&mut self, key: Key) {
        let dead = &self.species.dead;
        let Some(&level) = self.species.levels.first() else {
            return;
        };
        let to = self.base.highest_m();
        let from = dead.from * to;
        // Stems that fork have nodes at the fork only; their dead branches are spaced like whorls.
        let level = BranchLevel {
            insertion_deg: [dead.insertion_deg; 2],
            curve_deg: [-4.0; 2],
            planar: false,
            leafy_from: 2.0,
            ..level
        };
        for (node, z, azimuth) in nodes(&level, to - from, self.limb_density(), key.domain(DEAD)) {
            let branch_key = key.domain(DEAD).item(node);
            let mut rng = branch_key.rng();
            if !rng.chance(dead.persistence) {
                continue;
            }
            let below = (to - from - z) / (to - from);
            let z = from + z;
            let whole = below < dead.whole_zone && rng.chance(0.7);
            let length = if whole {
                dead.whole
                    * self.size.crown_radius_m
                    * rng.range_f64(0.3, 1.0)
                    * (1.0 - 0.6 * below / dead.whole_zone)
            } else {
                rng.range_f64(dead.stub_m[0], dead.stub_m[1])
            };
            let s = self.stem_param(z);
            let (start, along) = (self.axes[0].at(s), self.axes[0].direction(s));
            let direction = insertion(&level, along, 0.0, azimuth, &mut rng);
            if z > self.base.towards_m(direction.truncate()) {
                continue;
            }
            // A stub's length counts from the bark.
            let length = length + 0.5 * self.size.dbh_m;
            let joints = BranchLevel {
                joint_m: level.joint_m.max(0.4),
                ..level
            };
            let points = walk(&joints, start, direction, length, branch_key);
            self.axes.push(Axis {
                order: 1,
                dead: true,
                points,
                parent: Some((0, s)),
                leafy_from: 2.0,
                key: branch_key,
            });
        }
    }
}
