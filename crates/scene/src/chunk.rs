//! Chunk coordinates.

use glam::DVec2;

/// The integer coordinate of a square chunk: chunk (0, 0) has its south-west corner at the world's
/// origin, x counts east, y north.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ChunkCoord {
    /// Chunks east of the origin.
    pub x: i32,
    /// Chunks north of the origin.
    pub y: i32,
}

impl ChunkCoord {
    /// The chunk at integer coordinate (x, y).
    #[must_use]
    pub const fn new(x: i32, y: i32) -> Self {
        Self { x, y }
    }

    /// The chunk that holds a world point; its west and south borders belong to it.
    #[must_use]
    pub fn containing(world_m: DVec2, chunk_size_m: f64) -> Self {
        let cell = (world_m / chunk_size_m).floor();
        Self::new(cell.x as i32, cell.y as i32)
    }

    /// The world position of the south-west corner.
    #[must_use]
    pub fn origin_m(self, chunk_size_m: f64) -> DVec2 {
        DVec2::new(f64::from(self.x), f64::from(self.y)) * chunk_size_m
    }

    /// The world position of the centre.
    #[must_use]
    pub fn centre_m(self, chunk_size_m: f64) -> DVec2 {
        self.origin_m(chunk_size_m) + DVec2::splat(chunk_size_m / 2.0)
    }

    /// The chunk `dx` to the east and `dy` to the north.
    #[must_use]
    pub const fn offset(self, dx: i32, dy: i32) -> Self {
        Self::new(self.x + dx, self.y + dy)
    }

    /// The chunks that are at most `rings` away, diagonally too, and this one among them, in order
    /// of (x, y).
    pub fn square(self, rings: i32) -> impl Iterator<Item = Self> {
        (-rings..=rings).flat_map(move |x| (-rings..=rings).map(move |y| self.offset(x, y)))
    }

    /// The distance from a world point to the nearest point of this chunk; 0 inside.
    #[must_use]
    pub fn distance_m(self, world_m: DVec2, chunk_size_m: f64) -> f64 {
        let low = self.origin_m(chunk_size_m);
        world_m.distance(world_m.clamp(low, low + DVec2::splat(chunk_size_m)))
    }

    /// All chunks that come within `radius_m` of a world point, in order of (x, y).
    #[must_use]
    pub fn within(world_m: DVec2, radius_m: f64, chunk_size_m: f64) -> Vec<Self> {
        let low = Self::containing(world_m - DVec2::splat(radius_m), chunk_size_m);
        let high = Self::containing(world_m + DVec2::splat(radius_m), chunk_size_m);
        (low.x..=high.x)
            .flat_map(|x| (low.y..=high.y).map(move |y| Self::new(x, y)))
            .filter(|c| c.distance_m(world_m, chunk_size_m) <= radius_m)
            .collect()
    }
}

impl From<ChunkCoord> for [i32; 2] {
    fn from(c: ChunkCoord) -> Self {
        [c.x, c.y]
    }
}

impl std::fmt::Display for ChunkCoord {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}, {})", self.x, self.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_point_is_in_its_chunk(x in -1e6_f64..1e6, y in -1e6_f64..1e6, size in 1.0_f64..200.0) {
            let c = ChunkCoord::containing(DVec2::new(x, y), size);
            prop_assert!(c.distance_m(DVec2::new(x, y), size) < 1e-9);
        }

        #[test]
        fn within_is_the_brute_force_answer(
            x in -99.0_f64..99.0,
            y in -99.0_f64..99.0,
            r in 0.0_f64..150.0,
        ) {
            let p = DVec2::new(x, y);
            let all: Vec<_> = (-8..8)
                .flat_map(|x| (-8..8).map(move |y| ChunkCoord::new(x, y)))
                .filter(|c| c.distance_m(p, 50.0) <= r)
                .collect();
            prop_assert_eq!(ChunkCoord::within(p, r, 50.0), all);
        }
    }
}
