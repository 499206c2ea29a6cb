//! A camera's pictures and maps, small enough for a page, as `data:` addresses.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use nemoral_dataset::CameraFrame;
use nemoral_scene::{Image, Ontology};
use serde::Serialize;

/// The most pixels that the pictures of a frame have, over its cameras.
const PICTURE_PX: usize = 1280 * 720;
/// The most pixels that all maps of one kind have in a frame, over its cameras.
const MAP_PX: usize = 960 * 540;
/// Things of which less is visible have no box on the page: twigs behind leaves are many.
const BOXED_FRACTION: f64 = 0.2;
/// The longer side of a thumbnail, about.
const THUMBNAIL_PX: usize = 160;
/// Depths from 1 m to this have colours of their own, metres.
pub(crate) const FAR_M: f32 = 300.0;

/// A camera's view of a frame.
#[derive(Debug, Serialize)]
pub(crate) struct View {
    name: String,
    /// Of maps, pixels; the picture may have more.
    width: usize,
    height: usize,
    maps: Vec<Map>,
    /// Left, top, width and height as shares of the picture's, and what it is.
    boxes: Vec<(f32, f32, f32, f32, String)>,
}

#[derive(Debug, Serialize)]
struct Map {
    name: &'static str,
    /// A `data:` address.
    src: String,
}

/// All that is shown of a camera which shares the frame with others.
pub(crate) fn view(camera: &CameraFrame, cameras: usize, ontology: &Ontology) -> View {
    let (width, height) = (camera.rgb.width(), camera.rgb.height());
    let picture_step = step(width * height * cameras, PICTURE_PX);
    let step = step(width * height * cameras, MAP_PX);
    let mut maps = vec![
        Map {
            name: "Picture",
            src: jpeg(&reduced(&camera.rgb, picture_step), 86),
        },
        Map {
            name: "Classes",
            src: indexed(&sampled(&camera.semantic, step), &class_palette(ontology)),
        },
        Map {
            name: "Instances",
            src: instances(&sampled(&camera.instance, step)),
        },
        Map {
            name: "Depth",
            src: indexed(
                &sampled(&camera.depth_m, step).map(|&d| depth_index(d)),
                &depth_palette(),
            ),
        },
        Map {
            name: "Normals",
            src: jpeg(
                &sampled(&camera.normal, step)
                    .map(|n| n.to_array().map(|v| (127.5 * (v + 1.0)).round() as u8)),
                86,
            ),
        },
    ];
    if let Some(flow) = &camera.flow {
        let flow = sampled(flow, step);
        let longest = flow.pixels().iter().flatten();
        let longest = longest.map(|f| f.offset_px.length()).fold(1.0, f32::max);
        let colour = flow.map(|f| {
            f.map_or([0; 3], |f| {
                let angle = libm::atan2f(f.offset_px.y, f.offset_px.x) / std::f32::consts::TAU;
                hue_colour(
                    angle.rem_euclid(1.0),
                    (f.offset_px.length() / longest).sqrt(),
                )
            })
        });
        maps.push(Map {
            name: "Flow",
            src: jpeg(&colour, 86),
        });
    }
    if let Some(trunks) = &camera.trunks {
        maps.push(Map {
            name: "Trunks",
            src: instances(&sampled(trunks, step)),
        });
    }
    let boxes = camera.boxes.iter().flatten();
    let boxes = boxes.filter(|b| b.visible_fraction() >= BOXED_FRACTION);
    let boxes = boxes.filter_map(|b| {
        let v = b.visible?;
        Some((
            v.left as f32 / width as f32,
            v.top as f32 / height as f32,
            (v.right - v.left) as f32 / width as f32,
            (v.bottom - v.top) as f32 / height as f32,
            format!("{:?}", b.kind),
        ))
    });
    View {
        name: camera.name.clone(),
        width: width.div_ceil(step),
        height: height.div_ceil(step),
        maps,
        boxes: boxes.collect(),
    }
}

/// A small picture and its mean brightness, 0 to 255.
pub(crate) fn thumbnail(rgb: &Image<[u8; 3]>) -> (String, f64) {
    let small = reduced(rgb, rgb.width().max(rgb.height()).div_ceil(THUMBNAIL_PX));
    let sum = |p: &[u8; 3]| p.iter().map(|&v| f64::from(v)).sum::<f64>();
    let brightness = small.pixels().iter().map(sum).sum::<f64>() / 3.0;
    (jpeg(&small, 72), brightness / small.pixels().len() as f64)
}

/// Colours of the class ids.
fn class_palette(ontology: &Ontology) -> [[u8; 3]; 256] {
    let mut palette = [[0; 3]; 256];
    for class in ontology.classes() {
        palette[usize::from(class.id)] = class.colour;
    }
    palette
}

/// 0 for nothing; 1 to 255 for 1 m and less to [`FAR_M`] and more, by the logarithm.
fn depth_index(depth_m: f32) -> u8 {
    if depth_m <= 0.0 {
        return 0;
    }
    let share = libm::logf(depth_m.max(1.0)) / libm::logf(FAR_M);
    1 + (254.0 * share.min(1.0)).round() as u8
}

