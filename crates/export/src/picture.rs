//! Textures and masks as PNG files.

use std::collections::BTreeMap;
use std::sync::Arc;

use nemoral_scene::{AlphaMask, Material, Texture};
use rayon::prelude::*;

/// The longest side of a picture, pixels.
const MOST_SIDE: usize = 8192;

/// The pictures of materials: one for each texture with its mask, told apart by where they are.
#[derive(Default)]
pub(crate) struct Pictures<'a> {
    pairs: Vec<(&'a Texture, Option<&'a AlphaMask>)>,
    numbers: BTreeMap<(usize, usize), usize>,
}

impl<'a> Pictures<'a> {
    /// The number of a material's picture. New ones are numbered in turn.
    pub(crate) fn number(&mut self, material: &'a Material) -> usize {
        let mask = material.mask.as_ref();
        let place = (
            Arc::as_ptr(&material.albedo) as usize,
            mask.map_or(0, |mask| Arc::as_ptr(mask) as usize),
        );
        *self.numbers.entry(place).or_insert_with(|| {
            self.pairs
                .push((&material.albedo, mask.map(|mask| &**mask)));
            self.pairs.len() - 1
        })
    }

    /// Their PNG files, in order, and whether each has a mask.
    pub(crate) fn files(&self) -> Vec<(Vec<u8>, bool)> {
        let file = |&(texture, mask): &(_, Option<_>)| (png(texture, mask), mask.is_some());
        self.pairs.par_iter().map(file).collect()
    }
}

/// A texture as PNG: RGBA with the mask as alpha, 0 or 255, or RGB without a mask. Row 0 is that
/// at v = 0.
///
/// With a mask, the picture has a whole number of pixels for each of its texels, and at least one
/// for each of the texture's, up to the longest side.
fn png(texture: &Texture, mask: Option<&AlphaMask>) -> Vec<u8> {
    let width = side(texture.width(), mask.map(AlphaMask::width));
    let height = side(texture.height(), mask.map(AlphaMask::height));
    let channels = if mask.is_some() { 4 } else { 3 };
    let mut pixels = Vec::with_capacity(width * height * channels);
    let texels = texture.srgb();
    for row in 0..height {
        let from = row * texture.height() / height * texture.width();
        for column in 0..width {
            let [r, g, b, _] = texels[from + column * texture.width() / width];
            pixels.extend([r, g, b]);
            if let Some(mask) = mask {
                let at = (column * mask.width() / width, row * mask.height() / height);
                pixels.push(if mask.texel(at.0, at.1) { 255 } else { 0 });
            }
        }
    }
    let colour = if mask.is_some() {
        png::ColorType::Rgba
    } else {
        png::ColorType::Rgb
    };
    encode((width, height), colour, png::BitDepth::Eight, &pixels)
}

/// A PNG file of big-endian samples.
pub(crate) fn encode(
    (width, height): (usize, usize),
    colour: png::ColorType,
    depth: png::BitDepth,
    samples: &[u8],
) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    let written = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(samples));
    written.expect("there are as many samples as pixels, and memory takes them all");
    file
}

/// The side of a picture of a texture and a mask with so many texels.
fn side(texels: usize, of_mask: Option<usize>) -> usize {
    let Some(of_mask) = of_mask else {
        return texels.min(MOST_SIDE);
    };
    let most = (MOST_SIDE / of_mask).max(1);
    of_mask * texels.div_ceil(of_mask).min(most)
}

#[cfg(test)]
mod tests {
    use nemoral_scene::glam::Vec3;

    use super::*;

    #[test]
    fn each_texel_of_a_mask_is_whole_pixels() {
        let texture = Texture::from_linear(2, 1, &[Vec3::X, Vec3::Z]).expect("sides");
        let mask = AlphaMask::from_fn(3, 2, |c, r| c == r).expect("sides");
        let file = png(&texture, Some(&mask));
        let mut reader = png::Decoder::new(std::io::Cursor::new(file))
            .read_info()
            .expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("small")];
        let info = reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!((info.width, info.height), (3, 2));
        let alpha: Vec<u8> = pixels.iter().skip(3).step_by(4).copied().collect();
        assert_eq!(alpha[..3], [255, 0, 0]);
        assert_eq!(alpha[3..], [0, 255, 0]);
        assert_eq!(pixels[..3], [255, 0, 0]);
        assert_eq!(pixels[8..11], [0, 0, 255]);
    }

    #[test]
    fn sides_are_multiples_of_the_masks() {
        assert_eq!(side(9_000, None), MOST_SIDE);
        assert_eq!(side(2, Some(64)), 64);
        assert_eq!(side(65, Some(64)), 128);
        // More than the longest side would be needed for every texel of the texture.
        assert_eq!(side(8_000, Some(3_000)), 6_000);
        assert_eq!(side(4, Some(9_000)), 9_000);
    }
}
