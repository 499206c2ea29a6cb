//! How thick stems are at each height, and how much wood of each thickness a tree has.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::skeleton::BREAST_M;

/// The diameters of a stem over bark by the height above the ground, root flare included, as they
/// are cut on a tree's shape: each is that of the circle with the area of the level cut.
///
/// Copies of a shape are scaled, and what lies at breast height of a copy lies higher or lower on
/// its shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StemProfile {
    /// Height and diameter, metres, from the lowest cut up.
    cuts_m: Vec<[f64; 2]>,
    /// Height of the tree, metres.
    top_m: f64,
}

impl StemProfile {
    /// The profile of a tree of this height, metres, from cuts of `[height_m, diameter_m]` with
    /// rising heights.
    ///
    /// # Panics
    /// If heights do not rise.
    #[must_use]
    pub fn new(cuts_m: Vec<[f64; 2]>, top_m: f64) -> Self {
        assert!(
            cuts_m.windows(2).all(|pair| pair[0][0] < pair[1][0]),
            "heights rise"
        );
        Self { cuts_m, top_m }
    }

    /// The diameter at a height above the ground, metres. Below the lowest cut it is that of the
    /// lowest; above the highest, where a stem has forked into branches or has not been cut, it
    /// decreases evenly to 0 at the tree's top.
    #[must_use]
    pub fn diameter_m(&self, height_m: f64) -> f64 {
        let above = self.cuts_m.partition_point(|cut| cut[0] <= height_m);
        let end = [self.top_m, 0.0];
        let next = self.cuts_m.get(above).unwrap_or(&end);
        let Some(below) = above.checked_sub(1).map(|i| &self.cuts_m[i]) else {
            return self.cuts_m.first().map_or(0.0, |cut| cut[1]);
        };
        let rise_m = next[0] - below[0];
        if rise_m <= 0.0 || height_m >= next[0] {
            return 0.0;
        }
        below[1] + (next[1] - below[1]) * (height_m - below[0]) / rise_m
    }

    /// The diameter at breast height, 1.3 m above the ground, of a copy that is `along` times as
    /// high as the shape and as wide as it, metres; 0 if the copy is no higher than that.
    #[must_use]
    pub fn dbh_m(&self, along: f64) -> f64 {
        self.diameter_m(BREAST_M / along)
    }

    /// The frustums between cuts.
    pub(super) fn frustums(&self) -> impl Iterator<Item = Frustum> {
        self.cuts_m.windows(2).map(|pair| Frustum {
            length_m: pair[1][0] - pair[0][0],
            diameters_m: [pair[0][1], pair[1][1]],
        })
    }

    /// Volume between the lowest and the highest cut, m³.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        self.frustums().map(|piece| piece.volume_m3()).sum()
    }
}

/// A piece of wood between two round cuts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frustum {
    pub(super) length_m: f64,
    pub(super) diameters_m: [f64; 2],
}

impl Frustum {
    pub(super) fn volume_m3(&self) -> f64 {
        let [a, b] = self.diameters_m;
        PI / 12.0 * self.length_m * (a * a + a * b + b * b)
    }

    /// What remains if a share of the length, less than 1, is taken away at the first end.
    pub(super) fn without_first(&self, share: f64) -> Self {
        let [a, b] = self.diameters_m;
        Self {
            length_m: self.length_m * (1.0 - share),
            diameters_m: [a + (b - a) * share, b],
        }
    }

    /// The part that is at least `diameter_m` thick, which is between the diameters of its ends.
    fn part_of_at_least(&self, diameter_m: f64) -> Self {
        let [a, b] = self.diameters_m;
        let [thin, thick] = [a.min(b), a.max(b)];
        Self {
            length_m: self.length_m * (thick - diameter_m) / (thick - thin),
            diameters_m: [diameter_m, thick],
        }
    }
}

/// The volume of a tree's wood over bark above the ground, by its thickness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WoodVolume {
    /// Volume of the wood that is at least as thick as each of the thresholds, m³.
    at_least_m3: Vec<f64>,
}

impl WoodVolume {
    /// The least diameter of merchantable wood, metres: that of central Europe's large timber
    /// ("Derbholz").
    pub const MERCHANTABLE_M: f64 = 0.07;
    /// Each threshold is this much thicker than the one before.
    const STEP: f64 = 1.02;
    /// The first threshold but for 0, metres.
    const FIRST_M: f64 = 0.005;
    /// Thresholds, 0 included: the last is 3 m.
    const COUNT: usize = 325;

    fn threshold_m(i: usize) -> f64 {
        match i {
            0 => 0.0,
            i => Self::FIRST_M * libm::pow(Self::STEP, (i - 1) as f64),
        }
    }

