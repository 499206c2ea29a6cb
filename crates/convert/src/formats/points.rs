//! Points of surfaces for trainers of Gaussian splats, which begin with some: pixels of a regular
//! grid over each picture, placed by their depth.

use std::fmt::Write;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{Image, Intrinsics, RigidTransform};

/// At most so many pixels of a picture have a point.
const MOST: usize = 300;
/// Points are nearer than this, metres: what is farther is small in all pictures of a drive.
const FARTHEST_M: f32 = 60.0;

/// A line `x y z r g b` for each point of a picture that has a surface: metres, to 0.1 mm, in the
/// frame that `target_from_camera` leads to, and 8-bit sRGB.
pub(super) fn lines(
    k: &Intrinsics,
    rgb: &Image<[u8; 3]>,
    depth_m: &Image<f32>,
    target_from_camera: &RigidTransform,
) -> String {
    let (width, height) = (depth_m.width(), depth_m.height());
    // Each square with sides of so many pixels has one, in its middle.
    let step = (1..).find(|step| width.div_ceil(*step) * height.div_ceil(*step) <= MOST);
    let step = step.unwrap_or(width);
    let along = |side: usize| ((step / 2).min(side / 2)..side).step_by(step);
    let mut text = String::new();
    for row in along(height) {
        for column in along(width) {
            let z_m = *depth_m.at(column, row);
            if z_m > 0.0 && z_m < FARTHEST_M {
                let ray = k.direction(DVec2::new(column as f64 + 0.5, row as f64 + 0.5));
                let at_m = target_from_camera.transform_point(ray * (f64::from(z_m) / ray.z));
                let [x, y, z] = at_m.to_array();
                let [r, g, b] = rgb.at(column, row);
                writeln!(text, "{x:.4} {y:.4} {z:.4} {r} {g} {b}").expect("a string takes it");
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use nemoral_scene::glam::DVec3;

    use super::*;

    #[test]
    fn a_grid_of_near_pixels_is_placed_by_depth() {
        let (w, h) = (320, 180);
        let k = Intrinsics::from_fov(w, h, 1.2).expect("valid");
        let (w, h) = (w as usize, h as usize);
        let pixels: Vec<usize> = (0..w * h).collect();
        let rgb = Image::new(
            w,
            h,
            pixels.iter().map(|i| [7, 9, (i % 200) as u8]).collect(),
        );
        // The left half is near, the right one sky above and far away below.
        let depth = |&i: &usize| match (i % w < w / 2, i / w < h / 2) {
            (true, _) => 5.0,
            (false, true) => 0.0,
            (false, false) => 60.0,
        };
        let depth_m = Image::new(w, h, pixels.iter().map(depth).collect());
        let target_from_camera = RigidTransform {
            translation_m: DVec3::new(100.0, 0.0, 0.0),
            ..RigidTransform::IDENTITY
        };
        let text = lines(&k, &rgb, &depth_m, &target_from_camera);
        let count = text.lines().count();
        assert!((100..=MOST / 2 + 20).contains(&count), "{count}");
        for line in text.lines() {
            let n: Vec<f64> = line
                .split(' ')
                .map(|n| n.parse().expect("number"))
                .collect();
            let [x, y, z, r, g, b] = n[..] else {
                panic!("{line}")
            };
            let there = k.project(DVec3::new(x - 100.0, y, z)).expect("in front");
            assert!(
                (z, r, g) == (5.0, 7.0, 9.0) && there.x < w as f64 / 2.0,
                "{line}"
            );
            let (column, row) = (there.x.floor(), there.y.floor());
            // It is in the middle of its pixel, as far as 0.1 mm tell.
            let middle = DVec2::new(column + 0.5, row + 0.5);
            assert!(there.distance(middle) < 0.01, "{there}");
            let pixel = row as usize * w + column as usize;
            assert_eq!(b, (pixel % 200) as f64);
        }
    }

    #[test]
    fn pictures_of_any_size_have_points() {
        for (w, h) in [(1, 1), (1, 16384), (31, 22), (1920, 1080)] {
            let k = Intrinsics::from_fov(w, h, 1.2).expect("valid");
            let (w, h) = (w as usize, h as usize);
            let (rgb, depth_m) = (vec![[0; 3]; w * h], vec![2.0; w * h]);
            let (rgb, depth_m) = (Image::new(w, h, rgb), Image::new(w, h, depth_m));
            let count = lines(&k, &rgb, &depth_m, &RigidTransform::IDENTITY)
                .lines()
                .count();
            assert!((1..=MOST).contains(&count), "{w} {h}: {count}");
        }
    }
}
