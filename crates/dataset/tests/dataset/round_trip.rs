//! Everything that is written comes back, also through a second reader written from the formats'
//! specifications.

use std::path::Path;

use nemoral_dataset::{Dataset, DepthFormat, OpenMode, Writer, stats};

use crate::common::{header, opened, see, small, write};

#[test]
fn a_data_set_comes_back() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = header();
    let dataset = write(dir.path(), &header, &[0, 1, 3]);
    assert_eq!(dataset.manifest().header, opened(&header));
    let config = dataset.sequence_config(0).expect("a config");
    assert_eq!(config, header.sequences[0].config_toml);
    assert_eq!(dataset.manifest().tracks[0].frames, [[0, 2], [3, 4]]);
    assert_eq!(dataset.manifest().tracks[0].length, 4);
    for (i, k) in [0, 1, 3].into_iter().enumerate() {
        let (seen, frame) = (see(&header, k), dataset.read_frame(i).expect("frame"));
        let (camera, truth) = (&frame.cameras[0], &seen.truth[0]);
        assert_eq!(camera.rgb, seen.rgb[0]);
        assert_eq!(
            camera.semantic,
            truth.semantic.map(|&s| header.ontology.class(s).id)
        );
        assert_eq!(camera.instance, truth.object.map(|o| o.to_image_id()));
        for (a, b) in camera.depth_m.pixels().iter().zip(truth.depth_m.pixels()) {
            assert!((a - b).abs() <= 0.5 / 256.0 + 1e-5 && (*a == 0.0) == (*b == 0.0));
        }
        for (a, b) in camera.normal.pixels().iter().zip(truth.normal.pixels()) {
            assert!(a == b || a.angle_between(*b).to_degrees() < 0.4);
        }
        let (scan, points) = (&frame.lidars[0], &seen.points[0]);
        assert!(points.len() > 10_000);
        assert!(scan.ply.iter().map(|p| p.point).eq(points.iter().copied()));
        for ((p, bin), (label, ply)) in points
            .iter()
            .zip(&scan.points)
            .zip(scan.labels.iter().zip(&scan.ply))
        {
            assert_eq!(
                bin,
                &[p.position_m.x, p.position_m.y, p.position_m.z, p.intensity]
            );
            let expected = (
                u16::from(header.ontology.class(p.semantic).id),
                p.object.to_label_id(seen.chunk),
            );
            assert_eq!(
                (*label, u16::from(ply.class), ply.label),
                (expected, expected.0, expected.1)
            );
        }
    }
    assert_eq!(dataset.trees(0).expect("trees"), crate::common::trees());
    assert_eq!(
        dataset.objects(0).expect("objects"),
        crate::common::objects()
    );
    assert!(dataset.read_frame(3).is_err());
    assert!(!dir.path().join(".nemoral").exists());
}

/// Reads PLY by its specification, as far as scalars in one element need it.
fn read_ply(bytes: &[u8]) -> Vec<Vec<(String, f64)>> {
    let end = b"end_header\n";
    let at = bytes
        .windows(end.len())
        .position(|w| w == end)
        .expect("a header")
        + end.len();
    let text = std::str::from_utf8(&bytes[..at]).expect("ascii");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("ply"));
    assert_eq!(lines.next(), Some("format binary_little_endian 1.0"));
    let (mut count, mut fields) = (0, Vec::new());
    for line in lines {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["element", "vertex", n] => count = n.parse().expect("a count"),
            ["property", kind, name] => fields.push((kind, name)),
            ["comment", ..] | ["end_header"] => {}
            ref other => panic!("{other:?}"),
        }
    }
    let mut data = &bytes[at..];
    let mut take = |n: usize| {
        let (head, tail) = data.split_at(n);
        data = tail;
        head
    };
    let mut rows = Vec::new();
    for _ in 0..count {
        let mut row = Vec::new();
        for (kind, name) in &fields {
            let value = match *kind {
                "uchar" => f64::from(take(1)[0]),
                "double" => f64::from_le_bytes(take(8).try_into().expect("8")),
                "int" => f64::from(i32::from_le_bytes(take(4).try_into().expect("4"))),
                "float" => f64::from(f32::from_le_bytes(take(4).try_into().expect("4"))),
                other => panic!("{other}"),
            };
            row.push(((*name).to_owned(), value));
        }
        rows.push(row);
    }
    assert!(data.is_empty());
    rows
}

