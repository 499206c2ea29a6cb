use nemoral_export::{Error, HeightGrid, check_height_map, write_height_map};
use nemoral_scene::glam::DVec2;

fn hill() -> HeightGrid {
    let (columns, rows) = (5, 4);
    let height = |i: usize| 0.75 * (i % columns) as f64 + 3.0 * (i / columns) as f64 - 2.0;
    HeightGrid {
        south_west_m: DVec2::new(-10.5, 100.0),
        spacing_m: 0.25,
        columns,
        rows,
        heights_m: (0..columns * rows).map(height).collect(),
    }
}

/// A number of the file beside a map.
fn number(text: &str, key: &str) -> f64 {
    let start = format!("{key} = ");
    let line = text.lines().find_map(|line| line.strip_prefix(&start));
    line.expect(key).parse().expect("a number")
}

#[test]
fn heights_are_read_back_to_half_a_level() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, grid) = (folder.path().join("hill.png"), hill());
    let size = write_height_map(&grid, &path).expect("written");
    let text = std::fs::read_to_string(folder.path().join("hill.toml")).expect("a text");
    let file = std::fs::read(&path).expect("a map");
    assert_eq!(size, (text.len() + file.len()) as u64);
    let reader = png::Decoder::new(std::io::Cursor::new(file)).read_info();
    let mut reader = reader.expect("a PNG");
    let mut samples = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut samples).expect("samples");
    assert_eq!((info.width, info.height), (5, 4));
    assert_eq!(info.bit_depth, png::BitDepth::Sixteen);
    let level = number(&text, "metres_per_level");
    assert!((level - 12.0 / 65_535.0).abs() < 1e-12);
    assert_eq!(number(&text, "west_m"), -10.5);
    assert_eq!(number(&text, "north_m"), 100.75);
    assert_eq!(
        (number(&text, "columns"), number(&text, "rows")),
        (5.0, 4.0)
    );
    for (i, sample) in samples.chunks_exact(2).enumerate() {
        let (column, row) = (i % 5, 3 - i / 5);
        let read = f64::from(u16::from_be_bytes([sample[0], sample[1]]));
        let height = number(&text, "lowest_m") + level * read;
        assert!((height - grid.heights_m[row * 5 + column]).abs() <= level / 2.0 + 1e-12);
    }
}

#[test]
fn flat_ground_is_one_level() {
    let folder = tempfile::tempdir().expect("a folder");
    let flat = HeightGrid {
        heights_m: vec![7.0; 20],
        ..hill()
    };
    assert!(flat.height_scale().metres_per_level > 0.0);
    write_height_map(&flat, &folder.path().join("flat.png")).expect("written");
}

#[test]
fn wrong_grids_and_names_are_refused_and_leave_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |grid: &HeightGrid, name: &str| {
        let error = write_height_map(grid, &folder.path().join(name)).expect_err("refused");
        assert!(
            std::fs::read_dir(folder.path())
                .expect("a folder")
                .next()
                .is_none()
        );
        error
    };
    let mut short = hill();
    short.heights_m.pop();
    assert!(matches!(refused(&short, "a.png"), Error::Param(_)));
    let mut lost = hill();
    lost.heights_m[3] = f64::NAN;
    assert!(matches!(refused(&lost, "a.png"), Error::Param(_)));
    let still = HeightGrid {
        spacing_m: 0.0,
        ..hill()
    };
    assert!(
        refused(&still, "a.png")
            .to_string()
            .starts_with("spacing_m = 0")
    );
    assert!(matches!(refused(&hill(), "a.tif"), Error::Name { .. }));
    assert!(!refused(&hill(), "none/a.png").is_request());
    let huge = HeightGrid {
        columns: usize::MAX,
        rows: 2,
        ..hill()
    };
    assert!(matches!(refused(&huge, "a.png"), Error::Param(_)));
}

#[test]
fn only_the_text_of_an_older_map_is_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let (map, text) = (folder.path().join("a.png"), folder.path().join("a.toml"));
    std::fs::write(&text, "preset = \"beech\"").expect("written");
    let error = write_height_map(&hill(), &map).expect_err("refused");
    assert!(matches!(&error, Error::NotOfMap { path } if *path == text));
    assert!(error.is_request() && !map.exists());
    let kept = std::fs::read_to_string(&text).expect("a text");
    assert_eq!(kept, "preset = \"beech\"");
    // A picture beside the text does not make it a map's.
    std::fs::write(&map, "a picture").expect("written");
    let error = write_height_map(&hill(), &map).expect_err("refused");
    assert!(matches!(&error, Error::NotOfMap { path } if *path == text));
    let kept = std::fs::read_to_string(&text).expect("a text");
    assert_eq!(kept, "preset = \"beech\"");
    assert_eq!(std::fs::read(&map).expect("a picture"), b"a picture");
    std::fs::remove_file(&map).expect("removed");
    std::fs::remove_file(&text).expect("removed");
    for _ in 0..2 {
        write_height_map(&hill(), &map).expect("written");
    }
    assert!(check_height_map(&map, &[&folder.path().join("b.toml")]).is_ok());
    let error = check_height_map(&map, &[&text]).expect_err("refused");
    assert!(matches!(error, Error::NotOfMap { .. }));
    let error = check_height_map(&map, &[&map]).expect_err("refused");
    assert!(matches!(error, Error::Input { path } if path == map));
}
