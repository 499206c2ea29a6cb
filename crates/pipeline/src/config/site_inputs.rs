//! What the files of a site say: its trees, its ground and its trails.

use nemoral_import::{HeightMap, ImportError, Sidecar, Stem, read_stem_map, read_trail_lines};
use nemoral_scene::glam::DVec2;
use nemoral_terrain::HeightPosts;

use super::Site;
use crate::{Error, InputFile, InputFiles};

fn wrong(file: &InputFile, e: &ImportError) -> Error {
    Error::request(format!("{}: {e}", file.path().display()))
}

/// The stem map of a config; `None` without one.
pub(crate) fn stems_of(site: &Site, inputs: &InputFiles) -> Result<Option<Vec<Stem>>, Error> {
    let Some(file) = inputs.get(&site.stems.path) else {
        return Ok(None);
    };
    let stems = read_stem_map(file.bytes()).map_err(|e| wrong(file, &e))?;
    Ok(Some(stems))
}

/// The height map of a config; `None` without one.
pub(crate) fn height_map(site: &Site, inputs: &InputFiles) -> Result<Option<HeightMap>, Error> {
    let Some(file) = inputs.get(&site.terrain.path) else {
        return Ok(None);
    };
    let sidecar = if HeightMap::needs_sidecar(file.bytes()) {
        let sidecar = inputs.get(&site.terrain.sidecar).ok_or_else(|| {
            let path = file.path().display();
            Error::request(format!(
                "{path}: a PNG needs site.terrain.sidecar, a file that says where it lies and how \
                 high"
            ))
        })?;
        Some(Sidecar::read(sidecar.bytes()).map_err(|e| wrong(sidecar, &e))?)
    } else {
        None
    };
    let map = HeightMap::read(file.bytes(), sidecar.as_ref()).map_err(|e| wrong(file, &e))?;
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

/// The trail lines of a config in the world; none without a file.
pub(crate) fn lines_m(site: &Site, inputs: &InputFiles) -> Result<Vec<Vec<DVec2>>, Error> {
    let Some(file) = inputs.get(&site.trails.path) else {
        return Ok(Vec::new());
    };
    let lines = read_trail_lines(file.bytes()).map_err(|e| wrong(file, &e))?;
    let place = |[x, y]: [f64; 2]| DVec2::new(x - site.origin_x_m, y - site.origin_y_m);
    let of_line =
        |line: nemoral_import::TrailLine| line.vertices_m.into_iter().map(place).collect();
    Ok(lines.into_iter().map(of_line).collect())
}
