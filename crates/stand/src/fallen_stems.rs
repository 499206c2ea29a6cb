//! Where stems lie.

use std::f64::consts::TAU;

use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key, Rng};

const STEM: Domain = Domain::new("stand.fallen_stem");
const PLACE: Domain = Domain::new("stand.fallen_stem.place");

/// The greatest mean number of stems in a chunk, which are all that a chunk has ids for.
const MOST_MEAN: f64 = 65_535.0;

/// How often a place is looked for.
const TRIES: u64 = 24;

/// A kind of stems.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StemKind {
    /// How often it is chosen, relative to the others.
    pub weight: f64,
    /// Its length, metres.
    pub length_m: f64,
    /// Its greatest radius, metres.
    pub radius_m: f64,
    /// Its volume, m³.
    pub volume_m3: f64,
    /// How large its copies are.
    pub scale: StemScale,
}

/// The scales of a stem's copies, evenly between the two numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StemScale {
    /// Of length and thickness apart.
    Apart(f64, f64),
    /// One of both, which keeps its form.
    Together(f64, f64),
}

impl StemScale {
    /// That of grown stems.
    pub const GROWN: Self = Self::Apart(0.82, 1.18);

    /// Scales of length and of thickness.
    fn draw(self, rng: &mut impl Rng) -> [f64; 2] {
        match self {
            Self::Apart(low, high) => [rng.range_f64(low, high), rng.range_f64(low, high)],
            Self::Together(low, high) => [rng.range_f64(low, high); 2],
        }
    }

    /// The mean volume of copies, over that of the stem.
    fn mean_volume(self) -> f64 {
        // The mean of the n-th power of a number that is spread evenly.
        let mean = |low: f64, high: f64, n: i32| {
            if high - low > 1e-9 {
                (high.powi(n + 1) - low.powi(n + 1)) / (f64::from(n + 1) * (high - low))
            } else {
                low.powi(n)
            }
        };
        match self {
            Self::Apart(low, high) => mean(low, high, 1) * mean(low, high, 2),
            Self::Together(low, high) => mean(low, high, 3),
        }
    }
}

/// A stem on the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FallenStem {
    /// Index of its kind.
    pub kind: usize,
    /// World position of its middle, metres.
    pub middle_m: DVec2,
    /// The direction of its thin end, of length 1.
    pub heading: DVec2,
    /// Its length relative to its kind's.
    pub length_scale: f64,
    /// Its thickness relative to its kind's.
    pub radius_scale: f64,
    /// Its length, metres.
    pub length_m: f64,
    /// Its greatest radius, metres.
    pub radius_m: f64,
    /// Its own key.
    pub key: Key,
}

impl FallenStem {
    /// Its ends on the map, the thick one first.
    #[must_use]
    pub fn ends_m(&self) -> [DVec2; 2] {
        let half = 0.5 * self.length_m * self.heading;
        [self.middle_m - half, self.middle_m + half]
    }

    /// The distance of a place on the map from its axis, metres.
    #[must_use]
    pub fn distance_m(&self, place_m: DVec2) -> f64 {
        let half = 0.5 * self.length_m;
        let off = place_m - self.middle_m;
        let along = off.dot(self.heading).clamp(-half, half);
        off.distance(self.heading * along)
    }

    /// Whether two stems would lie in each other.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        let room = self.radius_m + other.radius_m;
        let near = self.middle_m.distance(other.middle_m);
        near <= 0.5 * (self.length_m + other.length_m) + room
            && (crosses(self.ends_m(), other.ends_m())
                || self.ends_m().iter().any(|&p| other.distance_m(p) < room)
                || other.ends_m().iter().any(|&p| self.distance_m(p) < room))
    }
}

