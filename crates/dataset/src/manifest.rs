//! `dataset.json`.

mod records;
mod validate;

use std::collections::BTreeMap;

use nemoral_files::Folder;
use nemoral_scene::excerpt;
use serde::{Deserialize, Serialize};

pub use self::records::{FrameRecord, TrackRecord};

use crate::{DatasetHeader, Error, FileRecord, layout, limits, seal};

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
