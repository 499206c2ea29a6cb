//! Small data sets, by closed forms: a wall of patches in front of cameras, a scan of the same
//! wall.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nemoral_convert::{ConversionSummary, ConvertParams, Error, FormatName, OutputMode, convert};
use nemoral_dataset::{
    BalanceRecord, CameraData, CameraSpec, Dataset, DatasetHeader, EurocFiles, FrameChoice,
    FrameData, ImuSpec, LidarData, LidarSpec, OpenMode, SequenceSpec, Track, WorldTables, Writer,
};
use nemoral_scene::glam::{DVec2, DVec3, Vec2, Vec3};
use nemoral_scene::{
    AnnotationKinds, Annotations, ChunkCoord, Flow, Image, Intrinsics, LidarPoint, ObjectBox,
    ObjectId, ObjectKind, ObjectRecord, Ontology, PixelBox, PointFlags, RigidTransform, Semantic,
    Shutter, TreeRecord, TruthImages, Twist,
};

/// Where the drive begins, far from the origin as in long drives.
pub(crate) const START: DVec3 = DVec3::new(-12_345.5, 27_500.25, 3.0);

/// The tree, the rock and the shrub of every picture.
pub(crate) fn objects() -> Vec<ObjectRecord> {
    let chunk = ChunkCoord::containing(START.truncate(), 50.0);
    let kinds = [ObjectKind::Tree, ObjectKind::Rock, ObjectKind::Shrub];
    let record = |(i, &kind): (usize, &ObjectKind)| ObjectRecord {
        object: ObjectId::new(chunk, i as u16 + 1).expect("in range"),
        kind,
        species: "fagus".to_owned(),
        position_m: START,
        radius_m: 0.5,
        height_m: 2.0,
    };
    kinds.iter().enumerate().map(record).collect()
}

/// Logs that no picture shows, as in long drives: 16 chunks away from [`objects`], with the same
/// ids in instance maps.
fn twins() -> Vec<ObjectRecord> {
    let away = [(16, 0), (-16, 0), (0, 16)];
    let twin = |(seen, (dx, dy)): (ObjectRecord, (i32, i32))| {
        let chunk = seen.object.chunk().offset(dx, dy);
        let object = ObjectId::new(chunk, seen.object.item()).expect("in range");
        assert_eq!(object.to_image_id(), seen.object.to_image_id());
        ObjectRecord {
            object,
            kind: ObjectKind::Log,
            position_m: seen.position_m + 50.0 * DVec3::new(dx.into(), dy.into(), 0.0),
            ..seen
        }
    };
    objects().into_iter().zip(away).map(twin).collect()
}

/// The tree of every picture, in the second row of its table, and one in the chunk west of it.
pub(crate) fn trees() -> Vec<TreeRecord> {
    let seen = objects()[0].object;
    let chunk = seen.chunk();
    let other = ObjectId::new(ChunkCoord::new(chunk.x - 1, chunk.y), 7);
    let record = |(i, object): (u32, ObjectId)| TreeRecord {
        object,
        species: "fagus".to_owned(),
        position_m: START - DVec3::X * 40.0 * f64::from(i),
        dbh_m: 0.3,
        height_m: 20.0,
        crown_base_m: 8.0,
        crown_radius_m: 2.5,
        leaf_area_m2: 100.0,
        stem_volume_m3: 0.7,
        wood_volume_m3: None,
        merchantable_volume_m3: None,
        lean_rad: 0.0,
        age_class: "middle".to_owned(),
        alive: true,
        field_id: String::new(),
    };
    let ids = [seen, other.expect("in range")];
    (0..).zip(ids).map(record).collect()
}

pub(crate) fn header() -> DatasetHeader {
    let optical = RigidTransform::body_from_optical();
    let mount = |y| RigidTransform::from_xyz_rpy(DVec3::new(0.3, y, 1.3), 0.01, 0.05, 0.02);
    let camera = |name: &str, y| CameraSpec {
        name: name.to_owned(),
        intrinsics: Intrinsics::from_fov(31, 22, 1.3).expect("valid"),
        body_from_camera: mount(y) * optical,
        annotations: AnnotationKinds::default(),
        shutter: Shutter::INSTANT,
        noisy: false,
        processed: false,
    };
    let mut header = DatasetHeader::new("nemoral", "0.1.0", 7, Ontology::paper());
    header.licence = "CC-BY-4.0".to_owned();
    let sequence = &mut header.sequences[0];
    sequence.cameras = vec![camera("front", 0.0), camera("right", -0.5)];
    sequence.lidars = vec![LidarSpec {
        name: "top".to_owned(),
        body_from_lidar: mount(0.1),
        deskewed: true,
        pointing_errors: false,
        ply: true,
    }];
    header
}

