//! Drafts of which every second column is computed, where whole ones would come too slowly. What is
//! measured in pixels, such as drops on the lens, is twice as wide in them.

use std::time::Duration;

use nemoral_scene::glam::Vec3;
use nemoral_scene::{Image, Intrinsics};
use rayon::prelude::*;

/// Whether the next draft is halved, by how long this one took. Ten whole ones a second are fast
/// enough; a halved one takes somewhat more than half the time of a whole one.
pub(super) fn is_next_halved(is_halved: bool, took: Duration) -> bool {
    took > Duration::from_millis(if is_halved { 45 } else { 95 })
}

/// The camera of the columns 0, 2, 4 and so on of another's pictures.
pub(super) fn camera_of(whole: &Intrinsics) -> Intrinsics {
    Intrinsics {
        width: whole.width.div_ceil(2),
        fx: whole.fx / 2.0,
        // The centre of its column c is that of the whole picture's column 2 c.
        cx: whole.cx / 2.0 + 0.25,
        ..*whole
    }
}

/// The whole picture of this width from those columns, which no lens has spread.
///
/// Other columns are the means of both sides; then light is spread by 0.7 pixels.
pub(super) fn fill(half: &Image<[u8; 3]>, width: usize) -> Image<[u8; 3]> {
    let (columns, height) = (half.width(), half.height());
    let pixel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
        let light = |column: usize| {
            // The square of a code value is about its light.
            let light = |y| Vec3::from(half.at(column, y).map(|code| f32::from(code).powi(2)));
            0.25 * (light(above) + 2.0 * light(y) + light(below))
        };
        let (left, right) = ((x / 2).saturating_sub(1), (x / 2 + 1).min(columns - 1));
        let light = if x % 2 == 0 {
            0.125 * (light(left) + 6.0 * light(x / 2) + light(right))
        } else {
            0.5 * (light(x / 2) + light(right))
        };
        light.to_array().map(|light| light.sqrt().round() as u8)
    };
    let filled = (0..width * height).into_par_iter().map(pixel).collect();
    Image::new(width, height, filled)
}

#[cfg(test)]
mod tests {
    use nemoral_scene::Distortion;
    use nemoral_scene::glam::DVec2;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn half_a_camera_looks_along_every_second_column(
            width in 120_u32..600,
            column in 0.0_f64..1.0,
            y in 0.0_f64..120.0,
            k1 in -0.03_f64..0.0,
        ) {
            let lens = Distortion::Fisheye { k1, k2: 0.0, k3: 0.0, k4: 0.0 };
            for lens in [Distortion::None, lens] {
                let whole = Intrinsics::through_lens(width, 120, 1.4, lens).expect("a camera");
                let half = camera_of(&whole);
                let column = (column * f64::from(half.width)).floor();
                let expected = whole.direction(DVec2::new(2.0 * column + 0.5, y));
                let got = half.direction(DVec2::new(column + 0.5, y));
                prop_assert!(got.distance(expected) < 1e-8, "{got} for {expected}");
            }
        }

        #[test]
        fn an_even_picture_stays_even(code in any::<u8>(), width in 1_usize..40) {
            let rgb = [code, 255 - code, 7];
            let half = Image::new(width.div_ceil(2), 3, vec![rgb; width.div_ceil(2) * 3]);
            prop_assert_eq!(fill(&half, width), Image::new(width, 3, vec![rgb; width * 3]));
        }
    }

    #[test]
    fn light_is_spread_to_both_sides() {
        let mut columns = vec![[0; 3]; 15];
        columns[7] = [200; 3];
        let filled = fill(&Image::new(5, 3, columns), 9);
        let light = |x: usize, y: usize| f32::from(filled.at(x, y)[0]).powi(2) / 200.0_f32.powi(2);
        let row: Vec<f32> = (0..9).map(|x| light(x, 1)).collect();
        for (x, expected) in [0.0, 0.0, 0.0625, 0.25, 0.375, 0.25, 0.0625, 0.0, 0.0]
            .iter()
            .enumerate()
        {
            assert!((row[x] - expected).abs() < 0.005, "{row:?}");
        }
        assert!((light(4, 0) - 0.1875).abs() < 0.005 && light(4, 0) == light(4, 2));
    }

    #[test]
    fn drafts_that_come_too_slowly_are_halved() {
        let ms = Duration::from_millis;
        assert!(is_next_halved(false, ms(130)) && is_next_halved(true, ms(70)));
        assert!(!is_next_halved(false, ms(90)) && !is_next_halved(true, ms(40)));
        // A draft at either bound does not change back and forth.
        assert!(!is_next_halved(false, 2 * ms(45)) && is_next_halved(true, ms(96) / 2));
    }
}
