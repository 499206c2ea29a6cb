//! The image files: RGB, class palette, 24-bit instances, depth, normals.
//!
//! Compression is chosen by measurement. Images that vary smoothly are Paeth-filtered and
//! compressed by fdeflate: on rendered scenes the files are as small as with zlib's level 1 (within
//! 6 %; 18 % larger on pure texture), and about three times as fast. Images of flat patches are not
//! filtered and compressed at level 1, which makes them 7 to 30 % smaller than filtered ones. On
//! the synthetic foliage of `examples/measure.rs` the five images of 1280 × 720 take 70 ms, best of
//! four.

use std::io::Cursor;
use std::path::Path;

use nemoral_scene::glam::Vec3;
use nemoral_scene::{Flow, Image, Intrinsics, ObjectId, Ontology, Semantic};
use png::{BitDepth, ColorType, DeflateCompression, Filter};

use crate::Error;
use crate::formats::Size;
use crate::formats::{annotations, exif};

#[derive(Clone, Copy)]
enum Content {
    /// Neighbours differ a little.
    Smooth,
    /// Neighbours are equal, or have nothing in common.
    Patches,
}

struct Format {
    colour: ColorType,
    depth: BitDepth,
    content: Content,
    palette: Option<Vec<u8>>,
    srgb: bool,
    exif: Option<Vec<u8>>,
}

fn encode(width: usize, height: usize, format: Format, data: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(data.len() / 2);
    let mut info = png::Info::with_size(width as u32, height as u32);
    info.exif_metadata = format.exif.map(Into::into);
    let encoder = png::Encoder::with_info(&mut out, info);
    let mut encoder = encoder.expect("pictures are not animated");
    encoder.set_color(format.colour);
    encoder.set_depth(format.depth);
    let (filter, compression) = match format.content {
        Content::Smooth => (Filter::Paeth, DeflateCompression::FdeflateUltraFast),
        Content::Patches => (Filter::NoFilter, DeflateCompression::Level(1)),
    };
    encoder.set_filter(filter);
    encoder.set_deflate_compression(compression);
    if let Some(palette) = format.palette {
        encoder.set_palette(palette);
    }
    if format.srgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    }
    let mut writer = encoder.write_header().expect("the sides are 1..=16384");
    writer
        .write_image_data(data)
        .expect("the buffer has the image's size and memory takes it");
    writer.finish().expect("memory takes it");
    out
}

/// 8-bit sRGB, with the pinhole in its metadata if there is one.
pub(crate) fn encode_rgb(rgb: &Image<[u8; 3]>, intrinsics: Option<&Intrinsics>) -> Vec<u8> {
    let format = Format {
        colour: ColorType::Rgb,
        depth: BitDepth::Eight,
        content: Content::Smooth,
        palette: None,
        srgb: true,
        exif: intrinsics.map(exif::encode),
    };
    encode(
        rgb.width(),
        rgb.height(),
        format,
        rgb.pixels().as_flattened(),
    )
}

/// 8-bit palette: the index is the class id, the palette has the class colours.
pub(crate) fn encode_semantic(semantic: &Image<Semantic>, ontology: &Ontology) -> Vec<u8> {
    let last = ontology.classes().iter().map(|c| c.id).max().unwrap_or(0);
    let mut palette = vec![0; 3 * (usize::from(last) + 1)];
    for class in ontology.classes() {
        let at = 3 * usize::from(class.id);
        palette[at..at + 3].copy_from_slice(&class.colour);
    }
    let ids = class_ids(ontology);
    let data: Vec<u8> = semantic.pixels().iter().map(|&s| ids[s as usize]).collect();
    let format = Format {
        colour: ColorType::Indexed,
        depth: BitDepth::Eight,
        content: Content::Patches,
        palette: Some(palette),
        srgb: false,
        exif: None,
    };
    encode(semantic.width(), semantic.height(), format, &data)
}

/// The class id of every fine semantic.
pub(crate) fn class_ids(ontology: &Ontology) -> [u8; Semantic::ALL.len()] {
    std::array::from_fn(|i| ontology.class(Semantic::ALL[i]).id)
}

/// 8-bit RGB; the id is R + 256 G + 65536 B.
pub(crate) fn encode_instance(object: &Image<ObjectId>) -> Vec<u8> {
    let mut data = Vec::with_capacity(3 * object.pixels().len());
    for id in object.pixels() {
        let [r, g, b, _] = id.to_image_id().to_le_bytes();
        data.extend_from_slice(&[r, g, b]);
    }
    let format = Format {
        colour: ColorType::Rgb,
        depth: BitDepth::Eight,
        content: Content::Patches,
        palette: None,
        srgb: false,
        exif: None,
    };
    encode(object.width(), object.height(), format, &data)
}

