//! A survey agrees with the trees that were grown, with the ground, and with itself.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::path::Path;

use nemoral_dataset::Crop;
use nemoral_import::HeightMap;
use nemoral_pipeline::config::ConfigLayers;
use nemoral_pipeline::{
    Backend, ExportArea, InventoryParams, InventoryPlots, Recorder, Survey, SurveyParams,
};
use nemoral_realism::grown;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{DeadwoodRecord, ObjectKind, TreeRecord};

fn recorder(settings: &[&str]) -> Recorder {
    let base = [
        "chunks.visible_radius_m=30",
        "chunks.undergrowth_radius_m=10",
        "chunks.delete_radius_m=40",
        "terrain.max_height_m=12",
    ];
    let settings = base.iter().chain(settings).map(|s| (*s).to_owned());
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        settings: settings.collect(),
        ..ConfigLayers::default()
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

const LOW_M: DVec2 = DVec2::new(-20.0, -10.0);
const HIGH_M: DVec2 = DVec2::new(40.0, 30.0);

#[test]
fn a_survey_finds_the_trees_that_were_grown() {
    let recorder = recorder(&[]);
    let survey = recorder.survey(LOW_M, HIGH_M, &coarse()).expect("a survey");
    let trees = &survey.trees;
    println!("{} trees, cover {:.3}", trees.len(), survey.maps.cover());
    assert!(trees.len() > 50, "{}", trees.len());
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
    let cells = &survey.maps.cells;
    let highest_m = cells.iter().map(|cell| cell.height_m).fold(0.0, f64::max);
    let all = || survey.trees.iter().chain(&survey.trees_outside);
    let tallest_m = all().map(|t| t.height_m).fold(0.0, f64::max);
    assert!(
        (0.93 * tallest_m..tallest_m + 1.5).contains(&highest_m),
        "{highest_m} {tallest_m}"
    );
    for tree in survey.trees.iter().filter(|t| t.alive) {
        let foot_m = tree.position_m.truncate();
        // As far around its foot as it leans, and two metres more, is its top or something higher.
        let reach = (tree.height_m * tree.lean_rad.tan()).ceil() as i32 + 2;
        let near = (-reach..=reach)
            .flat_map(|dy| (-reach..=reach).map(move |dx| DVec2::new(dx.into(), dy.into())));
        let near = near.filter_map(|by_m| grid.cell_at(foot_m + by_m));
        let top_m = near
            .map(|number| cells[number].height_m)
            .fold(0.0, f64::max);
        // At the border the top may be outside.
        let is_inside = grid.cell_at(foot_m - f64::from(reach)).is_some()
            && grid.cell_at(foot_m + f64::from(reach)).is_some();
        assert!(
            !is_inside || top_m > 0.85 * tree.height_m - 0.5,
            "{top_m} over {tree:?}"
        );
    }
    // Tops are trees that are known, and those of the canopy alone.
    let known: BTreeSet<_> = all().map(|tree| tree.object).collect();
    let tops: BTreeSet<_> = cells.iter().map(|cell| cell.top).collect();
    assert!(tops.iter().all(|top| top.is_none() || known.contains(top)));
    assert!(!survey.trees_outside.is_empty());
    assert!(
        survey
            .trees_outside
            .iter()
            .all(|tree| tops.contains(&tree.object))
    );
    let own = survey
        .trees
        .iter()
        .filter(|tree| tops.contains(&tree.object));
    assert!(2 * own.count() > survey.trees.len());
    for cell in cells {
        assert!(
            cell.top.is_none() || cell.height_m >= 2.0 && cell.cover > 0.0,
            "{cell:?}"
        );
        assert!((cell.cover == 0.0) == (cell.height_m < 2.0), "{cell:?}");
    }
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
    let all = survey.trees.iter().chain(&survey.trees_outside);
    let tallest_m = all.map(|t| t.height_m).fold(0.0, f64::max);
    assert!(survey.profile.layers() <= tallest_m as usize + 3);
    // Half of the surface of wood around breast height, where there are few branches, is hardly
    // more than that of cylinders; feet are wider, and shrubs are among them.
    let stems_m2: f64 = (survey.trees.iter())
        .map(|t| 0.5 * std::f64::consts::PI * t.dbh_m)
        .sum();
    for (layer, share) in [(0, 1.0..2.2), (1, 0.9..1.5)] {
        let found = survey.profile.wood_m2[layer] / stems_m2;
        println!("wood in layer {layer}: {found:.3} of its stems");
        assert!(share.contains(&found), "{layer}: {found}");
    }
}

fn the_ground_is_the_worlds(recorder: &Recorder, survey: &Survey) {
    let grid = &survey.maps.grid;
    let numbers: Vec<_> = (0..grid.cells()).step_by(7).collect();
    let places: Vec<_> = numbers
        .iter()
        .map(|&number| grid.middle_m(number))
        .collect();
    let ground = recorder.ground(&places).expect("ground");
    let mut bare = 0;
    for (&number, (sample, _)) in numbers.iter().zip(ground) {
        let cell = &survey.maps.cells[number];
        assert_eq!(cell.ground_m, sample.height_m);
        // The highest ground of a cell is uphill of its middle.
        let uphill_m = cell.surface_m - cell.ground_m;
        assert!(uphill_m > -0.05, "{cell:?}");
        bare += u32::from(cell.height_m == 0.0);
        assert!(
            cell.height_m > 0.0 || uphill_m < 0.2 + sample.gradient.length(),
            "{cell:?}"
        );
    }
    assert!(bare > 3, "{bare}");
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
            let cells = &s.maps.cells[row * wide..][..wide];
            cells
                .iter()
                .map(|c| (c.top, c.cover, c.ground_m))
                .collect::<Vec<_>>()
        };
        assert_eq!([line(&west), line(&east)].concat(), line(whole));
    }
    let ids = |trees: &mut dyn Iterator<Item = &TreeRecord>| {
        trees.map(|tree| tree.object).collect::<BTreeSet<_>>()
    };
    let halves = ids(&mut west.trees.iter().chain(&east.trees));
    assert_eq!(halves, ids(&mut whole.trees.iter()));
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
        plots: InventoryPlots::Squares { side_m: 20.0 },
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
    assert_eq!((map.columns, map.rows, map.spacing_m), (60, 40, 1.0));
    assert_eq!((map.west_m, map.north_m), (-19.5, 29.5));
    let ground = grid.from_north(|number| survey.maps.cells[number].ground_m as f32);
    assert_eq!(map.heights_m, ground);
    let canopy = HeightMap::from_tiff(&read("chm.tif")).expect("a height map");
    let heights = grid.from_north(|number| survey.maps.cells[number].height_m as f32);
    assert_eq!(canopy.heights_m, heights);
    // Plots have the trees and the canopy of the whole.
    let (stand, plots) = (text("stand.csv"), text("plots.csv"));
    let mean = |name: &str| column(&plots, name).iter().sum::<f64>() / 6.0;
    let per_ha = column(&stand, "trees_per_ha");
    assert_eq!(column(&plots, "west_m")[..4], [-20.0, 0.0, 20.0, -20.0]);
    assert_eq!(column(&plots, "x_m")[..4], [-10.0, 10.0, 30.0, -10.0]);
    assert_eq!(
        column(&plots, "plot_id")[..],
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    );
    assert_eq!(column(&plots, "area_m2")[..], [400.0; 6]);
    assert!((mean("trees_per_ha") - per_ha[0]).abs() < 1e-3);
    assert!((mean("canopy_cover") - survey.maps.cover()).abs() < 1e-4);
    assert!(mean("canopy_cells") > mean("canopy_cover"));
    assert!((per_ha[1..].iter().sum::<f64>() - per_ha[0]).abs() < 1e-3);
    assert_eq!(text("trees.csv").lines().count(), survey.trees.len() + 1);
    assert_eq!(
        text("deadwood.csv").lines().count(),
        survey.deadwood.len() + 1
    );
    assert!(text("crowns.geojson").contains("\"MultiPolygon\""));
    assert_eq!(
        text("stems.geojson").matches("\"Point\"").count(),
        survey.trees.len()
    );
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

