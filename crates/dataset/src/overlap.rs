//! How much of a scan the frame before has seen already.

use std::collections::HashMap;

use nemoral_scene::glam::{DVec3, I64Vec3};

/// Points nearer than this are of the same place, metres.
pub(crate) const NEAR_M: f64 = 0.1;
/// A sphere around any point reaches into two cells along each axis.
const CELL_M: f64 = 2.0 * NEAR_M;

/// The points of a scan by cells of space.
struct Grid(HashMap<I64Vec3, Vec<DVec3>>);

impl Grid {
    fn new(points: Vec<DVec3>) -> Self {
        let mut cells: HashMap<I64Vec3, Vec<DVec3>> = HashMap::new();
        for p in points {
            let cell = (p / CELL_M).floor().as_i64vec3();
            cells.entry(cell).or_default().push(p);
        }
        Self(cells)
    }

    fn has_near(&self, p: DVec3) -> bool {
        let lowest = ((p - NEAR_M) / CELL_M).floor().as_i64vec3();
        (0..8_i64).any(|corner| {
            let cell = lowest + I64Vec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
            let is_near = |q: &DVec3| q.distance_squared(p) <= NEAR_M * NEAR_M;
            self.0.get(&cell).is_some_and(|q| q.iter().any(is_near))
        })
    }
}

/// Compares each scan with the one before it in the same sequence.
#[derive(Default)]
pub(crate) struct Overlap {
    before: Option<(u32, Grid)>,
    shares: Vec<f64>,
}

impl Overlap {
    /// Enters the next frame of a sequence, with its points in the world. A frame without points
    /// is passed over.
    pub(crate) fn add(&mut self, sequence: u32, points: Vec<DVec3>) {
        if points.is_empty() {
            return;
        }
        if let Some((of, grid)) = &self.before
            && *of == sequence
        {
            let seen = points.iter().filter(|&&p| grid.has_near(p)).count();
            self.shares.push(seen as f64 / points.len() as f64);
        }
        self.before = Some((sequence, Grid::new(points)));
    }

    /// For each frame but the first of a sequence, the share of its points near one of the frame
    /// before.
    pub(crate) fn shares(self) -> Vec<f64> {
        self.shares
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn points() -> impl Strategy<Value = Vec<DVec3>> {
        // Far from the origin, and so dense that many points have neighbours.
        let at = (-0.6_f64..0.6).prop_map(|x| x - 71_000.0);
        prop::collection::vec(
            [at.clone(), at.clone(), at].prop_map(DVec3::from_array),
            1..150,
        )
    }

    proptest! {
        #[test]
        fn near_points_are_those_of_all_pairs(a in points(), b in points()) {
            let near = |p: &&DVec3| a.iter().any(|q| q.distance_squared(**p) <= NEAR_M * NEAR_M);
            let expected = b.iter().filter(near).count() as f64 / b.len() as f64;
            let mut overlap = Overlap::default();
            overlap.add(0, a.clone());
            overlap.add(0, b);
            prop_assert_eq!(overlap.shares(), [expected]);
        }
    }

    #[test]
    fn sequences_do_not_overlap() {
        let scan = || vec![DVec3::ONE, DVec3::NEG_ONE];
        let mut overlap = Overlap::default();
        for (sequence, points) in [
            (0, scan()),
            (0, scan()),
            (1, scan()),
            (1, Vec::new()),
            (1, vec![DVec3::ONE, DVec3::ZERO]),
        ] {
            overlap.add(sequence, points);
        }
        assert_eq!(overlap.shares(), [1.0, 0.5]);
    }
}
