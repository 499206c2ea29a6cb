//! Leaves: where the cards hang, how they turn, how many there are.

use std::f64::consts::{FRAC_PI_2, TAU};

use nemoral_scene::Card;
use nemoral_scene::glam::DVec3;
use nemoral_seed::{Domain, Draw, Key};

use super::materials::FoliageCard;
use super::skeleton::{Axis, beside, param_of_arc, turn};
use super::{FoliageForm, TreeSize};

const CARDS: Domain = Domain::new("assets.tree.cards");

/// Length of the longest leafy shoots over the height of the tree.
const SHOOT_SHARE: f64 = 0.12;

/// The number and the size of a tree's cards, before they have places.
#[derive(Clone, Copy, Debug)]
pub(super) struct FoliageDensity<'a> {
    pub(super) form: &'a FoliageForm,
    pub(super) cards: &'a [FoliageCard],
    /// How many cards the tree has.
    pub(super) count: usize,
    /// Their mean linear scale, so that their silhouette is right.
    pub(super) scale: f64,
}

impl<'a> FoliageDensity<'a> {
    /// n = LA s / (A c): the number of cards whose opaque area is the silhouette of the leaf area.
    /// Where that is more than `most`, there are fewer and larger cards.
    pub(super) fn new(
        form: &'a FoliageForm,
        cards: &'a [FoliageCard],
        size: &TreeSize,
        most: usize,
    ) -> Self {
        let silhouette = size.leaf_area_m2 * form.silhouette_factor;
        let mean = cards.iter().map(FoliageCard::silhouette_m2).sum::<f64>() / cards.len() as f64;
        let tall = cards
            .iter()
            .fold(0.0_f64, |m, c| m.max(f64::from(c.height_m)));
        // Saplings' shoots are shorter than what is drawn, though not by much.
        let smaller = (tall / (SHOOT_SHARE * size.height_m)).clamp(1.0, 1.7);
        let wanted = (smaller * smaller * silhouette / mean).ceil();
        let count = wanted.clamp(1.0, most as f64);
        Self {
            form,
            cards,
            count: count as usize,
            scale: (silhouette / (mean * count)).sqrt(),
        }
    }

    /// Mean length of a card, metres.
    pub(super) fn card_m(&self) -> f64 {
        self.scale
            * self
                .cards
                .iter()
                .map(|c| f64::from(c.height_m))
                .sum::<f64>()
            / self.cards.len() as f64
    }
}

/// A card on its twig.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    /// The index of the twig, and the position on it.
    pub(super) axis: usize,
    pub(super) s: f64,
    /// The point of the twig that it springs from.
    pub(super) at: DVec3,
    across: DVec3,
    pub(super) along: DVec3,
    /// Which of the species' cards.
    pub(super) kind: usize,
}

impl Leaf {
    /// Turns the card, keeping its size and heading, until its tip is between the ground and
    /// `top_m`.
    pub(super) fn keep_below(&mut self, top_m: f64) {
        let room = (-self.at.z).min(0.0)..(top_m - self.at.z).max(0.0);
        if room.contains(&self.along.z) {
            return;
        }
        let (length, width) = (self.along.length(), self.across.length());
        let level = self.along.truncate().extend(0.0);
        let level = level.try_normalize().unwrap_or(DVec3::X);
        let rise = (self.along.z.clamp(room.start, room.end) / length).clamp(-1.0, 1.0);
        self.along = (level * (1.0 - rise * rise).max(0.0).sqrt() + DVec3::Z * rise) * length;
        let across = self.across.reject_from(self.along).try_normalize();
        self.across = across.unwrap_or_else(|| beside(self.along / length)) * width;
    }

    /// How far the image reaches above the point that it springs from, metres. It is taken as an
    /// ellipse that fills the card, because images are empty in their corners.
    pub(super) fn above_m(&self) -> f64 {
        let (along, across) = (self.along.z, self.across.z);
        (0.5 * along + 0.5 * (along * along + across * across).sqrt()).max(0.0)
    }

    pub(super) fn card(&self, cards: &[FoliageCard]) -> Card {
        Card {
            corner: (self.at - 0.5 * self.across).as_vec3(),
            edge_u: self.across.as_vec3(),
            edge_v: self.along.as_vec3(),
            material: cards[self.kind].material,
        }
    }
}

