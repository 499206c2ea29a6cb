//! Files from a stranger: whatever their bytes are, there is a result, and memory is bounded.

mod common;

use nemoral_import::{
    HeightMap, HeightPngSidecar, ImportError, Model, ModelFiles, ModelKind, read_stem_map,
    read_trail_lines,
};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

#[global_allocator]
static ALLOCATOR: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// How many mutants of each kind of file are read.
const MUTANTS: u64 = 1000;

/// The most memory that a file may ask for: the largest height map, as it is unpacked and as f32.
const MOST_MB: f64 = 512.0;

/// A xorshift generator.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

/// A file with some bytes changed, repeated, lost or cut off.
fn mutant(seed: &[u8], dice: &mut Dice) -> Vec<u8> {
    const TOKENS: [&[u8]; 8] = [
        b"-1",
        b"1e308",
        b"nan",
        b"\"",
        b",,",
        b"\r\n",
        b"\xff\xff\xff\x7f",
        b"99999999999",
    ];
    let mut bytes = seed.to_vec();
    for _ in 0..=dice.below(6) {
        let at = dice.below(bytes.len());
        match dice.below(6) {
            0 | 1 if !bytes.is_empty() => bytes[at] = dice.below(256) as u8,
            2 if !bytes.is_empty() => bytes[at] ^= 1 << dice.below(8),
            3 => {
                let token = TOKENS[dice.below(TOKENS.len())];
                bytes.splice(at..at, token.iter().copied());
            }
            4 => {
                let end = (at + 1 + dice.below(20)).min(bytes.len());
                bytes.drain(at..end);
            }
            _ if dice.below(8) == 0 => bytes.truncate(at),
            _ => {
                let end = (at + dice.below(40)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
        }
    }
    bytes
}

/// Reads mutants of a file; how many are accepted.
fn survive(seed: &[u8], read: impl Fn(&[u8]) -> bool) -> usize {
    assert!(read(seed), "the seed is read");
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    ALLOCATOR.reset_peak_usage();
    let accepted = (0..MUTANTS)
        .filter(|_| read(&mutant(seed, &mut dice)))
        .count();
    let peak = f64::from(ALLOCATOR.peak_usage_as_mb());
    assert!(peak < MOST_MB, "{peak} MB");
    accepted
}

#[test]
fn a_thousand_mutants_of_each_kind_of_file_are_read_or_refused() {
    let stems = "tree,x_m,y_m,species,dbh_cm,height_m,alive\n1,3.5,-2,beech,31.5,24,true\n\
                 2,6,1.25,\"oak, red\",,,0\n# a note\n3,7.1,2,spruce,12,9.5,yes\n";
    let accepted = survive(stems.as_bytes(), |bytes| read_stem_map(bytes).is_ok());
    assert!((20..950).contains(&accepted), "{accepted}");

    let geojson = r#"{"type":"FeatureCollection","crs":{"type":"name","properties":{"name":
        "urn:ogc:def:crs:EPSG::25829"}},"features":[{"type":"Feature","geometry":
        {"type":"LineString","coordinates":[[0,100],[20.5,3],[400,-2]]}},{"type":"Feature",
        "geometry":{"type":"MultiLineString","coordinates":[[[1,2],[300,4,5]],[[5,6],[7,8]]]}}]}"#;
    let accepted = survive(geojson.as_bytes(), |bytes| read_trail_lines(bytes).is_ok());
    assert!(accepted > 5, "{accepted}");
    let table = "trail;x_m;y_m\na;1,5;2\na;30;4\nb;5;6\nb;70;8\n";
    let accepted = survive(table.as_bytes(), |bytes| read_trail_lines(bytes).is_ok());
    assert!(accepted > 5, "{accepted}");
    // Deep nesting does not overflow the stack.
    let deep = r#"{"type":"Feature","geometry":"#.repeat(100_000);
    assert!(read_trail_lines(deep.as_bytes()).is_err());

    let mut tif = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut tif).expect("memory takes it");
    let mut image = encoder
        .new_image::<colortype::Gray32Float>(9, 6)
        .expect("an image");
    let more = image.encoder();
    let tie = [0.0, 0.0, 0.0, 500_000.0, 4e6, 0.0];
    more.write_tag(Tag::ModelPixelScaleTag, &[1.0, 1.0, 0.0][..])
        .expect("a tag");
    more.write_tag(Tag::ModelTiepointTag, &tie[..])
        .expect("a tag");
    more.write_tag(Tag::GdalNodata, "-9999").expect("a tag");
    let heights: Vec<f32> = (0..54).map(|i| i as f32).collect();
    image.write_data(&heights).expect("an image");
    let tif = tif.into_inner();
    let accepted = survive(&tif, |bytes| HeightMap::from_tiff(bytes).is_ok());
    assert!(accepted > 20, "{accepted}");

    let json = r#"{"origin_m":[0,0],"metres_per_pixel":1,"min_height_m":0,"max_height_m":9}"#;
    let accepted = survive(json.as_bytes(), |bytes| {
        HeightPngSidecar::read(bytes).is_ok()
    });
    assert!(accepted > 5, "{accepted}");

    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 9, 6);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header().expect("a header");
    let codes: Vec<u8> = (0..108).map(|i| i * 2).collect();
    writer.write_image_data(&codes).expect("an image");
    writer.finish().expect("the end");
    let sidecar = HeightPngSidecar::read(json.as_bytes()).expect("a sidecar");
    survive(&bytes, |bytes| HeightMap::from_png(bytes, &sidecar).is_ok());
}

