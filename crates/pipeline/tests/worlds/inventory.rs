//! A survey agrees with the trees that were grown, with the ground, and with itself.

use std::path::Path;

use nemoral_import::HeightMap;
use nemoral_pipeline::config::Layers;
use nemoral_pipeline::{Backend, InventoryParams, Recorder, Survey, SurveyParams};
use nemoral_realism::grown;
use nemoral_scene::TreeRecord;
use nemoral_scene::glam::DVec2;

fn recorder(settings: &[&str]) -> Recorder {
    let base = [
        "chunks.visible_radius_m=30",
        "chunks.undergrowth_radius_m=10",
        "chunks.delete_radius_m=40",
        "placement.regeneration.saplings_per_ha=0",
        "terrain.max_height_m=12",
    ];
    let settings = base.iter().chain(settings).map(|s| (*s).to_owned());
    let layers = Layers {
        preset: Some("demo".to_owned()),
        settings: settings.collect(),
        ..Layers::default()
    };
    let sequence = layers.sequences().expect("sound").get(0).expect("one");
    Recorder::new(sequence, Backend::Cpu, grown(), 2).expect("sound")
}

fn coarse() -> SurveyParams {
    SurveyParams {
        cell_m: 1.0,
        rays_a_side: 4,
        layer_m: 1.0,
    }
}

const LOW_M: DVec2 = DVec2::new(-40.0, -30.0);
const HIGH_M: DVec2 = DVec2::new(60.0, 50.0);

#[test]
fn a_survey_finds_the_trees_that_were_grown() {
    let recorder = recorder(&[]);
    let survey = recorder.survey(LOW_M, HIGH_M, &coarse()).expect("a survey");
    let trees = &survey.trees;
    println!("{} trees, cover {:.3}", trees.len(), survey.maps.cover);
    assert!(trees.len() > 100, "{}", trees.len());
    heights_are_the_trees(&survey);
    leaves_are_the_trees(&survey);
    the_ground_is_the_worlds(&recorder, &survey);
    halves_make_the_whole(&recorder, &survey);
    files_say_the_same(&recorder);
}

/// The canopy above a tree is as high as it, unless a higher one hides it, and nothing is higher
/// than what stands around.
fn heights_are_the_trees(survey: &Survey) {
    let grid = &survey.maps.grid;
    let heights: Vec<f64> = survey.maps.heights_m().collect();
    let tallest = |trees: &[TreeRecord]| trees.iter().map(|t| t.height_m).fold(0.0, f64::max);
    let highest_m = heights.iter().copied().fold(0.0, f64::max);
    let tallest_m = tallest(&survey.trees);
    assert!(
        (0.93 * tallest_m..tallest_m + 1.5).contains(&highest_m),
        "{highest_m} {tallest_m}"
    );
    let mut straight = 0;
    for tree in survey.trees.iter().filter(|t| t.alive && t.lean_rad < 0.02) {
        let Some(cell) = grid.cell_at(tree.position_m.truncate()) else {
            panic!("{tree:?} is inside");
        };
        // Within two metres of the foot of a straight tree is its top, or something higher.
        let near = (-2..=2_i64).flat_map(|dy| (-2..=2_i64).map(move |dx| (dx, dy)));
        let top_m = near.filter_map(|(dx, dy)| {
            let (column, row) = (
                (cell % grid.columns) as i64 + dx,
                (cell / grid.columns) as i64 + dy,
            );
            let inside =
                (0..grid.columns as i64).contains(&column) && (0..grid.rows as i64).contains(&row);
            inside.then(|| heights[row as usize * grid.columns + column as usize])
        });
        let top_m = top_m.fold(0.0, f64::max);
        assert!(top_m > 0.85 * tree.height_m - 0.5, "{top_m} over {tree:?}");
        straight += 1;
    }
    assert!(straight > 10, "{straight}");
    // Whose crown is highest is told by ids of trees that are there, but for those from outside.
    let own = survey
        .maps
        .tops
        .iter()
        .filter(|top| survey.trees.iter().any(|tree| tree.object == **top));
    let crowned = survey.maps.tops.iter().filter(|top| !top.is_none()).count();
    assert!(own.count() as f64 > 0.85 * crowned as f64);
}

