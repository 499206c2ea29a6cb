//! The ground as a function.

use std::sync::Arc;

use glam::{DVec2, Vec3};

/// Height and slope of a ground at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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

    /// The height alone, equal to that of [`sample`](Self::sample) to the bit.
    fn height_m(&self, world_m: DVec2) -> f64 {
        self.sample(world_m).height_m
    }
}

/// Grounds behind a pointer are grounds.
macro_rules! forward {
    ($($pointer:ty),*) => {$(
        impl<S: Surface + ?Sized> Surface for $pointer {
            fn sample(&self, world_m: DVec2) -> SurfaceSample {
                (**self).sample(world_m)
            }

            fn height_m(&self, world_m: DVec2) -> f64 {
                (**self).height_m(world_m)
            }
        }
    )*};
}

forward!(&S, Box<S>, Arc<S>);

/// A plane: the simplest ground, for tests and for testing grounds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the contract, its height alone is not that of its samples, which tells them apart.
    struct Quick;

    impl Surface for Quick {
        fn sample(&self, _: DVec2) -> SurfaceSample {
            FlatSurface::default().sample(DVec2::ZERO)
        }

        fn height_m(&self, _: DVec2) -> f64 {
            1.0
        }
    }

    #[test]
    fn pointers_to_grounds_forward_every_method() {
        fn heights(ground: impl Surface) -> [f64; 2] {
            [
                ground.sample(DVec2::ONE).height_m,
                ground.height_m(DVec2::ONE),
            ]
        }
        let boxed: Box<dyn Surface> = Box::new(Quick);
        for found in [heights(&Quick), heights(boxed), heights(Arc::new(Quick))] {
            assert_eq!(found, [0.0, 1.0]);
        }
    }
}
