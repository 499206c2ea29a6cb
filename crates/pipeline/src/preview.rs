//! A contact sheet of one frame, which shows what a data set will look like.

use std::path::Path;
use std::sync::Arc;

use nemoral_render::CameraImages;
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Image, Intrinsics, LidarPoint, ObjectId, Ontology, RigidTransform, Semantic};

use crate::config::Config;
use crate::plan::{Cache, Runner, Store};
use crate::prove::within_sequence;
use crate::world::cameras::intrinsics;
use crate::{Backend, Error, ForestPlan, InputFiles};

/// The colour between the pictures.
const PAPER: [u8; 3] = [18, 20, 22];
/// Width of the strip between the pictures, pixels.
const GAP: usize = 12;

/// Makes the contact sheet of a frame: the first camera's picture; below it classes and instances,
/// depth and scan. `cache` may store grown plants between runs.
///
/// # Errors
/// If the frame is beyond the sequence or cannot be made.
pub fn preview(
    config: &Config,
    inputs: &InputFiles,
    backend: Backend,
    frame: u64,
    threads: usize,
    cache: Option<Arc<Cache>>,
) -> Result<Image<[u8; 3]>, Error> {
    within_sequence(config, frame)?;
    let forest = ForestPlan::with_inputs(config, inputs, backend)?;
    let store = Store::unlimited().with_cache(cache);
    let runner = Runner::new(forest.plan(), &store, threads);
    let images = runner.get(forest.images, frame)?;
    let image = images.first().ok_or_else(|| {
        Error::request(
            "camera.enabled = false: must be true for a preview, which shows the first camera",
        )
    })?;
    let scans = runner.get(forest.scans, frame)?;
    let ontology = Ontology::by_name(&config.output.ontology)
        .expect("the config's words are the built-in ontologies");
    let camera_from_lidar =
        config.camera.body_from_camera().inverse() * config.lidar.body_from_lidar();
    Ok(contact_sheet(
        image,
        &scans[0],
        &ontology,
        &intrinsics("camera", &config.camera)?,
        &camera_from_lidar,
    ))
}

/// Refuses the name of a picture that does not end in `.png`, as only PNG is written.
///
/// # Errors
/// If it has another extension or none.
pub fn check_png_name(path: &Path) -> Result<(), Error> {
    let ending = path.extension();
    if ending.is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
        return Ok(());
    }
    let path = path.display();
    Err(Error::request(format!(
        "{path}: pictures are PNG files: the name must end in .png"
    )))
}

/// Writes an image as PNG, under its name only when it is whole.
///
/// # Errors
/// As [`check_png_name`], and if the file cannot be written.
pub fn write_png(image: &Image<[u8; 3]>, path: &Path) -> Result<(), Error> {
    check_png_name(path)?;
    nemoral_dataset::write_png(path, image).map_err(Error::from)
}

/// Arranges the pictures of a frame.
fn contact_sheet(
    images: &CameraImages,
    scan: &[LidarPoint],
    ontology: &Ontology,
    intrinsics: &Intrinsics,
    camera_from_lidar: &RigidTransform,
) -> Image<[u8; 3]> {
    let truth = &images.truth;
    let classes = truth.semantic.map(|&s| ontology.class(s).colour);
    let tiles = [
        shaded(&classes, &truth.normal),
        shaded(&instances(&truth.object, &truth.semantic), &truth.normal),
        truth.depth_m.map(|&d| depth_colour(d)),
        scan_picture(scan, ontology, intrinsics, camera_from_lidar),
    ]
    .map(|tile| halved(&tile));
    let (width, height) = (images.rgb.width(), images.rgb.height());
    let (w, h) = (tiles[0].width(), tiles[0].height());
    let sheet_width = (2 * w + GAP).max(width) + 2 * GAP;
    let sheet_height = height + 2 * h + 4 * GAP;
    let mut sheet = vec![PAPER; sheet_width * sheet_height];
    let mut paste = |picture: &Image<[u8; 3]>, left: usize, top: usize| {
        for row in 0..picture.height() {
            let from = &picture.pixels()[row * picture.width()..][..picture.width()];
            sheet[(top + row) * sheet_width + left..][..picture.width()].copy_from_slice(from);
        }
    };
    paste(&images.rgb, GAP, GAP);
    // The lower pictures end at the same column as the upper one.
    let right = GAP + width.max(2 * w + GAP) - w;
    for (i, tile) in tiles.iter().enumerate() {
        let left = if i % 2 == 0 { GAP } else { right };
        paste(tile, left, 2 * GAP + height + i / 2 * (h + GAP));
    }
    Image::new(sheet_width, sheet_height, sheet)
}

/// Flat colours with a little shading by the normals, for viewing only.
fn shaded(colours: &Image<[u8; 3]>, normals: &Image<Vec3>) -> Image<[u8; 3]> {
    let towards = Vec3::new(-0.4, -0.6, -0.7);
    let pixels = colours.pixels().iter().zip(normals.pixels()).map(|(c, n)| {
        let light = if *n == Vec3::ZERO {
            1.0
        } else {
            0.72 + 0.28 * n.dot(towards).max(0.0)
        };
        c.map(|v| (f32::from(v) * light).min(255.0) as u8)
    });
    Image::new(colours.width(), colours.height(), pixels.collect())
}

