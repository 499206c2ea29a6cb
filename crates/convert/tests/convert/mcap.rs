//! MCAP, read record by record, point clouds by plain CDR, and the metadata of bags.

use std::collections::BTreeMap;

use nemoral_convert::FormatName;
use nemoral_dataset::ImuSpec;
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

use crate::common::{Made, header, made, made_of, pose, text};

/// What is added to the times of a sequence.
const START_NS: u64 = 1_000_000_000;

/// Reads little-endian numbers and texts one after the other.
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    pub(crate) at: usize,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub(crate) fn take(&mut self, n: usize) -> &'a [u8] {
        self.at += n;
        &self.bytes[self.at - n..self.at]
    }

    pub(crate) fn number(&mut self, n: usize) -> u64 {
        self.take(n)
            .iter()
            .rev()
            .fold(0, |sum, b| sum << 8 | u64::from(*b))
    }

    fn text(&mut self) -> String {
        let n = self.number(4) as usize;
        String::from_utf8(self.take(n).to_vec()).expect("UTF-8")
    }

    fn map(&mut self, key: usize, value: usize) -> BTreeMap<u64, u64> {
        let end = self.number(4) as usize + self.at;
        let mut map = BTreeMap::new();
        while self.at < end {
            let key = self.number(key);
            map.insert(key, self.number(value));
        }
        map
    }

    /// The next record: its code and content.
    fn record(&mut self) -> (u64, &'a [u8]) {
        let code = self.number(1);
        let n = self.number(8) as usize;
        (code, self.take(n))
    }

    /// A number of CDR, at a multiple of its size after the first four bytes.
    pub(crate) fn aligned(&mut self, n: usize) -> u64 {
        self.at = 4 + (self.at - 4).next_multiple_of(n);
        self.number(n)
    }

    pub(crate) fn cdr_text(&mut self) -> String {
        let n = self.aligned(4) as usize;
        let text = self.take(n);
        assert_eq!(text.last(), Some(&0));
        String::from_utf8(text[..n - 1].to_vec()).expect("UTF-8")
    }
}

#[test]
fn the_index_leads_to_messages_and_points_are_those_of_scans() {
    let made = made(FormatName::Mcap);
    let bytes = std::fs::read(made.out.join("00/00_0.mcap")).expect("a file");
    let magic = b"\x89MCAP0\r\n";
    assert!(bytes.starts_with(magic) && bytes.ends_with(magic));

    // From the footer to the summary, to chunks, to messages.
    let footer = bytes.len() - 8 - 29;
    let (code, content) = Reader::new(&bytes[footer..]).record();
    assert_eq!((code, content.len()), (2, 20));
    let start = Reader::new(content).number(8) as usize;
    let mut summary = Reader::new(&bytes[start..footer]);
    let (mut topics, mut chunks, mut total) = (BTreeMap::new(), Vec::new(), 0);
    while summary.at < footer - start {
        let (code, content) = summary.record();
        let mut r = Reader::new(content);
        match code {
            4 => {
                let id = r.number(2);
                let _schema = r.number(2);
                topics.insert(id, r.text());
            }
            8 => chunks.push(content),
            0x0B => total = r.number(8),
            _ => {}
        }
    }
    assert_eq!((topics.len(), chunks.len()), (4 + 1 + 2 * 5, 3));
    let mut count = 0;
    for (i, chunk) in chunks.into_iter().enumerate() {
        let frame = [1, 2, 4][i];
        let mut r = Reader::new(chunk);
        let (first, last) = (r.number(8), r.number(8));
        let (at, length) = (r.number(8) as usize, r.number(8) as usize);
        let places = r.map(2, 8);
        let (code, content) = Reader::new(&bytes[at..at + length]).record();
        assert_eq!((code, content.len() + 9), (6, length));
        let mut r = Reader::new(content);
        assert_eq!((r.number(8), r.number(8)), (first, last));
        let size = r.number(8) as usize;
        let crc = r.number(4) as u32;
        assert_eq!(r.text(), "");
        assert_eq!(r.number(8) as usize, size);
        let records = r.take(size);
        assert_eq!(crc, crc32fast::hash(records));
        for (channel, place) in places {
            let (code, content) = Reader::new(&bytes[place as usize..]).record();
            assert_eq!(code, 7);
            let mut r = Reader::new(content);
            assert_eq!(r.number(2), channel);
            for (time, offset) in r.map(8, 8) {
                let (code, content) = Reader::new(&records[offset as usize..]).record();
                assert_eq!(code, 5);
                let mut r = Reader::new(content);
                assert_eq!(r.number(2), channel);
                let _sequence = r.number(4);
                assert_eq!((r.number(8), r.number(8)), (time, time));
                assert_eq!((time - START_NS) as f64 * 1e-9, pose(frame).0);
                count += 1;
                if topics[&channel] == "/top/points" {
                    check_points(&made, i, r.take(content.len() - 22));
                }
            }
        }
    }
    assert_eq!((count, total), (3 * 13 + 2, 3 * 13 + 2));
}

