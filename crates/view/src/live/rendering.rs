//! Pictures of what is seen, as files for a browser.

use std::sync::atomic::Ordering;
use std::time::Instant;

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use nemoral_pipeline::config::Config;
use nemoral_pipeline::recording::pose::FramePose;
use nemoral_pipeline::recording::recording_context::RecordingContext;
use nemoral_pipeline::{
    picture_of_classes, picture_of_depth, picture_of_instances, picture_of_normals, picture_of_scan,
};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{Image, RayCaster};

use super::shadow_cache::ShadowCachingCaster;
use super::world::WorldSnapshot;
use super::{Shared, half_width};
use crate::Error;
use crate::view_request::{ImageKind, ViewRequest, Viewpoint};

/// The number of what is seen, as that of the only frame of its config.
const FRAME: u64 = 0;

/// An image, before it is a file.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderedImage {
    /// sRGB code values.
    pub image: Image<[u8; 3]>,
    /// Whether its colours mean something, which a lossy file would blur.
    pub is_truth: bool,
    /// Whether it is whole, not a draft.
    pub still: bool,
}

/// The answer to a [`ViewRequest`].
#[derive(Clone, Debug, PartialEq)]
pub struct ViewImage {
    /// The image.
    pub rendered: RenderedImage,
    /// Where it was taken: as asked for, but clear of stems, logs and rocks.
    pub viewpoint: Viewpoint,
    /// The number of the change that it shows.
    pub revision: u64,
    /// Whether it is the whole picture of the newest change, with all that is visible. It will not
    /// change.
    pub is_final: bool,
}

/// Takes a picture or a scan.
pub(super) fn render(
    shared: &Shared,
    shown: &WorldSnapshot,
    seen: &Config,
    request: &ViewRequest,
    caster: &dyn RayCaster,
) -> Result<RenderedImage, Error> {
    let world = &*shown.world;
    let runner = world.runner(shared, 1);
    let robot = &seen.robot;
    let place_m = DVec2::new(robot.start_x_m, robot.start_y_m);
    let body = world
        .forest
        .level_pose(&runner, place_m, robot.heading_deg)?;
    let pose = FramePose::still(body, 0.0, &world.lidars, seen.chunks.size_m);
    let materials = &world.materials;
    let begun = Instant::now();
    // A GPU draws whole pictures quickly.
    let is_timed =
        !request.still && request.kind == ImageKind::Colour && !shared.backend.draws_ahead();
    let is_halved = is_timed && shared.halved.load(Ordering::Relaxed);
    let mut rig = world.cameras[usize::from(!request.still) + usize::from(is_halved)].clone();
    let intrinsics = seen.camera.intrinsics();
    let refused = |e| Error::value("camera", e, "possible at this size");
    let whole = intrinsics.map_err(refused)?;
    rig.intrinsics = if is_halved {
        half_width::camera_of(&whole)
    } else {
        whole
    };
    rig.body_from_camera = seen.camera.body_from_camera();
    rig.renderer
        .check_size(rig.intrinsics.width, rig.intrinsics.height)?;
    let eye_m = (body * rig.body_from_camera).translation_m - shown.scene.origin_m;
    let caching = ShadowCachingCaster {
        caster,
        shadows: &shown.shadows,
        eye_m: eye_m.as_vec3(),
        pixel_rad: (1.0 / whole.fx) as f32,
    };
    let mut context =
        RecordingContext::new(world.forest.world(), FRAME, &pose, &shown.scene, materials);
    context.caster = if request.still { caster } else { &caching };
    let truth = || context.truth(&rig);
    let image = match request.kind {
        ImageKind::Colour if is_halved => {
            half_width::fill(&context.picture(0, &rig)?.rgb, whole.width as usize)
        }
        ImageKind::Colour => context.picture(0, &rig)?.rgb,
        ImageKind::Classes => picture_of_classes(&truth()?, &world.ontology),
        ImageKind::Instances => picture_of_instances(&truth()?),
        ImageKind::Depth => picture_of_depth(&truth()?),
        ImageKind::Normals => picture_of_normals(&truth()?),
        ImageKind::Lidar => {
            let lidar = &world.lidars[0];
            let scan = context.scan(lidar);
            let camera_from_lidar = rig.body_from_camera.inverse() * lidar.body_from_lidar;
            picture_of_scan(&scan, &world.ontology, &rig.intrinsics, &camera_from_lidar)
        }
    };
    if is_timed {
        let next = half_width::is_next_halved(is_halved, begun.elapsed());
        shared.halved.store(next, Ordering::Relaxed);
    }
    Ok(RenderedImage {
        image,
        is_truth: request.kind != ImageKind::Colour,
        still: request.still,
    })
}

impl RenderedImage {
    /// The image as a file, with its media type: PNG where colours mean something, else JPEG.
    #[must_use]
    pub fn encode(&self) -> (&'static str, Vec<u8>) {
        let (width, height) = (self.image.width() as u32, self.image.height() as u32);
        let bytes = self.image.pixels().as_flattened();
        let mut out = Vec::new();
        if self.is_truth {
            let mut encoder = png::Encoder::new(&mut out, width, height);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            encoder.set_compression(png::Compression::Fast);
            let mut writer = encoder.write_header().expect("the sides are 16 to 8192");
            writer
                .write_image_data(bytes)
                .expect("the buffer has the image's size");
            writer.finish().expect("memory takes it");
            return ("image/png", out);
        }
        let quality = if self.still { 93 } else { 82 };
        JpegEncoder::new_with_quality(&mut out, quality)
            .encode(bytes, width, height, ExtendedColorType::Rgb8)
            .expect("the sides are 16 to 8192 and memory takes it");
        ("image/jpeg", out)
    }
}