/// Clusters of cards along the leafy parts of the axes, evenly by length, with extra ones at the
/// tips. The sum of their silhouettes is exactly what the leaf area demands.
pub(super) fn leaves(axes: &[Axis], density: &FoliageDensity<'_>, key: Key) -> Vec<Leaf> {
    let form = density.form;
    let arcs: Vec<Vec<f64>> = axes.iter().map(Axis::arcs).collect();
    // Running sums of leafy length: (sum at the end of the axis, axis, leafy length).
    let mut total = 0.0;
    let mut stretches = Vec::new();
    for (i, axis) in axes.iter().enumerate() {
        let length = arcs[i][arcs[i].len() - 1];
        let leafy = length * (1.0 - axis.leafy_from);
        if !axis.dead && leafy > 0.0 {
            total += leafy + form.tip_weight_m;
            stretches.push((total, i, leafy));
        }
    }
    if stretches.is_empty() {
        return Vec::new();
    }
    let per_cluster = form.cards_per_cluster as usize;
    let clusters = density.count.div_ceil(per_cluster);
    let inclinations = Quantiles::beta(
        form.inclination_mean_deg / 90.0,
        form.inclination_sd_deg / 90.0,
    );
    let mut out = Vec::with_capacity(density.count);
    for cluster in 0..clusters {
        let mut rng = key.domain(CARDS).item(cluster as u64).rng();
        let at = total * (cluster as f64 + rng.unit_f64()) / clusters as f64;
        let &(end, i, leafy) = &stretches[stretches
            .partition_point(|s| s.0 <= at)
            .min(stretches.len() - 1)];
        let (axis, arcs) = (&axes[i], &arcs[i]);
        // Positions past the leafy length are at the tip.
        let before_tip = (end - form.tip_weight_m - at).clamp(0.0, leafy);
        let s = param_of_arc(arcs, arcs[arcs.len() - 1] - before_tip);
        let (point, twig) = (axis.at(s), axis.direction(s));
        let first = rng.range_f64(0.0, TAU);
        for k in 0..per_cluster.min(density.count - out.len()) {
            let azimuth = first + TAU * (k as f64 + rng.range_f64(-0.2, 0.2)) / per_cluster as f64;
            let spread = form.spread_deg.to_radians() * rng.range_f64(0.5, 1.3);
            let side = turn(beside(twig), twig, azimuth);
            let (sin, cos) = libm::sincos(spread);
            let wanted = twig * cos + side * sin + DVec3::Z * form.tropism;
            let inclination = FRAC_PI_2 * inclinations.at(rng.unit_f64());
            let (along, normal) = incline(wanted.normalize_or(twig), inclination, rng.chance(0.5));
            let kind = rng.below(density.cards.len() as u32) as usize;
            let scale = density.scale * rng.range_f64(0.8, 1.2);
            let card = &density.cards[kind];
            out.push(Leaf {
                axis: i,
                s,
                at: point,
                across: along.cross(normal) * (scale * f64::from(card.width_m)),
                along: along * (scale * f64::from(card.height_m)),
                kind,
            });
        }
    }
    // The random kinds and scales leave a small error, which is divided evenly among all cards.
    let wanted = density.scale
        * density.scale
        * density.count as f64
        * density
            .cards
            .iter()
            .map(FoliageCard::silhouette_m2)
            .sum::<f64>()
        / density.cards.len() as f64;
    let correction = (wanted / silhouette_m2(&out, density.cards)).sqrt();
    for leaf in &mut out {
        leaf.across *= correction;
        leaf.along *= correction;
    }
    out
}

/// Σ area · opaque fraction, m².
pub(super) fn silhouette_m2(leaves: &[Leaf], cards: &[FoliageCard]) -> f64 {
    let area = |l: &Leaf| l.across.cross(l.along).length();
    leaves
        .iter()
        .map(|l| area(l) * f64::from(cards[l.kind].opaque_fraction))
        .sum()
}