#[test]
fn a_second_reader_sees_the_same_points() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    write(dir.path(), &header, &[1]);
    let (seen, at) = (see(&header, 1), dir.path().join("sequences/00"));
    let bin = std::fs::read(at.join("velodyne/000001.bin")).expect("bin");
    let label = std::fs::read(at.join("labels/000001.label")).expect("label");
    let ply = read_ply(&std::fs::read(at.join("points/000001.ply")).expect("ply"));
    let points = &seen.points[0];
    assert_eq!(
        (bin.len(), label.len(), ply.len()),
        (16 * points.len(), 4 * points.len(), points.len())
    );
    for (i, p) in points.iter().enumerate() {
        let float =
            |k: usize| f32::from_le_bytes(bin[16 * i + 4 * k..][..4].try_into().expect("4"));
        assert_eq!(
            [float(0), float(1), float(2), float(3)],
            [p.position_m.x, p.position_m.y, p.position_m.z, p.intensity]
        );
        let word = u32::from_le_bytes(label[4 * i..][..4].try_into().expect("4"));
        let class = u32::from(header.ontology.class(p.semantic).id);
        assert_eq!(
            word,
            class | u32::from(p.object.to_label_id(seen.chunk)) << 16
        );
        let expected = [
            ("x", f64::from(p.position_m.x)),
            ("y", f64::from(p.position_m.y)),
            ("z", f64::from(p.position_m.z)),
            ("range", f64::from(p.range_m)),
            ("range_true", f64::from(p.true_range_m)),
            ("intensity", f64::from(p.intensity)),
            ("reflectivity", f64::from(p.reflectivity)),
            ("class", f64::from(class)),
            ("semantic", f64::from(p.semantic as u8)),
            ("chunk_x", f64::from(p.object.chunk().x)),
            ("chunk_y", f64::from(p.object.chunk().y)),
            ("item", f64::from(p.object.item())),
            ("label_instance", f64::from(word >> 16)),
            ("ring", f64::from(p.ring)),
            ("return_no", f64::from(p.return_number)),
            ("n_returns", f64::from(p.returns)),
            ("t", p.time_ns as f64 / 1e9),
            ("pulse", f64::from(p.pulse)),
            ("incidence_cos", f64::from(p.incidence_cos)),
            ("nx", f64::from(p.normal.x)),
            ("ny", f64::from(p.normal.y)),
            ("nz", f64::from(p.normal.z)),
            ("flags", f64::from(p.flags.0)),
        ];
        assert!(
            ply[i].iter().map(|(n, v)| (n.as_str(), *v)).eq(expected),
            "{:?}",
            ply[i]
        );
    }
}

#[test]
fn images_look_right_to_an_ordinary_viewer() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    write(dir.path(), &header, &[0]);
    let seen = see(&header, 0);
    let open = |folder: &str| {
        image::open(dir.path().join(format!("sequences/00/{folder}/000000.png"))).expect("an image")
    };
    let truth = &seen.truth[0];
    // The colours of the palette are those of the classes.
    let colours = open("semantic").into_rgb8();
    for (s, c) in truth.semantic.pixels().iter().zip(colours.pixels()) {
        assert_eq!(c.0, header.ontology.class(*s).colour);
    }
    let ids = open("instance").into_rgb8();
    for (o, c) in truth.object.pixels().iter().zip(ids.pixels()) {
        let [r, g, b] = c.0.map(u32::from);
        assert_eq!(o.to_image_id(), r + 256 * g + 65536 * b);
    }
    let depth = open("depth");
    assert_eq!(depth.color(), image::ColorType::L16);
    for (z, d) in truth
        .depth_m
        .pixels()
        .iter()
        .zip(depth.into_luma16().pixels())
    {
        assert_eq!(f32::from(d.0[0]), (z * 256.0).round());
    }
    let normals = open("normals").into_rgb8();
    for (n, c) in truth.normal.pixels().iter().zip(normals.pixels()) {
        let code = |v: f32| (127.5 * (v + 1.0)).round() as u8;
        let expected = if n.length() == 0.0 {
            [0; 3]
        } else {
            n.to_array().map(code)
        };
        assert_eq!(c.0, expected);
    }
    assert_eq!(
        open("image_2").into_rgb8().into_raw(),
        seen.rgb[0].pixels().as_flattened()
    );
}

#[test]
fn float_depth_keeps_every_bit() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut header = small();
    header.sequences[0].depth_format = DepthFormat::Npy;
    let dataset = write(dir.path(), &header, &[0]);
    let frame = dataset.read_frame(0).expect("frame");
    assert_eq!(frame.cameras[0].depth_m, see(&header, 0).truth[0].depth_m);
    assert!(dir.path().join("sequences/00/depth/000000.npy").exists());
    assert!(!dir.path().join("sequences/00/depth/000000.png").exists());
}

#[test]
fn statistics_are_counted_right() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    write(dir.path(), &header, &[0, 2]);
    let s = stats(dir.path()).expect("stats");
    let seen = [see(&header, 0), see(&header, 2)];
    for c in &s.classes {
        let of = |s| header.ontology.class(s).id == c.id;
        let pixels = seen
            .iter()
            .flat_map(|f| f.truth[0].semantic.pixels())
            .filter(|s| of(**s))
            .count();
        let points = seen
            .iter()
            .flat_map(|f| &f.points[0])
            .filter(|p| of(p.semantic))
            .count();
        assert_eq!(
            (c.pixels, c.points),
            (pixels as u64, points as u64),
            "{}",
            c.name
        );
    }
    let depths = seen.iter().flat_map(|f| f.truth[0].depth_m.pixels());
    let farthest = depths.fold(0.0_f32, |a, &b| a.max(b));
    assert!((s.depth_m.expect("depth").max - f64::from(farthest)).abs() < 0.01);
    let files = crate::common::tree(dir.path());
    let size: usize = files
        .iter()
        .filter(|(p, _)| p != &Path::new("dataset.json"))
        .map(|(_, b)| b.len())
        .sum();
    assert_eq!((s.frames, s.trees, s.bytes), (2, 2, size as u64));
    let dbh = s.dbh_m.expect("trees");
    assert!((dbh.min - 0.2).abs() < 1e-12 && (dbh.max - 0.3).abs() < 1e-12);
    println!("{s}");
}

#[test]
fn the_second_opening_of_a_manifest_is_the_first() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    let writer = Writer::create(dir.path(), OpenMode::Fresh, header.clone()).expect("create");
    writer
        .write_frame(&see(&header, 0).data(&header))
        .expect("frame");
    let mut written = crate::common::finish(writer, 4);
    written.header = opened(&written.header);
    assert_eq!(
        Dataset::open(dir.path()).expect("open").manifest(),
        &written
    );
    let json = std::fs::read_to_string(dir.path().join("dataset.json")).expect("json");
    assert!(json.contains("\"seed\": 18446744073709551609"), "{json}");
}
