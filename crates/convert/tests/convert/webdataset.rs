//! WebDataset's tar files, read by the offsets of POSIX.

use std::collections::BTreeMap;
use std::io::Cursor;

use nemoral_convert::FormatName;
use nemoral_scene::Distortion;

use crate::common::{header, made_of, pose};

/// The members by name, in their order.
fn untar(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let (mut at, mut members) = (0, Vec::new());
    while bytes[at..at + 512].iter().any(|b| *b != 0) {
        let header = &bytes[at..at + 512];
        let text = |from: usize, to: usize| {
            let field = header[from..to].split(|b| *b == 0).next().expect("a field");
            String::from_utf8(field.to_vec()).expect("ASCII")
        };
        assert_eq!(&header[257..263], b"ustar\0");
        let octal = |text: String| usize::from_str_radix(text.trim(), 8).expect("octal");
        let blank = header.iter().enumerate();
        let sum: usize = blank
            .map(|(i, b)| {
                if (148..156).contains(&i) {
                    32
                } else {
                    usize::from(*b)
                }
            })
            .sum();
        assert_eq!(octal(text(148, 156)), sum);
        let size = octal(text(124, 136));
        members.push((text(0, 100), bytes[at + 512..at + 512 + size].to_vec()));
        at += 512 + size.next_multiple_of(512);
    }
    assert_eq!(bytes.len(), at + 1024);
    members
}

/// The shape and the bytes of an `.npy`.
fn npy<'a>(bytes: &'a [u8], data_type: &str) -> (Vec<usize>, &'a [u8]) {
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(end % 64, 0);
    let head = std::str::from_utf8(&bytes[10..end]).expect("ASCII");
    assert!(
        head.contains(&format!("'descr': '{data_type}'")) && head.ends_with('\n'),
        "{head}"
    );
    let shape = head
        .split_once("'shape': (")
        .expect("a shape")
        .1
        .split_once(')')
        .expect("closed")
        .0;
    let shape = shape.split(',').map(|n| n.trim().parse().expect("a side"));
    (shape.collect(), &bytes[end..])
}

#[test]
fn samples_hold_what_the_frames_hold() {
    let mut header = header();
    let [k1, k2, k3, p1, p2] = [-0.15, 0.03, 0.001, 0.002, -0.004];
    header.sequences[0].cameras[0].intrinsics.distortion =
        Distortion::BrownConrady { k1, k2, k3, p1, p2 };
    let made = made_of(FormatName::WebDataset, &header);
    let bytes = std::fs::read(made.out.join("00-000000.tar")).expect("a shard");
    let members = untar(&bytes);
    // The members of one sample are neighbours.
    let keys: Vec<&str> = (members.iter())
        .map(|(n, _)| n.split_once('.').expect("a key").0)
        .collect();
    assert!(keys.is_sorted());
    assert_eq!(members.len(), 3 * (1 + 2 * 5 + 2));
    let members: BTreeMap<String, Vec<u8>> = members.into_iter().collect();
    for (i, frame) in [1, 2, 4].into_iter().enumerate() {
        let read = made.dataset.read_frame(i).expect("a frame");
        let get = |suffix: &str| &members[&format!("00_{frame:06}.{suffix}")];
        let json: serde_json::Value = serde_json::from_slice(get("json")).expect("JSON");
        let (time_s, body) = pose(frame);
        assert_eq!(json["time_s"].as_f64(), Some(time_s));
        let names = json["classes"].as_object().expect("names by ids");
        assert_eq!(names.len(), 8);
        assert_eq!(names["3"], "Trunks");
        for (c, camera) in header.sequences[0].cameras.iter().enumerate() {
            let at = (body * camera.body_from_camera).translation_m;
            let found = &json["cameras"][c]["world_from_camera"];
            for axis in 0..3 {
                let found = found[axis][3].as_f64().expect("a number");
                assert!((found - at[axis]).abs() < 1e-8);
            }
            let name = &camera.name;
            let folder = made.dataset.root().join("sequences/00");
            let native = |first: &str| match (c, first) {
                (0, _) => folder.join(format!("{first}/{frame:06}.png")),
                (_, "image_2") => folder.join(format!("image_3/{frame:06}.png")),
                _ => folder.join(format!("{name}/{first}/{frame:06}.png")),
            };
            for (ours, theirs) in [
                ("image_2", "rgb"),
                ("instance", "instance"),
                ("normals", "normals"),
            ] {
                let expected = std::fs::read(native(ours)).expect("a picture");
                assert_eq!(*get(&format!("{name}.{theirs}.png")), expected);
            }
            // Grey numbers, which stay what they are in RGB.
            let classes = get(&format!("{name}.semantic.png"));
            let mut decoder = png::Decoder::new(Cursor::new(&classes[..]));
            decoder.set_transformations(png::Transformations::IDENTITY);
            let mut reader = decoder.read_info().expect("a PNG");
            let mut grey = vec![0; reader.output_buffer_size().expect("small")];
            let info = reader.next_frame(&mut grey).expect("pixels");
            let kind = (info.color_type, info.bit_depth);
            assert_eq!(kind, (png::ColorType::Grayscale, png::BitDepth::Eight));
            assert_eq!(grey, read.cameras[c].semantic.pixels());
            let said = &json["cameras"][c];
            let (k, lens) = (camera.intrinsics, ["brown_conrady", "pinhole"][c]);
            assert_eq!(said["lens"], lens);
            assert_eq!(said["cx"].as_f64(), Some(k.cx));
            let (shape, data) = npy(get(&format!("{name}.depth.npy")), "<f4");
            assert_eq!(shape, [22, 31]);
            let depth: Vec<f32> = data
                .as_chunks::<4>()
                .0
                .iter()
                .map(|b| f32::from_le_bytes(*b))
                .collect();
            assert_eq!(depth, read.cameras[c].depth_m.pixels());
        }
        let scan = &read.lidars[0];
        let (shape, data) = npy(get("top.points.npy"), "<f4");
        assert_eq!(shape, [scan.points.len(), 4]);
        let points: Vec<f32> = data
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect();
        assert_eq!(points, scan.points.as_flattened());
        let (shape, data) = npy(get("top.labels.npy"), "<u2");
        assert_eq!(shape, [scan.points.len(), 2]);
        let words: Vec<u16> = data
            .as_chunks::<2>()
            .0
            .iter()
            .map(|b| u16::from_le_bytes(*b))
            .collect();
        let pairs: Vec<_> = words.chunks(2).map(|w| (w[0], w[1])).collect();
        assert_eq!(pairs, scan.labels);
    }
}