/// A card's axis and normal with exactly the given inclination (angle between normal and vertical).
/// The axis keeps its heading; it is laid down only if it is steeper than the inclination allows.
fn incline(wanted: DVec3, inclination: f64, left: bool) -> (DVec3, DVec3) {
    let level = wanted
        .truncate()
        .extend(0.0)
        .try_normalize()
        .unwrap_or(DVec3::X);
    let elevation = libm::asin(wanted.z.clamp(-1.0, 1.0)).clamp(-inclination, inclination);
    let (sin, cos) = libm::sincos(elevation);
    let along = level * cos + DVec3::Z * sin;
    // The normals of cards with this axis: the most upright one, turned about the axis.
    let up = DVec3::Z * cos - level * sin;
    let turned = libm::acos((libm::cos(inclination) / cos.max(1e-9)).clamp(-1.0, 1.0));
    (along, turn(up, along, if left { turned } else { -turned }))
}

/// Quantiles of a distribution on 0..1.
struct Quantiles(Vec<f64>);

impl Quantiles {
    /// The quantiles of the Beta distribution with this mean and standard deviation, by integration
    /// of its density.
    fn beta(mean: f64, sd: f64) -> Self {
        const CELLS: usize = 512;
        // A Beta distribution's standard deviation is below sqrt(mean (1 − mean)).
        let variance = (sd * sd).min(0.9 * mean * (1.0 - mean));
        let k = mean * (1.0 - mean) / variance - 1.0;
        let (a, b) = (mean * k, (1.0 - mean) * k);
        let width = 1.0 / CELLS as f64;
        let mut sum = 0.0;
        let sums: Vec<f64> = (0..CELLS)
            .map(|i| {
                let t = (i as f64 + 0.5) * width;
                sum += match i {
                    // At its ends the density may be unbounded; there the unbounded factor is
                    // integrated exactly.
                    0 => libm::pow(width, a - 1.0) / a * libm::pow(1.0 - t, b - 1.0),
                    i if i == CELLS - 1 => libm::pow(t, a - 1.0) * libm::pow(width, b - 1.0) / b,
                    _ => libm::pow(t, a - 1.0) * libm::pow(1.0 - t, b - 1.0),
                };
                sum
            })
            .collect();
        Self(sums.into_iter().map(|s| s / sum).collect())
    }

    fn at(&self, u: f64) -> f64 {
        let i = self.0.partition_point(|&c| c <= u).min(self.0.len() - 1);
        let low = if i == 0 { 0.0 } else { self.0[i - 1] };
        (i as f64 + (u - low) / (self.0[i] - low).max(1e-300)) / self.0.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn quantiles_have_the_mean_and_deviation_asked_for() {
        for (mean, sd) in [(57.3, 21.5), (70.0, 13.0), (35.7, 19.3), (25.7, 32.0)] {
            let q = Quantiles::beta(mean / 90.0, sd / 90.0);
            let draws: Vec<f64> = (0..10_000)
                .map(|i| 90.0 * q.at((f64::from(i) + 0.5) / 1e4))
                .collect();
            let m = draws.iter().sum::<f64>() / 1e4;
            let s = (draws.iter().map(|d| (d - m) * (d - m)).sum::<f64>() / 1e4).sqrt();
            assert!(
                (m - mean).abs() < 0.3 && (s - sd).abs() < 0.5,
                "{m} +- {s} for {mean} +- {sd}"
            );
        }
    }

    proptest! {
        #[test]
        fn a_card_has_the_inclination_drawn(
            x in -1.0..1.0,
            y in -1.0..1.0,
            z in -1.0..1.0,
            degrees in 0.0..90.0,
            left: bool,
        ) {
            let wanted = DVec3::new(x, y, z).normalize_or(DVec3::X);
            let inclination = f64::to_radians(degrees);
            let (along, normal) = incline(wanted, inclination, left);
            prop_assert!(
                (along.length() - 1.0).abs() < 1e-9 && (normal.length() - 1.0).abs() < 1e-9
            );
            prop_assert!(along.dot(normal).abs() < 1e-9);
            prop_assert!(
                (normal.z.abs() - inclination.cos()).abs() < 1e-7,
                "{} {}",
                normal.z,
                inclination.cos()
            );
            // Its heading over the ground is still the one that was asked for.
            let level = wanted.truncate();
            if level.length() > 1e-3 && along.truncate().length() > 1e-3 {
                prop_assert!(along.truncate().normalize().dot(level.normalize()) > 1.0 - 1e-6);
            }
        }
    }
}
