//! The air between the camera and what it sees.

/// A layer of air whose extinction decreases with height: σ(z) = σ(camera) · e^(−(z − camera) /
/// height).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layer {
    /// The extinction at the camera, 1/m.
    pub(crate) extinction: f32,
    /// The height over which it decreases by a factor of e, metres.
    pub(crate) height_m: f32,
}

impl Layer {
    /// The extinction at a place that is so much higher than the camera, 1/m.
    fn extinction_at(&self, rise_m: f32) -> f32 {
        // Far below the camera the layer would overflow; e^20 is opaque already.
        self.extinction * libm::expf((-rise_m / self.height_m).min(20.0))
    }

    /// The optical depth of a path that rises by `rise_m`: σ · d · (1 − e^(−x)) / x with x = rise /
    /// height, the integral of σ along it.
    fn depth(&self, distance_m: f32, rise_m: f32) -> f32 {
        let x = rise_m / self.height_m;
        let mean = if x.abs() < 0.1 {
            // The series of the quotient, where the quotient itself would be inexact.
            1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0))))
        } else {
            // Far below the camera the layer would overflow; e^20 is opaque already.
            let x = x.max(-20.0);
            (1.0 - libm::expf(-x)) / x
        };
        self.extinction * distance_m * mean
    }

    /// The optical depth of a path out to the sky with this upward sine.
    fn depth_out(&self, rise: f32) -> f32 {
        self.extinction * self.height_m / rise.max(1e-3)
    }
}

/// Aerial perspective, and the fade at the end of the visible range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Haze {
    /// All haze but fog.
    pub(crate) air: Layer,
    /// The share of `air` that is mist beyond the sky's own aerosols, 0..=1.
    pub(crate) mist: f32,
    /// Fog near the ground.
    pub(crate) fog: Layer,
    /// The distance beyond which everything is sky, metres.
    pub(crate) range_m: f32,
}

impl Haze {
    /// The share of the sky's light that mist and fog let through from a direction with this upward
    /// sine.
    pub(crate) fn sky_transmittance(&self, rise: f32) -> f32 {
        if self.mist == 0.0 && self.fog.extinction == 0.0 {
            return 1.0;
        }
        libm::expf(-self.mist * self.air.depth_out(rise) - self.fog.depth_out(rise))
    }

    /// The same air as it is around a place that is so much higher than the camera.
    pub(crate) fn raised(&self, rise_m: f32) -> Self {
        let raised = |layer: Layer| Layer {
            extinction: layer.extinction_at(rise_m),
            ..layer
        };
        Self {
            air: raised(self.air),
            fog: raised(self.fog),
            ..*self
        }
    }

    /// The extinction at a place that is so much higher than the camera, 1/m.
    pub(crate) fn extinction_per_m(&self, rise_m: f32) -> f32 {
        self.air.extinction_at(rise_m) + self.fog.extinction_at(rise_m)
    }

