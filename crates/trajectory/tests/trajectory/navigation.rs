//! What a navigation system estimates: how far errors go, how they change, and what is refused.

use proptest::prelude::*;

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;
use nemoral_seed::Key;
use nemoral_trajectory::{Navigation, NavigationParams, TrackPoint};

const NONE: NavigationParams = NavigationParams {
    horizontal_m: 0.0,
    vertical_m: 0.0,
    roll_pitch_rad: 0.0,
    heading_rad: 0.0,
    correlation_s: 60.0,
    drift_m: 0.0,
    heading_drift_rad: 0.0,
    loop_m: 0.0,
    reference_point_m: DVec3::ZERO,
    lever_m: DVec3::ZERO,
    boresight_rad: [0.0; 3],
};

/// A straight drive north, with a pose after each step.
fn drive(poses: usize, step_s: f64, step_m: f64) -> Vec<(f64, RigidTransform)> {
    let pose = |i: usize| {
        let along_m = DVec3::new(0.0, step_m * i as f64, 0.0);
        let facing_north = std::f64::consts::FRAC_PI_2;
        let pose = RigidTransform::from_xyz_rpy(along_m, 0.0, 0.0, facing_north);
        (step_s * i as f64, pose)
    };
    (0..poses).map(pose).collect()
}

fn estimated(
    params: NavigationParams,
    seed: u64,
    poses: &[(f64, RigidTransform)],
) -> Vec<RigidTransform> {
    let navigation = Navigation::new(params, Key::world(seed)).expect("in range");
    navigation.estimated(&TrackPoint::along(poses))
}

/// The errors of place, metres, and of attitude about the world's axes, radians.
fn errors(estimated: &RigidTransform, truth: &RigidTransform) -> [f64; 6] {
    let place = estimated.translation_m - truth.translation_m;
    let turn = (estimated.rotation * truth.rotation.inverse()).to_scaled_axis();
    [place.x, place.y, place.z, turn.x, turn.y, turn.z]
}

fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    let (mut count, mut sum) = (0.0, 0.0);
    for value in values {
        count += 1.0;
        sum += value * value;
    }
    (sum / count).sqrt()
}

#[test]
fn no_errors_are_the_truth() {
    let drive = drive(50, 0.5, 1.0);
    for (estimated, (_, truth)) in estimated(NONE, 1, &drive).iter().zip(&drive) {
        assert_eq!(estimated.translation_m, truth.translation_m);
        assert!(estimated.rotation.angle_between(truth.rotation) < 1e-7);
    }
}

#[test]
fn wandering_has_its_deviations_and_its_time() {
    let params = NavigationParams {
        horizontal_m: 0.03,
        vertical_m: 0.05,
        roll_pitch_rad: 4e-4,
        heading_rad: 1.4e-3,
        ..NONE
    };
    let wanted = [0.03, 0.03, 0.05, 4e-4, 4e-4, 1.4e-3];
    // However long a step is: a pose a second, or one in two time constants.
    for step_s in [1.0, 120.0] {
        let truth = drive(200, step_s, 0.0);
        let found: Vec<Vec<[f64; 6]>> = (0..400)
            .map(|seed| {
                let all = estimated(params, seed, &truth);
                (all.iter().zip(&truth))
                    .map(|(estimated, (_, truth))| errors(estimated, truth))
                    .collect()
            })
            .collect();
        for (axis, wanted) in wanted.into_iter().enumerate() {
            for at in [0, 60, 199] {
                let at_once = deviation(found.iter().map(|run| run[at][axis]));
                assert!(
                    (at_once / wanted - 1.0).abs() < 0.12,
                    "{axis} {at}: {at_once}"
                );
            }
            let products = found.iter().map(|run| run[100][axis] * run[160][axis]);
            let correlation = products.sum::<f64>() / found.len() as f64 / (wanted * wanted);
            let after = (-60.0 * step_s / params.correlation_s).exp();
            assert!((correlation - after).abs() < 0.16, "{axis}: {correlation}");
        }
    }
}

