//! Where the world of a sequence lies on the earth.

use nemoral_scene::glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::{Error, limits};

/// The place of a world that was grown on somebody's own site.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteSpec {
    /// The EPSG code of the site's projected coordinates; absent from `dataset.json` if it is not
    /// known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub epsg: Option<u16>,
    /// The world's origin in the site's coordinates, metres: easting, northing, height.
    pub origin_m: [f64; 3],
}

impl SiteSpec {
    /// A place of the world in the site's coordinates.
    #[must_use]
    pub fn from_world(&self, world_m: DVec3) -> DVec3 {
        world_m + DVec3::from_array(self.origin_m)
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        let (low, high) = limits::EPSG_CODES.into_inner();
        if let Some(code) = self.epsg.filter(|code| !(low..=high).contains(code)) {
            return Err(Error::invalid(
                "site.epsg",
                code,
                format!("{low} to {high}"),
            ));
        }
        let reach = limits::MAX_SITE_M;
        match self
            .origin_m
            .iter()
            .find(|m| !(-reach..=reach).contains(*m))
        {
            None => Ok(()),
            Some(m) => Err(Error::invalid(
                "site.origin_m",
                m,
                format!("within {reach} m"),
            )),
        }
    }
}
