//! Pictures of materials: PNG and JPEG.

use std::fmt;
use std::io::Cursor;

use image::{ImageFormat, ImageReader, Limits, Rgba, RgbaImage};

use super::{MAX_PICTURE_PIXELS, MAX_PICTURE_SIDE};
use crate::ImportError;
use crate::error::shown;

/// A picture in eight bits, row by row from the top.
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    /// sRGB, and alpha.
    pixels: RgbaImage,
}

impl fmt::Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Picture({} x {})", self.width, self.height)
    }
}

impl Picture {
    /// Reads a picture. `left` is the number of pixels that the model's further pictures may have.
    pub(super) fn read(bytes: &[u8], name: &str, left: &mut u64) -> Result<Self, ImportError> {
        let wrong = |why: String| ImportError::file(format!("picture {}: {why}", shown(name)));
        let format = match bytes {
            [0x89, b'P', b'N', b'G', ..] => ImageFormat::Png,
            [0xff, 0xd8, 0xff, ..] => ImageFormat::Jpeg,
            _ => {
                return Err(wrong(
                    "is neither PNG nor JPEG, which alone are read".into(),
                ));
            }
        };
        let reader = || {
            let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
            let mut limits = Limits::default();
            limits.max_image_width = Some(MAX_PICTURE_SIDE);
            limits.max_image_height = Some(MAX_PICTURE_SIDE);
            // 16 bits of four channels.
            limits.max_alloc = Some(8 * MAX_PICTURE_PIXELS);
            reader.limits(limits);
            reader
        };
        let size = reader().into_dimensions();
        let (width, height) = size.map_err(|e| wrong(shown(&e.to_string())))?;
        if width == 0 || height == 0 || width > MAX_PICTURE_SIDE || height > MAX_PICTURE_SIDE {
            return Err(wrong(format!(
                "has {width} x {height} pixels: sides of 1 to {MAX_PICTURE_SIDE} are read"
            )));
        }
        let pixels = u64::from(width) * u64::from(height);
        *left = left.checked_sub(pixels).ok_or_else(|| {
            wrong(format!(
                "the model's pictures have more than {MAX_PICTURE_PIXELS} pixels together"
            ))
        })?;
        let decoded = reader()
            .decode()
            .map_err(|e| wrong(shown(&e.to_string())))?;
        Ok(Self {
            width: width as usize,
            height: height as usize,
            pixels: decoded.into_rgba8(),
        })
    }

    pub(super) fn at(&self, column: usize, row: usize) -> [u8; 4] {
        let Rgba(pixel) = self.pixels.get_pixel(column as u32, row as u32);
        *pixel
    }

    /// Whether a pixel is not opaque.
    pub(super) fn has_holes(&self) -> bool {
        self.pixels.pixels().any(|p| p[3] < 128)
    }
}
