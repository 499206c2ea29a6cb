//! The data sets that are mutated: the two shards of a drive of two frames, with tiny files of
//! every kind.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::Path;

use nemoral_dataset::{
    CameraData, CameraSpec, DatasetHeader, DepthFormat, FrameData, LidarData, LidarSpec, OpenMode,
    SequenceSpec, Track, WorldTables, Writer,
};
use nemoral_scene::glam::{DQuat, DVec2, DVec3, Vec2, Vec3};
use nemoral_scene::{
    AnnotationKinds, Annotations, ChunkCoord, Flow, Image, Intrinsics, LidarPoint, ObjectBox,
    ObjectId, ObjectKind, ObjectRecord, Ontology, PixelBox, PointFlags, RigidTransform, Semantic,
    Shutter, TreeRecord, TruthImages, Twist,
};

use crate::scratch::Scratch;

/// The files below a folder, by their names in it, with forward slashes.
pub type Files = BTreeMap<String, Vec<u8>>;

/// Columns and rows of the pictures.
const SIZE: (u32, u32) = (12, 8);
/// Frames of the drive.
const FRAMES: u64 = 2;
/// Depth of every pixel, metres.
const DEPTH_M: f32 = 4.0;

/// Reads a folder.
///
/// # Panics
/// If it cannot be read.
#[must_use]
pub fn files(root: &Path) -> Files {
    let mut found = Files::new();
    let mut folders = vec![String::new()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root.join(&folder)).expect("a folder") {
            let entry = entry.expect("an entry");
            let name = entry.file_name().into_string().expect("a plain name");
            let inner = if folder.is_empty() {
                name
            } else {
                format!("{folder}/{name}")
            };
            if entry.file_type().expect("a kind").is_dir() {
                folders.push(inner);
            } else {
                let bytes = fs::read(root.join(&inner)).expect("a file");
                found.insert(inner, bytes);
            }
        }
    }
    found
}

/// The files of the two shards.
#[must_use]
pub fn shards() -> [Files; 2] {
    let scratch = Scratch::new();
    [0..1, 1..2].map(|frames| {
        let out = scratch.path().join(format!("{}", frames.start));
        write_shard(&out, DepthFormat::Png16, frames);
        files(&out)
    })
}

/// Writes frames of the drive.
///
/// # Panics
/// If they cannot be written.
pub fn write_shard(out: &Path, depth: DepthFormat, frames: Range<u64>) {
    let header = header(depth);
    let writer = Writer::create(out, OpenMode::Fresh, header.clone()).expect("a new folder");
    for index in frames {
        write_frame(&writer, &header, index);
    }
    let (trees, objects) = (vec![tree()], vec![object()]);
    let world = WorldTables {
        trees: &trees,
        objects: &objects,
        deadwood: &[],
    };
    let poses: Vec<_> = (0..FRAMES).map(|k| (0.5 * k as f64, pose())).collect();
    let track = Track {
        sequence: 0,
        poses,
        balance: None,
        stands: false,
        estimated: vec![pose(); FRAMES as usize],
        lines: Vec::new(),
        imu: None,
    };
    writer.write_sequence(&track, &world).expect("a sequence");
    writer.finish().expect("a whole data set");
}

/// The robot stands still, so that the flow is 0.
fn pose() -> RigidTransform {
    RigidTransform::from_xyz_rpy(DVec3::new(120.0, -30.0, 2.0), 0.0, 0.1, 0.2)
}

fn chunk() -> ChunkCoord {
    ChunkCoord::containing(DVec2::new(120.0, -30.0), 50.0)
}

fn id() -> ObjectId {
    ObjectId::new(chunk(), 7).expect("in range")
}

fn header(depth_format: DepthFormat) -> DatasetHeader {
    let mount = |x| RigidTransform::from_xyz_rpy(DVec3::new(x, 0.0, 1.0), 0.0, 0.0, 0.0);
    let lidar = |name: &str, x| LidarSpec {
        name: name.to_owned(),
        body_from_lidar: mount(x),
        deskewed: true,
        pointing_errors: false,
        ply: true,
    };
    let sequence = SequenceSpec {
        depth_format,
        has_estimated_poses: true,
        cameras: vec![CameraSpec {
            name: "front".to_owned(),
            intrinsics: Intrinsics::from_fov(SIZE.0, SIZE.1, 1.2).expect("valid"),
            body_from_camera: mount(0.2) * RigidTransform::body_from_optical(),
            annotations: AnnotationKinds {
                sky: true,
                flow: true,
                trunks: true,
                boxes: true,
                radiance: true,
            },
            shutter: Shutter::INSTANT,
            noisy: true,
            processed: true,
        }],
        lidars: vec![lidar("top", 0.1), lidar("rear", -0.3)],
        stage_keys: BTreeMap::from([("terrain".to_owned(), "0f".repeat(32))]),
        config: serde_json::json!({ "placement": { "trees": 60 } }).into(),
        config_toml: "[placement]\ntrees = 60\n".to_owned(),
        ..SequenceSpec::new(0, 7)
    };
    DatasetHeader {
        licence: "CC-BY-4.0".to_owned(),
        config_toml: "[placement]\ntrees = 60\n".to_owned(),
        sequences: vec![sequence],
        ..DatasetHeader::new("nemoral", "0.1.0", 7, Ontology::paper())
    }
}

