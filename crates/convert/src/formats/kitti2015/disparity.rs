//! Disparity from planar depth, at a frame and at the next one, and which of its places the other
//! pictures show.

use nemoral_dataset::DepthFormat;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{Image, Intrinsics, RigidTransform};
use png::{BitDepth, ColorType};

use super::{Pair, Rig};
use crate::geometry::relative;
use crate::{Error, Files, FrameRef, Source, pictures};

/// How much nearer than a place the surface of a pixel must be to hide it: metres, and a share of
/// the depth. Depth is rounded, and that of a slanted surface changes within a pixel: smaller
/// tolerances hide more places that rays find free, larger ones fewer that they find hidden.
const TOLERANCE_M: f64 = 0.04;
const TOLERANCE: f64 = 0.005;

/// Disparities of a pair of frames.
pub(super) fn put(
    source: &Source,
    pair: &Pair<'_>,
    rig: &Rig,
    files: &mut Files,
) -> Result<(), Error> {
    let left = &pair.sequence.cameras[0];
    let pose = |frame: &FrameRef<'_>| frame.world_from_body() * left.body_from_camera;
    let depth = Depths {
        left: depth_m(source, &pair.first, 0)?,
        right: depth_m(source, &pair.first, rig.right)?,
        next_left: depth_m(source, &pair.next, 0)?,
        next_right: depth_m(source, &pair.next, rig.right)?,
    };
    let next_from_first = relative(&pose(&pair.next), &pose(&pair.first));
    let pixels = depth.disparities(&left.intrinsics, rig, &next_from_first);
    for (k, folder) in ["disp_occ_0", "disp_noc_0", "disp_occ_1", "disp_noc_1"]
        .into_iter()
        .enumerate()
    {
        let data: Vec<u8> = (pixels.pixels().iter())
            .flat_map(|codes| codes[k].to_be_bytes())
            .collect();
        let (width, height) = (pixels.width(), pixels.height());
        let (grey, sixteen) = (ColorType::Grayscale, BitDepth::Sixteen);
        let bytes = pictures::encode(width, height, grey, sixteen, None, &data);
        files.put(pair.path(folder, 10), bytes);
    }
    Ok(())
}

/// A camera's depth, metres. The greatest that 16 bits hold stands for anything beyond: of such a
/// place nothing is known but that it is far.
fn depth_m(source: &Source, frame: &FrameRef<'_>, camera: usize) -> Result<Image<f32>, Error> {
    const FAR_M: f32 = 65535.0 / 256.0;
    let depth_m = source.depth_m(frame, camera)?;
    Ok(match source.depth_format(frame.sequence) {
        DepthFormat::Png16 => depth_m.map(|&z| if z < FAR_M { z } else { 0.0 }),
        _ => depth_m,
    })
}

/// Planar depth of both cameras at both frames, metres; 0 for none.
struct Depths {
    left: Image<f32>,
    right: Image<f32>,
    next_left: Image<f32>,
    next_right: Image<f32>,
}

impl Depths {
    /// The codes of each pixel: `occ` and `noc` at the frame, then at the next one.
    fn disparities(
        &self,
        k: &Intrinsics,
        rig: &Rig,
        next_from_first: &RigidTransform,
    ) -> Image<[u16; 4]> {
        let width = self.left.width();
        let of = |i: usize| {
            let (column, row) = (i % width, i / width);
            let z_m = f64::from(*self.left.at(column, row));
            if z_m <= 0.0 {
                return [0; 4];
            }
            let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let disparity_px = rig.fx_baseline_px_m / z_m;
            let beside = at - DVec2::X * disparity_px;
            let now = code(disparity_px);
            let seen_now = shows(&self.right, beside, z_m);
            let place = DVec3::new((at.x - k.cx) / k.fx, (at.y - k.cy) / k.fy, 1.0) * z_m;
            let place = next_from_first.transform_point(place);
            // Behind the next camera there is no disparity.
            let Some(there) = k.project(place) else {
                return [now, if seen_now { now } else { 0 }, 0, 0];
            };
            let next_px = rig.fx_baseline_px_m / place.z;
            let next = code(next_px);
            let seen_next = shows(&self.next_left, there, place.z)
                && shows(&self.next_right, there - DVec2::X * next_px, place.z);
            let [now_seen, next_seen] = [(seen_now, now), (seen_next, next)]
                .map(|(seen, code)| if seen { code } else { 0 });
            [now, now_seen, next, next_seen]
        };
        let all = 0..width * self.left.height();
        Image::new(width, self.left.height(), all.map(of).collect())
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

/// Whether a picture shows a place: it lies inside, and the pixel there shows nothing nearer.
fn shows(depth_m: &Image<f32>, at: DVec2, z_m: f64) -> bool {
    let (width, height) = (depth_m.width() as f64, depth_m.height() as f64);
    if !(at.x >= 0.0 && at.y >= 0.0 && at.x < width && at.y < height) {
        return false;
    }
    let nearest_m = f64::from(*depth_m.at(at.x as usize, at.y as usize));
    // 0 is nothing at all, which hides nothing.
    nearest_m == 0.0 || nearest_m >= z_m - TOLERANCE_M - TOLERANCE * z_m
}
