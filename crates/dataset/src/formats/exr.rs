//! Radiance images: OpenEXR, linear Rec. 709 primaries (sRGB's), 32-bit floats, cd/m².

use std::io::Cursor;
use std::path::Path;

use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{
    Compression, Encoding, Image as Exr, Layer, LayerAttributes, ReadChannels, ReadLayers,
    SpecificChannels, Vec2, WritableImage, read,
};
use nemoral_scene::Image;
use nemoral_scene::glam::Vec3;

use crate::Error;
use crate::formats::Size;

/// Three channels in blocks of sixteen deflated lines, which every reader knows.
pub(crate) fn encode(radiance: &Image<Vec3>) -> Vec<u8> {
    let size = (radiance.width(), radiance.height());
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let light = radiance.at(at.x(), at.y());
        (light.x, light.y, light.z)
    });
    let attributes = LayerAttributes {
        // A value of 1 is 1 cd/m².
        white_luminance: Some(1.0),
        ..LayerAttributes::default()
    };
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels);
    let mut out = Cursor::new(Vec::new());
    (Exr::from_layer(layer).write().non_parallel())
        .to_buffered(&mut out)
        .expect("the image has its size and memory takes it");
    out.into_inner()
}

/// Whether it is a header of [`encode`]. The format has a dozen ways to pack pixels, and only the
/// one that is written here is unpacked here.
fn is_ours(header: &Header) -> bool {
    let channels = &header.channels.list;
    let plain = |name: &str, i: usize| {
        channels.get(i).is_some_and(|c| {
            c.name == *name && c.sample_type == SampleType::F32 && c.sampling == Vec2(1, 1)
        })
    };
    !header.deep
        && header.compression == Compression::ZIP16
        && header.blocks == BlockDescription::ScanLines
        && channels.len() == 3
        && plain("B", 0)
        && plain("G", 1)
        && plain("R", 2)
}

/// The image, if it is what [`encode`] makes.
pub(crate) fn decode(path: &Path, bytes: &[u8], size: Size) -> Result<Image<Vec3>, Error> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false);
    let meta = meta.map_err(|e| Error::malformed(path, e))?;
    // This is checked before memory is allocated.
    let found = meta
        .headers
        .iter()
        .map(|h| (h.layer_size.x(), h.layer_size.y()));
    if !found.clone().eq([size]) {
        let found: Vec<_> = found.take(3).map(|(w, h)| format!("{w} × {h}")).collect();
        let (found, (w, h)) = (found.join(", "), size);
        let message = format!("has layers of {found} pixels, the camera has {w} × {h}");
        return Err(Error::malformed(path, message));
    }
    if !meta.headers.iter().all(is_ours) {
        let message =
            "must have channels B, G and R of 32-bit floats alone, in lines packed by ZIP";
        return Err(Error::malformed(path, message));
    }
    let read = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![Vec3::ZERO; size.area()]),
            |(width, pixels), at, (r, g, b): (f32, f32, f32)| {
                pixels[at.y() * *width + at.x()] = Vec3::new(r, g, b);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel();
    let read = read.from_buffered(Cursor::new(bytes));
    let layer = read.map_err(|e| Error::malformed(path, e))?.layer_data;
    let (width, pixels) = layer.channel_data.pixels;
    Ok(Image::new(width, layer.size.height(), pixels))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_comes_back_to_the_bit_and_the_bytes_are_the_same_each_time() {
        let pixel = |i: usize| Vec3::new(1.6e9 / (i as f32 + 1.0), i as f32 * 0.1, 1e-7);
        let radiance = Image::new(37, 21, (0..37 * 21).map(pixel).collect());
        let bytes = encode(&radiance);
        assert_eq!(bytes, encode(&radiance));
        let path = Path::new("x.exr");
        assert_eq!(decode(path, &bytes, (37, 21)).expect("whole"), radiance);
        let e = decode(path, &bytes[..bytes.len() / 2], (37, 21)).expect_err("half");
        assert!(e.to_string().contains("x.exr"), "{e}");
    }
    #[test]
    fn what_is_packed_otherwise_is_not_unpacked() {
        let packed = |compression| {
            let encoding = Encoding {
                compression,
                ..Encoding::SMALL_LOSSLESS
            };
            let channels = SpecificChannels::rgb(|_: Vec2<usize>| (1.0_f32, 2.0_f32, 3.0_f32));
            let layer = Layer::new((4, 4), LayerAttributes::default(), encoding, channels);
            let mut out = Cursor::new(Vec::new());
            let image = Exr::from_layer(layer);
            (image.write().non_parallel().to_buffered(&mut out)).expect("memory takes it");
            decode(Path::new("x.exr"), &out.into_inner(), (4, 4))
        };
        assert!(packed(Compression::ZIP16).is_ok());
        for other in [
            Compression::Uncompressed,
            Compression::PIZ,
            Compression::B44,
        ] {
            let e = packed(other).expect_err("another packing");
            assert!(e.to_string().contains("packed by ZIP"), "{e}");
        }
    }
}
