//! YOLO's boxes, turned back into pixels.

use std::collections::BTreeMap;

use nemoral_convert::{ConvertParams, Error, FormatName, OutputMode, convert};

use crate::common::{header, made, numbers, objects, text};

#[test]
fn boxes_are_around_the_visible_pixels_of_objects() {
    let made = made(FormatName::Yolo);
    let yaml = text(made.out.join("data.yaml"));
    assert!(
        yaml.contains("train:\n  - images/00\n") && yaml.contains("\n  0: tree\n"),
        "{yaml}"
    );
    let names: BTreeMap<&str, &str> = yaml
        .lines()
        .filter_map(|l| l.trim().split_once(": "))
        .collect();
    for (i, frame) in [1, 2, 4].into_iter().enumerate() {
        let read = made.dataset.read_frame(i).expect("a frame");
        for (c, camera) in header().sequences[0].cameras.iter().enumerate() {
            let name = format!("00/{frame:06}_{}", camera.name);
            assert!(made.out.join(format!("images/{name}.png")).exists());
            let map = &read.cameras[c].instance;
            let (w, h) = (map.width() as f64, map.height() as f64);
            let mut found = Vec::new();
            for row in numbers(&text(made.out.join(format!("labels/{name}.txt")))) {
                let [kind, x, y, width, height] = row[..] else {
                    panic!("{row:?}")
                };
                let edges = [
                    x - width / 2.0,
                    y - height / 2.0,
                    x + width / 2.0,
                    y + height / 2.0,
                ];
                let pixels: Vec<i64> = edges
                    .iter()
                    .zip([w, h, w, h])
                    .map(|(e, size)| {
                        let at = e * size;
                        assert!((at - at.round()).abs() < 1e-9);
                        at.round() as i64
                    })
                    .collect();
                found.push((names[&*kind.to_string()].to_owned(), pixels));
            }
            let mut expected = Vec::new();
            for object in objects() {
                let id = object.object.to_image_id();
                let on = || {
                    let pixels = map.pixels().iter().enumerate().filter(|(_, i)| **i == id);
                    pixels.map(|(i, _)| ((i % map.width()) as i64, (i / map.width()) as i64))
                };
                if let (Some(l), Some(t)) = (on().map(|p| p.0).min(), on().map(|p| p.1).min()) {
                    let r = on().map(|p| p.0).max().expect("there") + 1;
                    let b = on().map(|p| p.1).max().expect("there") + 1;
                    expected.push((object.kind.name().to_owned(), vec![l, t, r, b]));
                }
            }
            found.sort();
            expected.sort();
            assert_eq!(found, expected);
            assert!(!found.is_empty());
        }
    }
}

#[test]
fn objects_of_few_pixels_have_no_boxes_if_asked() {
    let made = made(FormatName::Yolo);
    let map = &made.dataset.read_frame(0).expect("a frame").cameras[0].instance;
    let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
    for &id in map.pixels().iter().filter(|id| **id > 0) {
        *sizes.entry(id).or_default() += 1;
    }
    let largest = sizes.values().copied().max().expect("objects");
    assert!(sizes.len() > 1 && sizes.values().any(|size| *size < largest));
    // The number itself is enough.
    for min_px in [0, 1, largest, largest + 1] {
        let params = ConvertParams {
            min_px: min_px as u32,
            ..ConvertParams::new(FormatName::Yolo)
        };
        let out = made.out.with_file_name(format!("of-{min_px}"));
        convert(made.dataset.root(), &out, &params).expect("converted");
        let rows = numbers(&text(out.join("labels/00/000001_front.txt")));
        let expected = sizes.values().filter(|size| **size >= min_px).count();
        assert_eq!(rows.len(), expected, "{min_px}");
        assert!(out.join("images/00/000001_front.png").exists());
    }
    // One of other boxes is not gone on with.
    let params = ConvertParams {
        min_px: 1,
        mode: OutputMode::Resume,
        ..ConvertParams::new(FormatName::Yolo)
    };
    let e = convert(made.dataset.root(), &made.out, &params).expect_err("all boxes");
    assert!(
        matches!(
            e,
            Error::Mismatch {
                field: "min_px",
                ..
            }
        ),
        "{e}"
    );
}
