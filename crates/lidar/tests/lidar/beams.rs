//! Wide beams and several returns, on walls with known answers.

use nemoral_lidar::{
    Beam, EchoObservation, ExactRange, PulseErrors, ReturnMode, ScanRequest, Scanner, ScannerParams,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{LidarPoint, Material, MaterialLibrary, PointFlags, RigidTransform, Semantic};
use nemoral_seed::Key;

use crate::walls::{KEY, Step, ahead, materials, params, scan_with, wide};

#[test]
fn a_wide_beam_on_a_wall_is_a_thin_one() {
    let wall = Step {
        near: 8.0,
        far: 8.0,
    };
    let thin = scan_with(params(Beam::default(), ReturnMode::Strongest), &wall);
    let beam = Beam {
        horizontal_fwhm_rad: 0.001,
        vertical_fwhm_rad: 0.001,
        ..wide()
    };
    let wide = scan_with(params(beam, ReturnMode::Strongest), &wall);
    let mut compared = 0;
    // At y = 0 one of the two walls ends and the other begins.
    for a in thin.iter().filter(|p| p.position_m.y.abs() > 0.05) {
        let i = wide
            .binary_search_by_key(&a.pulse, |p| p.pulse)
            .expect("comes back");
        let b = &wide[i];
        assert!(
            (a.range_m - b.range_m).abs() < 2e-4 * a.range_m,
            "{a:?} {b:?}"
        );
        assert!((a.intensity - b.intensity).abs() < 1e-3);
        assert!(!b.flags.has(PointFlags::MIXED));
        compared += 1;
    }
    assert!(compared > 5000, "{compared}");
}

#[test]
fn near_edges_mix_and_far_ones_give_two_returns() {
    for (far, apart) in [(8.4, false), (12.0, true)] {
        let points = scan_with(params(wide(), ReturnMode::All(5)), &Step { near: 8.0, far });
        let (mut mixed, mut double) = (0, 0);
        for p in &points {
            let x = p.position_m.x;
            let between = x > 8.01 && x < far - 0.01;
            if between {
                mixed += 1;
                assert!(p.flags.has(PointFlags::MIXED), "{p:?}");
                // The label is that of the surface that gave most of the light, so the range is
                // nearer to it. Sub-rays to the sides of a pulse are a little longer.
                let nearer = if p.semantic == Semantic::Leaf {
                    8.0
                } else {
                    far
                };
                assert!(
                    (x - nearer).abs() < 0.5 * (far - 8.0) + 0.01,
                    "{x} {:?}",
                    p.semantic
                );
            }
            // Points without mixing lie on the surface of their label.
            let wall = if p.position_m.y > 0.0 {
                Semantic::Leaf
            } else {
                Semantic::Stem
            };
            let there = !between && p.semantic == wall;
            assert!(there || p.flags.has(PointFlags::MIXED), "{p:?}");
            if p.returns == 2 {
                double += 1;
                assert_eq!(p.return_number == 1, p.semantic == Semantic::Leaf);
            }
            assert!((1..=p.returns).contains(&p.return_number));
        }
        if apart {
            assert!(mixed == 0 && double > 200, "{double}");
        } else {
            assert!(mixed > 100 && double == 0, "{mixed}");
        }
    }
}

/// Light is conserved: the two returns of a split pulse sum to the whole.
#[test]
fn a_split_pulse_shares_out_its_light() {
    let points = scan_with(
        params(wide(), ReturnMode::All(5)),
        &Step {
            near: 8.0,
            far: 12.0,
        },
    );
    let mut pairs = 0;
    for pair in points.windows(2).filter(|w| w[0].pulse == w[1].pulse) {
        let sum = pair[0].intensity + pair[1].intensity;
        assert!((sum - 0.5 * pair[0].incidence_cos).abs() < 0.02, "{pair:?}");
        pairs += 1;
    }
    assert!(pairs > 100, "{pairs}");
}

#[test]
fn every_mode_gives_a_part_of_all() {
    let step = Step {
        near: 8.0,
        far: 12.0,
    };
    let all = scan_with(params(wide(), ReturnMode::All(15)), &step);
    for (mode, most) in [
        (ReturnMode::Strongest, 1),
        (ReturnMode::First, 1),
        (ReturnMode::Last, 1),
        (ReturnMode::Dual, 2),
    ] {
        let some = scan_with(params(wide(), mode), &step);
        for p in &some {
            assert!(p.returns <= most);
            assert!(
                all.iter()
                    .any(|q| q.pulse == p.pulse && q.range_m == p.range_m)
            );
        }
        let pulses = |list: &[LidarPoint]| {
            let mut pulses: Vec<u32> = list.iter().map(|p| p.pulse).collect();
            pulses.dedup();
            pulses
        };
        assert_eq!(pulses(&some), pulses(&all));
    }
}

/// An echo that is not seen is not counted, and the strongest of those seen is reported.
#[test]
fn a_weak_echo_gives_way() {
    let deaf_to_near = |o: &EchoObservation, _: Key| (o.range_m > 10.0).then_some(o.range_m);
    let scanner =
        Scanner::new(params(wide(), ReturnMode::Strongest), Box::new(ahead())).expect("valid");
    let still = |_: f64| RigidTransform::IDENTITY;
    let step = Step {
        near: 8.0,
        far: 12.0,
    };
    let points = scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster: &step,
        materials: &materials(),
        scene_from_lidar_at: &still,
        range_model: &deaf_to_near,
        key: KEY,
    });
    assert!(points.len() > 1000);
    assert!(points.iter().all(|p| p.semantic == Semantic::Stem && p.returns == 1
        || p.position_m.length() > 10.0));
}

