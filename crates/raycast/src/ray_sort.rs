//! Sorting the rays of a batch, so that neighbours in the order take similar paths.

use glam::{Vec2, Vec3};
use nemoral_scene::{Bounds, Ray};
use rayon::prelude::*;

/// Batches of fewer rays are keyed by one thread.
const LEAST: usize = 4096;

/// Ray numbers sorted so that rays of similar direction are near each other, because what one ray
/// has brought to the cache serves the next. A permutation of `0..rays.len()`.
pub(crate) fn by_direction(rays: &[Ray]) -> Vec<u32> {
    sorted(rays, |ray| morton(octahedral(ray.direction)))
}

/// Ray numbers sorted so that rays of similar origin are near each other, for rays of about one
/// direction, as shadow rays are. A permutation of `0..rays.len()`.
pub(crate) fn by_origin(rays: &[Ray]) -> Vec<u32> {
    let bounds = Bounds::of_points(rays.iter().map(|r| r.origin));
    let size = (bounds.max - bounds.min).max_element().max(1e-3);
    sorted(rays, |ray| morton_3d((ray.origin - bounds.min) / size))
}

/// Ray numbers sorted by the lower 20 bits of a key; rays with equal keys keep their order.
fn sorted(rays: &[Ray], key: impl Fn(&Ray) -> u32 + Sync) -> Vec<u32> {
    let key = |(i, ray): (usize, &Ray)| u64::from(key(ray)) << 32 | i as u64;
    let mut keys = Vec::new();
    let keyed = rays.par_iter().enumerate().with_min_len(LEAST);
    keyed.map(key).collect_into_vec(&mut keys);
    let mut sorted = vec![0; keys.len()];
    for shift in [32, 42] {
        pass(&keys, shift, &mut sorted);
        std::mem::swap(&mut keys, &mut sorted);
    }
    keys.into_iter().map(|key| key as u32).collect()
}

/// Sorts by ten bits of the keys; keys that are equal there keep their order.
fn pass(keys: &[u64], shift: u32, sorted: &mut [u64]) {
    let digit = |key: u64| (key >> shift) as usize & 1023;
    let mut starts = [0_u32; 1025];
    for &key in keys {
        starts[digit(key) + 1] += 1;
    }
    for i in 1..1024 {
        starts[i] += starts[i - 1];
    }
    for &key in keys {
        let place = &mut starts[digit(key)];
        sorted[*place as usize] = key;
        *place += 1;
    }
}

/// The point of a direction on the sphere unfolded to the unit square (Cigolle et al. 2014, "A
/// survey of efficient representations for independent unit vectors").
fn octahedral(d: Vec3) -> Vec2 {
    let p = Vec2::new(d.x, d.y) / (d.x.abs() + d.y.abs() + d.z.abs());
    let folded = if d.z >= 0.0 {
        p
    } else {
        (Vec2::ONE - Vec2::new(p.y, p.x).abs())
            * Vec2::new(1.0_f32.copysign(p.x), 1.0_f32.copysign(p.y))
    };
    (folded + 1.0) / 2.0
}

/// The cell of a point on a Z-order curve of 1024 by 1024 cells.
fn morton(p: Vec2) -> u32 {
    let spread = |x: f32| {
        let mut bits = ((x * 1024.0) as u32).min(1023);
        bits = (bits | bits << 8) & 0x00FF_00FF;
        bits = (bits | bits << 4) & 0x0F0F_0F0F;
        bits = (bits | bits << 2) & 0x3333_3333;
        (bits | bits << 1) & 0x5555_5555
    };
    spread(p.x) | spread(p.y) << 1
}

/// The cell of a point of the unit cube on a Z-order curve of 64 by 128 by 128 cells.
fn morton_3d(p: Vec3) -> u32 {
    let spread = |x: f32| {
        let mut bits = ((x * 128.0) as u32).min(127);
        bits = (bits | bits << 8) & 0x0000_F00F;
        bits = (bits | bits << 4) & 0x000C_30C3;
        (bits | bits << 2) & 0x0024_9249
    };
    (spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2) >> 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_on_the_curve_follow_each_other() {
        let turn = |i: u32| {
            let (azimuth, height) = ((i * 7919 % 1000) as f32 * 0.0063, (i % 37) as f32 / 37.0);
            let direction = Vec3::new(azimuth.cos(), azimuth.sin(), 2.0 * height - 1.0);
            Ray::new(Vec3::ZERO, direction.normalize_or(Vec3::X))
        };
        let rays: Vec<Ray> = (0..3000).map(turn).collect();
        let cell = |i: u32| morton(octahedral(rays[i as usize].direction));
        let mut expected: Vec<u32> = (0..3000).collect();
        expected.sort_by_key(|&i| cell(i));
        assert_eq!(by_direction(&rays), expected);
        assert!(by_direction(&[]).is_empty());
    }

    #[test]
    fn neighbours_in_space_follow_each_other() {
        // The cells at the corners of a cube are visited along the curve, and each ray occurs once.
        let corner = |k: u32| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32);
        let rays: Vec<Ray> = [6, 3, 0, 5, 1, 7, 2, 4]
            .map(|k| Ray::new(corner(k) * 40.0 - 7.0, Vec3::Z))
            .to_vec();
        assert_eq!(by_origin(&rays), [2, 4, 6, 1, 7, 3, 0, 5]);
        assert!(by_origin(&[]).is_empty());
        assert_eq!(morton_3d(Vec3::ONE), 0xF_FFFF);
    }
}
