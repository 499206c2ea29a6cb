//! The trail lines of a site.

use nemoral_import::read_trail_lines;
use nemoral_scene::glam::DVec2;

use crate::config::Site;
use crate::{Error, InputFiles};

/// The trail lines of a config in the world; none without a file.
pub(crate) fn lines_m(site: &Site, inputs: &InputFiles) -> Result<Vec<Vec<DVec2>>, Error> {
    let Some(file) = inputs.get(&site.trails.path) else {
        return Ok(Vec::new());
    };
    let lines = read_trail_lines(file.bytes())
        .map_err(|e| Error::request(format!("{}: {e}", file.path().display())))?;
    let place = |[x, y]: [f64; 2]| DVec2::new(x - site.origin_x_m, y - site.origin_y_m);
    let of_line =
        |line: nemoral_import::TrailLine| line.vertices_m.into_iter().map(place).collect();
    Ok(lines.into_iter().map(of_line).collect())
}
