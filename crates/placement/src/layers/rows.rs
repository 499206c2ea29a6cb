//! Planted rows on the endless plane.

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};

use crate::sampler::bridson::SamplePoint;
use crate::sampler::sizes::DiskSizes;
use crate::sampler::square::Square;
use nemoral_scene::ParamError;

const ROWS: Domain = Domain::new("placement.rows");
const PHASE: Domain = Domain::new("placement.rows.phase");
const VIGOUR: Domain = Domain::new("placement.rows.vigour");

/// Planted trees deviate from their places by at most this many standard deviations.
const STRAY: f64 = 2.5;

/// The share of its four neighbours' mean vigour that a tree loses.
///
/// In a square grid the sizes of two neighbours then correlate by -(c / 2) / (1 + c² / 4) = -0.19.
/// Diameters of planted pines were found uncorrelated or negatively so, the more the denser and the
/// older the stand (Liu and Burkhart 1994, "Spatial characteristics of diameter and total height in
/// juvenile loblolly pine plantations"), while good and poor sites, which are not modelled, make
/// neighbours alike. A moderate correlation of -0.15 to -0.3 is plausible; the value in that range
/// is our choice.
const COMPETITION: f64 = 0.4;

/// Rows of planted trees: a rotated grid of the whole plane, whose places are identified by two
/// integers.
///
/// Neighbours compete: a tree's size is the quantile of its own vigour less a share of that of its
/// four neighbours, each weighted by 1 / distance (as in Hegyi's competition index, 1974). The
/// distribution of all sizes is that of the varieties' weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows {
    /// Distance between rows, metres, 0.5 to 50.
    pub row_m: f64,
    /// Distance between places in a row, metres, 0.5 to 50.
    pub in_row_m: f64,
    /// Standard deviation of a tree's position about its place, along the row and across it,
    /// metres, at least 0; planters reach 0.15 to 0.3. No tree deviates by more than 2.5 times as
    /// much.
    pub jitter_m: f64,
    /// Direction of the rows, clockwise from north, degrees.
    pub heading_deg: f64,
}

impl Rows {
    pub(crate) fn check(&self, path: &str, largest_m: f64) -> Result<(), ParamError> {
        ParamError::check_within(format!("{path}.row_m"), self.row_m, 0.5, 50.0)?;
        ParamError::check_within(format!("{path}.in_row_m"), self.in_row_m, 0.5, 50.0)?;
        ParamError::check_within(
            format!("{path}.heading_deg"),
            self.heading_deg,
            -360.0,
            360.0,
        )?;
        // Two neighbours that deviate towards each other must still keep the distance rule.
        let narrow = self.row_m.min(self.in_row_m);
        let most = (narrow - 2.0 * largest_m) / (2.0 * STRAY);
        if self.jitter_m >= 0.0 && self.jitter_m <= most {
            return Ok(());
        }
        let allowed = format!(
            "from 0 to {:.3}: neighbours {narrow} m apart that stray keep the distance that their \
             radii ask for",
            most.max(0.0)
        );
        Err(ParamError::new(
            format!("{path}.jitter_m"),
            self.jitter_m,
            allowed,
        ))
    }

    /// Places in a square of one chunk edge.
    pub(crate) fn per_chunk(&self, chunk_size_m: f64) -> f64 {
        chunk_size_m * chunk_size_m / (self.row_m * self.in_row_m)
    }

    /// All planted trees in the square of half width `need` (chunk edges) around a chunk's centre.
    ///
    /// The tree of a place is a function of its two integers, computed and rounded in the
    /// coordinates of the plane, so that chunks with different origins see the same bits.
    pub(crate) fn plant(
        &self,
        sizes: &DiskSizes,
        key: Key,
        chunk: ChunkCoord,
        chunk_size_m: f64,
        need: f64,
    ) -> Vec<SamplePoint<Key>> {
        let scale = 1.0 / chunk_size_m;
        let (row, step, jitter) = (
            self.row_m * scale,
            self.in_row_m * scale,
            self.jitter_m * scale,
        );
        let (sin, cos) = libm::sincos(self.heading_deg.to_radians());
        // A heading is clockwise from north.
        let (along, across) = (DVec2::new(sin, cos), DVec2::new(cos, -sin));
        let vigour = key.domain(VIGOUR);
        let mut rng = key.domain(PHASE).rng();
        let phase = DVec2::new(rng.unit_f64(), rng.unit_f64());
        let origin = DVec2::new(f64::from(chunk.x), f64::from(chunk.y));
        let centre = origin + DVec2::splat(0.5);
        // Half the diagonal of the square covers it at any heading.
        let reach = need * std::f64::consts::SQRT_2 + STRAY * jitter;
        let places = |axis: DVec2, spacing: f64, phase: f64| {
            let middle = centre.dot(axis);
            let low = ((middle - reach) / spacing - phase).floor() as i64 - 1;
            let high = ((middle + reach) / spacing - phase).ceil() as i64 + 1;
            low..=high
        };
        let mut points = Vec::new();
        for j in places(across, row, phase.y) {
            for i in places(along, step, phase.x) {
                let key = key.domain(ROWS).item(i as u64).item(j as u64);
                let mut rng = key.rng();
                let (variety, radius, core) =
                    sizes.of_quantile(self.rank(COMPETITION, vigour, i, j));
                let mut stray = || jitter * rng.normal().clamp(-STRAY, STRAY);
                let place = DVec2::new(
                    (i as f64 + phase.x) * step + stray(),
                    (j as f64 + phase.y) * row + stray(),
                );
                let p = round(along * place.x + across * place.y) - origin;
                if Square::around_tile(need).contains(p) {
                    points.push(SamplePoint {
                        p,
                        core,
                        radius,
                        variety,
                        key,
                    });
                }
            }
        }
        points
    }

