//! `dataset.json`.

use std::collections::BTreeMap;

use nemoral_files::{Folder, InnerPath};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{RigidTransform, Twist, excerpt};
use serde::{Deserialize, Serialize};

use crate::error::shown;
use crate::formats::kitti;
use crate::header::is_place;
use crate::{
    BalanceRecord, DatasetHeader, Error, FileRecord, FrameChoice, SequenceSpec, layout, limits,
    seal,
};

/// The version of the layout that this crate writes; it reads no other.
pub const FORMAT_VERSION: u32 = 2;

/// `dataset.json`: everything about a data set except its content. It contains no time of day, host
/// name, thread count or duration, so that equal requests give equal bytes.
// It is read in two parts: what `flatten` does not know it would keep as values, which take many
// times the memory of their text.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Manifest {
    /// [`FORMAT_VERSION`].
    pub format_version: u32,
    /// What decides the bytes.
    #[serde(flatten)]
    pub header: DatasetHeader,
    /// The tracks of the sequences that have frames here, by sequence.
    pub tracks: Vec<TrackRecord>,
    /// The files that belong to no frame, by path; `dataset.json` itself is not among them.
    pub files: Vec<FileRecord>,
    /// The frames that exist here, by sequence and index: a shard lists its own.
    pub frames: Vec<FrameRecord>,
}

/// A `dataset.json` that was read.
pub(crate) struct ManifestFile {
    pub(crate) manifest: Manifest,
    /// Whether it is unchanged since it was written.
    pub(crate) is_untouched: bool,
    /// BLAKE3 of its bytes, hexadecimal.
    pub(crate) digest: String,
}

/// What a [`Manifest`] has beside its header, to be read.
#[derive(Deserialize)]
struct Lists {
    tracks: Vec<TrackRecord>,
    files: Vec<FileRecord>,
    frames: Vec<FrameRecord>,
}

/// The drive of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackRecord {
    /// The sequence's number.
    pub sequence: u32,
    /// Number of frames of the whole drive, and of lines of `poses.txt` and `times.txt`.
    pub length: u64,
    /// The frames that exist here, as half-open ranges.
    pub frames: Vec<[u64; 2]>,
    /// The pose of the reference sensor (the first camera) at frame 0 in the world: 3 × 4,
    /// row-major, metres. `world_from_frame0 · poses.txt[k]` is its pose at frame k.
    pub world_from_frame0: [[f64; 4]; 3],
    /// How its poses were chosen among several; absent if they are a drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub balance: Option<BalanceRecord>,
    /// Whether the body stands still at each pose, as a tripod does; absent if it does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stands: bool,
    /// The first frames of flight lines, from 0 on, between which the body turns; absent if it is
    /// no flight along lines.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<u64>,
}

/// A frame that exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameRecord {
    /// The sequence's number.
    pub sequence: u32,
    /// The frame's number in its sequence, which is in the names of its files.
    pub index: u64,
    /// Seconds after the start of the sequence, the middle of the exposure.
    pub time_s: f64,
    /// The key of all that went into the frame, hexadecimal.
    pub key: String,
    /// The body's pose in the world: 3 × 4, row-major, metres.
    pub world_from_body: [[f64; 4]; 3],
    /// How the body moves at that time, in its own axes; absent if no camera has a shutter or the
    /// body stands still.
    #[serde(default, skip_serializing_if = "Twist::is_still")]
    pub body_motion: Twist,
    /// Which candidate it is; absent if its sequence is a drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub balance: Option<FrameChoice>,
    /// The chunk in which each LiDAR stood; the instances of `.label` files are relative to it.
    pub sensor_chunks: Vec<[i32; 2]>,
    /// LiDAR points by class id, over all LiDARs.
    pub point_classes: BTreeMap<u8, u64>,
    /// The frame's files, by path.
    pub files: Vec<FileRecord>,
}

impl TrackRecord {
    /// [`TrackRecord::world_from_frame0`] as a transform.
    #[must_use]
    pub fn world_from_frame0(&self) -> RigidTransform {
        kitti::from_rows(&self.world_from_frame0)
    }

    /// The number of the flight line that a frame is on, from 0; `None` if it is on none.
    #[must_use]
    pub fn line_of(&self, frame: u64) -> Option<u64> {
        let after = self.lines.partition_point(|first| *first <= frame);
        after.checked_sub(1).map(|line| line as u64)
    }

