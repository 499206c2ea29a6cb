//! MCAP with ROS 2's messages, for Foxglove, Rerun, rosbags and `ros2 bag play`. Each sequence is a
//! bag of rosbag2:
//! ```text
//! SS/SS_0.mcap       all messages
//! SS/metadata.yaml   topics, numbers of messages, time
//! ```
//!
//! Topics, NAME being that of a sensor:
//! - `/NAME/points`: `PointCloud2` of a LiDAR; its fields are in `docs/reference/formats.md`.
//! - `/NAME/image`: `Image` of a camera, `rgb8`.
//! - `/NAME/semantic`: `Image`, `mono8`: the class.
//! - `/NAME/instance`: `Image`, `32SC1`: the object as in instance maps; 0 = none.
//! - `/NAME/depth`: `Image`, `32FC1`: planar depth, metres; +Inf where nothing is, or what is
//!   farther than the data set can say (REP 117, 118).
//! - `/NAME/camera_info`: `CameraInfo`; the first pixel's centre is (0, 0), as OpenCV has it;
//!   `right` has the baseline of its pair in `p`.
//! - `/label_info`: `LabelInfo`: the names of classes, of all pictures and scans, once.
//! - `/imu`: `Imu`, if the data set has an inertial measurement unit: angular velocity, and linear
//!   acceleration with gravity.
//! - `/tf_static`, `/tf`: sensors in `base_link`, `base_link` in `map`.
//! - `/odom`: `Odometry` of `base_link` in `map`; velocities are the inertial unit's true ones, or
//!   by differences of poses.
//!
//! Times are nanoseconds after the start of the sequence, plus a second: to tf2 a time of 0 is the
//! latest one, and scans begin before their frame's time. The stamp of a deskewed scan is its
//! frame's time, that of a raw one its own start; either is logged at its frame's time, as all else
//! of the frame is. `map` is the data set's world. A camera's frame is the optical one. A rolling
//! shutter's picture has the pose of its middle row.

mod bag;
mod cdr;
mod cloud;
mod container;
pub(super) mod imu;
pub(super) mod odometry;

use nemoral_dataset::{CameraSpec, Manifest};
use nemoral_scene::{Image, Ontology, Twist};

use crate::formats::{refuse_times_beyond, stereo};
use crate::geometry::lens;
use crate::labels::Labels;
use crate::{ClassMapping, Error, FileStream, Format, FrameRef, Sequence, Sink, Source};
use bag::Durability;
use cdr::Cdr;
use cloud::Timing;
use container::{Channel, Container, Message};
use odometry::Motion;

const MAP: &str = "map";
const BODY: &str = "base_link";
/// The frames that are no sensor's; ROS has the last one between these two (REP 105).
const FRAMES: [&str; 3] = [BODY, MAP, "odom"];
/// The channels that are not a sensor's.
const TF_STATIC: usize = 0;
const TF: usize = 1;
const ODOM: usize = 2;
const LABELS: usize = 3;
/// The channels of a camera.
const OF_CAMERA: usize = 5;

/// The format.
#[derive(Debug)]
pub(crate) struct Mcap {
    pub(crate) ontology: Option<ClassMapping>,
}

impl Mcap {
    fn labels(&self, own: &Ontology) -> Result<Labels, Error> {
        Labels::of(own, self.ontology.as_ref())?.in_bytes()
    }
}

