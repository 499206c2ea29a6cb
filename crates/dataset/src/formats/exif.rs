//! Exif metadata of pictures: the focal length, from which photogrammetry starts.
//!
//! Source: Exif 3.0 (CIPA DC-008-2023), which is a TIFF 6.0 file without pictures. In PNG it is the
//! chunk `eXIf` (PNG, third edition).

use nemoral_scene::Intrinsics;

/// The width of the sensor whose focal length is given, mm: a pinhole in pixels has no size, and
/// focal lengths for this one are what photographers compare.
const SENSOR_MM: f64 = 36.0;

/// Types of TIFF fields.
const ASCII: u16 = 2;
const SHORT: u16 = 3;
const LONG: u16 = 4;
const RATIONAL: u16 = 5;

/// A field of a directory.
struct Field {
    tag: u16,
    kind: u16,
    count: u32,
    /// Up to four bytes, or more, which are stored elsewhere.
    value: Vec<u8>,
}

impl Field {
    fn short(tag: u16, value: u16) -> Self {
        Self::new(tag, SHORT, 1, value.to_le_bytes().to_vec())
    }

    fn long(tag: u16, value: u32) -> Self {
        Self::new(tag, LONG, 1, value.to_le_bytes().to_vec())
    }

    /// In steps of 1 / 1,000,000 below 4000, else in steps that fit.
    fn rational(tag: u16, value: f64) -> Self {
        let mut denominator = 1_000_000.0;
        while value * denominator > f64::from(u32::MAX) && denominator > 1.0 {
            denominator /= 10.0;
        }
        let mut bytes = ((value * denominator).round() as u32)
            .to_le_bytes()
            .to_vec();
        bytes.extend((denominator as u32).to_le_bytes());
        Self::new(tag, RATIONAL, 1, bytes)
    }

    fn text(tag: u16, text: &str) -> Self {
        let bytes: Vec<u8> = text.bytes().chain([0]).collect();
        Self::new(tag, ASCII, bytes.len() as u32, bytes)
    }

    const fn new(tag: u16, kind: u16, count: u32, value: Vec<u8>) -> Self {
        Self {
            tag,
            kind,
            count,
            value,
        }
    }
}

/// The metadata of a picture by this pinhole: maker and model, size, focal length, and the
/// resolution of the sensor, which together give the focal length in pixels.
pub(crate) fn encode(intrinsics: &Intrinsics) -> Vec<u8> {
    let width = f64::from(intrinsics.width);
    let pixels_per_cm = width / (0.1 * SENSOR_MM);
    let pixels_per_cm_down = pixels_per_cm * intrinsics.fy / intrinsics.fx;
    let mut out = b"II*\0".to_vec();
    out.extend(8_u32.to_le_bytes());
    let maker = |directory: u32| {
        vec![
            Field::text(0x010F, "nemoral"),
            Field::text(0x0110, "virtual camera"),
            // Where the Exif directory is.
            Field::long(0x8769, directory),
        ]
    };
    // The second directory follows the first, whatever it says about it.
    let mut first = Vec::new();
    write_directory(&mut first, 8, &maker(0));
    let second_at = 8 + first.len() as u32;
    write_directory(&mut out, 8, &maker(second_at));
    let exif = [
        // The version is written as four characters without an end.
        Field::new(0x9000, 7, 4, b"0300".to_vec()),
        Field::rational(0x920A, intrinsics.fx * SENSOR_MM / width),
        Field::long(0xA002, intrinsics.width),
        Field::long(0xA003, intrinsics.height),
        Field::rational(0xA20E, pixels_per_cm),
        Field::rational(0xA20F, pixels_per_cm_down),
        // Centimetres.
        Field::short(0xA210, 3),
    ];
    write_directory(&mut out, second_at, &exif);
    out
}

/// Appends a directory that begins `at` this offset, and the values that do not fit into it.
fn write_directory(out: &mut Vec<u8>, at: u32, fields: &[Field]) {
    let mut elsewhere = Vec::new();
    let elsewhere_at = at + 2 + 12 * fields.len() as u32 + 4;
    out.extend((fields.len() as u16).to_le_bytes());
    for field in fields {
        out.extend(field.tag.to_le_bytes());
        out.extend(field.kind.to_le_bytes());
        out.extend(field.count.to_le_bytes());
        if field.value.len() <= 4 {
            let mut value = field.value.clone();
            value.resize(4, 0);
            out.extend(value);
        } else {
            let offset = elsewhere_at + elsewhere.len() as u32;
            out.extend(offset.to_le_bytes());
            elsewhere.extend(&field.value);
            // Values begin at even offsets.
            if !elsewhere.len().is_multiple_of(2) {
                elsewhere.push(0);
            }
        }
    }
    // No further directory.
    out.extend([0; 4]);
    out.extend(elsewhere);
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn u16_at(bytes: &[u8], at: usize) -> u16 {
        u16::from_le_bytes(bytes[at..at + 2].try_into().expect("two"))
    }

    fn u32_at(bytes: &[u8], at: usize) -> u32 {
        u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"))
    }

    /// The numbers of a directory by tag, and whether tags are in order, as TIFF demands.
    fn directory(bytes: &[u8], at: usize) -> BTreeMap<u16, f64> {
        let entries = (0..usize::from(u16_at(bytes, at))).map(|i| at + 2 + 12 * i);
        let tags: Vec<u16> = entries.clone().map(|e| u16_at(bytes, e)).collect();
        assert!(tags.is_sorted());
        let value = |e: usize| match u16_at(bytes, e + 2) {
            SHORT => u16_at(bytes, e + 8).into(),
            LONG => u32_at(bytes, e + 8).into(),
            RATIONAL => {
                let at = u32_at(bytes, e + 8) as usize;
                f64::from(u32_at(bytes, at)) / f64::from(u32_at(bytes, at + 4))
            }
            _ => 0.0,
        };
        tags.into_iter().zip(entries.map(value)).collect()
    }

    #[test]
    fn the_focal_length_in_pixels_follows() {
        for (width, fov) in [(1280, 1.4), (64, 0.02), (8192, 2.9)] {
            let k = Intrinsics::from_fov(width, width / 2, fov).expect("valid");
            let bytes = encode(&k);
            assert_eq!(&bytes[..8], b"II*\0\x08\0\0\0");
            let first = directory(&bytes, 8);
            let exif = directory(&bytes, first[&0x8769] as usize);
            // The focal length times the sensor's resolution.
            let focal_px = exif[&0x920A] / 10.0 * exif[&0xA20E];
            assert!(
                (focal_px / k.fx - 1.0).abs() < 1e-5,
                "{focal_px} for {}",
                k.fx
            );
            assert_eq!((exif[&0xA002], exif[&0xA210]), (width.into(), 3.0));
        }
    }
}