fn check_points(made: &crate::common::Made, i: usize, data: &[u8]) {
    assert_eq!(data[..4], [0, 1, 0, 0]);
    let mut r = Reader::new(data);
    r.at = 4;
    let (seconds, nanoseconds) = (r.aligned(4), r.aligned(4));
    let time_s = pose([1, 2, 4][i]).0;
    assert_eq!((seconds - 1) as f64 + nanoseconds as f64 * 1e-9, time_s);
    assert_eq!(r.cdr_text(), header().sequences[0].lidars[0].name);
    let scan = &made.dataset.read_frame(i).expect("a frame").lidars[0];
    assert_eq!((r.aligned(4), r.aligned(4)), (1, scan.ply.len() as u64));
    let cloud = Cloud::read(&mut r);
    assert_eq!((cloud.points.len(), r.at), (scan.ply.len(), data.len()));
    // The scan is deskewed.
    let names: Vec<&str> = cloud.fields.keys().map(String::as_str).collect();
    assert_eq!(
        names.join(" "),
        "instance intensity label range reflectivity ring x y z"
    );
    let all = cloud.points.iter().zip(&scan.ply).zip(&scan.points);
    for ((point, p), &[x, y, z, intensity]) in all {
        let number = |name: &str| cloud.number(point, name);
        let real = |name: &str| cloud.real(point, name);
        assert_eq!(
            [real("x"), real("y"), real("z"), real("intensity")],
            [x, y, z, intensity]
        );
        assert_eq!(number("ring"), u64::from(p.point.ring));
        assert_eq!(number("label"), u64::from(p.class));
        assert_eq!(number("instance"), u64::from(p.point.object.to_image_id()));
        let range_mm = f64::from(p.point.range_m) * 1e3;
        assert!((number("range") as f64 - range_mm).abs() <= 0.5);
        let percent = 100.0 * f64::from(intensity);
        assert!((number("reflectivity") as f64 - percent).abs() <= 0.5 + 1e-4);
    }
}

/// The fields and points of a cloud.
pub(crate) struct Cloud<'a> {
    /// Where each field is in a point, and its type.
    pub(crate) fields: BTreeMap<String, (usize, u64)>,
    pub(crate) points: Vec<&'a [u8]>,
}

impl<'a> Cloud<'a> {
    /// Reads what follows on height and width.
    pub(crate) fn read(r: &mut Reader<'a>) -> Self {
        let mut fields = BTreeMap::new();
        for _ in 0..r.aligned(4) {
            let name = r.cdr_text();
            let offset = r.aligned(4) as usize;
            let data_type = r.number(1);
            assert_eq!(r.aligned(4), 1);
            fields.insert(name, (offset, data_type));
        }
        assert_eq!(r.number(1), 0, "little-endian");
        let step = r.aligned(4) as usize;
        let (row, bytes) = (r.aligned(4), r.aligned(4));
        assert_eq!(row, bytes);
        let points = r.take(bytes as usize).chunks_exact(step).collect();
        assert_eq!(r.number(1), 1, "dense");
        Self { fields, points }
    }

    pub(crate) fn number(&self, point: &[u8], name: &str) -> u64 {
        let (at, data_type) = self.fields[name];
        let size = match data_type {
            4 => 2,
            6 | 7 => 4,
            other => panic!("type {other}"),
        };
        Reader::new(&point[at..]).number(size)
    }

