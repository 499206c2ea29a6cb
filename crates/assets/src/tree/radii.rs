//! How thick the wood is.

use super::skeleton::{Axis, BREAST_M};
use super::{FoliageForm, Species, Taper, TreeSize};

/// A twig of this length adds as much to the pipe sum as one tip, for the side shoots that are too
/// small to be grown.
const SHOOT_M: f64 = 0.4;

/// Radius of an axis that continues its parent at its end, as a share of the parent's radius there.
const LEADER_RATIO: f64 = 0.92;

impl Taper {
    /// Stem radius over bark at height z, metres, without the root flare: exactly half the diameter
    /// at 1.3 m there.
    pub(super) fn radius_m(&self, size: &TreeSize, z: f64) -> f64 {
        let slenderness = size.height_m / size.dbh_m;
        let shape = |z: f64| {
            let x = (z / size.height_m).clamp(0.0, 1.0);
            let power =
                self.power + self.slenderness_power * slenderness + self.top_power * (1.0 - x);
            (1.0 + self.butt * libm::exp(-self.butt_decay * x)) * libm::pow(1.0 - x, power)
        };
        0.5 * size.dbh_m * shape(z) / shape(BREAST_M)
    }
}

/// The radius of every axis at every point, in the order of the axes.
///
/// Order 0 follows the taper curve. For the others, r^g is summed from the tips down (pipe model).
/// Then each first-order branch, with all that it bears, is brought to the share of the stem's
/// radius that the species allows, by one power law that does not change its tips.
pub(super) fn radii(axes: &[Axis], species: &Species, size: &TreeSize) -> Vec<Vec<f64>> {
    let leaf = &species.foliage;
    let mut radii = pipe(axes, leaf);
    let stem_radius = |z: f64| species.stem.taper.radius_m(size, z).max(leaf.tip_radius_m);
    let stem: Vec<f64> = axes[0].points.iter().map(|p| stem_radius(p.z)).collect();
    let thickest = axes
        .iter()
        .zip(&radii)
        .filter(|(a, _)| a.order == 1 && !a.dead)
        .fold(0.0_f64, |m, (_, r)| m.max(r[0]));
    radii[0] = stem;
    // The power of the first-order branch that each axis belongs to.
    let mut powers = vec![1.0; axes.len()];
    for i in 1..axes.len() {
        let axis = &axes[i];
        let Some((parent, at)) = axis.parent else {
            continue;
        };
        let parent_radius = at_param(&radii[parent], at);
        let tip = leaf.tip_radius_m;
        if axis.dead {
            // A dead branch has lost its twigs and tapers to a broken end.
            let (base, n) = (
                (species.dead.radius_ratio * parent_radius).max(1.5 * tip),
                axis.points.len() - 1,
            );
            radii[i] = (0..=n)
                .map(|k| base * (1.0 - 0.45 * k as f64 / n as f64))
                .collect();
            continue;
        }
        let [mut least, mut most] = species.levels[axis.order - 1].radius_ratio;
        if at as usize + 1 >= radii[parent].len() {
            // It springs from its parent's end and is as thick as that.
            (least, most) = (LEADER_RATIO, LEADER_RATIO);
        }
        powers[i] = if axis.order == 1 {
            // The thickest branch gets the greatest share, the others less, in proportion to their
            // pipe sums.
            let share = (radii[i][0] / thickest).clamp(0.0, 1.0);
            let base = ((least + (most - least) * share) * parent_radius).max(1.3 * tip);
            if radii[i][0] > 1.05 * tip {
                libm::log(base / tip) / libm::log(radii[i][0] / tip)
            } else {
                1.0
            }
        } else {
            powers[parent]
        };
        for r in &mut radii[i] {
            *r = tip * libm::pow((*r / tip).max(1.0), powers[i]);
        }
        let scale = (most * parent_radius / radii[i][0]).min(1.0);
        for r in &mut radii[i] {
            *r = (*r * scale).max(0.6 * tip);
        }
    }
    radii
}

/// Bottom-up sums of r^g, from tips of one radius.
fn pipe(axes: &[Axis], leaf: &FoliageForm) -> Vec<Vec<f64>> {
    let g = leaf.pipe_exponent;
    let tip = libm::pow(leaf.tip_radius_m, g);
    // What children add at each point of their parent.
    let mut added: Vec<Vec<f64>> = axes.iter().map(|a| vec![0.0; a.points.len()]).collect();
    let mut radii: Vec<Vec<f64>> = vec![Vec::new(); axes.len()];
    for i in (0..axes.len()).rev() {
        let axis = &axes[i];
        let mut sum = tip;
        let last = axis.points.len() - 1;
        let mut r = vec![leaf.tip_radius_m; last + 1];
        sum += added[i][last];
        for k in (0..last).rev() {
            sum += added[i][k] + tip * axis.points[k].distance(axis.points[k + 1]) / SHOOT_M;
            r[k] = libm::pow(sum, 1.0 / g);
        }
        radii[i] = r;
        if let (Some((parent, at)), false) = (axis.parent, axis.dead) {
            added[parent][at as usize] += sum;
        }
    }
    radii
}

