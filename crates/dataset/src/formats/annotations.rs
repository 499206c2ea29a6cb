//! The files of further truth: sky masks, optical flow, hidden trunks, boxes.

use std::fmt::Write;
use std::path::Path;

use nemoral_scene::glam::{DQuat, DVec3, Vec2};
use nemoral_scene::{Flow, Image, ObjectBox, ObjectId, ObjectKind, PixelBox};

use crate::Error;
use crate::limits::MAX_POSITION_M;

/// KITTI's flow: 16 bits, pixels × 64 + 2¹⁵.
const PER_PIXEL: f32 = 64.0;
const ZERO: f32 = 32768.0;
/// Values of the blue channel: no flow, seen in the next frame, hidden or outside there.
const NONE: u16 = 0;
const SEEN: u16 = 1;
const HIDDEN: u16 = 2;

/// A component of the flow, if it fits.
fn code(pixels: f32) -> Option<u16> {
    let code = (pixels * PER_PIXEL + ZERO).round();
    (1.0..=65535.0).contains(&code).then_some(code as u16)
}

/// The three 16-bit samples of a pixel.
pub(crate) fn flow_to_samples(flow: Option<Flow>) -> [u16; 3] {
    let samples = flow.and_then(|f| {
        let state = if f.seen { SEEN } else { HIDDEN };
        Some([code(f.offset_px.x)?, code(f.offset_px.y)?, state])
    });
    samples.unwrap_or([0, 0, NONE])
}

/// The flow from the samples of a pixel, within 1/128 pixel.
pub(crate) fn flow_from_samples([u, v, state]: [u16; 3]) -> Option<Flow> {
    let pixels = |code: u16| (f32::from(code) - ZERO) / PER_PIXEL;
    (state != NONE).then(|| Flow {
        offset_px: Vec2::new(pixels(u), pixels(v)),
        seen: state == SEEN,
    })
}

const HEADER: &str = "object,image_id,kind,left,top,right,bottom,visible_px,whole_left,whole_top,\
whole_right,whole_bottom,whole_px,visible_fraction,x_m,y_m,z_m,length_m,width_m,height_m,qx,qy,qz,\
qw";

/// `boxes/IIIIII.csv`. The visible box of what is not seen is empty: 0, 0, 0, 0.
pub(crate) fn encode_boxes(boxes: &[ObjectBox]) -> String {
    let mut out = format!("{HEADER}\n");
    for b in boxes {
        let none = PixelBox {
            left: 0,
            top: 0,
            right: 0,
            bottom: 0,
        };
        let (v, w) = (b.visible.unwrap_or(none), b.whole);
        let (c, s, q) = (b.centre_m, b.size_m, b.camera_from_box);
        writeln!(
            out,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{:.6},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},\
             {:.7},{:.7},{:.7},{:.7}",
            b.object.to_u64(),
            b.object.to_image_id(),
            b.kind.name(),
            v.left,
            v.top,
            v.right,
            v.bottom,
            b.visible_px,
            w.left,
            w.top,
            w.right,
            w.bottom,
            b.whole_px,
            b.visible_fraction(),
            c.x,
            c.y,
            c.z,
            s.x,
            s.y,
            s.z,
            q.x,
            q.y,
            q.z,
            q.w,
        )
        .expect("a string takes it");
    }
    out
}

/// The boxes of a file; metres to a tenth of a millimetre.
pub(crate) fn decode_boxes(path: &Path, bytes: &[u8]) -> Result<Vec<ObjectBox>, Error> {
    let text = std::str::from_utf8(bytes).map_err(|e| Error::malformed(path, e))?;
    let mut lines = text.lines();
    if lines.next() != Some(HEADER) {
        return Err(Error::malformed(path, format!("line 1: must be {HEADER}")));
    }
    lines
        .enumerate()
        .map(|(i, line)| {
            let wrong = || Error::malformed(path, format!("line {}: is no box", i + 2));
            decode_box(line).ok_or_else(wrong)
        })
        .collect()
}