#[test]
fn drift_grows_with_the_root_of_the_way_however_it_is_cut() {
    let params = NavigationParams {
        drift_m: 0.01,
        heading_drift_rad: 1e-3,
        ..NONE
    };
    for step_m in [0.5, 10.0] {
        let poses = (400.0 / step_m) as usize + 1;
        let truth = drive(poses, 1.0, step_m);
        let (mut places, mut headings) = (Vec::new(), Vec::new());
        for seed in 0..400 {
            let all = estimated(params, seed, &truth);
            assert_eq!(all[0].translation_m, truth[0].1.translation_m);
            let at_end = errors(&all[poses - 1], &truth[poses - 1].1);
            places.extend(&at_end[..3]);
            headings.push(at_end[5]);
        }
        let (place, heading) = (
            deviation(places.into_iter()),
            deviation(headings.into_iter()),
        );
        assert!((place / 0.2 - 1.0).abs() < 0.1, "{place}");
        assert!((heading / 0.02 - 1.0).abs() < 0.12, "{heading}");
    }
}

#[test]
fn a_closed_loop_has_its_drift_in_its_middle() {
    let params = NavigationParams {
        drift_m: 0.01,
        loop_m: 400.0,
        ..NONE
    };
    // A bridge's deviation is k sqrt(s (L - s) / L): 10 cm in the middle.
    let truth = drive(900, 1.0, 1.0);
    let runs: Vec<_> = (0..500)
        .map(|seed| estimated(params, seed, &truth))
        .collect();
    for (at, wanted) in [(0, 0.0), (100, 0.0866), (200, 0.1), (400, 0.0), (600, 0.1)] {
        let of_run = |run: &Vec<RigidTransform>| errors(&run[at], &truth[at].1)[0];
        let found = deviation(runs.iter().map(of_run));
        assert!((found - wanted).abs() <= 0.1 * wanted, "{at}: {found}");
    }
}

/// A beam 45 degrees aside from 60 m above level ground, over which two lines are flown in opposite
/// directions: a boresight angle of roll lifts one strip and lowers the other.
#[test]
fn a_boresight_angle_is_a_step_between_strips() {
    let params = NavigationParams {
        boresight_rad: [0.05_f64.to_radians(), 0.0, 0.0],
        ..NONE
    };
    let height_of = |yaw_rad: f64, left: f64| {
        let above = DVec3::new(0.0, 0.0, 60.0);
        let truth = RigidTransform::from_xyz_rpy(above, 0.0, 0.0, yaw_rad);
        let estimated = estimated(params, 1, &[(0.0, truth)]);
        estimated[0]
            .transform_point(DVec3::new(0.0, 60.0 * left, -60.0))
            .z
    };
    let step_m = height_of(0.0, 1.0) - height_of(std::f64::consts::PI, -1.0);
    assert!((step_m - 0.105).abs() < 5e-4, "{step_m}");
}

/// Without a time constant, errors at one place say nothing about those at the next, however soon
/// that is.
#[test]
fn errors_without_a_time_constant_are_independent() {
    let params = NavigationParams {
        horizontal_m: 1.0,
        correlation_s: 0.0,
        ..NONE
    };
    let truth = drive(20_000, 1e-6, 1.0);
    let found = estimated(params, 4, &truth);
    let east: Vec<f64> = (found.iter().zip(&truth))
        .map(|(found, (_, truth))| errors(found, truth)[0])
        .collect();
    assert!((deviation(east.iter().copied()) - 1.0).abs() < 0.03);
    let products = east.windows(2).map(|pair| pair[0] * pair[1]);
    let correlation = products.sum::<f64>() / 20_000.0;
    assert!(correlation.abs() < 0.03, "{correlation}");
}

