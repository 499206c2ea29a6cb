//! KITTI's benchmark of 2015, read as its development kit describes it, of a world that rays meet
//! by closed forms: a slanted wall, and a plate in front of it.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use nemoral_convert::{ConvertParams, Error, FormatName, OutputMode, convert_with_progress};
use nemoral_dataset::{
    BalanceRecord, BalanceTarget, CameraSpec, Dataset, DatasetHeader, DepthFormat, ProgressMonitor,
    Split,
};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{
    Distortion, Image, Intrinsics, ObjectId, RigidTransform, Semantic, Shutter, TruthImages,
};

use crate::common::{
    Drive, START, annotated, made_of_drives, made_of_frames, numbers, png, pose, run, text,
    write_drives, write_of,
};

const WIDTH: usize = 124;
const HEIGHT: usize = 88;
const BASELINE_M: f64 = 0.5;

fn wide() -> DatasetHeader {
    let mut header = annotated();
    for camera in &mut header.sequences[0].cameras {
        let size = (WIDTH as u32, HEIGHT as u32);
        camera.intrinsics = Intrinsics::from_fov(size.0, size.1, 1.3).expect("valid");
    }
    header
}

/// Distance along a ray to the wall or the plate, whichever is nearer; from the world's axes.
fn cast(from: DVec3, along: DVec3) -> Option<f64> {
    // x ahead of the first camera, as the drive starts.
    let stage = RigidTransform::from_xyz_rpy(START, 0.0, 0.0, 0.45).inverse();
    let (from, along) = (stage.transform_point(from), stage.transform_vector(along));
    let normal = DVec3::new(-1.0, 0.35, 0.1);
    let wall = (DVec3::new(12.0, 0.0, 0.0) - from).dot(normal) / along.dot(normal);
    let plate = (5.0 - from.x) / along.x;
    let at = from + along * plate;
    let meets = (at.y - 0.3).abs() < 0.8 && (at.z - 1.4).abs() < 0.7;
    let hits = [(plate, meets), (wall, true)];
    let hits = hits.into_iter().filter(|(t, meets)| *meets && *t > 1e-9);
    hits.map(|(t, _)| t).min_by(f64::total_cmp)
}

fn eye(camera: &CameraSpec, frame: u64) -> RigidTransform {
    pose(frame).1 * camera.body_from_camera
}

/// What the ray of a pixel meets.
fn place(camera: &CameraSpec, frame: u64, column: usize, row: usize) -> Option<DVec3> {
    let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
    let (eye, k) = (eye(camera, frame), &camera.intrinsics);
    let ray = DVec3::new((at.x - k.cx) / k.fx, (at.y - k.cy) / k.fy, 1.0);
    let along = eye.transform_vector(ray.normalize());
    Some(eye.translation_m + along * cast(eye.translation_m, along)?)
}

/// Where a camera sees a place, with its depth, and whether nothing is in front of it there.
fn seen(camera: &CameraSpec, frame: u64, place: DVec3) -> (DVec3, bool) {
    let (eye, k) = (eye(camera, frame), &camera.intrinsics);
    let local = eye.inverse().transform_point(place);
    let x = k.fx * local.x / local.z + k.cx;
    let y = k.fy * local.y / local.z + k.cy;
    let (way, inside) = (place - eye.translation_m, |v: f64, size: usize| {
        (0.0..size as f64).contains(&v)
    });
    let far = cast(eye.translation_m, way.normalize()).unwrap_or(f64::INFINITY);
    let free = far > way.length() - 1e-6;
    (
        DVec3::new(x, y, local.z),
        free && local.z > 0.0 && inside(x, WIDTH) && inside(y, HEIGHT),
    )
}

