//! A photographed sky from its file.

use std::io::Cursor;

use exr::math::Vec2;
use exr::meta::{BlockDescription, MetaData};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use nemoral_render::SkyImage;
use nemoral_scene::Image;
use nemoral_scene::glam::Vec3;

use super::{Error, InputFiles, Sky};

/// The most pixels of a sky image. A decoded pixel takes twelve bytes, or sixteen with opacity.
const MOST_PIXELS: u64 = 8192 * 4096;
/// The most bytes of a decoded image, of which two exist for a while.
const MOST_BYTES: u64 = 12 * MOST_PIXELS;

impl Sky {
    /// The photographed sky, if the table names one.
    ///
    /// # Errors
    /// If the file is not a Radiance or OpenEXR image of a sky, or is larger than the limit.
    pub fn photograph(&self, inputs: &InputFiles) -> Result<Option<SkyImage>, Error> {
        let Some(file) = inputs.get(&self.image) else {
            return Ok(None);
        };
        let refused = |why: &dyn std::fmt::Display| {
            Error::request(format!("sky.image = \"{}\": {why}", self.image))
        };
        let reader = ImageReader::new(Cursor::new(file.bytes()));
        let reader = reader.with_guessed_format().map_err(|e| refused(&e))?;
        // Images for screens have no values above white.
        if !matches!(
            reader.format(),
            Some(ImageFormat::Hdr | ImageFormat::OpenExr)
        ) {
            return Err(refused(&"must be a Radiance (.hdr) or OpenEXR (.exr) file"));
        }
        if reader.format() == Some(ImageFormat::OpenExr) {
            check_exr(file.bytes()).map_err(|e| refused(&e))?;
        }
        let mut decoder = reader.into_decoder().map_err(|e| refused(&e))?;
        // The header is checked before memory is allocated.
        let (width, height) = decoder.dimensions();
        if u64::from(width) * u64::from(height) > MOST_PIXELS {
            return Err(refused(&format!(
                "has {width} x {height} pixels: at most {MOST_PIXELS}, as of 8192 x 4096"
            )));
        }
        if decoder.total_bytes() > MOST_BYTES {
            let most = MOST_BYTES / 16;
            return Err(refused(&format!(
                "has {width} x {height} pixels with an opacity: at most {most} of such; write it \
                 without"
            )));
        }
        decoder
            .set_limits(Limits::default())
            .map_err(|e| refused(&e))?;
        let pixels = DynamicImage::from_decoder(decoder).map_err(|e| refused(&e))?;
        let pixels = pixels.into_rgb32f();
        let (width, height) = (pixels.width() as usize, pixels.height() as usize);
        let light = pixels.pixels().map(|p| Vec3::from_array(p.0)).collect();
        drop(pixels);
        SkyImage::new(&Image::new(width, height, light), self.image_azimuth_deg)
            .map(Some)
            .map_err(|e| refused(&e))
    }
}

