//! A small analytic world, ray-cast by closed forms: a ground with a trail, and spheres.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nemoral_dataset::{
    CameraData, CameraSpec, Cloud, CloudParams, CloudPoint, Dataset, DatasetHeader, Error,
    FrameData, LidarData, LidarSpec, Manifest, OpenMode, SequenceSpec, Track, WorldTables, Writer,
};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{
    AnnotationKinds, Annotations, ChunkCoord, Flow, Image, Intrinsics, LidarPoint, ObjectBox,
    ObjectId, ObjectKind, ObjectRecord, Ontology, PixelBox, PointFlags, RigidTransform, Semantic,
    Shutter, TreeRecord, TruthImages, Twist,
};

pub(crate) const CHUNK_M: f64 = 50.0;
/// The start of the drive, in the middle of a far chunk.
pub(crate) const START: DVec3 = DVec3::new(-125.0, 275.0, 0.0);

pub(crate) struct Sphere {
    pub(crate) centre: DVec3,
    pub(crate) radius: f64,
    pub(crate) semantic: Semantic,
    pub(crate) object: ObjectId,
    pub(crate) kind: ObjectKind,
}

pub(crate) fn spheres() -> Vec<Sphere> {
    let mut all = Vec::new();
    let mut add = |x: f64, y: f64, z: f64, radius: f64, semantic, kind, item| {
        let centre = START + DVec3::new(x, y, z);
        let chunk = ChunkCoord::containing(centre.truncate(), CHUNK_M);
        let object = ObjectId::new(chunk, item).expect("in range");
        all.push(Sphere {
            centre,
            radius,
            semantic,
            object,
            kind,
        });
    };
    add(7.0, 2.5, 1.5, 1.2, Semantic::Stem, ObjectKind::Tree, 1);
    add(7.0, 2.5, 3.9, 1.6, Semantic::Leaf, ObjectKind::Tree, 1);
    add(10.0, -3.0, 1.8, 1.5, Semantic::Stem, ObjectKind::Tree, 2);
    add(12.0, -3.5, 4.5, 2.0, Semantic::Needle, ObjectKind::Tree, 2);
    add(16.0, 1.0, 2.0, 3.0, Semantic::Rock, ObjectKind::Rock, 3);
    add(6.0, -2.0, 0.5, 0.8, Semantic::Shrub, ObjectKind::Shrub, 4);
    add(9.0, 5.5, 0.6, 0.9, Semantic::Fern, ObjectKind::Shrub, 5);
    all
}

pub(crate) struct Hit {
    pub(crate) t: f64,
    pub(crate) normal: DVec3,
    pub(crate) semantic: Semantic,
    pub(crate) object: ObjectId,
}

/// The nearest surface on a ray of the world.
pub(crate) fn cast(world: &[Sphere], origin: DVec3, direction: DVec3) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    let mut offer = |hit: Hit| {
        if hit.t > 0.0 && hit.t < 100.0 && best.as_ref().is_none_or(|b| hit.t < b.t) {
            best = Some(hit);
        }
    };
    if direction.z < 0.0 {
        let t = -origin.z / direction.z;
        let on_trail = (origin.y + t * direction.y - START.y).abs() < 1.0;
        offer(Hit {
            t,
            normal: DVec3::Z,
            semantic: if on_trail {
                Semantic::TrailSurface
            } else {
                Semantic::Litter
            },
            object: ObjectId::NONE,
        });
    }
    for s in world {
        let to = origin - s.centre;
        let (b, c) = (to.dot(direction), to.length_squared() - s.radius * s.radius);
        let d = b * b - c;
        if d > 0.0 {
            let t = -b - d.sqrt();
            offer(Hit {
                t,
                normal: (to + t * direction) / s.radius,
                semantic: s.semantic,
                object: if s.semantic == Semantic::Fern {
                    ObjectId::NONE
                } else {
                    s.object
                },
            });
        }
    }
    best
}

pub(crate) fn header() -> DatasetHeader {
    DatasetHeader {
        generator: "nemoral".to_owned(),
        version: "0.1.0".to_owned(),
        seed: u64::MAX - 6,
        backend: "cpu".to_owned(),
        licence: "CC-BY-4.0".to_owned(),
        ontology: Ontology::paper(),
        sequences: vec![sequence(0)],
        config_toml: "[placement]\ndensity = 0.1\n".to_owned(),
        input_files: BTreeMap::new(),
    }
}

