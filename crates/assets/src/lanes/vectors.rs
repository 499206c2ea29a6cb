//! Eight points of the plane, and eight colours.

use std::ops::{Add, Div, Mul, MulAssign, Sub};

use glam::{Vec2, Vec3};

use super::{F32x8, Mask8};

/// Eight points of the plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec2x8 {
    pub(crate) x: F32x8,
    pub(crate) y: F32x8,
}

/// Eight colours.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vec3x8 {
    pub(crate) x: F32x8,
    pub(crate) y: F32x8,
    pub(crate) z: F32x8,
}

impl Vec2x8 {
    #[inline(always)]
    pub(crate) fn new(x: impl Into<F32x8>, y: impl Into<F32x8>) -> Self {
        Self {
            x: x.into(),
            y: y.into(),
        }
    }

    #[inline(always)]
    pub(crate) fn length(self) -> F32x8 {
        (self.x * self.x + self.y * self.y).sqrt()
    }
}

impl Add<Vec2> for Vec2x8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Vec2) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl Sub<Vec2> for Vec2x8 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Vec2) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl Mul<f32> for Vec2x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}

impl Div<F32x8> for Vec2x8 {
    type Output = Self;
    #[inline(always)]
    fn div(self, divisor: F32x8) -> Self {
        Self::new(self.x / divisor, self.y / divisor)
    }
}

/// One colour in all lanes.
#[inline(always)]
pub(crate) const fn rgb(r: f32, g: f32, b: f32) -> Vec3x8 {
    Vec3x8 {
        x: F32x8::splat(r),
        y: F32x8::splat(g),
        z: F32x8::splat(b),
    }
}

impl Vec3x8 {
    /// This colour where `t` is 0, `other` where it is 1.
    #[inline(always)]
    pub(crate) fn lerp(self, other: Self, t: impl Into<F32x8>) -> Self {
        let t = t.into();
        self * (1.0 - t) + other * t
    }
}

impl From<Vec3> for Vec3x8 {
    #[inline(always)]
    fn from(c: Vec3) -> Self {
        rgb(c.x, c.y, c.z)
    }
}

impl Add for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }
}

impl Mul for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            x: self.x * other.x,
            y: self.y * other.y,
            z: self.z * other.z,
        }
    }
}

impl Mul<F32x8> for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: F32x8) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }
}

impl Mul<f32> for Vec3x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f32) -> Self {
        self * F32x8::splat(factor)
    }
}

impl<T> MulAssign<T> for Vec3x8
where
    Self: Mul<T, Output = Self>,
{
    #[inline(always)]
    fn mul_assign(&mut self, factor: T) {
        *self = *self * factor;
    }
}

impl Mask8 {
    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select_colour(self, yes: Vec3x8, no: Vec3x8) -> Vec3x8 {
        Vec3x8 {
            x: self.select(yes.x, no.x),
            y: self.select(yes.y, no.y),
            z: self.select(yes.z, no.z),
        }
    }
}