fn instances(objects: &Image<ObjectId>, semantics: &Image<Semantic>) -> Image<[u8; 3]> {
    let pixels = objects
        .pixels()
        .iter()
        .zip(semantics.pixels())
        .map(|(object, semantic)| {
            if *semantic == Semantic::Sky {
                return [34, 38, 44];
            }
            if object.is_none() {
                return [74, 78, 80];
            }
            // A hue for each id, far from that of the next.
            let mixed = object.to_u64().wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let hue = (mixed >> 40) as f32 / (1 << 24) as f32;
            let value = 0.65 + 0.35 * ((mixed >> 20 & 0xFFFF) as f32 / 65536.0);
            hue_colour(hue, value)
        });
    Image::new(objects.width(), objects.height(), pixels.collect())
}

fn hue_colour(hue: f32, value: f32) -> [u8; 3] {
    [0.0, 2.0 / 3.0, 1.0 / 3.0].map(|shift| {
        let wave = ((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0;
        ((0.25 + 0.75 * wave.clamp(0.0, 1.0)) * value * 255.0) as u8
    })
}

/// Warm colours are near and cold ones far, by the logarithm; where nothing was hit it is dark.
fn depth_colour(depth_m: f32) -> [u8; 3] {
    if depth_m <= 0.0 {
        return [14, 14, 20];
    }
    // Anchors of the inferno palette, light to dark.
    const ANCHORS: [[f32; 3]; 6] = [
        [252.0, 255.0, 164.0],
        [251.0, 155.0, 6.0],
        [221.0, 81.0, 58.0],
        [147.0, 38.0, 103.0],
        [66.0, 10.0, 104.0],
        [20.0, 11.0, 52.0],
    ];
    let t = ((depth_m.max(1.0).ln() / 200.0_f32.ln()) * 5.0).clamp(0.0, 4.999);
    let (i, f) = (t as usize, t.fract());
    std::array::from_fn(|k| (ANCHORS[i][k] * (1.0 - f) + ANCHORS[i + 1][k] * f) as u8)
}

/// The scan from behind and above the robot, in the colours of the classes.
fn scan_picture(
    scan: &[LidarPoint],
    ontology: &Ontology,
    intrinsics: &Intrinsics,
    camera_from_lidar: &RigidTransform,
) -> Image<[u8; 3]> {
    let (width, height) = (intrinsics.width as usize, intrinsics.height as usize);
    let body = RigidTransform::body_from_optical();
    // The view is from eight metres behind and five above, looking down by about 14°.
    let pitch = 0.24;
    let place = RigidTransform::from_xyz_rpy(DVec3::new(-8.0, 0.0, 5.0), 0.0, pitch, 0.0);
    let viewer_from_camera = (place * body).inverse() * body;
    let viewer_from_lidar = viewer_from_camera * *camera_from_lidar;
    let mut pixels = vec![PAPER; width * height];
    let mut nearest = vec![f32::INFINITY; width * height];
    for point in scan {
        let p = viewer_from_lidar.transform_point(point.position_m.as_dvec3());
        let Some(at) = intrinsics.project(p) else {
            continue;
        };
        let colour = ontology.class(point.semantic).colour;
        let light = (1.3 - p.length() as f32 / 150.0).clamp(0.55, 1.15);
        let colour = colour.map(|c| (f32::from(c) * light).min(255.0) as u8);
        // Near points are larger.
        let size = (2.0 + 24.0 / p.z).clamp(2.0, 5.0) as i64;
        for (dx, dy) in (0..size).flat_map(|x| (0..size).map(move |y| (x, y))) {
            let (x, y) = (at.x as i64 + dx, at.y as i64 + dy);
            if (0..width as i64).contains(&x) && (0..height as i64).contains(&y) {
                let i = y as usize * width + x as usize;
                if (p.z as f32) < nearest[i] {
                    (nearest[i], pixels[i]) = (p.z as f32, colour);
                }
            }
        }
    }
    Image::new(width, height, pixels)
}

/// The image at half size, less half a gap so that two fit under the whole; four pixels are
/// averaged to one.
fn halved(image: &Image<[u8; 3]>) -> Image<[u8; 3]> {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let width = width.saturating_sub(GAP / 2).max(1);
    let pixels = (0..width * height).map(|i| {
        let (x, y) = (i % width * 2, i / width * 2);
        std::array::from_fn(|k| {
            let sum: u32 = [(0, 0), (1, 0), (0, 1), (1, 1)]
                .iter()
                .map(|&(dx, dy)| u32::from(image.at(x + dx, y + dy)[k]))
                .sum();
            (sum / 4) as u8
        })
    });
    Image::new(width, height, pixels.collect())
}