/// The usual [`header`], whose sequence has one more LiDAR for each mount.
pub(crate) fn with_lidars(mounts: &[RigidTransform]) -> DatasetHeader {
    let mut header = header();
    let usual = header.sequences[0].lidars[0].clone();
    let further = |(i, mount): (usize, &RigidTransform)| LidarSpec {
        name: format!("lidar_{i}"),
        body_from_lidar: *mount,
        ..usual.clone()
    };
    let further = mounts.iter().enumerate().map(further);
    header.sequences[0].lidars.extend(further);
    header
}

/// The body's time and pose at a frame.
pub(crate) fn pose(frame: u64) -> (f64, RigidTransform) {
    let time_s = 0.5 * frame as f64 + 0.25;
    (time_s, pose_at(time_s))
}

/// The body's pose at a time.
pub(crate) fn pose_at(time_s: f64) -> RigidTransform {
    let k = 2.0 * (time_s - 0.25);
    let at = START + DVec3::new(0.8 * k, 0.1 * k, 0.01 * k);
    RigidTransform::from_xyz_rpy(at, 0.02 * k, -0.01 * k, 0.4 + 0.1 * k)
}

/// What a pixel, or a laser, sees: patches with and without objects, with holes.
fn seen(column: usize, row: usize, frame: u64) -> (Semantic, ObjectId) {
    let object = |i: usize| objects()[i].object;
    let x = column + frame as usize;
    match (x / 5 % 6, row / 4 % 5) {
        (_, 0) => (Semantic::Sky, ObjectId::NONE),
        (1, 1 | 2) if !(column + row).is_multiple_of(3) => (Semantic::Leaf, object(0)),
        (1, _) => (Semantic::Stem, object(0)),
        (3, 3) => (Semantic::Rock, object(1)),
        (4, 2) => (Semantic::Shrub, object(2)),
        (4, 3) => (Semantic::Grass, ObjectId::NONE),
        (5, _) => (Semantic::TrailSurface, ObjectId::NONE),
        _ => (Semantic::Litter, ObjectId::NONE),
    }
}

fn images(camera: &CameraSpec, frame: u64) -> (Image<[u8; 3]>, TruthImages) {
    let (w, h) = (
        camera.intrinsics.width as usize,
        camera.intrinsics.height as usize,
    );
    let all = Image::new(w, h, (0..w * h).map(|i| (i % w, i / w)).collect());
    let depth = |c: usize, r: usize| match seen(c, r, frame).0 {
        Semantic::Sky => 0.0,
        _ => 1.0 + c as f32 * 0.7 + r as f32 * 0.01,
    };
    let shift = camera.name.len();
    let rgb = all.map(|&(c, r)| [(c * 7 + shift) as u8, (r * 11) as u8, (c * r) as u8]);
    let normal = |c, r| {
        if depth(c, r) > 0.0 {
            -Vec3::Z
        } else {
            Vec3::ZERO
        }
    };
    let truth = TruthImages {
        semantic: all.map(|&(c, r)| seen(c, r, frame).0),
        object: all.map(|&(c, r)| seen(c, r, frame).1),
        depth_m: all.map(|&(c, r)| depth(c, r)),
        normal: all.map(|&(c, r)| normal(c, r)),
    };
    (rgb, truth)
}

/// The header of a data set that every format takes: with boxes, flow, and a rectified pair.
pub(crate) fn annotated() -> DatasetHeader {
    let mut header = header();
    let cameras = &mut header.sequences[0].cameras;
    cameras[1].body_from_camera = cameras[0].body_from_camera
        * RigidTransform {
            translation_m: DVec3::X * 0.5,
            ..RigidTransform::IDENTITY
        };
    for camera in cameras {
        camera.annotations.flow = camera.name != "right";
        camera.annotations.boxes = true;
    }
    header
}

