//! The ports through which a trajectory gets to know the land.

use std::fmt::Debug;

use nemoral_scene::glam::DVec2;

/// Something upright to keep clear of, such as a stem or a rock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Its middle on the map, metres.
    pub position_m: DVec2,
    /// Its radius, metres.
    pub radius_m: f64,
}

/// The obstacles near a place. Closures with the same arguments implement it.
pub trait Obstacles {
    /// The error of the user's land.
    type Error;

    /// Every obstacle whose surface is closer than `reach_m` to a place on the map; further ones do
    /// not change the result but take time. The order must not depend on anything but the
    /// arguments.
    ///
    /// # Errors
    /// If the land there cannot be made.
    fn near(&self, place_m: DVec2, reach_m: f64) -> Result<Vec<Obstacle>, Self::Error>;
}

impl<E, F: Fn(DVec2, f64) -> Result<Vec<Obstacle>, E>> Obstacles for F {
    type Error = E;

    fn near(&self, place_m: DVec2, reach_m: f64) -> Result<Vec<Obstacle>, E> {
        self(place_m, reach_m)
    }
}

/// A line on the map by arc length: a trail, a road, a row of waypoints.
pub trait Polyline: Debug + Send + Sync {
    /// Its length, metres.
    fn length_m(&self) -> f64;

    /// The place at an arc length from 0 to the line's length, metres.
    fn position_m(&self, s_m: f64) -> DVec2;

    /// The direction there, of length 1.
    fn tangent(&self, s_m: f64) -> DVec2;
}
