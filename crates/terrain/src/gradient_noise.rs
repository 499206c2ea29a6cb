//! One octave: gradient noise with its exact gradient.

use std::sync::LazyLock;

use glam::{DVec2, I64Vec2};

/// Standard deviation of [`gradient_noise`] over the plane.
///
/// With gradients of unit length in independent uniform directions, the variance at a point of a
/// cell is the sum over its corners of (weight · distance)² / 2; this is the root of its mean.
pub(crate) const SIGMA: f64 = 0.215_710_8;

/// Unit vectors in 256 directions, computed by libm, so that every platform gets the same bits.
static DIRECTIONS: LazyLock<[DVec2; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let angle = (i as f64 + 0.5) * (std::f64::consts::TAU / 256.0);
        DVec2::new(libm::cos(angle), libm::sin(angle))
    })
});

/// Gradient noise (Perlin 1985, with the quintic fade of Perlin 2002), value and gradient.
///
/// Zero at lattice points, within ±√½, twice continuously differentiable. The lattice is hashed,
/// not looked up in a permutation table, so it does not repeat after 256 cells.
#[inline]
pub(crate) fn gradient_noise(seed: u64, p: DVec2) -> (f64, DVec2) {
    let i = I64Vec2::new(floor(p.x), floor(p.y));
    let f = p - i.as_dvec2();
    let (west, east) = (mix_column(seed, i.x), mix_column(seed, i.x.wrapping_add(1)));
    let directions = &*DIRECTIONS;
    let corner = |column: u64, offset: I64Vec2| {
        let g = directions[(mix(column, i.y.wrapping_add(offset.y)) >> 56) as usize];
        (g.dot(f - offset.as_dvec2()), g)
    };
    let (a, ga) = corner(west, I64Vec2::new(0, 0));
    let (b, gb) = corner(east, I64Vec2::new(1, 0));
    let (c, gc) = corner(west, I64Vec2::new(0, 1));
    let (d, gd) = corner(east, I64Vec2::new(1, 1));
    let (u, du) = fade(f.x);
    let (v, dv) = fade(f.y);
    let twist = a - b - c + d;
    let value = a + u * (b - a) + v * (c - a) + u * v * twist;
    let gradient = ga
        + u * (gb - ga)
        + v * (gc - ga)
        + u * v * (ga - gb - gc + gd)
        + DVec2::new(du * (b - a + v * twist), dv * (c - a + u * twist));
    (value, gradient)
}

/// `f64::floor`, which is a function call on baseline x86-64. Beyond ±2⁶³ there is no lattice.
#[inline]
fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero.wrapping_sub(i64::from(towards_zero as f64 > x))
}

/// 6t⁵ − 15t⁴ + 10t³ and its derivative.
#[inline]
fn fade(t: f64) -> (f64, f64) {
    let s = t * (t - 1.0);
    (t * t * t * (t * (6.0 * t - 15.0) + 10.0), 30.0 * s * s)
}

#[inline]
fn mix_column(seed: u64, x: i64) -> u64 {
    finish(seed ^ (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

#[inline]
fn mix(column: u64, y: i64) -> u64 {
    finish(column ^ (y as u64).wrapping_mul(0xD1B5_4A32_D192_ED03))
}

/// The finaliser of `SplitMix64` (Stafford's variant 13).
#[inline]
fn finish(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of points that is not aligned with the lattice anywhere.
    fn points(n: u32) -> impl Iterator<Item = DVec2> {
        (0..n).flat_map(move |x| {
            (0..n).map(move |y| DVec2::new(f64::from(x) * 0.618_034, f64::from(y) * 0.414_214))
        })
    }

    #[test]
    fn sigma_is_the_closed_form_and_what_is_measured() {
        let n = 10_000;
        let (mut a, mut b) = (0.0, 0.0);
        for k in 0..n {
            let x = (f64::from(k) + 0.5) / f64::from(n);
            let w = (1.0 - fade(x).0).powi(2) / f64::from(n);
            a += w * x * x;
            b += w;
        }
        assert!((SIGMA - (4.0 * a * b).sqrt()).abs() < 1e-6);
        let variance = points(400)
            .map(|p| gradient_noise(7, p).0.powi(2))
            .sum::<f64>()
            / 160_000.0;
        assert!((variance.sqrt() / SIGMA - 1.0).abs() < 0.03, "{variance}");
    }

    #[test]
    fn values_stay_within_the_bound() {
        for p in points(600) {
            assert!(gradient_noise(3, p).0.abs() <= 0.5_f64.sqrt());
        }
    }

    /// Beside each line of the lattice other corners are looked up.
    #[test]
    fn value_and_gradient_go_on_over_the_lines_of_the_lattice() {
        let step = 1e-9;
        for i in -20..=20 {
            for k in 0..200 {
                let (line, along) = (f64::from(i), f64::from(k) * 0.314_159 - 31.0);
                for (a, b) in [
                    (
                        DVec2::new(line - step, along),
                        DVec2::new(line + step, along),
                    ),
                    (
                        DVec2::new(along, line - step),
                        DVec2::new(along, line + step),
                    ),
                ] {
                    let [(value_a, gradient_a), (value_b, gradient_b)] =
                        [a, b].map(|p| gradient_noise(11, p));
                    assert!((value_a - value_b).abs() < 1e-7, "{a}: {value_a} {value_b}");
                    let turn = gradient_a.distance(gradient_b);
                    assert!(turn < 1e-7, "{a}: {gradient_a} {gradient_b}");
                }
            }
        }
    }

    #[test]
    fn it_does_not_repeat_after_256_cells() {
        for period in [
            DVec2::new(256.0, 0.0),
            DVec2::new(0.0, 256.0),
            DVec2::splat(256.0),
        ] {
            let same = points(100)
                .filter(|&p| {
                    let (a, b) = (gradient_noise(1, p).0, gradient_noise(1, p + period).0);
                    (a - b).abs() < 1e-6
                })
                .count();
            assert!(same < 10, "{same} of 10000");
        }
    }

    #[test]
    fn directions_are_even() {
        // Neighbouring lattice points must not be correlated: the mean product of gradients is 0.
        let g = |x: i64, y: i64| DIRECTIONS[(mix(mix_column(5, x), y) >> 56) as usize];
        let n = 20_000;
        for (dx, dy) in [(1, 0), (0, 1), (1, 1), (1, -1), (2, 0)] {
            let mean: f64 = (0..n)
                .map(|k| g(k, 3 * k).dot(g(k + dx, 3 * k + dy)))
                .sum::<f64>()
                / n as f64;
            assert!(
                mean.abs() < 4.0 / (2.0 * n as f64).sqrt(),
                "({dx}, {dy}): {mean}"
            );
        }
    }
}
