//! What holds for any input.

use nemoral_dataset::{CameraSpec, Dataset, FrameData, OpenMode, Writer};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{
    AnnotationKinds, Annotations, ChunkCoord, Image, Intrinsics, LidarPoint, ObjectId, PointFlags,
    RigidTransform, Semantic, Shutter, TruthImages, Twist,
};
use proptest::prelude::*;

use crate::common::{finish, see, small, tree, write};

fn semantic() -> impl Strategy<Value = Semantic> {
    (0..Semantic::ALL.len()).prop_map(|i| Semantic::ALL[i])
}

fn object() -> impl Strategy<Value = ObjectId> {
    let some = (-2_097_151..=2_097_151, -2_097_151..=2_097_151, 1_u16..)
        .prop_map(|(x, y, item)| ObjectId::new(ChunkCoord::new(x, y), item).expect("in range"));
    prop_oneof![Just(ObjectId::NONE), some]
}

fn vector() -> impl Strategy<Value = Vec3> {
    let number = || prop::num::f32::NORMAL | prop::num::f32::ZERO;
    (number(), number(), number()).prop_map(Vec3::from)
}

fn point() -> impl Strategy<Value = LidarPoint> {
    let bytes = (
        any::<u8>(),
        any::<u8>(),
        any::<u8>(),
        any::<u8>(),
        any::<u8>(),
    );
    let what = (vector(), vector(), vector(), semantic(), object());
    (
        what,
        bytes,
        -(1_i64 << 50) + 1..1_i64 << 50,
        0..=i32::MAX as u32,
        prop::num::f32::NORMAL,
    )
        .prop_map(
            |((position_m, normal, v, semantic, object), b, time_ns, pulse, incidence_cos)| {
                LidarPoint {
                    position_m,
                    true_range_m: v.x,
                    range_m: v.y,
                    intensity: v.z,
                    reflectivity: b.0,
                    semantic,
                    object,
                    ring: b.1,
                    return_number: b.2,
                    returns: b.3,
                    time_ns,
                    pulse,
                    incidence_cos,
                    normal,
                    flags: PointFlags(b.4),
                }
            },
        )
}

type Pixel = (Semantic, ObjectId, f32, Vec3, [u8; 3]);

fn pixels() -> impl Strategy<Value = (u32, u32, Vec<Pixel>)> {
    (1_u32..20, 1_u32..20).prop_flat_map(|(w, h)| {
        let pixel = (
            semantic(),
            object(),
            0.0_f32..300.0,
            vector(),
            any::<[u8; 3]>(),
        );
        let count = (w * h) as usize;
        (Just(w), Just(h), prop::collection::vec(pixel, count))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_frame_comes_back(
        points in prop::collection::vec(point(), 0..40),
        (w, h, pixels) in pixels(),
        index in 0_u64..3_000_000,
        cx in -99..99,
        cy in -99..99,
    ) {
        let dir = tempfile::tempdir().expect("a folder");
        let mut header = small();
        header.sequences[0].cameras = vec![CameraSpec {
            name: "front".to_owned(),
            intrinsics: Intrinsics::from_fov(w, h, 1.0).expect("valid"),
            body_from_camera: RigidTransform::body_from_optical(),
            annotations: AnnotationKinds::default(),
            shutter: Shutter::INSTANT,
            noisy: false,
            processed: false,
        }];
        header.sequences[0].number = 3;
        let all = Image::new(w as usize, h as usize, pixels);
        let truth = TruthImages {
            semantic: all.map(|p| p.0),
            object: all.map(|p| p.1),
            depth_m: all.map(|p| p.2),
            normal: all.map(|p| p.3.normalize_or_zero()),
        };
        let rgb = all.map(|p| p.4);
        let chunk = ChunkCoord::new(cx, cy);
        let annotations = Annotations::default();
        let frame = FrameData {
            sequence: 3,
            index,
            time_s: 0.1,
            world_from_body: RigidTransform::IDENTITY,
            body_motion: Twist::STILL,
            balance: None,
            cameras: vec![nemoral_dataset::CameraData {
                name: "front",
                rgb: &rgb,
                radiance: None,
                truth: &truth,
                annotations: &annotations,
            }],
            lidars: vec![nemoral_dataset::LidarData {
                name: "top",
                points: &points,
                sensor_chunk: chunk,
            }],
            frame_key: [7; 32],
        };
        let writer = Writer::create(dir.path(), OpenMode::Fresh, header.clone()).expect("create");
        let record = writer.write_frame(&frame).expect("frame");
        prop_assert!(writer.has_frame(3, index, &[7; 32]));
        prop_assert_eq!(record.files.len(), 8);
        let at = |folder: &str, e: &str| {
            dir.path()
                .join(format!("sequences/03/{folder}/{index:06}.{e}"))
        };
        let semantic = image::open(at("semantic", "png"))
            .expect("image")
            .into_rgb8();
        for (p, c) in all.pixels().iter().zip(semantic.pixels()) {
            prop_assert_eq!(header.ontology.class(p.0).colour, c.0);
        }
        let label = std::fs::read(at("labels", "label")).expect("label");
        for (p, l) in points.iter().zip(label.chunks(4)) {
            let class = header.ontology.class(p.semantic).id;
            let [i0, i1] = p.object.to_label_id(chunk).to_le_bytes();
            prop_assert_eq!(l, [class, 0, i0, i1]);
        }
    }

    #[test]
    fn any_points_come_back_through_the_reader(points in prop::collection::vec(point(), 0..200)) {
        let dir = tempfile::tempdir().expect("a folder");
        let mut header = small();
        header.sequences[0].cameras.clear();
        let writer = Writer::create(dir.path(), OpenMode::Fresh, header.clone()).expect("create");
        let mut seen = see(&header, 0);
        seen.points = vec![points];
        writer.write_frame(&seen.data(&header)).expect("frame");
        finish(writer, 1);
        let frame = Dataset::open(dir.path())
            .expect("open")
            .read_frame(0)
            .expect("frame");
        let back: Vec<LidarPoint> = frame.lidars[0].ply.iter().map(|p| p.point).collect();
        prop_assert_eq!(&back, &seen.points[0]);
    }
}

#[test]
fn threads_and_order_do_not_change_a_byte() {
    let dir = tempfile::tempdir().expect("a folder");
    let (one, many) = (dir.path().join("one"), dir.path().join("many"));
    let header = small();
    write(&one, &header, &[0, 1, 2, 3]);
    let writer = Writer::create(&many, OpenMode::Fresh, header.clone()).expect("create");
    std::thread::scope(|scope| {
        for k in [3, 1, 2, 0] {
            let (writer, header) = (&writer, &header);
            scope.spawn(move || {
                writer
                    .write_frame(&see(header, k).data(header))
                    .expect("frame");
            });
        }
    });
    finish(writer, 4);
    assert!(tree(&one) == tree(&many));
}