    /// The shares of a surface's light that pass the air and the fade at the end of the visible
    /// range.
    ///
    /// Air is Beer and Lambert's law through two exponential layers. The fade 1 − (d / range)¹⁶
    /// takes next to nothing at half the range, 3 % at four fifths of it and everything at the
    /// range, so that no edge is visible. (lighting.wgsl has the same.)
    pub(crate) fn transmittance(&self, distance_m: f32, rise_m: f32) -> (f32, f32) {
        let mut depth = self.air.depth(distance_m, rise_m);
        if self.fog.extinction > 0.0 {
            depth += self.fog.depth(distance_m, rise_m);
        }
        let d2 = (distance_m / self.range_m) * (distance_m / self.range_m);
        let d4 = d2 * d2;
        let d8 = d4 * d4;
        let fade = (1.0 - d8 * d8).max(0.0);
        (libm::expf(-depth), fade)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::extinction_per_m;
    use proptest::prelude::*;

    fn haze(air: Layer, fog: Layer) -> Haze {
        Haze {
            air,
            mist: 0.0,
            fog,
            range_m: 1e9,
        }
    }

    fn layer(extinction: f32, height_m: f32) -> Layer {
        Layer {
            extinction,
            height_m,
        }
    }

    /// The depth of a layer by Simpson's rule in f64.
    fn integrated(l: Layer, distance: f32, rise: f32) -> f64 {
        let n = 2000;
        let sigma = |i: u32| {
            let z = f64::from(rise) * f64::from(i) / f64::from(n);
            f64::from(l.extinction) * libm::exp(-z / f64::from(l.height_m))
        };
        let weight = |i: u32| match i {
            0 => 1.0,
            i if i == n => 1.0,
            i if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        (0..=n).map(|i| weight(i) * sigma(i)).sum::<f64>() * f64::from(distance)
            / f64::from(n)
            / 3.0
    }

    proptest! {
        /// Both layers at once, upwards, downwards and level, are compared with the integral and,
        /// in f64, with the closed form.
        #[test]
        fn air_is_beer_and_lamberts_law(
            distance in 0.5_f32..2000.0,
            slope in -0.99_f32..0.99,
            air in 1e-5_f32..0.01,
            air_height in 20.0_f32..2000.0,
            fog in 0.0_f32..0.2,
            fog_height in 2.0_f32..60.0,
        ) {
            let rise = (slope * distance).clamp(-15.0 * fog_height, 1e4);
            let (air, fog) = (layer(air, air_height), layer(fog, fog_height));
            let (got, fade) = haze(air, fog).transmittance(distance, rise);
            prop_assert!(fade > 0.999);
            let exact =
                libm::exp(-integrated(air, distance, rise) - integrated(fog, distance, rise));
            prop_assert!((f64::from(got) - exact).abs() < 1e-5, "{got} for {exact}");
            let closed = |l: Layer| {
                let x = f64::from(rise) / f64::from(l.height_m);
                let mean = if x == 0.0 { 1.0 } else { -libm::expm1(-x) / x };
                f64::from(l.extinction) * f64::from(distance) * mean
            };
            let closed = libm::exp(-closed(air) - closed(fog));
            prop_assert!((f64::from(got) - closed).abs() < 1e-5, "{got} for {closed}");
        }
    }

    #[test]
    fn two_percent_of_the_contrast_are_left_at_the_visibility() {
        for visibility in [50.0, 1000.0, 20_000.0] {
            let air = layer(extinction_per_m(visibility) as f32, 100.0);
            let (left, _) = haze(air, layer(0.0, 1.0)).transmittance(visibility as f32, 0.0);
            assert!((left - 0.02).abs() < 1e-5, "{visibility}: {left}");
        }
    }

    #[test]
    fn fog_hides_the_low_sky_first() {
        let h = haze(layer(2e-4, 100.0), layer(0.03, 10.0));
        let [low, middle, high] = [0.02, 0.3, 1.0].map(|rise| h.sky_transmittance(rise));
        assert!(
            low < 1e-5 && middle < 0.4 && high > 0.7,
            "{low} {middle} {high}"
        );
        assert!((high - libm::expf(-0.3)).abs() < 1e-6);
    }

    #[test]
    fn nothing_is_left_at_the_end_of_the_world() {
        let clear = Haze {
            range_m: 300.0,
            ..haze(layer(0.0, 30.0), layer(0.0, 30.0))
        };
        let at = |d| clear.transmittance(d, 0.0).1;
        assert_eq!((at(0.0), at(300.0), at(400.0)), (1.0, 0.0, 0.0));
        // What is seen well before the end is veiled by the air alone.
        assert!(at(150.0) > 0.9999 && at(200.0) > 0.998 && at(290.0) < 0.45 && at(299.9) < 6e-3);
        for d in [10.0, 120.0, 225.0, 270.0, 297.0] {
            let exact = 1.0 - libm::pow(f64::from(d) / 300.0, 16.0);
            assert!(
                (f64::from(at(d)) - exact).abs() < 1e-5,
                "{d}: {} for {exact}",
                at(d)
            );
        }
    }
}
