//! PNG files that are not in the data set.

use nemoral_scene::Image;
use png::{BitDepth, ColorType};

/// 8-bit grey, a number for each pixel, such as a class's id.
pub(crate) fn encode_grey(image: &Image<u8>) -> Vec<u8> {
    let (width, height) = (image.width(), image.height());
    let (grey, eight) = (ColorType::Grayscale, BitDepth::Eight);
    encode(width, height, grey, eight, None, image.pixels())
}

/// A PNG of the given kind; `data` is row by row, 16-bit samples big-endian.
pub(crate) fn encode(
    width: usize,
    height: usize,
    colour: ColorType,
    depth: BitDepth,
    palette: Option<Vec<u8>>,
    data: &[u8],
) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width as u32, height as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Fast);
    if let Some(palette) = palette {
        encoder.set_palette(palette);
    }
    let mut writer = encoder.write_header().expect("the sides are 1..=16384");
    writer
        .write_image_data(data)
        .expect("the buffer has the image's size and memory takes it");
    writer.finish().expect("memory takes it");
    out
}
