//! Requests that succeed, run in all the ways that must not change the result.

use std::fs;

use crate::common::{
    SMALL, assert_same_files, base, files, folder, nemoral, outcome, record, run, small,
};

#[test]
fn a_data_set_is_complete_checked_and_counted() {
    let out = folder("complete").join("out");
    let path = out.to_string_lossy();
    let done = run(&[
        "generate",
        "--preset",
        "demo",
        "--out",
        &path,
        "--set",
        "camera.width_px=320",
        "--set",
        "camera.height_px=180",
        "--set",
        "lidar.pulses=20000",
    ]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stderr.contains("2 frames in"), "{}", done.stderr);
    assert!(done.stderr.contains("2 of 2"), "progress: {}", done.stderr);

    // The layout of docs/reference/files.md, and nothing else.
    let mut expected: Vec<String> = [
        "README.md",
        "config.toml",
        "dataset.json",
        "ontology.yaml",
        "poses/00.txt",
        "sequences/00/calib.txt",
        "sequences/00/config.toml",
        "sequences/00/instances.csv",
        "sequences/00/poses.txt",
        "sequences/00/times.txt",
        "sequences/00/trees.csv",
    ]
    .map(str::to_owned)
    .into();
    for frame in ["000000", "000001"] {
        for folder in ["image_2", "semantic", "instance", "depth", "normals"] {
            expected.push(format!("sequences/00/{folder}/{frame}.png"));
        }
        for (folder, extension) in [("velodyne", "bin"), ("labels", "label"), ("points", "ply")] {
            expected.push(format!("sequences/00/{folder}/{frame}.{extension}"));
        }
    }
    expected.sort();
    let found = files(&out);
    assert_eq!(found.keys().cloned().collect::<Vec<_>>(), expected);
    assert!(found.values().all(|bytes| !bytes.is_empty()));

    let checked = run(&["check", &path]);
    assert_eq!(
        checked.code,
        Some(0),
        "{}{}",
        checked.stdout,
        checked.stderr
    );
    assert!(checked.stdout.contains("passed"), "{}", checked.stdout);

    let counted = run(&["stats", &path]);
    assert_eq!(counted.code, Some(0), "{}", counted.stderr);
    for word in ["2 frames", "Trunks", "Canopy", "DBH", "trees"] {
        assert!(counted.stdout.contains(word), "{}", counted.stdout);
    }

    // One cloud of all scans has as many points as they hold; with voxels there are fewer.
    let cloud = folder("complete-cloud").join("cloud.ply");
    let points_in = |arguments: &[&str]| -> usize {
        let to = ["cloud", &path, "-o", &cloud.to_string_lossy()].map(str::to_owned);
        let to: Vec<&str> = to.iter().map(String::as_str).collect();
        let done = run(&[&to, arguments].concat());
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        let bytes = fs::read(&cloud).expect("a cloud");
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(2000)]);
        let count = head.lines().find_map(|l| l.strip_prefix("element vertex "));
        count.expect("a PLY").parse().expect("a number")
    };
    let in_scans = found
        .iter()
        .filter(|(name, _)| name.ends_with(".label"))
        .map(|(_, bytes)| bytes.len() / 4)
        .sum::<usize>();
    assert_eq!(points_in(&[]), in_scans);
    let thinned = points_in(&["--voxel", "0.5", "--pure"]);
    assert!(
        thinned > 100 && thinned < in_scans / 2,
        "{thinned} of {in_scans}"
    );

    // Beside it, on request: what it shows of each tree, and where the scanners were.
    let [trees, trajectory] = ["trees.csv", "trajectory.csv"].map(|name| {
        let table = cloud.with_file_name(name);
        table.to_string_lossy().into_owned()
    });
    let beside = |trajectory: &str| {
        let cloud = cloud.to_string_lossy();
        let command = ["cloud", &path, "-o", &cloud, "--trees", &trees];
        run(&[&command[..], &["--trajectory", trajectory]].concat())
    };
    let done = beside(&trajectory);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    for (what, table) in [(" trees", &trees), ("2 poses", &trajectory)] {
        let told = format!("{what} in {table}, in world coordinates");
        assert!(done.stdout.contains(&told), "{}", done.stdout);
    }
    let table = fs::read_to_string(&trajectory).expect("a table");
    assert!(table.starts_with("gps_time,x_m,y_m,z_m,") && table.lines().count() == 3);
    let table = fs::read_to_string(&trees).expect("a table");
    let widths: Vec<usize> = table.lines().map(|row| row.split(',').count()).collect();
    assert!(widths.len() > 1 && widths.iter().all(|width| *width == widths[0]));
    assert!(table.contains(",tree_id,foot_inside,points,points_cropped,highest_point_m,"));
    // Another way to the same file is that file.
    let folder = cloud.parent().expect("a folder");
    let name = folder.file_name().expect("a name");
    let around = folder.join("..").join(name).join("trees.csv");
    for same in [&trees, &around.to_string_lossy().into_owned()] {
        let done = beside(same);
        assert_eq!(done.code, Some(2), "{}", done.stdout);
        assert!(done.stderr.contains("trajectory"), "{}", done.stderr);
    }

    // One changed bit is enough.
    let depth = out.join("sequences/00/depth/000001.png");
    let mut bytes = fs::read(&depth).expect("a depth image");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&depth, bytes).expect("a writable file");
    let checked = run(&["check", &path]);
    assert_eq!(checked.code, Some(1), "{}", checked.stdout);
    assert!(
        checked.stdout.contains("depth/000001.png"),
        "{}",
        checked.stdout
    );
    assert!(checked.stdout.contains("FAILED"), "{}", checked.stdout);
}

