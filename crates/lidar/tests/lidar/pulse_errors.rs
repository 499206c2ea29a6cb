//! Errors other than of range: of directions, of steps in range, lost pulses and false alarms.

use nemoral_lidar::{Beam, PulseErrors, ReturnMode, ScannerParams};
use nemoral_scene::{ObjectId, PointFlags, RayCaster, Semantic};

use crate::walls::{Step, Void, params, scan_with};

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
