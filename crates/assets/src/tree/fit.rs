//! The last few per cent: stretches what was grown to the size demanded.

use std::f64::consts::FRAC_PI_4;

use nemoral_scene::glam::DVec2;

use super::TreeSize;
use super::foliage::Leaf;
use super::skeleton::{Axis, BREAST_M};

/// What a crown measures.
pub(super) struct Crown {
    pub(super) base_m: f64,
    pub(super) top_m: f64,
    pub(super) radius_m: f64,
}

impl Crown {
    /// Directions in which radii are measured.
    const SECTORS: usize = 8;

    pub(super) fn measure(axes: &[Axis], leaves: &[Leaf], lean: DVec2) -> Self {
        let ends = axes.iter().map(|a| a.points[a.points.len() - 1]);
        let tips = leaves.iter().map(|l| l.at + l.along);
        let tops = leaves.iter().map(|l| l.at.z + l.above_m());
        let top_m = ends.map(|p| p.z).chain(tops).fold(0.0, f64::max);
        let mut heights: Vec<f64> = leaves.iter().map(|l| l.at.z + 0.5 * l.along.z).collect();
        let rank = heights.len() / 50;
        let base_m = if heights.is_empty() {
            top_m
        } else {
            *heights.select_nth_unstable_by(rank, f64::total_cmp).1
        };
        let centre = lean * (0.5 * (base_m + top_m));
        let mut farthest = [0.0_f64; Self::SECTORS];
        for p in tips.chain(leaves.iter().map(|l| l.at)) {
            let off = p.truncate() - centre;
            let turns = libm::atan2(off.y, off.x) / (2.0 * FRAC_PI_4 * 4.0) + 1.0;
            let sector = (turns * Self::SECTORS as f64) as usize % Self::SECTORS;
            farthest[sector] = farthest[sector].max(off.length_squared());
        }
        let radius_m = (farthest.iter().sum::<f64>() / Self::SECTORS as f64).sqrt();
        Self {
            base_m,
            top_m,
            radius_m,
        }
    }
}

/// The height above which the stem may be stretched: breast height, or lower in saplings.
fn fixed_m(size: &TreeSize) -> f64 {
    BREAST_M.min(0.2 * size.height_m)
}

/// Stretches what is above [`fixed_m`] once more, by the one factor that puts the highest of all
/// twigs and leaves exactly at the demanded height.
pub(super) fn set_height(axes: &mut [Axis], leaves: &mut [Leaf], size: &TreeSize, lean: DVec2) {
    let fixed = fixed_m(size);
    let room = size.height_m - fixed;
    // A leaf that is longer than the part of the tree above its twig is laid down as far as
    // necessary.
    for leaf in leaves.iter_mut() {
        leaf.keep_below(size.height_m);
    }
    let ends = axes.iter().flat_map(|a| &a.points).map(|p| (p.z, 0.0));
    let tips = leaves.iter().map(|l| (l.at.z, l.above_m()));
    let stretch = ends
        .chain(tips)
        .filter(|(z, _)| *z > fixed + 0.05 * room)
        .map(|(z, above)| (room - above) / (z - fixed))
        .fold(f64::INFINITY, f64::min);
    if !stretch.is_finite() {
        return;
    }
    let stretch = stretch.clamp(0.5, 2.0);
    for p in axes.iter_mut().flat_map(|a| &mut a.points) {
        if p.z > fixed {
            let rise = (p.z - fixed) * (stretch - 1.0);
            *p += (lean * rise).extend(rise);
        }
    }
    for leaf in leaves.iter_mut() {
        leaf.at = axes[leaf.axis].at(leaf.s);
    }
}

/// Stretches axes and leaves so that the crown has the demanded base, top and radius. One map of
/// space moves everything, so that what was attached stays attached; below breast height the map is
/// the identity.
pub(super) fn fit(axes: &mut [Axis], leaves: &mut [Leaf], size: &TreeSize, lean: DVec2) {
    let fixed = fixed_m(size);
    for _ in 0..6 {
        let crown = Crown::measure(axes, leaves, lean);
        // A crown that begins at breast height has no stem below it to stretch.
        let (base, wanted_base) = if size.crown_base_m.min(crown.base_m) > 1.15 * fixed {
            let most = (1.3 * (crown.base_m - fixed)).min(0.9 * (size.height_m - fixed));
            (
                crown.base_m,
                (size.crown_base_m - fixed).clamp(0.7 * (crown.base_m - fixed), most) + fixed,
            )
        } else {
            (fixed, fixed)
        };
        let stretch_low = if base > fixed {
            (wanted_base - fixed) / (base - fixed)
        } else {
            1.0
        };
        let stretch_high =
            ((size.height_m - wanted_base) / (crown.top_m - base).max(0.1)).clamp(0.4, 2.5);
        let spread = (size.crown_radius_m / crown.radius_m.max(0.05)).clamp(0.5, 2.0);
        for axis in axes.iter_mut() {
            for p in axis.points.iter_mut().filter(|p| p.z > fixed) {
                let z = if p.z < base {
                    fixed + (p.z - fixed) * stretch_low
                } else {
                    wanted_base + (p.z - base) * stretch_high
                };
                let share = if base > fixed {
                    ((p.z - fixed) / (0.5 * (base - fixed))).min(1.0)
                } else {
                    1.0
                };
                let from_axis = p.truncate() - lean * p.z;
                *p = (lean * z + from_axis * (1.0 + (spread - 1.0) * share)).extend(z);
            }
        }
        for leaf in leaves.iter_mut() {
            leaf.at = axes[leaf.axis].at(leaf.s);
        }
    }
}