/// The numbers of a column of a table; 0 for what is none.
fn column(table: &str, name: &str) -> Vec<f64> {
    let mut lines = table.lines();
    let head = lines.next().expect("a head");
    let at = head.split(',').position(|c| c == name);
    let at = at.unwrap_or_else(|| panic!("{name} in {table}"));
    let field = |line: &str| {
        line.split(',')
            .nth(at)
            .expect("wide")
            .parse()
            .unwrap_or(0.0)
    };
    lines.map(field).collect()
}

/// In a wet, mossy forest with climbers, dead wood and leafless trees, and on a slope.
#[test]
fn ground_water_moss_and_stones_are_no_canopy() {
    let recorder = recorder(&[
        "climbers.moss=1",
        "climbers.ivy=1",
        "deadwood.volume_m3_ha=60",
        "terrain.max_height_m=60",
        "season.day_of_year=20",
    ]);
    let survey = plots_are_what_is_in_them(&recorder);
    heights_are_the_trees(&survey);
    the_ground_is_the_worlds(&recorder, &survey);
    // Summer's leaves are in tables of trees, and few are left.
    let of_trees = survey.trees.iter().map(|t| t.leaf_area_m2).sum::<f64>();
    let found = survey.profile.leaf_m2[2..].iter().sum::<f64>();
    println!("leaf area in winter {found:.0} of {of_trees:.0} m²");
    assert!(found < 0.9 * of_trees, "{found} {of_trees}");
}

