//! An inertial unit measures the drive that the frames are of.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use nemoral_dataset::{Dataset, OpenMode};
use nemoral_imu::{GRAVITY_M_S2, ImuMotion, ImuSample};
use nemoral_pipeline::config::ConfigLayers;
use nemoral_pipeline::{
    Backend, Error, FrameSelection, FrameWritten, GenerateParams, MeasuredMotion, Observer,
    Recorder, SequenceFrames, generate,
};
use nemoral_realism::grown;
use nemoral_scene::glam::{DQuat, DVec3};

fn recorder(preset: &str, settings: &[&str]) -> Recorder {
    let layers = ConfigLayers {
        preset: Some(preset.to_owned()),
        settings: settings.iter().map(|&s| s.to_owned()).collect(),
        ..ConfigLayers::default()
    };
    let sequence = layers.sequences().expect("sound").get(0).expect("one");
    Recorder::new(sequence, Backend::Cpu, grown(), 2).expect("sound")
}

fn measured(recorder: &Recorder) -> Result<(Vec<(ImuMotion, ImuSample)>, MeasuredMotion), Error> {
    let mut all = Vec::new();
    let count = recorder.measure_motion(|motion, sample| {
        all.push((*motion, *sample));
        Ok(())
    })?;
    Ok((all, count))
}

const UNIT: [&str; 5] = [
    "frames=9",
    "robot.spacing_s=0.5",
    "imu.rate_hz=100",
    "imu.mount_x_m=-0.2",
    "imu.mount_yaw_deg=90",
];