fn images(camera: &CameraSpec, frame: u64) -> (Image<[u8; 3]>, TruthImages) {
    let all = (0..WIDTH * HEIGHT).map(|i| (i % WIDTH, i / WIDTH));
    let all = Image::new(WIDTH, HEIGHT, all.collect());
    let depth = |&(c, r): &(usize, usize)| {
        let place = place(camera, frame, c, r);
        place.map_or(0.0, |p| seen(camera, frame, p).0.z as f32)
    };
    let depth_m = all.map(depth);
    let truth = TruthImages {
        semantic: depth_m.map(|&z| match z {
            0.0 => Semantic::Sky,
            _ => Semantic::Litter,
        }),
        object: depth_m.map(|_| ObjectId::NONE),
        normal: depth_m.map(|&z| if z > 0.0 { -Vec3::Z } else { Vec3::ZERO }),
        depth_m,
    };
    let shift = camera.name.len() + frame as usize;
    (all.map(|&(c, r)| [(c + shift) as u8, r as u8, 7]), truth)
}

/// The 16-bit samples of a picture, `channels` a pixel.
fn samples(path: &Path, channels: usize) -> Vec<u16> {
    let (w, h, data) = png(path);
    assert_eq!((w, h, data.len()), (WIDTH, HEIGHT, 2 * channels * w * h));
    let samples = data.as_chunks::<2>().0.iter();
    samples.map(|s| u16::from_be_bytes(*s)).collect()
}

/// Whether the pixels around a place are of both surfaces, so that whether it is seen depends on
/// less than a pixel.
fn on_an_edge(depth_m: &Image<f32>, at: DVec3) -> bool {
    let (column, row) = ((at.x - 0.5).floor(), (at.y - 0.5).floor());
    let near = |v: f64, size: usize| {
        [-1.0, 0.0, 1.0, 2.0].map(|d| ((v + d).max(0.0) as usize).min(size - 1))
    };
    let rows = near(row, HEIGHT).into_iter();
    let around = rows.flat_map(|r| near(column, WIDTH).map(|c| *depth_m.at(c, r)));
    let (low, high) = around.fold((f32::MAX, 0.0_f32), |(l, h), z| (l.min(z), h.max(z)));
    high - low > 1.5
}

/// A converted data set of two frames without flow.
struct Pair {
    _dir: tempfile::TempDir,
    header: DatasetHeader,
    dataset: Dataset,
    out: PathBuf,
}

/// Takes the picture of a camera at a frame.
type Shot = fn(&CameraSpec, u64) -> (Image<[u8; 3]>, TruthImages);

impl Pair {
    fn new(format: DepthFormat, images: Shot) -> Self {
        let mut header = wide();
        header.sequences[0].depth_format = format;
        header.sequences[0].cameras[0].annotations.flow = false;
        let dir = tempfile::tempdir().expect("a folder");
        let (source, out) = (dir.path().join("dataset"), dir.path().join("out"));
        let dataset = write_of(&source, &header, &[1, 2], images);
        run(&source, &out, FormatName::Kitti2015, OutputMode::Fresh).expect("converted");
        Self {
            _dir: dir,
            header,
            dataset,
            out,
        }
    }

    fn disparity(&self, name: &str) -> Vec<u16> {
        let path = format!("training/{name}/000000_10.png");
        samples(&self.out.join(path), 1)
    }
}

