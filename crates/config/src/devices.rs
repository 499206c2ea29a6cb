//! LiDARs by their data sheets, as a layer of a config.

use nemoral_lidar::{Device, MotorParams, ScannerParams, Wavelength};
use toml::{Table, Value};

use super::{
    Lidar, LidarAvia, LidarBeam, LidarErrors, LidarHorizon, LidarMid40, LidarMid70, LidarMirror,
    LidarMotor, LidarPanorama, LidarPattern, LidarSpinning, Noise, RangeNoiseModel, SpinningHead,
};

/// The keys that a device sets in a LiDAR's table, over the preset and under everything that a user
/// sets. `None` for `custom`, and for a name that is refused elsewhere.
pub(super) fn layer(name: &str) -> Option<Table> {
    let lidar = lidar(Device::from_name(name)?);
    let Ok(Value::Table(mut table)) = Value::try_from(&lidar) else {
        unreachable!("a config is plain data");
    };
    // The device sets neither the mount nor, within what it can, what is made of its echoes.
    table.retain(|key, _| {
        !key.starts_with("mount_") && !["enabled", "returns", "deskew", "carrier"].contains(&key)
    });
    Some(table)
}

fn lidar(device: Device) -> Lidar {
    let ScannerParams {
        pulses_per_scan,
        min_range_m,
        max_range_m,
        wavelength,
        beam,
        errors,
        ..
    } = device.params();
    let sheet = device.sheet();
    let ouster = |beams, vertical_fov_deg| {
        LidarPattern::Spinning(LidarSpinning {
            head: SpinningHead::Ouster,
            beams,
            vertical_fov_deg,
            ..LidarSpinning::default()
        })
    };
    let head = |head| {
        LidarPattern::Spinning(LidarSpinning {
            head,
            ..LidarSpinning::default()
        })
    };
    Lidar {
        device: device.name().to_owned(),
        pulses: pulses_per_scan,
        max_returns: sheet.max_returns.into(),
        min_range_m: round(min_range_m.into()),
        max_range_m: round(max_range_m.into()),
        wavelength_nm: match wavelength {
            Wavelength::Nm905 => 905,
            Wavelength::Nm1550 => 1550,
        },
        pattern: match device {
            Device::Mid40 => LidarPattern::Mid40(LidarMid40::default()),
            Device::Mid70 => LidarPattern::Mid70(LidarMid70::default()),
            Device::Avia | Device::L1 => LidarPattern::Avia(LidarAvia::default()),
            Device::Vlp16 | Device::ZebHorizon => head(SpinningHead::Vlp16),
            Device::Hdl64e => head(SpinningHead::Hdl64e),
            Device::Os0 => ouster(128, 90.0),
            Device::Os1x32 => ouster(32, 45.0),
            Device::Os1x64 => head(SpinningHead::Os1x64),
            Device::Os1x128 => ouster(128, 45.0),
            Device::Terrestrial => LidarPattern::Panorama(LidarPanorama {
                low_deg: -40.0,
                high_deg: 60.0,
                rate_hz: 1e5,
            }),
            Device::Vux1Uav => LidarPattern::Mirror(LidarMirror::default()),
            Device::LivoxHorizonLike => LidarPattern::Horizon(LidarHorizon::default()),
            device => unreachable!("{} has no pattern here", device.name()),
        },
        motor: match device {
            Device::ZebHorizon => LidarMotor {
                turns_hz: MotorParams::default().turns_hz,
                ..LidarMotor::default()
            },
            _ => LidarMotor::default(),
        },
        beam: LidarBeam {
            horizontal_deg: round(beam.horizontal_fwhm_rad.to_degrees()),
            vertical_deg: round(beam.vertical_fwhm_rad.to_degrees()),
            exit_m: beam.exit_m,
            rings: beam.rings.into(),
            pulse_ns: round(2.0 * beam.resolution_m / LIGHT_M_PER_NS),
        },
        errors: LidarErrors {
            angular_deg: round(errors.angular_sigma_rad.to_degrees()),
            range_step_m: errors.range_step_m,
            dropout: errors.dropout,
            false_alarm: errors.false_alarm,
        },
        noise: Noise {
            model: RangeNoiseModel::SignalToNoise,
            reference_range_m: sheet.reference_range_m,
            reference_reflectance: sheet.reference_reflectance,
            floor_m: sheet.sigma_floor_m,
            at_threshold_m: sheet.sigma_at_threshold_m,
            intensity_at_threshold: errors.intensity_at_threshold,
            reflectance_spread: errors.reflectance_spread,
            ..Noise::default()
        },
        ..Lidar::default()
    }
}

