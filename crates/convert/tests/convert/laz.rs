//! LAZ, unpacked by the crate `laz`, with header and points read by the specification's offsets.

use std::collections::{BTreeMap, BTreeSet};

use nemoral_convert::FormatName;
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

use crate::common::{Drive, Made, header, made, made_of, made_of_drives, pose, text, with_lidars};
use crate::las::{LasFile, f64_at, u16_at, u64_at};

/// The frames that [`made`] makes.
const FRAMES: [u64; 3] = [1, 2, 4];

fn file(made: &Made, lidar: &str, frame: u64) -> LasFile {
    LasFile::read(&made.out.join(format!("00/{lidar}/{frame:06}.laz")))
}

/// The row of each object in `trees.csv`, from 1.
fn rows(made: &Made) -> BTreeMap<[i32; 3], u32> {
    let table = text(made.dataset.root().join("sequences/00/trees.csv"));
    let mut lines = table.lines();
    let columns: Vec<&str> = lines.next().expect("columns").split(',').collect();
    assert_eq!(columns[1..4], ["chunk_x", "chunk_y", "item"]);
    let key = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        [1, 2, 3].map(|i| fields[i].parse().expect("a number"))
    };
    lines.map(key).zip(1..).collect()
}

#[test]
fn points_are_in_the_world_and_nothing_that_is_known_is_lost() {
    let made = made(FormatName::Laz);
    let (lidar, rows) = (&header().sequences[0].lidars[0], rows(&made));
    let mut of_trees = 0;
    for (i, frame) in FRAMES.into_iter().enumerate() {
        let file = file(&made, "top", frame);
        let bytes = &file.bytes;
        assert_eq!(&bytes[..4], b"LASF");
        assert_eq!((bytes[24], bytes[25], u16_at(bytes, 94)), (1, 4, 375));
        assert_eq!(bytes[104] & 0x3F, 6);

        let scan = &made.dataset.read_frame(i).expect("a frame").lidars[0].ply;
        assert_eq!(scan.len(), file.points().len());
        let (time_s, world_from_body) = pose(frame);
        let world_from_lidar = world_from_body * lidar.body_from_lidar;
        let (mut low, mut high, mut first) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0);
        for (found, p) in file.points().zip(scan) {
            let at_m = found.position_m();
            let expected_m = world_from_lidar.transform_point(p.point.position_m.as_dvec3());
            let off_m = (at_m - expected_m).abs().max_element();
            assert!(off_m <= 0.51e-4, "{at_m} {expected_m}");
            (low, high) = (low.min(at_m), high.max(at_m));
            let intensity = f32::from(found.intensity()) / 65535.0;
            assert!((intensity - p.point.intensity).abs() < 1e-5);
            let returns = (p.point.return_number, p.point.returns);
            assert_eq!(found.returns(), returns);
            first += u64::from(p.point.return_number == 1);
            // Background, Terrain, Traversable, Trunks, Canopy, Shrubs, Herbaceous, Rocks.
            let asprs = [7, 2, 2, 5, 5, 4, 3, 1][usize::from(p.class)];
            assert_eq!((found.class(), found.source()), (asprs, 1));
            assert_eq!((found.channel(), found.user_data()), ((0, 0, 0), 1));
            let down = (at_m - world_from_lidar.translation_m)
                .normalize()
                .dot(-DVec3::Z);
            assert!((found.angle_deg().abs().to_radians().cos() - down).abs() < 1e-4);
            // What is fired together is a nanosecond apart, and the sequence starts at 1 s.
            let time_ns = p.point.time_ns + i64::from(p.point.ring);
            let time = 1.0 + time_s + time_ns as f64 * 1e-9;
            assert!((found.time_s() - time).abs() < 1e-12);
            assert_eq!(found.u8("class"), p.class);
            assert_eq!(found.u8("semantic"), p.point.semantic as u8);
            let (ring, flags) = (found.u8("ring"), found.u8("flags"));
            assert_eq!((ring, flags), (p.point.ring, p.point.flags.0));
            let object = p.point.object;
            assert_eq!(found.u32("instance"), object.to_image_id());
            let chunk = [found.i32("chunk_x"), found.i32("chunk_y")];
            assert_eq!(chunk, [object.chunk().x, object.chunk().y]);
            let row = rows.get(&[chunk[0], chunk[1], object.item().into()]);
            assert_eq!(found.u32("treeID"), row.copied().unwrap_or(0));
            of_trees += u32::from(row.is_some());
            assert_eq!(found.u32("pulse"), p.point.pulse);
            assert_eq!(found.f32("range"), p.point.range_m);
            assert_eq!(found.f32("range_true"), p.point.true_range_m);
            assert_eq!(found.f32("incidence_cos"), p.point.incidence_cos);
        }
        assert_eq!(u64_at(bytes, 255), first);
        for axis in 0..3 {
            assert!((f64_at(bytes, 179 + 16 * axis) - high[axis]).abs() < 1e-8);
            assert!((f64_at(bytes, 187 + 16 * axis) - low[axis]).abs() < 1e-8);
        }
    }
    // The tree that is seen is not in the first row.
    assert!(of_trees > 0 && rows.len() == 2);
}

