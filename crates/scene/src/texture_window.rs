//! The part of a texture and mask that a card shows.

use glam::{DVec2, Vec2};

/// Which part of its material's texture and mask a card shows, and which way round: the texture
/// coordinate is an affine function of the place on the card.
///
/// The point (s, t) of a card, both in 0..1 along its edges, has the texture coordinate
/// `origin + s · along_u + t · along_v`. So a window cuts a leaf out of an atlas, turns it and
/// flips it. Texture coordinates outside of 0..1 clamp in masks and repeat in colours.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TextureWindow {
    /// The texture coordinate at the card's corner.
    pub origin: Vec2,
    /// How it changes along the card's edge u.
    pub along_u: Vec2,
    /// How it changes along the card's edge v.
    pub along_v: Vec2,
}

impl TextureWindow {
    /// The whole texture as it is, which cards without a window show.
    pub const WHOLE: Self = Self {
        origin: Vec2::ZERO,
        along_u: Vec2::X,
        along_v: Vec2::Y,
    };

    /// The upright rectangle between two texture coordinates.
    #[must_use]
    pub fn rectangle(min: Vec2, max: Vec2) -> Self {
        Self {
            origin: min,
            along_u: Vec2::new(max.x - min.x, 0.0),
            along_v: Vec2::new(0.0, max.y - min.y),
        }
    }

    /// The same window mirrored along the card's edge u.
    #[must_use]
    pub fn flipped(self) -> Self {
        Self {
            origin: self.origin + self.along_u,
            along_u: -self.along_u,
            ..self
        }
    }

    /// The same window turned by a quarter: what was along the card's edge u is along its edge v.
    #[must_use]
    pub fn turned(self) -> Self {
        Self {
            origin: self.origin + self.along_v,
            along_u: -self.along_v,
            along_v: self.along_u,
        }
    }

    /// The texture coordinate at a place on the card, both in 0..1, computed in f64 and rounded
    /// once.
    #[inline(always)]
    #[must_use]
    pub fn uv(&self, s: f64, t: f64) -> Vec2 {
        let at = |k: usize| {
            f64::from(self.origin[k])
                + s * f64::from(self.along_u[k])
                + t * f64::from(self.along_v[k])
        };
        DVec2::new(at(0), at(1)).as_vec2()
    }

    /// The area of the window, in that of the texture.
    #[must_use]
    pub fn area(&self) -> f64 {
        let (u, v) = (self.along_u.as_dvec2(), self.along_v.as_dvec2());
        u.perp_dot(v).abs()
    }

    /// Whether all its numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.origin.is_finite() && self.along_u.is_finite() && self.along_v.is_finite()
    }

    /// Its numbers as bits, by which windows are told apart.
    #[must_use]
    pub fn to_bits(self) -> [u32; 6] {
        let [o, u, v] = [self.origin, self.along_u, self.along_v];
        [o.x, o.y, u.x, u.y, v.x, v.y].map(f32::to_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_cut_out_turned_and_flipped() {
        let window = TextureWindow::rectangle(Vec2::new(0.25, 0.5), Vec2::new(0.5, 1.0));
        assert_eq!(window.uv(0.0, 1.0), Vec2::new(0.25, 1.0));
        assert_eq!(window.area(), 0.125);
        assert_eq!(window.flipped().uv(0.25, 1.0), window.uv(0.75, 1.0));
        // A quarter turn brings the corner at u = 1 to where v = 1 was, and so on.
        for (s, t) in [(0.0, 0.0), (1.0, 0.0), (0.25, 0.75)] {
            assert_eq!(window.turned().uv(s, t), window.uv(t, 1.0 - s));
        }
        let around = window.turned().turned().turned().turned();
        assert_eq!(around.uv(0.25, 0.75), window.uv(0.25, 0.75));
        assert_eq!(TextureWindow::WHOLE.uv(0.3, 0.7), Vec2::new(0.3, 0.7));
    }
}
