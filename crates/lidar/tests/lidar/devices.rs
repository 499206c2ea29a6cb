//! Devices, beam tables and tables of pulses.

use std::collections::BTreeSet;

use crate::common::azimuth_elevation_deg;
use nemoral_lidar::{
    Avia, CsvPattern, CsvPatternError, Device, Laser, Panorama, PanoramaParams, Pulse, ScanPattern,
    Scanner, SpinningPattern,
};
use nemoral_scene::glam::DVec3;

#[test]
fn every_device_scans_within_its_field_of_view() {
    for &device in Device::ALL {
        let name = device.name();
        assert_eq!(Device::from_name(name), Some(device));
        let params = device.params();
        let scanner = Scanner::new(params, device.pattern()).expect(name);
        let duration_s = match device {
            Device::Terrestrial => 60.0,
            _ => 0.1,
        };
        assert!(
            (scanner.duration_s() / duration_s - 1.0).abs() < 2e-3,
            "{name}"
        );
        let sheet = device.sheet();
        let [mut left, mut right, mut low, mut high] = [0.0_f64; 4];
        let looks_down = scanner.field_of_view().axis == DVec3::NEG_Z;
        assert_eq!(looks_down, device == Device::Vux1Uav);
        for mut pulse in scanner.pulses(0) {
            if looks_down {
                let d = pulse.direction;
                pulse.direction = DVec3::new(-d.z, d.y, d.x);
            }
            let (az, el) = azimuth_elevation_deg(&pulse);
            (left, right) = (left.max(az), right.min(az));
            (low, high) = (low.min(el), high.max(el));
        }
        let [wide, tall] = sheet.field_of_view_deg;
        // Horizon-like and Avia are models: up to 3 degrees (in their documentation).
        assert!((left - right - wide).abs() < 3.2, "{name}: {left} {right}");
        assert!((high - low - tall).abs() < 3.2, "{name}: {low} {high}");
        assert!(!sheet.title.is_empty() && !sheet.source.is_empty());
        assert!(sheet.reference_range_m < params.max_range_m.into());
    }
    assert_eq!(Device::from_name("mid41"), None);
}

/// A tenth of a second of a scanner for drones: ten lines of a quarter of a turn, and the Avia's
/// pulses.
#[test]
fn scanners_for_drones_have_their_pulses() {
    let (vux, l1) = (Device::Vux1Uav, Device::L1);
    assert_eq!(vux.params().pulses_per_scan, 13_750);
    assert_eq!(l1.params().pulses_per_scan, 24_000);
    let pulses = vux.pattern().pulses(0, 13_751);
    assert!((pulses[13_750].time_s - 0.1).abs() < 1e-15);
    assert_eq!(pulses[13_750].direction, pulses[0].direction);
    // 0.5 mrad to 1/e² are 2 σ to each side, of which the width at half maximum has 2.3548.
    let fwhm_rad = vux.params().beam.horizontal_fwhm_rad;
    assert!((fwhm_rad * 4.0 / 2.354_820 / 0.5e-3 - 1.0).abs() < 5e-3);
    let avia = Device::Avia.pattern();
    assert_eq!(l1.pattern().pulses(7, 100), avia.pulses(7, 100));
}

/// What HELIOS++'s prisms reach: 70.6 by 77.1 degrees.
#[test]
fn the_avia_fills_its_field_of_view() {
    let [mut wide, mut tall] = [0.0_f64; 2];
    for i in 0..2_400_000 {
        let (az, el) = azimuth_elevation_deg(&Avia.pulse(i));
        (wide, tall) = (wide.max(az.abs()), tall.max(el.abs()));
    }
    assert!((wide - 35.3).abs() < 0.15, "{wide}");
    assert!((tall - 38.55).abs() < 0.15, "{tall}");
    // Six beams fire together, and the pattern does not repeat within the second.
    let (a, b) = (Avia.pulse(6), Avia.pulse(11));
    assert_eq!((a.time_s, a.ring, b.ring), (b.time_s, 0, 5));
    let first = Avia.pulse(0).direction;
    assert!((1..40_000).all(|s| Avia.pulse(6 * s).direction.distance(first) > 1e-6));
}

