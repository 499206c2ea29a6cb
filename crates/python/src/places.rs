//! Places that users name, which must lie within the world.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DVec2, DVec3};

use crate::arrays;
use crate::failure::Failure;

/// The farthest place from the world's origin, metres.
const FARTHEST_M: f64 = 1e7;

/// The greatest height above and below 0 of a body, metres: the renderer's is 100,000 m, with room
/// for where sensors are on the body.
const HIGHEST_M: f64 = 9e4;

/// A place that is not beyond the world.
pub(crate) fn place(name: &str, x_m: f64, y_m: f64) -> Result<DVec2, Failure> {
    let place_m = DVec2::new(x_m, y_m);
    // Not a number is not within.
    if place_m.abs().cmple(DVec2::splat(FARTHEST_M)).all() {
        return Ok(place_m);
    }
    let allowed = format!("finite, at most {FARTHEST_M:e} m from the origin");
    Err(Failure::argument(name, format!("({x_m}, {y_m})"), allowed))
}

/// A pose by the 16 numbers of its matrix, at a place that is not beyond the world.
pub(crate) fn pose_of(numbers: &[f64; 16]) -> Result<RigidTransform, Failure> {
    let pose = arrays::transform("pose", numbers)?;
    place("pose", pose.translation_m.x, pose.translation_m.y)?;
    let z_m = pose.translation_m.z;
    if z_m.abs() > HIGHEST_M {
        let allowed = format!("at most {HIGHEST_M} m above or below 0");
        return Err(Failure::argument("pose", format!("{z_m} m high"), allowed));
    }
    Ok(pose)
}

/// The mean of the origins of rays, none of which may be farther from it than one sees: it would
/// miss everything.
pub(crate) fn mean_within(
    rays: &[(DVec3, DVec3)],
    visible_radius_m: f64,
) -> Result<DVec2, Failure> {
    for (i, (origin, _)) in rays.iter().enumerate() {
        place(&format!("rays[{i}]"), origin.x, origin.y)?;
    }
    let sum: DVec2 = rays.iter().map(|(origin, _)| origin.truncate()).sum();
    let mean = sum / rays.len().max(1) as f64;
    let mean_m = place("mean of the origins", mean.x, mean.y)?;
    for (i, (origin, _)) in rays.iter().enumerate() {
        let apart_m = origin.truncate().distance(mean_m);
        if apart_m > visible_radius_m {
            let found = format!("{origin}, {apart_m:.0} m from the mean of all origins");
            let allowed = format!(
                "within chunks.visible_radius_m = {visible_radius_m} of it, as there is nothing \
                 beyond; cast the rays of each place alone, or give `around`"
            );
            return Err(Failure::argument(&format!("rays[{i}]"), found, allowed));
        }
    }
    Ok(mean_m)
}
