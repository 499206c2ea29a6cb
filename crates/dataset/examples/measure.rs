//! Writes frames of 1280 × 720 pixels and 50,000 points that are as busy as foliage, and prints how
//! long each file took and how large it is: `cargo run --release --example measure -- OUT`.

#![allow(clippy::print_stdout, reason = "a measurement prints")]

use std::path::Path;
use std::time::Instant;

use nemoral_dataset::{
    CameraData, CameraSpec, DatasetHeader, FrameData, LidarData, LidarSpec, OpenMode, SequenceSpec,
    Track, WorldTables, Writer,
};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{
    AnnotationKinds, Annotations, ChunkCoord, Image, Intrinsics, LidarPoint, ObjectId, Ontology,
    PointFlags, RigidTransform, Semantic, Shutter, TruthImages, Twist,
};
use nemoral_seed::{Domain, Draw, Key};

const W: usize = 1280;
const H: usize = 720;

#[derive(Clone, Copy)]
struct Pixel {
    semantic: Semantic,
    object: ObjectId,
    depth_m: f32,
    normal: Vec3,
    colour: Vec3,
}

/// Ground, trunks as columns, and some 60,000 leaves as discs, far ones first.
fn picture() -> Image<Pixel> {
    let mut rng = Key::world(1).domain(Domain::new("dataset.measure")).rng();
    let sky = Pixel {
        semantic: Semantic::Sky,
        object: ObjectId::NONE,
        depth_m: 0.0,
        normal: Vec3::ZERO,
        colour: Vec3::new(0.7, 0.8, 0.95),
    };
    let mut pixels = vec![sky; W * H];
    let object = |i: u32| {
        ObjectId::new(
            ChunkCoord::new((i % 5) as i32, (i / 40) as i32),
            1 + i as u16,
        )
    };
    for y in H / 2 + 20..H {
        let depth_m = 1.6 * 800.0 / (y - H / 2) as f32;
        for p in &mut pixels[y * W..][..W] {
            let bump =
                Vec3::new(rng.unit_f32() - 0.5, -3.0, rng.unit_f32() - 0.5).normalize_or_zero();
            *p = Pixel {
                semantic: if rng.chance(0.1) {
                    Semantic::Grass
                } else {
                    Semantic::Litter
                },
                object: ObjectId::NONE,
                depth_m,
                normal: bump,
                colour: Vec3::new(0.35, 0.25, 0.15) * (0.6 + 0.6 * rng.unit_f32()),
            };
        }
    }
    for tree in 0..150_u32 {
        let depth_m = 80.0 - 0.5 * tree as f32;
        let half = (160.0 / depth_m) as i32 + 1;
        let (x0, foot) = (
            rng.below(W as u32) as i32,
            H / 2 + (1280.0 / depth_m) as usize,
        );
        for (y, dx) in (0..foot.min(H)).flat_map(|y| (-half..=half).map(move |dx| (y, dx))) {
            let x = x0 + dx;
            if (0..W as i32).contains(&x) {
                let s = dx as f32 / (half + 1) as f32;
                pixels[y * W + x as usize] = Pixel {
                    semantic: Semantic::Stem,
                    object: object(tree).expect("in range"),
                    depth_m: depth_m - 0.2 * (1.0 - s * s).sqrt(),
                    normal: Vec3::new(s, 0.0, -(1.0 - s * s).sqrt()),
                    colour: Vec3::new(0.4, 0.33, 0.28) * (0.5 + 0.5 * rng.unit_f32()),
                };
            }
        }
        for _ in 0..400 {
            let (cx, cy) = (
                x0 + rng.below(400) as i32 - 200,
                rng.below(H as u32 * 2 / 3) as i32,
            );
            let r = 1 + (60.0 / depth_m) as i32;
            let facing = Vec3::new(rng.unit_f32() - 0.5, rng.unit_f32() - 0.5, -rng.unit_f32());
            let z = depth_m + 3.0 * rng.unit_f32();
            for (dy, dx) in (-r..=r).flat_map(|dy| (-r..=r).map(move |dx| (dy, dx))) {
                let (x, y) = (cx + dx, cy + dy);
                let inside = (0..W as i32).contains(&x) && (0..H as i32).contains(&y);
                if inside && dx * dx + dy * dy <= r * r && rng.chance(0.8) {
                    pixels[y as usize * W + x as usize] = Pixel {
                        semantic: Semantic::Leaf,
                        object: object(tree).expect("in range"),
                        depth_m: z + 0.01 * dx as f32,
                        normal: facing.normalize_or_zero(),
                        colour: Vec3::new(0.2, 0.45, 0.12) * (0.4 + 0.8 * rng.unit_f32()),
                    };
                }
            }
        }
    }
    Image::new(W, H, pixels)
}

