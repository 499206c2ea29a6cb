//! The images of a picture that is being rendered.

use glam::{DVec2, Vec3};
use nemoral_scene::{Image, ObjectId, Semantic, TruthImages};
use rayon::prelude::*;

use super::pixel_truth::PixelTruth;

/// Side of the squares of pixels of which one finds out what blocks its shadow ray.
pub(crate) const LATTICE: usize = 4;

/// The farthest two depths of one surface are apart, as a share of the depth.
pub(super) const SAME_DEPTH: f32 = 0.03;
/// The least cosine between two normals of one surface.
pub(super) const SAME_NORMAL: f32 = 0.8;

/// The images of a picture, row by row.
pub(crate) struct FrameBuffer {
    pub(crate) width: usize,
    pub(crate) semantic: Vec<Semantic>,
    pub(crate) object: Vec<ObjectId>,
    pub(crate) depth_m: Vec<f32>,
    pub(crate) normal: Vec<Vec3>,
    /// Radiance, at first without that of the sun.
    pub(crate) linear: Vec<Vec3>,
    /// The sun's light. In path-traced pictures this and the next two fields are empty.
    pub(crate) sun: DirectLight,
    /// The light of each lamp.
    pub(crate) lamps: Vec<DirectLight>,
    /// For one pixel of each [`LATTICE`], how far from its surface its shadow ray was blocked,
    /// metres; 0 where it was not.
    pub(crate) blocker_m: Vec<f32>,
}

/// The light of one source, pixel by pixel.
#[derive(Default)]
pub(crate) struct DirectLight {
    /// Its radiance from the surface without occlusion; zero where it does not matter.
    pub(crate) radiance: Vec<Vec3>,
    /// Whether the shadow ray reaches it.
    pub(crate) lit: Vec<bool>,
    /// The share of its disc that is visible from the surface, once it is known.
    pub(crate) share: Vec<f32>,
}

impl DirectLight {
    pub(crate) fn none(pixels: usize) -> Self {
        Self {
            radiance: filled(Vec3::ZERO, pixels),
            lit: filled(false, pixels),
            share: Vec::new(),
        }
    }
}

impl FrameBuffer {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let n = width * height;
        Self {
            width,
            semantic: filled(Semantic::Sky, n),
            object: filled(ObjectId::NONE, n),
            depth_m: filled(0.0, n),
            normal: filled(Vec3::ZERO, n),
            linear: filled(Vec3::ZERO, n),
            sun: DirectLight::none(n),
            lamps: Vec::new(),
            blocker_m: filled(0.0, width.div_ceil(LATTICE) * height.div_ceil(LATTICE)),
        }
    }

    /// A frame buffer with this truth and black colours.
    pub(crate) fn of_truth(truth: TruthImages) -> Self {
        let n = truth.depth_m.pixels().len();
        Self {
            width: truth.depth_m.width(),
            semantic: truth.semantic.into_pixels(),
            object: truth.object.into_pixels(),
            depth_m: truth.depth_m.into_pixels(),
            normal: truth.normal.into_pixels(),
            linear: filled(Vec3::ZERO, n),
            sun: DirectLight::default(),
            lamps: Vec::new(),
            blocker_m: Vec::new(),
        }
    }

    /// Whether the pixel `i` shows the surface of an object at this depth and with this normal.
    #[inline]
    pub(crate) fn shows(&self, i: usize, object: ObjectId, depth_m: f32, normal: Vec3) -> bool {
        self.object[i] == object
            && (self.depth_m[i] - depth_m).abs() < SAME_DEPTH * depth_m
            && self.normal[i].dot(normal) > SAME_NORMAL
    }

    /// The share of a source's disc that is visible from a surface at an image position: the mean
    /// of those of the four pixels around it that show the same surface; `None` if none of them
    /// does.
    pub(crate) fn share_of(
        &self,
        source: &DirectLight,
        at: DVec2,
        seen: &PixelTruth,
    ) -> Option<f32> {
        let (width, height) = (self.width, self.linear.len() / self.width);
        let from =
            |at: f64, n: usize| ((at - 0.5).floor().max(0.0) as usize).min(n.saturating_sub(2));
        let (left, top) = (from(at.x, width), from(at.y, height));
        let (mut sum, mut pixels) = (0.0, 0.0);
        for y in top..(top + 2).min(height) {
            for x in left..(left + 2).min(width) {
                let i = y * width + x;
                if source.radiance[i] != Vec3::ZERO
                    && self.shows(i, seen.object, seen.depth_m, seen.normal)
                {
                    sum += source.share[i];
                    pixels += 1.0;
                }
            }
        }
        (pixels > 0.0).then(|| sum / pixels)
    }

    pub(crate) fn into_images(self) -> (Image<Vec3>, TruthImages) {
        let (width, height) = (self.width, self.linear.len() / self.width);
        let truth = TruthImages {
            semantic: Image::new(width, height, self.semantic),
            object: Image::new(width, height, self.object),
            depth_m: Image::new(width, height, self.depth_m),
            normal: Image::new(width, height, self.normal),
        };
        (Image::new(width, height, self.linear), truth)
    }
}

/// A map with one value. Touching memory for the first time takes longer than writing it, so all
/// threads share that.
pub(crate) fn filled<T: Copy + Send + Sync>(value: T, n: usize) -> Vec<T> {
    let mut map = Vec::new();
    rayon::iter::repeat_n(value, n)
        .with_min_len(1 << 16)
        .collect_into_vec(&mut map);
    map
}
