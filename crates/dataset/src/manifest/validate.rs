//! What a manifest must be for its names, sizes and poses to be relied on.

use std::collections::BTreeMap;

use nemoral_files::InnerPath;
use nemoral_scene::glam::DVec3;

use super::{FrameRecord, Manifest, TrackRecord, extend};
use crate::error::shown;
use crate::header::is_place;
use crate::{Error, FileRecord, SequenceSpec, layout, limits};

impl Manifest {
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
