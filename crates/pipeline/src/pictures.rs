//! Truth and scans in colours, for eyes.

use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    Image, Intrinsics, LidarPoint, Ontology, RigidTransform, Semantic, TruthImages,
};

/// The colour where there is nothing.
pub(crate) const PAPER: [u8; 3] = [18, 20, 22];

/// The colours of the classes, with a little shading.
#[must_use]
pub fn picture_of_classes(truth: &TruthImages, ontology: &Ontology) -> Image<[u8; 3]> {
    let flat = truth.semantic.map(|&s| ontology.class(s).colour);
    shaded(&flat, &truth.normal)
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

/// A colour for each instance, grey for what is none.
#[must_use]
pub fn picture_of_instances(truth: &TruthImages) -> Image<[u8; 3]> {
    let objects = &truth.object;
    let pixels = objects
        .pixels()
        .iter()
        .zip(truth.semantic.pixels())
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
    let flat = Image::new(objects.width(), objects.height(), pixels.collect());
    shaded(&flat, &truth.normal)
}

/// Depth: near is warm and light, far cold and dark, by the logarithm; where nothing was hit it is
/// darkest.
#[must_use]
pub fn picture_of_depth(truth: &TruthImages) -> Image<[u8; 3]> {
    truth.depth_m.map(|&d| depth_colour(d))
}

/// Normals in the camera's frame: each axis from -1 to 1 is a channel from 0 to 255, as in files.
#[must_use]
pub fn picture_of_normals(truth: &TruthImages) -> Image<[u8; 3]> {
    let channel = |v: f32| (127.5 * (v + 1.0)).round() as u8;
    truth.normal.map(|n| n.to_array().map(channel))
}

fn hue_colour(hue: f32, value: f32) -> [u8; 3] {
    [0.0, 2.0 / 3.0, 1.0 / 3.0].map(|shift| {
        let wave = ((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0;
        ((0.25 + 0.75 * wave.clamp(0.0, 1.0)) * value * 255.0) as u8
    })
}

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
    let t = ((libm::logf(depth_m.max(1.0)) / libm::logf(200.0)) * 5.0).clamp(0.0, 4.999);
    let (i, f) = (t as usize, t.fract());
    std::array::from_fn(|k| (ANCHORS[i][k] * (1.0 - f) + ANCHORS[i + 1][k] * f) as u8)
}

/// A scan from behind and above the camera, in the colours of the classes.
#[must_use]
pub fn picture_of_scan(
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
