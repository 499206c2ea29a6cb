//! What a camera writes on request: it comes back, and check finds lies in it.

use std::fs;

use nemoral_dataset::{OpenMode, Writer};
use nemoral_scene::{AnnotationKinds, Intrinsics};

use crate::common::{see, small, write};

#[test]
fn further_truth_comes_back_and_lies_are_found() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut header = small();
    header.sequences[0].cameras[0].intrinsics = Intrinsics::from_fov(96, 72, 1.3).expect("valid");
    header.sequences[0].cameras[0].annotations = AnnotationKinds {
        sky: true,
        flow: true,
        trunks: true,
        boxes: true,
        radiance: true,
    };
    let dataset = write(&dir.path().join("sound"), &header, &[0, 1]);
    let (seen, frame) = (see(&header, 0), dataset.read_frame(0).expect("frame"));
    let (camera, annotations) = (&frame.cameras[0], &seen.annotations[0]);
    let sky = camera.sky.as_ref().expect("asked for");
    assert_eq!(
        *sky,
        seen.truth[0]
            .depth_m
            .map(|&z| if z == 0.0 { 255 } else { 0 })
    );
    let trunks = annotations
        .trunks
        .as_ref()
        .map(|t| t.map(|o| o.to_image_id()));
    assert_eq!(camera.trunks, trunks);
    let (found, made) = (camera.flow.as_ref(), annotations.flow.as_ref());
    let pairs = found.expect("asked for").pixels().iter();
    let mut hidden = 0;
    for (a, b) in pairs.zip(made.expect("made").pixels()) {
        assert_eq!(a.map(|f| f.seen), b.map(|f| f.seen));
        if let (Some(a), Some(b)) = (a, b) {
            assert!((a.offset_px - b.offset_px).abs().max_element() < 0.01);
            hidden += usize::from(!a.seen);
        }
    }
    assert!(hidden > 50);
    let (found, made) = (camera.boxes.as_ref(), annotations.boxes.as_ref());
    let (found, made) = (found.expect("asked for"), made.expect("made"));
    assert_eq!(found.len(), made.len());
    for (a, b) in found.iter().zip(made) {
        assert_eq!(
            (a.object, a.kind, a.visible, a.whole),
            (b.object, b.kind, b.visible, b.whole)
        );
        assert_eq!((a.visible_px, a.whole_px), (b.visible_px, b.whole_px));
        assert!(a.centre_m.distance(b.centre_m) < 1e-3);
    }
    assert!(found.iter().any(|b| b.visible_fraction() < 0.9));
    assert_eq!(camera.radiance.as_ref(), Some(&seen.radiance[0]));
    let report = nemoral_dataset::check(dataset.root()).expect("check");
    assert!(report.passed(), "{report}");

    // False values, each of which must be found in its file.
    let lie = |name: &str, change: &dyn Fn(&mut nemoral_scene::Annotations)| {
        let out = dir.path().join(name);
        let writer = Writer::create(&out, OpenMode::Fresh, header.clone()).expect("create");
        let mut seen = see(&header, 0);
        change(&mut seen.annotations[0]);
        writer.write_frame(&seen.data(&header)).expect("frame");
        crate::common::finish(writer, 4);
        let report = nemoral_dataset::check(&out).expect("check").to_string();
        assert!(
            report.contains(&format!("problem: sequences/00/{name}/000000")),
            "{report}"
        );
    };
    lie("flow", &|e| {
        let flow = e.flow.take().expect("made");
        e.flow = Some(flow.map(|f| {
            f.map(|mut f| {
                f.offset_px.x += 0.5;
                f
            })
        }));
    });
    lie("trunks", &|e| {
        let trunks = e.trunks.take().expect("made");
        let mut pixels = trunks.pixels().to_vec();
        pixels.rotate_right(1);
        e.trunks = Some(nemoral_scene::Image::new(96, 72, pixels));
    });
    lie("boxes", &|e| {
        let boxes = e.boxes.as_mut().expect("made");
        let seen = boxes.iter_mut().find(|b| b.visible_px > 1);
        seen.expect("some").visible_px -= 1;
    });
    let at = dataset.root().join("sequences/00/sky");
    fs::copy(at.join("000001.png"), at.join("000000.png")).expect("copy");
    crate::common::reseal(dataset.root(), "sequences/00/sky/000000.png");
    let report = nemoral_dataset::check(dataset.root())
        .expect("check")
        .to_string();
    assert!(report.contains("contradict the depth image"), "{report}");

    // A picture that does not follow its light, and light that is negative.
    for (name, change) in [("a lower one", 0.5_f32), ("below 0", -1.0)] {
        let out = dir.path().join(name);
        let writer = Writer::create(&out, OpenMode::Fresh, header.clone()).expect("create");
        let mut seen = see(&header, 0);
        let mut light = seen.radiance[0].clone().into_pixels();
        let lit = light.iter().position(|c| c.y > 100.0).expect("some");
        light[lit].y *= change;
        seen.radiance[0] = nemoral_scene::Image::new(96, 72, light);
        writer.write_frame(&seen.data(&header)).expect("frame");
        crate::common::finish(writer, 4);
        let report = nemoral_dataset::check(&out).expect("check").to_string();
        let file = "problem: sequences/00/radiance/000000.exr";
        assert!(report.contains(file) && report.contains(name), "{report}");
    }

    // What the header asks for must be given.
    let writer = Writer::create(&dir.path().join("less"), OpenMode::Fresh, header.clone());
    let mut seen = see(&header, 0);
    seen.annotations[0].flow = None;
    let e = writer.expect("create").write_frame(&seen.data(&header));
    assert!(e.expect_err("refused").to_string().contains("front.flow"));
}
