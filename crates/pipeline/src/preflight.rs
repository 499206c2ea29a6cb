//! The checks of a world before its first frame.

use nemoral_scene::glam::DVec3;

use crate::config::{Camera, CameraOptics, Config, Lidar, RangeNoiseModel, RobotPath};
use crate::imu::refuse_too_many;
use crate::plan::Runner;
use crate::recording::pose::scan_s;
use crate::world::lidars::LidarRig;
use crate::world::trajectory::RobotTrajectory;
use crate::{Error, ForestPlan};

/// Computes everything that a world's frames have in common. The result is a list of notes for the
/// user.
pub(crate) fn preflight(
    config: &Config,
    forest: &ForestPlan,
    runner: &Runner<'_>,
) -> Result<Option<String>, Error> {
    let trajectory = runner.get(forest.trajectory, ())?;
    if let Some(frames) = trajectory.frames().filter(|&f| f < config.frames) {
        return Err(Error::request(format!(
            "frames = {}: the robot's path has {frames}",
            config.frames
        )));
    }
    runner.get(forest.cameras, ())?;
    let lidars = runner.get(forest.lidars, ())?;
    if config.imu.enabled {
        refuse_too_many(config, &trajectory, &lidars)?;
    }
    runner.get(forest.placement, ())?;
    let ground = runner.get(forest.ground_model, ())?;
    let on_trails = ground.measured_trees_on_trails();
    let of_plot = (on_trails > 0).then(|| {
        format!(
            "{on_trails} trees of the stem map stand on trails; trails.enabled = false leaves \
             trails out"
        )
    });
    let notes: Vec<String> = trajectory
        .note()
        .map(str::to_owned)
        .into_iter()
        .chain(trajectory.frames().and_then(|f| frames_note(config, f)))
        .chain(overlap_note(&trajectory, config.frames, scan_s(&lidars)))
        .chain(gaps_note(config, scan_s(&lidars)))
        .chain(sight_notes(config, &lidars))
        .chain(stocking_note(config))
        .chain(
            config
                .all_cameras()
                .filter_map(|(path, camera)| centre_note(&path, camera)),
        )
        .chain(ground.note_of_plot())
        .chain(of_plot)
        .chain(runner.get(forest.assets, ())?.models.notes.iter().cloned())
        .collect();
    Ok((!notes.is_empty()).then(|| notes.join("; ")))
}

/// A note of a path that goes on after the last frame.
fn frames_note(config: &Config, of_path: u64) -> Option<String> {
    let frames = config.frames;
    (of_path > frames).then(|| {
        format!(
            "the robot's path has {of_path} places; frames = {frames} are made, and frames = 0 is \
             all"
        )
    })
}

/// A note of scans that begin before the one before has ended.
fn overlap_note(trajectory: &RobotTrajectory, frames: u64, scan_s: f64) -> Option<String> {
    let step_s = |frame: u64| trajectory.time_s(frame + 1) - trajectory.time_s(frame);
    let least_s = (0..frames - 1).take(10_000).map(step_s).reduce(f64::min)?;
    (scan_s > least_s * (1.0 + 1e-6)).then(|| {
        format!(
            "a scan takes {scan_s:.3} s and frames are {least_s:.3} s apart: scans overlap in \
             time, as those of no scanner do; robot.spacing_s sets their interval"
        )
    })
}

/// A note of flight lines or lanes of which parts are not scanned.
fn gaps_note(config: &Config, scan_s: f64) -> Option<String> {
    let step_s = config.robot.pace().step_s();
    let lines = match config.robot.path {
        RobotPath::Flight(_) => "flight lines",
        RobotPath::Lanes(_) => "lanes",
        _ => return None,
    };
    (0.0 < scan_s && scan_s < 0.999 * step_s).then(|| {
        let share = 100.0 * scan_s / step_s;
        format!(
            "a scan takes {scan_s:.3} s and frames are {step_s:.3} s apart: {share:.0} % of the \
             {lines} are scanned; robot.spacing_s = {scan_s:.3} scans all of them"
        )
    })
}

/// What ground and vegetation reflect to lasers, about.
const USUAL_REFLECTANCE: f64 = 0.4;

/// Notes of LiDARs on a flight that do not see the ground below.
fn sight_notes(config: &Config, lidars: &[LidarRig]) -> Vec<String> {
    let RobotPath::Flight(flight) = &config.robot.path else {
        return Vec::new();
    };
    let note = |((path, lidar), rig): ((String, &Lidar), &LidarRig)| {
        let cone = rig.scanner.field_of_view();
        let axis = rig.body_from_lidar.transform_vector(cone.axis);
        if axis.angle_between(DVec3::NEG_Z) > cone.half_angle_rad {
            return Some(format!(
                "[{path}] does not see what is straight below; {path}.mount_pitch_deg = 90 points \
                 down what looks ahead"
            ));
        }
        let noise = &lidar.noise;
        let by_signal_m = match noise.model {
            RangeNoiseModel::SignalToNoise => {
                let share = USUAL_REFLECTANCE / noise.reference_reflectance;
                noise.reference_range_m * share.sqrt()
            }
            _ => f64::INFINITY,
        };
        let reach_m = by_signal_m.min(rig.scanner.params().max_range_m.into());
        (flight.height_m > reach_m).then(|| {
            format!(
                "robot.flight.height_m = {}: [{path}] sees what reflects {:.0} % to {reach_m:.0} m",
                flight.height_m,
                100.0 * USUAL_REFLECTANCE
            )
        })
    };
    config.all_lidars().zip(lidars).filter_map(note).collect()
}