    pub(super) fn of(pieces: impl Iterator<Item = Frustum>) -> Self {
        let thresholds_m: Vec<f64> = (0..Self::COUNT).map(Self::threshold_m).collect();
        // What is thicker than a threshold, and not than the next one.
        let mut whole_m3 = vec![0.0; Self::COUNT];
        let mut at_least_m3 = vec![0.0; Self::COUNT];
        for piece in pieces {
            let [a, b] = piece.diameters_m;
            let first = thresholds_m.partition_point(|&d| d <= a.min(b));
            let end = thresholds_m.partition_point(|&d| d < a.max(b));
            whole_m3[first.saturating_sub(1)] += piece.volume_m3();
            for i in first..end {
                at_least_m3[i] += piece.part_of_at_least(thresholds_m[i]).volume_m3();
            }
        }
        let mut sum_m3 = 0.0;
        for (volume_m3, whole_m3) in at_least_m3.iter_mut().zip(whole_m3).rev() {
            sum_m3 += whole_m3;
            *volume_m3 += sum_m3;
        }
        Self { at_least_m3 }
    }

    /// Volume of all wood, m³.
    #[must_use]
    pub fn total_m3(&self) -> f64 {
        self.at_least_m3.first().copied().unwrap_or(0.0)
    }

    /// Volume of the wood that is at least this thick, metres, to half a per cent of all wood; m³.
    #[must_use]
    pub fn volume_above_diameter_m3(&self, diameter_m: f64) -> f64 {
        let next = (0..self.at_least_m3.len()).find(|&i| Self::threshold_m(i) > diameter_m);
        let Some(next) = next else { return 0.0 };
        let Some(last) = next.checked_sub(1) else {
            return self.total_m3();
        };
        let [low_m, high_m] = [last, next].map(Self::threshold_m);
        let [below, above] = [last, next].map(|i| self.at_least_m3[i]);
        below + (above - below) * (diameter_m - low_m) / (high_m - low_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cone that is 0.4 m thick at the ground and 20 m high.
    fn cone() -> StemProfile {
        let cuts = (0..20).map(|i| [f64::from(i), 0.4 - 0.02 * f64::from(i)]);
        StemProfile::new(cuts.collect(), 20.0)
    }

    #[test]
    fn diameters_are_those_between_cuts() {
        let cone = cone();
        for height_m in [0.0, 0.3, 1.3, 7.77, 19.0, 19.5, 20.0] {
            let found = cone.diameter_m(height_m);
            assert!(
                (found - 0.02 * (20.0 - height_m)).abs() < 1e-12,
                "{height_m}: {found}"
            );
        }
        assert_eq!(cone.diameter_m(-1.0), 0.4);
        assert_eq!(cone.diameter_m(25.0), 0.0);
        assert_eq!(StemProfile::default().diameter_m(1.3), 0.0);
    }

    #[test]
    fn volumes_are_those_of_cones() {
        let cone = cone();
        let volume = |diameter: f64, height: f64| PI / 12.0 * diameter * diameter * height;
        let whole = volume(0.4, 20.0) - volume(0.02, 1.0);
        assert!((cone.volume_m3() / whole - 1.0).abs() < 1e-9);
        let wood = WoodVolume::of(cone.frustums());
        assert!((wood.total_m3() / whole - 1.0).abs() < 1e-9);
        // Of a cone, what is thinner than a diameter is a cone.
        for diameter_m in [0.05, 0.07, 0.1, 0.2, 0.33, 0.39] {
            let exact = volume(0.4, 20.0) - volume(diameter_m, 50.0 * diameter_m);
            let found = wood.volume_above_diameter_m3(diameter_m);
            assert!(
                (found - exact).abs() < 5e-3 * whole,
                "{diameter_m}: {found} for {exact}"
            );
        }
        assert_eq!(wood.volume_above_diameter_m3(0.5), 0.0);
        assert_eq!(wood.volume_above_diameter_m3(5.0), 0.0);
    }

    #[test]
    fn pieces_of_one_thickness_count_whole() {
        let piece = Frustum {
            length_m: 2.0,
            diameters_m: [0.1, 0.1],
        };
        let wood = WoodVolume::of([piece; 3].into_iter());
        let whole = 3.0 * piece.volume_m3();
        assert!((wood.volume_above_diameter_m3(0.07) / whole - 1.0).abs() < 1e-12);
        assert!((wood.total_m3() / whole - 1.0).abs() < 1e-12);
        assert_eq!(wood.volume_above_diameter_m3(0.12), 0.0);
    }
}
