//! Scenes for other programs.

use std::fs;

use crate::common::{folder, run};

/// A region of a small forest.
const REGION: [&str; 5] = ["export", "--preset", "demo", "--region", "-4,2,9,11"];

#[test]
fn a_tree_is_a_gltf_file() {
    let folder = folder("tree");
    let out = folder.join("beech.glb");
    let path = out.to_string_lossy();
    let done = run(&[
        "tree", "beech", "--dbh", "0.2", "--seed", "3", "--out", &path,
    ]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stdout.starts_with("beech: 0.20 m thick"),
        "{}",
        done.stdout
    );
    let first = fs::read(&out).expect("a file");
    assert_eq!(&first[..4], b"glTF");
    let text = String::from_utf8_lossy(&first);
    for said in [
        "\"species\":\"beech\"",
        "\"semantic\":\"leaf\"",
        "\"alphaMode\":\"MASK\"",
    ] {
        assert!(text.contains(said), "{said}");
    }
    let again = folder.join("again.glb");
    let path = again.to_string_lossy();
    let done = run(&[
        "tree", "beech", "--dbh", "0.2", "--seed", "3", "--out", &path,
    ]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        fs::read(&again).expect("a file") == first,
        "equal trees are equal bytes"
    );
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_region_is_written_in_every_format() {
    let folder = folder("region");
    for (format, name, main) in [
        ("glb", "scene.glb", "scene.glb"),
        ("usd", "usd", "usd/forest.usda"),
        ("sdf", "sdf", "sdf/world.sdf"),
        ("heightmap", "ground.png", "ground.toml"),
    ] {
        let out = folder.join(name);
        let out = out.to_string_lossy();
        let done = run(&[&REGION[..], &["--to", format, "--out", &out]].concat());
        assert_eq!(done.code, Some(0), "{format}: {}", done.stderr);
        assert!(folder.join(main).is_file(), "{format}");
    }
    // 13 by 9 metres, a post each half metre, borders included.
    let about = fs::read_to_string(folder.join("ground.toml")).expect("a text");
    for line in [
        "columns = 27",
        "rows = 19",
        "west_m = -4.0",
        "north_m = 11.0",
    ] {
        assert!(about.contains(line), "{line}: {about}");
    }
    let out = folder.join("usd");
    let again = run(&[
        &REGION[..],
        &["--to", "usd", "--out", &out.to_string_lossy()],
    ]
    .concat());
    assert_eq!(again.code, Some(2));
    assert!(
        again.stderr.contains("the folder is not empty"),
        "{}",
        again.stderr
    );
}

#[test]
fn wrong_requests_say_what_is_allowed() {
    let folder = folder("export_refusals");
    let out = folder.join("out.glb");
    let out = out.to_string_lossy();
    let refused = |arguments: &[&str], said: &[&str]| {
        let done = run(arguments);
        assert_eq!(done.code, Some(2), "{arguments:?}: {}", done.stderr);
        for word in said {
            assert!(done.stderr.contains(word), "{word:?}: {}", done.stderr);
        }
        assert!(fs::read_dir(&folder).expect("a folder").next().is_none());
    };
    refused(
        &["tree", "baobab", "--out", &out],
        &["baobab", "beech", ".toml"],
    );
    refused(&["tree", "none.toml", "--out", &out], &["none.toml"]);
    refused(
        &["tree", "beech", "--dbh", "3.5", "--out", &out],
        &["beech: dbh_m = 3.5", "from 0."],
    );
    refused(
        &["tree", "beech", "--out", "tree.obj"],
        &["must end in .glb"],
    );
    let of = |region: &'static str| ["export", "--preset", "demo", "--region", region];
    let glb = ["--to", "glb", "--out", &*out];
    let with = |region| [&of(region)[..], &glb].concat();
    refused(&with("0,0,10"), &["four numbers"]);
    refused(&with("10,0,0,10"), &["region = 10,0,0,10", "X0 < X1"]);
    refused(&with("0,0,nan,10"), &["region", "X0 < X1"]);
    refused(&with("0,0,9000,9000"), &["chunks", "at most 900"]);
    refused(
        &[&with("0,0,9,9")[..], &["--spacing", "1"]].concat(),
        &["--spacing", "heightmap"],
    );
    let frame = ["export", "--preset", "demo", "--frame", "99999"];
    refused(&[&frame[..], &glb].concat(), &["frame 99999"]);
    let both = ["--frame", "1"];
    refused(
        &[&with("0,0,9,9")[..], &both].concat(),
        &["cannot be used with"],
    );
    let png = folder.join("out.png");
    let config = folder.join("out.toml");
    let config = config.to_string_lossy();
    fs::write(&*config, "preset = \"demo\"\n").expect("written");
    for map_is_there in [false, true] {
        if map_is_there {
            fs::write(&png, "a map").expect("written");
        }
        let out = png.to_string_lossy();
        let done = run(&["export", &config, "--to", "heightmap", "--out", &out]);
        assert_eq!(done.code, Some(2), "{}", done.stderr);
        assert!(
            done.stderr.contains("out.toml: the height map"),
            "{}",
            done.stderr
        );
        assert_eq!(
            fs::read(&*config).expect("a config"),
            b"preset = \"demo\"\n"
        );
    }
    fs::remove_file(&png).expect("removed");
    fs::remove_file(&*config).expect("removed");
    // So does the config, whatever it is called.
    let config = folder.join("config.glb");
    fs::write(&config, "preset = \"demo\"\n").expect("written");
    let out = config.to_string_lossy();
    let done = run(&["export", &out, "--to", "glb", "--out", &out]);
    assert_eq!(done.code, Some(2), "{}", done.stderr);
    let said = "config.glb: the scene is made from this file";
    assert!(done.stderr.contains(said), "{}", done.stderr);
    fs::remove_file(&config).expect("removed");
    // What the ground is made from stays.
    let stems = folder.join("stems.png");
    let table = "x_m,y_m,species,dbh_cm\n3,2,beech,31\n";
    fs::write(&stems, table).expect("written");
    let out = stems.to_string_lossy();
    let setting = format!("site.stems.path={out}");
    let site = ["--set", &*setting, "--out", &*out];
    let map = [&of("0,0,9,9")[..], &site, &["--to", "heightmap"]].concat();
    let preview = [&["preview", "--preset", "demo"][..], &site].concat();
    for arguments in [map, preview] {
        let done = run(&arguments);
        assert_eq!(done.code, Some(2), "{}", done.stderr);
        let said = "stems.png: the scene is made from this file";
        assert!(done.stderr.contains(said), "{}", done.stderr);
        assert_eq!(fs::read(&stems).expect("a table"), table.as_bytes());
    }
    fs::remove_file(&stems).expect("removed");
    let png = png.to_string_lossy();
    let map = ["--to", "heightmap", "--out", &*png, "--spacing"];
    refused(
        &[&of("0,0,9,9")[..], &map, &["0"]].concat(),
        &["spacing = 0"],
    );
    refused(
        &[&of("0,0,900,900")[..], &map, &["0.01"]].concat(),
        &["90001 x 90001 posts"],
    );
}

#[test]
fn an_inventory_that_cannot_be_made_is_refused_at_once() {
    let folder = folder("no-inventory");
    let out = folder.join("plot");
    let out = out.to_string_lossy();
    for (options, told) in [
        (&["--region", "0,0,10,0"][..], "region = 0,0,10,0: must be"),
        (&["--region", "0,0,10"], "must be four numbers"),
        (
            &["--region", "0,0,10,10", "--cell", "3"],
            "a whole number of cells a side",
        ),
        (&["--region", "0,0,10,10", "--rays", "0"], "rays_a_side = 0"),
        (&["--region", "0,0,10,10", "--layer", "0"], "layer_m = 0"),
        (
            &["--region", "0,0,10,10", "--min-dbh", "7"],
            "min_dbh_m = 7",
        ),
        (
            &["--region", "0,0,10,10", "--plots", "4"],
            "plots: cells = 2.5 x 2.5 of 4 m",
        ),
        (
            &["--region", "0,0,10,10", "--min-deadwood-diameter", "7"],
            "min_deadwood_diameter_m = 7",
        ),
        (
            &["--region", "0,0,10,10", "--plot", "5,5,4", "--plot=5,5,6"],
            "plot 2 = 5,5,6: must be 1 cm wide or more and lie wholly in the region 0,0,10,10",
        ),
        (
            &["--plot", "-5,5"],
            "plot = '-5,5': must be WEST,SOUTH,EAST,NORTH of a rectangle or EAST,NORTH,RADIUS",
        ),
        (&["--plot", "5,5,0"], "plot = '5,5,0': must be"),
        (&["--plot", "5,5,4", "--cell", "0"], "cell_m = 0"),
        (&["--plot", "5e7,5,4"], "region = "),
        (&["--plot", "5,5,4", "--plots", "5"], "cannot be used with"),
    ] {
        let done = run(&[
            &["inventory", "--preset", "demo", "--out", &out][..],
            options,
        ]
        .concat());
        assert_eq!(done.code, Some(2), "{told}: {}", done.stderr);
        assert!(done.stderr.contains(told), "{told}: {}", done.stderr);
        assert!(!folder.join("plot").exists());
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn an_inventory_of_circles_is_of_the_region_around_them() {
    let folder = folder("inventory-of-circles");
    let out = folder.join("plots");
    let options = ["--plot=-1,6.2,4", "--plot", "6,7,5.64", "--out"];
    let command = [&["inventory", "--preset", "demo"][..], &options].concat();
    let done = run(&[&command[..], &[&*out.to_string_lossy()]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stdout.contains("from -5, 1 to 12, 13 m"),
        "{}",
        done.stdout
    );
    let plots = fs::read_to_string(out.join("plots.csv")).expect("a table");
    let starts: Vec<&str> = plots.lines().map(|line| &line[..11]).collect();
    assert_eq!(starts, ["plot_id,x_m", "1,-1,6.2,4,", "2,6,7,5.64,"]);
    assert!(out.join("deadwood_stand.csv").is_file());
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn an_inventory_is_a_folder_of_tables_and_maps() {
    let folder = folder("inventory");
    let out = folder.join("plot");
    let options = ["--region", "-4,2,16,12", "--plots", "5", "--out"];
    let command = [&["inventory", "--preset", "demo"][..], &options].concat();
    let done = run(&[&command[..], &[&*out.to_string_lossy()]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stdout.contains("on 0.02 ha from -4, 2 to 16, 12 m"),
        "{}",
        done.stdout
    );
    let rows = |name: &str| {
        fs::read_to_string(out.join(name))
            .expect(name)
            .lines()
            .count()
    };
    assert_eq!(rows("plots.csv"), 9);
    assert!(rows("stand.csv") >= 2 && rows("profile.csv") > 5);
    for map in ["dtm.tif", "dsm.tif", "chm.tif", "crowns.tif"] {
        assert!(out.join(map).is_file(), "{map}");
    }
}
