//! Planted rows on the endless plane.

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Draw, Key, Stage};

use crate::bridson::{Kinds, Point, from_centre};
use crate::params::{ParamError, within};

const ROWS: Stage = Stage::new("placement.rows");
const PHASE: Stage = Stage::new("placement.rows.phase");

/// A planter's hand strays no farther than this many standard deviations.
const STRAY: f64 = 2.5;

/// Rows of planted trees: a grid of the whole plane, turned, whose places are known by two integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows {
    /// From row to row, metres, 0.5 to 50.
    pub row_m: f64,
    /// From place to place in a row, metres, 0.5 to 50.
    pub in_row_m: f64,
    /// Standard deviation of where a tree stands about its place, along the row and across it,
    /// metres, at least 0; planters reach 0.15 to 0.3. No tree strays more than 2.5 times as far.
    pub jitter_m: f64,
    /// Where the rows head, clockwise from north, degrees.
    pub heading_deg: f64,
}

impl Rows {
    pub(crate) fn check(&self, path: &str, largest_m: f64) -> Result<(), ParamError> {
        within(&format!("{path}.row_m"), self.row_m, 0.5, 50.0)?;
        within(&format!("{path}.in_row_m"), self.in_row_m, 0.5, 50.0)?;
        within(
            &format!("{path}.heading_deg"),
            self.heading_deg,
            -360.0,
            360.0,
        )?;
        // Two neighbours that stray towards each other must still keep the distance rule.
        let narrow = self.row_m.min(self.in_row_m);
        let most = (narrow - 2.0 * largest_m) / (2.0 * STRAY);
        if self.jitter_m >= 0.0 && self.jitter_m <= most {
            return Ok(());
        }
        let allowed = format!(
            "from 0 to {:.3}: neighbours {narrow} m apart that stray keep the distance that their \
             radii ask for",
            most.max(0.0)
        );
        Err(ParamError::range(
            format!("{path}.jitter_m"),
            self.jitter_m,
            allowed,
        ))
    }

    /// Places in a square of one chunk edge.
    pub(crate) fn per_chunk(&self, chunk_size_m: f64) -> f64 {
        chunk_size_m * chunk_size_m / (self.row_m * self.in_row_m)
    }

    /// All planted trees in the square of half edge `need` (chunk edges) around a chunk's centre.
    ///
    /// A place's tree is a function of its two integers, computed in the plane's own coordinates and
    /// snapped there: chunks that look from different origins see the same bits.
    pub(crate) fn plant(
        &self,
        kinds: &Kinds,
        key: Key,
        chunk: ChunkCoord,
        chunk_size_m: f64,
        need: f64,
    ) -> Vec<Point> {
        let scale = 1.0 / chunk_size_m;
        let (row, step, jitter) = (
            self.row_m * scale,
            self.in_row_m * scale,
            self.jitter_m * scale,
        );
        let (sin, cos) = libm::sincos(self.heading_deg.to_radians());
        // A heading is clockwise from north.
        let (along, across) = (DVec2::new(sin, cos), DVec2::new(cos, -sin));
        let mut rng = key.stage(PHASE).rng();
        let phase = DVec2::new(rng.unit_f64(), rng.unit_f64());
        let origin = DVec2::new(f64::from(chunk.x), f64::from(chunk.y));
        let centre = origin + DVec2::splat(0.5);
        // Half the diagonal of the square covers it at any heading.
        let reach = need * std::f64::consts::SQRT_2 + STRAY * jitter;
        let places = |axis: DVec2, spacing: f64, phase: f64| {
            let middle = centre.dot(axis);
            let low = ((middle - reach) / spacing - phase).floor() as i64 - 1;
            let high = ((middle + reach) / spacing - phase).ceil() as i64 + 1;
            low..=high
        };
        let mut points = Vec::new();
        for j in places(across, row, phase.y) {
            for i in places(along, step, phase.x) {
                let key = key.stage(ROWS).item(i as u64).item(j as u64);
                let mut rng = key.rng();
                let (variety, radius, core) = kinds.draw(&mut rng);
                let mut stray = || jitter * rng.normal().clamp(-STRAY, STRAY);
                let place = DVec2::new(
                    (i as f64 + phase.x) * step + stray(),
                    (j as f64 + phase.y) * row + stray(),
                );
                let p = round(along * place.x + across * place.y) - origin;
                if from_centre(p) <= need {
                    points.push(Point {
                        p,
                        core,
                        radius,
                        variety,
                        key,
                    });
                }
            }
        }
        points
    }
}

/// Positions are multiples of 2⁻³⁰, here far from the origin too: the difference to a chunk's corner is exact.
fn round(p: DVec2) -> DVec2 {
    const PLACES: f64 = (1_u64 << 30) as f64;
    (p * PLACES).round() / PLACES
}
