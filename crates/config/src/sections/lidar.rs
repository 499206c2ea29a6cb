//! Keys of the LiDAR.

use super::{LidarMotor, LidarPattern};
use crate::choices::{CUSTOM_DEVICE, DEVICES};
use crate::schema::AllowedValues::{Cuboid, Flag, OneOf, Real, RealAbove, Whole};
use crate::schema::{SectionSpec, section};
use crate::{LaconteSensor, RangeNoiseModel, ReturnMode};

section! {
    /// The LiDAR (paper, V-B).
    Lidar at "lidar" {
        /// Whether there is a LiDAR. Without the first one there are no further ones.
        enabled: bool = true, Flag, "pictures alone are a tenth smaller and quicker";
        /// A scanner by its data sheet. It sets the pattern, the pulses of 0.1 s (of a turn, for a
        /// terrestrial scanner), ranges, wavelength, most returns, beam, errors and noise below;
        /// keys that you set yourself override it, but `max_returns` is at most the device's.
        device: String = CUSTOM_DEVICE.into(), OneOf(&DEVICES),
            "the makers' data sheets, each named in the handbook";
        /// Pulses fired in a scan.
        pulses: u32 = 50_000, Whole(1, 10_000_000), "paper, VI";
        /// Surfaces nearer than this block pulses and give no return.
        min_range_m: f64 = 0.5, Real(0.0, 10.0), "blind zone: Livox";
        /// Surfaces farther than this give no return.
        max_range_m: f64 = 260.0, Real(1.0, 2000.0), "Livox wiki, at 80 % reflectance";
        /// Laser wavelength.
        wavelength_nm: u32 = 905, Whole(905, 1550), "905 or 1550";
        /// Which echoes of a pulse become points. A `device` with one return has neither `dual` nor
        /// `all`.
        returns: ReturnMode = ReturnMode::Strongest, OneOf(ReturnMode::WORDS),
            "one for each pulse, as in the paper";
        /// The most returns of a pulse with `all`; at most as many as the `device` has.
        max_returns: u32 = 5, Whole(1, 15), "LAS allows 15";
        /// Write points in the LiDAR frame at the frame's time; if false, raw points, each in the
        /// LiDAR frame at its pulse's time.
        deskew: bool = true, Flag, "our choice";
        /// Position in front of the body's origin.
        mount_x_m: f64 = 0.35, Real(-10.0, 10.0), "above the camera";
        /// Position to the left of it.
        mount_y_m: f64 = 0.0, Real(-10.0, 10.0), "centred";
        /// Height above the ground.
        mount_z_m: f64 = 1.35, Real(0.0, 50.0), "above the camera";
        /// Rotation to the left.
        mount_yaw_deg: f64 = 0.0, Real(-180.0, 180.0), "forward";
        /// Pitch, downwards.
        mount_pitch_deg: f64 = 0.0, Real(-90.0, 90.0), "level";
        /// Roll, about its own forward axis after yaw and pitch: the right side goes down.
        mount_roll_deg: f64 = 0.0, Real(-180.0, 180.0), "upright";
        /// What carries the LiDAR, such as a person, as a box between two corners in the body's
        /// frame, metres: nothing is seen through it, and it gives no points itself.
        carrier: Vec<f64> = Vec::new(), Cuboid(-10.0, 10.0), "nothing is in the way";
    }
    plus {
        /// The LiDAR's pattern.
        #[serde(flatten)]
        pattern: LidarPattern;
        /// The motor that turns the LiDAR.
        motor: LidarMotor;
        /// The LiDAR's beam.
        beam: LidarBeam;
        /// The weather's air, as the LiDAR sees it.
        air: LidarAir;
        /// Errors other than those of ranges.
        errors: LidarErrors;
        /// Errors of ranges.
        noise: Noise;
    }
}

/// Further LiDARs.
pub(super) const FURTHER_LIDARS: SectionSpec = SectionSpec {
    path: "lidars",
    doc: " Further LiDARs on the same robot: a table `[lidars.NAME]` for each, with the keys of \
        `[lidar]`, says how it differs from the first one. Their files are in folders of that \
        name.",
    choice: None,
    keys: &[],
    named: None,
    defaults: toml::Table::new,
};

section! {
    /// The laser beam. It is cast as sub-rays, whose echoes mix or separate as in a real pulse.
    LidarBeam at "lidar.beam" {
        /// Divergence sideways, full width at half maximum.
        horizontal_deg: f64 = 0.28, Real(0.0, 5.0), "Livox Horizon: Livox wiki";
        /// Divergence upwards, full width at half maximum.
        vertical_deg: f64 = 0.03, Real(0.0, 5.0), "Livox Horizon: Livox wiki";
        /// Diameter of the beam where it leaves the scanner, out to 1/e² of its middle; 0 for a
        /// point.
        exit_m: f64 = 0.0, Real(0.0, 0.1), "a point; Ouster OS1: 0.01";
        /// Rings of sub-rays around the middle: 0, 1, 2, 3 give 1, 7, 19, 37 rays for each pulse.
        rings: u32 = 0, Whole(0, 8), "a line, as in the paper; HELIOS++ has 2";
        /// Length of the pulse; surfaces that are less than half of it apart merge into one echo.
        pulse_ns: f64 = 4.0, Real(0.0, 100.0), "Livox scanners in HELIOS++";
    }
}