    pub(crate) fn real(&self, point: &[u8], name: &str) -> f32 {
        f32::from_bits(self.number(point, name) as u32)
    }
}

/// The content of the records of the summary with a code.
fn summary(bytes: &[u8], code: u64) -> Vec<&[u8]> {
    let footer = bytes.len() - 8 - 29;
    let (_, content) = Reader::new(&bytes[footer..]).record();
    let mut summary = Reader::new(&bytes[..footer]);
    summary.at = Reader::new(content).number(8) as usize;
    let mut found = Vec::new();
    while summary.at < footer {
        let (other, content) = summary.record();
        if other == code {
            found.push(content);
        }
    }
    found
}

/// What rosbag2 writes of a publisher that keeps ten messages and has no deadlines.
fn qos(durability: u32) -> String {
    format!(
        "- history: 1
  depth: 10
  reliability: 1
  durability: {durability}
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
"
    )
}

#[test]
fn the_right_camera_of_a_pair_says_how_far_it_is_from_the_left_one() {
    let mut header = header();
    for (camera, y_m) in header.sequences[0].cameras.iter_mut().zip([0.0, -0.5]) {
        let mount = RigidTransform::from_xyz_rpy(DVec3::new(0.3, y_m, 1.3), 0.0, 0.0, 0.2);
        let along = mount.rotation * DVec3::new(0.0, y_m, 0.0);
        let translation_m = DVec3::new(0.3, 0.0, 1.3) + along;
        camera.body_from_camera = RigidTransform {
            translation_m,
            ..mount
        } * RigidTransform::body_from_optical();
    }
    let focal_px = header.sequences[0].cameras[1].intrinsics.fx;
    let made = made_of(FormatName::Mcap, &header);
    let bytes = std::fs::read(made.out.join("00/00_0.mcap")).expect("a file");
    assert!(
        !made
            .done
            .notes
            .iter()
            .any(|note| note.contains("rectified"))
    );
    for (topic, baseline_m) in [("/front/camera_info", 0.0), ("/right/camera_info", 0.5)] {
        let messages = messages(&bytes);
        let (.., data) = messages.iter().find(|m| m.0 == topic).expect("a camera");
        // `p` is the last matrix, before 7 words of binning and window and a byte.
        let mut r = Reader::new(data);
        r.at = data.len() - 1 - 6 * 4 - 12 * 8;
        let p: Vec<f64> = (0..12).map(|_| f64::from_bits(r.number(8))).collect();
        assert_eq!((p[0], p[10]), (focal_px, 1.0));
        assert!(
            (p[3] + focal_px * baseline_m).abs() < 1e-9,
            "{topic}: {}",
            p[3]
        );
    }
}

/// Topic, time and message of everything, in the order of the file.
pub(crate) fn messages(bytes: &[u8]) -> Vec<(String, u64, &[u8])> {
    let mut topics = BTreeMap::new();
    for channel in summary(bytes, 4) {
        let mut r = Reader::new(channel);
        let (id, _schema) = (r.number(2), r.number(2));
        topics.insert(id, r.text());
    }
    let mut all = Vec::new();
    for index in summary(bytes, 8) {
        let mut r = Reader::new(index);
        let _span = r.take(16);
        let at = r.number(8) as usize;
        let (_, chunk) = Reader::new(&bytes[at..]).record();
        let mut r = Reader::new(chunk);
        let _before = r.take(8 + 8 + 8 + 4);
        let _compression = r.text();
        let size = r.number(8) as usize;
        let mut records = Reader::new(r.take(size));
        while records.at < size {
            let (code, content) = records.record();
            if code == 5 {
                let mut r = Reader::new(content);
                let (id, _sequence, time_ns) = (r.number(2), r.number(4), r.number(8));
                let _published = r.number(8);
                all.push((topics[&id].clone(), time_ns, r.take(content.len() - 22)));
            }
        }
    }
    all
}