#[test]
fn a_thousand_mutants_of_models_are_read_or_refused() {
    let model = |name: &'static str| {
        move |bytes: &[u8]| {
            let files = common::gathered(name, bytes.to_vec(), "", common::beside_obj);
            files.and_then(|f| Model::read(&f, ModelKind::Tree)).is_ok()
        }
    };
    for (seed, name, least) in [
        (common::tree_glb(), "tree.glb", 20),
        (common::tree_gltf(), "tree.gltf", 5),
        (common::tree_obj(), "tree.obj", 20),
    ] {
        let accepted = survive(&seed, model(name));
        assert!((least..950).contains(&accepted), "{name}: {accepted}");
    }
    // With its materials and its picture.
    let files = common::gathered("tree.obj", common::tree_obj(), "", common::beside_obj);
    let archive = files.expect("files").to_tar().expect("short names");
    let accepted = survive(&archive, |bytes| {
        let files = ModelFiles::gather("tree.tar", bytes.to_vec(), &mut |_, _| Ok(None));
        files
            .and_then(|f| Model::read(&f, ModelKind::Shrub))
            .is_ok()
    });
    assert!((20..950).contains(&accepted), "{accepted}");
}

#[test]
fn lists_without_end_are_refused_while_they_are_read() {
    ALLOCATOR.reset_peak_usage();
    for (list, of) in [("nodes", "{}"), ("accessors", "{}"), ("materials", "{}")] {
        let many = vec![of; 1_000_000].join(",");
        let file = format!(r#"{{"asset":{{"version":"2.0"}},"{list}":[{many}]}}"#);
        let files = ModelFiles::single("x.gltf", file.into_bytes());
        let refused = Model::read(&files, ModelKind::Rock).expect_err("too many");
        assert!(refused.to_string().starts_with("is no glTF"), "{refused}");
    }
    let objects = (0..150_000).map(|i| format!("o {i}\nf 1 1 1\n"));
    let face = format!("v 0 0 0\nf{}", " 1".repeat(3_000_000));
    for (obj, expected) in [
        (
            format!("v 0 0 0\n{}", objects.collect::<String>()),
            "more than 100000 parts",
        ),
        (face, "line 2: more than 2000000 triangles"),
        ("vn 0 0 1\n".repeat(6_000_001), "more than 6000000"),
    ] {
        let files = ModelFiles::single("x.obj", obj.into_bytes());
        let refused = Model::read(&files, ModelKind::Rock).expect_err("too many");
        assert!(refused.to_string().contains(expected), "{refused}");
    }
    let peak = f64::from(ALLOCATOR.peak_usage_as_mb());
    assert!(peak < MOST_MB, "{peak} MB");
}

/// A shape with these lines before its faces, and these materials.
fn shape(lines: &str, mtl: &str) -> Result<Model, ImportError> {
    let obj = format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 1\nvn 0 0 1\nvt 0 0\n{lines}");
    let files = common::gathered("x.obj", obj.into_bytes(), "", |name| {
        (name == "a.mtl").then(|| mtl.as_bytes().to_vec())
    })?;
    Model::read(&files, ModelKind::Rock)
}

#[test]
fn lines_that_other_readers_break_on_are_read_or_named() {
    for mtl in ["newmtl a\nKd 0.5", "newmtl a\nKs", "newmtl a\nKe 0 0", ""] {
        let model = shape("usemtl a\nf 1 2 3", mtl).expect(mtl);
        assert_eq!(model.mesh.triangles.len(), 1, "{mtl}");
    }
    for (lines, expected) in [
        (
            "f 1//6148914691236517206 2//1 3//1",
            "line 7: 6148914691236517206 of 1 normals",
        ),
        (
            "f 1/-9 2/1 3/1",
            "line 7: -9 of 1 texture coordinates is none",
        ),
        (
            "f 1/-9223372036854775808 2/1 3/1",
            "of 1 texture coordinates is none",
        ),
        ("f 0 1 2", "line 7: 0 of 3 positions is none"),
        ("f 1 2", "less than three corners"),
        ("f 1/1 2 3", "corners of different kinds"),
        ("l 1 2 3\np 1", "has no faces"),
        ("\x0bo a\n\x0bf 1 2 x", "line 8: x is no corner"),
        ("v 1 2", "line 7: 1 2: must be 3 numbers"),
    ] {
        let refused = shape(lines, "").expect_err(lines).to_string();
        assert!(refused.contains(expected), "{lines}: {refused}");
    }
    // A material that is in no file keeps its name; parts with and without normals are both read.
    let model = shape("usemtl moss\nf 1 2 3\nf 1//1 2//1 3//1", "").expect("a shape");
    assert_eq!(model.materials[0].name, "moss");
    assert_eq!(model.mesh.triangles.len(), 2);
    assert!(model.notes.iter().any(|note| note.contains("moss")));
}

#[test]
fn parts_without_end_are_refused() {
    ALLOCATOR.reset_peak_usage();
    let read = |gltf: String| {
        let files = ModelFiles::single("x.gltf", gltf.into_bytes());
        Model::read(&files, ModelKind::Rock).map(|model| model.mesh.triangles.len())
    };
    let list = |item: &str, n: usize| vec![item; n].join(",");
    let gltf = |nodes: &str, primitives: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"primitives":
            [{primitives}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3",
            "count":1}}],"bufferViews":[{{"buffer":0,"byteLength":12}}],"buffers":[{{
            "byteLength":12,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAA"}}]}}"#
        )
    };
    let primitive = r#"{"attributes":{"POSITION":0}}"#;
    let many = gltf(&list(r#"{"mesh":0}"#, 90_000), &list(primitive, 10_000));
    let refused = read(many).expect_err("too many").to_string();
    assert!(refused.contains("more than 100000 primitives"), "{refused}");
    // Looking for roots is linear.
    let children = format!(r#"{{"children":[{}]}}"#, list("0", 99_000));
    let nodes = format!("{},{}", list(&children, 10), list("{}", 90_000));
    let refused = read(gltf(&nodes, primitive))
        .expect_err("twice")
        .to_string();
    assert!(
        refused.contains("twice") || refused.contains("no triangles"),
        "{refused}"
    );
    let peak = f64::from(ALLOCATOR.peak_usage_as_mb());
    assert!(peak < MOST_MB, "{peak} MB");
}

#[test]
fn lines_that_end_with_a_carriage_return_take_no_longer() {
    let mut table = "x,y\r".to_owned();
    for i in 0..150_000 {
        table += &format!("{}.{},{i}\r", i % 2, i % 7);
    }
    assert_eq!(
        read_trail_lines(table.as_bytes()).map(|t| t.lines.len()),
        Ok(1)
    );
    table += "1,\r";
    let error = read_trail_lines(table.as_bytes()).expect_err("y is missing");
    assert_eq!(error.to_string(), "line 150002: y is missing");
}

#[test]
fn a_header_cannot_ask_for_more_than_the_largest_map() {
    // A PNG of 2^31 - 1 by 2^31 - 1 pixels, without any.
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    bytes.extend([
        0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 16, 0, 0, 0, 0,
    ]);
    // The checksum of that header.
    let mut crc = !0_u32;
    for byte in &bytes[12..] {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
        }
    }
    bytes.extend((!crc).to_be_bytes());
    bytes.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
    let json = r#"{"origin_m":[0,0],"metres_per_pixel":1,"min_height_m":0,"max_height_m":9}"#;
    let sidecar = HeightPngSidecar::read(json.as_bytes()).expect("a sidecar");
    let error = HeightMap::from_png(&bytes, &sidecar)
        .expect_err("too large")
        .to_string();
    assert!(error.contains("posts: must be"), "{error}");
}