    /// The share of all trees that are smaller than the one at a place, if neighbours take
    /// `competition` of each other: uniform in 0..1 over the plane.
    fn rank(&self, competition: f64, key: Key, i: i64, j: i64) -> f64 {
        let own = |i: i64, j: i64| key.item(i as u64).item(j as u64).rng().normal();
        let of_two = 0.5 * competition / (self.row_m + self.in_row_m);
        // The nearer neighbours are those along the shorter spacing.
        let (along, across) = (of_two * self.row_m, of_two * self.in_row_m);
        let lost =
            along * (own(i - 1, j) + own(i + 1, j)) + across * (own(i, j - 1) + own(i, j + 1));
        let variance = 1.0 + 2.0 * (along * along + across * across);
        let vigour = (own(i, j) - lost) / variance.sqrt();
        0.5 * libm::erfc(-vigour * std::f64::consts::FRAC_1_SQRT_2)
    }
}

/// Positions are multiples of 2⁻³⁰, far from the origin too, so that the difference to a chunk's
/// corner is exact.
fn round(p: DVec2) -> DVec2 {
    const PLACES: f64 = (1_u64 << 30) as f64;
    (p * PLACES).round() / PLACES
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variety::DiskKind;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn rows(row_m: f64, in_row_m: f64) -> Rows {
        Rows {
            row_m,
            in_row_m,
            jitter_m: 0.1,
            heading_deg: 25.0,
        }
    }

    fn sizes(weights: &[f64]) -> DiskSizes {
        let varieties: Vec<DiskKind> = (0..weights.len())
            .map(|i| {
                // Sizes are in neither ascending nor descending order.
                let radius_m = 0.1 + 0.03 * ((7 * i + 3) % 11) as f64;
                DiskKind {
                    weight: weights[i],
                    radius_m: (radius_m, radius_m + 0.02),
                }
            })
            .collect();
        DiskSizes::new(&varieties, vec![0.0; weights.len()], 50.0, 1.0)
    }

    /// The correlation of ranks along rows, across them, and along the diagonal, in a square of
    /// places.
    fn correlations(rows: &Rows, competition: f64) -> [f64; 3] {
        const SIDE: i64 = 160;
        let key = Key::world(4).domain(VIGOUR);
        let ranks: BTreeMap<(i64, i64), f64> = (0..SIDE * SIDE)
            .map(|k| (k % SIDE, k / SIDE))
            .map(|(i, j)| ((i, j), rows.rank(competition, key, i, j)))
            .collect();
        [(1, 0), (0, 1), (1, 1)].map(|(di, dj)| {
            let pairs = ranks.iter().filter_map(|((i, j), a)| {
                let b = ranks.get(&(i + di, j + dj))?;
                Some((a - 0.5) * (b - 0.5))
            });
            let products: Vec<f64> = pairs.collect();
            // A uniform number's variance is a twelfth.
            12.0 * products.iter().sum::<f64>() / products.len() as f64
        })
    }

    /// The range of the correlation of neighbours' sizes.
    const NEIGHBOURS: std::ops::Range<f64> = -0.3..-0.15;

    #[test]
    fn neighbours_keep_each_other_small() {
        let [along, across, diagonal] = correlations(&rows(3.0, 3.0), COMPETITION);
        assert!(NEIGHBOURS.contains(&along), "{along}");
        assert!(NEIGHBOURS.contains(&across), "{across}");
        assert!(diagonal.abs() < 0.05, "{diagonal}");
        // Sizes do not correlate without competition, and too much with too much of it.
        for (competition, least) in [(0.0, -0.03), (0.2, NEIGHBOURS.end)] {
            let [along, across, _] = correlations(&rows(3.0, 3.0), competition);
            assert!(
                along > least && across > least,
                "{competition}: {along} {across}"
            );
        }
        let [along, across, _] = correlations(&rows(3.0, 3.0), 1.2);
        assert!(along < NEIGHBOURS.start && across < NEIGHBOURS.start);
    }

    #[test]
    fn nearer_neighbours_take_more() {
        let [along, across, _] = correlations(&rows(4.0, 2.0), COMPETITION);
        assert!(along < 1.5 * across && across < -0.05, "{along} {across}");
        let [turned, ..] = correlations(&rows(2.0, 4.0), COMPETITION);
        assert!((turned - across).abs() < 0.03, "{turned} {across}");
    }

    #[test]
    fn ranks_are_uniform() {
        let rows = rows(4.0, 2.0);
        let mut counts = [0_u32; 20];
        for k in 0..40_000_i64 {
            // The places are far from each other, as neighbours would compensate each other.
            let rank = rows.rank(COMPETITION, Key::world(9), 3 * (k % 200), 3 * (k / 200));
            counts[(20.0 * rank) as usize] += 1;
        }
        let square = counts
            .iter()
            .map(|c| (f64::from(*c) - 2000.0).powi(2) / 2000.0);
        // Chi-square of 19 degrees of freedom: 43.8 in one of a thousand.
        assert!(square.sum::<f64>() < 43.8, "{counts:?}");
    }

    #[test]
    fn value_stability() {
        let rows = rows(4.0, 2.2);
        let rank = rows.rank(COMPETITION, Key::world(7), -3, 12);
        let member = sizes(&[2.0, 0.0, 1.0, 3.0]).of_quantile(rank);
        assert_eq!(format!("{rank:?} {member:?}"), VALUES);
    }
    const VALUES: &str = "0.7505779041279994 (0, 0.004100693484953599, 0.004100693484953599)";

    proptest! {
        /// Each variety has the share of its weight of all quantiles, and small varieties have the
        /// low ones.
        #[test]
        fn varieties_have_their_weights(weights in proptest::collection::vec(0.0_f64..5.0, 1..9)) {
            prop_assume!(weights.iter().sum::<f64>() > 0.1);
            const STEPS: u32 = 4000;
            let sizes = sizes(&weights);
            let total: f64 = weights.iter().sum();
            let mut counts = vec![0.0; weights.len()];
            let mut last = 0.0;
            for k in 0..STEPS {
                let (variety, radius, _) =
                    sizes.of_quantile((f64::from(k) + 0.5) / f64::from(STEPS));
                prop_assert!(radius >= last, "{radius} after {last}");
                last = radius;
                counts[usize::from(variety)] += 1.0 / f64::from(STEPS);
            }
            for (count, weight) in counts.iter().zip(&weights) {
                prop_assert!((count - weight / total).abs() < 1.5 / f64::from(STEPS));
            }
            prop_assert!(sizes.of_quantile(0.0).1 > 0.0 && sizes.of_quantile(1.0).1 >= last);
        }

        /// A tree does not depend on the chunk that it is seen from.
        #[test]
        fn two_chunks_see_the_same_trees(
            seed: u64,
            x in -1000_i32..1000,
            row_m in 2.0_f64..6.0,
            in_row_m in 2.0_f64..6.0,
        ) {
            let rows = rows(row_m, in_row_m);
            let sizes = sizes(&[1.0, 2.0, 0.5]);
            let chunks = [ChunkCoord::new(x, -x), ChunkCoord::new(x + 1, -x)];
            let seen = chunks.map(|chunk| {
                let points = rows.plant(&sizes, Key::world(seed), chunk, 50.0, 0.6);
                let points = points.into_iter().map(|p| (p.key, p));
                points.collect::<BTreeMap<Key, SamplePoint<Key>>>()
            });
            let mut both = 0;
            for (key, a) in &seen[0] {
                let Some(b) = seen[1].get(key) else { continue };
                prop_assert_eq!((a.variety, a.radius, a.core), (b.variety, b.radius, b.core));
                prop_assert_eq!(a.p, b.p + DVec2::X);
                both += 1;
            }
            // A strip of 0.2 x 1.2 chunk edges.
            let expected = 0.24 * rows.per_chunk(50.0);
            prop_assert!(
                (f64::from(both) - expected).abs() < 0.35 * expected,
                "{both} of {expected}"
            );
        }
    }
}