/// Leaf area by height sums to that of the trees; crowns that reach in stand for those that reach
/// out.
fn leaves_are_the_trees(survey: &Survey) {
    let of_trees = survey.trees.iter().map(|t| t.leaf_area_m2).sum::<f64>();
    // Low plants are below two metres, and so are few leaves of trees.
    let found = survey.profile.leaf_m2[2..].iter().sum::<f64>();
    println!("leaf area {found:.0} of {of_trees:.0} m²");
    assert!(
        (0.9..1.1).contains(&(found / of_trees)),
        "{found} {of_trees}"
    );
    let tallest_m = survey.trees.iter().map(|t| t.height_m).fold(0.0, f64::max);
    assert!(survey.profile.layers() <= tallest_m as usize + 3);
    // Stems reach from the ground up, and their surface is at least that of cylinders to 1.3 m.
    let stems_m2: f64 = (survey.trees.iter())
        .map(|t| 0.5 * std::f64::consts::PI * t.dbh_m)
        .sum();
    assert!(
        survey.profile.wood_m2[1] > 0.8 * stems_m2,
        "{:?}",
        survey.profile.wood_m2
    );
}

fn the_ground_is_the_worlds(recorder: &Recorder, survey: &Survey) {
    let grid = &survey.maps.grid;
    let cells = (0..grid.rows).step_by(7).flat_map(|row| {
        (0..grid.columns)
            .step_by(5)
            .map(move |column| (column, row))
    });
    let cells: Vec<_> = cells.collect();
    let places: Vec<_> = cells.iter().map(|&(c, r)| grid.middle_m(c, r)).collect();
    let ground = recorder.ground(&places).expect("ground");
    for (&(column, row), (sample, _)) in cells.iter().zip(ground) {
        let cell = row * grid.columns + column;
        assert_eq!(survey.maps.ground_m[cell], sample.height_m);
        assert!(survey.maps.surface_m[cell] > sample.height_m - 0.6);
    }
}

fn halves_make_the_whole(recorder: &Recorder, whole: &Survey) {
    let cut_m = 7.0;
    let survey = |low_m, high_m| recorder.survey(low_m, high_m, &coarse()).expect("a half");
    let west = survey(LOW_M, DVec2::new(cut_m, HIGH_M.y));
    let east = survey(DVec2::new(cut_m, LOW_M.y), HIGH_M);
    let grid = &whole.maps.grid;
    for row in 0..grid.rows {
        let line = |s: &Survey| {
            let wide = s.maps.grid.columns;
            s.maps.tops[row * wide..][..wide].to_vec()
        };
        assert_eq!([line(&west), line(&east)].concat(), line(whole));
    }
    let mut ids: Vec<_> = west
        .trees
        .iter()
        .chain(&east.trees)
        .map(|t| t.object)
        .collect();
    ids.sort_unstable();
    assert_eq!(
        ids,
        whole.trees.iter().map(|t| t.object).collect::<Vec<_>>()
    );
    for (layer, area) in whole.profile.leaf_m2.iter().enumerate() {
        let of = |s: &Survey| s.profile.leaf_m2.get(layer).copied().unwrap_or(0.0);
        assert!((of(&west) + of(&east) - area).abs() < 1e-6 * (1.0 + area));
    }
}

