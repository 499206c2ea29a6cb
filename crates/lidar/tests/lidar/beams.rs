//! Wide beams, several returns, and errors other than of range, on scenes with known answers.

use nemoral_lidar::{
    AirLayer, AirParams, Beam, EchoObservation, ExactRange, PulseErrors, RepeatingLines,
    RepeatingLinesParams, ReturnMode, ScanRequest, Scanner, ScannerParams,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    ChunkCoord, Hit, LidarPoint, Material, MaterialId, MaterialLibrary, ObjectId, PointFlags, Ray,
    RayCaster, RigidTransform, Semantic,
};
use nemoral_seed::{Domain, Key};

const KEY: Key = Key::world(7).domain(Domain::new("lidar.beams"));

fn materials() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    for (name, semantic, reflectance) in [
        ("near", Semantic::Leaf, 0.5),
        ("far", Semantic::Stem, 0.5),
        ("sky", Semantic::Rock, 0.0),
    ] {
        let mut material = Material::plain(name, semantic, Vec3::splat(0.2));
        material.optics.nm905.reflectance = reflectance;
        library.add(material);
    }
    library
}

fn hit(ray: &Ray, distance_m: f32, material: u16) -> Option<Hit> {
    let object = ObjectId::new(ChunkCoord::new(0, 0), material + 1).expect("in range");
    (distance_m <= ray.t_max_m)
        .then(|| Hit::new(distance_m, Vec3::NEG_X, MaterialId(material)).with_object(object))
}

/// A wall at x = `far`; before it, where y > 0, another at x = `near`.
struct Step {
    near: f32,
    far: f32,
}

impl RayCaster for Step {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let at = |x: f32| (x - ray.origin.x) / ray.direction.x;
        if ray.direction.x <= 0.0 {
            return None;
        }
        let near = at(self.near);
        if near * ray.direction.y + ray.origin.y > 0.0 {
            hit(ray, near, 0)
        } else {
            hit(ray, at(self.far), 1)
        }
    }
}

/// An empty world.
struct Void;

impl RayCaster for Void {
    fn closest_hit(&self, _: &Ray) -> Option<Hit> {
        None
    }
}

/// 30° to each side, so that no light is grazing.
fn ahead() -> RepeatingLines {
    RepeatingLines::new(RepeatingLinesParams {
        horizontal_fov_rad: std::f64::consts::FRAC_PI_3,
        ..RepeatingLinesParams::default()
    })
    .expect("valid")
}

fn wide() -> Beam {
    Beam {
        horizontal_fwhm_rad: 0.02,
        vertical_fwhm_rad: 0.002,
        rings: 3,
        ..Beam::default()
    }
}

fn scan_with(params: ScannerParams, caster: &dyn RayCaster) -> Vec<LidarPoint> {
    let scanner = Scanner::new(params, Box::new(ahead())).expect("valid");
    let still = |_: f64| RigidTransform::IDENTITY;
    scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster,
        materials: &materials(),
        scene_from_lidar_at: &still,
        range_model: &ExactRange,
        key: KEY,
    })
}

fn params(beam: Beam, returns: ReturnMode) -> ScannerParams {
    ScannerParams {
        pulses_per_scan: 30_000,
        beam,
        returns,
        ..ScannerParams::default()
    }
}

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
fn pointing_errors_have_their_sigma() {
    let sigma = 0.002;
    let errors = PulseErrors {
        angular_sigma_rad: sigma,
        ..PulseErrors::default()
    };
    let wall = Step {
        near: 8.0,
        far: 8.0,
    };
    let points = scan_with(
        ScannerParams {
            errors,
            ..params(Beam::default(), ReturnMode::Strongest)
        },
        &wall,
    );
    let n = points.len() as f64;
    // Points are written where the scanner believes, off the wall by tan(incidence) × sigma ×
    // range.
    let variance = points
        .iter()
        .filter(|p| p.incidence_cos > 0.5)
        .map(|p| {
            let direction = p.position_m.as_dvec3().normalize();
            let expected = 8.0 / direction.x;
            let slope = (1.0 / direction.x.powi(2) - 1.0).sqrt();
            let off = (f64::from(p.range_m) - expected) / (expected * slope.max(0.2));
            (slope > 0.2).then_some(off * off)
        })
        .collect::<Vec<_>>();
    let used: Vec<f64> = variance.into_iter().flatten().collect();
    let measured = (used.iter().sum::<f64>() / used.len() as f64).sqrt();
    assert!(used.len() > 2000 && n > 5000.0);
    assert!((measured / sigma - 1.0).abs() < 0.04, "{measured}");
}

#[test]
fn ranges_are_written_in_steps() {
    let errors = PulseErrors {
        range_step_m: 0.05,
        ..PulseErrors::default()
    };
    let points = scan_with(
        ScannerParams {
            errors,
            ..params(Beam::default(), ReturnMode::Strongest)
        },
        &Step {
            near: 8.0,
            far: 9.0,
        },
    );
    for p in &points {
        let steps = p.range_m / 0.05;
        assert!((steps - steps.round()).abs() < 1e-3, "{}", p.range_m);
        assert!((p.range_m - p.true_range_m).abs() <= 0.0251);
    }
}

