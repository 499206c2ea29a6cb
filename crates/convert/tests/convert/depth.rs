//! Depth as floats: OpenEXR by the crate `exr`'s reader, NumPy's arrays by their format.

use exr::prelude::{FlatSamples, Vec2, read_first_flat_layer_from_file};
use nemoral_convert::FormatName;

use crate::common::{header, made};

#[test]
fn every_depth_is_the_data_sets() {
    let (exr, npy) = (made(FormatName::Exr), made(FormatName::Npy));
    for (i, frame) in [1_u64, 2, 4].into_iter().enumerate() {
        let cameras = &exr.dataset.read_frame(i).expect("a frame").cameras;
        for (seen, spec) in cameras.iter().zip(&header().sequences[0].cameras) {
            let depth_m = seen.depth_m.pixels();
            assert!(depth_m.iter().any(|z| *z > 0.0));
            let path = exr.out.join(format!("00/{}/{frame:06}.exr", spec.name));
            let image = read_first_flat_layer_from_file(path).expect("OpenEXR");
            let layer = &image.layer_data;
            assert_eq!(layer.size, Vec2(31, 22));
            assert_eq!(layer.channel_data.list.len(), 1);
            let channel = &layer.channel_data.list[0];
            assert_eq!(channel.name.to_string(), "Z");
            let FlatSamples::F32(samples) = &channel.sample_data else {
                panic!("no floats");
            };
            assert_eq!(samples, depth_m);

            let path = npy.out.join(format!("00/{}/{frame:06}.npy", spec.name));
            let bytes = std::fs::read(path).expect("an array");
            let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
            let head = std::str::from_utf8(&bytes[10..end]).expect("ASCII");
            assert!(
                head.contains("'<f4'") && head.contains("(22, 31)"),
                "{head}"
            );
            let values: Vec<f32> = (bytes[end..].as_chunks::<4>().0.iter())
                .map(|b| f32::from_le_bytes(*b))
                .collect();
            assert_eq!(values, depth_m);
        }
    }
}