    /// Whether the body moves from frame to frame: they are neither single views nor stations.
    #[must_use]
    pub fn is_drive(&self) -> bool {
        self.balance.is_none() && !self.stands
    }

    /// Whether the body moves from a frame to the next one, which may not exist here: not after the
    /// last one of a drive, nor from one flight line to the next.
    #[must_use]
    pub fn goes_on_after(&self, frame: u64) -> bool {
        let next = frame.saturating_add(1);
        self.is_drive() && next < self.length && self.line_of(frame) == self.line_of(next)
    }
}

impl FrameRecord {
    /// [`FrameRecord::world_from_body`] as a transform.
    #[must_use]
    pub fn world_from_body(&self) -> RigidTransform {
        kitti::from_rows(&self.world_from_body)
    }

    /// Size of all its files.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.files.iter().map(|f| f.bytes).sum()
    }
}

impl Manifest {
    /// How many LiDAR points have a class, by its id.
    #[must_use]
    pub fn point_classes(&self) -> BTreeMap<u8, u64> {
        let mut points = BTreeMap::new();
        for (&class, count) in self.frames.iter().flat_map(|f| &f.point_classes) {
            *points.entry(class).or_insert(0) += count;
        }
        points
    }

    /// Pretty-printed JSON, but with each frame on one line, as a long drive has many. The text
    /// contains its own checksum.
    pub(crate) fn to_json(&self) -> String {
        let head = Self {
            format_version: self.format_version,
            header: self.header.clone(),
            tracks: self.tracks.clone(),
            files: self.files.clone(),
            frames: Vec::new(),
        };
        let head = serde_json::to_string_pretty(&head).expect("a manifest has string keys");
        let checksum = format!("{{\n  \"checksum\": \"{}\",", seal::blank());
        let head = head.replacen('{', &checksum, 1);
        let head = head
            .strip_suffix("[]\n}")
            .expect("frames are the last field");
        let frames: Vec<String> = self
            .frames
            .iter()
            .map(|f| "    ".to_owned() + &serde_json::to_string(f).expect("string keys"))
            .collect();
        let frames = frames.join(",\n");
        seal::stamp(&format!("{head}[\n{frames}\n  ]\n}}\n"))
    }

    /// Reads and [validates](Self::validate) the manifest of a folder.
    pub(crate) fn read(folder: &Folder) -> Result<ManifestFile, Error> {
        let name = layout::inner(layout::MANIFEST);
        let path = name.below(folder.root());
        let text = folder.read_text(&name, limits::MANIFEST_BYTES)?;
        let manifest = Self::parse(&text).map_err(|message| Error::malformed(path, message))?;
        Ok(ManifestFile {
            manifest,
            is_untouched: seal::is_stamped(&text),
            digest: blake3::hash(text.as_bytes()).to_hex().to_string(),
        })
    }

    /// The same from text.
    fn parse(text: &str) -> Result<Self, String> {
        if text.trim().is_empty() {
            return Err("is empty".to_owned());
        }
        // Such errors quote what they have found.
        let unread = |e: serde_json::Error| excerpt(&e.to_string(), 300);
        let version: Version = serde_json::from_str(text).map_err(unread)?;
        if version.format_version != FORMAT_VERSION {
            return Err(format!(
                "format_version is {}, this program reads {FORMAT_VERSION}",
                version.format_version
            ));
        }
        let header: DatasetHeader = serde_json::from_str(text).map_err(unread)?;
        let lists: Lists = serde_json::from_str(text).map_err(unread)?;
        let manifest = Self {
            format_version: version.format_version,
            header,
            tracks: lists.tracks,
            files: lists.files,
            frames: lists.frames,
        };
        manifest.validate().map_err(|e| e.to_string())?;
        Ok(manifest)
    }

