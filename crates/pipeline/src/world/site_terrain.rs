//! The height map of a site.

use nemoral_import::{HeightMap, Sidecar};
use nemoral_scene::glam::DVec2;
use nemoral_terrain::HeightPosts;

use crate::config::Site;
use crate::{Error, InputFiles};

/// The first bytes of a PNG.
const PNG: &[u8] = b"\x89PNG";

/// The height map of a config; `None` without one.
pub(crate) fn height_map(site: &Site, inputs: &InputFiles) -> Result<Option<HeightMap>, Error> {
    let Some(file) = inputs.get(&site.terrain.path) else {
        return Ok(None);
    };
    let of = |path: &std::path::Path, e: nemoral_import::ImportError| {
        Error::request(format!("{}: {e}", path.display()))
    };
    if !file.bytes().starts_with(PNG) {
        let map = HeightMap::from_tiff(file.bytes()).map_err(|e| of(file.path(), e))?;
        return Ok(Some(map));
    }
    let sidecar = inputs.get(&site.terrain.sidecar).ok_or_else(|| {
        Error::request(format!(
            "{}: a PNG needs site.terrain.sidecar, a file that says where it lies and how high",
            file.path().display()
        ))
    })?;
    let read = Sidecar::read(sidecar.bytes()).map_err(|e| of(sidecar.path(), e))?;
    let map = HeightMap::from_png(file.bytes(), &read).map_err(|e| of(file.path(), e))?;
    Ok(Some(map))
}

/// The posts of a height map in the world.
pub(crate) fn posts(map: HeightMap, site: &Site) -> HeightPosts {
    let origin_z_m = site.terrain.origin_z_m;
    HeightPosts {
        columns: map.columns,
        first_m: DVec2::new(map.west_m - site.origin_x_m, map.north_m - site.origin_y_m),
        spacing_m: map.spacing_m,
        heights_m: (map.heights_m.into_iter())
            .map(|h| (f64::from(h) - origin_z_m) as f32)
            .collect(),
    }
}
