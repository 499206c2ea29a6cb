//! Images in memory.

use glam::Vec3;

use crate::{ObjectId, Semantic};

/// A row-major image.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    width: usize,
    height: usize,
    pixels: Vec<T>,
}

impl<T> Image<T> {
    /// An image from its pixels, row by row.
    ///
    /// # Panics
    /// If there are not `width · height` pixels.
    #[must_use]
    pub fn new(width: usize, height: usize, pixels: Vec<T>) -> Self {
        assert_eq!(
            pixels.len(),
            width * height,
            "an image has width x height pixels"
        );
        Self {
            width,
            height,
            pixels,
        }
    }

    /// The number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The pixels, row by row.
    #[must_use]
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// Turns the image into its pixels, row by row.
    #[must_use]
    pub fn into_pixels(self) -> Vec<T> {
        self.pixels
    }

    /// The pixel at (column, row).
    ///
    /// # Panics
    /// If it is outside.
    #[must_use]
    pub fn at(&self, column: usize, row: usize) -> &T {
        assert!(column < self.width, "column {column} of {}", self.width);
        &self.pixels[row * self.width + column]
    }

    /// The same image with every pixel changed.
    #[must_use]
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Image<U> {
        Image::new(self.width, self.height, self.pixels.iter().map(f).collect())
    }
}

/// The truth at exactly each pixel's centre.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthImages {
    /// The fine semantic; [`Semantic::Sky`] where nothing was hit.
    pub semantic: Image<Semantic>,
    /// The object that the surface belongs to.
    pub object: Image<ObjectId>,
    /// Planar depth: z in the optical frame, metres; 0 where nothing was hit.
    pub depth_m: Image<f32>,
    /// Unit normal in the optical frame, towards the camera; zero where nothing was hit.
    pub normal: Image<Vec3>,
}
