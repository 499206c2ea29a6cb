//! LAZ, unpacked by the crate `laz`, with header and points read by the specification's offsets.

use std::collections::BTreeMap;
use std::io::Cursor;

use laz::{LasZipDecompressor, LazVlr};
use nemoral_convert::FormatName;
use nemoral_scene::glam::DVec3;

use crate::common::{header, made, pose};

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes[at..at + 2].try_into().expect("two"))
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"))
}

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight"))
}

fn f64_at(bytes: &[u8], at: usize) -> f64 {
    f64::from_bits(u64_at(bytes, at))
}

#[test]
fn points_are_in_the_world_and_nothing_that_is_known_is_lost() {
    let made = made(FormatName::Laz);
    let lidar = &header().sequences[0].lidars[0];
    for (i, frame) in [1_u64, 2, 4].into_iter().enumerate() {
        let path = made.out.join(format!("00/top/{frame:06}.laz"));
        let bytes = std::fs::read(path).expect("a scan");
        assert_eq!(&bytes[..4], b"LASF");
        assert_eq!((bytes[24], bytes[25], u16_at(&bytes, 94)), (1, 4, 375));
        assert_eq!(bytes[104] & 0x3F, 6);
        let stride = usize::from(u16_at(&bytes, 105));
        let count = u64_at(&bytes, 247) as usize;
        let vector = |at: usize| DVec3::from_array([0, 8, 16].map(|i| f64_at(&bytes, at + i)));
        let (scale, offset) = (vector(131), vector(155));

        // The variable-length records: how points are packed, and what their extra bytes are.
        let (mut at, mut vlr, mut extra) = (375, None, BTreeMap::new());
        let mut position = 30;
        for _ in 0..u32_at(&bytes, 100) {
            let (id, length) = (
                u16_at(&bytes, at + 18),
                usize::from(u16_at(&bytes, at + 20)),
            );
            let data = &bytes[at + 54..at + 54 + length];
            match id {
                22204 => vlr = Some(LazVlr::from_buffer(data).expect("a record")),
                4 => {
                    for one in data.chunks(192) {
                        let name = one[4..36].split(|b| *b == 0).next().expect("a name");
                        let name = String::from_utf8(name.to_vec()).expect("ASCII");
                        extra.insert(name, position);
                        position += match one[2] {
                            1 => 1,
                            5 | 9 => 4,
                            other => panic!("type {other}"),
                        };
                    }
                }
                other => panic!("record {other}"),
            }
            at += 54 + length;
        }
        assert_eq!((at, position), (u32_at(&bytes, 96) as usize, stride));
        let mut source = Cursor::new(&bytes[..]);
        source.set_position(at as u64);
        let mut unpacked = vec![0; stride * count];
        let mut laz = LasZipDecompressor::new(source, vlr.expect("packed")).expect("packed");
        laz.decompress_many(&mut unpacked).expect("points");

        let scan = &made.dataset.read_frame(i).expect("a frame").lidars[0].ply;
        assert_eq!(scan.len(), count);
        let (time_s, world_from_body) = pose(frame);
        let world_from_lidar = world_from_body * lidar.body_from_lidar;
        let (mut low, mut high, mut first) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0);
        for (record, p) in unpacked.chunks(stride).zip(scan) {
            let steps = [0, 4, 8].map(|i| f64::from(u32_at(record, i) as i32));
            let found = DVec3::from_array(steps) * scale + offset;
            let expected = world_from_lidar.transform_point(p.point.position_m.as_dvec3());
            assert!(
                (found - expected).abs().max_element() <= 0.51e-4,
                "{found} {expected}"
            );
            (low, high) = (low.min(found), high.max(found));
            let intensity = f32::from(u16_at(record, 12)) / 65535.0;
            assert!((intensity - p.point.intensity).abs() < 1e-5);
            assert_eq!(record[14] & 15, p.point.return_number);
            assert_eq!(record[14] >> 4, p.point.returns);
            first += u64::from(p.point.return_number == 1);
            // Background, Terrain, Traversable, Trunks, Canopy, Shrubs, Herbaceous, Rocks.
            let asprs = [7, 2, 2, 5, 5, 4, 3, 1][usize::from(p.class)];
            assert_eq!((record[16], u16_at(record, 20)), (asprs, 1));
            assert_eq!(record[17], 1);
            // Angles from straight down, negative to the left.
            let angle_deg = f64::from(u16_at(record, 18) as i16) * 0.006;
            let down = (found - world_from_lidar.translation_m)
                .normalize()
                .dot(-DVec3::Z);
            assert!((angle_deg.abs().to_radians().cos() - down).abs() < 1e-4);
            assert_eq!(angle_deg < 0.0, p.point.position_m.y > 0.0);
            // What is fired together is a nanosecond apart.
            let time_ns = p.point.time_ns + i64::from(p.point.ring);
            let time = time_s + time_ns as f64 * 1e-9;
            assert!((f64_at(record, 22) - time).abs() < 1e-12);
            let byte = |name: &str| record[extra[name]];
            assert_eq!(byte("class"), p.class);
            assert_eq!(byte("semantic"), p.point.semantic as u8);
            assert_eq!(
                (byte("ring"), byte("flags")),
                (p.point.ring, p.point.flags.0)
            );
            assert_eq!(
                u32_at(record, extra["instance"]),
                p.point.object.to_image_id()
            );
            assert_eq!(u32_at(record, extra["pulse"]), p.point.pulse);
            assert_eq!(f32_at(record, extra["range"]), p.point.range_m);
            assert_eq!(f32_at(record, extra["range_true"]), p.point.true_range_m);
            assert_eq!(
                f32_at(record, extra["incidence_cos"]),
                p.point.incidence_cos
            );
        }
        assert_eq!(u64_at(&bytes, 255), first);
        for axis in 0..3 {
            assert!((f64_at(&bytes, 179 + 16 * axis) - high[axis]).abs() < 1e-8);
            assert!((f64_at(&bytes, 187 + 16 * axis) - low[axis]).abs() < 1e-8);
        }
    }
}
