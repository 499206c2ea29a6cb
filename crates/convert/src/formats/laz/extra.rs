//! Extra dimensions: what a data set knows of a point beyond what LAS has a place for.
//!
//! Source: LAS specification 1.4 R15 (ASPRS), table 24.

use super::bytes::Bytes;
use super::file::LazPoint;

/// A type of values, by the specification's number.
#[derive(Clone, Copy)]
enum Kind {
    U8 = 1,
    U32 = 5,
    I32 = 6,
    F32 = 9,
}

impl Kind {
    fn bytes(self) -> u16 {
        match self {
            Self::U8 => 1,
            Self::U32 | Self::I32 | Self::F32 => 4,
        }
    }
}

/// Bytes of a name and of a description in the record. Both are shorter, as some readers want a
/// zero at the end.
const TEXT_BYTES: usize = 32;
/// Names, types and descriptions, in the order of [`put`].
const DIMENSIONS: [(&str, Kind, &str); 12] = [
    ("class", Kind::U8, "number of the class, classes.md"),
    ("semantic", Kind::U8, "number of semantic, classes.md"),
    ("instance", Kind::U32, "image_id of the tables, 0: none"),
    ("chunk_x", Kind::I32, "chunk of the object, eastwards"),
    ("chunk_y", Kind::I32, "chunk of the object, northwards"),
    ("treeID", Kind::U32, "row of trees.csv, 0: no tree"),
    ("ring", Kind::U8, "number of the laser or line"),
    ("pulse", Kind::U32, "number of the pulse in its scan"),
    ("range", Kind::F32, "measured range, m"),
    ("range_true", Kind::F32, "true range, m, 0: false alarm"),
    ("incidence_cos", Kind::F32, "cosine of the incidence"),
    ("flags", Kind::U8, "bits, as in files.md (scans)"),
];

/// Bytes of a point's extra dimensions.
pub(super) fn bytes_per_point() -> u16 {
    DIMENSIONS.iter().map(|(_, kind, _)| kind.bytes()).sum()
}

/// The record that describes them.
pub(super) fn record() -> Vec<u8> {
    let mut out = Bytes::default();
    for (name, kind, description) in DIMENSIONS {
        out.bytes(&[0, 0, kind as u8, 0]).text(name, TEXT_BYTES);
        // No value stands for nothing; no limits, scale or offset are given.
        out.bytes(&[0; 4 + 5 * 24]).text(description, TEXT_BYTES);
    }
    out.0
}

/// Appends a point's values.
pub(super) fn put(out: &mut Bytes, p: &LazPoint<'_>) {
    let point = &p.recorded.point;
    let chunk = point.object.chunk();
    out.bytes(&[p.recorded.class, point.semantic as u8])
        .u32(point.object.to_image_id())
        .i32(chunk.x)
        .i32(chunk.y)
        .u32(p.tree)
        .bytes(&[point.ring])
        .u32(point.pulse)
        .f32(point.range_m)
        .f32(point.true_range_m)
        .f32(point.incidence_cos)
        .bytes(&[point.flags.0]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_dimension_has_a_name_and_a_description_that_fit() {
        assert_eq!(record().len(), 192 * DIMENSIONS.len());
        for (name, _, description) in DIMENSIONS {
            for text in [name, description] {
                assert!(
                    text.is_ascii() && (1..TEXT_BYTES).contains(&text.len()),
                    "{text}"
                );
            }
        }
    }
}