    /// Checks that a [`Writer`](crate::Writer) could have written this manifest. After that its
    /// names, sizes and poses can be relied on, whoever wrote it: its files are those of the
    /// layout.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        self.header.validate()?;
        if !self.tracks.is_sorted_by(|a, b| a.sequence < b.sequence) {
            let allowed = "in order of their sequences, each once";
            return Err(Error::invalid("tracks", "…", allowed));
        }
        let mut driven = Vec::new();
        for track in &self.tracks {
            track.validate()?;
            let sequence = self.header.sequence(track.sequence).ok_or_else(|| {
                let allowed = "that of a sequence";
                Error::invalid("tracks: sequence", track.sequence, allowed)
            })?;
            driven.push((sequence, track));
        }
        let at = |f: &FrameRecord| (f.sequence, f.index);
        if !self.frames.is_sorted_by(|a, b| at(a) < at(b)) {
            return Err(Error::invalid(
                "frames",
                "…",
                "in order of their numbers, each once",
            ));
        }
        for f in &self.frames {
            let field = || format!("frame {} of sequence {}", f.index, f.sequence);
            match driven.binary_search_by_key(&f.sequence, |(s, _)| s.number) {
                Err(_) => {
                    let allowed = "of a sequence with a track";
                    return Err(Error::invalid(field(), "there", allowed));
                }
                Ok(i) if f.index >= driven[i].1.length => {
                    let allowed = format!("one of the sequence's {}", driven[i].1.length);
                    return Err(Error::invalid(field(), "there", allowed));
                }
                Ok(i) => {
                    f.validate(driven[i].0)?;
                    f.check_choice(driven[i].1)?;
                }
            }
        }
        let mut listed: BTreeMap<u32, Vec<[u64; 2]>> = BTreeMap::new();
        for f in &self.frames {
            extend(listed.entry(f.sequence).or_default(), f.index);
        }
        for t in &self.tracks {
            if t.frames != listed.remove(&t.sequence).unwrap_or_default() {
                let field = format!("track of sequence {}.frames", t.sequence);
                return Err(Error::invalid(
                    field,
                    "others",
                    "the ranges of the frames listed",
                ));
            }
        }
        let inputs = self.header.inputs();
        for file in &self.files {
            if inputs.get(&file.path).is_some_and(|input| *input != file) {
                let allowed = "as in its sequence's inputs";
                return Err(Error::invalid("files", format!("'{}'", file.path), allowed));
            }
        }
        same_files(
            "files",
            &self.files,
            &layout::common_files(&self.header, driven.iter().map(|(s, t)| (*s, t.length))),
        )
    }
}

impl TrackRecord {
    /// Checks the numbers of a drive.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        let field = |what| format!("track of sequence {}.{what}", self.sequence);
        if !(1..=limits::MAX_FRAMES).contains(&self.length) {
            let allowed = format!("1 to {}", limits::MAX_FRAMES);
            return Err(Error::invalid(field("length"), self.length, allowed));
        }
        if let Some(balance) = &self.balance {
            balance.validate(&field("balance"))?;
        }
        let are_in_order = self.lines.is_sorted_by(|a, b| a < b);
        let end = self.lines.first().zip(self.lines.last());
        if !are_in_order || end.is_some_and(|(first, last)| *first != 0 || *last >= self.length) {
            let shown = format!("{} of them", self.lines.len());
            let allowed = format!("rising from 0 to less than {}", self.length);
            return Err(Error::invalid(field("lines"), shown, allowed));
        }
        validate_pose(&field("world_from_frame0"), &self.world_from_frame0)
    }
}

impl FrameRecord {
    /// Checks that the frame was chosen as its track says.
    fn check_choice(&self, track: &TrackRecord) -> Result<(), Error> {
        let field = format!("frame {} of sequence {}.balance", self.index, self.sequence);
        match (&self.balance, &track.balance) {
            (None, None) => Ok(()),
            (Some(choice), Some(of)) => choice.validate(&field, of),
            (Some(_), None) => Err(Error::invalid(field, "there", "none, as its track's")),
            (None, Some(_)) => Err(Error::invalid(field, "none", "there, as its track's")),
        }
    }

    /// Checks names, numbers and files of one frame, which may be one that no manifest lists yet.
    pub(crate) fn validate(&self, sequence: &SequenceSpec) -> Result<(), Error> {
        self.validate_numbers(sequence)?;
        let expected = layout::frame_files(sequence, self.index);
        same_files(&format!("{}.files", self.name()), &self.files, &expected)
    }

    /// What errors call it.
    fn name(&self) -> String {
        format!("frame {} of sequence {}", self.index, self.sequence)
    }

