//! Turns a LiDAR's table into the parameters of the scanner.

use std::f64::consts::TAU;

use nemoral_lidar::{
    AirLayer, AirParams, Avia, Beam, Carrier, CsvPattern, LivoxHorizonLike, Mid40, Mid70,
    MirrorMotion, MotorParams, MotorisedPattern, Panorama, PanoramaParams, RepeatingLines,
    RepeatingLinesParams, ScanMirror, ScanMirrorParams, ScanPattern, ScannerParams,
    SpinningPattern, Wavelength,
};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{RigidTransform, extinction_per_m};

use super::devices::LIGHT_M_PER_NS;
use super::mount::mount;
use super::{
    Error, InputFile, InputFiles, Lidar, LidarMirror, LidarPattern, MirrorKind, ReturnMode,
    SpinningHead, Weather,
};

/// The lidar ratio of continental haze, steradians.
const HAZE_SR: f64 = 50.0;

/// An error of the table at `path`.
fn refused_at(path: &str, why: impl std::fmt::Display) -> Error {
    Error::request(format!("{path}: {why}"))
}

impl Lidar {
    /// The position and direction of the LiDAR frame on the body.
    #[must_use]
    pub fn body_from_lidar(&self) -> RigidTransform {
        mount(
            [self.mount_x_m, self.mount_y_m, self.mount_z_m],
            [
                self.mount_roll_deg,
                self.mount_pitch_deg,
                self.mount_yaw_deg,
            ],
        )
    }

    /// The directions and times of the pulses. `path` is where the table is.
    ///
    /// # Errors
    /// If there is no such pattern, or a file is no table of pulses.
    pub fn scan_pattern(
        &self,
        path: &str,
        inputs: &InputFiles,
    ) -> Result<Box<dyn ScanPattern>, Error> {
        let pattern = self.unmoved_pattern(path, inputs)?;
        let params = MotorParams {
            turns_hz: self.motor.turns_hz,
            tilt_rad: self.motor.tilt_deg.to_radians(),
        };
        if params.turns_hz == 0.0 {
            return Ok(pattern);
        }
        let motorised = MotorisedPattern::new(pattern, params);
        Ok(Box::new(
            motorised.map_err(|e| refused_at(&format!("{path}.motor"), e))?,
        ))
    }

    /// The same without its motor.
    fn unmoved_pattern(
        &self,
        path: &str,
        inputs: &InputFiles,
    ) -> Result<Box<dyn ScanPattern>, Error> {
        let refused = |e| refused_at(path, e);
        Ok(match &self.pattern {
            LidarPattern::Mid40(_) => Box::new(Mid40),
            LidarPattern::Mid70(_) => Box::new(Mid70),
            LidarPattern::Avia(_) => Box::new(Avia),
            LidarPattern::Horizon(_) => Box::new(LivoxHorizonLike),
            LidarPattern::Lines(l) => {
                // One turn has the number of pulses that is asked for.
                let columns = self.pulses.div_ceil(l.lines).max(1);
                let params = RepeatingLinesParams {
                    lines: l.lines as u8,
                    bottom_rad: l.low_deg.to_radians(),
                    top_rad: l.high_deg.to_radians(),
                    horizontal_fov_rad: TAU,
                    columns,
                    rotation_hz: l.rotation_hz,
                };
                Box::new(RepeatingLines::new(params).map_err(refused)?)
            }
            LidarPattern::Spinning(s) => {
                let head = match s.head {
                    SpinningHead::Vlp16 => SpinningPattern::vlp16(s.rotation_hz),
                    SpinningHead::Hdl64e => SpinningPattern::hdl64e(s.rotation_hz),
                    SpinningHead::Os1x64 => SpinningPattern::os1_64(s.columns, s.rotation_hz),
                    SpinningHead::Ouster => SpinningPattern::ouster(
                        s.vertical_fov_deg.to_radians(),
                        s.beams as u8,
                        s.columns,
                        s.rotation_hz,
                    ),
                };
                Box::new(head.map_err(refused)?)
            }
            LidarPattern::Panorama(p) => {
                let (bottom, top) = (p.low_deg.to_radians(), p.high_deg.to_radians());
                // The steps of both angles are equal.
                let pulses = f64::from(self.pulses);
                let rows = (pulses * (top - bottom) / TAU).sqrt().round().max(1.0);
                let params = PanoramaParams {
                    rows: rows as u32,
                    columns: self.pulses.div_ceil(rows as u32),
                    bottom_rad: bottom,
                    top_rad: top,
                    rate_hz: p.rate_hz,
                };
                Box::new(Panorama::new(params).map_err(refused)?)
            }
            LidarPattern::Mirror(m) => Box::new(ScanMirror::new(m.params()).map_err(refused)?),
            LidarPattern::Table(table) => {
                let file = inputs.get(&table.path);
                let pattern = CsvPattern::from_csv(file.map_or(&[][..], InputFile::bytes));
                Box::new(
                    pattern.map_err(|e| {
                        Error::request(format!("{}.table: {}: {e}", path, table.path))
                    })?,
                )
            }
        })
    }

