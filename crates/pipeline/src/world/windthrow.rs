//! Thrown trees: where they stood, and the pits that their root plates left in the ground.

use nemoral_scene::SurfaceSample;
use nemoral_scene::glam::DVec2;
use nemoral_seed::Draw;
use nemoral_stand::{FallenStem, StemKind, StemScale};

use crate::config::LONGEST_LOG_M;

/// No log, thrown or fallen, reaches farther from its middle, metres.
pub const LOG_REACH_M: f64 = LONGEST_LOG_M / 2.0;
/// Length over diameter of a thrown stem without its crown.
const SLENDERNESS: f64 = 36.0;
/// Radius of a root plate over the diameter of its stem: plates are some six diameters wide.
const PLATE: f64 = 3.0;
/// Where the middle of the pit is: so many radii of the plate behind it.
const BEHIND: f64 = 0.75;
/// How deep the pit is, in radii of the plate.
const DEPTH: f64 = 0.38;

/// A tree that a storm threw. Its stem's thick end is at its root plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WindthrownTree {
    pub(crate) stem: FallenStem,
}

impl WindthrownTree {
    /// Their kind of stems in a stand of this mean diameter, metres.
    pub(crate) fn kind(dbh_mean_m: f64) -> StemKind {
        let diameter_m = (1.1 * dbh_mean_m).clamp(0.12, 0.6);
        StemKind {
            weight: 1.0,
            length_m: (SLENDERNESS * diameter_m).clamp(4.0, 14.0),
            radius_m: 0.5 * diameter_m,
            volume_m3: 0.0,
            scale: StemScale::GROWN,
        }
    }

    /// Radius of its root plate, metres.
    pub(crate) fn plate_radius_m(&self) -> f64 {
        (PLATE * 2.0 * self.stem.radius_m).clamp(0.55, 1.35)
    }

    /// Height of the stem's thick end, the plate's centre, above the ground, metres.
    pub(crate) fn held_m(&self) -> f64 {
        0.48 * self.plate_radius_m()
    }

    /// Its number among `count` shapes.
    pub(crate) fn number(&self, count: usize) -> usize {
        self.stem.key.item(7).rng().below(count as u32) as usize
    }

    /// The middle of its pit on the map.
    fn pit_m(&self) -> DVec2 {
        self.stem.ends_m()[0] - self.stem.heading * (BEHIND * self.plate_radius_m())
    }

    fn pit_radius_m(&self) -> f64 {
        1.15 * self.plate_radius_m()
    }

    /// Whether a disk on the map keeps clear of stem, plate and pit.
    pub(crate) fn is_clear_of(&self, world_m: DVec2, radius_m: f64) -> bool {
        let plate = self.stem.ends_m()[0];
        self.stem.distance_m(world_m) > radius_m + self.stem.radius_m + 0.05
            && plate.distance(world_m) > radius_m + self.plate_radius_m()
            && self.pit_m().distance(world_m) > radius_m + self.pit_radius_m()
    }

    /// Whether a stem would lie in this one's stem, plate or pit.
    pub(crate) fn is_near_stem(&self, other: &FallenStem) -> bool {
        let near = |p: DVec2, r: f64| other.distance_m(p) < r + other.radius_m;
        self.stem.meets(other)
            || near(self.stem.ends_m()[0], self.plate_radius_m())
            || near(self.pit_m(), self.pit_radius_m())
    }

    /// Whether it keeps so far from trails by a distance to their edges; the stem itself may lie
    /// across.
    pub(crate) fn is_beside(
        &self,
        edge_m: impl Fn(DVec2) -> f64,
        may_cross: bool,
        verge_m: f64,
    ) -> bool {
        let [plate, tip] = self.stem.ends_m();
        let steps = self.stem.length_m.ceil();
        edge_m(self.pit_m()) > self.pit_radius_m() + verge_m
            && edge_m(plate) > self.plate_radius_m() + verge_m
            && (may_cross
                || (0..=steps as u32).all(|i| {
                    let p = plate.lerp(tip, f64::from(i) / steps);
                    edge_m(p) > self.stem.radius_m + verge_m
                }))
    }

    /// Whether a place is in the bare soil of its pit.
    pub(crate) fn is_pit(&self, world_m: DVec2) -> bool {
        self.pit_m().distance(world_m) < 0.82 * self.pit_radius_m()
    }

    /// Distance from the pit's border, metres; negative inside.
    pub(crate) fn pit_border_m(&self, world_m: DVec2) -> f64 {
        self.pit_m().distance(world_m) - self.pit_radius_m()
    }

    /// Takes the pit from a sample of the ground: a smooth bowl, level at its border.
    pub(crate) fn dig(&self, world_m: DVec2, ground: &mut SurfaceSample) {
        let off = world_m - self.pit_m();
        let r2 = self.pit_radius_m() * self.pit_radius_m();
        let rest = 1.0 - off.length_squared() / r2;
        if rest > 0.0 {
            let depth_m = DEPTH * self.plate_radius_m();
            ground.height_m -= depth_m * rest * rest;
            ground.gradient += off * (4.0 * depth_m * rest / r2);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::ChunkCoord;
    use nemoral_seed::Key;
    use nemoral_stand::fallen_stems;

    fn tree() -> WindthrownTree {
        let kinds = [WindthrownTree::kind(0.3)];
        let at = ChunkCoord::new(0, 0);
        let stems = |seed| fallen_stems(at, 50.0, Key::world(seed), 4.0, &kinds, |_| true);
        let stem = (0..20).find_map(|seed| stems(seed).first().copied());
        WindthrownTree {
            stem: stem.expect("four in a chunk on average"),
        }
    }

    #[test]
    fn a_pit_is_a_bowl_with_its_true_gradient() {
        let tree = tree();
        let height = |p: DVec2| {
            let mut sample = SurfaceSample {
                height_m: 2.0,
                gradient: DVec2::ZERO,
            };
            tree.dig(p, &mut sample);
            sample
        };
        let (middle, r) = (tree.pit_m(), tree.pit_radius_m());
        let deep = 2.0 - height(middle).height_m;
        assert!((0.2..0.6).contains(&deep), "{deep}");
        for i in 0..40 {
            let p = middle + DVec2::from_angle(0.7 * f64::from(i)) * (r * f64::from(i) / 36.0);
            let e = 1e-5;
            let slope =
                |d: DVec2| (height(p + d * e).height_m - height(p - d * e).height_m) / e / 2.0;
            let found = height(p).gradient;
            let measured = DVec2::new(slope(DVec2::X), slope(DVec2::Y));
            assert!(found.distance(measured) < 1e-4, "{found} {measured}");
        }
        assert_eq!(height(middle + DVec2::X * (r + 0.01)).height_m, 2.0);
    }

    #[test]
    fn nothing_stands_in_a_thrown_tree() {
        let tree = tree();
        let [plate, tip] = tree.stem.ends_m();
        for p in [plate, tip, tree.stem.middle_m, tree.pit_m()] {
            assert!(!tree.is_clear_of(p, 0.1));
        }
        let beside = tree.stem.middle_m + tree.stem.heading.perp() * (tree.stem.radius_m + 0.4);
        assert!(tree.is_clear_of(beside, 0.2) && !tree.is_clear_of(beside, 0.5));
    }
}
