//! Height maps: what is written is read back, and what is wrong is named.

use nemoral_import::{HeightMap, HeightPngSidecar};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

const COLUMNS: usize = 7;
const ROWS: usize = 5;

fn height(i: usize) -> f32 {
    100.0 + 0.25 * (i % COLUMNS) as f32 - 1.5 * (i / COLUMNS) as f32
}

/// What a GeoTIFF says besides its heights.
struct Tags {
    scale: Vec<f64>,
    tie: Vec<f64>,
    keys: Vec<u16>,
    no_data: Option<&'static str>,
    /// What GDAL says about its band.
    metadata: Option<&'static str>,
    /// 1 if 0 is black.
    photometric: u16,
}

impl Default for Tags {
    fn default() -> Self {
        Self {
            scale: vec![0.5, 0.5, 0.0],
            tie: vec![0.0, 0.0, 0.0, 553_000.0, 4_450_000.0, 0.0],
            keys: vec![1, 1, 0, 2, 1024, 0, 1, 1, 1025, 0, 1, 1],
            no_data: Some("-9999"),
            metadata: None,
            photometric: 1,
        }
    }
}

fn tiff(tags: &Tags) -> Vec<u8> {
    let mut heights: Vec<f32> = (0..COLUMNS * ROWS).map(height).collect();
    heights[3] = -9999.0;
    heights[4] = f32::NAN;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).expect("memory takes it");
    let (w, h) = (COLUMNS as u32, ROWS as u32);
    let mut image = encoder
        .new_image::<colortype::Gray32Float>(w, h)
        .expect("an image");
    let more = image.encoder();
    more.write_tag(Tag::ModelPixelScaleTag, &tags.scale[..])
        .expect("a tag");
    more.write_tag(Tag::ModelTiepointTag, &tags.tie[..])
        .expect("a tag");
    more.write_tag(Tag::GeoKeyDirectoryTag, &tags.keys[..])
        .expect("a tag");
    more.write_tag(Tag::PhotometricInterpretation, tags.photometric)
        .expect("a tag");
    for (tag, text) in [
        (Tag::GdalNodata, tags.no_data),
        (Tag::Unknown(42_112), tags.metadata),
    ] {
        if let Some(text) = text {
            more.write_tag(tag, text).expect("a tag");
        }
    }
    image.write_data(&heights).expect("an image");
    bytes.into_inner()
}

fn refused(tags: &Tags) -> String {
    HeightMap::from_tiff(&tiff(tags))
        .expect_err("it is refused")
        .to_string()
}

#[test]
fn a_geotiff_is_read_where_it_lies() {
    let map = HeightMap::from_tiff(&tiff(&Tags::default())).expect("a height map");
    assert_eq!((map.columns, map.rows, map.spacing_m), (COLUMNS, ROWS, 0.5));
    // Pixels are areas, and posts are their middles.
    assert_eq!(map.post_m(0, 0), [553_000.25, 4_449_999.75]);
    assert_eq!(map.post_m(6, 4), [553_003.25, 4_449_997.75]);
    for i in (0..COLUMNS * ROWS).filter(|i| ![3, 4].contains(i)) {
        assert_eq!(
            map.height_m(i % COLUMNS, i / COLUMNS),
            Some(height(i)),
            "{i}"
        );
    }
    assert_eq!((map.height_m(3, 0), map.height_m(4, 0)), (None, None));
    let of_points = Tags {
        keys: vec![1, 1, 0, 1, 1025, 0, 1, 2],
        tie: vec![1.0, 2.0, 0.0, 553_000.0, 4_450_000.0, 0.0],
        ..Tags::default()
    };
    let map = HeightMap::from_tiff(&tiff(&of_points)).expect("a height map");
    assert_eq!(map.post_m(1, 2), [553_000.0, 4_450_000.0]);
}

#[test]
fn a_geotiff_says_which_coordinates_it_has() {
    let epsg = |key: &[u16]| {
        let keys = [&[1, 1, 0, 2, 1024, 0, 1, 1][..], key].concat();
        let tags = Tags {
            keys,
            ..Tags::default()
        };
        HeightMap::from_tiff(&tiff(&tags))
            .expect("a height map")
            .epsg
    };
    assert_eq!(epsg(&[3072, 0, 1, 25_829]), Some(25_829));
    // Another key; one that is elsewhere; a system of the user's own; none.
    assert_eq!(epsg(&[3073, 0, 1, 25_829]), None);
    assert_eq!(epsg(&[3072, 34_736, 1, 25_829]), None);
    assert_eq!(epsg(&[3072, 0, 1, 32_767]), None);
    assert_eq!(epsg(&[3072, 0, 1, 0]), None);
}