/// The encoding and the pixels of an image, of four bytes each.
fn image<'a>(
    messages: &[(String, u64, &'a [u8])],
    topic: &str,
    i: usize,
) -> (String, Vec<&'a [u8]>) {
    let mut of_topic = messages.iter().filter(|m| m.0 == topic);
    let (.., data) = of_topic.nth(i).unwrap_or_else(|| panic!("no {topic}"));
    let mut r = Reader::new(data);
    r.at = 4;
    let _stamp = (r.aligned(4), r.aligned(4));
    let _frame = r.cdr_text();
    assert_eq!((r.aligned(4), r.aligned(4)), (22, 31));
    let encoding = r.cdr_text();
    let (order, step, length) = (r.number(1), r.aligned(4), r.aligned(4) as usize);
    assert_eq!((order, step, length), (0, 4 * 31, 4 * 31 * 22));
    (encoding, r.take(length).chunks(4).collect())
}

#[test]
fn depth_is_infinite_where_nothing_is_and_objects_have_their_numbers() {
    let made = made(FormatName::Mcap);
    let bytes = std::fs::read(made.out.join("00/00_0.mcap")).expect("a file");
    let messages = messages(&bytes);
    let mut empty = 0;
    for i in 0..3 {
        let read = made.dataset.read_frame(i).expect("a frame");
        for seen in &read.cameras {
            let (encoding, pixels) = image(&messages, &format!("/{}/depth", seen.name), i);
            assert_eq!(encoding, "32FC1");
            for (pixel, &depth_m) in pixels.iter().zip(seen.depth_m.pixels()) {
                let found = f32::from_bits(Reader::new(pixel).number(4) as u32);
                // 0 would be a surface at the lens.
                let is_empty = depth_m == 0.0;
                assert_eq!(found, if is_empty { f32::INFINITY } else { depth_m });
                empty += usize::from(is_empty);
            }
            let (encoding, pixels) = image(&messages, &format!("/{}/instance", seen.name), i);
            assert_eq!(encoding, "32SC1");
            let found = pixels
                .iter()
                .map(|pixel| Reader::new(pixel).number(4) as u32);
            assert!(found.eq(seen.instance.pixels().iter().copied()));
        }
    }
    assert!(empty > 99, "{empty}");
}

#[test]
fn names_of_classes_are_told_once() {
    let made = made(FormatName::Mcap);
    let bytes = std::fs::read(made.out.join("00/00_0.mcap")).expect("a file");
    let messages = messages(&bytes);
    let mut infos = messages.iter().filter(|m| m.0 == "/label_info");
    let (_, time_ns, data) = infos.next().expect("a message");
    assert!(infos.next().is_none());
    assert_eq!((time_ns - START_NS) as f64 * 1e-9, pose(1).0);
    let mut r = Reader::new(data);
    r.at = 4;
    let _stamp = (r.aligned(4), r.aligned(4));
    assert_eq!(r.cdr_text(), "base_link");
    let found: Vec<(u64, String)> = (0..r.aligned(4))
        .map(|_| (r.aligned(2), r.cdr_text()))
        .collect();
    let classes = header().ontology;
    let classes = classes.classes().iter();
    let expected: Vec<(u64, String)> = classes.map(|c| (c.id.into(), c.name.clone())).collect();
    assert_eq!(found, expected);
    assert_eq!((r.aligned(4), r.at), (0, data.len()));
}

#[test]
fn an_inertial_unit_says_what_it_measured_between_the_first_frame_and_the_last() {
    let mut header = header();
    header.sequences[0].imu = Some(ImuSpec {
        body_from_imu: RigidTransform::IDENTITY,
        rate_hz: 20.0,
        angular_rate_noise_rad_s: 0.5,
        specific_force_noise_m_s2: 0.25,
    });
    let made = made_of(FormatName::Mcap, &header);
    let bytes = std::fs::read(made.out.join("00/00_0.mcap")).expect("a file");
    let messages = messages(&bytes);
    assert!(messages.is_sorted_by_key(|m| m.1));
    let of_unit: Vec<_> = messages.iter().filter(|m| m.0 == "/imu").collect();
    let times_ns: Vec<u64> = of_unit.iter().map(|m| m.1).collect();
    // A second around the frames, as far as there are readings.
    let first_s = (pose(1).0 - 1.0).max(-0.025);
    let wanted = made.dataset.imu(0).expect("readings").into_iter();
    let wanted = wanted.filter(|r| r.time_ns as f64 * 1e-9 > first_s);
    let wanted: Vec<u64> = wanted.map(|r| START_NS + r.time_ns as u64).collect();
    assert!(wanted.len() > 3);
    assert_eq!(times_ns, wanted);
    let (_, time_ns, data) = of_unit[2];
    let mut r = Reader::new(data);
    r.at = 4;
    let stamp = (r.aligned(4), r.aligned(4));
    assert_eq!(stamp, (time_ns / 1_000_000_000, time_ns % 1_000_000_000));
    assert_eq!(r.cdr_text(), "imu");
    let numbers: Vec<f64> = (0..4 + 9 + 3 + 9 + 3 + 9)
        .map(|_| f64::from_bits(r.aligned(8)))
        .collect();
    assert_eq!(r.at, data.len());
    assert_eq!(numbers[..5], [0.0, 0.0, 0.0, 1.0, -1.0]);
    assert_eq!(
        numbers[13..17],
        [(time_ns - START_NS) as f64, 0.0, 0.5, 0.25]
    );
    assert_eq!(numbers[25..29], [0.0, 0.25, 9.75, 0.0625]);
    let mounts = messages
        .iter()
        .find(|m| m.0 == "/tf_static")
        .expect("mounts");
    assert!(mounts.2.windows(4).any(|w| w == b"imu\0"));
    check_bag(&made, (times_ns[0], pose(4).0));
}

#[test]
fn the_folder_of_a_sequence_is_a_bag_and_its_metadata_agree_with_the_file() {
    let start_ns = START_NS + (pose(1).0 * 1e9).round() as u64;
    check_bag(&made(FormatName::Mcap), (start_ns, pose(4).0));
}

/// Compares the metadata of a bag with its file, whose first and last message have these times.
fn check_bag(made: &Made, (first_ns, last_s): (u64, f64)) {
    let bytes = std::fs::read(made.out.join("00/00_0.mcap")).expect("a file");
    let mut types = BTreeMap::new();
    for schema in summary(&bytes, 3) {
        let mut r = Reader::new(schema);
        types.insert(r.number(2), r.text());
    }
    let mut r = Reader::new(summary(&bytes, 0x0B)[0]);
    let total = r.number(8);
    // Numbers of schemas, channels, attachments, metadata and chunks.
    let _numbers = r.take(2 + 4 * 4);
    let (start_ns, end_ns) = (r.number(8), r.number(8));
    assert_eq!(start_ns, first_ns);
    assert_eq!((end_ns - START_NS) as f64 * 1e-9, last_s);
    let counts = r.map(2, 8);

    let mut topics = String::new();
    for channel in summary(&bytes, 4) {
        let mut r = Reader::new(channel);
        let id = r.number(2);
        let message_type = &types[&r.number(2)];
        let (topic, encoding) = (r.text(), r.text());
        let _bytes = r.number(4);
        assert_eq!(r.text(), "offered_qos_profiles");
        let offered = r.text();
        let is_kept = ["/tf_static", "/label_info"].contains(&&*topic);
        assert_eq!(offered, qos(if is_kept { 1 } else { 2 }));
        let (offered, count) = (offered.replace('\n', "\\n"), counts[&id]);
        topics += &format!(
            "    - topic_metadata:
        name: {topic}
        type: {message_type}
        serialization_format: {encoding}
        offered_qos_profiles: \"{offered}\"
      message_count: {count}
"
        );
    }
    assert_eq!(
        text(made.out.join("00/metadata.yaml")),
        format!(
            "rosbag2_bagfile_information:
  version: 5
  storage_identifier: mcap
  starting_time:
    nanoseconds_since_epoch: {start_ns}
  duration:
    nanoseconds: {duration_ns}
  message_count: {total}
  topics_with_message_count:
{topics}  compression_format: \"\"
  compression_mode: \"\"
  relative_file_paths:
    - 00_0.mcap
  files:
    - path: 00_0.mcap
      starting_time:
        nanoseconds_since_epoch: {start_ns}
      duration:
        nanoseconds: {duration_ns}
      message_count: {total}
",
            duration_ns = end_ns - start_ns
        )
    );
    assert_eq!(made.done.files, 2);
}
