//! GOOSE's layout, read by its names.

use std::collections::{BTreeMap, BTreeSet};

use nemoral_convert::{ClassMapping, ConvertParams, FormatName, convert};
use nemoral_scene::{Ontology, Semantic};

use crate::common::{header, made, made_of, png, text, tree, write};

/// Background, Terrain, Traversable, Trunks, Canopy, Shrubs, Herbaceous, Rocks in GOOSE.
const IDS: [u8; 8] = [53, 31, 24, 28, 27, 17, 50, 40];

#[test]
fn names_lead_to_pictures_and_scans_with_their_classes() {
    let made = made(FormatName::Goose);
    let csv = text(made.out.join("goose_label_mapping.csv"));
    let colours: BTreeMap<u8, String> = csv
        .lines()
        .skip(1)
        .map(|l| {
            let words: Vec<&str> = l.split(',').collect();
            (words[1].parse().expect("an id"), words[3].to_owned())
        })
        .collect();
    assert!(csv.contains("tree_trunk,28,1,#ffaa92\n"), "{csv}");
    for (i, stem) in ["0001_0000000000750000000", "0002_0000000001250000000"]
        .iter()
        .enumerate()
    {
        let stem = format!("train/nemoral_00/nemoral_00__{stem}");
        let read = made.dataset.read_frame(i).expect("a frame");
        let (seen, scan) = (&read.cameras[0], &read.lidars[0]);
        let map =
            |kind: &str, what: &str| png(made.out.join(format!("{kind}/{stem}_{what}.png"))).2;
        assert_eq!(
            map("images", "windshield_vis"),
            seen.rgb.pixels().as_flattened()
        );
        let ids = map("labels", "labelids");
        let expected: Vec<u8> = seen
            .semantic
            .pixels()
            .iter()
            .map(|&c| IDS[usize::from(c)])
            .collect();
        assert_eq!(ids, expected);
        for (id, colour) in ids.iter().zip(map("labels", "color").chunks(3)) {
            let hex = format!("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2]);
            assert_eq!(hex, colours[id]);
        }
        // Numbers and objects are in pairs.
        let numbers = map("labels", "instanceids");
        let numbers = numbers
            .as_chunks::<2>()
            .0
            .iter()
            .map(|b| u16::from_be_bytes(*b));
        let pairs: BTreeSet<_> = numbers.zip(seen.instance.pixels()).collect();
        let objects: BTreeSet<_> = seen.instance.pixels().iter().collect();
        assert_eq!(pairs.len(), objects.len());
        assert!(pairs.iter().all(|(n, id)| (*n == 0) == (**id == 0)));
        let points = std::fs::read(made.out.join(format!("velodyne/{stem}_vls128.bin")));
        let points = points.expect("points");
        let points: Vec<f32> = points
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect();
        assert_eq!(points, scan.points.as_flattened());
        let words = std::fs::read(made.out.join(format!("labels/{stem}_goose.label")));
        let words = words.expect("labels");
        for (word, &(class, instance)) in words.as_chunks::<4>().0.iter().zip(&scan.labels) {
            let word = u32::from_le_bytes(*word);
            let id = if class == 0 {
                0
            } else {
                IDS[usize::from(class)]
            };
            assert_eq!((word & 0xFFFF, word >> 16), (id.into(), instance.into()));
        }
    }
}

#[test]
fn names_of_classes_stay_in_their_column() {
    let folder = tempfile::tempdir().expect("a folder");
    let [source, out] = ["dataset", "out"].map(|name| folder.path().join(name));
    write(&source, &header(), &[1]);
    let table = "name = \"x\"\nsource = \"s\"\nrest = \"void\"\n\
                 [[class]]\nid = 0\nname = \"void\"\ncolour = [0, 0, 0]\nfrom = []\n\
                 [[class]]\nid = 4\nname = 'tree, \"old\"'\ncolour = [0, 255, 0]\n\
                 from = [\"Trunks\"]\n";
    let params = ConvertParams {
        ontology: Some(ClassMapping::parse("x", table).expect("valid")),
        ..ConvertParams::new(FormatName::Goose)
    };
    convert(&source, &out, &params).expect("converted");
    let csv = text(out.join("goose_label_mapping.csv"));
    let rows = "void,0,0,#000000\n\"tree, \"\"old\"\"\",4,0,#00ff00\n";
    assert!(csv.ends_with(rows), "{csv}");
}

#[test]
fn classes_that_are_semantics_are_finer() {
    let mut header = header();
    header.ontology = Ontology::semantics();
    let made = made_of(FormatName::Goose, &header);
    let of = |semantic: u16| match Semantic::from_u8(semantic as u8) {
        Some(Semantic::Litter) => 5,
        Some(Semantic::TrailSurface) => 24,
        Some(Semantic::Leaf) => 27,
        Some(Semantic::Stem) => 28,
        Some(Semantic::Rock) => 40,
        Some(Semantic::Grass) => 50,
        Some(Semantic::Shrub) => 17,
        Some(Semantic::Sky) => 53,
        other => panic!("{other:?} is not seen here"),
    };
    let files = tree(&made.out);
    let ending = |end: &str| {
        let found = files
            .iter()
            .find(|(path, _)| path.to_string_lossy().ends_with(end));
        found.unwrap_or_else(|| panic!("no {end}"))
    };
    let read = made.dataset.read_frame(0).expect("a frame");
    let (_, _, classes) = png(made.out.join(ending("_labelids.png").0));
    let seen = read.cameras[0].semantic.pixels();
    assert_eq!(
        classes,
        seen.iter().map(|&c| of(c.into()) as u8).collect::<Vec<_>>()
    );
    let words = ending("_goose.label").1.as_chunks::<4>().0;
    for (word, &(class, _)) in words.iter().zip(&read.lidars[0].labels) {
        // What a scan calls sky is a false alarm.
        let expected = if class == 0 { 0 } else { of(class) };
        assert_eq!(u32::from_le_bytes(*word) & 0xFFFF, expected);
    }
}