#[test]
fn threads_do_not_matter() {
    let out = folder("threads").join("out");
    record(&out, &["--threads", "1"]);
    assert_same_files(&out, base());
}

#[test]
fn parts_and_shards_make_the_whole() {
    let folder = folder("shards");
    // The second half of 27 frames is the last 14.
    let parts: [&[&str]; 2] = [
        &["--frames", "0..26"],
        &["--frames", "13..40", "--shard", "1/2"],
    ];
    let mut merge = vec!["merge".to_owned()];
    // The last shard comes first, as the order must not matter.
    for (i, arguments) in parts.iter().enumerate().rev() {
        let part = folder.join(format!("part{i}"));
        record(&part, arguments);
        merge.push(part.to_string_lossy().into_owned());
    }
    let whole = folder.join("whole");
    let some = run(&["merge", &merge[1], "--out", &whole.to_string_lossy()]);
    assert_eq!(some.code, Some(2), "{}", some.stderr);
    assert!(some.stderr.contains("--partial"), "{}", some.stderr);
    merge.extend(["--out".to_owned(), whole.to_string_lossy().into_owned()]);
    let merged = run(&merge.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(merged.code, Some(0), "{}", merged.stderr);
    assert!(merged.stdout.contains("40 frames"), "{}", merged.stdout);
    assert_same_files(&whole, base());
}

#[test]
fn another_seed_replaces_a_data_set_only_if_asked() {
    let out = folder("seed").join("out");
    copy(base(), &out);
    let foreign = out.join("notes.txt");
    fs::write(&foreign, "mine").expect("a writable folder");
    let seed = ["--seed", "8", "--frames", "2", "--quiet"];
    let overwrite = [&seed[..], &["--overwrite"]].concat();
    let done = outcome(&mut small(&out, &overwrite));
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stdout.is_empty() && done.stderr.is_empty(), "quiet");

    let (old, new) = (files(base()), files(&out));
    let frames = |f: &std::collections::BTreeMap<String, Vec<u8>>| {
        f.keys().filter(|n| n.contains("image_2")).count()
    };
    assert_eq!((frames(&old), frames(&new)), (40, 2));
    for name in [
        "image_2/000000.png",
        "depth/000001.png",
        "velodyne/000000.bin",
    ] {
        let name = format!("sequences/00/{name}");
        assert!(old[&name] != new[&name], "{name}");
    }
    let trees = "sequences/00/trees.csv";
    assert!(old[trees] != new[trees]);
    // Files that are not part of the data set stay.
    assert_eq!(fs::read(&foreign).expect("still there"), b"mine");

    // Shards of two worlds cannot be merged.
    let whole = out.with_extension("whole");
    let merge = [&out, base(), &whole].map(|p| p.to_string_lossy().into_owned());
    let done = run(&["merge", &merge[0], &merge[1], "--out", &merge[2]]);
    assert_eq!(done.code, Some(2), "{}", done.stderr);
    assert!(done.stderr.contains("seed"), "{}", done.stderr);
    assert!(!whole.exists());
}

fn copy(from: &std::path::Path, to: &std::path::Path) {
    for (name, bytes) in files(from) {
        let path = to.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a writable folder");
        fs::write(path, bytes).expect("a writable folder");
    }
}

