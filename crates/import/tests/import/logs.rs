//! Logs of users: however they lie in their files, they are the same logs.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use nemoral_import::{ImportError, Model, ModelFiles, ModelKind};
use nemoral_scene::Semantic;
use nemoral_scene::glam::{DQuat, DVec3};
use proptest::prelude::*;

const LENGTH_M: f64 = 4.0;
const RADII_M: [f64; 2] = [0.25, 0.15];
const SIDES: usize = 24;

/// A truncated cone along x with its thick end at negative x, turned and moved, as OBJ with z up;
/// `underside` tells whether the quarter below is there.
fn log(turn: DQuat, shift: DVec3, underside: bool) -> Result<Model, ImportError> {
    let mut obj = "usemtl oak\n".to_owned();
    for ring in 0..=8 {
        let t = f64::from(ring) / 8.0;
        let radius = RADII_M[0] + t * (RADII_M[1] - RADII_M[0]);
        for side in 0..SIDES {
            let angle = TAU * side as f64 / SIDES as f64;
            let p = DVec3::new(
                LENGTH_M * (t - 0.5),
                radius * angle.cos(),
                radius * angle.sin(),
            );
            let p = turn * p + shift;
            writeln!(obj, "v {} {} {}", p.x, p.y, p.z).expect("memory");
        }
    }
    let vertex = |ring: usize, side: usize| ring * SIDES + side % SIDES + 1;
    for (ring, side) in (0..8).flat_map(|ring| (0..SIDES).map(move |side| (ring, side))) {
        let middle = TAU * (side as f64 + 0.5) / SIDES as f64;
        if !underside && (1.25 * PI..1.75 * PI).contains(&middle) {
            continue;
        }
        let [a, b] = [vertex(ring, side), vertex(ring, side + 1)];
        let [c, d] = [vertex(ring + 1, side + 1), vertex(ring + 1, side)];
        // Seen from outside counterclockwise: the other way round than y to z.
        writeln!(obj, "f {a} {d} {c} {b}").expect("memory");
    }
    let mut sidecar = |name: &str, _: u64| {
        Ok((name == "log.obj.toml").then(|| b"up = \"z\"\nmetres_per_unit = 1.0\n".to_vec()))
    };
    let files = ModelFiles::gather("log.obj", obj.into_bytes(), &mut sidecar)?;
    Model::read(&files, ModelKind::Log)
}

fn assert_is_the_log(model: &Model, tolerance: f64) {
    let measured = model.log.expect("a log");
    let near = |a: f64, b: f64| {
        assert!(
            (a / b - 1.0).abs() < tolerance,
            "{a}, not {b}: {measured:?}"
        )
    };
    near(measured.length_m, LENGTH_M);
    let [thick, thin] = RADII_M;
    let cone_m3 = PI / 3.0 * LENGTH_M * (thick * thick + thick * thin + thin * thin);
    near(measured.volume_m3, cone_m3);
    // Near the ends.
    let at = |share: f64| 2.0 * (thick + share * (thin - thick));
    near(measured.diameter_m[0], at(0.06));
    near(measured.diameter_m[1], at(0.94));
    near(2.0 * measured.half_height_m[0], at(0.06));
    near(2.0 * measured.half_height_m[1], at(0.94));
    let xs = || model.mesh.positions.iter().map(|p| p.x);
    let (low, high) = (xs().fold(9.0, f32::min), xs().fold(-9.0, f32::max));
    assert!((low + high).abs() < 1e-3 && high > 1.9, "{low} {high}");
    let widest = |p: fn(f32) -> bool| {
        let radii = model.mesh.positions.iter().filter(|v| p(v.x));
        radii.map(|v| v.y.hypot(v.z)).fold(0.0, f32::max)
    };
    assert!(widest(|x| x < 0.0) > widest(|x| x > 1.0) + 0.03);
    assert!(model.materials.iter().all(|m| m.semantic == Semantic::Log));
}

#[test]
fn a_log_that_stands_is_laid_down() {
    let up = DQuat::from_rotation_y(-PI / 2.0);
    let standing = log(up, DVec3::new(5.0, 3.0, 2.0), true).expect("a log");
    assert_is_the_log(&standing, 0.03);
    assert!(
        standing.notes.iter().any(|n| n.contains("stands")),
        "{:?}",
        standing.notes
    );
    let lying = log(DQuat::IDENTITY, DVec3::ZERO, true).expect("a log");
    assert!(!lying.notes.iter().any(|n| n.contains("stands")));
}

#[test]
fn a_scanned_log_may_lack_its_underside() {
    let open = log(DQuat::IDENTITY, DVec3::ZERO, false).expect("a log");
    let measured = open.log.expect("a log");
    // What is seen is a little less high than it was.
    assert!(
        (0.42..0.52).contains(&measured.diameter_m[0]),
        "{measured:?}"
    );
    assert!((0.35..0.75).contains(&measured.volume_m3), "{measured:?}");
}

#[test]
fn what_is_as_wide_as_long_is_no_log() {
    let mut cube = "usemtl x\n".to_owned();
    for i in 0..8 {
        writeln!(cube, "v {} {} {}", i & 1, i >> 1 & 1, i >> 2).expect("memory");
    }
    cube += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let files = ModelFiles::single("cube.obj", cube.into_bytes());
    let refused = Model::read(&files, ModelKind::Log)
        .expect_err("a cube")
        .to_string();
    assert!(refused.contains("1.5 times as long as wide"), "{refused}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Whichever way it points, and wherever it is.
    #[test]
    fn logs_are_the_same_however_they_lie(
        yaw in 0.0..TAU, pitch in -1.2..1.2_f64, roll in 0.0..TAU, x in -90.0..90.0, z in -9.0..9.0,
    ) {
        let turn = DQuat::from_rotation_z(yaw)
            * DQuat::from_rotation_y(pitch)
            * DQuat::from_rotation_x(roll);
        assert_is_the_log(&log(turn, DVec3::new(x, 0.5 * x, z), true).expect("a log"), 0.03);
    }
}
