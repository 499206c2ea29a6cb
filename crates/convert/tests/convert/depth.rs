//! Depth as floats: OpenEXR by the crate `exr`'s reader, NumPy's arrays by their format.

use std::path::PathBuf;

use exr::prelude::{FlatSamples, Vec2, read_first_flat_layer_from_file};
use nemoral_convert::{FormatName, OutputMode};
use nemoral_dataset::{CameraSpec, DepthFormat};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{Image, ObjectId, Semantic, TruthImages};

use crate::common::{header, made, run, write_of};

/// The samples of an OpenEXR file of 31 by 22 pixels.
fn of_exr(path: PathBuf) -> Vec<f32> {
    let image = read_first_flat_layer_from_file(path).expect("OpenEXR");
    let layer = &image.layer_data;
    assert_eq!(layer.size, Vec2(31, 22));
    assert_eq!(layer.channel_data.list.len(), 1);
    let channel = &layer.channel_data.list[0];
    assert_eq!(channel.name.to_string(), "Z");
    let FlatSamples::F32(samples) = &channel.sample_data else {
        panic!("no floats");
    };
    samples.clone()
}

/// The values of a NumPy array of that size.
fn of_npy(path: PathBuf) -> Vec<f32> {
    let bytes = std::fs::read(path).expect("an array");
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let head = std::str::from_utf8(&bytes[10..end]).expect("ASCII");
    assert!(
        head.contains("'<f4'") && head.contains("(22, 31)"),
        "{head}"
    );
    (bytes[end..].as_chunks::<4>().0.iter())
        .map(|b| f32::from_le_bytes(*b))
        .collect()
}

#[test]
fn every_depth_is_the_data_sets() {
    let (exr, npy) = (made(FormatName::Exr), made(FormatName::Npy));
    for (i, frame) in [1_u64, 2, 4].into_iter().enumerate() {
        let cameras = &exr.dataset.read_frame(i).expect("a frame").cameras;
        for (seen, spec) in cameras.iter().zip(&header().sequences[0].cameras) {
            let depth_m = seen.depth_m.pixels();
            assert!(depth_m.iter().any(|z| *z > 0.0));
            let path = exr.out.join(format!("00/{}/{frame:06}.exr", spec.name));
            assert_eq!(of_exr(path), depth_m);
            let path = npy.out.join(format!("00/{}/{frame:06}.npy", spec.name));
            assert_eq!(of_npy(path), depth_m);
        }
    }
}

/// Sky, and surfaces up to 300 m away.
fn distant(camera: &CameraSpec, _: u64) -> (Image<[u8; 3]>, TruthImages) {
    let size = [camera.intrinsics.width, camera.intrinsics.height].map(|side| side as usize);
    let count = size[0] * size[1];
    let depth_m = (0..count).map(|i| 300.0 * i as f32 / (count - 1) as f32);
    let depth_m = Image::new(size[0], size[1], depth_m.collect());
    let is_sky = |z: f32| z == 0.0;
    let truth = TruthImages {
        semantic: depth_m.map(|&z| match is_sky(z) {
            true => Semantic::Sky,
            false => Semantic::Litter,
        }),
        object: depth_m.map(|_| ObjectId::NONE),
        normal: depth_m.map(|&z| if is_sky(z) { Vec3::ZERO } else { -Vec3::Z }),
        depth_m,
    };
    (truth.depth_m.map(|_| [1, 2, 3]), truth)
}

#[test]
fn what_is_too_far_for_16_bits_is_infinitely_far() {
    for format in [DepthFormat::Png16, DepthFormat::Npy] {
        let mut header = header();
        header.sequences[0].depth_format = format;
        let camera = &header.sequences[0].cameras[0];
        let (_, truth) = distant(camera, 1);
        let folder = tempfile::tempdir().expect("a folder");
        let source = folder.path().join("dataset");
        write_of(&source, &header, &[1], distant);
        let [exr, npy] = [(FormatName::Exr, "exr"), (FormatName::Npy, "npy")].map(|(name, end)| {
            let out = folder.path().join(end);
            run(&source, &out, name, OutputMode::Fresh).expect("converted");
            out.join(format!("00/{}/000001.{end}", camera.name))
        });
        let mut infinite = 0;
        for found_m in [of_exr(exr), of_npy(npy)] {
            assert_eq!(found_m.len(), truth.depth_m.pixels().len());
            for (&found_m, &z) in found_m.iter().zip(truth.depth_m.pixels()) {
                if format == DepthFormat::Png16 && z > 256.0 {
                    assert_eq!(found_m, f32::INFINITY, "{z}");
                    infinite += 1;
                } else if found_m.is_finite() {
                    // Half a step of a PNG.
                    assert!((found_m - z).abs() <= 0.5 / 256.0, "{found_m} for {z}");
                } else {
                    assert!(z > 255.99, "{z}");
                }
            }
        }
        assert_eq!(infinite > 100, format == DepthFormat::Png16);
    }
}
