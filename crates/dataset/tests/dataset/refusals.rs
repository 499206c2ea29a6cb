//! Headers and frames that cannot be written are refused, at the beginning.

use nemoral_dataset::{FrameData, OpenMode, Writer};

use crate::common::{see, small};

#[test]
fn impossible_headers_and_frames_are_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("x");
    let refused = |change: &dyn Fn(&mut nemoral_dataset::DatasetHeader)| {
        let mut header = small();
        change(&mut header);
        Writer::create(&out, OpenMode::Fresh, header)
            .expect_err("refused")
            .to_string()
    };
    assert!(refused(&|h| h.sequences[0].cameras[0].name = "../x".to_owned()).contains("'../x'"));
    assert!(
        refused(&|h| h.sequences[0].cameras[0].name = "velodyne".to_owned()).contains("velodyne")
    );
    assert!(refused(&|h| h.sequences[0].lidars[0].name = "front".to_owned()).contains("unique"));
    assert!(refused(&|h| h.sequences[0].chunk_size_m = f64::NAN).contains("chunk_size_m"));
    let long = "#".repeat((4 << 20) + 1);
    for told in [
        refused(&|h| h.config_toml = long.clone()),
        refused(&|h| h.sequences[0].config_toml = long.clone()),
    ] {
        assert!(told.contains("config.toml = 4194305: must be"), "{told}");
    }
    assert!(
        refused(&|h| h.sequences[0].lidars[0].body_from_lidar.translation_m.x = f64::NAN)
            .contains("top.mount")
    );
    assert!(
        refused(&|h| {
            h.sequences[0].lidars.clear();
            h.sequences[0].cameras.clear();
        })
        .contains("at least one")
    );
    assert!(!out.exists());

    let header = small();
    let writer = Writer::create(&out, OpenMode::Fresh, header.clone()).expect("create");
    let seen = see(&crate::common::header(), 0);
    let e = writer.write_frame(&seen.data(&header)).expect_err("size");
    assert!(
        e.to_string()
            .contains("frame 0.front.rgb = 320 × 240: must be 32 × 24"),
        "{e}"
    );
    let seen = see(&header, 0);
    let mut frame = seen.data(&header);
    frame.lidars.clear();
    assert!(
        writer
            .write_frame(&frame)
            .expect_err("no scan")
            .to_string()
            .contains("lidars")
    );
    // What could not be listed at the end is refused at the beginning.
    type Lie<'a> = (&'a str, &'a dyn Fn(&mut FrameData<'_>));
    let lies: [Lie<'_>; 5] = [
        ("time_s = 1700000000000000000: ", &|f| f.time_s = 1.7e18),
        ("time_s = NaN: ", &|f| f.time_s = f64::NAN),
        ("world_from_body", &|f| {
            f.world_from_body.translation_m.x = 1.7e18
        }),
        ("body_motion", &|f| {
            f.body_motion.linear_m_s.y = f64::INFINITY
        }),
        ("must be less than 10000000", &|f| f.index = 10_000_000),
    ];
    for (told, lie) in lies {
        let mut frame = seen.data(&header);
        lie(&mut frame);
        let e = writer.write_frame(&frame).expect_err(told).to_string();
        assert!(e.contains(told), "{e}");
    }
    assert!(writer.frames().is_empty() && !out.join("sequences").exists());
    let mut frame = seen.data(&header);
    frame.world_from_body.translation_m.x += 1.0;
    writer.write_frame(&frame).expect("written");
    let world = nemoral_dataset::WorldTables::default();
    let e = writer
        .write_sequence(&crate::common::track(4), &world)
        .expect_err("another pose");
    assert!(e.to_string().contains("pose of frame 0"), "{e}");
}
