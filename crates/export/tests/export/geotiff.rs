//! Maps of heights and ids, read by the `tiff` crate and by this file's own reading of GeoKeys.

use std::io::Cursor;

use nemoral_export::{Error, RasterMap, RasterValues, to_geotiff, write_geotiff};
use nemoral_scene::glam::DVec2;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

fn map(values: RasterValues, epsg: Option<u16>) -> RasterMap {
    RasterMap {
        north_west_m: DVec2::new(553_220.25, 4_450_330.5),
        cell_m: 0.5,
        columns: 3,
        rows: 2,
        values,
        epsg,
    }
}

fn decoder(bytes: Vec<u8>) -> Decoder<Cursor<Vec<u8>>> {
    Decoder::new(Cursor::new(bytes)).expect("TIFF")
}

#[test]
fn heights_and_ids_come_back_where_they_lie() {
    let heights = vec![1.25, -3.5, 1e-3, 2.0, 4000.125, 0.0];
    let bytes = to_geotiff(&map(RasterValues::Real(heights.clone()), Some(25_829)));
    let mut file = decoder(bytes.expect("a map"));
    assert_eq!(file.dimensions().expect("sides"), (3, 2));
    let mut numbers = |tag| file.get_tag_f64_vec(tag).expect("a tag");
    assert_eq!(numbers(Tag::ModelPixelScaleTag), [0.5, 0.5, 0.0]);
    let tie = [0.0, 0.0, 0.0, 553_220.25, 4_450_330.5, 0.0];
    assert_eq!(numbers(Tag::ModelTiepointTag), tie);
    // Projected, pixels are areas, the code.
    let keys = file.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).expect("keys");
    assert_eq!(
        keys,
        [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 25_829]
    );
    match file.read_image().expect("pixels") {
        DecodingResult::F32(read) => assert_eq!(read, heights),
        other => panic!("{other:?}"),
    }
    let ids = vec![0, 1, 16_777_215, 4_294_967_295, 5, 6];
    let mut file = decoder(to_geotiff(&map(RasterValues::Id(ids.clone()), None)).expect("a map"));
    let keys = file.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).expect("keys");
    assert_eq!(keys, [1, 1, 0, 1, 1025, 0, 1, 1]);
    match file.read_image().expect("pixels") {
        DecodingResult::U32(read) => assert_eq!(read, ids),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_no_map_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let sound = map(RasterValues::Id(vec![0; 6]), None);
    let path = dir.path().join("map.tif");
    let bytes = write_geotiff(&sound, &path).expect("written");
    assert_eq!(std::fs::metadata(&path).expect("a file").len(), bytes);
    let refused = write_geotiff(&sound, &dir.path().join("map.png"));
    assert!(matches!(refused, Err(Error::Name { .. })));
    for (change, told) in [
        (&|m: &mut RasterMap| m.columns = 4, "4 x 2 cells, 6 values"),
        (&|m: &mut RasterMap| m.rows = 0, "3 x 0 cells"),
        (&|m: &mut RasterMap| m.cell_m = f64::NAN, "cell_m"),
        (
            &|m: &mut RasterMap| m.north_west_m.x = f64::INFINITY,
            "a finite place",
        ),
    ] as [(&dyn Fn(&mut RasterMap), &str); 4]
    {
        let mut wrong = sound.clone();
        change(&mut wrong);
        let refused = to_geotiff(&wrong).expect_err(told);
        assert!(refused.to_string().contains(told), "{refused}");
    }
}
