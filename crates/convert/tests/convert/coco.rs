//! COCO's files, decoded as pycocotools and panopticapi do.

use std::collections::BTreeMap;

use nemoral_convert::{ConvertParams, FormatName, convert};
use serde_json::Value;

use crate::common::{header, made, objects, png, text};

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

fn items<'a>(of: &'a Value, name: &str) -> &'a [Value] {
    of[name].as_array().expect(name)
}

fn number(of: &Value) -> usize {
    of.as_u64().expect("a number") as usize
}

/// The pixels, row by row, of compressed runs, which go column by column.
fn mask(segmentation: &Value) -> Vec<bool> {
    let (height, width) = (
        number(&segmentation["size"][0]),
        number(&segmentation["size"][1]),
    );
    let mut bytes = segmentation["counts"].as_str().expect("runs").bytes();
    let mut counts: Vec<i64> = Vec::new();
    while bytes.len() > 0 {
        let (mut x, mut shift, mut last) = (0_i64, 0, 0);
        for byte in bytes.by_ref() {
            last = i64::from(byte) - 48;
            x |= (last & 0x1F) << shift;
            shift += 5;
            if last & 0x20 == 0 {
                break;
            }
        }
        if last & 0x10 != 0 {
            x |= -1 << shift;
        }
        if counts.len() > 2 {
            x += counts[counts.len() - 2];
        }
        counts.push(x);
    }
    let runs = counts.iter().enumerate();
    let columns: Vec<bool> = runs
        .flat_map(|(i, &n)| std::iter::repeat_n(i % 2 == 1, n as usize))
        .collect();
    assert_eq!(columns.len(), width * height);
    (0..width * height)
        .map(|i| columns[i % width * height + i / width])
        .collect()
}

fn bounds(mask: &[bool], width: usize) -> [usize; 4] {
    let on = || {
        mask.iter()
            .enumerate()
            .filter(|(_, m)| **m)
            .map(|(i, _)| (i % width, i / width))
    };
    let (left, right) = (on().map(|p| p.0).min(), on().map(|p| p.0).max());
    let (top, bottom) = (on().map(|p| p.1).min(), on().map(|p| p.1).max());
    let (left, top) = (left.expect("not empty"), top.expect("not empty"));
    [
        left,
        top,
        right.expect("there") - left + 1,
        bottom.expect("there") - top + 1,
    ]
}

