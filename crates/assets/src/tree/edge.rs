//! Trees at the edge of a wood, which light reaches from the side: their crowns reach down there.

use nemoral_scene::glam::DVec2;

use super::{BranchLevel, CrownForm, Species, TreeSize};

/// Where the crown of an edge tree begins, as a share of its height, for species that do not say.
const CROWN_BASE: f64 = 0.12;
/// Height of an edge tree relative to that of a tree in the wood that is as thick: nobody crowds
/// it, and wind bends it (our choice; edge trees are stouter).
const HEIGHT: f64 = 0.93;
/// The same of its crown's mean radius: freely grown crowns are 1.3 to 1.5 times as wide as those
/// of stands, and one side is free.
const CROWN_RADIUS: f64 = 1.15;
/// The share of the leaf area of a crown that is longer on all sides, which one side has.
const LEAVES: f64 = 0.6;
/// How much more level limbs that only light from the side keeps alive are than the lowest of a
/// tree in the wood, and the angle from the stem to which they sink at most, degrees.
const SUNK_DEG: [f64; 2] = [20.0, 95.0];
/// How much farther the crown reaches to the light, and less far to the wood, as a share of its
/// radius.
const ASIDE: f64 = 0.2;
/// The least radius of the outline at the crown's base, as a share of the greatest: low branches
/// in the light live long.
const FOOT: f64 = 0.75;

impl Species {
    /// The size of a tree at the edge of a wood, from that of the same tree inside: as thick, a
    /// little lower, with a wider crown and more leaves. Its crown's base is the one on the side of
    /// the light; that in the shade is [`shaded_base_m`](Self::shaded_base_m).
    #[must_use]
    pub fn size_at_edge(&self, inside: &TreeSize) -> TreeSize {
        let height_m = HEIGHT * inside.height_m;
        let share = self.allometry.edge_crown_base.unwrap_or(CROWN_BASE);
        // No lower than grown trees can have it.
        let crown_base_m = (share * height_m).max(0.4).min(self.shaded_base_m(inside));
        let longer = (height_m - crown_base_m) / (inside.height_m - inside.crown_base_m);
        TreeSize {
            height_m,
            crown_base_m,
            crown_radius_m: (CROWN_RADIUS * inside.crown_radius_m).min(15.0),
            leaf_area_m2: (inside.leaf_area_m2 * (1.0 + LEAVES * (longer - 1.0).max(0.0)))
                .min(5_000.0),
            ..*inside
        }
    }

    /// Where the crown of a tree at the edge begins on the side of the wood, metres: as high as
    /// inside.
    #[must_use]
    pub fn shaded_base_m(&self, inside: &TreeSize) -> f64 {
        HEIGHT * inside.crown_base_m
    }
}

/// Where a crown begins on each side of the stem.
#[derive(Clone, Copy, Debug)]
pub(super) struct CrownBase {
    lowest_m: f64,
    shaded_m: Option<f64>,
}

impl CrownBase {
    /// As a size has it; if a height in the shade is given, that on the side of -x.
    pub(super) fn new(size: &TreeSize, shaded_m: Option<f64>) -> Self {
        Self {
            lowest_m: size.crown_base_m,
            shaded_m,
        }
    }

    /// The lowest of all sides, metres.
    pub(super) fn lowest_m(&self) -> f64 {
        self.lowest_m
    }

    /// The highest, metres.
    pub(super) fn highest_m(&self) -> f64 {
        self.shaded_m.unwrap_or(self.lowest_m)
    }

    /// That on the side that a level direction points to, metres: light reaches a third of the
    /// circle wholly, and another third not at all.
    pub(super) fn towards_m(&self, direction: DVec2) -> f64 {
        let Some(shaded_m) = self.shaded_m else {
            return self.lowest_m;
        };
        let light = (direction.normalize_or(DVec2::X).x + 0.5).clamp(0.0, 1.0);
        shaded_m + (self.lowest_m - shaded_m) * light * light * (3.0 - 2.0 * light)
    }

    /// How much farther than its mean a crown reaches in the direction of an azimuth's cosine, as a
    /// share of its radius.
    pub(super) fn aside(&self, cosine: f64) -> f64 {
        self.shaded_m.map_or(0.0, |_| ASIDE * cosine)
    }

    /// The form of a limb at a height, and its place in the crown, 0 to 1; `None` if all sides are
    /// alike. Above the shaded base both are those inside the wood.
    pub(super) fn limb(
        &self,
        level: &BranchLevel,
        height_m: f64,
        top_m: f64,
    ) -> Option<(BranchLevel, f64)> {
        let from_m = self.shaded_m?;
        if height_m >= from_m {
            let t = (height_m - from_m) / (top_m - from_m).max(1e-6);
            return Some((*level, t.min(1.0)));
        }
        let [more_level, most] = SUNK_DEG;
        let [lowest, _] = level.insertion_deg;
        let low = BranchLevel {
            insertion_deg: [(lowest + more_level).min(most).max(lowest); 2],
            ..*level
        };
        Some((low, 0.0))
    }

    /// The outline of a crown that light reaches from the side.
    pub(super) fn form(&self, form: CrownForm) -> CrownForm {
        match self.shaded_m {
            Some(_) => CrownForm {
                base: form.base.max(FOOT),
                ..form
            },
            None => form,
        }
    }
}
