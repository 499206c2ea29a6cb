//! The ground as a function.

use glam::{DVec2, Vec3};

/// Height and slope of a ground at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Height above the world's zero, metres.
    pub height_m: f64,
    /// (dz/dx, dz/dy), metres per metre.
    pub gradient: DVec2,
}

impl SurfaceSample {
    /// The upward unit normal.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        let n = glam::DVec3::new(-self.gradient.x, -self.gradient.y, 1.0);
        (n / n.length()).as_vec3()
    }
}

/// A ground: a height and a gradient everywhere.
///
/// Points are *world* positions in f64, so that two chunks that ask for the same border point get
/// the same bits. Implementations are pure functions.
pub trait Surface: Send + Sync {
    /// Height and gradient at a world point (x east, y north, metres).
    fn sample(&self, world_m: DVec2) -> SurfaceSample;

    /// The height alone.
    fn height_m(&self, world_m: DVec2) -> f64 {
        self.sample(world_m).height_m
    }
}

impl<S: Surface + ?Sized> Surface for &S {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        (**self).sample(world_m)
    }
}

impl<S: Surface + ?Sized> Surface for std::sync::Arc<S> {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        (**self).sample(world_m)
    }
}

/// A plane: the simplest ground, for tests and for testing grounds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlatSurface {
    /// Height at the world's origin, metres.
    pub height_m: f64,
    /// (dz/dx, dz/dy), metres per metre.
    pub gradient: DVec2,
}

impl Surface for FlatSurface {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        SurfaceSample {
            height_m: self.height_m + self.gradient.dot(world_m),
            gradient: self.gradient,
        }
    }
}
