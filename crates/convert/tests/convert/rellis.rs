//! RELLIS-3D's layout, read through its lists.

use nemoral_convert::FormatName;

use crate::common::{header, made, numbers, png, text};

/// Background, Terrain, Traversable, Trunks, Canopy, Shrubs, Herbaceous, Rocks in RELLIS-3D.
const IDS: [u8; 8] = [7, 1, 1, 4, 4, 19, 3, 34];

#[test]
fn lists_lead_to_pictures_and_scans_with_their_classes() {
    let made = made(FormatName::Rellis);
    let list = |name: &str| {
        let text = text(made.out.join(name));
        let pair = |l: &str| l.split_once(' ').map(|(a, b)| (a.to_owned(), b.to_owned()));
        text.lines()
            .map(|l| pair(l).expect("two paths"))
            .collect::<Vec<_>>()
    };
    assert!(list("val.lst").is_empty() && list("pt_test.lst").is_empty());
    let (pictures, scans) = (list("train.lst"), list("pt_train.lst"));
    assert_eq!((pictures.len(), scans.len()), (3, 3));
    assert_eq!(
        pictures[2].0,
        "00000/pylon_camera_node/frame000004-2_250.png"
    );
    assert_eq!(numbers(&text(made.out.join("00000/poses.txt"))).len(), 3);
    // The first pixel's centre is at (0, 0), as OpenCV has it.
    let k = header().sequences[0].cameras[0].intrinsics;
    let info = &numbers(&text(made.out.join("00000/camera_info.txt")))[0];
    assert_eq!(*info, [k.fx, k.fy, 15.0, 10.5]);
    let calib = text(made.out.join("00000/calib.txt"));
    let row: Vec<&str> = calib.lines().next().expect("P0").split(' ').collect();
    assert_eq!([row[0], row[3], row[7]], ["P0:", "15", "10.5"]);
    for i in 0..3 {
        let read = made.dataset.read_frame(i).expect("a frame");
        let (seen, scan) = (&read.cameras[0], &read.lidars[0]);
        let (_, _, rgb) = png(made.out.join(&pictures[i].0));
        assert_eq!(rgb, seen.rgb.pixels().as_flattened());
        let (_, _, classes) = png(made.out.join(&pictures[i].1));
        let expected: Vec<u8> = seen
            .semantic
            .pixels()
            .iter()
            .map(|&c| IDS[usize::from(c)])
            .collect();
        assert_eq!(classes, expected);
        let points = std::fs::read(made.out.join(&scans[i].0)).expect("points");
        let points: Vec<f32> = points
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect();
        assert_eq!(points, scan.points.as_flattened());
        let words = std::fs::read(made.out.join(&scans[i].1)).expect("labels");
        let words: Vec<u32> = words
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| u32::from_le_bytes(*b))
            .collect();
        let id = |class: u16| match class {
            0 => 0,
            class => u32::from(IDS[usize::from(class)]),
        };
        let expected: Vec<u32> = (scan.labels.iter())
            .map(|&(class, instance)| id(class) | u32::from(instance) << 16)
            .collect();
        assert_eq!(words, expected);
    }
}