/// Snow on the shoots of pines is cards over cards, and none of it is leaf.
#[test]
fn a_snowy_stand_has_the_leaves_that_it_has_without_snow() {
    let profile = |settings: &[&str]| {
        let survey = recorder(settings).survey(LOW_M, HIGH_M, &coarse());
        survey.expect("a survey").profile
    };
    let bare = profile(&[]);
    let snowy = profile(&["weather.snow_depth_m=0.3", "weather.snow_on_crowns=0.7"]);
    // Snow presses low plants down.
    let sum = |layers: &[f64]| layers[2..].iter().sum::<f64>();
    for (name, bare, snowy) in [
        ("leaf", &bare.leaf_m2, &snowy.leaf_m2),
        ("wood", &bare.wood_m2, &snowy.wood_m2),
    ] {
        let (bare, snowy) = (sum(bare), sum(snowy));
        println!("{name}: {bare:.1} m², {snowy:.1} m² with snow");
        assert!(
            bare > 50.0 && (snowy / bare - 1.0).abs() < 1e-6,
            "{name}: {bare} {snowy}"
        );
    }
}

/// Circles have the trees, the logs and the cells that are as near to their middles as their
/// radius; the whole has all logs, in every file.
fn plots_are_what_is_in_them(recorder: &Recorder) -> Survey {
    let circle = |x, y, radius_m| Crop::Circle {
        centre_m: DVec2::new(x, y),
        radius_m,
    };
    let rectangle = |low_m, high_m| Crop::Rectangle { low_m, high_m };
    let given = vec![
        circle(2.5, 8.25, 17.84),
        circle(25.0, 15.0, 15.0),
        // The square around it, and the whole.
        rectangle(DVec2::new(10.0, 0.0), DVec2::new(40.0, 30.0)),
        rectangle(LOW_M, HIGH_M),
    ];
    let params = InventoryParams {
        survey: coarse(),
        min_deadwood_diameter_m: 0.15,
        plots: InventoryPlots::Given(given.clone()),
        ..InventoryParams::default()
    };
    let around = params.plots.region_m(1.0).expect("in range");
    assert_eq!(around, Some([LOW_M, HIGH_M]));
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("plots");
    let survey = recorder.write_inventory([LOW_M, HIGH_M], &params, &out);
    let survey = survey.expect("an inventory");
    let text = |name: &str| {
        let bytes = nemoral_files::read(&out.join(name), 1 << 24).expect(name);
        String::from_utf8(bytes).expect("text")
    };
    let plots = text("plots.csv");
    let found = |name: &str| column(&plots, name);
    assert_eq!(found("radius_m"), [17.84, 15.0, 0.0, 0.0]);
    assert_eq!(found("x_m"), [2.5, 25.0, 25.0, 10.0]);
    assert_eq!(found("west_m"), [-15.34, 10.0, 10.0, -20.0]);
    let counts_as_log = |piece: &&DeadwoodRecord| {
        piece.kind == ObjectKind::Log && piece.diameter_m[0] >= params.min_deadwood_diameter_m
    };
    for (i, plot) in given.iter().enumerate() {
        let (area_m2, is_inside): (f64, Box<dyn Fn(DVec2) -> bool>) = match *plot {
            Crop::Circle { centre_m, radius_m } => (
                PI * radius_m * radius_m,
                Box::new(move |at_m: DVec2| (at_m - centre_m).length_squared() <= radius_m.powi(2)),
            ),
            Crop::Rectangle { low_m, high_m } => (
                (high_m.x - low_m.x) * (high_m.y - low_m.y),
                Box::new(move |at_m: DVec2| at_m.cmpge(low_m).all() && at_m.cmplt(high_m).all()),
            ),
        };
        let per_ha = 1e4 / area_m2;
        let near = |name: &str, wanted: f64| {
            let found = found(name)[i];
            assert!(
                (found - wanted).abs() < 1e-3,
                "{name} of {plot:?}: {found} {wanted}"
            );
        };
        let [living_m2, dead_m2] = [true, false].map(|alive| {
            let thick = survey
                .trees
                .iter()
                .filter(|t| t.alive == alive && t.dbh_m >= 0.07);
            let here = thick.filter(|t| is_inside(t.position_m.truncate()));
            here.map(|t| PI / 4.0 * t.dbh_m * t.dbh_m)
                .collect::<Vec<f64>>()
        });
        assert!(living_m2.len() > 5, "{plot:?}");
        near("area_m2", area_m2);
        near("trees_per_ha", per_ha * living_m2.len() as f64);
        near("basal_area_m2_ha", per_ha * living_m2.iter().sum::<f64>());
        near("dead_trees_per_ha", per_ha * dead_m2.len() as f64);
        near(
            "dead_basal_area_m2_ha",
            per_ha * dead_m2.iter().sum::<f64>(),
        );
        let logs = survey.deadwood.iter().filter(counts_as_log);
        let logs = logs.filter(|log| is_inside(log.position_m.truncate()));
        let logs_m3: f64 = logs.map(|log| log.volume_m3).sum();
        near("lying_deadwood_m3_ha", per_ha * logs_m3);
        let grid = &survey.maps.grid;
        let cells: Vec<_> = (0..grid.cells())
            .filter(|&number| is_inside(grid.middle_m(number)))
            .map(|number| survey.maps.cells[number])
            .collect();
        let mean = cells.iter().map(|cell| cell.cover).sum::<f64>() / cells.len() as f64;
        near("canopy_cover", mean);
        let highest_m = cells.iter().map(|cell| cell.height_m).fold(0.0, f64::max);
        near("canopy_height_max_m", highest_m);
    }
    // A circle has no more than the square around it, in absolute numbers.
    let count = |i: usize| found("trees_per_ha")[i] * found("area_m2")[i] / 1e4;
    assert!(count(1) <= count(2) + 1e-3 && count(2) < count(3));
    // The threshold leaves some out, and the whole is the same in all files.
    let [thick, all] = [
        survey.deadwood.iter().filter(counts_as_log).count(),
        survey.deadwood.len(),
    ];
    println!("{thick} of {all} pieces of dead wood count");
    assert!(0 < thick && thick < all, "{thick} of {all}");
    let whole_m3_ha = found("lying_deadwood_m3_ha")[3];
    assert!(whole_m3_ha > 5.0, "{whole_m3_ha}");
    let of_stages = column(&text("deadwood_stand.csv"), "volume_m3_ha");
    assert_eq!(of_stages.len(), 6);
    assert!((of_stages[0] - whole_m3_ha).abs() < 1e-3);
    assert!((of_stages[1..].iter().sum::<f64>() - whole_m3_ha).abs() < 1e-3);
    let pieces_per_ha = column(&text("deadwood_stand.csv"), "pieces_per_ha")[0];
    let hectares = survey.maps.grid.area_m2() / 1e4;
    assert!((pieces_per_ha * hectares - thick as f64).abs() < 1e-3);
    let about: serde_json::Value = serde_json::from_str(&text("inventory.json")).expect("JSON");
    let of_json = about["lying_deadwood_m3_ha"].as_f64().expect("a number");
    assert!((of_json - whole_m3_ha).abs() < 1e-3);
    assert_eq!(about["min_deadwood_diameter_m"], 0.15);
    assert_eq!(about["plots"], 4);
    survey
}

