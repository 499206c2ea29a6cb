//! The decoders of single files as functions of their bytes. They exist for the fuzzers and for the
//! replay of their findings, and are not part of the crate's interface.

use std::path::Path;

use nemoral_files::Folder;

use crate::formats::Size;
use crate::formats::kitti::Calibration;
use crate::formats::{
    annotations, data_card, exr, images, kitti, npy, ontology_yaml, ply, scan, tables,
};
use crate::{DatasetHeader, Error, Manifest, imu, output::state, seal};

/// What errors call the file.
const NAME: &str = "input";

fn name() -> &'static Path {
    Path::new(NAME)
}

/// How many kinds of PNG there are.
pub const PNG_KINDS: u8 = 6;

/// A PNG: colour, classes, instances, depth, a mask, flow or normals.
///
/// # Errors
/// If the bytes are not a picture of that kind and size.
pub fn png(kind: u8, bytes: &[u8], size: Size) -> Result<(), Error> {
    match kind % PNG_KINDS {
        0 => images::decode_instance(name(), bytes, size).map(drop),
        1 => images::decode_semantic(name(), bytes, size).map(drop),
        2 => images::decode_depth(name(), bytes, size).map(drop),
        3 => images::decode_mask(name(), bytes, size).map(drop),
        4 => images::decode_flow(name(), bytes, size).map(drop),
        _ => images::decode_normals(name(), bytes, size).map(drop),
    }
}

/// A depth image as `.npy`.
///
/// # Errors
/// If the bytes are no such image of that size.
pub fn npy(bytes: &[u8], size: Size) -> Result<(), Error> {
    npy::decode(name(), bytes, size).map(drop)
}

/// A radiance image.
///
/// # Errors
/// If the bytes are no such image of that size.
pub fn exr(bytes: &[u8], size: Size) -> Result<(), Error> {
    exr::decode(name(), bytes, size).map(drop)
}

/// A scan; returns the bytes that are written for what was read.
///
/// # Errors
/// If the bytes are not a scan of this program.
pub fn ply(bytes: &[u8]) -> Result<Vec<u8>, Error> {
    ply::decode(name(), bytes).map(|points| ply::encode(&points))
}

/// `.bin`.
///
/// # Errors
/// If the bytes are not points.
pub fn points(bytes: &[u8]) -> Result<(), Error> {
    scan::decode_points(name(), bytes).map(drop)
}

/// `.label`.
///
/// # Errors
/// If the bytes are not labels.
pub fn labels(bytes: &[u8]) -> Result<(), Error> {
    scan::decode_labels(name(), bytes).map(drop)
}

/// `poses.txt`, and what is computed from it.
///
/// # Errors
/// If a line is not a matrix.
pub fn poses(text: &str) -> Result<(), Error> {
    let rows = kitti::decode_poses(name(), text)?;
    let poses: Vec<_> = rows.iter().map(kitti::from_rows).collect();
    for pair in poses.windows(2) {
        std::hint::black_box(kitti::relative(&pair[0], &pair[1]));
    }
    Ok(())
}

/// `calib.txt`; returns the text that is written for what was read.
///
/// # Errors
/// If lines are missing or are not matrices.
pub fn calibration(text: &str) -> Result<String, Error> {
    kitti::decode_calibration(name(), text).map(|c| kitti::encode_calibration(&c))
}

/// `times.txt`.
///
/// # Errors
/// If a line is not a number.
pub fn times(text: &str) -> Result<(), Error> {
    kitti::decode_times(name(), text).map(drop)
}

/// `trees.csv`; returns the text that is written for what was read.
///
/// # Errors
/// If the text is no such table.
pub fn trees(text: &str) -> Result<String, Error> {
    let rows = tables::read_tree_rows(name(), text)?;
    tables::trees(name(), &rows)?;
    Ok(tables::encode_trees(&rows))
}

/// `instances.csv`; returns the text that is written for what was read.
///
/// # Errors
/// If the text is no such table.
pub fn objects(text: &str) -> Result<String, Error> {
    let rows = tables::read_object_rows(name(), text)?;
    tables::objects(name(), &rows)?;
    Ok(tables::encode_objects(&rows))
}

/// `deadwood.csv`; returns the text that is written for what was read.
///
/// # Errors
/// If the text is no such table.
pub fn deadwood(text: &str) -> Result<String, Error> {
    let rows = tables::read_deadwood_rows(name(), text)?;
    tables::deadwood(name(), &rows)?;
    Ok(tables::encode_deadwood(&rows))
}

/// The samples and the true states of an inertial measurement unit.
///
/// # Errors
/// If the texts are no such tables.
pub fn imu(samples: &str, states: &str) -> Result<(), Error> {
    imu::readings((name(), samples), (name(), states)).map(drop)
}

/// Boxes.
///
/// # Errors
/// If the bytes are not such a table.
pub fn boxes(bytes: &[u8]) -> Result<(), Error> {
    let boxes = annotations::decode_boxes(name(), bytes)?;
    std::hint::black_box(annotations::encode_boxes(&boxes));
    Ok(())
}

/// All that is written from a manifest alone: itself, the card, the class table, the calibration.
#[must_use]
pub fn texts(manifest: &Manifest) -> [String; 4] {
    let classes = manifest.frames.last().map(|f| f.point_classes.clone());
    let header = &manifest.header;
    [
        manifest.to_json(),
        data_card::encode(manifest),
        ontology_yaml::encode(header, &classes.unwrap_or_default()),
        kitti::encode_calibration(&Calibration::of(&header.sequences[0])),
    ]
}

/// The header and the frames that an unfinished data set's state folder holds, whole or not.
///
/// # Errors
/// If it cannot be read or is not valid.
pub fn state(root: &Path) -> Result<Option<(DatasetHeader, usize)>, Error> {
    let folder = Folder::new(root);
    let Some(header) = state::header(&folder)? else {
        return Ok(None);
    };
    let records = state::records(&folder, &header)?;
    Ok(Some((header, records.len())))
}

/// A text with its seal, as stored in the state folder.
#[must_use]
pub fn seal(json: &str) -> String {
    seal::seal(json)
}

/// `dataset.json` with the checksum that it must have.
#[must_use]
pub fn stamp(text: &str) -> String {
    seal::stamp(text)
}