/// A sensor at the reference point is turned in its place, however far from the body's origin it
/// is.
#[test]
fn errors_of_attitude_turn_about_the_reference_point() {
    let point_m = DVec3::new(0.4, -0.1, 1.2);
    let params = NavigationParams {
        roll_pitch_rad: 0.02,
        heading_rad: 0.05,
        heading_drift_rad: 0.01,
        reference_point_m: point_m,
        boresight_rad: [0.03, -0.05, 0.1],
        ..NONE
    };
    let truth = drive(20, 1.0, 1.0);
    for (found, (_, truth)) in estimated(params, 3, &truth).iter().zip(&truth) {
        let [found_m, true_m] = [found, truth].map(|pose| pose.transform_point(point_m));
        assert!(found_m.distance(true_m) < 1e-12);
        assert!(found.rotation.angle_between(truth.rotation) > 0.05);
    }
}

#[test]
fn value_stability() {
    let params = NavigationParams {
        horizontal_m: 0.03,
        vertical_m: 0.05,
        roll_pitch_rad: 4e-4,
        heading_rad: 1.4e-3,
        drift_m: 0.01,
        heading_drift_rad: 1e-3,
        loop_m: 20.0,
        lever_m: DVec3::new(0.01, -0.02, 0.03),
        boresight_rad: [1e-3, -2e-3, 3e-3],
        ..NONE
    };
    let last = estimated(params, 7, &drive(30, 0.5, 1.0))[29];
    assert_eq!(format!("{:?}", last.translation_m), PLACE);
    assert_eq!(format!("{:?}", last.rotation), ATTITUDE);
}
const PLACE: &str = "DVec3(0.0457205846995765, 28.94889742027809, -0.02206711565496623)";
const ATTITUDE: &str =
    "DQuat(0.0011837674248048732, -0.00022710016969049597, 0.7077629600162313, 0.7064489645751202)";

#[test]
fn wrong_values_are_refused_by_name() {
    let refused = |params| {
        let refused = Navigation::new(params, Key::world(1)).expect_err("out of range");
        refused.to_string()
    };
    for (params, field) in [
        (
            NavigationParams {
                horizontal_m: -1.0,
                ..NONE
            },
            "horizontal_m",
        ),
        (
            NavigationParams {
                heading_rad: f64::NAN,
                ..NONE
            },
            "heading_rad",
        ),
        (
            NavigationParams {
                drift_m: f64::INFINITY,
                ..NONE
            },
            "drift_m",
        ),
        (
            NavigationParams {
                correlation_s: -1.0,
                ..NONE
            },
            "correlation_s",
        ),
        (
            NavigationParams {
                boresight_rad: [0.0, f64::NAN, 0.0],
                ..NONE
            },
            "boresight_rad",
        ),
    ] {
        assert!(refused(params).contains(field), "{}", refused(params));
    }
}

proptest! {
    /// What is estimated of a pose does not depend on those after it, and is always a pose.
    #[test]
    fn later_poses_change_nothing(
        seed in any::<u64>(),
        count in 1_usize..40,
        step_s in 0.0_f64..100.0,
        step_m in 0.0_f64..100.0,
        scale in 0.0_f64..10.0,
        loop_m in prop_oneof![Just(0.0), 0.1_f64..1000.0],
    ) {
        let params = NavigationParams {
            horizontal_m: scale,
            vertical_m: scale,
            roll_pitch_rad: scale,
            heading_rad: scale,
            drift_m: scale,
            heading_drift_rad: scale,
            loop_m,
            ..NONE
        };
        let truth = drive(count, step_s, step_m);
        let all = estimated(params, seed, &truth);
        prop_assert_eq!(all.len(), count);
        let some = estimated(params, seed, &truth[..count.div_ceil(2)]);
        prop_assert_eq!(&all[..some.len()], &some[..]);
        for pose in all {
            prop_assert!(pose.translation_m.is_finite());
            prop_assert!((pose.rotation.length() - 1.0).abs() < 1e-12);
        }
    }
}
