//! Ambient occlusion of a shape's surface by the shape's own parts, and what they hide from the
//! ground.

use glam::Vec3;

/// Baked ambient occlusion: the share, 0..=1, of the light from all around that nearby parts of the
/// same shape let through.
///
/// It is low between leaves and at the foot of a tuft. As in the occlusion textures of renderers, 1
/// is unoccluded and 0 is black. It depends on the shape alone, wherever the shape stands; parts
/// that are farther away, other shapes and direct sunlight are not included.
///
/// Shares are stored as bytes, where 255 is unoccluded ([`encode`](Self::encode),
/// [`decode`](Self::decode)).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AmbientOcclusion {
    /// One share for each vertex of the mesh, in their order, for the side that the normal points
    /// to.
    pub vertices: Vec<u8>,
    /// For each card, in their order, one share for each corner in the order of
    /// [`Card::corners`](crate::Card::corners): the mean of both sides.
    pub cards: Vec<[u8; 4]>,
}

/// Surfaces of a shape that are near each other, as one point: they hide as much light from the
/// ground as thin leaves of this area, with every orientation, would.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Occluder {
    /// Where they are, in the shape's space, metres.
    pub position_m: Vec3,
    /// The area of one side of the leaves, m².
    pub area_m2: f32,
}

impl AmbientOcclusion {
    /// The byte of a share, which is clamped to 0..=1.
    #[must_use]
    pub fn encode(share: f32) -> u8 {
        (share.clamp(0.0, 1.0) * 255.0).round() as u8
    }

    /// The share of a byte, 0..=1.
    #[must_use]
    pub fn decode(code: u8) -> f32 {
        f32::from(code) * (1.0 / 255.0)
    }

    /// The share inside the triangle of three vertices, where the second weighs `u` and the third
    /// `v`.
    #[must_use]
    pub fn in_triangle(&self, corners: [u32; 3], u: f32, v: f32) -> f32 {
        let [a, b, c] = corners.map(|i| Self::decode(self.vertices[i as usize]));
        a * (1.0 - u - v) + b * u + c * v
    }

    /// The share at (u, v) of a card, interpolated bilinearly.
    #[must_use]
    pub fn on_card(&self, card: usize, u: f32, v: f32) -> f32 {
        let [a, b, c, d] = self.cards[card].map(Self::decode);
        let (foot, tip) = (a + (b - a) * u, d + (c - d) * u);
        foot + (tip - foot) * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_lie_between_their_corners() {
        let shares = AmbientOcclusion {
            vertices: vec![0, 51, 255],
            cards: vec![[255; 4], [0, 51, 255, 102]],
        };
        assert_eq!(shares.in_triangle([2, 2, 2], 0.3, 0.3), 1.0);
        assert!((shares.in_triangle([0, 1, 2], 0.25, 0.5) - 0.55).abs() < 1e-6);
        assert_eq!(shares.on_card(0, 0.7, 0.2), 1.0);
        let corners = [
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.2),
            (1.0, 1.0, 1.0),
            (0.0, 1.0, 0.4),
        ];
        for (u, v, share) in corners {
            assert!((shares.on_card(1, u, v) - share).abs() < 1e-6, "{u} {v}");
        }
        assert!((shares.on_card(1, 0.5, 0.5) - 0.4).abs() < 1e-6);
    }

    #[test]
    fn bytes_are_shares() {
        let round_trip = |code| AmbientOcclusion::encode(AmbientOcclusion::decode(code));
        assert!((0..=255).all(|code| round_trip(code) == code));
        assert_eq!(AmbientOcclusion::encode(-1.0), 0);
        assert_eq!(AmbientOcclusion::encode(7.0), 255);
    }
}
