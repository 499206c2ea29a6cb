//! The grid on which the boxes of a shape's tree are stored.

use glam::DVec3;
use nemoral_scene::Bounds;

/// Steps of a grid, per axis.
const STEPS: f64 = 65_535.0;

/// Planes at equal distances, perpendicular to each axis.
#[derive(Clone, Debug)]
pub(crate) struct QuantizationGrid {
    /// Where the first planes are.
    pub(crate) origin: DVec3,
    /// The distance from each plane to the next.
    pub(crate) step: [f32; 3],
}

impl QuantizationGrid {
    /// The grid of boxes whose coordinates are stored as they are.
    pub(crate) const IDENTITY: Self = Self {
        origin: DVec3::ZERO,
        step: [1.0; 3],
    };

    /// A grid over a box.
    pub(crate) fn over(bounds: &Bounds) -> Self {
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        // One step fewer than there are, so that rounding does not bring the last plane inside.
        let step = (max - min) / (STEPS - 1.0);
        Self {
            origin: min,
            step: step.as_vec3().to_array().map(|s| s.max(1e-30)),
        }
    }

    /// The planes just below and above two coordinates of an axis.
    pub(crate) fn around(&self, axis: usize, low: f32, high: f32) -> [u16; 2] {
        let (origin, step) = (self.origin[axis], f64::from(self.step[axis]));
        let below = ((f64::from(low) - origin) / step).floor();
        let above = ((f64::from(high) - origin) / step).ceil();
        // `as` saturates.
        [below as u16, above as u16]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_box_on_the_grid_contains_the_box_it_was_made_from(
            points in prop::collection::vec(prop::array::uniform3(-1e6_f32..1e6), 2..20),
            flat in 0_usize..4,
            size in prop::sample::select(vec![1e-6_f32, 1.0, 1e6]),
        ) {
            let points = points.iter().map(|p| {
                let mut p = Vec3::from_array(*p) * 1e-6 * size + 3.0;
                if flat < 3 {
                    p[flat] = 7.1;
                }
                p
            });
            let points: Vec<Vec3> = points.collect();
            let grid = QuantizationGrid::over(&Bounds::of_points(points.iter().copied()));
            for pair in points.windows(2) {
                let b = Bounds::of_points(pair.iter().copied());
                for k in 0..3 {
                    let planes = grid.around(k, b.min[k], b.max[k]);
                    let [low, high] =
                        planes.map(|p| grid.origin[k] + f64::from(p) * f64::from(grid.step[k]));
                    let (min, max) = (f64::from(b.min[k]), f64::from(b.max[k]));
                    // To the rounding of f64, which the slack of rays covers.
                    let tiny = 1e-12 * f64::from(size);
                    prop_assert!(
                        low <= min + tiny && high >= max - tiny,
                        "{low} {min} {max} {high}"
                    );
                    let step = 1.001 * f64::from(grid.step[k]) + tiny;
                    prop_assert!(min - low <= step && high - max <= step);
                }
            }
        }
    }
}