    /// The parameters of the scanner, whose range is limited to the visible radius.
    #[must_use]
    pub fn scanner_params(&self, visible_radius_m: f64, weather: &Weather) -> ScannerParams {
        let l = self;
        ScannerParams {
            pulses_per_scan: l.pulses,
            min_range_m: l.min_range_m as f32,
            // All sensors see to the same distance.
            max_range_m: l.max_range_m.min(visible_radius_m) as f32,
            wavelength: self.wavelength(),
            beam: Beam {
                horizontal_fwhm_rad: l.beam.horizontal_deg.to_radians(),
                vertical_fwhm_rad: l.beam.vertical_deg.to_radians(),
                exit_m: l.beam.exit_m,
                rings: l.beam.rings as u8,
                resolution_m: 0.5 * LIGHT_M_PER_NS * l.beam.pulse_ns,
            },
            returns: match l.returns {
                ReturnMode::First => nemoral_lidar::ReturnMode::First,
                ReturnMode::Last => nemoral_lidar::ReturnMode::Last,
                ReturnMode::Dual => nemoral_lidar::ReturnMode::Dual,
                ReturnMode::All => nemoral_lidar::ReturnMode::All(l.max_returns as u8),
                ReturnMode::Strongest => nemoral_lidar::ReturnMode::Strongest,
            },
            errors: self.pulse_errors(),
            air: self.air_params(weather),
            carrier: self.carrier_box(),
            deskew: l.deskew,
        }
    }

    fn wavelength(&self) -> Wavelength {
        if self.wavelength_nm == 1550 {
            Wavelength::Nm1550
        } else {
            Wavelength::Nm905
        }
    }

    /// What carries the LiDAR and hides what is behind it, if anything does.
    fn carrier_box(&self) -> Option<Carrier> {
        let &[x0, y0, z0, x1, y1, z1] = self.carrier.as_slice() else {
            return None;
        };
        Some(Carrier {
            low_m: DVec3::new(x0, y0, z0),
            high_m: DVec3::new(x1, y1, z1),
            carrier_from_lidar: self.body_from_lidar(),
        })
    }

    /// The weather's air at the laser's wavelength.
    #[must_use]
    pub fn air_params(&self, weather: &Weather) -> AirParams {
        let (air, noise) = (&self.air, &self.noise);
        let present = if air.enabled { 1.0 } else { 0.0 };
        let visibility_km = weather.visibility_m / 1000.0;
        // Haze scatters long waves less, the more the clearer it is; drops scatter all alike (Kim,
        // McArthur and Korevaar 2001). Visibility is defined for 550 nm.
        let exponent = match visibility_km {
            v if v > 50.0 => 1.6,
            v if v > 6.0 => 1.3,
            v if v > 1.0 => 0.16 * v + 0.34,
            v => (v - 0.5).max(0.0),
        };
        let wavelength = f64::from(self.wavelength_nm) / 550.0;
        // From drops to haze between 1 and 5 km.
        let haze = (libm::log(visibility_km) / libm::log(5.0)).clamp(0.0, 1.0);
        let drop_reflectance = if air.drop_reflectance == 0.0 {
            self.wavelength().drop_reflectance()
        } else {
            air.drop_reflectance
        };
        AirParams {
            haze: AirLayer {
                extinction_per_m: present
                    * extinction_per_m(weather.visibility_m)
                    * libm::pow(wavelength, -exponent),
                base_m: None,
                height_m: weather.haze_height_m,
                lidar_ratio_sr: air.lidar_ratio_sr + haze * (HAZE_SR - air.lidar_ratio_sr),
            },
            fog: AirLayer {
                extinction_per_m: present * weather.fog_per_m,
                base_m: Some(weather.fog_base_m),
                height_m: weather.fog_height_m,
                lidar_ratio_sr: air.lidar_ratio_sr,
            },
            rain_mm_per_h: present * weather.rain_mm_per_h,
            snowfall_mm_per_h: present * weather.snowfall_mm_per_h,
            drop_reflectance,
            flake_reflectance: air.flake_reflectance,
            reference_range_m: noise.reference_range_m,
            reference_reflectance: noise.reference_reflectance,
            near_m: air.near_m,
        }
    }
}

