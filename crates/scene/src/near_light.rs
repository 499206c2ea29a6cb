//! What near parts of a shape leave of the light around them.

/// The share, 0..=1, of the light from all around that near parts of the same shape leave: dark between
/// leaves, at the foot of a tuft. It is of the shape alone, wherever it stands; what is farther, other
/// shapes and the sun's beam are not in it.
///
/// Shares are kept in bytes, 255 is all ([`code`](Self::code), [`share`](Self::share)).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NearLight {
    /// One of each vertex of the mesh, in their order, for the side that its normal points to.
    pub vertices: Vec<u8>,
    /// Of each card, in their order, one of each corner as [`Card::corners`](crate::Card::corners) has them, the mean of both
    /// sides.
    pub cards: Vec<[u8; 4]>,
}

impl NearLight {
    /// The byte of a share; what is outside of 0..=1 is taken as its next end.
    #[must_use]
    pub fn code(share: f32) -> u8 {
        (share.clamp(0.0, 1.0) * 255.0).round() as u8
    }

    /// The share of a byte, 0..=1.
    #[must_use]
    pub fn share(code: u8) -> f32 {
        f32::from(code) * (1.0 / 255.0)
    }

    /// In a triangle of these vertices, where the second and the third weigh `u` and `v`.
    #[must_use]
    pub fn in_triangle(&self, corners: [u32; 3], u: f32, v: f32) -> f32 {
        let [a, b, c] = corners.map(|i| Self::share(self.vertices[i as usize]));
        a * (1.0 - u - v) + b * u + c * v
    }

    /// At (u, v) of a card, bilinear.
    #[must_use]
    pub fn on_card(&self, card: usize, u: f32, v: f32) -> f32 {
        let [a, b, c, d] = self.cards[card].map(Self::share);
        let (foot, tip) = (a + (b - a) * u, d + (c - d) * u);
        foot + (tip - foot) * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_lie_between_their_corners() {
        let near = NearLight {
            vertices: vec![0, 51, 255],
            cards: vec![[255; 4], [0, 51, 255, 102]],
        };
        assert_eq!(near.in_triangle([2, 2, 2], 0.3, 0.3), 1.0);
        assert!((near.in_triangle([0, 1, 2], 0.25, 0.5) - 0.55).abs() < 1e-6);
        assert_eq!(near.on_card(0, 0.7, 0.2), 1.0);
        let corners = [
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.2),
            (1.0, 1.0, 1.0),
            (0.0, 1.0, 0.4),
        ];
        for (u, v, share) in corners {
            assert!((near.on_card(1, u, v) - share).abs() < 1e-6, "{u} {v}");
        }
        assert!((near.on_card(1, 0.5, 0.5) - 0.4).abs() < 1e-6);
    }

    #[test]
    fn bytes_are_shares() {
        assert!((0..=255).all(|code| NearLight::code(NearLight::share(code)) == code));
        assert_eq!((NearLight::code(-1.0), NearLight::code(7.0)), (0, 255));
    }
}