/// More basal area than woods have, m²/ha: dense ones have 60, old conifers of wet coasts 100.
const MOST_BASAL_AREA: f64 = 100.0;

/// A note of a stand that is denser than any.
fn stocking_note(config: &Config) -> Option<String> {
    let (assets, placement) = (&config.assets, &config.placement);
    let per_ha = placement.trees * 1e4 / config.chunks.size_m.powi(2);
    // Weibull's distribution, kept within its limits.
    const RANKS: u32 = 64;
    let scale_m = assets.dbh_mean_m / libm::tgamma(1.0 + 1.0 / assets.dbh_shape);
    let dbh_m = |rank: u32| {
        let above = 1.0 - (f64::from(rank) + 0.5) / f64::from(RANKS);
        let drawn_m = scale_m * libm::pow(-libm::log(above), 1.0 / assets.dbh_shape);
        drawn_m.clamp(assets.dbh_min_m, assets.dbh_max_m)
    };
    let squares_m2: f64 = (0..RANKS).map(|rank| dbh_m(rank).powi(2)).sum();
    let mean_square_m2 = squares_m2 / f64::from(RANKS);
    let basal_area = per_ha * std::f64::consts::FRAC_PI_4 * mean_square_m2;
    (basal_area > MOST_BASAL_AREA).then(|| {
        format!(
            "placement.trees and assets.dbh_mean_m ask for {per_ha:.0} trees and about \
             {basal_area:.0} m² of basal area per hectare; woods rarely have more than 60"
        )
    })
}

/// A note of a camera whose axis is outside of its picture.
fn centre_note(path: &str, camera: &Camera) -> Option<String> {
    let CameraOptics::Calibration(c) = &camera.optics else {
        return None;
    };
    let (width, height) = (camera.width_px, camera.height_px);
    let is_inside =
        (0.0..=f64::from(width)).contains(&c.cx_px) && (0.0..=f64::from(height)).contains(&c.cy_px);
    (!is_inside).then(|| {
        format!(
            "{path}.calibration: the principal point ({}, {}) is outside of the picture of \
             {width} x {height}: is it the calibration of a larger one?",
            c.cx_px, c.cy_px
        )
    })
}

/// Refuses a frame beyond the sequence.
pub(crate) fn within_sequence(config: &Config, frame: u64) -> Result<(), Error> {
    let frames = config.frames;
    if frame < frames {
        return Ok(());
    }
    Err(Error::request(format!(
        "frame {frame}: the sequence has {frames} frames, counted from 0; the config's `frames` \
         makes it longer"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ConfigLayers;

    fn config(settings: &[&str]) -> Config {
        let layers = ConfigLayers {
            settings: settings.iter().map(|&s| s.to_owned()).collect(),
            ..ConfigLayers::default()
        };
        layers.load().expect("sound")
    }

    #[test]
    fn stands_that_are_denser_than_any_are_told() {
        assert_eq!(stocking_note(&config(&[])), None);
        // 1200 trees of 40 cm on a hectare, and as many of which none is thicker than 20 cm.
        let dense = config(&["placement.trees=300", "assets.dbh_mean_m=0.4"]);
        let note = stocking_note(&dense).expect("a note");
        assert!(note.contains("1200 trees and about 1"), "{note}");
        let thin = [
            "assets.dbh_mean_m=0.2",
            "assets.dbh_max_m=0.2",
            "assets.dbh_shape=1",
        ];
        assert_eq!(
            stocking_note(&config(&[&["placement.trees=300"], &thin[..]].concat())),
            None
        );
    }

    #[test]
    fn calibrations_of_larger_pictures_are_told() {
        let note = |settings: &[&str]| {
            let config = config(settings);
            let mut notes = config
                .all_cameras()
                .map(|(path, camera)| centre_note(&path, camera));
            notes.next().flatten()
        };
        let large = "camera.calibration={ fx_px = 1200.0, cx_px = 1920.0, cy_px = 1080.0 }";
        let told = note(&[large]).expect("a note");
        assert!(
            told.contains("(1920, 1080) is outside of the picture of 1280 x 720"),
            "{told}"
        );
        assert_eq!(
            note(&[large, "camera.width_px=3840", "camera.height_px=2160"]),
            None
        );
        assert_eq!(note(&[]), None);
    }
}