section! {
    /// How the LiDAR sees the air of `[weather]`: haze, fog, rain and snowfall weaken echoes. Fog,
    /// drops and flakes have echoes of their own, which are labelled `airborne_echo` and flagged as
    /// false alarms. The receiver's threshold is `reference_range_m` and `reference_reflectance` of
    /// the noise.
    LidarAir at "lidar.air" {
        /// Whether it does.
        enabled: bool = true, Flag, "one air for all sensors";
        /// Extinction over backscatter of fog, and of mist with less than 1 km of visibility; haze
        /// beyond 5 km has 50.
        lidar_ratio_sr: f64 = 18.8, Real(5.0, 200.0),
            "drops of clouds at 905 nm: O'Connor et al. 2004; Rasshofer et al. 2011 have 65";
        /// Nearer than this, the receiver is less sensitive to the air's echoes, by the square of
        /// the range.
        near_m: f64 = 10.0, Real(0.0, 50.0),
            "our choice: then a target of 40 % is seen to some 20 m at 50 m of visibility";
        /// The reflectance of a disc that sends as much light back as a drop of rain of its width;
        /// 0 for that of water at the wavelength: 0.024 at 905 nm, 0.008 at 1550 nm.
        drop_reflectance: f64 = 0.0, Real(0.0, 1.0),
            "the front and the rear of a sphere, by Fresnel; absorption: Hale and Querry 1973";
        /// The same of a flake of snow.
        flake_reflectance: f64 = 0.3, Real(0.01, 1.0),
            "ice crystals' lidar ratio of 20 sr; Hahner et al. 2022 have 0.9";
    }
}

section! {
    /// Errors of pointing and detection.
    LidarErrors at "lidar.errors" {
        /// Standard deviation of a pulse's direction, sideways and upwards.
        angular_deg: f64 = 0.0, Real(0.0, 5.0), "off; Livox below 0.05 to 0.1";
        /// Ranges are written in steps of this; 0 for none.
        range_step_m: f64 = 0.0, Real(0.0, 1.0), "off; Velodyne 0.002, Livox 0.001";
        /// Probability that a pulse is lost.
        dropout: f64 = 0.0, Real(0.0, 1.0), "off";
        /// Probability that a pulse that meets nothing gives a point all the same.
        false_alarm: f64 = 0.0, Real(0.0, 1.0), "off; Livox below 0.0001";
    }
}

section! {
    /// Errors of measured ranges (paper, V-B) and intensities. With the model `off` there are none
    /// of either.
    Noise at "lidar.noise" {
        /// The model: no errors, the paper's, Laconte's bias, a spread by incidence, by range, or
        /// by signal-to-noise ratio with a threshold of detection.
        model: RangeNoiseModel = RangeNoiseModel::Paper, OneOf(RangeNoiseModel::WORDS),
            "paper, V-B; each model's source is named in the handbook";
        /// Standard deviation of `paper` and `laconte`.
        sigma_m: f64 = 0.02, Real(0.0, 1.0), "Livox wiki: Mid-40 at 20 m";
        /// The sensor whose bias `laconte` has.
        laconte_device: LaconteSensor = LaconteSensor::Hdl32e, OneOf(LaconteSensor::WORDS),
            "Laconte et al. 2019, in libpointmatcher";
        /// `laconte` by its closed form: within 2 % for narrow beams, and faster.
        laconte_closed: bool = false, Flag, "as published";
        /// `snr` sees this far …
        reference_range_m: f64 = 90.0, RealAbove(0.0, 10_000.0), "Livox wiki: 90 m at 10 %";
        /// … a target of this reflectance.
        reference_reflectance: f64 = 0.1, RealAbove(0.0, 1.0), "Livox wiki: 90 m at 10 %";
        /// Extinction of the air for `snr`, per metre, besides the weather's.
        extinction_per_m: f64 = 0.0, Real(0.0, 1.0), "clear air";
        /// Spread of strong echoes for `snr`; the least one for `linear`; head-on at 20 m for
        /// `incidence`.
        floor_m: f64 = 0.007, Real(0.0, 1.0), "our choice: some millimetres";
        /// Spread that `snr` adds at its threshold.
        at_threshold_m: f64 = 0.09, Real(0.0, 1.0), "LISA (Kilic et al. 2021)";
        /// Probability that noise alone passes the threshold of `snr`, by which detection fades
        /// around it: of echoes at the threshold, half are seen. 0 for a step.
        false_alarm_probability: f64 = 0.0, Real(0.0, 0.4),
            "a step; Livox and Ouster state at most 0.0001";
        /// Relative spread of the intensity of the weakest echo, that of `reference_range_m` and
        /// `reference_reflectance`. It falls with the root of the signal-to-noise ratio.
        intensity_at_threshold: f64 = 0.0, Real(0.0, 1.0),
            "off; devices have 0.27: one in 3.72, which noise passes once in 10,000 times";
        /// How much plants and rocks of one material differ in reflectance: the standard deviation
        /// of its logarithm.
        reflectance_spread: f64 = 0.0, Real(0.0, 1.0), "off; devices have 0.1, our choice";
        /// Spread that `linear` adds per metre of range.
        per_metre: f64 = 0.0006, Real(0.0, 1.0), "Hokuyo UTM-30LX, in libpointmatcher";
    }
}