impl LidarMirror {
    /// The parameters of the pattern.
    pub(crate) fn params(&self) -> ScanMirrorParams {
        ScanMirrorParams {
            motion: match self.kind {
                MirrorKind::Rotating => MirrorMotion::Rotating,
                MirrorKind::Polygon => MirrorMotion::Polygon { duty: self.duty },
                MirrorKind::Sine => MirrorMotion::Sine,
                MirrorKind::Triangle => MirrorMotion::Triangle,
                MirrorKind::Cone => MirrorMotion::Cone,
                MirrorKind::Nutating => MirrorMotion::Nutating,
            },
            rate_hz: self.rate_hz,
            lines_hz: self.lines_hz,
            half_angle_rad: self.half_angle_deg.to_radians(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn air(lidar: &Lidar, weather: &Weather) -> AirParams {
        lidar.scanner_params(300.0, weather).air
    }

    #[test]
    fn the_air_is_that_of_the_cameras_at_the_lasers_wavelength() {
        let clear = Weather::default();
        let lidar = Lidar::default();
        let air_of = |visibility_m, wavelength_nm| {
            let weather = Weather {
                visibility_m,
                ..clear.clone()
            };
            let lidar = Lidar {
                wavelength_nm,
                ..lidar.clone()
            };
            air(&lidar, &weather).haze
        };
        // Clear air hardly weakens a laser, less so at the longer wavelength; drops are all alike.
        let extinction = |visibility_m, nm| air_of(visibility_m, nm).extinction_per_m;
        assert!((extinction(20_000.0, 905) - 1.023e-4).abs() < 1e-7);
        assert!((extinction(20_000.0, 1550) - 0.508e-4).abs() < 1e-7);
        assert!((extinction(50.0, 905) - 0.07824).abs() < 1e-9);
        assert_eq!(extinction(400.0, 905), extinction(400.0, 1550));
        // From fog over mist to haze, the lidar ratio grows and never jumps.
        let ratio = |visibility_m| air_of(visibility_m, 905).lidar_ratio_sr;
        assert_eq!(
            (ratio(50.0), ratio(1000.0), ratio(5000.0), ratio(20_000.0)),
            (18.8, 18.8, 50.0, 50.0)
        );
        assert!((ratio(2236.0) - 34.4).abs() < 0.01);

        let valley = Weather {
            fog_per_m: 0.05,
            fog_base_m: 12.0,
            ..clear.clone()
        };
        let fog = air(&lidar, &valley).fog;
        assert_eq!(
            (fog.extinction_per_m, fog.base_m, fog.height_m),
            (0.05, Some(12.0), 8.0)
        );

        let wet = Weather {
            rain_mm_per_h: 10.0,
            snowfall_mm_per_h: 1.0,
            ..clear.clone()
        };
        let falling = air(&lidar, &wet);
        assert_eq!(
            (falling.rain_mm_per_h, falling.snowfall_mm_per_h),
            (10.0, 1.0)
        );

        // Water absorbs most of what would come back from the rear of a drop at 1550 nm.
        let drops = |drop_reflectance, wavelength_nm| {
            let mut lidar = lidar.clone();
            lidar.wavelength_nm = wavelength_nm;
            lidar.air.drop_reflectance = drop_reflectance;
            air(&lidar, &wet).drop_reflectance
        };
        assert_eq!([905, 1550].map(|nm| drops(0.0, nm)), [0.024, 0.008]);
        assert_eq!([905, 1550].map(|nm| drops(0.03, nm)), [0.03; 2]);

        let mut blind = lidar.clone();
        blind.air.enabled = false;
        let none = air(&blind, &valley);
        assert_eq!(
            (none.haze.extinction_per_m, none.fog.extinction_per_m),
            (0.0, 0.0)
        );
    }

    #[test]
    fn the_carrier_is_where_the_body_is() {
        let params = |lidar: &Lidar| lidar.scanner_params(300.0, &Weather::default());
        let lidar = Lidar {
            carrier: vec![-0.3, -0.25, 0.0, 0.0, 0.25, 1.8],
            mount_yaw_deg: 90.0,
            ..Lidar::default()
        };
        let carrier = params(&lidar).carrier.expect("a person");
        assert_eq!(carrier.low_m, DVec3::new(-0.3, -0.25, 0.0));
        assert_eq!(carrier.high_m, DVec3::new(0.0, 0.25, 1.8));
        // What is 1 m to the right of a LiDAR that looks to the left is ahead of the body.
        let right = carrier.carrier_from_lidar.transform_point(DVec3::NEG_Y);
        let expected = DVec3::new(lidar.mount_x_m + 1.0, 0.0, lidar.mount_z_m);
        assert!(right.distance(expected) < 1e-12);
        assert!(params(&Lidar::default()).carrier.is_none());
    }
}