/// The distance that light travels in a nanosecond, metres.
pub(super) const LIGHT_M_PER_NS: f64 = 0.299_792_458;

/// Rounds to a millionth, so that numbers look like those of data sheets rather than like f32.
fn round(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::super::choices::DEVICES;
    use super::*;
    use crate::InputFiles;

    #[test]
    fn every_device_has_a_name_and_a_layer() {
        let (custom, devices) = DEVICES.split_first().expect("words");
        assert_eq!(*custom, "custom");
        assert!(devices.iter().all(|name| layer(name).is_some()));
        assert!(layer(custom).is_none() && layer("mid41").is_none());
    }

    /// A device fires the same pulses by its crate and by a config.
    #[test]
    fn a_layer_has_the_devices_pattern() {
        for &device in Device::ALL {
            let of_config = lidar(device)
                .scan_pattern("lidar", &InputFiles::default())
                .expect("a pattern");
            let own = device.pattern();
            let every_part = (0..4000).map(|i| i * 977);
            assert!(
                every_part.clone().all(|k| {
                    let (a, b) = (of_config.pulse(k), own.pulse(k));
                    let is_near = a.direction.distance(b.direction) < 1e-5;
                    is_near && (a.time_s - b.time_s).abs() < 1e-9 && a.ring == b.ring
                }),
                "{}",
                device.name()
            );
        }
    }

    #[test]
    fn layers_of_drones_have_their_sheets_numbers() {
        let vux = lidar(Device::Vux1Uav);
        assert_eq!((vux.pulses, vux.wavelength_nm), (13_750, 1550));
        assert_eq!((vux.beam.horizontal_deg, vux.beam.pulse_ns), (0.0169, 4.0));
        assert_eq!(
            (vux.noise.reference_range_m, vux.noise.floor_m),
            (170.0, 0.005)
        );
        let l1 = lidar(Device::L1);
        assert_eq!((l1.pulses, l1.wavelength_nm), (24_000, 905));
        assert_eq!(
            (l1.noise.reference_range_m, l1.noise.floor_m),
            (190.0, 0.02)
        );
    }

    #[test]
    fn a_layer_has_the_sheets_numbers() {
        let lidar = lidar(Device::Vlp16);
        assert_eq!((lidar.pulses, lidar.min_range_m), (28_935, 0.4));
        assert_eq!(
            (lidar.beam.horizontal_deg, lidar.beam.pulse_ns),
            (0.172, 6.0)
        );
        assert_eq!(lidar.errors.range_step_m, 0.002);
        assert_eq!(lidar.max_returns, 2);
        let noise = &lidar.noise;
        let spreads = (noise.intensity_at_threshold, noise.reflectance_spread);
        assert_eq!(spreads, (0.27, 0.1));
    }

    /// A device has its own returns, and neither the mount nor the carrier of another.
    #[test]
    fn a_layer_has_what_is_the_devices_alone() {
        let has = |key: &str| layer("avia").is_some_and(|table| table.contains_key(key));
        let set = ["pulses", "max_returns", "beam", "noise"];
        assert!(set.into_iter().all(has));
        let left = ["mount_z_m", "carrier", "returns", "deskew"];
        assert!(!left.into_iter().any(has));
    }
}
