//! A contact sheet of one frame, which shows what a data set will look like.

use std::path::Path;
use std::sync::Arc;

use nemoral_render::CameraImages;
use nemoral_scene::{Image, Ontology};

use crate::config::Config;
use crate::pictures::{
    PAPER, picture_of_classes, picture_of_depth, picture_of_instances, picture_of_normals,
    picture_of_scan,
};
use crate::plan::{Cache, Runner, Store};
use crate::preflight::within_sequence;
use crate::world::cameras::intrinsics;
use crate::{Backend, Error, ForestPlan, InputFiles};

/// Width of the strip between the pictures, pixels.
const GAP: usize = 12;

/// Makes the contact sheet of a frame: the first camera's picture; below it classes and instances,
/// depth and scan (or normals, if there is no LiDAR). `cache` may store grown plants between runs.
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
    let ontology = config.output.ontology.table();
    let last = match scans.first() {
        Some(scan) => {
            let camera_from_lidar =
                config.camera.body_from_camera().inverse() * config.lidar.body_from_lidar();
            let intrinsics = intrinsics("camera", &config.camera)?;
            picture_of_scan(scan, &ontology, &intrinsics, &camera_from_lidar)
        }
        None => picture_of_normals(&image.truth),
    };
    Ok(contact_sheet(image, &last, &ontology))
}

/// Writes an image as PNG, under its name only when it is whole.
///
/// # Errors
/// If the name does not end in `.png`, or the file cannot be written.
pub fn write_png(image: &Image<[u8; 3]>, path: &Path) -> Result<(), Error> {
    nemoral_export::check_name(path, "png").map_err(|e| Error::request(e.to_string()))?;
    nemoral_dataset::write_png(path, image).map_err(Error::from)
}

/// Arranges the pictures of a frame.
fn contact_sheet(
    images: &CameraImages,
    last: &Image<[u8; 3]>,
    ontology: &Ontology,
) -> Image<[u8; 3]> {
    let truth = &images.truth;
    let tiles = [
        halved(&picture_of_classes(truth, ontology)),
        halved(&picture_of_instances(truth)),
        halved(&picture_of_depth(truth)),
        halved(last),
    ];
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
