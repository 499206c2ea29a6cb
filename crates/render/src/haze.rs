//! The air between the camera and what it sees.

/// Aerial perspective, and the end of the visible world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Haze {
    /// Extinction at the camera's height, 1/m.
    pub(crate) extinction: f32,
    /// The part of it that the sky's own aerosols do not explain: mist, 1/m.
    pub(crate) mist: f32,
    /// The height over which the haze thins by e, metres.
    pub(crate) height_m: f32,
    /// Where everything is sky, metres.
    pub(crate) range_m: f32,
}

impl Haze {
    /// The share of the sky's light that the mist lets through from a direction with this upward
    /// sine.
    pub(crate) fn sky_transmittance(&self, rise: f32) -> f32 {
        if self.mist == 0.0 {
            return 1.0;
        }
        libm::expf(-self.mist * self.height_m / rise.max(1e-3))
    }

    /// The share of a surface's light that arrives: air, then the fade at the end of the world.
    ///
    /// Air is Beer and Lambert's law through an exponential layer. The fade (1 − (d / range)⁴)²
    /// takes 12 % at half the range and all of it at the range, so that no edge is seen.
    pub(crate) fn transmittance(&self, distance_m: f32, rise_m: f32) -> (f32, f32) {
        let x = rise_m / self.height_m;
        // The mean of e^(−x) along the way; the series where the quotient loses its digits.
        let density = if x.abs() < 1e-2 {
            1.0 - 0.5 * x
        } else {
            // Far below the camera the layer would overflow; e^20 is opaque already.
            let x = x.max(-20.0);
            (1.0 - libm::expf(-x)) / x
        };
        let air = libm::expf(-self.extinction * distance_m * density);
        let d2 = (distance_m / self.range_m) * (distance_m / self.range_m);
        let fade = (1.0 - d2 * d2).max(0.0);
        (air, fade * fade)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_is_beer_and_lamberts_law_through_a_layer() {
        let haze = Haze {
            extinction: 0.004,
            mist: 0.0,
            height_m: 30.0,
            range_m: 1e9,
        };
        for (distance, rise) in [
            (50.0_f32, 0.0_f32),
            (200.0, 0.2),
            (120.0, 60.0),
            (90.0, -25.0),
        ] {
            let n = 10_000;
            let depth: f64 = (0..n)
                .map(|i| {
                    let t = (f64::from(i) + 0.5) / f64::from(n);
                    0.004 * (-f64::from(rise) * t / 30.0).exp() * f64::from(distance) / f64::from(n)
                })
                .sum();
            let (air, fade) = haze.transmittance(distance, rise);
            assert!(
                (f64::from(air) - (-depth).exp()).abs() < 1e-4,
                "{distance} {rise}: {air}"
            );
            assert!(fade > 0.999);
        }
    }

    #[test]
    fn nothing_is_left_at_the_end_of_the_world() {
        let haze = Haze {
            extinction: 0.0,
            mist: 0.0,
            height_m: 30.0,
            range_m: 300.0,
        };
        let at = |d| haze.transmittance(d, 0.0).1;
        assert_eq!((at(0.0), at(300.0), at(400.0)), (1.0, 0.0, 0.0));
        assert!(at(150.0) > 0.85 && at(290.0) < 0.05 && at(299.9) < 1e-4);
    }
}