/// A site's maps lie where its files do.
#[test]
fn the_inventory_of_a_site_lies_on_its_map() {
    let terrain = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/site/terrain.tif"
    );
    let recorder = recorder(&[
        "site.origin_x_m=553220",
        "site.origin_y_m=4450330",
        "site.terrain.origin_z_m=73",
        &format!("site.terrain.path={terrain}"),
    ]);
    let (low_m, high_m) = (DVec2::new(-8.0, -6.0), DVec2::new(12.0, 14.0));
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("maps");
    let params = InventoryParams {
        survey: coarse(),
        plots: InventoryPlots::Squares { side_m: 10.0 },
        ..InventoryParams::default()
    };
    let survey = recorder
        .write_inventory([low_m, high_m], &params, &out)
        .expect("an inventory");
    let read = |name: &str| nemoral_files::read(&out.join(name), 1 << 24).expect(name);
    let map = |name: &str| HeightMap::from_tiff(&read(name)).expect(name);
    let [ground, surface, crowns] = ["dtm.tif", "dsm.tif", "crowns.tif"].map(map);
    assert_eq!((ground.west_m, ground.north_m), (553_212.5, 4_450_343.5));
    assert_eq!(
        [&ground, &surface, &crowns].map(|map| map.epsg),
        [Some(32_629); 3]
    );
    // The example's ground, which is measured, is 73 to 90 m high.
    let cells = &survey.maps.cells;
    let from_north = |of: &dyn Fn(usize) -> f64| survey.maps.grid.from_north(|n| of(n) as f32);
    assert_eq!(ground.heights_m, from_north(&|n| cells[n].ground_m + 73.0));
    assert_eq!(
        surface.heights_m,
        from_north(&|n| cells[n].surface_m + 73.0)
    );
    assert!(ground.heights_m.iter().all(|h| (73.0..95.0).contains(h)));
    let text = |name: &str| String::from_utf8(read(name)).expect("text");
    assert!(
        text("plots.csv")
            .lines()
            .nth(1)
            .expect("a plot")
            .starts_with("1,553217,4450329,,553212,4450324,553222,4450334,100,")
    );
    assert!(text("inventory.json").contains("\"epsg\": 32629"));
    // Numbers of crowns are those of the polygons, cell by cell.
    let json: serde_json::Value = serde_json::from_str(&text("crowns.geojson")).expect("JSON");
    let features = json["features"].as_array().expect("features");
    assert!(features.len() > 5);
    for feature in features {
        let properties = &feature["properties"];
        let number = properties["crown"].as_u64().expect("a number") as f32;
        let cells = crowns.heights_m.iter().filter(|n| **n == number).count();
        assert_eq!(properties["visible_area_m2"], cells as f64);
        let x = &feature["geometry"]["coordinates"][0][0][0][0];
        assert!((553_212.0..=553_232.0).contains(&x.as_f64().expect("a number")));
    }
    let highest = crowns.heights_m.iter().copied().fold(0.0, f32::max);
    assert_eq!(highest as usize, features.len());
}