#[test]
fn pulses_are_lost_and_raised_as_often_as_asked() {
    let count = |errors, caster: &dyn RayCaster| {
        let p = ScannerParams {
            errors,
            ..params(Beam::default(), ReturnMode::Strongest)
        };
        scan_with(p, caster)
    };
    let wall = Step {
        near: 8.0,
        far: 9.0,
    };
    let all = count(PulseErrors::default(), &wall).len() as f64;
    let dropout = PulseErrors {
        dropout: 0.3,
        ..PulseErrors::default()
    };
    let kept = count(dropout, &wall).len() as f64;
    let sigma = (0.3 * 0.7 * all).sqrt();
    assert!((kept - 0.7 * all).abs() < 4.0 * sigma, "{kept} of {all}");

    let raised = PulseErrors {
        false_alarm: 0.05,
        ..PulseErrors::default()
    };
    let alarms = count(raised, &Void);
    let expected = 0.05 * 30_000.0;
    assert!((alarms.len() as f64 - expected).abs() < 4.0 * (0.95_f64 * expected).sqrt());
    for p in &alarms {
        assert!(p.flags.has(PointFlags::FALSE_ALARM) && p.semantic == Semantic::Sky);
        assert!(p.object == ObjectId::NONE && p.true_range_m == 0.0);
        assert!((0.5..=260.0).contains(&p.range_m));
    }
    // There are no false alarms where the wall is seen.
    assert_eq!(
        count(raised, &wall)
            .iter()
            .filter(|p| p.position_m.x > 7.0)
            .count() as f64,
        all
    );
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

/// Fog with this visibility.
fn foggy(visibility_m: f64) -> AirParams {
    let fog = AirLayer {
        extinction_per_m: 3.912 / visibility_m,
        height_m: 1e9,
        ..AirLayer::default()
    };
    AirParams {
        fog,
        ..AirParams::default()
    }
}

#[test]
fn fog_weakens_echoes_and_has_its_own() {
    let scan = |visibility_m, returns, caster: &dyn RayCaster| {
        let air = foggy(visibility_m);
        let params = ScannerParams {
            air,
            ..params(Beam::default(), returns)
        };
        scan_with(params, caster)
    };
    let is_air = |p: &&LidarPoint| p.semantic == Semantic::AirborneEcho;
    let wall = |m: f32| Step { near: m, far: m };

    // A wall that is near is seen through fog, and is as dark as Beer and Lambert say.
    let clear = scan_with(params(Beam::default(), ReturnMode::Strongest), &wall(6.0));
    let dim = scan(100.0, ReturnMode::Strongest, &wall(6.0));
    assert_eq!(clear.len(), dim.len());
    let mut walls = 0;
    // Fog that is right before the wall is merged with it.
    let is_pure = |p: &LidarPoint| !is_air(&p) && !p.flags.has(PointFlags::MIXED);
    for (a, b) in clear.iter().zip(&dim).filter(|(_, b)| is_pure(b)) {
        let left = libm::exp(-2.0 * 0.03912 * f64::from(a.true_range_m));
        assert!((f64::from(b.intensity / a.intensity) - left).abs() < 1e-4);
        assert_eq!(
            (a.position_m, a.semantic, a.flags),
            (b.position_m, b.semantic, b.flags)
        );
        walls += 1;
    }
    assert!(f64::from(walls) > 0.8 * clear.len() as f64, "{walls}");
    assert!(dim.iter().filter(is_air).count() < clear.len() / 100);

    // One that is far is hidden: fog is stronger, but not the last.
    let hidden = scan(50.0, ReturnMode::Strongest, &wall(60.0));
    assert!(hidden.len() > 29_000 && hidden.iter().all(|p| is_air(&p)));
    for p in &hidden {
        assert!(p.flags == PointFlags(PointFlags::FALSE_ALARM) && p.object == ObjectId::NONE);
        assert!((1.0..30.0).contains(&p.range_m) && p.range_m == p.true_range_m);
        assert!(p.normal == Vec3::ZERO && p.intensity > 0.0);
    }
    let ranges: Vec<f32> = hidden.iter().map(|p| p.range_m).collect();
    let spread = ranges.iter().copied().fold(0.0, f32::max);
    assert!(spread > 5.0, "no thin shell: {spread}");
    let last = scan(50.0, ReturnMode::Last, &wall(20.0));
    assert!(
        last.iter()
            .all(|p| p.semantic == Semantic::Leaf || p.semantic == Semantic::Stem)
    );
    // Behind so much of it, no surface is seen, though the range model has no threshold.
    assert!(scan(50.0, ReturnMode::Last, &wall(60.0)) == hidden);
    let first = scan(50.0, ReturnMode::First, &wall(20.0));
    assert!(first.iter().filter(is_air).count() > 29_000);

    // The sky has echoes in fog, and none in clear air.
    assert!(scan(50.0, ReturnMode::Strongest, &Void).len() > 29_000);
    assert!(scan(20_000.0, ReturnMode::Strongest, &Void).is_empty());
    assert!(scan(1e6, ReturnMode::Strongest, &Void).is_empty());
}

#[test]
fn falling_snow_weakens_echoes_and_flakes_have_their_own() {
    // The beam of a Mid-40, as a line.
    let beam = Beam {
        horizontal_fwhm_rad: 0.28_f64.to_radians(),
        vertical_fwhm_rad: 0.03_f64.to_radians(),
        ..Beam::default()
    };
    let scan = |snowfall_mm_per_h, returns, caster: &dyn RayCaster| {
        let air = AirParams {
            snowfall_mm_per_h,
            ..AirParams::default()
        };
        let params = ScannerParams {
            air,
            ..params(beam, returns)
        };
        scan_with(params, caster)
    };
    let is_flake = |p: &&LidarPoint| p.semantic == Semantic::AirborneEcho;
    let wall = Step {
        near: 60.0,
        far: 60.0,
    };
    let clear = scan(0.0, ReturnMode::All(15), &wall);
    let snow = scan(1.0, ReturnMode::All(15), &wall);
    assert!(clear.iter().all(|p| !is_flake(&p)));
    // 0.94 flakes a pulse, of which few are merged, or beyond the wall.
    let flakes = snow.iter().filter(is_flake).count() as f64 / clear.len() as f64;
    assert!((0.85..0.95).contains(&flakes), "{flakes}");
    for p in snow.iter().filter(is_flake) {
        assert!(p.flags == PointFlags(PointFlags::FALSE_ALARM) && p.object == ObjectId::NONE);
        assert!(p.range_m < 60.0 && p.normal == Vec3::ZERO && p.intensity > 0.0);
    }
    // The wall is as dark as Beer and Lambert say.
    let walls: Vec<_> = snow.iter().filter(|p| !is_flake(p)).collect();
    assert_eq!(walls.len(), clear.len());
    for (a, b) in clear.iter().zip(walls) {
        let left = libm::exp(-2.0 * 3.33e-3 * f64::from(a.true_range_m));
        assert!((f64::from(b.intensity / a.intensity) / left - 1.0).abs() < 0.01);
    }
    // The first echo is often a flake's, the strongest one sometimes, the last one never.
    let share = |returns| {
        let points = scan(1.0, returns, &wall);
        points.iter().filter(is_flake).count() as f64 / points.len() as f64
    };
    assert!(share(ReturnMode::First) > 0.5 && share(ReturnMode::Last) == 0.0);
    assert!((0.0..share(ReturnMode::First)).contains(&share(ReturnMode::Strongest)));
    // A line without width meets no flake.
    let line = scan_with(
        ScannerParams {
            air: AirParams {
                snowfall_mm_per_h: 5.0,
                ..AirParams::default()
            },
            ..params(Beam::default(), ReturnMode::First)
        },
        &wall,
    );
    assert!(line.iter().all(|p| !is_flake(&p)));
}

#[test]
fn bad_air_is_refused_by_name() {
    let refused = |air| {
        let params = ScannerParams {
            air,
            ..ScannerParams::default()
        };
        Scanner::new(params, Box::new(ahead()))
            .expect_err("bad")
            .field
    };
    let base = AirParams::default();
    let of = |fog| AirParams { fog, ..base };
    let layer = AirLayer::default();
    for (air, field) in [
        (
            of(AirLayer {
                extinction_per_m: -1.0,
                ..layer
            }),
            "air.extinction_per_m",
        ),
        (
            of(AirLayer {
                height_m: 0.0,
                ..layer
            }),
            "air.height_m",
        ),
        (
            of(AirLayer {
                lidar_ratio_sr: f64::NAN,
                ..layer
            }),
            "air.lidar_ratio_sr",
        ),
        (
            of(AirLayer {
                base_m: Some(f64::INFINITY),
                ..layer
            }),
            "air.base_m",
        ),
        (
            AirParams {
                reference_range_m: 0.0,
                ..base
            },
            "air.reference_range_m",
        ),
        (
            AirParams {
                reference_reflectance: 0.0,
                ..base
            },
            "air.reference_reflectance",
        ),
        (
            AirParams {
                near_m: -1.0,
                ..base
            },
            "air.near_m",
        ),
        (
            AirParams {
                rain_mm_per_h: -1.0,
                ..base
            },
            "air.rain_mm_per_h",
        ),
        (
            AirParams {
                flake_reflectance: 1.5,
                ..base
            },
            "air.flake_reflectance",
        ),
    ] {
        assert_eq!(refused(air), field);
    }
}