/// A header as an opened data set has it: the configs of sequences are read when asked for.
pub(crate) fn opened(header: &DatasetHeader) -> DatasetHeader {
    let mut header = header.clone();
    for sequence in &mut header.sequences {
        sequence.config_toml.clear();
    }
    header
}

/// A sequence in this world.
pub(crate) fn sequence(number: u32) -> SequenceSpec {
    let optical = RigidTransform::body_from_optical();
    let mount = |x, y, z| RigidTransform::from_xyz_rpy(DVec3::new(x, y, z), 0.0, 0.05, 0.02);
    SequenceSpec {
        chunk_size_m: CHUNK_M,
        cameras: vec![CameraSpec {
            name: "front".to_owned(),
            intrinsics: Intrinsics::from_fov(320, 240, 1.3).expect("valid"),
            body_from_camera: mount(0.25, 0.05, 1.3) * optical,
            annotations: AnnotationKinds::default(),
            shutter: Shutter::INSTANT,
            noisy: false,
            processed: false,
        }],
        lidars: vec![LidarSpec {
            name: "top".to_owned(),
            body_from_lidar: mount(0.2, 0.0, 1.4),
            deskewed: true,
            pointing_errors: false,
            ply: true,
        }],
        stage_keys: BTreeMap::from([("terrain".to_owned(), "00ff".repeat(16))]),
        config: serde_json::json!({
            "placement": { "density": 0.1, "species": ["fagus"] },
            "lidar": { "pulses": 20_000 },
        })
        .into(),
        config_toml: "[placement]\ndensity = 0.1\n".to_owned(),
        ..SequenceSpec::new(number, u64::MAX - 6)
    }
}

pub(crate) fn track(frames: usize) -> Track {
    let pose = |k: usize| {
        let k = k as f64;
        let at = START + DVec3::new(0.3 * k, 0.05 * k, 0.0);
        (
            0.5 * k,
            RigidTransform::from_xyz_rpy(at, 0.01 * k, 0.0, 0.02 * k),
        )
    };
    Track {
        sequence: 0,
        poses: (0..frames).map(pose).collect(),
        balance: None,
        stands: false,
        estimated: Vec::new(),
        lines: Vec::new(),
        imu: None,
    }
}

/// How the body moves during a rolling shutter's exposure: fast enough to have a visible effect.
pub(crate) const MOTION: Twist = Twist {
    linear_m_s: DVec3::new(5.0, 0.5, 0.1),
    angular_rad_s: DVec3::new(0.1, -0.3, 0.6),
};

/// The body's motion, which is the same in all frames.
pub(crate) fn motion(header: &DatasetHeader) -> Twist {
    let rolls = header.sequences[0]
        .cameras
        .iter()
        .any(|c| c.shutter.readout_s > 0.0);
    if rolls { MOTION } else { Twist::STILL }
}

/// Where a camera is when it reads a row.
fn world_from_row(camera: &CameraSpec, world_from_body: RigidTransform, y: f64) -> RigidTransform {
    let time = camera.shutter.row_time_s(y, camera.intrinsics.height);
    let moved = MOTION.of_mounted(&camera.body_from_camera).after(time);
    world_from_body * camera.body_from_camera * moved
}

/// The sensors' data of a frame, owned.
pub(crate) struct Seen {
    pub(crate) index: u64,
    pub(crate) time_s: f64,
    pub(crate) world_from_body: RigidTransform,
    pub(crate) body_motion: Twist,
    pub(crate) rgb: Vec<Image<[u8; 3]>>,
    /// Radiance that follows the pictures.
    pub(crate) radiance: Vec<Image<Vec3>>,
    pub(crate) truth: Vec<TruthImages>,
    pub(crate) annotations: Vec<Annotations>,
    pub(crate) points: Vec<Vec<LidarPoint>>,
    pub(crate) chunk: ChunkCoord,
    pub(crate) key: [u8; 32],
}

