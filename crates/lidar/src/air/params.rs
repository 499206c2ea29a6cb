//! What the air is made of, and how well the receiver sees it.

use nemoral_scene::ParamError;

/// A layer of air whose extinction decreases with height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirLayer {
    /// Extinction at its base, at the laser's wavelength, per metre, at least 0.
    pub extinction_per_m: f64,
    /// The base's height in the scene, metres; the scanner's if none.
    pub base_m: Option<f64>,
    /// The height over which extinction decreases by a factor of e, metres, greater than 0.
    pub height_m: f64,
    /// Extinction over backscatter, steradians, greater than 0: 18.8 for drops of fog and clouds,
    /// some 50 for haze.
    pub lidar_ratio_sr: f64,
}

impl Default for AirLayer {
    /// None.
    fn default() -> Self {
        Self {
            extinction_per_m: 0.0,
            base_m: None,
            height_m: 100.0,
            lidar_ratio_sr: 18.8,
        }
    }
}

/// The air, and how well the receiver sees it. By default there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirParams {
    /// Haze and mist.
    pub haze: AirLayer,
    /// Fog near the ground.
    pub fog: AirLayer,
    /// Rain, everywhere, 0..=200.
    pub rain_mm_per_h: f64,
    /// Snowfall as water, everywhere, 0..=20.
    pub snowfall_mm_per_h: f64,
    /// The reflectance of a disc that sends as much light back as a raindrop of its width, 0..=1.
    pub drop_reflectance: f64,
    /// The same of a snowflake.
    pub flake_reflectance: f64,
    /// The farthest range at which the receiver sees a reference target, metres, greater than 0.
    pub reference_range_m: f64,
    /// The reflectance of that target, greater than 0.
    pub reference_reflectance: f64,
    /// Nearer than this, the receiver is less sensitive to the air's echoes, by the square of the
    /// range; metres, at least 0.
    pub near_m: f64,
}

impl Default for AirParams {
    /// No air, and the receiver of Livox's Mid-40: 90 m at 10 %.
    fn default() -> Self {
        Self {
            haze: AirLayer::default(),
            fog: AirLayer::default(),
            rain_mm_per_h: 0.0,
            snowfall_mm_per_h: 0.0,
            drop_reflectance: 0.024,
            flake_reflectance: 0.3,
            reference_range_m: 90.0,
            reference_reflectance: 0.1,
            near_m: 10.0,
        }
    }
}

impl AirParams {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        for layer in [&self.haze, &self.fog] {
            ParamError::check_at_least_zero("air.extinction_per_m", layer.extinction_per_m)?;
            ParamError::check_positive("air.height_m", layer.height_m)?;
            ParamError::check_positive("air.lidar_ratio_sr", layer.lidar_ratio_sr)?;
            let base_m = layer.base_m.unwrap_or(0.0);
            ParamError::check(base_m.is_finite(), "air.base_m", base_m, "finite")?;
        }
        for (field, value, most, allowed) in [
            ("air.rain_mm_per_h", self.rain_mm_per_h, 200.0, "0..=200"),
            (
                "air.snowfall_mm_per_h",
                self.snowfall_mm_per_h,
                20.0,
                "0..=20",
            ),
            ("air.drop_reflectance", self.drop_reflectance, 1.0, "0..=1"),
            (
                "air.flake_reflectance",
                self.flake_reflectance,
                1.0,
                "0..=1",
            ),
        ] {
            ParamError::check((0.0..=most).contains(&value), field, value, allowed)?;
        }
        ParamError::check_positive("air.reference_range_m", self.reference_range_m)?;
        ParamError::check_positive("air.reference_reflectance", self.reference_reflectance)?;
        ParamError::check_at_least_zero("air.near_m", self.near_m)
    }

    pub(super) fn layers(&self) -> [AirLayer; 2] {
        [self.haze, self.fog]
    }
}