fn decode_box(line: &str) -> Option<ObjectBox> {
    let words: Vec<&str> = line.split(',').collect();
    if words.len() != HEADER.split(',').count() {
        return None;
    }
    let whole_number = |i: usize| words[i].parse::<u32>().ok();
    let real = |i: usize| words[i].parse::<f64>().ok().filter(|x| x.is_finite());
    // Both boxes are around some pixels, so their ends come after their beginnings.
    let pixels = |i: usize| {
        let found = PixelBox {
            left: whole_number(i)?,
            top: whole_number(i + 1)?,
            right: whole_number(i + 2)?,
            bottom: whole_number(i + 3)?,
        };
        (found.left < found.right && found.top < found.bottom).then_some(found)
    };
    let object = ObjectId::from_u64(words[0].parse().ok()?)?;
    let visible_px = whole_number(7)?;
    let turn = DQuat::from_xyzw(real(20)?, real(21)?, real(22)?, real(23)?);
    let parsed = ObjectBox {
        object,
        kind: *ObjectKind::ALL.iter().find(|k| k.name() == words[2])?,
        visible: if visible_px > 0 {
            Some(pixels(3)?)
        } else {
            None
        },
        whole: pixels(8)?,
        visible_px,
        whole_px: whole_number(12).filter(|n| *n > 0)?,
        centre_m: DVec3::new(real(14)?, real(15)?, real(16)?),
        size_m: DVec3::new(real(17)?, real(18)?, real(19)?),
        camera_from_box: turn.normalize(),
    };
    let far = parsed
        .centre_m
        .abs()
        .max_element()
        .max(parsed.size_m.max_element());
    let is_box = parsed.size_m.min_element() >= 0.0 && far <= MAX_POSITION_M;
    let is_turn = (turn.length_squared() - 1.0).abs() < 1e-3;
    let derived = is_box
        && is_turn
        && whole_number(1)? == object.to_image_id()
        && (real(13)? - parsed.visible_fraction()).abs() < 1e-6;
    derived.then_some(parsed)
}

/// The sky mask: 255 where nothing was hit, else 0.
pub(crate) fn sky_mask(depth_m: &Image<f32>) -> Image<u8> {
    depth_m.map(|&z| if z == 0.0 { 255 } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::ChunkCoord;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn flow_comes_back(x in -511.9_f32..511.9, y in -511.9_f32..511.9, seen: bool) {
            let flow = Flow {
                offset_px: Vec2::new(x, y),
                seen,
            };
            let back = flow_from_samples(flow_to_samples(Some(flow))).expect("there");
            prop_assert!(
                back.seen == seen
                    && (back.offset_px - flow.offset_px).abs().max_element() <= 1.0 / 128.0 + 1e-4
            );
        }
    }

    #[test]
    fn flow_that_does_not_fit_is_none() {
        let far = Flow {
            offset_px: Vec2::new(600.0, 0.0),
            seen: true,
        };
        assert_eq!(flow_to_samples(Some(far)), [0; 3]);
        assert_eq!(flow_from_samples([0; 3]), None);
        // As KITTI's development kit reads it.
        let one = Flow {
            offset_px: Vec2::new(1.0, -2.0),
            seen: true,
        };
        assert_eq!(flow_to_samples(Some(one)), [32768 + 64, 32768 - 128, 1]);
    }

    #[test]
    fn boxes_come_back() {
        let pixels = PixelBox::EMPTY.with(3, 4).with(9, 30);
        let seen = ObjectBox {
            object: ObjectId::new(ChunkCoord::new(-3, 70), 12).expect("in range"),
            kind: ObjectKind::Shrub,
            visible: Some(pixels),
            whole: pixels.with(50, 3),
            visible_px: 20,
            whole_px: 300,
            centre_m: DVec3::new(-1.25, 2.5, 30.0),
            size_m: DVec3::new(1.0, 2.0, 3.5),
            camera_from_box: DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5),
        };
        let hidden = ObjectBox {
            visible: None,
            visible_px: 0,
            ..seen
        };
        let path = Path::new("x.csv");
        let text = encode_boxes(&[seen, hidden]);
        let back = decode_boxes(path, text.as_bytes()).expect("valid");
        assert_eq!(back, [seen, hidden]);
        for (from, to) in [
            ("shrub", "bush"),
            (",20,", ",x,"),
            ("0.066667", "0.1"),
            (",3,4,10,31,", ",10,4,3,31,"),
            (",3,4,10,31,", ",3,31,10,4,"),
            (",3,3,51,31,", ",51,3,3,31,"),
            (",3,3,51,31,", ",3,31,51,31,"),
        ] {
            let changed = text.replacen(from, to, 1);
            assert_ne!(text, changed, "{from}");
            assert!(decode_boxes(path, changed.as_bytes()).is_err(), "{to}");
        }
    }
}