/// Metres × 256, to nearest; 0 for no surface, at least 1 for a surface, at most 65535.
pub(crate) fn depth_to_u16(depth_m: f32) -> u16 {
    if depth_m > 0.0 {
        // Both ends saturate; the cast does so at the upper one.
        ((depth_m * 256.0).round() as u16).max(1)
    } else {
        0
    }
}

/// 16-bit grey.
pub(crate) fn encode_depth(depth_m: &Image<f32>) -> Vec<u8> {
    let mut data = Vec::with_capacity(2 * depth_m.pixels().len());
    for &z in depth_m.pixels() {
        data.extend_from_slice(&depth_to_u16(z).to_be_bytes());
    }
    let format = Format {
        colour: ColorType::Grayscale,
        depth: BitDepth::Sixteen,
        content: Content::Smooth,
        palette: None,
        srgb: false,
        exif: None,
    };
    encode(depth_m.width(), depth_m.height(), format, &data)
}

/// round(127.5 (n + 1)); (0, 0, 0), which no unit vector gives, for no surface.
pub(crate) fn normal_to_rgb(n: Vec3) -> [u8; 3] {
    if n == Vec3::ZERO || !n.is_finite() {
        return [0; 3];
    }
    ((n + Vec3::ONE) * 127.5)
        .to_array()
        .map(|c| c.round() as u8)
}

/// The normal of a colour, within 0.4° of the one that was written.
pub(crate) fn normal_from_rgb(rgb: [u8; 3]) -> Vec3 {
    if rgb == [0; 3] {
        return Vec3::ZERO;
    }
    let n = Vec3::from_array(rgb.map(f32::from)) / 127.5 - Vec3::ONE;
    n.normalize_or_zero()
}

/// 8-bit RGB.
pub(crate) fn encode_normals(normal: &Image<Vec3>) -> Vec<u8> {
    let data = normal.map(|&n| normal_to_rgb(n));
    let format = Format {
        colour: ColorType::Rgb,
        depth: BitDepth::Eight,
        content: Content::Patches,
        palette: None,
        srgb: false,
        exif: None,
    };
    encode(
        data.width(),
        data.height(),
        format,
        data.pixels().as_flattened(),
    )
}

/// 8-bit grey.
pub(crate) fn encode_mask(mask: &Image<u8>) -> Vec<u8> {
    let format = Format {
        colour: ColorType::Grayscale,
        depth: BitDepth::Eight,
        content: Content::Patches,
        palette: None,
        srgb: false,
        exif: None,
    };
    encode(mask.width(), mask.height(), format, mask.pixels())
}

/// 16-bit RGB, KITTI's flow.
pub(crate) fn encode_flow(flow: &Image<Option<Flow>>) -> Vec<u8> {
    let mut data = Vec::with_capacity(6 * flow.pixels().len());
    for sample in flow
        .pixels()
        .iter()
        .flat_map(|f| annotations::flow_to_samples(*f))
    {
        data.extend_from_slice(&sample.to_be_bytes());
    }
    let format = Format {
        colour: ColorType::Rgb,
        depth: BitDepth::Sixteen,
        content: Content::Smooth,
        palette: None,
        srgb: false,
        exif: None,
    };
    encode(flow.width(), flow.height(), format, &data)
}

/// The raw samples of a PNG of one kind, row by row.
fn decode(
    path: &Path,
    bytes: &[u8],
    colour: ColorType,
    depth: BitDepth,
    (width, height): Size,
) -> Result<Vec<u8>, Error> {
    let bad = |e: &dyn std::fmt::Display| Error::malformed(path, e);
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::IDENTITY);
    // Text chunks are not needed, and may be compressed to a thousandth of their size.
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    // This is checked before memory is allocated.
    let found = decoder.read_header_info().map_err(|e| bad(&e))?;
    let (w, h) = (found.width as usize, found.height as usize);
    if (w, h) != (width, height) {
        let message = format!("is {w} × {h} pixels, the camera has {width} × {height}");
        return Err(bad(&message));
    }
    let mut reader = decoder.read_info().map_err(|e| bad(&e))?;
    let size = reader
        .output_buffer_size()
        .ok_or_else(|| bad(&"the image is too large for this machine"))?;
    if reader.output_color_type() != (colour, depth) {
        return Err(bad(&format!(
            "is {:?}, must be {:?}",
            reader.output_color_type(),
            (colour, depth)
        )));
    }
    let mut data = vec![0; size];
    reader.next_frame(&mut data).map_err(|e| bad(&e))?;
    Ok(data)
}

