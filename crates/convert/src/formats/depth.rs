//! Depth as 32-bit floats, for tools that read no 16-bit PNG in KITTI's steps:
//! ```text
//! SS/CAMERA/FFFFFF.exr     OpenEXR, one channel Z, deflated
//! SS/CAMERA/FFFFFF.npy     NumPy, shape (height, width), <f4
//! ```
//! Depth is planar, metres; 0 where nothing is. It is as exact as the data set's: in steps of 1/256
//! m up to 256 m, and +Inf beyond, or not rounded if the data set was made with `output.depth_npy =
//! true`.
//!
//! Source: OpenEXR's technical introduction, which calls a channel of depth `Z`; NumPy's format
//! 1.0.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as Exr, Layer, LayerAttributes,
    WritableImage,
};
use nemoral_dataset::Manifest;
use nemoral_scene::Image;

use crate::formats::refuse_without_cameras;
use crate::{Error, Format, Sink, Source};

/// The format, by the container of its files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Depth {
    Exr,
    Npy,
}

impl Depth {
    const fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Npy => "npy",
        }
    }

    fn encode(self, depth_m: &Image<f32>) -> Vec<u8> {
        match self {
            Self::Exr => encode_exr(depth_m),
            Self::Npy => nemoral_dataset::encode_npy(depth_m),
        }
    }
}

impl Format for Depth {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_without_cameras(self.extension(), manifest)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        for sequence in source.sequences() {
            for frame in source.frames(sequence.number) {
                sink.step(&format!("frame-{}", frame.name()), |files| {
                    for (i, camera) in sequence.cameras.iter().enumerate() {
                        let (number, name) = (sequence.number, &camera.name);
                        let end = self.extension();
                        let path = format!("{number:02}/{name}/{:06}.{end}", frame.index);
                        files.put(path, self.encode(&source.depth_m(&frame, i)?));
                    }
                    Ok(String::new())
                })?;
            }
        }
        Ok(())
    }
}

fn encode_exr(depth_m: &Image<f32>) -> Vec<u8> {
    let samples = FlatSamples::F32(depth_m.pixels().to_vec());
    let channels = AnyChannels::sort([AnyChannel::new("Z", samples)].into_iter().collect());
    let size = (depth_m.width(), depth_m.height());
    let attributes = LayerAttributes::default();
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels);
    let mut out = Cursor::new(Vec::new());
    (Exr::from_layer(layer).write().non_parallel())
        .to_buffered(&mut out)
        .expect("the image has its size and memory takes it");
    out.into_inner()
}