/// The upright boxes of [`objects`] in the world, and their lengths, widths and heights.
pub(crate) fn boxes_in_world() -> Vec<(RigidTransform, DVec3)> {
    let pose = |i: f64| {
        let at = START + DVec3::new(6.0 + 3.0 * i, i - 1.0, 0.5);
        RigidTransform::from_xyz_rpy(at, 0.0, 0.0, 2.5 * i - 2.0)
    };
    let size = |i: f64| DVec3::new(1.5 + i, 0.75, 2.0 - 0.5 * i);
    (0..3).map(|i| (pose(i.into()), size(i.into()))).collect()
}

/// The share of an object that is visible, in percent, which differs by camera and frame.
pub(crate) fn visible_percent(camera: &str, object: usize, frame: u64) -> u32 {
    (37 * object as u32 + 20 * frame as u32 + camera.len() as u32) % 101
}

/// Further truth, as far as a camera is asked for it. Only the first camera sees the shrub's box,
/// and none does in frame 2.
fn annotations(camera: &CameraSpec, frame: u64) -> Annotations {
    let (_, truth) = images(camera, frame);
    let camera_from_world = (pose(frame).1 * camera.body_from_camera).inverse();
    let boxed = |(i, (world_from_box, size_m)): (usize, (RigidTransform, DVec3))| {
        let camera_from_box = camera_from_world * world_from_box;
        let is_seen = i < 2 || camera.name == "front" && frame != 2;
        let visible_px = visible_percent(&camera.name, i, frame);
        is_seen.then_some(ObjectBox {
            object: objects()[i].object,
            kind: objects()[i].kind,
            visible: (visible_px > 0).then_some(PixelBox::EMPTY.with(1, 2)),
            whole: PixelBox::EMPTY.with(1, 2),
            visible_px,
            whole_px: 100,
            centre_m: camera_from_box.translation_m,
            size_m,
            camera_from_box: camera_from_box.rotation,
        })
    };
    let boxes = boxes_in_world().into_iter().enumerate().filter_map(boxed);
    let (w, h) = (truth.depth_m.width(), truth.depth_m.height());
    let flow = |i: usize| {
        let (c, r) = (i % w, i / w);
        (*truth.depth_m.at(c, r) > 0.0).then(|| Flow {
            offset_px: Vec2::new(0.25 * c as f32 - 3.0, 1.5 - 0.125 * r as f32),
            seen: !(c + r).is_multiple_of(4),
        })
    };
    let asked = camera.annotations;
    Annotations {
        flow: (asked.flow).then(|| Image::new(w, h, (0..w * h).map(flow).collect())),
        trunks: None,
        boxes: asked.boxes.then(|| boxes.collect()),
    }
}

/// A point on the ray of each second pixel of the first camera of a sequence.
fn scan_of(spec: &SequenceSpec, frame: u64) -> Vec<LidarPoint> {
    let (camera, lidar) = (&spec.cameras[0], &spec.lidars[0]);
    let lidar_from_camera = lidar.body_from_lidar.inverse() * camera.body_from_camera;
    let k = camera.intrinsics;
    let point = |pulse: u32| {
        let (column, row) = (2 * pulse % k.width, 2 * pulse / k.width);
        let at = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
        let range = 3.0 + 0.05 * f64::from(pulse);
        let position = lidar_from_camera.transform_point(k.direction(at) * range);
        let (semantic, object) = seen(column as usize, row as usize, frame);
        LidarPoint {
            position_m: position.as_vec3(),
            true_range_m: position.length() as f32,
            range_m: position.length() as f32,
            intensity: 0.001 * pulse as f32,
            reflectivity: (pulse % 150) as u8,
            semantic,
            object,
            ring: (pulse % 16) as u8,
            return_number: 1 + (pulse % 2) as u8,
            returns: 2,
            time_ns: 1_000 * i64::from(pulse) - 50_000,
            pulse,
            incidence_cos: 0.5,
            normal: Vec3::X,
            flags: PointFlags(0),
        }
    };
    (0..k.width * k.height / 2).map(point).collect()
}

/// The same of the first sequence.
pub(crate) fn scan(header: &DatasetHeader, frame: u64) -> Vec<LidarPoint> {
    scan_of(&header.sequences[0], frame)
}

/// Frames of a drive of five.
#[derive(Clone, Debug)]
pub(crate) struct Drive<'a> {
    pub(crate) sequence: u32,
    pub(crate) frames: &'a [u64],
    /// What is added to the times of [`pose`].
    pub(crate) later_s: f64,
    /// How many chunks the sensors' is from the one that the body is in.
    pub(crate) chunks_away: i32,
    pub(crate) stands: bool,
    pub(crate) lines: Vec<u64>,
    pub(crate) balance: Option<BalanceRecord>,
}

