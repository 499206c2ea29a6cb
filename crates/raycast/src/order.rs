//! The order in which the rays of a batch are cast.

use glam::{Vec2, Vec3};
use nemoral_scene::Ray;

/// Ray numbers, neighbours in direction near each other: what one ray has brought to the cache
/// serves the next. A permutation of `0..rays.len()`.
pub(crate) fn by_direction(rays: &[Ray]) -> Vec<u32> {
    let mut keys: Vec<u64> = rays
        .iter()
        .zip(0_u64..)
        .map(|(ray, i)| u64::from(morton(octahedral(ray.direction))) << 32 | i)
        .collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

/// The sphere unfolded on the unit square (Cigolle et al. 2014, "A survey of efficient
/// representations for independent unit vectors").
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