#[test]
fn disparities_are_those_of_rays_and_so_are_occlusions() {
    for format in [DepthFormat::Png16, DepthFormat::Npy] {
        let pair = Pair::new(format, images);
        let Pair {
            header,
            dataset,
            out,
            ..
        } = &pair;
        let [occ, noc] = ["disp_occ_0", "disp_noc_0"].map(|name| pair.disparity(name));
        let [next_occ, next_noc] = ["disp_occ_1", "disp_noc_1"].map(|name| pair.disparity(name));
        let cameras = &header.sequences[0].cameras;
        let (left, right) = (&cameras[0], &cameras[1]);
        let reads = [0, 1].map(|f| dataset.read_frame(f).expect("a frame").cameras);
        let (mut hidden, mut outside, mut next_hidden, mut edges) = (0, 0, 0, 0);
        for i in 0..WIDTH * HEIGHT {
            let (column, row) = (i % WIDTH, i / WIDTH);
            let place = place(left, 1, column, row).expect("the wall is everywhere");
            let near = |code: u16, px: f64, error_px: f64| {
                assert!(
                    (f64::from(code) / 256.0 - px).abs() <= 0.5 / 256.0 + error_px,
                    "{i}"
                );
            };
            // From the file's depth to half a step, and from the rays as well as depth is rounded.
            let z_m = f64::from(reads[0][0].depth_m.pixels()[i]);
            near(occ[i], left.intrinsics.fx * BASELINE_M / z_m, 1e-6);
            let (at, is_seen) = seen(right, 1, place);
            let rounding = |z_m: f64| left.intrinsics.fx * BASELINE_M / (z_m * z_m) / 200.0;
            near(occ[i], column as f64 + 0.5 - at.x, rounding(z_m));
            if on_an_edge(&reads[0][1].depth_m, at) {
                edges += 1;
            } else {
                assert_eq!(
                    noc[i],
                    if is_seen { occ[i] } else { 0 },
                    "{column} {row} {at}"
                );
                hidden += usize::from(!is_seen && at.x >= 0.0);
                outside += usize::from(at.x < 0.0);
            }
            let (there, there_seen) = seen(left, 2, place);
            let (beside, beside_seen) = seen(right, 2, place);
            near(next_occ[i], there.x - beside.x, 2.0 * rounding(there.z));
            if on_an_edge(&reads[1][0].depth_m, there) || on_an_edge(&reads[1][1].depth_m, beside) {
                continue;
            }
            let is_seen = there_seen && beside_seen;
            assert_eq!(
                next_noc[i],
                if is_seen { next_occ[i] } else { 0 },
                "{column} {row}"
            );
            next_hidden += usize::from(!is_seen);
        }
        assert!(
            hidden > 50 && outside > 50 && next_hidden > 100,
            "{hidden} {outside}"
        );
        assert!(edges < WIDTH * HEIGHT / 10, "{edges}");
        for (camera, folder) in [(0, "image_2"), (1, "image_3")] {
            for (read, time) in reads.iter().zip([10, 11]) {
                let path = out.join(format!("training/{folder}/000000_{time}.png"));
                assert_eq!(png(path).2, read[camera].rgb.pixels().as_flattened());
            }
        }
        // The calibration projects the same place as far apart as disparity says.
        let calib = text(out.join("training/calib_cam_to_cam/000000.txt"));
        let matrix = |name: &str| {
            let line = calib
                .lines()
                .find_map(|l| l.strip_prefix(&format!("{name}: ")));
            numbers(line.expect(name))[0].clone()
        };
        let place = [0.3, -0.2, 4.0, 1.0];
        let column = |name: &str| {
            let m = matrix(name);
            let dot = |r: usize| (0..4).map(|c| m[4 * r + c] * place[c]).sum::<f64>();
            dot(0) / dot(2)
        };
        let apart = column("P_rect_02") - column("P_rect_03");
        assert!((apart - left.intrinsics.fx * BASELINE_M / 4.0).abs() < 1e-9);
        let expected = left
            .intrinsics
            .project(DVec3::from_slice(&place[..3]))
            .expect("ahead");
        assert!((column("P_rect_00") - (expected.x - 0.5)).abs() < 1e-9);
        let beside = matrix("T_03");
        assert!((beside[0] + BASELINE_M).abs() < 1e-9 && beside[1..] == [0.0, 0.0]);
    }
}