#[test]
fn a_vlp16_fires_by_its_manual() {
    let vlp = SpinningPattern::vlp16(10.0).expect("valid");
    assert!((vlp.rate_hz() - 289_351.85).abs() < 0.01);
    let order: Vec<i32> = (0..16)
        .map(|i| azimuth_elevation_deg(&vlp.pulse(i)).1.round() as i32)
        .collect();
    assert_eq!(
        order,
        [-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15]
    );
    let (one, next) = (vlp.pulse(1), vlp.pulse(16));
    assert!((one.time_s - 2.304e-6).abs() < 1e-15 && (next.time_s - 55.296e-6).abs() < 1e-15);
    assert_eq!(
        (vlp.pulse(0).ring, one.ring, vlp.pulse(15).ring),
        (0, 8, 15)
    );
    // Clockwise from above, half a turn after 50 ms: straight ahead.
    let ahead = vlp.pulse((0.05 / 55.296e-6) as u64 * 16);
    assert!(azimuth_elevation_deg(&ahead).0.abs() < 0.3);
    let (a, b) = (vlp.pulse(1600), vlp.pulse(1616));
    let turned = azimuth_elevation_deg(&a).0 - azimuth_elevation_deg(&b).0;
    assert!((turned - 360.0 * 10.0 * 55.296e-6).abs() < 1e-9, "{turned}");
}

#[test]
fn an_hdl64_and_an_ouster_have_their_beams() {
    let hdl = SpinningPattern::hdl64e(10.0).expect("valid");
    let rings: BTreeSet<(u8, i64)> = (0..64)
        .map(|i| {
            let p = hdl.pulse(i);
            (
                p.ring,
                (1000.0 * azimuth_elevation_deg(&p).1).round() as i64,
            )
        })
        .collect();
    assert_eq!(rings.len(), 64);
    // Rings rise with elevation.
    assert!(
        rings
            .iter()
            .zip(rings.iter().skip(1))
            .all(|(a, b)| a.0 < b.0 && a.1 < b.1)
    );
    assert_eq!(
        (rings.first(), rings.last()),
        (Some(&(0, -24_330)), Some(&(63, 2000)))
    );
    let os1 = SpinningPattern::ouster(45.0_f64.to_radians(), 128, 1024, 10.0).expect("valid");
    assert!((os1.rate_hz() - 1_310_720.0).abs() < 1e-3);
    assert_eq!(os1.pulse(127).time_s, 0.0, "a column fires at once");
    assert!((os1.pulse(128).time_s - 1.0 / 10_240.0).abs() < 1e-15);
}

/// An Ouster's tables of beams begin with the highest one, and its rings, too. Pulses and their
/// random numbers are as they were when rings began with the lowest one.
#[test]
fn rings_are_counted_from_the_end_where_makers_begin() {
    let ousters = [Device::Os0, Device::Os1x32, Device::Os1x64, Device::Os1x128];
    for device in Device::ALL {
        let head = match device {
            Device::Vlp16 => 16,
            Device::Hdl64e | Device::Os1x64 => 64,
            Device::Os1x32 => 32,
            Device::Os0 | Device::Os1x128 => 128,
            _ => continue,
        };
        let pattern = device.pattern();
        let elevation = |pulse: &Pulse| azimuth_elevation_deg(pulse).1;
        let mut pulses = pattern.pulses(5 * head, head as u32);
        pulses.sort_by(|a, b| elevation(a).total_cmp(&elevation(b)));
        let rings: Vec<u64> = pulses.iter().map(|p| p.ring.into()).collect();
        let (up, down): (Vec<_>, Vec<_>) = ((0..head).collect(), (0..head).rev().collect());
        let is_ouster = ousters.contains(device);
        assert_eq!(rings, if is_ouster { down } else { up }, "{device:?}");
        if is_ouster {
            for laser in 0..head {
                let number = 7 * head + laser;
                assert_eq!(pattern.identity(number), 7 << 8 | laser);
                let low_deg = match device {
                    // What the sheet rounds to 33.2 degrees.
                    Device::Os1x64 => -16.611,
                    _ => -0.5 * device.sheet().field_of_view_deg[1],
                };
                let step_deg = -2.0 * low_deg / (head - 1) as f64;
                let expected_deg = low_deg + step_deg * laser as f64;
                let found_deg = elevation(&pattern.pulse(number));
                assert!((found_deg - expected_deg).abs() < 1e-9, "{device:?}");
            }
        }
    }
}

