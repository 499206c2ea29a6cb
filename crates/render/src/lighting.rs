use glam::Vec3;

use crate::error::ParamError;
use crate::{SkyParams, Sun};

/// All light there is in a scene.
#[derive(Clone, Debug)]
pub struct Lighting {
    sun_direction: Vec3,
}

impl Lighting {
    /// The light of a sun and a sky.
    ///
    /// # Errors
    /// If a parameter is out of its range, or the sun lower than 6° under the horizon (night).
    pub fn new(sun: &Sun, _sky: &SkyParams) -> Result<Self, ParamError> {
        Ok(Self {
            sun_direction: sun.direction().as_vec3(),
        })
    }

    /// The unit vector towards the sun.
    #[must_use]
    pub fn sun_direction(&self) -> Vec3 {
        self.sun_direction
    }
}