    /// Checks all but the files, which may not be written yet.
    pub(crate) fn validate_numbers(&self, sequence: &SequenceSpec) -> Result<(), Error> {
        let name = self.name();
        if self.index >= limits::MAX_FRAMES {
            let allowed = format!("less than {}", limits::MAX_FRAMES);
            return Err(Error::invalid(name, self.index, allowed));
        }
        // The limit keeps sums over all frames from overflowing.
        let most = limits::MAX_POINTS * sequence.lidars.len() as u64;
        if let Some((class, count)) = self.point_classes.iter().find(|(_, n)| **n > most) {
            let field = format!("{name}.point_classes.{class}");
            return Err(Error::invalid(field, count, format!("at most {most}")));
        }
        if !(self.time_s.is_finite() && self.time_s.abs() <= 1e12) {
            return Err(Error::invalid(
                format!("{name}.time_s"),
                self.time_s,
                "within 1e12 s of 0",
            ));
        }
        validate_pose(&format!("{name}.world_from_body"), &self.world_from_body)?;
        let motion = [self.body_motion.linear_m_s, self.body_motion.angular_rad_s];
        if !motion.into_iter().all(is_place) {
            let value = format!("{:?}", self.body_motion);
            return Err(Error::invalid(
                format!("{name}.body_motion"),
                value,
                "within 1e12 m/s and 1e12 rad/s",
            ));
        }
        if self.sensor_chunks.len() != sequence.lidars.len() {
            let (found, asked) = (self.sensor_chunks.len(), sequence.lidars.len());
            let allowed = format!("{asked}, one for each LiDAR");
            return Err(Error::invalid(
                format!("{name}.sensor_chunks"),
                found,
                allowed,
            ));
        }
        if !is_digest(&self.key) {
            return Err(Error::invalid(
                format!("{name}.key"),
                shown(&self.key),
                "64 hexadecimal digits",
            ));
        }
        Ok(())
    }
}

/// Checks that the listed files are exactly those of the layout, and none is larger than it can be.
fn same_files(
    field: &str,
    listed: &[FileRecord],
    expected: &[(InnerPath, u64)],
) -> Result<(), Error> {
    let is_expected = |path: &InnerPath| expected.binary_search_by(|(e, _)| e.cmp(path)).is_ok();
    if let Some(file) = listed.iter().find(|f| !is_expected(&f.path)) {
        let allowed = "a file of this data set's sensors";
        return Err(Error::invalid(field, format!("'{}'", file.path), allowed));
    }
    let differing = (expected.iter().enumerate())
        .find(|(i, (path, _))| listed.get(*i).is_none_or(|f| f.path != *path));
    if let Some((_, (path, _))) = differing {
        let (found, allowed) = if listed.iter().any(|f| f.path == *path) {
            ("…".to_owned(), "in order of their paths")
        } else {
            (format!("without '{path}'"), "complete")
        };
        return Err(Error::invalid(field, found, allowed));
    }
    if listed.len() > expected.len() {
        return Err(Error::invalid(field, "…", "each once"));
    }
    for (file, (path, limit)) in listed.iter().zip(expected) {
        if file.bytes > *limit {
            let allowed = format!("at most {limit}");
            return Err(Error::invalid(
                format!("{path}: bytes"),
                file.bytes,
                allowed,
            ));
        }
        if !is_digest(&file.blake3) {
            let allowed = "64 hexadecimal digits";
            return Err(Error::invalid(
                format!("{path}: blake3"),
                shown(&file.blake3),
                allowed,
            ));
        }
    }
    Ok(())
}

fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit())
}

/// Checks that a pose is a rotation, to the precision of computations in f64, and a valid position.
fn validate_pose(field: &str, rows: &[[f64; 4]; 3]) -> Result<(), Error> {
    let axis = |r: usize| DVec3::new(rows[r][0], rows[r][1], rows[r][2]);
    let (x, y, z) = (axis(0), axis(1), axis(2));
    let turned = (x.cross(y) - z).length();
    let unit = [x, y].iter().all(|a| (a.length() - 1.0).abs() < 1e-6);
    let position = DVec3::new(rows[0][3], rows[1][3], rows[2][3]);
    if unit && turned < 1e-6 && x.dot(y).abs() < 1e-6 && is_place(position) {
        return Ok(());
    }
    let allowed = "a rotation and a place within 1e12 m";
    Err(Error::invalid(field, format!("{rows:?}"), allowed))
}

/// Ascending numbers as half-open ranges.
pub(crate) fn ranges(indices: impl IntoIterator<Item = u64>) -> Vec<[u64; 2]> {
    let mut ranges = Vec::new();
    for index in indices {
        extend(&mut ranges, index);
    }
    ranges
}

fn extend(ranges: &mut Vec<[u64; 2]>, index: u64) {
    match ranges.last_mut() {
        Some(last) if last[1] == index => last[1] += 1,
        _ => ranges.push([index, index + 1]),
    }
}

#[derive(Deserialize)]
struct Version {
    format_version: u32,
}
