//! The heights of a formation along a trail: smoothing, and the limit of its grade.

/// Low-pass by a Gaussian of `sigma` samples. The sequence is continued beyond its ends by point
/// reflection, so that ends and constant slopes do not change.
pub(crate) fn smooth(values: &[f64], sigma: f64) -> Vec<f64> {
    let radius = (3.0 * sigma).ceil() as i64;
    let kernel: Vec<f64> = (0..=radius)
        .map(|i| libm::exp(-0.5 * (i as f64 / sigma) * (i as f64 / sigma)))
        .collect();
    let total = kernel[0] + 2.0 * kernel[1..].iter().sum::<f64>();
    let last = values.len() as i64 - 1;
    let at = |i: i64| {
        let (end, mirrored) = match i {
            _ if i < 0 => (0, -i),
            _ if i > last => (last, 2 * last - i),
            _ => return values[i as usize],
        };
        // A sequence shorter than the kernel is constant beyond its reflection.
        2.0 * values[end as usize] - values[mirrored.clamp(0, last) as usize]
    };
    (0..=last)
        .map(|i| {
            let sides = (1..=radius).map(|k| kernel[k as usize] * (at(i - k) + at(i + k)));
            (kernel[0] * at(i) + sides.sum::<f64>()) / total
        })
        .collect()
}

/// The sequence closest to `values` (in the largest difference) whose slope over `places` is at
/// most `grade`: the mean of the highest such sequence below and the lowest above (McShane 1934,
/// Whitney 1934).
pub(crate) fn limit_grade(values: &[f64], places: &[f64], grade: f64) -> Vec<f64> {
    let n = values.len();
    let (mut below, mut above) = (values.to_vec(), values.to_vec());
    let mut pass = |i: usize, from: usize| {
        let rise = grade * (places[i] - places[from]).abs();
        below[i] = below[i].min(below[from] + rise);
        above[i] = above[i].max(above[from] - rise);
    };
    (1..n).for_each(|i| pass(i, i - 1));
    (1..n).rev().for_each(|i| pass(i - 1, i));
    below
        .iter()
        .zip(&above)
        .map(|(b, a)| 0.5 * (a + b))
        .collect()
}

/// The heights of a formation over a smoothed ground: of at most this grade, but nowhere farther
/// from the ground than `earth_m`, and rounded with a deviation of some samples.
pub(crate) fn formation(
    ground: &[f64],
    places: &[f64],
    (grade, earth_m): (f64, f64),
    rounding: f64,
) -> Vec<f64> {
    let eased = limit_grade(ground, places, grade);
    // Within the limits it stays to the bit. A ground that is not a number sets none.
    let kept = (eased.iter().zip(ground)).map(|(h, g)| h.max(g - earth_m).min(g + earth_m));
    smooth(&kept.collect::<Vec<_>>(), rounding)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn slopes_and_ends_survive_smoothing() {
        let line: Vec<f64> = (0..50).map(|i| 3.0 + 0.2 * f64::from(i)).collect();
        for (a, b) in line.iter().zip(smooth(&line, 4.0)) {
            assert!((a - b).abs() < 1e-12);
        }
        assert_eq!(smooth(&[2.0], 5.0), [2.0]);
        let saw: Vec<f64> = (0..60).map(|i| f64::from(i % 2)).collect();
        let smoothed = smooth(&saw, 3.0);
        assert!(smoothed[10..50].iter().all(|v| (v - 0.5).abs() < 1e-3));
        assert!((smoothed[0] - 0.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn grades_are_limited_by_the_least_change(
            values in proptest::collection::vec(-20.0_f64..20.0, 2..60),
            grade in 0.01_f64..2.0,
        ) {
            let places: Vec<f64> = (0..values.len()).map(|i| i as f64 * 1.1).collect();
            let got = limit_grade(&values, &places, grade);
            for i in 1..got.len() {
                prop_assert!((got[i] - got[i - 1]).abs() <= grade * 1.1 * (1.0 + 1e-9));
            }
            // No sequence can be closer than half the worst excess of any pair.
            let mut excess = 0.0_f64;
            for i in 0..values.len() {
                for j in 0..i {
                    excess =
                        excess.max((values[i] - values[j]).abs() - grade * (places[i] - places[j]));
                }
            }
            let worst = got
                .iter()
                .zip(&values)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            prop_assert!(worst <= 0.5 * excess + 1e-9);
        }

        #[test]
        fn formations_keep_to_the_ground_and_to_the_grade_within_that(
            steps in proptest::collection::vec(-3.0_f64..3.0, 12..120),
            grade in 0.02_f64..1.0,
            earth_m in 0.2_f64..30.0,
        ) {
            let sum = |height: &mut f64, step: &f64| {
                *height += step;
                Some(*height)
            };
            let ground: Vec<f64> = steps.iter().scan(0.0, sum).collect();
            let places: Vec<f64> = (0..ground.len()).map(|i| i as f64).collect();
            let got = formation(&ground, &places, (grade, earth_m), 3.0);
            // Rounding moves what it gets nearer to the mean of its neighbours.
            for (h, g) in got.iter().zip(smooth(&ground, 3.0)) {
                prop_assert!((h - g).abs() <= earth_m + 1e-9, "{} {} {}", h, g, earth_m);
            }
            // Where the limits are far, they change no bit.
            let free = smooth(&limit_grade(&ground, &places, grade), 3.0);
            prop_assert_eq!(formation(&ground, &places, (grade, 1e9), 3.0), free);
        }
    }
}