impl Seen {
    pub(crate) fn data<'a>(&'a self, header: &'a DatasetHeader) -> FrameData<'a> {
        let images = self
            .rgb
            .iter()
            .zip(&self.radiance)
            .zip(&self.truth)
            .zip(&self.annotations)
            .zip(&header.sequences[0].cameras);
        let scans = self.points.iter().zip(&header.sequences[0].lidars);
        FrameData {
            sequence: 0,
            index: self.index,
            time_s: self.time_s,
            world_from_body: self.world_from_body,
            body_motion: self.body_motion,
            balance: None,
            cameras: images
                .map(|((((rgb, radiance), truth), annotations), c)| CameraData {
                    name: &c.name,
                    rgb,
                    radiance: c.annotations.radiance.then_some(radiance),
                    truth,
                    annotations,
                })
                .collect(),
            lidars: scans
                .map(|(points, l)| LidarData {
                    name: &l.name,
                    points,
                    sensor_chunk: self.chunk,
                })
                .collect(),
            frame_key: self.key,
        }
    }
}

/// A number in [0, 1) that depends on `i` alone.
pub(crate) fn noise(i: u64) -> f64 {
    let mut x = i.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

pub(crate) fn see(header: &DatasetHeader, frame: usize) -> Seen {
    let world = spheres();
    let (time_s, world_from_body) = track(frame + 1).poses[frame];
    let ontology = Ontology::paper();
    let (mut rgb, mut truth, mut annotations) = (Vec::new(), Vec::new(), Vec::new());
    for camera in &header.sequences[0].cameras {
        let k = camera.intrinsics;
        let (w, h) = (k.width as usize, k.height as usize);
        let pixel = |i: usize| {
            let at = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
            let d = k.direction(at);
            let world_from_camera = world_from_row(camera, world_from_body, at.y);
            let back = world_from_camera.inverse();
            let ray = world_from_camera.transform_vector(d);
            let hit = cast(&world, world_from_camera.translation_m, ray)?;
            Some((
                hit.semantic,
                hit.object,
                (hit.t * d.z) as f32,
                back.transform_vector(hit.normal).as_vec3(),
            ))
        };
        let pixels: Vec<_> = (0..w * h)
            .map(|i| pixel(i).unwrap_or((Semantic::Sky, ObjectId::NONE, 0.0, Vec3::ZERO)))
            .collect();
        let all = Image::new(w, h, pixels);
        annotations.push(extra_of(camera, frame));
        rgb.push(all.map(|p| {
            ontology
                .class(p.0)
                .colour
                .map(|c| (f32::from(c) * (0.5 - 0.5 * p.3.z)) as u8)
        }));
        truth.push(TruthImages {
            semantic: all.map(|p| p.0),
            object: all.map(|p| p.1),
            depth_m: all.map(|p| p.2),
            normal: all.map(|p| p.3),
        });
    }
    let points = header.sequences[0]
        .lidars
        .iter()
        .map(|lidar| {
            scan(
                &world,
                &(world_from_body * lidar.body_from_lidar),
                frame as u64,
            )
        })
        .collect();
    let chunk = ChunkCoord::containing(world_from_body.translation_m.truncate(), CHUNK_M);
    Seen {
        index: frame as u64,
        time_s,
        world_from_body,
        body_motion: motion(header),
        radiance: rgb.iter().map(light).collect(),
        rgb,
        truth,
        annotations,
        points,
        chunk,
        key: [frame as u8; 32],
    }
}

/// The light of a picture, as if its tone curve were a square root.
fn light(rgb: &Image<[u8; 3]>) -> Image<Vec3> {
    rgb.map(|c| Vec3::from_array(c.map(|c| 0.01 * f32::from(c) * f32::from(c))))
}

/// The further truth that a camera is asked for, by closed forms.
fn extra_of(camera: &CameraSpec, frame: usize) -> Annotations {
    let k = camera.intrinsics;
    let (w, h) = (k.width as usize, k.height as usize);
    let poses = track(frame + 2).poses;
    let [here, next] = [poses[frame].1, poses[frame + 1].1];
    let moved = MOTION.of_mounted(&camera.body_from_camera);
    // The origin and the direction of a pixel's ray.
    let ray = |i: usize| {
        let at = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
        let pose = world_from_row(camera, here, at.y);
        let direction = pose.transform_vector(k.direction(at));
        (at, pose.translation_m, direction)
    };
    let world = spheres();
    let seen = |i: usize, of: &[Sphere]| cast(of, ray(i).1, ray(i).2);
    let flow = |i: usize| {
        let (at, eye, direction) = ray(i);
        let place = eye + direction * seen(i, &world)?.t;
        let in_next = (next * camera.body_from_camera).inverse();
        let there = in_next.transform_point(place);
        let there = k.project_moving(there, &camera.shutter, &moved)?;
        let eye = world_from_row(camera, next, there.y).translation_m;
        let way = place - eye;
        let far = cast(&world, eye, way.normalize()).map_or(0.0, |h| h.t);
        let inside = there.min_element() >= 0.0 && there.x < w as f64 && there.y < h as f64;
        Some(Flow {
            offset_px: (there - at).as_vec2(),
            seen: inside && far > way.length() - 1e-6,
        })
    };
    let only = |keep: &dyn Fn(&Sphere) -> bool| -> Vec<Sphere> {
        spheres().into_iter().filter(keep).collect()
    };
    let stems = only(&|s| s.semantic == Semantic::Stem);
    let owner = |i: usize, of: &[Sphere]| seen(i, of).map_or(ObjectId::NONE, |h| h.object);
    let middle = here * camera.body_from_camera;
    let boxed = |o: ObjectRecord| {
        let alone = only(&|s| s.object == o.object && s.semantic != Semantic::Fern);
        let count = |of: &[Sphere]| {
            let mine = (0..w * h).filter(|&i| owner(i, of) == o.object);
            mine.fold((0, PixelBox::EMPTY), |(n, b), i| {
                (n + 1, b.with((i % w) as u32, (i / w) as u32))
            })
        };
        let (whole, visible) = (count(&alone), count(&world));
        (whole.0 > 0).then_some(ObjectBox {
            object: o.object,
            kind: o.kind,
            visible: (visible.0 > 0).then_some(visible.1),
            whole: whole.1,
            visible_px: visible.0,
            whole_px: whole.0,
            centre_m: middle.inverse().transform_point(o.position_m),
            size_m: DVec3::ONE,
            camera_from_box: middle.inverse().rotation,
        })
    };
    let asked = camera.annotations;
    let mut boxes: Vec<_> = if asked.boxes {
        objects().into_iter().filter_map(boxed).collect()
    } else {
        Vec::new()
    };
    boxes.sort_by_key(|b| b.object);
    let image = |asked: bool| asked.then_some(0..w * h);
    Annotations {
        flow: image(asked.flow).map(|i| Image::new(w, h, i.map(flow).collect())),
        trunks: image(asked.trunks)
            .map(|i| Image::new(w, h, i.map(|i| owner(i, &stems)).collect())),
        boxes: asked.boxes.then_some(boxes),
    }
}

fn scan(world: &[Sphere], world_from_lidar: &RigidTransform, frame: u64) -> Vec<LidarPoint> {
    let back = world_from_lidar.inverse();
    let mut points = Vec::new();
    for pulse in 0..20_000_u32 {
        let u = |k| noise(frame << 40 | u64::from(pulse) << 8 | k);
        let (yaw, pitch) = (1.2 * (u(0) - 0.5), 0.8 * (u(1) - 0.5));
        let direction = DVec3::new(
            yaw.cos() * pitch.cos(),
            yaw.sin() * pitch.cos(),
            pitch.sin(),
        );
        let ray = world_from_lidar.transform_vector(direction);
        let Some(hit) = cast(world, world_from_lidar.translation_m, ray) else {
            continue;
        };
        let incidence = -hit.normal.dot(ray);
        let range = hit.t + 0.04 * (u(2) - 0.5);
        points.push(LidarPoint {
            position_m: (direction * range).as_vec3(),
            true_range_m: hit.t as f32,
            range_m: range as f32,
            intensity: (0.4 * incidence) as f32,
            reflectivity: 60,
            semantic: hit.semantic,
            object: hit.object,
            ring: (pulse % 6) as u8,
            return_number: 1,
            returns: 1,
            time_ns: 5_000 * i64::from(pulse) - 70_000,
            pulse,
            incidence_cos: incidence as f32,
            normal: back.transform_vector(hit.normal).as_vec3(),
            flags: PointFlags(if pulse % 100 == 0 {
                PointFlags::MIXED
            } else {
                0
            }),
        });
    }
    points
}

pub(crate) fn objects() -> Vec<ObjectRecord> {
    let mut records: Vec<ObjectRecord> = Vec::new();
    for s in spheres() {
        if records.iter().all(|r| r.object != s.object) {
            records.push(ObjectRecord {
                object: s.object,
                kind: s.kind,
                species: "fagus, sylvatica \"purpurea\"".to_owned(),
                position_m: s.centre,
                radius_m: s.radius,
                height_m: 1.0 / 3.0,
            });
        }
    }
    records
}

pub(crate) fn trees() -> Vec<TreeRecord> {
    let tree = |o: &ObjectRecord| TreeRecord {
        object: o.object,
        species: o.species.clone(),
        position_m: o.position_m,
        dbh_m: 0.1 + 0.1 * f64::from(o.object.item()),
        height_m: 20.0,
        crown_base_m: 8.1,
        crown_radius_m: 2.5,
        leaf_area_m2: if o.object.item().is_multiple_of(2) {
            120.0
        } else {
            0.0
        },
        stem_volume_m3: 0.7,
        wood_volume_m3: Some(0.9),
        merchantable_volume_m3: Some(0.5),
        lean_rad: 0.0,
        age_class: "middle".to_owned(),
        alive: o.object.item().is_multiple_of(2),
        field_id: String::new(),
    };
    objects()
        .iter()
        .filter(|o| o.kind == ObjectKind::Tree)
        .map(tree)
        .collect()
}

pub(crate) fn finish(writer: Writer, length: usize) -> Manifest {
    try_finish(writer, length).expect("finish")
}

/// The same on a disk that may fail.
pub(crate) fn try_finish(writer: Writer, length: usize) -> Result<Manifest, Error> {
    let (trees, objects) = (trees(), objects());
    let world = WorldTables {
        trees: &trees,
        objects: &objects,
        deadwood: &[],
    };
    writer.write_sequence(&track(length), &world)?;
    writer.finish()
}

/// Writes frames of a drive of four.
pub(crate) fn write(out: &Path, header: &DatasetHeader, frames: &[usize]) -> Dataset {
    let writer = Writer::create(out, OpenMode::Fresh, header.clone()).expect("create");
    for &k in frames {
        writer
            .write_frame(&see(header, k).data(header))
            .expect("frame");
    }
    finish(writer, 4);
    Dataset::open(out).expect("open")
}

/// A smaller header, for tests that do not need pictures.
pub(crate) fn small() -> DatasetHeader {
    let mut header = header();
    header.sequences[0].cameras[0].intrinsics = Intrinsics::from_fov(32, 24, 1.3).expect("valid");
    header
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

/// Updates the checksum in `dataset.json` of a file that a test has changed, so that only the
/// content of the file can give the change away.
pub(crate) fn reseal(root: &Path, relative: &str) {
    let path = root.join("dataset.json");
    let mut json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).expect("read")).expect("json");
    let bytes = std::fs::read(root.join(relative)).expect("read");
    let fix = |files: &mut serde_json::Value| {
        for f in files.as_array_mut().expect("a list") {
            if f["path"] == relative {
                f["bytes"] = bytes.len().into();
                f["blake3"] = blake3::hash(&bytes).to_hex().to_string().into();
            }
        }
    };
    fix(&mut json["files"]);
    for frame in json["frames"].as_array_mut().expect("a list") {
        fix(&mut frame["files"]);
    }
    stamp(root, &mut json);
}

/// Writes a changed `dataset.json` with a valid checksum, as a stranger can do.
pub(crate) fn stamp(root: &Path, json: &mut serde_json::Value) {
    let blank = "0".repeat(64);
    json["checksum"] = blank.clone().into();
    let text = serde_json::to_string_pretty(json).expect("JSON");
    let digest = blake3::hash(text.as_bytes()).to_hex();
    let text = text.replacen(&blank, &digest, 1);
    std::fs::write(root.join("dataset.json"), text).expect("write");
}

/// The points of a data set's cloud.
pub(crate) fn cloud_points(dir: &Path, params: CloudParams) -> Result<Vec<CloudPoint>, Error> {
    let mut points = Vec::new();
    Cloud::open(dir, params)?.for_each(|point| {
        points.push(*point);
        Ok::<_, Error>(())
    })?;
    Ok(points)
}