impl<'a> Drive<'a> {
    pub(crate) fn of(sequence: u32, frames: &'a [u64]) -> Self {
        Self {
            sequence,
            frames,
            later_s: 0.0,
            chunks_away: 0,
            stands: false,
            lines: Vec::new(),
            balance: None,
        }
    }
}

/// Writes frames of a drive of five.
pub(crate) fn write(out: &Path, header: &DatasetHeader, frames: &[u64]) -> Dataset {
    write_of(out, header, frames, images)
}

/// The same with pictures of something else.
pub(crate) fn write_of(
    out: &Path,
    header: &DatasetHeader,
    frames: &[u64],
    images: impl Fn(&CameraSpec, u64) -> (Image<[u8; 3]>, TruthImages),
) -> Dataset {
    let writer = Writer::create(out, OpenMode::Fresh, header.clone()).expect("create");
    write_drive(&writer, header, &Drive::of(0, frames), images);
    writer.finish().expect("finish");
    Dataset::open(out).expect("open")
}

/// The same of several drives.
pub(crate) fn write_drives(out: &Path, header: &DatasetHeader, drives: &[Drive<'_>]) -> Dataset {
    let writer = Writer::create(out, OpenMode::Fresh, header.clone()).expect("create");
    for drive in drives {
        write_drive(&writer, header, drive, images);
    }
    writer.finish().expect("finish");
    Dataset::open(out).expect("open")
}

fn write_drive(
    writer: &Writer,
    header: &DatasetHeader,
    drive: &Drive<'_>,
    images: impl Fn(&CameraSpec, u64) -> (Image<[u8; 3]>, TruthImages),
) {
    let spec = header.sequence(drive.sequence).expect("a sequence");
    let pose = |index: u64| {
        let (time_s, world_from_body) = pose(index);
        (time_s + drive.later_s, world_from_body)
    };
    for &index in drive.frames {
        let (time_s, world_from_body) = pose(index);
        let seen: Vec<_> = spec.cameras.iter().map(|c| images(c, index)).collect();
        let annotations: Vec<_> = (spec.cameras.iter())
            .map(|c| annotations(c, index))
            .collect();
        let points = if spec.lidars.is_empty() {
            Vec::new()
        } else if spec.cameras.is_empty() {
            scan(&self::header(), index)
        } else {
            scan_of(spec, index)
        };
        let inside = ChunkCoord::containing(world_from_body.translation_m.truncate(), 50.0);
        let frame = FrameData {
            sequence: drive.sequence,
            index,
            time_s,
            world_from_body,
            body_motion: Twist::STILL,
            balance: drive.balance.as_ref().map(|of| FrameChoice {
                candidate: None,
                shares: vec![0.0; of.targets.len()],
            }),
            cameras: (spec.cameras.iter().zip(&seen).zip(&annotations))
                .map(|((spec, (rgb, truth)), annotations)| CameraData {
                    name: &spec.name,
                    rgb,
                    radiance: None,
                    truth,
                    annotations,
                })
                .collect(),
            lidars: (spec.lidars.iter())
                .map(|l| LidarData {
                    name: &l.name,
                    points: &points,
                    sensor_chunk: ChunkCoord::new(inside.x + drive.chunks_away, inside.y),
                })
                .collect(),
            frame_key: [index as u8; 32],
        };
        writer.write_frame(&frame).expect("frame");
    }
    let track = Track {
        sequence: drive.sequence,
        poses: (0..5).map(pose).collect(),
        balance: drive.balance.clone(),
        stands: drive.stands,
        estimated: (0..if spec.has_estimated_poses { 5 } else { 0 })
            .map(estimated)
            .collect(),
        lines: drive.lines.clone(),
        imu: spec.imu.as_ref().map(imu_files),
    };
    let (trees, objects) = (trees(), [objects(), twins()].concat());
    let world = WorldTables {
        trees: &trees,
        objects: &objects,
        deadwood: &[],
    };
    writer.write_sequence(&track, &world).expect("tables");
}

/// What a navigation system makes of a frame's pose, if there is one: 10 cm too high.
pub(crate) fn estimated(index: u64) -> RigidTransform {
    let mut pose = pose(index).1;
    pose.translation_m.z += 0.1;
    pose
}

/// The true velocity of the unit of [`imu_files`], m/s.
pub(crate) const UNIT_VELOCITY_M_S: DVec3 = DVec3::new(0.1, 0.2, 0.3);

/// What a unit says of the drive of five, twenty times a second: the times of its readings are its
/// angular rates, and its true poses are those of the body with its mount.
fn imu_files(unit: &ImuSpec) -> EurocFiles {
    let mut files = EurocFiles {
        sensor: "gyroscope_noise_density: 0.00016968 # rad / s / sqrt(Hz)\n\
                 gyroscope_random_walk: 0.000019393 # rad / s^2 / sqrt(Hz)\n\
                 accelerometer_noise_density: 0.002 # m / s^2 / sqrt(Hz)\n\
                 accelerometer_random_walk: 0.003 # m / s^3 / sqrt(Hz)\n"
            .to_owned(),
        ..EurocFiles::default()
    };
    let mut time_ns = 0_i64;
    while time_ns as f64 * 1e-9 <= pose(4).0 {
        let true_pose = pose_at(time_ns as f64 * 1e-9) * unit.body_from_imu;
        let (p, q, v) = (
            true_pose.translation_m,
            true_pose.rotation,
            UNIT_VELOCITY_M_S,
        );
        let _ = writeln!(files.samples, "{time_ns},{time_ns},0,0.5,0,0.25,9.75");
        let _ = writeln!(
            files.states,
            "{time_ns},{},{},{},{},{},{},{},{},{},{},0,0,0.01,0,0,0.02",
            p.x, p.y, p.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z
        );
        time_ns += 50_000_000;
    }
    files
}

/// A data set of frames 1, 2 and 4, converted.
pub(crate) struct Made {
    _folder: tempfile::TempDir,
    pub(crate) dataset: Dataset,
    pub(crate) out: PathBuf,
    pub(crate) done: ConversionSummary,
}

pub(crate) fn made(format: FormatName) -> Made {
    made_of(format, &header())
}

pub(crate) fn made_of(format: FormatName, header: &DatasetHeader) -> Made {
    made_of_frames(format, header, &[1, 2, 4])
}

/// A data set of some frames, converted.
pub(crate) fn made_of_frames(format: FormatName, header: &DatasetHeader, frames: &[u64]) -> Made {
    made_of_drives(format, header, &[Drive::of(0, frames)])
}

/// A data set of some drives, converted.
pub(crate) fn made_of_drives(
    format: FormatName,
    header: &DatasetHeader,
    drives: &[Drive<'_>],
) -> Made {
    let folder = tempfile::tempdir().expect("a folder");
    let source = folder.path().join("dataset");
    let dataset = write_drives(&source, header, drives);
    let out = folder.path().join("out");
    let done = run(&source, &out, format, OutputMode::Fresh).expect("converted");
    Made {
        _folder: folder,
        dataset,
        out,
        done,
    }
}

pub(crate) fn run(
    source: &Path,
    out: &Path,
    format: FormatName,
    mode: OutputMode,
) -> Result<ConversionSummary, Error> {
    let params = ConvertParams {
        mode,
        ..ConvertParams::new(format)
    };
    convert(source, out, &params)
}

/// Every file below a folder with its bytes.
pub(crate) fn tree(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let bytes = std::fs::read(&path).expect("a file");
                files.insert(path.strip_prefix(root).expect("below").to_owned(), bytes);
            }
        }
    }
    files
}

pub(crate) fn text(path: impl AsRef<Path>) -> String {
    let path = path.as_ref();
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The numbers of each line that is no comment.
pub(crate) fn numbers(text: &str) -> Vec<Vec<f64>> {
    let lines = text.lines().filter(|l| !l.starts_with('#'));
    let words = |l: &str| -> Vec<f64> {
        l.split_whitespace()
            .filter_map(|w| w.parse().ok())
            .collect()
    };
    lines.map(words).collect()
}

/// The samples of a PNG: width, height, channels × bytes, data.
pub(crate) fn png(path: impl AsRef<Path>) -> (usize, usize, Vec<u8>) {
    let file = std::fs::File::open(path.as_ref()).expect("a picture");
    let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().expect("a PNG");
    let mut data = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut data).expect("pixels");
    (info.width as usize, info.height as usize, data)
}
