//! Real scanners, by their data sheets.

use std::f64::consts::PI;

use crate::{
    AirParams, Beam, LivoxHorizonLike, Mid40, Mid70, MotorParams, MotorisedPattern, Panorama,
    PanoramaParams, PulseErrors, ReturnMode, ScanMirror, ScanMirrorParams, ScanPattern,
    ScannerParams, SpinningPattern, Wavelength,
};

/// A real scanner that is or was on sale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Device {
    /// Livox Mid-40.
    Mid40,
    /// Livox Mid-70.
    Mid70,
    /// Livox Avia.
    Avia,
    /// Like the Livox Horizon, whose optics are not published.
    LivoxHorizonLike,
    /// Velodyne VLP-16 at 10 Hz.
    Vlp16,
    /// Velodyne HDL-64E S2 at 10 Hz.
    Hdl64e,
    /// Ouster OS0 with 128 beams, 1024 columns, 10 Hz.
    Os0,
    /// Ouster OS1 with 32 beams, 1024 columns, 10 Hz.
    Os1x32,
    /// Ouster OS-1-64 of the first generation, 1024 columns, 10 Hz.
    Os1x64,
    /// Ouster OS1 with 128 beams, 1024 columns, 10 Hz.
    Os1x128,
    /// A terrestrial scanner on a tripod, like the RIEGL VZ-400.
    Terrestrial,
    /// RIEGL VUX-1UAV for drones, which looks down by itself, at 550,000 pulses and 100 lines a
    /// second. The scanner sees 330° around the direction of flight, of which surveys use the part
    /// below; here that is 90°, so a quarter of the pulses is measured. Its 170 m at 20 %, farthest
    /// echo, 5 mm and 1550 nm are not from a data sheet, but our choice.
    Vux1Uav,
    /// DJI Zenmuse L1 for drones, non-repeating, with the pattern of the [`Avia`](crate::Avia),
    /// ahead: pitch it down.
    L1,
    /// GeoSLAM ZEB Horizon, a handheld mapper: a VLP-16 on its side that a motor turns about the
    /// handle's upright axis, nearly half a turn a second. The angle is our choice.
    ZebHorizon,
}

/// Sweeps of a terrestrial scanner's turn, and pulses of a sweep: steps of 0.077° both ways, 6
/// million pulses.
const TERRESTRIAL: [u32; 2] = [4650, 1292];

/// What is published about a [`Device`] beyond its [`ScannerParams`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DataSheet {
    /// Maker and model.
    pub title: &'static str,
    /// Field of view, degrees, horizontally and vertically; of a scanner that looks down, across
    /// the flight and along it.
    pub field_of_view_deg: [f64; 2],
    /// The greatest range that the data sheet gives for a target of the reference reflectance,
    /// metres.
    pub reference_range_m: f64,
    /// The reflectance of that target, 0..1.
    pub reference_reflectance: f64,
    /// The spread of strong echoes, metres.
    pub sigma_floor_m: f64,
    /// The spread that noise adds at the threshold of detection, metres.
    pub sigma_at_threshold_m: f64,
    /// The most returns of a pulse, 1..=15.
    pub max_returns: u8,
    /// The sources of these numbers and of the parameters, and what is uncertain about them.
    pub source: &'static str,
}