/// Whether two segments cross.
fn crosses([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

/// The mean volume of a stem of these kinds, m³, over their weights and scales; above 0. `None` if
/// no kind is ever chosen, or if the mean is not finite or not above 0: no number of stems would
/// have a given volume.
#[must_use]
pub fn mean_volume_m3(kinds: &[StemKind]) -> Option<f64> {
    let chosen = || kinds.iter().filter(|k| k.weight > 0.0);
    let weight: f64 = chosen().map(|k| k.weight).sum();
    let volume_of = |k: &StemKind| k.weight * k.volume_m3 * k.scale.mean_volume();
    let mean_m3 = chosen().map(volume_of).sum::<f64>() / weight;
    (mean_m3.is_finite() && mean_m3 > 0.0).then_some(mean_m3)
}

/// The stems whose middles are in a chunk, `mean` of them on average: 0 to 65,535, and another
/// value counts as the nearest of these, NaN as 0.
///
/// Each looks for a place until `is_free` accepts one and it meets no other of the chunk. Those of
/// neighbours are not looked at; [`settle`] does.
pub fn fallen_stems(
    chunk: ChunkCoord,
    chunk_size_m: f64,
    key: Key,
    mean: f64,
    kinds: &[StemKind],
    is_free: impl Fn(&FallenStem) -> bool,
) -> Vec<FallenStem> {
    let key = key.domain(STEM).chunk([chunk.x, chunk.y]);
    let weights: Vec<f64> = kinds.iter().map(|k| k.weight).collect();
    let mut stems: Vec<FallenStem> = Vec::new();
    for item in 0..poisson(mean, key) {
        let own = key.item(item);
        let mut rng = own.rng();
        let Some(kind) = rng.weighted(&weights) else {
            break;
        };
        let [length_scale, radius_scale] = kinds[kind].scale.draw(&mut rng);
        let found = (0..TRIES).find_map(|i| {
            let mut rng = own.domain(PLACE).item(i).rng();
            let place = DVec2::new(rng.unit_f64(), rng.unit_f64()) * chunk_size_m;
            let (sin, cos) = libm::sincos(rng.range_f64(0.0, TAU));
            let stem = FallenStem {
                kind,
                middle_m: chunk.origin_m(chunk_size_m) + place,
                heading: DVec2::new(cos, sin),
                length_scale,
                radius_scale,
                length_m: kinds[kind].length_m * length_scale,
                radius_m: kinds[kind].radius_m * radius_scale,
                key: own,
            };
            let alone = !stems.iter().any(|other| other.meets(&stem));
            (alone && is_free(&stem)).then_some(stem)
        });
        stems.extend(found);
    }
    stems
}

/// The stems of a chunk that remain beside those of its neighbours: of two that meet, the one with
/// the larger key.
#[must_use]
pub fn settle(own: &[FallenStem], neighbours: &[&[FallenStem]]) -> Vec<FallenStem> {
    let yields = |stem: &FallenStem| {
        let others = neighbours.iter().copied().flatten();
        let mut stronger = others.filter(|o| o.key.to_bytes() > stem.key.to_bytes());
        stronger.any(|other| other.meets(stem))
    };
    own.iter().filter(|s| !yields(s)).copied().collect()
}

/// A number of a Poisson distribution, by exponential gaps.
fn poisson(mean: f64, key: Key) -> u64 {
    // False for NaN. Without an upper end the gaps would never be used up.
    let mean = if mean > 0.0 { mean.min(MOST_MEAN) } else { 0.0 };
    let mut rng = key.rng();
    let mut at = 0.0;
    let mut count = 0;
    loop {
        at += rng.exponential();
        if at > mean {
            return count;
        }
        count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [StemKind; 2] = [
        StemKind {
            weight: 2.0,
            length_m: 4.0,
            radius_m: 0.1,
            volume_m3: 0.1,
            scale: StemScale::GROWN,
        },
        StemKind {
            weight: 1.0,
            length_m: 9.0,
            radius_m: 0.2,
            volume_m3: 0.9,
            scale: StemScale::GROWN,
        },
    ];

    fn stems(x: i32, y: i32) -> Vec<FallenStem> {
        let key = Key::world(5);
        fallen_stems(ChunkCoord::new(x, y), 50.0, key, 12.0, &KINDS, |_| true)
    }

    fn settled(x: i32, y: i32) -> Vec<FallenStem> {
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j)));
        let around: Vec<_> = around.filter(|&at| at != (0, 0)).collect();
        let around: Vec<_> = around.iter().map(|(i, j)| stems(x + i, y + j)).collect();
        let around: Vec<&[FallenStem]> = around.iter().map(Vec::as_slice).collect();
        settle(&stems(x, y), &around)
    }

    #[test]
    fn as_many_as_asked_for_and_none_in_another() {
        let mut all: Vec<FallenStem> = Vec::new();
        for (x, y) in (0..12).flat_map(|x| (0..12).map(move |y| (x, y))) {
            all.extend(settled(x, y));
        }
        let mean = all.len() as f64 / 144.0;
        assert!((mean - 12.0).abs() < 0.8, "{mean}");
        let volume: f64 = all
            .iter()
            .map(|s| KINDS[s.kind].volume_m3 * s.length_scale * s.radius_scale.powi(2))
            .sum::<f64>()
            / 144.0;
        let expected = 12.0 * mean_volume_m3(&KINDS).expect("kinds with a volume");
        assert!(
            (volume / expected - 1.0).abs() < 0.08,
            "{volume} {expected}"
        );
        for (i, a) in all.iter().enumerate() {
            assert!(!all[..i].iter().any(|b| a.meets(b)), "{a:?}");
        }
    }

    #[test]
    fn any_mean_is_used_up() {
        let count = |mean| poisson(mean, Key::world(2));
        for none in [f64::NAN, -1.0, 0.0, f64::NEG_INFINITY] {
            assert_eq!(count(none), 0, "{none}");
        }
        for most in [f64::INFINITY, 1e300, MOST_MEAN] {
            assert_eq!(count(most), count(MOST_MEAN), "{most}");
        }
        // Five standard deviations.
        let off = count(MOST_MEAN) as f64 - MOST_MEAN;
        assert!(off.abs() < 5.0 * MOST_MEAN.sqrt(), "{off}");
        let at = ChunkCoord::new(0, 0);
        let found = fallen_stems(at, 50.0, Key::world(5), f64::NAN, &KINDS, |_| true);
        assert!(found.is_empty());
    }

    #[test]
    fn a_mean_volume_is_one_to_divide_by() {
        let with = |weight, volume_m3| StemKind {
            weight,
            volume_m3,
            ..KINDS[0]
        };
        assert_eq!(mean_volume_m3(&[]), None);
        let second = mean_volume_m3(&KINDS[1..]);
        for wrong in [with(0.0, 0.1), with(-1.0, 0.1), with(f64::NAN, 0.1)] {
            assert_eq!(mean_volume_m3(&[wrong]), None);
            // What is never chosen does not count.
            assert_eq!(mean_volume_m3(&[wrong, KINDS[1]]), second);
        }
        for volume_m3 in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(mean_volume_m3(&[with(1.0, volume_m3)]), None);
        }
        let mean_m3 = mean_volume_m3(&KINDS).expect("kinds with a volume");
        assert!((0.1..0.9).contains(&mean_m3), "{mean_m3}");
    }

    #[test]
    fn value_stability() {
        let first = stems(0, 0)[0];
        let found = (
            stems(0, 0).len(),
            first.kind,
            (first.middle_m * 1e6).round().as_i64vec2().to_array(),
            (first.length_m * 1e6).round() as i64,
        );
        assert_eq!(found, (15, 0, [41_257_397, 47_538_633], 4_226_273));
    }

    #[test]
    fn stems_meet_where_they_cross_or_touch() {
        let at = |x: f64, y: f64, turn: f64| FallenStem {
            middle_m: DVec2::new(x, y),
            heading: DVec2::from_angle(turn),
            ..stems(0, 0)[0]
        };
        let a = FallenStem {
            length_m: 4.0,
            radius_m: 0.1,
            ..at(0.0, 0.0, 0.0)
        };
        let b = |x, y, turn| FallenStem {
            length_m: 4.0,
            radius_m: 0.1,
            ..at(x, y, turn)
        };
        assert!(a.meets(&b(0.5, 0.3, 1.5)) && a.meets(&b(3.9, 0.1, 0.0)));
        assert!(a.meets(&b(1.0, 0.15, 0.0)));
        assert!(!a.meets(&b(0.0, 0.25, 0.0)) && !a.meets(&b(4.3, 0.0, 0.0)));
        assert!(!a.meets(&b(0.0, 2.3, std::f64::consts::FRAC_PI_2)));
    }
}