#[test]
fn extra_dimensions_say_what_they_are() {
    let made = made(FormatName::Laz);
    let file = file(&made, "top", 1);
    let all: BTreeMap<&str, &str> = file.descriptions().collect();
    let names = [
        "chunk_x",
        "chunk_y",
        "class",
        "flags",
        "incidence_cos",
        "instance",
        "pulse",
        "range",
        "range_true",
        "ring",
        "semantic",
        "treeID",
    ];
    assert!(all.keys().eq(&names), "{all:?}");
    assert!(all.values().all(|text| text.len() > 10), "{all:?}");
    assert_eq!(all["range_true"], "true range, m, 0: false alarm");
    assert_eq!(all["treeID"], "row of trees.csv, 0: no tree");
}

#[test]
fn pulses_of_equal_lidars_have_times_of_their_own() {
    let mount = header().sequences[0].lidars[0].body_from_lidar;
    let header = with_lidars(&[mount; 5]);
    let made = made_of(FormatName::Laz, &header);
    let (mut seen, mut count) = (BTreeSet::new(), 0);
    for frame in FRAMES {
        for (i, lidar) in (0_u8..).zip(&header.sequences[0].lidars) {
            let file = file(&made, &lidar.name, frame);
            for point in file.points() {
                assert_eq!(point.channel(), (0, i % 4, 0));
                assert_eq!(point.user_data(), i + 1);
                assert_eq!(point.source(), u16::from(i) + 1);
                // Many readers know no channels.
                seen.insert((point.time_s().to_bits(), point.returns().0));
                count += 1;
            }
        }
    }
    assert!(count > 0 && seen.len() == count, "{} {count}", seen.len());
}

#[test]
fn angles_are_by_the_side_of_the_body_however_a_lidar_is_mounted() {
    let usual = header().sequences[0].lidars[0].body_from_lidar;
    let turned = |yaw_deg: f64, roll_deg: f64| {
        let [yaw_rad, roll_rad] = [yaw_deg, roll_deg].map(f64::to_radians);
        RigidTransform::from_xyz_rpy(usual.translation_m, roll_rad, 0.0, yaw_rad)
    };
    let header = with_lidars(&[turned(180.0, 0.0), turned(90.0, 0.0), turned(0.0, 180.0)]);
    let made = made_of(FormatName::Laz, &header);
    let mut rolled = 0;
    for (i, lidar) in header.sequences[0].lidars.iter().enumerate() {
        let mut sides = [0; 2];
        for (k, frame) in FRAMES.into_iter().enumerate() {
            let file = file(&made, &lidar.name, frame);
            let world_from_body = pose(frame).1;
            let heading = world_from_body.transform_vector(DVec3::X);
            let left = DVec3::new(-heading.y, heading.x, 0.0);
            let scan = &made.dataset.read_frame(k).expect("a frame").lidars[i].ply;
            for (found, p) in file.points().zip(scan) {
                let in_body = p.point.position_m.as_dvec3();
                let in_body = lidar.body_from_lidar.transform_vector(in_body);
                let left_m = left.dot(world_from_body.transform_vector(in_body));
                let is_left = left_m > 1e-9;
                assert!(is_left || left_m < -1e-9);
                assert_eq!(found.angle_deg() < 0.0, is_left, "{} {in_body}", lidar.name);
                sides[usize::from(is_left)] += 1;
                rolled += u32::from(is_left != (in_body.y > 0.0));
            }
        }
        // One that looks aside sees one side.
        assert!(sides[0] + sides[1] > 100, "{} {sides:?}", lidar.name);
        assert!(i == 2 || (sides[0] > 9 && sides[1] > 9), "{sides:?}");
    }
    // Some are to the left of the body's own middle plane, which rolls, and right of nadir.
    assert!(rolled > 9, "{rolled}");
}

#[test]
fn times_of_a_scan_that_begins_before_its_sequence_are_not_negative() {
    let mut header = header();
    header.sequences[0].half_scan_s = Some(29.999_95);
    let drive = Drive {
        later_s: -pose(0).0,
        ..Drive::of(0, &[0, 1])
    };
    let made = made_of_drives(FormatName::Laz, &header, &[drive]);
    let spec = &made.dataset.manifest().header.sequences[0];
    assert_eq!(spec.las_time_shift_s(), 30.0);
    let scan = &made.dataset.read_frame(0).expect("a frame").lidars[0].ply;
    let mut earlier = 0;
    for (found, p) in file(&made, "top", 0).points().zip(scan) {
        let fired_ns = p.point.time_ns + i64::from(p.point.ring);
        assert!((found.time_s() - 30.0 - fired_ns as f64 * 1e-9).abs() < 1e-11);
        earlier += u32::from(fired_ns < 0);
    }
    assert!(earlier > 9);
}