/// A floor below the cameras, as far as depth of 16 bits reaches.
fn floor(camera: &CameraSpec, frame: u64) -> (Image<[u8; 3]>, TruthImages) {
    let (eye, k) = (eye(camera, frame), &camera.intrinsics);
    let depth_m = (0..WIDTH * HEIGHT).map(|i| {
        let at = DVec2::new((i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5);
        let ray = DVec3::new((at.x - k.cx) / k.fx, (at.y - k.cy) / k.fy, 1.0);
        let z_m = (START.z - eye.translation_m.z) / eye.transform_vector(ray).z;
        if (0.0..250.0).contains(&z_m) {
            z_m as f32
        } else {
            0.0
        }
    });
    let depth_m = Image::new(WIDTH, HEIGHT, depth_m.collect());
    let truth = TruthImages {
        semantic: depth_m.map(|&z| match z {
            0.0 => Semantic::Sky,
            _ => Semantic::Litter,
        }),
        object: depth_m.map(|_| ObjectId::NONE),
        normal: depth_m.map(|&z| if z > 0.0 { -Vec3::Y } else { Vec3::ZERO }),
        depth_m,
    };
    (truth.depth_m.map(|_| [1, 2, 3]), truth)
}

#[test]
fn grazing_ground_is_hidden_by_nothing() {
    for format in [DepthFormat::Png16, DepthFormat::Npy] {
        let pair = Pair::new(format, floor);
        let Pair {
            header, dataset, ..
        } = &pair;
        let [noc, next_noc] = ["disp_noc_0", "disp_noc_1"].map(|name| pair.disparity(name));
        let cameras = &header.sequences[0].cameras;
        let (left, right) = (&cameras[0], &cameras[1]);
        let depth_m = &dataset.read_frame(0).expect("a frame").cameras[0].depth_m;
        let inside = |at: DVec3| {
            // At the border there is no neighbour that tells the slope.
            (1.0..WIDTH as f64 - 1.0).contains(&at.x) && (1.0..HEIGHT as f64 - 1.0).contains(&at.y)
        };
        let (mut far, mut places) = (0, 0);
        for i in 0..WIDTH * HEIGHT {
            let z_m = f64::from(depth_m.pixels()[i]);
            // Beyond, a disparity may be rounded to less than there is.
            if z_m == 0.0 || z_m > 100.0 {
                continue;
            }
            let (eye, k) = (eye(left, 1), &left.intrinsics);
            let at = DVec2::new((i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5);
            let local = DVec3::new((at.x - k.cx) / k.fx, (at.y - k.cy) / k.fy, 1.0) * z_m;
            let place = eye.transform_point(local);
            let [beside, there, there_beside] =
                [(right, 1), (left, 2), (right, 2)].map(|(c, f)| seen(c, f, place).0);
            assert!(noc[i] > 0 || !inside(beside), "{at} {z_m}");
            if inside(there) && inside(there_beside) {
                assert!(next_noc[i] > 0, "{at} {z_m} m");
                places += 1;
                far += usize::from(z_m > 20.0);
            }
        }
        assert!(places > 2000 && far > 200, "{places} {far}");
    }
}

#[test]
fn what_the_next_picture_shows_is_flows_to_say() {
    // The flow of these data sets is no motion's, so that depth would say otherwise.
    let dir = tempfile::tempdir().expect("a folder");
    let noc_of = |name: &str, has_flow: bool| {
        let mut header = wide();
        header.sequences[0].cameras[0].annotations.flow = has_flow;
        let (source, out) = (
            dir.path().join(name),
            dir.path().join(format!("{name}-out")),
        );
        write_of(&source, &header, &[1, 2], floor);
        run(&source, &out, FormatName::Kitti2015, OutputMode::Fresh).expect("converted");
        let state = has_flow.then(|| samples(&source.join("sequences/00/flow/000001.png"), 3));
        (
            samples(&out.join("training/disp_noc_1/000000_10.png"), 1),
            state,
        )
    };
    let (by_depth, _) = noc_of("depth", false);
    let (by_flow, state) = noc_of("flow", true);
    let state = state.expect("a flow");
    let mut differ = 0;
    for i in 0..WIDTH * HEIGHT {
        match state[3 * i + 2] {
            0 => assert_eq!(by_flow[i], by_depth[i]),
            1 => assert!(by_flow[i] == by_depth[i] || by_depth[i] == 0),
            _ => {
                assert_eq!(by_flow[i], 0);
                differ += usize::from(by_depth[i] > 0);
            }
        }
    }
    assert!(differ > 500, "{differ}");
}

#[test]
fn files_of_a_frame_are_read_before_it_counts_as_done() {
    let dir = tempfile::tempdir().expect("a folder");
    let (source, out) = (dir.path().join("dataset"), dir.path().join("out"));
    crate::common::write(&source, &annotated(), &[0, 1]);
    let sequence = source.join("sequences/00");
    // Whoever hears of the first frame takes its files away.
    let monitor = ProgressMonitor::new(move |done| {
        for (path, _) in crate::common::tree(&sequence) {
            let file = path.file_stem().is_some_and(|stem| stem == "000000");
            if done.frame == 0 && file {
                std::fs::remove_file(sequence.join(path)).expect("removed");
            }
        }
        ControlFlow::Continue(())
    });
    let params = ConvertParams::new(FormatName::Kitti2015);
    convert_with_progress(&source, &out, &params, &monitor).expect("converted");
    assert!(!source.join("sequences/00/image_2/000000.png").exists());
}

#[test]
fn only_frames_of_drives_are_pairs() {
    let mut header = annotated();
    for number in 1..4 {
        let mut further = header.sequences[0].clone();
        further.number = number;
        header.sequences.push(further);
    }
    let standing = Drive {
        stands: true,
        ..Drive::of(1, &[0, 1])
    };
    let single = Drive {
        balance: Some(BalanceRecord {
            candidates: 4,
            pilot_poses: 10,
            cap: 2.0,
            targets: vec![BalanceTarget {
                name: "deadwood".to_owned(),
                goal: 0.1,
                before: 0.01,
                expected: 0.05,
                weight: 1.0,
            }],
        }),
        ..Drive::of(2, &[0, 1, 2])
    };
    let drives = [
        Drive::of(0, &[3, 4]),
        standing.clone(),
        single.clone(),
        // Nothing drives from one flight line to the next.
        Drive {
            lines: vec![0, 2],
            ..Drive::of(3, &[0, 1, 2, 3])
        },
    ];
    let made = made_of_drives(FormatName::Kitti2015, &header, &drives);
    let rows = "pair,sequence,frame,next_frame,split\n000000,0,3,4,train\n000001,3,0,1,val\n\
                000002,3,2,3,val\n";
    assert_eq!(text(made.out.join("pairs.csv")), rows);
    assert!(!made.out.join("training/image_2/000003_10.png").exists());

    header.sequences.truncate(3);
    header.sequences.remove(0);
    let dir = tempfile::tempdir().expect("a folder");
    let (source, out) = (dir.path().join("dataset"), dir.path().join("out"));
    write_drives(&source, &header, &[standing, single]);
    let e = run(&source, &out, FormatName::Kitti2015, OutputMode::Fresh).expect_err("refused");
    assert!(
        e.to_string()
            .contains("stations or single views of [balance]"),
        "{e}"
    );
    assert!(!out.exists());
}

#[test]
fn flow_is_the_data_sets_with_a_mask_of_ones() {
    let mut header = annotated();
    header.sequences[0].split = Some(Split::Test);
    let made = made_of_frames(FormatName::Kitti2015, &header, &[0, 1, 2, 4]);
    let table = text(made.out.join("pairs.csv"));
    let rows = "pair,sequence,frame,next_frame,split\n000000,0,0,1,test\n000001,0,1,2,test\n";
    assert_eq!(table, rows);
    assert_eq!(text(made.out.join("test.txt")), "000000\n000001\n");
    assert_eq!(text(made.out.join("train.txt")), "");
    for pair in 0..2 {
        let own = made
            .dataset
            .root()
            .join(format!("sequences/00/flow/{pair:06}.png"));
        let data = |path: &Path| png(path).2;
        let own = data(&own);
        let [occ, noc] = ["flow_occ", "flow_noc"]
            .map(|f| data(&made.out.join(format!("training/{f}/{pair:06}_10.png"))));
        let (mut of_all, mut of_seen) = (0, 0);
        for (i, own) in own.chunks(6).enumerate() {
            let (occ, noc) = (&occ[6 * i..6 * i + 6], &noc[6 * i..6 * i + 6]);
            let state = own[5];
            let kept = |keep: bool| match keep {
                true => [own[0], own[1], own[2], own[3], 0, 1],
                false => [0; 6],
            };
            assert_eq!((occ, noc), (&kept(state > 0)[..], &kept(state == 1)[..]));
            of_all += usize::from(state > 0);
            of_seen += usize::from(state == 1);
        }
        assert!(0 < of_seen && of_seen < of_all && of_all < own.len() / 6);
    }
    assert_eq!(made.done.notes, [""; 0]);
}

#[test]
fn half_of_the_benchmark_is_written_with_a_note_and_none_is_refused() {
    let exists = |out: &Path, folder: &str| out.join("training").join(folder).exists();
    let mut no_flow = annotated();
    no_flow.sequences[0].cameras[0].annotations.flow = false;
    let made = made_of_frames(FormatName::Kitti2015, &no_flow, &[0, 1]);
    let [note] = &made.done.notes[..] else {
        panic!("one note")
    };
    assert!(
        note.contains("no flow: the first camera of sequence 00"),
        "{note}"
    );
    assert!(exists(&made.out, "disp_occ_1") && !exists(&made.out, "flow_occ"));
    let mut skewed = annotated();
    skewed.sequences[0].cameras[1].intrinsics.cx += 2.0;
    let made = made_of_frames(FormatName::Kitti2015, &skewed, &[0, 1]);
    let [note] = &made.done.notes[..] else {
        panic!("one note")
    };
    assert!(
        note.contains("no disparity: cameras 'front' and 'right'"),
        "{note}"
    );
    assert!(exists(&made.out, "flow_occ") && !exists(&made.out, "image_3"));
    let mut bent_right = annotated();
    let [k1, k2, k3, k4] = [0.02, 0.003, -0.001, 0.0005];
    bent_right.sequences[0].cameras[1].intrinsics.distortion =
        Distortion::Fisheye { k1, k2, k3, k4 };
    let mut rolling_right = annotated();
    rolling_right.sequences[0].cameras[1].shutter = Shutter {
        readout_s: 0.02,
        ..Shutter::INSTANT
    };
    for (header, said) in [
        (
            bent_right,
            "no disparity: camera 'right' of sequence 00 has a lens",
        ),
        (
            rolling_right,
            "no disparity: camera 'right' of sequence 00 has a rolling shutter",
        ),
    ] {
        let made = made_of_frames(FormatName::Kitti2015, &header, &[0, 1]);
        let [note] = &made.done.notes[..] else {
            panic!("one note")
        };
        assert!(note.contains(said), "{note}");
        assert!(exists(&made.out, "flow_occ") && !exists(&made.out, "disp_occ_0"));
    }
    let calib = text(made.out.join("training/calib_cam_to_cam/000000.txt"));
    assert!(
        calib.contains("P_rect_02: ") && !calib.contains("_03: "),
        "{calib}"
    );

    let mut neither = no_flow;
    neither.sequences[0].cameras[1].name = "rear".to_owned();
    let mut bent = annotated();
    let [k1, k2, k3, k4] = [0.02, 0.003, -0.001, 0.0005];
    bent.sequences[0].cameras[0].intrinsics.distortion = Distortion::Fisheye { k1, k2, k3, k4 };
    let mut rolling = annotated();
    rolling.sequences[0].cameras[0].shutter = Shutter {
        readout_s: 0.02,
        ..Shutter::INSTANT
    };
    let dir = tempfile::tempdir().expect("a folder");
    let cases = [
        (neither, &[0, 1], "[cameras.right]"),
        (bent, &[0, 1], "camera 'front' of sequence 00 has a lens"),
        (rolling, &[0, 1], "camera.shutter.readout_ms = 0"),
        (
            annotated(),
            &[0, 2],
            "no two frames of a drive follow one another here",
        ),
    ];
    for (i, (header, frames, said)) in cases.into_iter().enumerate() {
        let source = dir.path().join(format!("dataset-{i}"));
        crate::common::write(&source, &header, frames);
        let out = dir.path().join("out");
        let e = run(&source, &out, FormatName::Kitti2015, OutputMode::Fresh).expect_err("refused");
        assert!(
            matches!(e, Error::Unsuitable { .. }) && !out.exists(),
            "{e}"
        );
        assert!(e.to_string().contains(said), "{e}");
    }
    assert!(
        run(
            &dir.path().join("dataset-0"),
            &dir.path().join("out"),
            FormatName::Kitti2015,
            OutputMode::Fresh
        )
        .expect_err("refused")
        .to_string()
        .contains("camera.flow = true")
    );
}