/// An 8-bit RGB image.
pub(crate) fn decode_rgb(path: &Path, bytes: &[u8], size: Size) -> Result<Image<[u8; 3]>, Error> {
    let data = decode(path, bytes, ColorType::Rgb, BitDepth::Eight, size)?;
    let (pixels, _) = data.as_chunks::<3>();
    Ok(Image::new(size.0, size.1, pixels.to_vec()))
}

/// Class ids.
pub(crate) fn decode_semantic(path: &Path, bytes: &[u8], size: Size) -> Result<Image<u8>, Error> {
    let data = decode(path, bytes, ColorType::Indexed, BitDepth::Eight, size)?;
    Ok(Image::new(size.0, size.1, data))
}

/// 24-bit instance ids.
pub(crate) fn decode_instance(path: &Path, bytes: &[u8], size: Size) -> Result<Image<u32>, Error> {
    Ok(decode_rgb(path, bytes, size)?.map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 0])))
}

/// Metres.
pub(crate) fn decode_depth(path: &Path, bytes: &[u8], size: Size) -> Result<Image<f32>, Error> {
    let data = decode(path, bytes, ColorType::Grayscale, BitDepth::Sixteen, size)?;
    let (words, _) = data.as_chunks::<2>();
    let metres = words
        .iter()
        .map(|&b| f32::from(u16::from_be_bytes(b)) / 256.0);
    Ok(Image::new(size.0, size.1, metres.collect()))
}

/// 0 or 255.
pub(crate) fn decode_mask(path: &Path, bytes: &[u8], size: Size) -> Result<Image<u8>, Error> {
    let data = decode(path, bytes, ColorType::Grayscale, BitDepth::Eight, size)?;
    Ok(Image::new(size.0, size.1, data))
}

/// Flow to the next frame.
pub(crate) fn decode_flow(
    path: &Path,
    bytes: &[u8],
    size: Size,
) -> Result<Image<Option<Flow>>, Error> {
    let data = decode(path, bytes, ColorType::Rgb, BitDepth::Sixteen, size)?;
    let (words, _) = data.as_chunks::<2>();
    let (samples, _) = words.as_chunks::<3>();
    let flow = samples
        .iter()
        .map(|s| annotations::flow_from_samples(s.map(u16::from_be_bytes)));
    Ok(Image::new(size.0, size.1, flow.collect()))
}

/// Unit normals.
pub(crate) fn decode_normals(path: &Path, bytes: &[u8], size: Size) -> Result<Image<Vec3>, Error> {
    Ok(decode_rgb(path, bytes, size)?.map(|&rgb| normal_from_rgb(rgb)))
}

/// Writes a picture as PNG; it appears under its name only when it is whole.
///
/// # Errors
/// [`Error::Io`] if it cannot be written.
pub fn write_png(path: &Path, rgb: &Image<[u8; 3]>) -> Result<(), Error> {
    Ok(nemoral_files::write(path, &encode_rgb(rgb, None))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn depth_is_nearest_and_a_surface_is_never_nothing(z in 1e-9_f32..400.0) {
            let code = depth_to_u16(z);
            prop_assert!(code >= 1);
            if z < 255.99 && z > 0.004 {
                prop_assert!((f32::from(code) / 256.0 - z).abs() <= 0.5 / 256.0 + 1e-5);
            }
            if z >= 256.0 {
                prop_assert_eq!(code, 65535);
            }
        }

        #[test]
        fn normals_come_back(x in -1.0_f32..1.0, y in -1.0_f32..1.0, z in -1.0_f32..1.0) {
            let Some(n) = Vec3::new(x, y, z).try_normalize() else { return Ok(()) };
            let back = normal_from_rgb(normal_to_rgb(n));
            prop_assert!(n.angle_between(back) < 0.4_f32.to_radians(), "{n} {back}");
        }
    }

    #[test]
    fn nothing_and_nonsense_have_codes_too() {
        for z in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(depth_to_u16(z), 0);
        }
        assert_eq!(depth_to_u16(f32::INFINITY), 65535);
        assert_eq!(normal_to_rgb(Vec3::ZERO), [0; 3]);
        assert_eq!(normal_to_rgb(Vec3::NAN), [0; 3]);
        assert_eq!(normal_to_rgb(-Vec3::Z), [128, 128, 0]);
    }

    #[test]
    fn another_kind_of_png_is_refused() {
        let rgb = encode_rgb(&Image::new(2, 1, vec![[1, 2, 3], [4, 5, 6]]), None);
        let path = Path::new("x.png");
        assert!(decode_semantic(path, &rgb, (2, 1)).is_err());
        let e = decode_depth(path, &rgb[..rgb.len() / 2], (2, 1)).expect_err("truncated");
        assert!(e.to_string().contains("x.png"), "{e}");
    }
}