fn points() -> Vec<LidarPoint> {
    let mut rng = Key::world(2).domain(Domain::new("dataset.measure")).rng();
    (0..50_000)
        .map(|pulse| LidarPoint {
            position_m: Vec3::new(rng.unit_f32(), rng.unit_f32(), rng.unit_f32()) * 40.0,
            true_range_m: 40.0 * rng.unit_f32(),
            range_m: 40.0 * rng.unit_f32(),
            intensity: rng.unit_f32(),
            reflectivity: rng.below(150) as u8,
            semantic: Semantic::Leaf,
            object: ObjectId::new(ChunkCoord::new(0, 0), 1 + rng.below(999) as u16)
                .expect("in range"),
            ring: (pulse % 6) as u8,
            return_number: 1,
            returns: 1,
            time_ns: 2000 * i64::from(pulse),
            pulse,
            incidence_cos: rng.unit_f32(),
            normal: Vec3::X,
            flags: PointFlags(0),
        })
        .collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::env::args().nth(1).ok_or("usage: measure OUT")?;
    let all = picture();
    let truth = TruthImages {
        semantic: all.map(|p| p.semantic),
        object: all.map(|p| p.object),
        depth_m: all.map(|p| p.depth_m),
        normal: all.map(|p| p.normal),
    };
    let rgb = all.map(|p| (p.colour * 255.0).to_array().map(|c| c as u8));
    let points = points();
    let mut header = DatasetHeader::new("measure", "0", 1, Ontology::paper());
    header.sequences[0] = SequenceSpec {
        cameras: vec![CameraSpec {
            name: "front".into(),
            intrinsics: Intrinsics::from_fov(W as u32, H as u32, 1.4)?,
            body_from_camera: RigidTransform::body_from_optical(),
            annotations: AnnotationKinds::default(),
            shutter: Shutter::INSTANT,
            noisy: false,
            processed: false,
        }],
        lidars: vec![LidarSpec {
            name: "top".into(),
            body_from_lidar: RigidTransform::IDENTITY,
            deskewed: true,
            pointing_errors: false,
            ply: true,
        }],
        ..SequenceSpec::new(0, 1)
    };
    let writer = Writer::create(Path::new(&out), OpenMode::Overwrite, header)?;
    let extra = Annotations::default();
    let frame = |index| FrameData {
        sequence: 0,
        index,
        time_s: 0.0,
        world_from_body: RigidTransform::IDENTITY,
        body_motion: Twist::STILL,
        balance: None,
        cameras: vec![CameraData {
            name: "front",
            rgb: &rgb,
            radiance: None,
            truth: &truth,
            annotations: &extra,
        }],
        lidars: vec![LidarData {
            name: "top",
            points: &points,
            sensor_chunk: ChunkCoord::new(0, 0),
        }],
        frame_key: [0; 32],
    };
    let mut last = None;
    for index in 0..5 {
        let start = Instant::now();
        last = Some(writer.write_frame(&frame(index))?);
        println!(
            "frame {index}: {:.0} ms",
            1e3 * start.elapsed().as_secs_f64()
        );
    }
    for f in last.iter().flat_map(|r| &r.files) {
        println!("{:>10} bytes  {}", f.bytes, f.path);
    }
    let start = Instant::now();
    let present = writer.has_frame(0, 0, &[0; 32]);
    println!(
        "has_frame {present}: {:.0} ms",
        1e3 * start.elapsed().as_secs_f64()
    );
    let poses = vec![(0.0, RigidTransform::IDENTITY); 5];
    writer.write_sequence(
        &Track {
            sequence: 0,
            poses,
            balance: None,
            stands: false,
            estimated: Vec::new(),
            lines: Vec::new(),
            imu: None,
        },
        &WorldTables::default(),
    )?;
    writer.finish()?;
    Ok(())
}
