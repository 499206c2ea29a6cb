//! `.bin` and `.label`: SemanticKITTI's scans.

use std::path::Path;

use crate::{Error, PlyPoint};

/// x, y, z, intensity; little-endian f32.
pub(crate) fn encode_points(points: &[PlyPoint]) -> Vec<u8> {
    let mut out = Vec::with_capacity(16 * points.len());
    for p in points {
        let [x, y, z] = p.point.position_m.to_array();
        for value in [x, y, z, p.point.intensity] {
            out.extend_from_slice(&value.to_le_bytes());
        }
    }
    out
}

/// Class in the lower, instance in the upper 16 bits; little-endian u32.
pub(crate) fn encode_labels(points: &[PlyPoint]) -> Vec<u8> {
    let word = |p: &PlyPoint| u32::from(p.class) | u32::from(p.label) << 16;
    points.iter().flat_map(|p| word(p).to_le_bytes()).collect()
}

/// The points of a file.
pub(crate) fn decode_points(path: &Path, bytes: &[u8]) -> Result<Vec<[f32; 4]>, Error> {
    let words = words(path, bytes)?;
    let (points, rest) = words.as_chunks::<4>();
    if rest.is_empty() {
        Ok(points.iter().map(|p| p.map(f32::from_bits)).collect())
    } else {
        Err(Error::malformed(
            path,
            "its size is no multiple of 16 bytes",
        ))
    }
}

/// The (class, instance) pairs of a file.
pub(crate) fn decode_labels(path: &Path, bytes: &[u8]) -> Result<Vec<(u16, u16)>, Error> {
    let split = |w: u32| (w as u16, (w >> 16) as u16);
    Ok(words(path, bytes)?.into_iter().map(split).collect())
}

fn words(path: &Path, bytes: &[u8]) -> Result<Vec<u32>, Error> {
    match bytes.as_chunks::<4>() {
        (words, []) => Ok(words.iter().map(|&w| u32::from_le_bytes(w)).collect()),
        _ => Err(Error::malformed(path, "its size is no multiple of 4 bytes")),
    }
}