/// Checks the sizes that an OpenEXR file declares. A decoder tells the display window alone, which
/// says nothing of the lines that are stored.
fn check_exr(bytes: &[u8]) -> Result<(), String> {
    let meta = MetaData::read_from_buffered(bytes, false).map_err(|e| e.to_string())?;
    for header in &meta.headers {
        let Vec2(width, height) = header.layer_size;
        let in_block = match header.blocks {
            BlockDescription::Tiles(tiles) => tiles.tile_size.area() as u64,
            BlockDescription::ScanLines => {
                (header.compression.scan_lines_per_block() * width) as u64
            }
        };
        let in_layer = (width * height) as u64;
        let bytes_of_block = in_block.saturating_mul(header.channels.bytes_per_pixel as u64);
        if in_layer > MOST_PIXELS || bytes_of_block > MOST_BYTES {
            return Err(format!(
                "has a layer of {width} x {height} pixels in blocks of {in_block}: at most \
                 {MOST_PIXELS}, as of 8192 x 4096"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use std::path::Path;

    fn read(path: &Path) -> Result<Option<SkyImage>, Error> {
        let mut config = Config::default();
        config.sky.image = path.to_string_lossy().as_ref().into();
        config.sky.photograph(&InputFiles::read(&config)?)
    }

    /// Found by fuzzing: the decoder took memory for a line of 268 million pixels.
    #[test]
    fn lines_that_are_longer_than_the_picture_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("sky.exr");
        let pixels = image::Rgb32FImage::from_pixel(64, 32, image::Rgb([1.0; 3]));
        pixels.save(&path).expect("written");
        let mut bytes = nemoral_files::read(&path, 1 << 20).expect("read");
        let name = b"dataWindow\0box2i\0";
        let window = (bytes.windows(name.len()).position(|w| w == name)).expect("a data window");
        // After the size of the box there are x and y of one corner, then x of the other.
        let right = window + name.len() + 4 + 8;
        assert_eq!(bytes[right..right + 4], 63_i32.to_le_bytes());
        bytes[right + 3] = 0x10;
        nemoral_files::write(&path, &bytes).expect("written");
        let text = read(&path).expect_err("too wide").to_string();
        assert!(
            text.contains("has a layer of 268435520 x 32 pixels"),
            "{text}"
        );
    }

    #[test]
    fn both_formats_are_read_and_light_comes_from_where_it_is() {
        let folder = tempfile::tempdir().expect("a folder");
        // The east is bright, which is three quarters of the width from the left edge (north is in
        // the middle).
        let pixel = |x: u32, _: u32| {
            let east = (40..56).contains(&x);
            image::Rgb(if east {
                [8.0, 6.0, 4.0]
            } else {
                [1.0, 1.0, 2.0]
            })
        };
        let pixels = image::Rgb32FImage::from_fn(64, 32, pixel);
        for name in ["sky.hdr", "sky.exr"] {
            let path = folder.path().join(name);
            pixels.save(&path).expect("written");
            let image = read(&path).unwrap_or_else(|e| panic!("{e}"));
            let image = image.expect("it names one");
            let sun = nemoral_render::Sun::from_angles(180.0, 40.0).expect("valid");
            let params = nemoral_render::SkyParams::default();
            let light = |gain| {
                nemoral_render::Lighting::photographed(&sun, &params, &image, gain).expect("valid")
            };
            let (one, two) = (light(1.0), light(2.0));
            let [east, west] = [Vec3::X, -Vec3::X].map(|n| one.sky_irradiance(n));
            assert!(east.y > 2.0 * west.y, "{name}: {east} {west}");
            let seen = one.sky_radiance(Vec3::new(0.8, 0.0, 0.6));
            assert!((seen.x / seen.z - 2.0).abs() < 0.05, "{name}: {seen}");
            // The image is as bright as the modelled sky times the gain; the sun does not change.
            let modelled = nemoral_render::Lighting::new(&sun, &params).expect("valid");
            let level = |l: &nemoral_render::Lighting| {
                l.sky_irradiance(Vec3::Z)
                    .dot(Vec3::new(0.2126, 0.7152, 0.0722))
            };
            assert!((level(&one) / level(&modelled) - 1.0).abs() < 1e-3);
            assert!((level(&two) / level(&modelled) - 2.0).abs() < 1e-3);
            assert_eq!(one.sun_irradiance(), modelled.sun_irradiance());
        }
    }

    #[test]
    fn errors_name_the_file_and_the_reason() {
        let folder = tempfile::tempdir().expect("a folder");
        let message = |name: &str, content: Option<&[u8]>| {
            let path = folder.path().join(name);
            if let Some(content) = content {
                nemoral_files::write(&path, content).expect("written");
            }
            let e = read(&path).expect_err("no sky");
            let text = e.to_string();
            assert!(text.contains(name), "{text}");
            text
        };
        message("missing.hdr", None);
        let text = message("text.hdr", Some(b"not an image"));
        assert!(text.contains("Radiance"), "{text}");
        message(
            "cut.hdr",
            Some(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\nabc"),
        );
        let black = image::Rgb32FImage::new(16, 8);
        black
            .save(folder.path().join("black.hdr"))
            .expect("written");
        let text = message("black.hdr", None);
        assert!(text.contains("above the horizon"), "{text}");
        assert!(read(Path::new("")).expect("none named").is_none());
    }
}