fn write_frame(writer: &Writer, header: &DatasetHeader, index: u64) {
    let (w, h) = (SIZE.0 as usize, SIZE.1 as usize);
    // Sky above, a trunk in the middle, the ground beside it.
    let part = |i: usize| match (i % w, i / w) {
        (_, 0) => Semantic::Sky,
        (5 | 6, _) => Semantic::Stem,
        _ => Semantic::Litter,
    };
    let parts = Image::new(w, h, (0..w * h).map(part).collect());
    let owner = |s: &Semantic| {
        if *s == Semantic::Stem {
            id()
        } else {
            ObjectId::NONE
        }
    };
    let there = |s: &Semantic| *s != Semantic::Sky;
    let truth = TruthImages {
        object: parts.map(owner),
        depth_m: parts.map(|s| if there(s) { DEPTH_M } else { 0.0 }),
        normal: parts.map(|s| if there(s) { -Vec3::Z } else { Vec3::ZERO }),
        semantic: parts,
    };
    let still = Flow {
        offset_px: Vec2::ZERO,
        seen: true,
    };
    let seen = PixelBox::EMPTY.with(5, 1).with(6, h as u32 - 1);
    let annotations = Annotations {
        flow: Some(truth.semantic.map(|s| there(s).then_some(still))),
        trunks: Some(truth.object.clone()),
        boxes: Some(vec![ObjectBox {
            object: id(),
            kind: ObjectKind::Tree,
            visible: Some(seen),
            whole: seen,
            visible_px: 2 * (SIZE.1 - 1),
            whole_px: 2 * (SIZE.1 - 1),
            centre_m: DVec3::new(0.0, 0.0, 4.2),
            size_m: DVec3::new(0.4, 0.4, 9.0),
            camera_from_box: DQuat::from_rotation_x(1.5),
        }]),
    };
    let rgb = truth
        .depth_m
        .map(|z| [(20.0 * z) as u8 + index as u8, 90, 40]);
    let radiance = rgb.map(|c| Vec3::from_array(c.map(|c| 0.5 * f32::from(c))));
    let points: Vec<LidarPoint> = (0..6).map(point).collect();
    let lidar = |spec| LidarData {
        name: spec,
        points: &points,
        sensor_chunk: chunk(),
    };
    let frame = FrameData {
        sequence: 0,
        index,
        time_s: 0.5 * index as f64,
        world_from_body: pose(),
        body_motion: Twist::STILL,
        balance: None,
        cameras: vec![CameraData {
            name: "front",
            rgb: &rgb,
            radiance: Some(&radiance),
            truth: &truth,
            annotations: &annotations,
        }],
        lidars: header.sequences[0]
            .lidars
            .iter()
            .map(|l| lidar(&l.name))
            .collect(),
        frame_key: [index as u8; 32],
    };
    writer.write_frame(&frame).expect("a frame of the header's");
}

fn point(i: u32) -> LidarPoint {
    let on_trunk = i.is_multiple_of(2);
    LidarPoint {
        position_m: Vec3::new(DEPTH_M, 0.1 * i as f32, -0.2),
        true_range_m: DEPTH_M,
        range_m: DEPTH_M + 0.01,
        intensity: 0.3,
        reflectivity: 60,
        semantic: if on_trunk {
            Semantic::Stem
        } else {
            Semantic::Litter
        },
        object: if on_trunk { id() } else { ObjectId::NONE },
        ring: i as u8,
        return_number: 1,
        returns: 1,
        time_ns: 4_000 * i64::from(i) - 40_000,
        pulse: i,
        incidence_cos: 0.9,
        normal: -Vec3::X,
        flags: PointFlags(if i == 3 { PointFlags::MIXED } else { 0 }),
    }
}

fn object() -> ObjectRecord {
    ObjectRecord {
        object: id(),
        kind: ObjectKind::Tree,
        species: "fagus, \"purpurea\"".to_owned(),
        position_m: DVec3::new(124.0, -30.0, 1.5),
        radius_m: 0.2,
        height_m: 9.0,
    }
}

fn tree() -> TreeRecord {
    let o = object();
    TreeRecord {
        object: o.object,
        species: o.species,
        position_m: o.position_m,
        dbh_m: 0.31,
        height_m: o.height_m,
        crown_base_m: 3.0,
        crown_radius_m: 2.0,
        leaf_area_m2: 40.0,
        stem_volume_m3: 0.3,
        wood_volume_m3: None,
        merchantable_volume_m3: None,
        lean_rad: 0.02,
        age_class: "young".to_owned(),
        alive: true,
        field_id: String::new(),
    }
}