#[test]
fn raw_points_are_where_the_moving_sensor_saw_them() {
    let drive =
        |t: f64| RigidTransform::from_xyz_rpy(DVec3::new(5.0 * t, 0.0, 0.0), 0.0, 0.0, 2.0 * t);
    let scan = |deskew| {
        let p = ScannerParams {
            deskew,
            ..params(Beam::default(), ReturnMode::Strongest)
        };
        let scanner = Scanner::new(p, Box::new(ahead())).expect("valid");
        scanner.scan(&ScanRequest {
            first_pulse: 0,
            caster: &Step {
                near: 8.0,
                far: 9.0,
            },
            materials: &materials(),
            scene_from_lidar_at: &drive,
            range_model: &ExactRange,
            key: KEY,
        })
    };
    let (raw, deskewed) = (scan(false), scan(true));
    assert_eq!(raw.len(), deskewed.len());
    let mut moved = 0.0_f64;
    for (r, d) in raw.iter().zip(&deskewed) {
        // Raw points are transformed by hand, through the pose at their moment.
        let pose = drive(r.time_ns as f64 * 1e-9);
        let back = pose.transform_point(r.position_m.into());
        assert!(back.distance(d.position_m.into()) < 1e-4, "{r:?} {d:?}");
        let normal = pose.transform_vector(r.normal.into());
        assert!(normal.distance(d.normal.into()) < 1e-5);
        moved = moved.max(f64::from(r.position_m.distance(d.position_m)));
    }
    assert!(moved > 0.3, "{moved}");
}

#[test]
fn bad_beams_and_errors_are_refused_by_name() {
    let refused = |p: ScannerParams| {
        Scanner::new(p, Box::new(ahead()))
            .expect_err("out of range")
            .field
    };
    let base = params(Beam::default(), ReturnMode::Strongest);
    let beam = |f: fn(&mut Beam)| {
        let mut beam = Beam::default();
        f(&mut beam);
        refused(ScannerParams { beam, ..base })
    };
    assert_eq!(
        beam(|b| b.horizontal_fwhm_rad = -0.1),
        "beam.horizontal_fwhm_rad"
    );
    assert_eq!(
        beam(|b| b.vertical_fwhm_rad = f64::NAN),
        "beam.vertical_fwhm_rad"
    );
    assert_eq!(beam(|b| b.rings = 9), "beam.rings");
    assert_eq!(
        beam(|b| b.resolution_m = f64::INFINITY),
        "beam.resolution_m"
    );
    assert_eq!(beam(|b| b.exit_m = 0.2), "beam.exit_m");
    let errors = |f: fn(&mut PulseErrors)| {
        let mut errors = PulseErrors::default();
        f(&mut errors);
        refused(ScannerParams { errors, ..base })
    };
    assert_eq!(
        errors(|e| e.angular_sigma_rad = 1.0),
        "errors.angular_sigma_rad"
    );
    assert_eq!(errors(|e| e.range_step_m = -1.0), "errors.range_step_m");
    assert_eq!(errors(|e| e.dropout = 1.5), "errors.dropout");
    assert_eq!(errors(|e| e.false_alarm = f64::NAN), "errors.false_alarm");
    for returns in [ReturnMode::All(0), ReturnMode::All(16)] {
        assert_eq!(refused(ScannerParams { returns, ..base }), "returns");
    }
}

/// Two walls, of which something that grows on stems covers one half of the view.
#[test]
fn points_know_what_holds_the_surface() {
    let step = Step {
        near: 10.0,
        far: 12.0,
    };
    let mut materials = MaterialLibrary::new();
    for (semantic, support) in [
        (Semantic::Climber, Some(Semantic::Stem)),
        (Semantic::Climber, Some(Semantic::Branch)),
    ] {
        materials.add(Material {
            support,
            ..Material::plain("wall", semantic, Vec3::splat(0.2))
        });
    }
    let scanner = Scanner::new(
        params(Beam::default(), ReturnMode::First),
        Box::new(ahead()),
    );
    let points = scanner.expect("valid").scan(&ScanRequest {
        first_pulse: 0,
        caster: &step,
        materials: &materials,
        scene_from_lidar_at: &|_: f64| RigidTransform::IDENTITY,
        range_model: &ExactRange,
        key: KEY,
    });
    let mut of = [0, 0];
    for p in &points {
        let near = p.object.item() == 1;
        let (on_stem, on_branch) = (
            p.flags.has(PointFlags::ON_STEM),
            p.flags.has(PointFlags::ON_BRANCH),
        );
        assert_eq!((on_stem, on_branch), (near, !near), "{p:?}");
        assert_eq!(p.semantic, Semantic::Climber);
        of[usize::from(near)] += 1;
    }
    assert!(of[0] > 1000 && of[1] > 1000, "{of:?}");
    // The same walls by themselves.
    let bare = scan_with(params(Beam::default(), ReturnMode::First), &step);
    let held = PointFlags::ON_STEM | PointFlags::ON_BRANCH;
    assert!(!bare.is_empty() && bare.iter().all(|p| !p.flags.has(held)));
}