#[test]
fn scale_and_offset_of_the_band_are_applied() {
    let scaled = Tags {
        metadata: Some(
            "<GDALMetadata>\n  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\">70</Item>\n  \
             <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.25</Item>\n</GDALMetadata>\n",
        ),
        ..Tags::default()
    };
    let map = HeightMap::from_tiff(&tiff(&scaled)).expect("a height map");
    for i in (0..COLUMNS * ROWS).filter(|i| ![3, 4].contains(i)) {
        let found = map.height_m(i % COLUMNS, i / COLUMNS);
        assert_eq!(found, Some(70.0 + 0.25 * height(i)), "{i}");
    }
    // What no data is counts before both.
    assert_eq!((map.height_m(3, 0), map.height_m(4, 0)), (None, None));
}

#[test]
fn a_value_for_no_data_is_no_height_of_any_land() {
    let of = |no_data| {
        let tags = Tags {
            no_data,
            ..Tags::default()
        };
        HeightMap::from_tiff(&tiff(&tags))
    };
    assert_eq!(of(Some("-9999")).expect("a map").height_m(3, 0), None);
    for no_data in [None, Some("-32768")] {
        let error = of(no_data).expect_err("9,999 m below the sea").to_string();
        assert!(error.contains("has a height of -9999"), "{error}");
    }
}

#[test]
fn heights_in_feet_are_refused() {
    // UTM in metres, with a key of the heights.
    let with = |key: [u16; 4]| {
        let keys = [&[1, 1, 0, 3, 1024, 0, 1, 1, 3076, 0, 1, 9001][..], &key[..]].concat();
        let tags = Tags {
            keys,
            ..Tags::default()
        };
        HeightMap::from_tiff(&tiff(&tags)).map_err(|e| e.to_string())
    };
    for (key, value) in [
        (4099, 9002),
        (4099, 9003),
        (4096, 5702),
        (4096, 6360),
        (4096, 8228),
    ] {
        let error = with([key, 0, 1, value]).expect_err("feet");
        let says = format!("not in metres (its GeoKey {key} is {value})");
        assert!(error.contains(&says), "{error}");
    }
    // Metres; NAVD88, DHHN2016 and a system of the user's own; none.
    for (key, value) in [
        (4099, 9001),
        (4096, 5703),
        (4096, 7837),
        (4096, 32_767),
        (4096, 0),
    ] {
        assert!(with([key, 0, 1, value]).is_ok(), "{key} {value}");
    }
}

#[test]
fn what_a_geotiff_lacks_is_named() {
    let of = |change: &dyn Fn(&mut Tags)| {
        let mut tags = Tags::default();
        change(&mut tags);
        refused(&tags)
    };
    assert!(of(&|t| t.scale.truncate(1)).contains("no tag ModelPixelScale"));
    assert!(of(&|t| t.tie.truncate(5)).contains("no tag ModelTiepoint"));
    assert!(of(&|t| t.scale[1] = 0.6).contains("must be squares"));
    assert!(of(&|t| t.scale.fill(1e-5)).contains("degrees are not allowed"));
    for height_m in [0.6, -0.5, f64::NAN] {
        assert!(of(&|t| t.scale[1] = height_m).contains("must be squares"));
    }
    assert!(of(&|t| t.keys[7] = 2).contains("is in degrees"));
    assert!(of(&|t| t.keys[8..].copy_from_slice(&[3076, 0, 1, 9002])).contains("not in metres"));
    assert!(of(&|t| t.no_data = Some("none")).contains("GDAL_NODATA = none"));
    assert!(of(&|t| t.tie[3] = 1e9).contains("west edge"));
    // A decoder for pictures would make 1 - 120 of a height of 120.
    assert!(of(&|t| t.photometric = 0).contains("0 is white"));
    let in_feet = "<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item>";
    assert!(of(&|t| t.metadata = Some(in_feet)).contains("heights in ft"));
    let wrong = "<Item name=\"SCALE\" sample=\"0\" role=\"scale\">0,01</Item>";
    assert!(of(&|t| t.metadata = Some(wrong)).contains("has 0,01 as the scale"));
    assert!(HeightMap::from_tiff(b"").is_err());
    // What says that it is in degrees lies beyond the end of the file.
    let mut bytes = tiff(&Tags {
        keys: vec![1, 1, 0, 2, 1024, 0, 1, 2, 1025, 0, 1, 1],
        ..Tags::default()
    });
    let entry = [0xaf, 0x87, 3, 0, 12, 0, 0, 0];
    let at = bytes.windows(8).position(|w| w == entry).expect("the tag") + 8;
    bytes[at..at + 4].copy_from_slice(&0x0fff_ffff_u32.to_le_bytes());
    let error = HeightMap::from_tiff(&bytes).expect_err("it is cut off");
    assert!(error.to_string().contains("no GeoTIFF"), "{error}");
}

