//! A drone that surveys a forest along flight lines.

use nemoral_pipeline::{Backend, Error, Recorder};
use nemoral_realism::grown;
use nemoral_scene::Semantic;
use nemoral_scene::glam::DVec3;

use crate::common::{recorded, refused, sequences};

/// Four crossing lines above a few trees, in 20 frames of 5 m.
const FLIGHT: [&str; 15] = [
    "frames=0",
    "chunks.visible_radius_m=80",
    "chunks.delete_radius_m=150",
    "robot.speed_m_s=5",
    "robot.spacing_s=1",
    "robot.heading_deg=90",
    "robot.flight.height_m=30",
    "robot.flight.length_m=15",
    "robot.flight.width_m=15",
    "robot.flight.line_spacing_m=15",
    "robot.flight.margin_m=5",
    "robot.flight.crossed=true",
    "lidar.device=vux1uav",
    "lidar.pulses=4000",
    "camera.mount_pitch_deg=90",
];

fn with_flight<'a>(settings: &[&'a str]) -> Vec<&'a str> {
    [&FLIGHT[..], settings].concat()
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn what_a_flight_does_not_see_is_told() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    let told = |name: &str, more: &[&str]| {
        let made = recorded(&dir.path().join(name), 1, &with_flight(more));
        made.map(|(_, told)| told)
    };
    let blind = "camera.enabled=false";
    let ahead = told("ahead", &[blind, "lidar.device=l1"])?;
    assert!(
        ahead.contains("[lidar] does not see what is straight below"),
        "{ahead}"
    );
    let far = told("far", &[blind, "lidar.noise.reference_range_m=20"])?;
    assert!(
        far.contains("[lidar] sees what reflects 40 % to 28 m"),
        "{far}"
    );
    // 4,000 pulses are 29 ms of every second.
    let gaps = "3 % of the flight lines are scanned; robot.spacing_s = 0.029 scans all of them";
    assert!(far.contains(gaps), "{far}");
    let down = [
        "lidar.device=l1",
        "lidar.mount_pitch_deg=90",
        "lidar.pulses=240000",
    ];
    let fine = told("fine", &[&[blind], &down[..]].concat())?;
    for word in ["straight below", "reflects", "scanned"] {
        assert!(!fine.contains(word), "{fine}");
    }
    Ok(())
}

#[test]
fn a_flight_surveys_its_area() -> Result<(), Error> {
    let sequence = sequences(&FLIGHT)?.get(0)?;
    // 0 is all of them.
    assert_eq!(sequence.config.frames, 20);
    let recorder = Recorder::new(sequence, Backend::Cpu, grown(), 2)?;
    let (mut ground, mut above) = (0, 0);
    for frame in [0, 7, 12, 19] {
        let pose = recorder.pose(frame)?.world_from_body();
        let ahead = pose.transform_vector(DVec3::X);
        let wanted = if frame < 10 { DVec3::X } else { DVec3::NEG_Y };
        assert!(ahead.dot(wanted).abs() > 0.98, "{frame}: {ahead}");
        let at = pose.translation_m;
        let made = recorder.frame(frame)?;
        let world_from_lidar = pose * recorder.spec().lidars[0].body_from_lidar;
        for p in &made.scans[0] {
            let point_m = world_from_lidar.transform_point(p.position_m.as_dvec3());
            // Lines lie across the flight, within 45 degrees and some sway.
            let to = point_m - at;
            let along_m = to.truncate().dot(ahead.truncate()).abs();
            assert!(to.z < 0.0 && along_m < 2.5 + 0.12 * -to.z, "{to}");
            assert!(to.truncate().length() < -1.3 * to.z + 3.0, "{to}");
            let is_ground = matches!(
                p.semantic,
                Semantic::Soil | Semantic::Litter | Semantic::TrailSurface
            );
            ground += u32::from(is_ground);
            above += u32::from(!is_ground);
        }
    }
    assert!(ground > 100 && above > 1000, "{ground} {above}");
    Ok(())
}

#[test]
fn its_data_set_knows_the_lines() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("flight");
    let (dataset, _) = recorded(&out, 7, &with_flight(&["camera.flow=true"]))?;
    let track = &dataset.manifest().tracks[0];
    assert_eq!((track.length, &track.lines[..]), (20, &[0, 5, 10, 15][..]));
    let lines: Vec<_> = [0, 4, 5, 19].map(|k| track.line_of(k)).to_vec();
    assert_eq!(lines, [Some(0), Some(0), Some(1), Some(3)]);
    // Times go on after a turn, and nothing flows from one line to the next.
    let times: Vec<f64> = dataset.frames().iter().map(|f| f.time_s).collect();
    assert_eq!(times, [0.5, 1.5, 2.5, 3.5, 4.5, 45.5, 46.5]);
    let report = nemoral_dataset::check(&out)?;
    assert!(report.passed(), "{report}");
    for (frame, flows) in [(3, true), (4, false), (5, true)] {
        let frame = dataset.read_frame(frame)?;
        let flow = frame.cameras[0].flow.as_ref().expect("asked for");
        let some = flow.pixels().iter().any(|pixel| pixel.is_some());
        assert_eq!(some, flows);
    }
    Ok(())
}

#[test]
fn impossible_flights_are_refused() {
    for (settings, told) in [
        (
            &["robot.flight.height_m=300", "chunks.visible_radius_m=120"][..],
            "robot.flight.height_m = 300: must be less than chunks.visible_radius_m = 120",
        ),
        (
            &["robot.rest_s=2"],
            "robot.rest_s = 2: must be 0 with [robot.flight]",
        ),
        (
            &["imu.enabled=true"],
            "must be false with [robot.flight]: turns between lines",
        ),
        (&["robot.flight.width_m=-1"], "robot.flight.width_m"),
        (
            &["robot.spacing_s=0.00001", "robot.flight.length_m=5000"],
            "robot.flight: it has more than 10000000 frames",
        ),
        (
            &[
                "robot.spacing_s=1",
                "robot.flight.crossed=false",
                "robot.flight.length_m=5000",
                "robot.flight.width_m=5000",
                "robot.flight.line_spacing_m=1",
            ],
            "robot.flight.line_spacing_m = 1: must be wide enough for at most 10,000 km of lines",
        ),
        (
            &["balance.targets.trunks=0.2"],
            "[robot.flight] asks for flight lines",
        ),
    ] {
        let text = refused(&with_flight(settings));
        assert!(text.contains(told), "{text}");
    }
    // Only a path that ends has all of its frames.
    let text = refused(&["frames=0"]);
    assert!(
        text.contains("frames = 0: must be at least 1, but with [robot.stations]"),
        "{text}"
    );
    let stations = sequences(&["frames=0", "robot.stations.rows=4"]).and_then(|all| all.get(0));
    assert_eq!(stations.expect("stations end").config.frames, 12);
    let dir = tempfile::tempdir().expect("a folder");
    let poses = dir.path().join("poses.txt");
    nemoral_files::write(&poses, b"0 0 0 1 0 0 0 1\n1 1 0 1 0 0 0 x\n").expect("written");
    let file = format!("robot.file.path={}", poses.display());
    let text = refused(&["frames=0", &file]);
    assert!(text.contains("poses.txt:2:"), "{text}");
    // All sequences have equally many frames.
    let varied = "vary.\"robot.flight.length_m\"=[20, 200]";
    let all = sequences(&with_flight(&["sequences=2", varied])).expect("sound");
    let text = all.get(1).expect_err("differs").to_string();
    assert!(text.contains("the path of sequence 1 has"), "{text}");
}