impl Format for Mcap {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        let mut lidars = manifest.header.sequences.iter().flat_map(|s| &s.lidars);
        if lidars.any(|l| !l.ply) {
            return Err(Error::Unsuitable {
                format: "mcap",
                reason: "points/*.ply are missing, which alone have rings and times; make the \
                         data set with output.ply = true"
                    .to_owned(),
            });
        }
        refuse_times_beyond("mcap", manifest)?;
        for sequence in &manifest.header.sequences {
            let cameras = sequence.cameras.iter().map(|c| &c.name);
            let mut names = cameras.chain(sequence.lidars.iter().map(|l| &l.name));
            if let Some(name) = names.find(|name| FRAMES.contains(&name.as_str())) {
                return Err(Error::Unsuitable {
                    format: "mcap",
                    reason: format!(
                        "a sensor of sequence {:02} is called '{name}', which is a frame of the \
                         robot in ROS; call it otherwise than {}",
                        sequence.number,
                        FRAMES.map(|name| format!("'{name}'")).join(", ")
                    ),
                });
            }
        }
        self.labels(&manifest.header.ontology).map(drop)
    }

    fn notes(&self, manifest: &Manifest) -> Vec<String> {
        let mut notes = cloud::notes(manifest);
        notes.extend(stereo::notes(
            manifest,
            "its `camera_info` has no baseline (p[3] = 0), without which nodes for stereo fail",
        ));
        notes
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let labels = self.labels(source.ontology())?;
        for sequence in source.sequences() {
            let name = format!("{:02}", sequence.number);
            let file = format!("{name}_0.mcap");
            sink.stream(
                &format!("{name}-messages"),
                &format!("{name}/{file}"),
                |out| write_messages(source, &sequence, &labels, out),
            )?;
            // It comes last, so that a folder that says it is a bag has its messages.
            sink.step(&format!("{name}-metadata"), |files| {
                let metadata = metadata(source, &sequence, &file)?;
                files.put(format!("{name}/metadata.yaml"), metadata);
                Ok(String::new())
            })?;
        }
        Ok(())
    }
}

/// Writes the file of a sequence, a chunk for each frame.
fn write_messages(
    source: &Source,
    sequence: &Sequence<'_>,
    labels: &Labels,
    out: &mut FileStream,
) -> Result<(), Error> {
    let frames: Vec<_> = source.frames(sequence.number).collect();
    let times_ns: Vec<u64> = frames.iter().map(time_ns).collect();
    let all = source.imu(sequence.number)?;
    if let Some(first) = all.first().filter(|reading| reading.time_ns < 0) {
        return Err(Error::Unsuitable {
            format: "mcap",
            reason: format!(
                "the inertial unit of sequence {:02} begins {} ns before the sequence",
                sequence.number, -first.time_ns
            ),
        });
    }
    let mut readings = imu::parts(&all, &times_ns);
    let motion = Motion {
        frames: &frames,
        track: source.track(sequence.number),
        unit: sequence.imu.map(|unit| (unit, &*all)),
    };
    let timings = (0..sequence.lidars.len()).map(|l| Timing::of(source, sequence, l));
    let timings: Vec<Timing> = timings.collect::<Result<_, _>>()?;
    let mut container = Container::begin(out, cdr::schemas(), channels(sequence))?;
    for (i, frame) in frames.iter().enumerate() {
        let mut messages = Vec::new();
        if let (Some(unit), Some(readings)) = (sequence.imu, readings.next()) {
            let channel = channels(sequence).len() - 1;
            messages.extend(readings.iter().map(|r| imu::message(channel, r, unit)));
        }
        if i == 0 {
            messages.push(mounts(sequence, frame));
            messages.push(label_info(labels, frame));
        }
        messages.extend(poses(frame, motion.at(i).as_ref()));
        let mut channel = LABELS + 1;
        for (l, (lidar, &timing)) in sequence.lidars.iter().zip(&timings).enumerate() {
            let scan = source.scan(frame, l)?.ply;
            let data = cloud::message(&scan, labels, frame, (&lidar.name, timing))?;
            messages.push(message(channel, frame, data));
            channel += 1;
        }
        for c in 0..sequence.cameras.len() {
            let data = pictures(source, (sequence, frame), c, labels)?;
            let all = data.into_iter().zip(channel..);
            messages.extend(all.map(|(data, channel)| message(channel, frame, data)));
            channel += OF_CAMERA;
        }
        messages.sort_by_key(|message| message.time_ns);
        container.chunk(&messages)?;
    }
    container.finish()
}