/// A 16-bit grey PNG of these codes.
fn png(codes: &[u16]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, COLUMNS as u32, ROWS as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header().expect("a header");
    let data: Vec<u8> = codes.iter().flat_map(|c| c.to_be_bytes()).collect();
    writer.write_image_data(&data).expect("an image");
    writer.finish().expect("the end");
    bytes
}

const SIDECAR: &str = r#"{ "origin_m": [20.0, -30.0], "metres_per_pixel": 2.0,
    "min_height_m": -10.0, "max_height_m": 55.535, "no_data": 7, "made_by": "a test" }"#;

#[test]
fn a_png_is_read_where_its_sidecar_says() {
    let codes: Vec<u16> = (0..35).map(|i| i * 1000 + 7 * u16::from(i == 0)).collect();
    let sidecar = HeightPngSidecar::read(SIDECAR.as_bytes()).expect("a sidecar");
    let map = HeightMap::from_png(&png(&codes), &sidecar).expect("a height map");
    // A file's kind is that of its bytes.
    let read = |sidecar| HeightMap::read(&png(&codes), sidecar);
    let error = read(None).expect_err("it has no sidecar").to_string();
    assert!(error.contains("needs a sidecar"), "{error}");
    assert_eq!(
        read(Some(&sidecar)).map(|m| m.post_m(0, 0)),
        Ok(map.post_m(0, 0))
    );
    assert!(HeightMap::read(&tiff(&Tags::default()), None).is_ok());
    // The origin is the corner of the south-west pixel, which is in the last row.
    assert_eq!(map.post_m(0, ROWS - 1), [21.0, -29.0]);
    assert_eq!(map.post_m(COLUMNS - 1, 0), [33.0, -21.0]);
    assert_eq!(map.height_m(0, 0), None);
    for i in 1..35 {
        let found = map.height_m(i % COLUMNS, i / COLUMNS).expect("a height");
        assert!(
            (f64::from(found) - (i as f64 - 10.0)).abs() < 1e-4,
            "{i}: {found}"
        );
    }
}

#[test]
fn the_sidecars_of_exports_are_read() {
    let toml = "# A comment.\ncolumns = 7\nrows = 5\nspacing_m = 2.0\nwest_m = 21.0\n\
                north_m = -21.0\nlowest_m = -10.0\nmetres_per_level = 0.001\n";
    let sidecar = HeightPngSidecar::read(toml.as_bytes()).expect("a sidecar");
    let codes: Vec<u16> = (0..35).map(|i| i * 1000).collect();
    let map = HeightMap::from_png(&png(&codes), &sidecar).expect("a height map");
    assert_eq!(map.post_m(0, 0), [21.0, -21.0]);
    assert_eq!(map.post_m(0, ROWS - 1), [21.0, -29.0]);
    assert_eq!(map.height_m(6, 4), Some(24.0));
}

#[test]
fn a_sidecar_of_values_deep_in_each_other_ends_no_program() {
    // 6,000 tables in each other in 12 kB, which the parser lets pass.
    let key = ["a"; 79].join(".");
    let value = (0..75).fold("1".to_owned(), |inner, _| format!("{{{key}={inner}}}"));
    let text = format!("[{key}]\n{key}={value}\n");
    let refused = HeightPngSidecar::read(text.as_bytes())
        .expect_err("refused")
        .to_string();
    assert!(
        refused.contains("is no sidecar: missing field"),
        "{refused}"
    );
}

#[test]
fn what_is_wrong_with_a_png_is_named() {
    let no = |json: &str| {
        HeightPngSidecar::read(json.as_bytes())
            .expect_err(json)
            .to_string()
    };
    assert!(no("{}").contains("origin_m"));
    assert!(no(&SIDECAR.replace("-10.0", "60")).contains("in order"));
    assert!(no(&SIDECAR.replace("[20.0, -30.0]", "[20.0]")).contains("is no sidecar"));
    let with = |json: &str, bytes: &[u8]| {
        let sidecar = HeightPngSidecar::read(json.as_bytes()).expect("a sidecar");
        HeightMap::from_png(bytes, &sidecar)
            .expect_err("it is refused")
            .to_string()
    };
    let good = png(&[1000; 35]);
    assert!(with(&SIDECAR.replace("2.0", "1e-9"), &good).contains("apart"));
    assert!(with(&SIDECAR.replace("55.535", "1e9"), &good).contains("height of"));
    assert!(with(SIDECAR, &png(&[7; 35])).contains("no data at any post"));
    assert!(with(SIDECAR, &good[..good.len() / 2]).contains("is no PNG"));
}