/// Near is light, far is dark: the inferno palette.
pub(crate) fn depth_palette() -> [[u8; 3]; 256] {
    const ANCHORS: [[f32; 3]; 6] = [
        [252.0, 255.0, 164.0],
        [251.0, 155.0, 6.0],
        [221.0, 81.0, 58.0],
        [147.0, 38.0, 103.0],
        [66.0, 10.0, 104.0],
        [20.0, 11.0, 52.0],
    ];
    std::array::from_fn(|index| {
        if index == 0 {
            return [14, 14, 20];
        }
        let t = (index - 1) as f32 / 254.0 * 4.999;
        let (i, f) = (t as usize, t.fract());
        std::array::from_fn(|k| (ANCHORS[i][k] * (1.0 - f) + ANCHORS[i + 1][k] * f) as u8)
    })
}

/// One of 255 colours for each id, and dark grey for none.
fn instances(ids: &Image<u32>) -> String {
    let palette = std::array::from_fn(|i| match i {
        0 => [52, 56, 60],
        i => hue_colour(
            (i as f32 * 0.618_034).fract(),
            0.65 + 0.35 * (i % 3) as f32 / 2.0,
        ),
    });
    let index = |&id: &u32| match id {
        0 => 0,
        id => 1 + ((u64::from(id).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) % 255) as u8,
    };
    indexed(&ids.map(index), &palette)
}

fn hue_colour(hue: f32, value: f32) -> [u8; 3] {
    [0.0, 2.0 / 3.0, 1.0 / 3.0].map(|shift: f32| {
        let wave = ((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0;
        ((0.25 + 0.75 * wave.clamp(0.0, 1.0)) * value * 255.0) as u8
    })
}

/// The smallest reduction of both sides with which `pixels` are at most `most`.
fn step(pixels: usize, most: usize) -> usize {
    (1..).find(|s| pixels / (s * s) <= most).unwrap_or(1)
}

/// The mean of each square of `step` × `step` pixels.
fn reduced(image: &Image<[u8; 3]>, step: usize) -> Image<[u8; 3]> {
    let (width, height) = (image.width().div_ceil(step), image.height().div_ceil(step));
    let pixels = (0..width * height).map(|i| {
        let columns = i % width * step..(i % width * step + step).min(image.width());
        let rows = i / width * step..(i / width * step + step).min(image.height());
        let mut sum = [0_u32; 3];
        for (x, y) in rows
            .clone()
            .flat_map(|y| columns.clone().map(move |x| (x, y)))
        {
            for (sum, &v) in sum.iter_mut().zip(image.at(x, y)) {
                *sum += u32::from(v);
            }
        }
        sum.map(|s| (s / (columns.len() * rows.len()) as u32) as u8)
    });
    Image::new(width, height, pixels.collect())
}

/// The pixel in the middle of each square: ids and depths have no mean.
fn sampled<T: Clone>(image: &Image<T>, step: usize) -> Image<T> {
    let (width, height) = (image.width().div_ceil(step), image.height().div_ceil(step));
    let middle = |i: usize, side: usize| (i * step + step / 2).min(side - 1);
    let pixels = (0..width * height).map(|i| {
        let at = (
            middle(i % width, image.width()),
            middle(i / width, image.height()),
        );
        image.at(at.0, at.1).clone()
    });
    Image::new(width, height, pixels.collect())
}

fn jpeg(image: &Image<[u8; 3]>, quality: u8) -> String {
    let mut out = Vec::new();
    let (width, height) = (image.width() as u32, image.height() as u32);
    JpegEncoder::new_with_quality(&mut out, quality)
        .encode(
            image.pixels().as_flattened(),
            width,
            height,
            ExtendedColorType::Rgb8,
        )
        .expect("the sides are 1 to 8192 and memory takes it");
    format!("data:image/jpeg;base64,{}", STANDARD.encode(out))
}

fn indexed(image: &Image<u8>, palette: &[[u8; 3]; 256]) -> String {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, image.width() as u32, image.height() as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette.as_flattened().to_vec());
    let mut writer = encoder.write_header().expect("the sides are 1 to 8192");
    writer
        .write_image_data(image.pixels())
        .expect("the buffer has the image's size and memory takes it");
    writer.finish().expect("memory takes it");
    format!("data:image/png;base64,{}", STANDARD.encode(out))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_a_frame_have_at_most_their_share_of_pixels() {
        for (width, height) in [(1, 1), (959, 541), (1280, 720), (8192, 8192), (8192, 1)] {
            let step = step(width * height, MAP_PX);
            assert!(width * height / (step * step) <= MAP_PX);
            let small = sampled(&Image::new(width, height, vec![7_u8; width * height]), step);
            assert!(small.width() >= width / step && small.height() >= height / step);
        }
    }

    #[test]
    fn reduction_takes_means_and_sampling_takes_pixels() {
        let ramp = Image::new(3, 3, (0..9).map(|i| [10 * i; 3]).collect());
        let means = [[20; 3], [35; 3], [65; 3], [80; 3]];
        assert_eq!(reduced(&ramp, 2).pixels(), means);
        assert_eq!(
            sampled(&ramp, 2).pixels(),
            [[40; 3], [50; 3], [70; 3], [80; 3]]
        );
    }

    #[test]
    fn depths_have_colours_by_the_logarithm() {
        let indices = [0.0, 0.5, 1.0, FAR_M.sqrt(), FAR_M, 1e6].map(depth_index);
        assert_eq!(indices, [0, 1, 1, 128, 255, 255]);
    }
}