/// `metadata.yaml` of a sequence whose messages are in `file`.
fn metadata(source: &Source, sequence: &Sequence<'_>, file: &str) -> Result<String, Error> {
    let mut times_ns: Vec<u64> = source
        .frames(sequence.number)
        .map(|f| time_ns(&f))
        .collect();
    let frames = times_ns.len();
    let readings = source.imu(sequence.number)?;
    let parts: Vec<_> = imu::parts(&readings, &times_ns).collect();
    let readings: usize = parts.iter().map(|part| part.len()).sum();
    times_ns.extend(parts.iter().copied().flatten().map(imu::time_ns));
    // Mounts and classes are told once, all else at each frame, but readings.
    let count = |i, channel: &Channel| match i {
        TF_STATIC | LABELS => frames.min(1),
        _ if channel.topic == imu::TOPIC => readings,
        _ => frames,
    };
    let topics: Vec<_> = (channels(sequence).into_iter().enumerate())
        .map(|(i, channel)| (count(i, &channel), channel))
        .map(|(count, channel)| (channel, count))
        .collect();
    let span = times_ns.iter().min().zip(times_ns.iter().max());
    Ok(bag::metadata(file, &topics, span.map(|(a, b)| (*a, *b))))
}

/// The time of a sequence's start, nanoseconds.
pub(super) const START_NS: u64 = 1_000_000_000;

/// The time of a frame.
fn time_ns(frame: &FrameRef<'_>) -> u64 {
    stamp_ns(frame.time_s)
}

/// A time of a sequence, which is not before its start, nanoseconds.
pub(super) fn stamp_ns(time_s: f64) -> u64 {
    START_NS.saturating_add((time_s * 1e9).round() as u64)
}

fn message(channel: usize, frame: &FrameRef<'_>, data: Vec<u8>) -> Message {
    let time_ns = time_ns(frame);
    Message {
        channel,
        time_ns,
        data,
    }
}

/// The topics of a sequence: those of the robot, then those of each LiDAR, of each camera, and that
/// of the inertial measurement unit.
fn channels(sequence: &Sequence<'_>) -> Vec<Channel> {
    let channel = |topic: String, schema, durability| Channel {
        topic,
        schema,
        qos: bag::offered_qos(durability),
    };
    let once = |topic, schema| channel(topic, schema, Durability::TransientLocal);
    let stream = |topic, schema| channel(topic, schema, Durability::Volatile);
    let mut all = vec![
        once("/tf_static".to_owned(), cdr::TF),
        stream("/tf".to_owned(), cdr::TF),
        stream("/odom".to_owned(), cdr::ODOMETRY),
        once("/label_info".to_owned(), cdr::LABEL_INFO),
    ];
    for lidar in sequence.lidars {
        all.push(stream(format!("/{}/points", lidar.name), cdr::POINT_CLOUD));
    }
    for camera in sequence.cameras {
        let name = &camera.name;
        all.push(stream(image_topic(name), cdr::IMAGE));
        all.push(stream(format!("/{name}/semantic"), cdr::IMAGE));
        all.push(stream(format!("/{name}/instance"), cdr::IMAGE));
        all.push(stream(format!("/{name}/depth"), cdr::IMAGE));
        all.push(stream(format!("/{name}/camera_info"), cdr::CAMERA_INFO));
    }
    if sequence.imu.is_some() {
        all.push(stream(imu::TOPIC.to_owned(), cdr::IMU));
    }
    all
}

/// The topic of a camera's pictures.
pub(super) fn image_topic(camera: &str) -> String {
    format!("/{camera}/image")
}

/// Where the sensors are on the robot.
fn mounts(sequence: &Sequence<'_>, frame: &FrameRef<'_>) -> Message {
    let lidars = sequence
        .lidars
        .iter()
        .map(|l| (&*l.name, &l.body_from_lidar));
    let cameras = sequence
        .cameras
        .iter()
        .map(|c| (&*c.name, &c.body_from_camera));
    let imu = sequence.imu.map(|unit| (imu::FRAME, &unit.body_from_imu));
    let all: Vec<_> = lidars.chain(cameras).chain(imu).collect();
    let mut out = Cdr::new();
    out.u32(all.len() as u32);
    for (name, mount) in all {
        out.header(time_ns(frame), BODY).text(name).pose(mount);
    }
    message(TF_STATIC, frame, out.finish())
}