fn files_say_the_same(recorder: &Recorder) {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("plot");
    let params = InventoryParams {
        survey: coarse(),
        plot_m: Some(20.0),
        ..InventoryParams::default()
    };
    let survey = recorder.write_inventory([LOW_M, HIGH_M], &params, &out);
    let survey = survey.expect("an inventory");
    let read = |name: &str| {
        nemoral_files::read(&out.join(name), 1 << 24).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let text = |name: &str| String::from_utf8(read(name)).expect("text");
    // GeoTIFFs, read by another crate.
    let map = HeightMap::from_tiff(&read("dtm.tif")).expect("a height map");
    let grid = &survey.maps.grid;
    assert_eq!((map.columns, map.rows, map.spacing_m), (100, 80, 1.0));
    assert_eq!((map.west_m, map.north_m), (-39.5, 49.5));
    for (row, line) in map.heights_m.chunks(map.columns).rev().enumerate() {
        for (column, height_m) in line.iter().enumerate() {
            assert_eq!(
                *height_m,
                survey.maps.ground_m[row * grid.columns + column] as f32
            );
        }
    }
    let canopy = HeightMap::from_tiff(&read("chm.tif")).expect("a height map");
    let highest = canopy.heights_m.iter().copied().fold(0.0, f32::max);
    assert_eq!(highest, survey.maps.heights_m().fold(0.0, f64::max) as f32);
    // Plots have the trees of the whole.
    let column = |table: &str, name: &str| -> Vec<f64> {
        let mut lines = table.lines();
        let at = lines
            .next()
            .and_then(|head| head.split(',').position(|c| c == name));
        let at = at.unwrap_or_else(|| panic!("{name} in {table}"));
        lines
            .map(|line| {
                line.split(',')
                    .nth(at)
                    .expect("wide")
                    .parse()
                    .unwrap_or(0.0)
            })
            .collect()
    };
    let (stand, plots) = (text("stand.csv"), text("plots.csv"));
    let per_ha = column(&stand, "trees_per_ha");
    let of_plots = column(&plots, "trees_per_ha");
    assert_eq!(of_plots.len(), 20);
    assert!((of_plots.iter().sum::<f64>() / 20.0 - per_ha[0]).abs() < 1e-3);
    assert!((per_ha[1..].iter().sum::<f64>() - per_ha[0]).abs() < 1e-3);
    assert_eq!(text("trees.csv").lines().count(), survey.trees.len() + 1);
    assert!(text("crowns.geojson").contains("\"MultiPolygon\""));
    assert!(text("inventory.json").contains("\"canopy_cover\""));
    let layers = column(&text("profile.csv"), "leaf_area_density_m2_m3");
    assert_eq!(layers.len(), survey.profile.layers());
    // Nothing of others is replaced.
    let again = recorder.write_inventory([LOW_M, HIGH_M], &params, &out);
    assert!(
        again
            .expect_err("not empty")
            .to_string()
            .contains("not empty")
    );
}

#[test]
fn what_cannot_be_surveyed_is_refused_before_anything_is_written() {
    let recorder = recorder(&[]);
    let refused =
        |[low_m, high_m]: [DVec2; 2], change: &dyn Fn(&mut InventoryParams), told: &str| {
            let mut params = InventoryParams::default();
            change(&mut params);
            let out = Path::new("/nonexistent/nowhere");
            let refused = recorder.write_inventory([low_m, high_m], &params, out);
            let refused = refused.expect_err(told);
            assert!(
                refused.is_request() && refused.to_string().contains(told),
                "{refused}"
            );
        };
    let square = [DVec2::ZERO, DVec2::splat(20.0)];
    refused([DVec2::ZERO, DVec2::ZERO], &|_| {}, "region = 0,0,0,0");
    refused(
        [DVec2::ZERO, DVec2::splat(1e5)],
        &|p| p.survey.cell_m = 100.0,
        "must be at most 900",
    );
    refused(
        square,
        &|p| p.survey.cell_m = 0.3,
        "a whole number of cells a side",
    );
    refused(square, &|p| p.survey.cell_m = f64::NAN, "cell_m = NaN");
    refused(square, &|p| p.survey.rays_a_side = 0, "rays_a_side = 0");
    refused(square, &|p| p.survey.layer_m = 0.0, "layer_m = 0");
    refused(square, &|p| p.min_dbh_m = -1.0, "min_dbh_m = -1");
    refused(square, &|p| p.plot_m = Some(7.0), "plots");
}
