//! Disparity from planar depth, at a frame and at the next one, and which of its places the other
//! pictures show.

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{Flow, Image, Intrinsics, RigidTransform};
use png::{BitDepth, ColorType};

use super::{Pair, Rig};
use crate::geometry::relative;
use crate::{Error, FrameRef, Source, StepFiles, png_encoding};

/// How much nearer than a place the surface before it must be to hide it: metres, and a share of
/// the depth. Depth is rounded, and that of a slanted surface changes within a pixel: smaller
/// tolerances hide more places that rays find free, larger ones fewer that they find hidden.
const TOLERANCE_M: f64 = 0.04;
const TOLERANCE_SHARE: f64 = 0.005;

/// Planar depth of both cameras at a frame, metres; 0 for none.
#[derive(Debug)]
pub(super) struct Depths {
    left: Image<f32>,
    right: Image<f32>,
}

impl Depths {
    pub(super) fn of(source: &Source, frame: &FrameRef<'_>, rig: &Rig) -> Result<Self, Error> {
        Ok(Self {
            left: depth_m(source, frame, 0)?,
            right: depth_m(source, frame, rig.right)?,
        })
    }
}

/// Writes the disparities of a pair of frames. `flow` is the first camera's, if it has any.
pub(super) fn put(
    pair: &Pair<'_>,
    rig: &Rig,
    [first, next]: [&Depths; 2],
    flow: Option<&Image<Option<Flow>>>,
    files: &mut StepFiles,
) {
    let left = &pair.sequence.cameras[0];
    let pose = |frame: &FrameRef<'_>| frame.world_from_body() * left.body_from_camera;
    let views = Views {
        first,
        next,
        flow,
        next_from_first: relative(&pose(&pair.next), &pose(&pair.first)),
    };
    let pixels = views.disparities(&left.intrinsics, rig);
    for (k, folder) in ["disp_occ_0", "disp_noc_0", "disp_occ_1", "disp_noc_1"]
        .into_iter()
        .enumerate()
    {
        let data: Vec<u8> = (pixels.pixels().iter())
            .flat_map(|codes| codes[k].to_be_bytes())
            .collect();
        let (width, height) = (pixels.width(), pixels.height());
        let (grey, sixteen) = (ColorType::Grayscale, BitDepth::Sixteen);
        let bytes = png_encoding::encode(width, height, grey, sixteen, None, &data);
        files.put(pair.path(folder, 10), bytes);
    }
}

/// A camera's depth, metres; 0 where it is too far to be known, too.
fn depth_m(source: &Source, frame: &FrameRef<'_>, camera: usize) -> Result<Image<f32>, Error> {
    let depth_m = source.depth_m(frame, camera)?;
    Ok(depth_m.map(|&z| if z.is_finite() { z } else { 0.0 }))
}

/// What disparities of a pair of frames are made of.
struct Views<'a> {
    first: &'a Depths,
    next: &'a Depths,
    flow: Option<&'a Image<Option<Flow>>>,
    next_from_first: RigidTransform,
}

impl Views<'_> {
    /// The codes of each pixel: `occ` and `noc` at the frame, then at the next one.
    fn disparities(&self, k: &Intrinsics, rig: &Rig) -> Image<[u16; 4]> {
        let (width, height) = (self.first.left.width(), self.first.left.height());
        let of = |i: usize| {
            let (column, row) = (i % width, i / width);
            let z_m = f64::from(*self.first.left.at(column, row));
            if z_m <= 0.0 {
                return [0; 4];
            }
            let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let disparity_px = rig.disparity_px(z_m);
            let now = code(disparity_px);
            let is_shown = shows(&self.first.right, at - DVec2::X * disparity_px, z_m);
            let now_noc = if is_shown { now } else { 0 };
            let place = DVec3::new((at.x - k.cx) / k.fx, (at.y - k.cy) / k.fy, 1.0) * z_m;
            let place = self.next_from_first.transform_point(place);
            // Behind the next camera there is no disparity.
            let Some(there) = k.project(place) else {
                return [now, now_noc, 0, 0];
            };
            let next_px = rig.disparity_px(place.z);
            let next = code(next_px);
            // Flow knows from rays what the next picture shows; depth alone guesses.
            let flow = self.flow.and_then(|flow| *flow.at(column, row));
            let is_shown = flow
                .map_or_else(|| shows(&self.next.left, there, place.z), |flow| flow.seen)
                && shows(&self.next.right, there - DVec2::X * next_px, place.z);
            [now, now_noc, next, if is_shown { next } else { 0 }]
        };
        Image::new(width, height, (0..width * height).map(of).collect())
    }
}

/// A disparity in 16 bits, pixels × 256; 0 if it does not fit.
fn code(disparity_px: f64) -> u16 {
    let code = (disparity_px * 256.0).round();
    if (1.0..=65535.0).contains(&code) {
        code as u16
    } else {
        0
    }
}

/// Whether a picture shows a place: it lies inside, and there is nothing nearer at it, neither at
/// the centre of its pixel nor by the slope of the surface from there. Within half a row, the depth
/// of open ground far away changes by more than any tolerance that still knows a trunk from what is
/// behind it.
fn shows(depth_m: &Image<f32>, at: DVec2, z_m: f64) -> bool {
    let (width, height) = (depth_m.width() as f64, depth_m.height() as f64);
    if !(at.x >= 0.0 && at.y >= 0.0 && at.x < width && at.y < height) {
        return false;
    }
    let (column, row) = (at.x as usize, at.y as usize);
    // The inverse of depth is linear over a plane's pixels; 0 is nothing at all, infinitely far.
    let inverse = |column: usize, row: usize| match f64::from(*depth_m.at(column, row)) {
        0.0 => 0.0,
        depth_m => depth_m.recip(),
    };
    let limit = (z_m - TOLERANCE_M - TOLERANCE_SHARE * z_m).max(0.0).recip();
    let own = inverse(column, row);
    // Towards the place, to the next pixel of its row and of its column.
    let (x, y) = (at.x - column as f64 - 0.5, at.y - row as f64 - 0.5);
    let beside = inverse(neighbour(column, x, depth_m.width()), row);
    let above = inverse(column, neighbour(row, y, depth_m.height()));
    let sloped = own + x.abs() * (beside - own) + y.abs() * (above - own);
    own <= limit || sloped <= limit
}

/// The pixel beside one, on the side of an offset from its centre; itself at the border.
fn neighbour(at: usize, offset: f64, size: usize) -> usize {
    if offset < 0.0 {
        at.saturating_sub(1)
    } else {
        (at + 1).min(size - 1)
    }
}