/// The tables of the maker's SDK for an OS-1-64 of the first generation: beams from the top on are
/// 0.527 degrees apart, and look to the right of the head, and to its left, in turns of four.
#[test]
fn an_os1_64_has_the_beams_of_its_makers_table() {
    let pattern = Device::Os1x64.pattern();
    let head = SpinningPattern::os1_64(1024, 10.0).expect("valid");
    let mut pulses = pattern.pulses(512 * 64, 64);
    assert_eq!(pulses, head.pulses(512 * 64, 64));
    pulses.sort_by_key(|p| p.ring);
    let table = [
        (0, 16.611, 3.164),
        (1, 16.084, 1.055),
        (2, 15.557, -1.055),
        (3, 15.029, -3.164),
        (4, 14.502, 3.164),
        (31, 0.264, -3.164),
        (32, -0.264, 3.164),
        (63, -16.611, -3.164),
    ];
    for (ring, elevation_deg, to_the_right_deg) in table {
        // Half a turn after the start, the head looks ahead.
        let (az, el) = azimuth_elevation_deg(&pulses[ring]);
        assert!((el - elevation_deg).abs() < 1e-3, "{ring}: {el}");
        assert!((az + to_the_right_deg).abs() < 1e-6, "{ring}: {az}");
    }
    let (params, sheet) = (Device::Os1x64.params(), Device::Os1x64.sheet());
    assert_eq!(sheet.field_of_view_deg, [360.0, 33.2]);
    assert_eq!(params.errors.range_step_m, 0.012);
    assert!((params.beam.vertical_fwhm_rad.to_degrees() - 0.13).abs() < 1e-12);
    // The others of the sheet are wider, in view and beam.
    let params = Device::Os1x128.params();
    assert_eq!(Device::Os1x128.sheet().field_of_view_deg[1], 45.0);
    assert!((params.beam.vertical_fwhm_rad.to_degrees() - 0.18).abs() < 1e-12);
    for rotation_hz in [0.0, f64::NAN] {
        let error = SpinningPattern::os1_64(1024, rotation_hz).expect_err("no rate");
        assert_eq!(error.field, "rotation_hz");
    }
}

#[test]
fn devices_give_as_many_returns_as_their_sheets_say() {
    for device in Device::ALL {
        let expected = match device {
            Device::Mid40 | Device::Hdl64e | Device::Os0 => 1,
            Device::Os1x32 | Device::Os1x64 | Device::Os1x128 => 1,
            Device::Mid70 | Device::LivoxHorizonLike | Device::Vlp16 | Device::ZebHorizon => 2,
            Device::Avia | Device::L1 => 3,
            Device::Terrestrial | Device::Vux1Uav => 15,
            other => panic!("{other:?} is not here"),
        };
        assert_eq!(device.sheet().max_returns, expected, "{device:?}");
    }
}

#[test]
fn bad_heads_are_refused_by_name() {
    let laser = Laser {
        elevation_rad: 0.1,
        azimuth_rad: 0.0,
        delay_s: 0.0,
        ring: 0,
    };
    let refused = |lasers, sequence, rotation| {
        SpinningPattern::new(lasers, sequence, rotation)
            .expect_err("out of range")
            .field
    };
    assert_eq!(refused(vec![], 1e-5, 10.0), "lasers");
    assert_eq!(refused(vec![laser], 0.0, 10.0), "sequence_s");
    assert_eq!(refused(vec![laser], 1e-5, f64::NAN), "rotation_hz");
    let late = Laser {
        delay_s: 1e-4,
        ..laser
    };
    assert_eq!(refused(vec![late], 1e-5, 10.0), "delay_s");
    assert_eq!(
        SpinningPattern::ouster(0.0, 32, 512, 10.0)
            .expect_err("flat")
            .field,
        "vertical_fov_rad"
    );
    for rotation_hz in [0.0, -10.0, f64::NAN] {
        let error = SpinningPattern::ouster(1.0, 4, 1024, rotation_hz).expect_err("no rate");
        assert_eq!(error.field, "rotation_hz");
    }
}

#[test]
fn an_ouster_may_see_straight_up_and_down() {
    for beams in 1..=255 {
        let head = SpinningPattern::ouster(std::f64::consts::PI, beams, 1024, 10.0).expect("valid");
        let top = azimuth_elevation_deg(&head.pulse(u64::from(beams) - 1)).1;
        assert!(beams == 1 || (top - 90.0).abs() < 1e-5, "{beams}: {top}");
    }
}