/// The radius between points.
pub(super) fn at_param(radii: &[f64], s: f64) -> f64 {
    let i = (s as usize).min(radii.len() - 2);
    radii[i] + (radii[i + 1] - radii[i]) * (s - i as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Diameters of maritime pine relative to breast height over x = z/H, from the segmented curve
    /// of Fang et al. for the Galician coast.
    const PINASTER: [(f64, f64); 9] = [
        (0.01, 1.20),
        (0.03, 1.12),
        (0.065, 0.99),
        (0.1, 0.87),
        (0.2, 0.81),
        (0.5, 0.62),
        (0.7, 0.47),
        (0.8, 0.34),
        (0.9, 0.19),
    ];

    fn size(dbh_m: f64, height_m: f64) -> TreeSize {
        TreeSize {
            dbh_m,
            height_m,
            crown_base_m: 0.6 * height_m,
            crown_radius_m: 2.0,
            leaf_area_m2: 80.0,
            lean_rad: 0.0,
        }
    }

    #[test]
    fn pine_tapers_as_published() {
        // At this height 1.3 m is x = 0.065, where the published curve is 0.99.
        let size = size(0.3, 20.0);
        let taper = Species::maritime_pine().stem.taper;
        for (x, published) in PINASTER {
            let ours = 2.0 * taper.radius_m(&size, x * 20.0) / 0.3 * 0.99;
            assert!(
                (ours - published).abs() < 0.045,
                "x = {x}: {ours} for {published}"
            );
        }
    }

    /// Diameters over that at 1.3 m at tenths 1, 3, 5, 7 and 9 of the height, and the form factor,
    /// by BDATPro (Kublin 2003, "Einheitliche Beschreibung der Schaftform", Forstwissenschaftliches
    /// Centralblatt 122), with the mean form of Germany's first national forest inventory.
    const BDAT: [(&str, f64, f64, [f64; 5], f64); 8] = [
        (
            "beech",
            0.4,
            29.0,
            [0.924, 0.810, 0.717, 0.561, 0.247],
            0.492,
        ),
        (
            "beech",
            0.2,
            21.0,
            [0.950, 0.799, 0.677, 0.491, 0.196],
            0.467,
        ),
        (
            "english_oak",
            0.45,
            24.0,
            [0.937, 0.823, 0.734, 0.592, 0.276],
            0.519,
        ),
        (
            "norway_spruce",
            0.3,
            24.0,
            [0.923, 0.796, 0.677, 0.497, 0.202],
            0.469,
        ),
        (
            "norway_spruce",
            0.45,
            30.0,
            [0.878, 0.767, 0.654, 0.473, 0.177],
            0.434,
        ),
        (
            "douglas_fir",
            0.45,
            33.0,
            [0.891, 0.751, 0.627, 0.430, 0.150],
            0.407,
        ),
        (
            "silver_birch",
            0.25,
            21.0,
            [0.948, 0.798, 0.684, 0.506, 0.207],
            0.472,
        ),
        (
            "scots_pine",
            0.35,
            24.0,
            [0.924, 0.765, 0.651, 0.494, 0.213],
            0.446,
        ),
    ];

    #[test]
    fn stems_have_the_form_of_an_inventorys() {
        for (name, dbh_m, height_m, diameters, form_factor) in BDAT {
            let species = Species::all().into_iter().find(|s| s.name == name);
            let taper = species.expect("a built-in species").stem.taper;
            let size = size(dbh_m, height_m);
            let share = |x: f64| 2.0 * taper.radius_m(&size, x * height_m) / dbh_m;
            for (x, asked) in [0.1, 0.3, 0.5, 0.7, 0.9].into_iter().zip(diameters) {
                let found = share(x);
                assert!(
                    (found - asked).abs() < 0.05,
                    "{name} at {x}: {found} for {asked}"
                );
            }
            let mean = (0..1000)
                .map(|i| share((f64::from(i) + 0.5) / 1000.0).powi(2))
                .sum::<f64>();
            let found = mean / 1000.0;
            let is_near = (found / form_factor - 1.0).abs() < 0.05;
            assert!(is_near, "{name}: {found} for {form_factor}");
        }
    }

    #[test]
    fn taper_passes_through_breast_height_and_thins_upwards() {
        for species in Species::all() {
            for (dbh, height) in [(0.1, 9.0), (0.3, 20.0), (0.5, 30.0)] {
                let size = size(dbh, height);
                let taper = species.stem.taper;
                assert!((taper.radius_m(&size, BREAST_M) - 0.5 * dbh).abs() < 1e-12);
                let radii: Vec<f64> = (0..=100)
                    .map(|i| taper.radius_m(&size, height * f64::from(i) / 100.0))
                    .collect();
                assert!(
                    radii.windows(2).all(|w| w[1] < w[0] * 1.001),
                    "{} {radii:?}",
                    species.name
                );
                assert!(radii[100] == 0.0);
            }
        }
    }
}