#[test]
fn pictures_alone_are_those_that_are_made_beside_scans() {
    let (alone, both) = (folder("no-lidar").join("out"), folder("lidar").join("out"));
    record(
        &alone,
        &["--frames", "0..2", "--set", "lidar.enabled=false"],
    );
    record(&both, &["--frames", "0..2"]);
    let (alone_files, both_files) = (files(&alone), files(&both));
    for (name, bytes) in &alone_files {
        if name.ends_with(".png") {
            assert!(both_files.get(name) == Some(bytes), "{name}");
        }
        let scans = ["velodyne", "labels", "points"];
        assert!(!scans.iter().any(|s| name.contains(s)), "{name}");
    }

    let path = alone.to_string_lossy();
    for command in [&["check", &path][..], &["stats", &path]] {
        let done = run(command);
        assert_eq!(done.code, Some(0), "{}{}", done.stdout, done.stderr);
    }
    let out = folder("no-lidar-out");
    fs::create_dir_all(&out).expect("a folder");
    let [page, sheet, cloud, coco, laz] = ["page.html", "sheet.png", "cloud.ply", "coco", "laz"]
        .map(|name| {
            let path = out.join(name);
            path.to_string_lossy().into_owned()
        });
    let done = run(&["report", &path, "--out", &page]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let done = run(&["convert", &path, "--to", "coco", "--out", &coco]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let done = run(&[
        "preview",
        "--preset",
        "demo",
        "--set",
        "lidar.enabled=false",
        "-o",
        &sheet,
    ]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    for command in [
        &["cloud", &path, "-o", &cloud][..],
        &["convert", &path, "--to", "laz", "--out", &laz],
    ] {
        let done = run(command);
        assert_eq!(done.code, Some(2), "{}", done.stdout);
        assert!(done.stderr.contains("LiDAR"), "{}", done.stderr);
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_data_set_is_made_again_from_itself_alone() {
    type Files = std::collections::BTreeMap<String, Vec<u8>>;
    let here = folder("again");
    let site = here.join("site");
    fs::create_dir_all(&site).expect("a writable folder");
    let assert_same = |a: &Files, b: &Files| {
        assert!(a.keys().eq(b.keys()), "{:?} {:?}", a.keys(), b.keys());
        for (name, bytes) in a {
            assert!(*bytes == b[name], "{name} differs");
        }
    };
    let config = "[lidar.table]\npath = \"pulses.csv\"\n[robot.file]\npath = \"my poses.txt\"\n\
                  [models.stone]\nfile = \"rocks/stone.obj\"\nkind = \"rock\"\nshare = 1\n";
    fs::write(site.join("site.toml"), config).expect("a writable folder");
    fs::create_dir_all(site.join("rocks")).expect("a writable folder");
    let obj = "mtllib stone.mtl\nusemtl grey\nv 0 0 -0.1\nv 1 0 -0.1\nv 0 1 -0.1\nv 0 0 0.5\n\
               f 1 2 4\nf 2 3 4\nf 3 1 4\n";
    fs::write(site.join("rocks/stone.obj"), obj).expect("a writable folder");
    fs::write(
        site.join("rocks/stone.mtl"),
        "newmtl grey\nKd 0.3 0.3 0.3\n",
    )
    .expect("writable");
    let sidecar = "up = \"z\"\nmetres_per_unit = 1\n";
    fs::write(site.join("rocks/stone.obj.toml"), sidecar).expect("a writable folder");
    fs::write(site.join("pulses.csv"), "0, 0, 0\n0.001, 1, -5\n").expect("a writable folder");
    let poses = "0 2 3 0 0 0 0 1\n1 3 3 0 0 0 0 1\n";
    fs::write(site.join("my poses.txt"), poses).expect("a writable folder");
    let from = |config: &std::path::Path, out: &str, more: &[&str]| {
        let mut command = small(&here.join(out), more);
        command.args(["--set", "frames=2"]).arg(config);
        let done = outcome(&mut command);
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        files(&here.join(out))
    };
    let first = from(&site.join("site.toml"), "first", &[]);
    let inputs: Vec<_> = first.keys().filter(|f| f.starts_with("inputs/")).collect();
    assert_eq!(inputs.len(), 3, "{inputs:?}");
    // A model is one file with those that it names.
    for end in ["-pulses.csv", "-my_poses.txt", "-stone.obj.tar"] {
        assert!(inputs.iter().any(|f| f.ends_with(end)), "{inputs:?}");
    }
    for file in ["dataset.json", "config.toml", "sequences/00/config.toml"] {
        let text = String::from_utf8_lossy(&first[file]);
        assert!(
            text.contains(inputs[0].as_str()) && !text.contains("site/"),
            "{file}"
        );
    }
    let checked = run(&["check", &here.join("first").to_string_lossy()]);
    assert_eq!(checked.code, Some(0), "{}", checked.stdout);

    // Moved to another place, without the files, it makes itself again, and so does its copy.
    fs::remove_dir_all(&site).expect("a writable folder");
    let moved = here.join("elsewhere/deep");
    fs::create_dir_all(moved.parent().expect("it has one")).expect("a writable folder");
    fs::rename(here.join("first"), &moved).expect("a writable folder");
    assert_same(&first, &from(&moved.join("config.toml"), "second", &[]));
    let sequence = here.join("second/sequences/00/config.toml");
    assert_same(&first, &from(&sequence, "third", &[]));

    // So do shards, and the union of them; a resumed run goes on from the copies.
    let config = here.join("second/config.toml");
    let shards = ["0/2", "1/2"].map(|shard| {
        let name = format!("shard{}", &shard[..1]);
        from(&config, &name, &["--shard", shard]);
        here.join(name).to_string_lossy().into_owned()
    });
    let merged = here.join("merged");
    let merge = [
        "merge",
        &shards[0],
        &shards[1],
        "--out",
        &merged.to_string_lossy(),
    ];
    let done = run(&merge);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_same(&first, &files(&merged));
    assert_same(&first, &from(&config, "merged", &["--resume"]));
    assert_same(&first, &from(&config, "merged", &["--overwrite"]));

    // A damaged copy is found.
    let copy = merged.join(inputs[0]);
    fs::write(&copy, "0, 0, 0\n").expect("a writable file");
    let checked = run(&["check", &merged.to_string_lossy()]);
    assert_eq!(checked.code, Some(1), "{}", checked.stdout);
    let refused = run(&["generate", &merged.join("config.toml").to_string_lossy()]);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    assert!(refused.stderr.contains("checksum"), "{}", refused.stderr);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_plot_is_recorded_from_its_stem_map() {
    let here = folder("plot");
    fs::create_dir_all(&here).expect("a writable folder");
    let stems = here.join("stems.csv");
    let table = "x_m,y_m,species,dbh_cm,height_m\n500010,4000000,beech,31,24\n\
                 500013.5,4000004,beech,18,\n500016,3999999,beech,,\n";
    fs::write(&stems, table).expect("a writable folder");
    let plot = |out: &str, more: &[&str]| {
        let mut command = nemoral();
        command
            .arg("plot")
            .arg(&stems)
            .args(["--preset", "demo", "--out"])
            .arg(here.join(out));
        for setting in SMALL.iter().chain(&["frames=1"]) {
            command.args(["--set", setting]);
        }
        outcome(command.args(more))
    };
    let done = plot("out", &[]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let found = files(&here.join("out"));
    let trees = String::from_utf8_lossy(&found["sequences/00/trees.csv"]);
    for (place, dbh_m) in [
        ("0,0,", ",0.31,24,"),
        ("3.5,4,", ",0.18,"),
        ("6,-1,", ",0."),
    ] {
        let row = trees
            .lines()
            .find(|l| l.contains(&format!("beech,{place}")));
        let row = row.unwrap_or_else(|| panic!("no tree at {place} {trees}"));
        assert!(row.contains(dbh_m), "{row}");
    }
    assert!(
        found
            .keys()
            .any(|f| f.starts_with("inputs/") && f.ends_with("-stems.csv"))
    );

    let refused = plot("other", &["--terrain", "none.tif"]);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    assert!(refused.stderr.contains("none.tif"), "{}", refused.stderr);
    assert!(!here.join("other").exists());
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn an_inertial_unit_is_written_once() {
    let out = folder("imu").join("unit");
    let imu = |settings: &[&str]| {
        let mut command = nemoral();
        command.args([
            "imu",
            "--preset",
            "demo",
            "--set",
            "frames=3",
            "--sequences",
            "2",
        ]);
        for setting in settings {
            command.args(["--set", setting]);
        }
        outcome(command.args(["--sequence", "1", "--out"]).arg(&out))
    };
    let refused = imu(&["robot.stations.rows=2"]);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    assert!(
        refused.stderr.contains("robot.stations"),
        "{}",
        refused.stderr
    );
    assert!(!out.exists());
    let written = imu(&["imu.rate_hz=50"]);
    assert_eq!(written.code, Some(0), "{}", written.stderr);
    assert!(
        written.stdout.contains("102 samples in"),
        "{}",
        written.stdout
    );
    assert!(out.join("imu0/sensor.yaml").is_file());
    let again = imu(&[]);
    assert_eq!(again.code, Some(2), "{}", again.stderr);
    assert!(again.stderr.contains("empty"), "{}", again.stderr);
}