impl Device {
    /// Every device.
    pub const ALL: &'static [Self] = &[
        Self::Mid40,
        Self::Mid70,
        Self::Avia,
        Self::LivoxHorizonLike,
        Self::Vlp16,
        Self::Hdl64e,
        Self::Os0,
        Self::Os1x32,
        Self::Os1x64,
        Self::Os1x128,
        Self::Terrestrial,
        Self::Vux1Uav,
        Self::L1,
        Self::ZebHorizon,
    ];

    /// The name in configs, `snake_case`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mid40 => "mid40",
            Self::Mid70 => "mid70",
            Self::Avia => "avia",
            Self::LivoxHorizonLike => "horizon",
            Self::Vlp16 => "vlp16",
            Self::Hdl64e => "hdl64e",
            Self::Os0 => "os0_128",
            Self::Os1x32 => "os1_32",
            Self::Os1x64 => "os1_64",
            Self::Os1x128 => "os1_128",
            Self::Terrestrial => "tls",
            Self::Vux1Uav => "vux1uav",
            Self::L1 => "l1",
            Self::ZebHorizon => "zeb_horizon",
        }
    }

    /// The device with a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|d| d.name() == name)
    }

    /// Its pattern.
    #[must_use]
    pub fn pattern(self) -> Box<dyn ScanPattern> {
        let known = "a device's own numbers are in range";
        let ouster = |fov_deg: f64, beams| {
            Box::new(SpinningPattern::ouster(fov_deg.to_radians(), beams, 1024, 10.0).expect(known))
        };
        match self {
            Self::Mid40 => Box::new(Mid40),
            Self::Mid70 => Box::new(Mid70),
            Self::Avia | Self::L1 => Box::new(crate::Avia),
            Self::LivoxHorizonLike => Box::new(LivoxHorizonLike),
            Self::Vlp16 => Box::new(SpinningPattern::vlp16(10.0).expect(known)),
            Self::Hdl64e => Box::new(SpinningPattern::hdl64e(10.0).expect(known)),
            Self::Os0 => ouster(90.0, 128),
            Self::Os1x32 => ouster(45.0, 32),
            Self::Os1x64 => Box::new(SpinningPattern::os1_64(1024, 10.0).expect(known)),
            Self::Os1x128 => ouster(45.0, 128),
            Self::Terrestrial => {
                let [columns, rows] = TERRESTRIAL;
                let params = PanoramaParams {
                    rows,
                    columns,
                    bottom_rad: f64::to_radians(-40.0),
                    top_rad: f64::to_radians(60.0),
                    rate_hz: 1e5,
                };
                Box::new(Panorama::new(params).expect(known))
            }
            Self::Vux1Uav => Box::new(ScanMirror::new(ScanMirrorParams::default()).expect(known)),
            Self::ZebHorizon => {
                let head = Self::Vlp16.pattern();
                Box::new(MotorisedPattern::new(head, MotorParams::default()).expect(known))
            }
        }
    }

    /// Its parameters: ranges, wavelength, beam, quantisation. Scans take 0.1 s, or a whole turn of
    /// a terrestrial scanner, a minute. The beam is cast with 19 sub-rays, and with 7 for that
    /// turn. The spreads of intensities and of objects' reflectances are our choice, the same for
    /// all devices.
    #[must_use]
    pub fn params(self) -> ScannerParams {
        // Divergence sideways and up, degrees; nearest and farthest range; steps of range; pulse,
        // ns.
        let (width_deg, ranges_m, step_m, pulse_ns, angular_deg) = match self {
            Self::Mid40 => ([0.03, 0.28], [1.0, 260.0], 0.001, 4.0, 0.1),
            Self::Mid70 => ([0.03, 0.28], [0.05, 260.0], 0.001, 4.0, 0.1),
            Self::Avia | Self::L1 => ([0.03, 0.28], [1.0, 450.0], 0.001, 4.0, 0.05),
            Self::LivoxHorizonLike => ([0.28, 0.03], [0.5, 260.0], 0.001, 4.0, 0.05),
            Self::Vlp16 | Self::ZebHorizon => ([0.172, 0.086], [0.4, 100.0], 0.002, 6.0, 0.0),
            Self::Hdl64e => ([0.115, 0.115], [0.9, 120.0], 0.002, 5.0, 0.0),
            Self::Os0 => ([0.35, 0.35], [0.3, 50.0], 0.001, 5.0, 0.0),
            Self::Os1x64 => ([0.13, 0.13], [0.8, 120.0], 0.012, 5.0, 0.0),
            Self::Os1x32 | Self::Os1x128 => ([0.18, 0.18], [0.8, 120.0], 0.001, 5.0, 0.0),
            Self::Terrestrial => ([0.012, 0.012], [1.5, 600.0], 0.0001, 5.0, 0.0),
            Self::Vux1Uav => ([0.0169, 0.0169], [3.0, 280.0], 0.0001, 4.0, 0.0),
        };
        // 0 where none is published.
        let exit_m = match self {
            Self::Vlp16 | Self::ZebHorizon => 0.0084,
            Self::Os1x32 | Self::Os1x64 | Self::Os1x128 => 0.01,
            Self::Terrestrial => 0.007,
            _ => 0.0,
        };
        let (pulses_per_scan, rings) = match self {
            Self::Terrestrial => (TERRESTRIAL[0] * TERRESTRIAL[1], 1),
            _ => ((0.1 * self.pattern().rate_hz()).round() as u32, 2),
        };
        let wavelength = match self {
            Self::Terrestrial | Self::Vux1Uav => Wavelength::Nm1550,
            _ => Wavelength::Nm905,
        };
        let sheet = self.sheet();
        ScannerParams {
            pulses_per_scan,
            min_range_m: ranges_m[0],
            max_range_m: ranges_m[1],
            wavelength,
            beam: Beam {
                horizontal_fwhm_rad: width_deg[0] * PI / 180.0,
                vertical_fwhm_rad: width_deg[1] * PI / 180.0,
                rings,
                resolution_m: 0.5 * 0.299_792_458 * pulse_ns,
                exit_m,
            },
            returns: ReturnMode::Strongest,
            air: AirParams {
                drop_reflectance: wavelength.drop_reflectance(),
                reference_range_m: sheet.reference_range_m,
                reference_reflectance: sheet.reference_reflectance,
                ..AirParams::default()
            },
            errors: PulseErrors {
                angular_sigma_rad: f64::to_radians(angular_deg),
                range_step_m: step_m,
                intensity_at_threshold: 0.27,
                reflectance_spread: 0.1,
                ..PulseErrors::default()
            },
            carrier: None,
            deskew: true,
        }
    }

    /// Its data sheet.
    #[must_use]
    pub const fn sheet(self) -> DataSheet {
        const LIVOX: DataSheet = DataSheet {
            title: "Livox Mid-40",
            field_of_view_deg: [38.4, 38.4],
            reference_range_m: 90.0,
            reference_reflectance: 0.1,
            sigma_floor_m: 0.007,
            sigma_at_threshold_m: 0.09,
            max_returns: 1,
            source: "Livox wiki: range ladder 90/130/260 m at 10/20/80 %, 2 cm at 20 m, 0.28° x \
                0.03°, angles below 0.1°; pulse length: HELIOS++",
        };
        const OUSTER: DataSheet = DataSheet {
            title: "Ouster OS1",
            field_of_view_deg: [360.0, 45.0],
            reference_range_m: 40.0,
            reference_reflectance: 0.1,
            sigma_floor_m: 0.015,
            sigma_at_threshold_m: 0.10,
            max_returns: 1,
            source: "OS1 data sheet: 40 m at 10 %, 0.8 to 120 m, 1.5 to 10 cm by signal, 0.18°, \
                10 mm at the exit, strongest return; 850 nm, for which the reflectances at 905 nm \
                stand; pulse length assumed",
        };
        match self {
            Self::Mid40 => LIVOX,
            Self::Mid70 => DataSheet {
                title: "Livox Mid-70",
                field_of_view_deg: [70.4, 70.4],
                max_returns: 2,
                source: "as Mid-40; blind zone 5 cm; user manual: dual return",
                ..LIVOX
            },
            Self::Avia => DataSheet {
                title: "Livox Avia",
                field_of_view_deg: [70.4, 77.2],
                reference_range_m: 190.0,
                max_returns: 3,
                source: "190 m at 10 %, three returns; optics: HELIOS++; the rest as Mid-40",
                ..LIVOX
            },
            Self::LivoxHorizonLike => DataSheet {
                title: "Like the Livox Horizon",
                field_of_view_deg: [81.7, 25.1],
                max_returns: 2,
                source: "Livox wiki, two returns; the pattern is fitted to its figures, the pulse \
                    length is the Mid-40's",
                ..LIVOX
            },
            Self::Vlp16 => DataSheet {
                title: "Velodyne VLP-16",
                field_of_view_deg: [360.0, 30.0],
                reference_range_m: 50.0,
                sigma_floor_m: 0.02,
                sigma_at_threshold_m: 0.06,
                max_returns: 2,
                source: "user manual: 3 cm, 100 m, 3.0 x 1.5 mrad, 2 mm steps, two returns; 8.4 mm \
                    at the exit: OpenPLX; 50 m at 10 % and pulse length assumed",
                ..OUSTER
            },
            Self::ZebHorizon => DataSheet {
                title: "GeoSLAM ZEB Horizon",
                field_of_view_deg: [360.0, 180.0],
                source: "user guide: 100 m, 300,000 pulses a second; a VLP-16 on a motor, half a \
                    turn a second; the angle is our choice; the rest as VLP-16",
                ..Self::Vlp16.sheet()
            },
            Self::Hdl64e => DataSheet {
                title: "Velodyne HDL-64E S2",
                field_of_view_deg: [360.0, 26.3],
                reference_range_m: 50.0,
                sigma_floor_m: 0.015,
                sigma_at_threshold_m: 0.06,
                source: "data sheet: 120 m, 50 m at 10 %, 2 cm; HELIOS++: 2 mrad, 20,833 pulses a \
                    second and laser, one return; pulse length assumed",
                ..OUSTER
            },
            Self::Os0 => DataSheet {
                title: "Ouster OS0-128",
                field_of_view_deg: [360.0, 90.0],
                reference_range_m: 35.0,
                source: "OS0 data sheet: 35 m at 10 %, 0.3 to 50 m, 0.35°; the rest as OS1, but \
                    for the exit",
                ..OUSTER
            },
            Self::Os1x32 => DataSheet {
                title: "Ouster OS1-32",
                ..OUSTER
            },
            Self::Os1x64 => DataSheet {
                title: "Ouster OS-1-64, first generation",
                field_of_view_deg: [360.0, 33.2],
                source: "OS1 data sheet of the first generation: ±16.6°, 0.13°, 1.2 cm steps; \
                    azimuths of beams: the maker's SDK; the rest as OS1-128",
                ..OUSTER
            },
            Self::Os1x128 => DataSheet {
                title: "Ouster OS1-128",
                ..OUSTER
            },
            Self::Terrestrial => DataSheet {
                title: "Like the RIEGL VZ-400",
                field_of_view_deg: [360.0, 100.0],
                reference_range_m: 280.0,
                reference_reflectance: 0.2,
                sigma_floor_m: 0.002,
                sigma_at_threshold_m: 0.01,
                max_returns: 15,
                source: "data sheet, long range mode: 280 m at 20 %, 1.5 to 600 m, 100,000 pulses \
                    a second, -40° to 60°, 0.35 mrad at 1/e², which is 0.012° at half maximum, all \
                    returns; 7 mm at the exit: AMAPVox; 1550 nm: Calders et al. 2015; pulse \
                    length: HELIOS++; 2 mm and 0.077° are our choice",
            },
            Self::Vux1Uav => DataSheet {
                title: "RIEGL VUX-1UAV",
                field_of_view_deg: [90.0, 0.0],
                reference_range_m: 170.0,
                reference_reflectance: 0.2,
                sigma_floor_m: 0.005,
                sigma_at_threshold_m: 0.01,
                max_returns: 15,
                source: "HELIOS++: 550,000 pulses fired and 100 lines a second, 330° (of which 90° \
                    are used), 0.5 mrad at 1/e², which is 0.017° at half maximum, 4 ns, 1 cm, from \
                    3 m; 170 m at 20 %, 280 m, 5 mm and 1550 nm are our choice; the rest as VZ-400",
            },
            Self::L1 => DataSheet {
                title: "DJI Zenmuse L1",
                field_of_view_deg: [70.4, 77.2],
                reference_range_m: 190.0,
                sigma_floor_m: 0.02,
                max_returns: 3,
                source: "DJI's guide: 190 m at 10 %, 450 m at 80 %, 70.4° x 77.2°, a Livox module; \
                    240,000 pulses a second, optics and 2 cm: HELIOS++; three returns, and the \
                    rest as Avia",
                ..LIVOX
            },
        }
    }
}
