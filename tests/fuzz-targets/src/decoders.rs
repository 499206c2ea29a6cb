//! Single files of a data set.
//!
//! The input of a picture begins with what `dataset.json` would say about it: its kind, its columns
//! and its rows. Rows and columns are a byte each, that is 1 to 256, and 16 or 32 times that if the
//! kind's bits 6 or 7 are set.

use nemoral_dataset::{Error, fuzz};

/// The kind and the size that an input starts with, and the rest.
fn picture(input: &[u8]) -> Option<(u8, (usize, usize), &[u8])> {
    let ([kind, columns, rows], bytes) = input.split_first_chunk()?;
    let scale = [1, 16, 32, 32][usize::from(kind >> 6)];
    let side = |byte: &u8| (usize::from(*byte) + 1) * scale;
    Some((kind & 0x3f, (side(columns), side(rows)), bytes))
}

fn text(input: &[u8]) -> Option<&str> {
    std::str::from_utf8(input).ok()
}

/// Decodes all kinds of PNG.
pub fn png(input: &[u8]) {
    if let Some((kind, size, bytes)) = picture(input) {
        let _ = fuzz::png(kind, bytes, size);
    }
}

/// Decodes depth as `.npy`.
pub fn npy(input: &[u8]) {
    if let Some((_, size, bytes)) = picture(input) {
        let _ = fuzz::npy(bytes, size);
    }
}

/// Decodes radiance as `.exr`.
pub fn exr(input: &[u8]) {
    if let Some((_, size, bytes)) = picture(input) {
        let _ = fuzz::exr(bytes, size);
    }
}

/// Reads a scan. An accepted one is as long as when it is written.
pub fn ply(input: &[u8]) {
    if let Ok(written) = fuzz::ply(input) {
        assert_eq!(written.len(), input.len(), "a scan has one form");
    }
}

/// Reads a `.bin` file of points.
pub fn bin(input: &[u8]) {
    let _ = fuzz::points(input);
}

/// Reads a `.label` file.
pub fn label(input: &[u8]) {
    let _ = fuzz::labels(input);
}

/// Reads a `poses.txt`.
pub fn poses(input: &[u8]) {
    let _ = text(input).map(fuzz::poses);
}

/// Reads a `calib.txt`. An accepted one can be written and read again.
pub fn calib(input: &[u8]) {
    if let Some(Ok(written)) = text(input).map(fuzz::calibration) {
        let again = fuzz::calibration(&written);
        assert_eq!(again.expect("what was written is read"), written);
    }
}

/// Reads a `times.txt`.
pub fn times(input: &[u8]) {
    let _ = text(input).map(fuzz::times);
}

/// Reads a `trees.csv`. An accepted one can be written and read again.
pub fn trees(input: &[u8]) {
    table(input, fuzz::trees);
}

/// Reads an `instances.csv`. An accepted one can be written and read again.
pub fn instances(input: &[u8]) {
    table(input, fuzz::objects);
}

/// Reads a `deadwood.csv`. An accepted one can be written and read again.
pub fn deadwood(input: &[u8]) {
    table(input, fuzz::deadwood);
}

/// Reads the samples and the true states of an inertial measurement unit, which are separated by a
/// byte 0.
pub fn imu(input: &[u8]) {
    let text = text(input).unwrap_or_default();
    let (samples, states) = text.split_once('\0').unwrap_or((text, ""));
    let _ = fuzz::imu(samples, states);
}

fn table(input: &[u8], rewritten: fn(&str) -> Result<String, Error>) {
    if let Some(Ok(written)) = text(input).map(rewritten) {
        let again = rewritten(&written);
        assert_eq!(again.expect("what was written is read"), written);
    }
}

/// Reads boxes.
pub fn boxes(input: &[u8]) {
    let _ = fuzz::boxes(input);
}