#[test]
fn integrated_it_leads_from_frame_to_frame() {
    // Along a trail, and winding between the trees.
    for path in ["robot.speed_m_s=1.2", "robot.wander.amplitude_m=6"] {
        let settings = [&UNIT[..], &[path]].concat();
        let recorder = recorder("demo", &settings);
        let (all, count) = measured(&recorder).expect("a drive");
        assert_eq!((all.len(), count.samples), (402, 402));
        let step_s = 0.01;
        // From the first state on, by what was truly felt.
        let (first, _) = all[0];
        let half =
            |motion: &ImuMotion| DQuat::from_scaled_axis(0.5 * step_s * motion.angular_rate_rad_s);
        let acceleration = |rotation: DQuat, motion: &ImuMotion| {
            rotation * motion.specific_force_m_s2 - DVec3::Z * GRAVITY_M_S2
        };
        let mut at = first.world_from_imu.translation_m;
        let mut rotation = first.world_from_imu.rotation * half(&first).inverse();
        let begins = acceleration(first.world_from_imu.rotation, &first);
        let mut velocity = first.velocity_m_s - 0.5 * step_s * begins;
        for (i, (motion, _)) in all.iter().enumerate() {
            let middle = rotation * half(motion);
            if i % 50 == 0 {
                let pose = recorder.pose(i as u64 / 50).expect("a frame");
                let imu = recorder.sequence().config.imu.body_from_imu();
                let wanted = pose.world_from_body() * imu;
                assert!((pose.time_s - motion.time_s).abs() < 1e-9);
                let truth = motion.world_from_imu;
                assert!(truth.translation_m.distance(wanted.translation_m) < 1e-9);
                assert!(truth.rotation.angle_between(wanted.rotation) < 1e-7);
                let drift_m = at.distance(wanted.translation_m);
                assert!(drift_m < 0.015, "{path}, sample {i}: {drift_m} m");
                assert!(middle.angle_between(wanted.rotation) < 3e-3);
            }
            velocity += step_s * acceleration(middle, motion);
            at += step_s * velocity;
            rotation = middle * half(motion);
        }
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_unit_has_the_errors_that_were_asked_for_and_the_same_ones_each_time() {
    let (all, count) = measured(&recorder("demo", &UNIT)).expect("a drive");
    assert_eq!(count.out_of_range, 0);
    let again = measured(&recorder("demo", &UNIT)).expect("a drive");
    assert_eq!(all, again.0);
    let noise = |(motion, sample): &(ImuMotion, ImuSample)| {
        sample.specific_force_m_s2 - sample.accelerometer_bias_m_s2 - motion.specific_force_m_s2
    };
    let squares: f64 = all.iter().map(|s| noise(s).length_squared()).sum();
    let deviation = (squares / (3 * all.len()) as f64).sqrt();
    // 0.002 m/s² a root of hertz, at 100 Hz.
    assert!((deviation / 0.02 - 1.0).abs() < 0.1, "{deviation}");
    let other = [&UNIT[..], &["seed=8"]].concat();
    let other = measured(&recorder("demo", &other)).expect("a drive").0;
    assert_ne!(
        other[0].1.gyroscope_bias_rad_s,
        all[0].1.gyroscope_bias_rad_s
    );
    let exact = [
        "imu.gyroscope_noise_density=0",
        "imu.gyroscope_random_walk=0",
        "imu.gyroscope_bias_rad_s=0",
    ];
    let exact = measured(&recorder("demo", &[&UNIT[..], &exact].concat())).expect("a drive");
    for (motion, sample) in exact.0 {
        assert_eq!(sample.angular_rate_rad_s, motion.angular_rate_rad_s);
    }
}

#[test]
fn a_long_drive_frees_chunks_and_turns_back_at_the_end_of_its_trail() {
    // 1.2 km at 20 m/s, along a trail that is shorter.
    let settings = [
        "frames=13",
        "robot.spacing_m=100",
        "robot.speed_m_s=20",
        "imu.rate_hz=50",
        "trails.max_length_chunks=4",
    ];
    let recorder = recorder("demo", &settings);
    let (all, measured) = measured(&recorder).expect("a drive");
    assert_eq!(all.len(), 3002);
    let of_single = |settings: &[&str]| {
        let recorder = self::recorder("demo", settings);
        self::measured(&recorder).expect("a drive")
    };
    // What was freed is made again, and is the same: the drive back is over the same ground.
    let (again, _) = of_single(&settings);
    assert_eq!(all, again);
    // It brakes before it turns.
    assert_eq!(measured.range_note(), None, "{measured:?}");
    // One frame is one sample, and those until its scan has ended.
    let (one, _) = of_single(&["frames=1"]);
    assert_eq!(one.len(), 3);
    assert_eq!(one[0].0.time_s, 0.0);
}

#[test]
fn the_folder_is_that_of_euroc() {
    let dir = tempfile::tempdir().expect("a folder");
    let count = recorder("demo", &UNIT)
        .write_imu(dir.path())
        .expect("written");
    let read = |name: &str| {
        let path = dir.path().join(name);
        nemoral_files::read_text(&path, 1 << 20).expect("a text")
    };
    let samples = read("imu0/data.csv");
    let states = read("state_groundtruth_estimate0/data.csv");
    for text in [&samples, &states] {
        assert_eq!(text.lines().count() as u64, count.samples + 1);
        assert!(text.starts_with("#timestamp"));
        let last = text.lines().last().and_then(|line| line.split_once(','));
        assert_eq!(last.map(|(time, _)| time), Some("4010000000"));
    }
    let sensor = read("imu0/sensor.yaml");
    assert!(
        sensor.contains("rate_hz: 100.0") && sensor.contains("T_BS:"),
        "{sensor}"
    );
}

struct Silent;

impl Observer for Silent {
    fn note(&self, _: &str) {}

    fn frame(&self, _: FrameWritten) {}
}

/// Makes scans of a drive with a unit.
fn record(out: &Path, shard: Option<(u64, u64)>) -> Result<(), Error> {
    record_with(out, shard, &[])
}

fn record_with(out: &Path, shard: Option<(u64, u64)>, more: &[String]) -> Result<(), Error> {
    let asked = ["imu.enabled=true", "camera.enabled=false"];
    let settings = UNIT.iter().chain(&asked).map(|&s| s.to_owned());
    let settings = settings.chain(more.iter().cloned());
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        settings: settings.collect(),
        ..ConfigLayers::default()
    };
    let all = SequenceFrames::new(FrameSelection::first(9), 1);
    let params = GenerateParams {
        sequences: layers.sequences()?,
        frames: shard.map_or(all.clone(), |(i, n)| all.shard(i, n)),
        out: out.to_owned(),
        mode: OpenMode::Fresh,
        is_shard: shard.is_some(),
        threads: 2,
        backend: Backend::Cpu,
        cache: grown(),
    };
    generate(&params, &Silent, &AtomicBool::new(false)).map(drop)
}

#[test]
fn data_sets_have_what_the_unit_measures_and_so_has_each_part() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    let [whole, alone] = ["whole", "alone"].map(|name| dir.path().join(name));
    record(&whole, None)?;
    recorder("demo", &UNIT).write_imu(&alone)?;
    let parts = ["first", "second"].map(|name| dir.path().join(name));
    for (part, i) in parts.iter().zip(0..) {
        record(part, Some((i, 2)))?;
    }
    for file in [
        "imu0/data.csv",
        "imu0/sensor.yaml",
        "state_groundtruth_estimate0/data.csv",
    ] {
        let read = |path: PathBuf| nemoral_files::read_text(&path, 1 << 20).expect("a text");
        let asked = read(alone.join(file));
        for out in [&whole, &parts[0], &parts[1]] {
            assert_eq!(read(out.join("sequences/00").join(file)), asked, "{file}");
        }
    }
    let report = nemoral_dataset::check(&whole)?;
    assert!(report.passed(), "{report}");
    assert_eq!(Dataset::open(&whole)?.imu(0)?.len(), 402);
    Ok(())
}

