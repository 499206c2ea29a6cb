//! A reader of LAS, by the specification's offsets. The crate `laz` unpacks points.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use laz::{LasZipDecompressor, LazVlr};
use nemoral_scene::glam::DVec3;

/// The bytes of a header.
const HEADER_BYTES: usize = 375;
/// The bytes of a point without extra dimensions.
const POINT_BYTES: usize = 30;

pub(crate) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes[at..at + 2].try_into().expect("two"))
}

pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"))
}

pub(crate) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight"))
}

pub(crate) fn f64_at(bytes: &[u8], at: usize) -> f64 {
    f64::from_bits(u64_at(bytes, at))
}

fn text_at(bytes: &[u8], at: usize, length: usize) -> String {
    let text = bytes[at..at + length].split(|b| *b == 0).next();
    String::from_utf8(text.expect("a text").to_vec()).expect("UTF-8")
}

/// A file.
pub(crate) struct LasFile {
    /// All of its bytes.
    pub(crate) bytes: Vec<u8>,
    /// The text of its coordinate reference system.
    pub(crate) wkt: Option<String>,
    stride: usize,
    unpacked: Vec<u8>,
    /// By name: where an extra dimension is in a point, and its description.
    extra: BTreeMap<String, (usize, String)>,
}

impl LasFile {
    pub(crate) fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("a file");
        let stride = usize::from(u16_at(&bytes, 105));
        let (mut at, mut position) = (HEADER_BYTES, POINT_BYTES);
        let (mut packing, mut extra, mut wkt) = (None, BTreeMap::new(), None);
        // The variable-length records: how points are packed, what their extra bytes are, and where
        // they lie.
        for _ in 0..u32_at(&bytes, 100) {
            let id = u16_at(&bytes, at + 18);
            let length = usize::from(u16_at(&bytes, at + 20));
            let data = &bytes[at + 54..][..length];
            match (&*text_at(&bytes, at + 2, 16), id) {
                ("laszip encoded", 22204) => {
                    packing = Some(LazVlr::from_buffer(data).expect("a record"))
                }
                ("LASF_Spec", 4) => {
                    for one in data.chunks(192) {
                        let described = (position, text_at(one, 160, 32));
                        extra.insert(text_at(one, 4, 32), described);
                        position += match one[2] {
                            1 => 1,
                            5 | 6 | 9 => 4,
                            other => panic!("type {other}"),
                        };
                    }
                }
                ("LASF_Projection", 2112) => {
                    assert_eq!(data.iter().position(|b| *b == 0), Some(length - 1));
                    assert_eq!(wkt.replace(text_at(data, 0, length)), None);
                }
                other => panic!("record {other:?}"),
            }
            at += 54 + length;
        }
        assert_eq!((at, position), (u32_at(&bytes, 96) as usize, stride));
        let length = stride * u64_at(&bytes, 247) as usize;
        let unpacked = unpack(&bytes, at, packing.expect("packed"), length);
        Self {
            bytes,
            wkt,
            stride,
            unpacked,
            extra,
        }
    }

    /// Three numbers of the header that are `by` bytes apart.
    pub(crate) fn vector(&self, at: usize, by: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|i| f64_at(&self.bytes, at + by * i)))
    }

    /// The names of extra dimensions with their descriptions.
    pub(crate) fn descriptions(&self) -> impl Iterator<Item = (&str, &str)> {
        let extra = self.extra.iter();
        extra.map(|(name, (_, description))| (&**name, &**description))
    }

    pub(crate) fn points(&self) -> impl ExactSizeIterator<Item = LasPoint<'_>> {
        let records = self.unpacked.chunks(self.stride);
        records.map(|record| LasPoint { file: self, record })
    }
}

fn unpack(bytes: &[u8], at: usize, packing: LazVlr, length: usize) -> Vec<u8> {
    let mut source = Cursor::new(bytes);
    source.set_position(at as u64);
    let mut unpacked = vec![0; length];
    let mut laz = LasZipDecompressor::new(source, packing).expect("packed");
    laz.decompress_many(&mut unpacked).expect("points");
    unpacked
}

/// A point of a file.
#[derive(Clone, Copy)]
pub(crate) struct LasPoint<'a> {
    file: &'a LasFile,
    record: &'a [u8],
}

impl LasPoint<'_> {
    pub(crate) fn position_m(&self) -> DVec3 {
        let steps = [0, 4, 8].map(|at| f64::from(u32_at(self.record, at) as i32));
        DVec3::from_array(steps) * self.file.vector(131, 8) + self.file.vector(155, 8)
    }

    pub(crate) fn intensity(&self) -> u16 {
        u16_at(self.record, 12)
    }

    /// The number of the return, and how many there are.
    pub(crate) fn returns(&self) -> (u8, u8) {
        (self.record[14] & 15, self.record[14] >> 4)
    }

    /// Flags of the class, the scanner's channel, and flags of the scan.
    pub(crate) fn channel(&self) -> (u8, u8, u8) {
        let flags = self.record[15];
        (flags & 15, flags >> 4 & 3, flags >> 6)
    }

    pub(crate) fn class(&self) -> u8 {
        self.record[16]
    }

    pub(crate) fn user_data(&self) -> u8 {
        self.record[17]
    }

    /// From straight down, negative to the left.
    pub(crate) fn angle_deg(&self) -> f64 {
        f64::from(u16_at(self.record, 18) as i16) * 0.006
    }

    pub(crate) fn source(&self) -> u16 {
        u16_at(self.record, 20)
    }

    pub(crate) fn time_s(&self) -> f64 {
        f64_at(self.record, 22)
    }

    fn at(&self, name: &str) -> usize {
        self.file.extra[name].0
    }

    pub(crate) fn u8(&self, name: &str) -> u8 {
        self.record[self.at(name)]
    }

    pub(crate) fn u32(&self, name: &str) -> u32 {
        u32_at(self.record, self.at(name))
    }

    pub(crate) fn i32(&self, name: &str) -> i32 {
        self.u32(name) as i32
    }

    pub(crate) fn f32(&self, name: &str) -> f32 {
        f32::from_bits(self.u32(name))
    }
}