#[test]
fn a_table_replays_itself() {
    let csv = "time/s,azimuth/deg,elevation/deg,ring\n# a comment\n5.0, 10, 0, 1\n5.1, -10, 20, 2\n\
        \n5.3, 0, -20, 3\n";
    let table = CsvPattern::from_csv(csv.as_bytes()).expect("a table");
    assert_eq!(table.len(), 3);
    // 0.3 s between first and last of three: 0.15 s more to the next.
    let times: Vec<f64> = (0..6).map(|i| table.pulse(i).time_s).collect();
    for (got, want) in times.iter().zip([0.0, 0.1, 0.3, 0.45, 0.55, 0.75]) {
        assert!((got - want).abs() < 1e-12, "{times:?}");
    }
    let (az, el) = azimuth_elevation_deg(&table.pulse(4));
    assert!((az + 10.0).abs() < 1e-9 && (el - 20.0).abs() < 1e-9);
    assert_eq!(table.pulse(5).ring, 3);
    assert!((table.rate_hz() - 3.0 / 0.45).abs() < 1e-12);
}

#[test]
fn a_header_follows_comments_and_a_byte_order_mark_is_none() {
    let len = |csv: &str| CsvPattern::from_csv(csv.as_bytes()).expect("a table").len();
    assert_eq!(len("\u{feff}0,0,0\n1,10,0\n2,10,0\n"), 3);
    assert_eq!(len("\u{feff}t,a,e\n0,0,0\n1,10,0\n"), 2);
    assert_eq!(len("# of a Mid-360\n\nt,a,e\n0,0,0\n1,10,0\n"), 2);
}

#[test]
fn bad_tables_are_refused_by_line() {
    let error = |csv: &str| {
        CsvPattern::from_csv(csv.as_bytes())
            .expect_err("bad")
            .to_string()
    };
    assert_eq!(
        error("0,0,0\n1,zwei,0\n"),
        "line 2: azimuth is \"zwei\", which is no number"
    );
    assert_eq!(
        error("0,0,0\n1,0,91\n"),
        "line 2: elevation is 91, but must be -90..=90"
    );
    assert_eq!(
        error("t,a,e\n1,0,0\n0.5,0,0\n"),
        "line 3: times must not decrease"
    );
    assert_eq!(
        error("0,0,0\n1,0\n"),
        "line 2: 2 fields; must be time, azimuth, elevation and, if wanted, ring"
    );
    assert!(error("0,0,0\n1,0,0,256\n").contains("ring is \"256\""));
    // A stranger's table may hold anything.
    let long = "\u{1b}[2J".repeat(1000);
    for row in [format!("1,{long},0"), format!("1,0,0,{long}")] {
        let error = error(&format!("0,0,0\n{row}\n"));
        assert!(
            error.contains("…\"") && error.chars().count() < 300,
            "{error}"
        );
        assert!(!error.contains(char::is_control), "{error}");
    }
    // What has numbers is no header.
    assert_eq!(
        error("# pulses\n0,0,91\n1,0,0\n2,0,0\n"),
        "line 2: elevation is 91, but must be -90..=90"
    );
    assert_eq!(
        error("t,a,e\ntime,azimuth,elevation\n"),
        "line 2: time is \"time\", which is no number"
    );
    assert_eq!(
        error("5,0,0\n5,1,0\n"),
        "a pattern needs pulses of different times, but all 2 have the same"
    );
    assert!(matches!(
        CsvPattern::from_csv("1,2,3\n".as_bytes()),
        Err(CsvPatternError::TooFew(1))
    ));
}

#[test]
fn a_panorama_covers_its_window_evenly() {
    let params = PanoramaParams {
        rows: 100,
        columns: 360,
        ..PanoramaParams::default()
    };
    let panorama = Panorama::new(params).expect("valid");
    let mut cells = BTreeSet::new();
    for i in 0..panorama.pulses_per_turn() {
        let (az, el) = azimuth_elevation_deg(&panorama.pulse(i));
        assert!((-60.0..90.0).contains(&el));
        cells.insert((
            (az + 180.0).floor() as i32,
            ((el + 60.0) / 1.5).floor() as i32,
        ));
    }
    assert_eq!(cells.len(), 36_000);
    let (a, b) = (panorama.pulse(17), panorama.pulse(36_017));
    assert_eq!(a.direction, b.direction);
    let refused = |p| Panorama::new(p).expect_err("out of range").field;
    assert_eq!(refused(PanoramaParams { rows: 0, ..params }), "rows");
    assert_eq!(
        refused(PanoramaParams {
            top_rad: -2.0,
            ..params
        }),
        "top_rad"
    );
}