/// A corner of a map that is given as the region of the next one.
#[test]
fn a_region_in_the_coordinates_of_a_site_is_refused() {
    let trails = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/site/trails.geojson"
    );
    let recorder = recorder(&[
        "site.origin_x_m=553220",
        "site.origin_y_m=4450330",
        &format!("site.trails.path={trails}"),
    ]);
    let region = [
        DVec2::new(553_200.0, 4_450_320.0),
        DVec2::new(553_240.0, 4_450_340.0),
    ];
    let out = Path::new("/nonexistent/nowhere");
    let refused = recorder.write_inventory(region, &InventoryParams::default(), out);
    let refused = refused.expect_err("refused").to_string();
    assert!(
        refused.ends_with("that would be -20,-10,20,10"),
        "{refused}"
    );
    // So do other commands, and a region elsewhere in the world is one.
    let [low_m, high_m] = region;
    let area = ExportArea::Region { low_m, high_m };
    assert!(recorder.export_heights(area, 10.0).is_err());
    assert!(recorder.survey(low_m, high_m, &coarse()).is_err());
    let far = DVec2::new(553_220.0, 0.0);
    let area = ExportArea::Region {
        low_m: far,
        high_m: far + 20.0,
    };
    recorder.export_heights(area, 10.0).expect("ground");
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
    refused(square, &|p| p.min_dbh_m = 7.0, "min_dbh_m = 7");
    refused(
        square,
        &|p| p.min_deadwood_diameter_m = 10.0,
        "min_deadwood_diameter_m = 10",
    );
    for (side_m, told) in [(7.0, "plots: cells ="), (0.2, "plots: plot_m = 0.2")] {
        refused(
            square,
            &|p| p.plots = InventoryPlots::Squares { side_m },
            told,
        );
    }
    // Each reaches out of the square at one side, is in the coordinates of a site, or is too small.
    for (x, y, radius_m, told) in [
        (4.0, 10.0, 5.0, "plot 2 = 4,10,5: must be 1 cm wide or more"),
        (
            10.0,
            4.0,
            5.0,
            "wholly in the region 0,0,20,20, metres in world",
        ),
        (15.5, 10.0, 5.0, "plot 2 = 15.5,10,5"),
        (10.0, 15.5, 5.0, "plot 2 = 10,15.5,5"),
        (553_220.0, 4_450_330.0, 5.0, "plot 2 = 553220,4450330,5"),
        (10.0, 10.0, 0.0, "plot 2 = 10,10,0"),
        (10.0, 10.0, 1e-153, "plot 2 = 10,10,0.000"),
        (10.0, 10.0, -1.0, "plot 2 = 10,10,-1"),
        (10.0, f64::NAN, 5.0, "plot 2 = 10,NaN,5"),
        (10.0, 10.0, f64::INFINITY, "plot 2 = 10,10,inf"),
    ] {
        let circle = |x, y, radius_m| Crop::Circle {
            centre_m: DVec2::new(x, y),
            radius_m,
        };
        refused(
            square,
            &|p| {
                let whole = circle(10.0, 10.0, 10.0);
                p.plots = InventoryPlots::Given(vec![whole, circle(x, y, radius_m)]);
            },
            told,
        );
    }
    let given = InventoryPlots::Given(vec![Crop::Circle {
        centre_m: DVec2::new(-3.1, 4.0),
        radius_m: 5.0,
    }]);
    let around = given.region_m(0.5).expect("in range");
    assert_eq!(around, Some([DVec2::new(-8.5, -1.0), DVec2::new(2.0, 9.0)]));
    assert_eq!(InventoryPlots::None.region_m(0.5).expect("in range"), None);
    let wrong = given.region_m(0.0).expect_err("no cell").to_string();
    assert!(wrong.contains("cell_m = 0"), "{wrong}");
}
