//! NumPy's array files, as far as depth images need them: version 1.0, `<f4`, two dimensions.

use std::path::Path;

use nemoral_scene::Image;

use crate::Error;
use crate::formats::Size;

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// A NumPy array file of shape (height, width), `<f4`.
#[must_use]
pub fn encode(image: &Image<f32>) -> Vec<u8> {
    let mut header = dictionary(image.width(), image.height());
    // Data starts at a multiple of 64 bytes; the header ends with a line feed.
    let used = MAGIC.len() + 2 + header.len() + 1;
    header.extend(std::iter::repeat_n(b' ', used.next_multiple_of(64) - used));
    header.push(b'\n');
    let mut out = MAGIC.to_vec();
    out.extend_from_slice(&(header.len() as u16).to_le_bytes());
    out.extend_from_slice(&header);
    for z in image.pixels() {
        out.extend_from_slice(&z.to_le_bytes());
    }
    out
}

fn dictionary(width: usize, height: usize) -> Vec<u8> {
    format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}), }}")
        .into_bytes()
}

/// The image, if the file is what [`encode`] makes of depth: 0 or more, maybe infinite.
pub(crate) fn decode(path: &Path, bytes: &[u8], size: Size) -> Result<Image<f32>, Error> {
    let image = parse(bytes)
        .filter(|image| (image.width(), image.height()) == size)
        .ok_or_else(|| {
            Error::malformed(
                path,
                format!(
                    "is not a .npy 1.0 file of {} × {} '<f4' in C order",
                    size.1, size.0
                ),
            )
        })?;
    let depths_m = 0.0..=f32::INFINITY;
    if let Some(i) = image.pixels().iter().position(|z| !depths_m.contains(z)) {
        let (column, row, z) = (i % size.0, i / size.0, image.pixels()[i]);
        let message = format!("depth = {z} m in column {column}, row {row}: must be 0 or more");
        return Err(Error::malformed(path, message));
    }
    Ok(image)
}

fn parse(bytes: &[u8]) -> Option<Image<f32>> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (length, rest) = rest.split_first_chunk::<2>()?;
    let (header, data) = rest.split_at_checked(usize::from(u16::from_le_bytes(*length)))?;
    let text = std::str::from_utf8(header).ok()?;
    let shape = text.split_once("'shape': (")?.1.split_once(')')?.0;
    let (height, width) = shape.split_once(',')?;
    let (height, width) = (height.trim().parse().ok()?, width.trim().parse().ok()?);
    let plain = text.trim_end().as_bytes() == dictionary(width, height);
    let (words, tail) = data.as_chunks::<4>();
    (plain && tail.is_empty() && Some(words.len()) == width.checked_mul(height)).then(|| {
        let values = words.iter().map(|&b| f32::from_le_bytes(b));
        Image::new(width, height, values.collect())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comes_back_and_starts_aligned() {
        for (w, h) in [(1, 1), (3, 2), (1280, 1)] {
            let image = Image::new(w, h, (0..w * h).map(|i| i as f32 * 0.3).collect());
            let bytes = encode(&image);
            assert_eq!((bytes.len() - 4 * w * h) % 64, 0);
            assert_eq!(
                decode(Path::new("x"), &bytes, (w, h)).expect("valid"),
                image
            );
            assert!(decode(Path::new("x"), &bytes[..bytes.len() - 1], (w, h)).is_err());
        }
        assert!(decode(Path::new("x"), b"\x93NUMPY\x01\x00\xff", (1, 1)).is_err());
    }

    #[test]
    fn what_is_no_depth_is_refused_by_its_pixel() {
        let read = |z| {
            let image = Image::new(3, 2, vec![1.0, 0.0, f32::INFINITY, -0.0, 5.0, z]);
            decode(Path::new("x.npy"), &encode(&image), (3, 2))
        };
        for z in [0.0, 1e-9, f32::INFINITY] {
            assert_eq!(*read(z).expect("a depth").at(2, 1), z);
        }
        for z in [f32::NAN, -1e-9, f32::NEG_INFINITY] {
            let error = read(z).expect_err("no depth").to_string();
            let told = format!("x.npy: depth = {z} m in column 2, row 1: must be 0 or more");
            assert_eq!(error, told);
        }
    }
}