/// `LabelInfo`: the names of classes, which are those of all pictures and scans. Its threshold is
/// for the confidence of guesses, and these are none.
fn label_info(labels: &Labels, frame: &FrameRef<'_>) -> Message {
    let mut out = Cdr::new();
    out.header(time_ns(frame), BODY)
        .u32(labels.classes.len() as u32);
    for class in &labels.classes {
        out.u16(class.id).text(&class.name);
    }
    let threshold = 0.0_f32;
    out.u32(threshold.to_bits());
    message(LABELS, frame, out.finish())
}

/// Where the robot is, and how it moves.
fn poses(frame: &FrameRef<'_>, twist: Option<&Twist>) -> [Message; 2] {
    let pose = frame.world_from_body();
    let mut tf = Cdr::new();
    tf.u32(1).header(time_ns(frame), MAP).text(BODY).pose(&pose);
    [
        message(TF, frame, tf.finish()),
        message(ODOM, frame, odometry::message(frame, twist)),
    ]
}

/// The messages of a camera, in the order of its topics.
fn pictures(
    source: &Source,
    (sequence, frame): (&Sequence<'_>, &FrameRef<'_>),
    i: usize,
    labels: &Labels,
) -> Result<[Vec<u8>; OF_CAMERA], Error> {
    let camera = &sequence.cameras[i];
    let image = |size: (usize, usize), encoding: &str, data: &[u8]| {
        let (width, height) = size;
        let mut out = Cdr::new();
        out.header(time_ns(frame), &camera.name)
            .u32(height as u32)
            .u32(width as u32);
        out.text(encoding)
            .u8(0)
            .u32((data.len() / height) as u32)
            .bytes(data);
        out.finish()
    };
    let rgb = source.picture(frame, i)?;
    let classes = source
        .classes(frame, i)?
        .map(|&class| labels.id(class) as u8);
    let instances: Image<[u8; 4]> = source.instances(frame, i)?.map(|id| id.to_le_bytes());
    // To ROS 0 is a distance, and +Inf a direction in which nothing is.
    let distance_m = |&z: &f32| if z > 0.0 { z } else { f32::INFINITY };
    let depth: Image<[u8; 4]> = source
        .depth_m(frame, i)?
        .map(|z| distance_m(z).to_le_bytes());
    let size = (rgb.width(), rgb.height());
    Ok([
        image(size, "rgb8", rgb.pixels().as_flattened()),
        image(size, "mono8", classes.pixels()),
        image(size, "32SC1", instances.pixels().as_flattened()),
        image(size, "32FC1", depth.pixels().as_flattened()),
        camera_info(frame, camera, baseline_px(sequence, i)),
    ])
}

/// -fx · B of the right camera of a rectified pair, which is B to the right of the left one; stereo
/// nodes take the baseline from it. 0 of all others.
fn baseline_px(sequence: &Sequence<'_>, camera: usize) -> f64 {
    let (left, right) = (&sequence.cameras[0], &sequence.cameras[camera]);
    let is_right = stereo::right(sequence.cameras) == Some(camera);
    match stereo::baseline_m(left, right).filter(|_| is_right) {
        Some(baseline_m) => -right.intrinsics.fx * baseline_m,
        None => 0.0,
    }
}

/// `CameraInfo`.
fn camera_info(frame: &FrameRef<'_>, camera: &CameraSpec, baseline_px: f64) -> Vec<u8> {
    let k = &camera.intrinsics;
    let (cx, cy) = (k.cx - 0.5, k.cy - 0.5);
    let (model, d) = match lens(&k.distortion) {
        ("fisheye", [d @ .., _]) => ("equidistant", d.to_vec()),
        (_, d) => ("plumb_bob", d.to_vec()),
    };
    let mut out = Cdr::new();
    out.header(time_ns(frame), &camera.name)
        .u32(k.height)
        .u32(k.width);
    out.text(model).u32(d.len() as u32).f64s(&d);
    out.f64s(&[k.fx, 0.0, cx, 0.0, k.fy, cy, 0.0, 0.0, 1.0]);
    out.f64s(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    out.f64s(&[k.fx, 0.0, cx, baseline_px]);
    out.f64s(&[0.0, k.fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
    // No binning, and the whole picture.
    out.u32(0).u32(0).u32(0).u32(0).u32(0).u32(0).u8(0);
    out.finish()
}