#[test]
fn masks_are_the_instance_maps_and_segments_the_classes() {
    let made = made(FormatName::Coco);
    let (header, width) = (header(), 31);
    let instances = json(&text(made.out.join("instances.json")));
    let panoptic = json(&text(made.out.join("panoptic.json")));
    let kinds: BTreeMap<usize, &str> = (items(&instances, "categories").iter())
        .map(|c| (number(&c["id"]), c["name"].as_str().expect("a name")))
        .collect();
    let classes: BTreeMap<usize, (&str, usize)> = (items(&panoptic, "categories").iter())
        .map(|c| {
            let name = c["name"].as_str().expect("a name");
            (number(&c["id"]), (name, number(&c["isthing"])))
        })
        .collect();
    assert_eq!(classes[&4], ("Trunks", 1));
    assert_eq!(classes[&2], ("Terrain", 0));
    let names = [1, 2, 4].into_iter().flat_map(|k| {
        let name = move |c: &nemoral_dataset::CameraSpec| format!("00_{k:06}_{}.png", c.name);
        header.sequences[0]
            .cameras
            .iter()
            .map(name)
            .collect::<Vec<_>>()
    });
    let (mut ids, mut crowds) = (Vec::new(), 0);
    for (i, name) in names.enumerate() {
        let seen = &made.dataset.read_frame(i / 2).expect("a frame").cameras[i % 2];
        let image = &items(&instances, "images")[i];
        assert_eq!(image["file_name"], name);
        assert_eq!(items(&panoptic, "images")[i], *image);
        let (w, h, rgb) = png(made.out.join("images").join(&name));
        assert_eq!((w, number(&image["width"])), (width, width));
        assert_eq!(h, number(&image["height"]));
        assert_eq!(rgb, seen.rgb.pixels().as_flattened());

        let mut found = vec![0; w * h];
        for a in items(&instances, "annotations")
            .iter()
            .filter(|a| a["image_id"] == image["id"])
        {
            ids.push(number(&a["id"]));
            let mask = mask(&a["segmentation"]);
            let instance = number(&a["instance_id"]);
            assert_eq!(number(&a["area"]), mask.iter().filter(|m| **m).count());
            let bbox: Vec<_> = items(a, "bbox").iter().map(number).collect();
            assert_eq!(bbox, bounds(&mask, width));
            for (pixel, _) in mask.iter().enumerate().filter(|(_, m)| **m) {
                assert_eq!(found[pixel], 0, "objects do not overlap");
                found[pixel] = instance;
            }
            let object = objects()
                .into_iter()
                .find(|o| o.object.to_image_id() as usize == instance);
            assert_eq!(
                kinds[&number(&a["category_id"])],
                object.expect("known").kind.name()
            );
        }
        let expected: Vec<_> = seen.instance.pixels().iter().map(|&i| i as usize).collect();
        assert_eq!(found, expected);

        let annotation = &items(&panoptic, "annotations")[i];
        assert_eq!(
            (&annotation["image_id"], &annotation["file_name"]),
            (&image["id"], &image["file_name"])
        );
        let (_, _, data) = png(made.out.join("panoptic").join(&name));
        let map: Vec<usize> = (data.chunks(3))
            .map(|c| usize::from(c[0]) + 256 * usize::from(c[1]) + 65536 * usize::from(c[2]))
            .collect();
        let mut covered = 0;
        for segment in items(annotation, "segments_info") {
            let mask: Vec<bool> = map.iter().map(|&id| id == number(&segment["id"])).collect();
            assert_eq!(
                number(&segment["area"]),
                mask.iter().filter(|m| **m).count()
            );
            covered += number(&segment["area"]);
            let bbox: Vec<_> = items(segment, "bbox").iter().map(number).collect();
            assert_eq!(bbox, bounds(&mask, width));
            for (pixel, _) in mask.iter().enumerate().filter(|(_, m)| **m) {
                let class = number(&segment["category_id"]) - 1;
                assert_eq!(usize::from(seen.semantic.pixels()[pixel]), class);
                assert_eq!(expected[pixel], number(&segment["instance_id"]));
            }
            let is_thing = classes[&number(&segment["category_id"])].1 == 1;
            let is_crowd = is_thing && number(&segment["instance_id"]) == 0;
            assert_eq!(number(&segment["iscrowd"]), usize::from(is_crowd));
            crowds += usize::from(is_crowd);
        }
        assert_eq!(covered, w * h, "every pixel is in a segment");
    }
    assert_eq!(
        ids,
        (1..=items(&instances, "annotations").len()).collect::<Vec<_>>()
    );
    assert!(
        ids.len() > 9 && crowds == 0,
        "{} objects, {crowds} crowds",
        ids.len()
    );
}

#[test]
fn objects_of_few_pixels_are_left_out_if_asked() {
    let made = made(FormatName::Coco);
    let all = json(&text(made.out.join("instances.json")));
    let areas: Vec<usize> = (items(&all, "annotations").iter())
        .map(|a| number(&a["area"]))
        .collect();
    let middle = (areas.iter().min().expect("objects") + areas.iter().max().expect("objects")) / 2;
    let params = ConvertParams {
        min_px: middle as u32,
        ..ConvertParams::new(FormatName::Coco)
    };
    let out = made.out.with_file_name("large");
    convert(made.dataset.root(), &out, &params).expect("converted");
    let large = json(&text(out.join("instances.json")));
    let found: Vec<usize> = (items(&large, "annotations").iter())
        .map(|a| number(&a["area"]))
        .collect();
    let expected: Vec<usize> = areas.iter().copied().filter(|a| *a >= middle).collect();
    assert!(!found.is_empty() && found.len() < areas.len());
    assert_eq!(found, expected);
    assert_eq!(large["images"], all["images"]);
    // Segments are of all pixels.
    let panoptic = [&made.out, &out].map(|out| text(out.join("panoptic.json")));
    assert_eq!(panoptic[0], panoptic[1]);
}