/// Two rounds of a circle, at times that do not begin with 0.
#[test]
fn poses_of_a_file_are_a_drive_and_a_loop_is_closed() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    let (poses, out) = (dir.path().join("loop.txt"), dir.path().join("out"));
    let (radius_m, turn_rad) = (8.0_f64, std::f64::consts::TAU / 20.0);
    let pose = |i: u32| {
        let angle = f64::from(i) * turn_rad;
        let ([x, y], half) = (
            [radius_m * angle.cos(), radius_m * angle.sin()],
            0.5 * angle,
        );
        let (time_s, heading) = (
            100.0 + 0.5 * f64::from(i),
            half + std::f64::consts::FRAC_PI_4,
        );
        format!(
            "{time_s} {x} {y} 0 0 0 {} {}\n",
            heading.sin(),
            heading.cos()
        )
    };
    let text: String = (0..41).map(pose).collect();
    nemoral_files::write(&poses, text.as_bytes()).expect("written");
    let path = format!("robot.file.path={}", poses.display());
    record_with(
        &out,
        None,
        &[path, "lidar.pulses=500".to_owned(), "frames=41".to_owned()],
    )?;
    let report = nemoral_dataset::check(&out)?;
    assert!(report.passed(), "{report}");
    let readings = Dataset::open(&out)?.imu(0)?;
    assert_eq!(readings.len(), 2002);
    assert_eq!(readings[0].time_ns, 100_000_000_000);
    // The second round is the first one, and it is driven smoothly over the whole circle.
    let (speed_m_s, rate) = (radius_m * turn_rad / 0.5, turn_rad / 0.5);
    for (first, second) in readings[200..800].iter().zip(&readings[1200..1800]) {
        let [a, b] = [first, second].map(|r| r.world_from_imu);
        assert!(a.translation_m.distance(b.translation_m) < 0.003);
        assert!((first.velocity_m_s.truncate().length() / speed_m_s - 1.0).abs() < 0.05);
        assert!((first.angular_rate_rad_s.z - rate).abs() < 0.1);
    }
    Ok(())
}

#[test]
fn a_data_set_without_a_drive_is_refused_before_it_is_begun() {
    for (settings, told) in [
        (
            &["robot.stations.rows=2"][..],
            "imu.enabled = true: must be false with [robot.stations]",
        ),
        (
            &["balance.targets.trunks=0.2", "frames=2"],
            "imu.enabled = true: must be false with [balance.targets]",
        ),
    ] {
        let settings = [&["imu.enabled=true"], settings].concat();
        let layers = ConfigLayers {
            preset: Some("demo".to_owned()),
            settings: settings.iter().map(|&s| s.to_owned()).collect(),
            ..ConfigLayers::default()
        };
        let refused = layers
            .sequences()
            .and_then(|all| all.get(0))
            .expect_err(told);
        assert!(refused.to_string().contains(told), "{refused}");
    }
}

/// The times of a file are known only where it is read.
#[test]
fn more_samples_than_are_kept_are_refused_before_the_first_frame() {
    let dir = tempfile::tempdir().expect("a folder");
    let (poses, out) = (dir.path().join("slow.txt"), dir.path().join("out"));
    let pose = |i: u32| format!("{} {i} 0 0 0 0 0 1\n", 125_000 * i);
    let text: String = (0..9).map(pose).collect();
    nemoral_files::write(&poses, text.as_bytes()).expect("written");
    let of_file = [format!("robot.file.path={}", poses.display())];
    let of_drive = ["frames=100000", "robot.spacing_s=1", "imu.rate_hz=400"].map(str::to_owned);
    for (settings, told) in [
        (
            &of_file[..],
            "imu.rate_hz = 100: must be at most 4.9 with 9 frames in 1000000 s",
        ),
        (
            &of_drive[..],
            "imu.rate_hz = 400: must be at most 50.0 with 100000 frames in 99999 s",
        ),
    ] {
        let refused = record_with(&out, None, settings).expect_err(told);
        assert!(refused.to_string().contains(told), "{refused}");
        assert!(!out.exists());
    }
}

#[test]
fn a_robot_that_does_not_drive_or_drives_for_ever_is_refused() {
    for (settings, why) in [
        (&["robot.stations.rows=2"][..], "stands still"),
        (&["robot.speed_m_s=1e-300"], "at most 1e8"),
        (&["frames=10000000", "robot.speed_m_s=0.1"], "at most 1e8"),
        (
            &["balance.targets.trunks=0.2", "frames=2"],
            "beside the path",
        ),
    ] {
        let refused = measured(&recorder("demo", settings)).expect_err("no drive");
        assert!(refused.to_string().contains(why), "{refused}");
    }
}
