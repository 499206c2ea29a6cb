//! The kinds of way that trails are.

use crate::schema::AllowedValues::{OneOf, Real, Text};
use crate::schema::section;

/// The word of `robot.trail.way` for any kind.
const ANY_WAY: &str = "any";

/// The words of `robot.trail.way`: [`ANY_WAY`], then the kinds in the order of their numbers.
pub(crate) const WAYS: [&str; 7] = [
    ANY_WAY,
    "forest_road",
    "track",
    "skid_trail",
    "firebreak",
    "footpath",
    "deer_path",
];

section! {
    /// The kinds of way that trails are, by their shares; each trail is of one kind. Where kinds
    /// meet, forest roads, tracks and skid trails join at grade, and the others fade into them.
    TrailKinds at "trails.kinds" {
        /// Share of roads with a carriageway of gravel and a ditch.
        forest_road: f64 = 0.12, Real(0.0, 1.0), "our choice";
        /// Share of machine tracks, with two ruts and a strip between: the keys of `[trails]`.
        track: f64 = 0.4, Real(0.0, 1.0), "our choice";
        /// Share of trails on which timber was skidded.
        skid_trail: f64 = 0.1, Real(0.0, 1.0), "our choice";
        /// Share of strips that are kept free of fuel.
        firebreak: f64 = 0.03, Real(0.0, 1.0), "our choice: rare";
        /// Share of trodden paths.
        footpath: f64 = 0.25, Real(0.0, 1.0), "our choice";
        /// Share of the paths of deer.
        deer_path: f64 = 0.1, Real(0.0, 1.0), "our choice";
    }
}

section! {
    /// How trails are built: the slopes of tracks, forest roads and skid trails, and the section of
    /// tracks.
    TrailSection at "trails.section" {
        /// Horizontal metres per metre of height of slopes cut into higher ground.
        cut_ratio: f64 = 1.0, Real(0.25, 10.0), "1:1 in earth (FAO 1977, logging roads)";
        /// Horizontal metres per metre of height of slopes filled onto lower ground.
        fill_ratio: f64 = 1.5, Real(0.25, 10.0), "1.5:1 in earth (FAO 1977, logging roads)";
        /// The steepest run along a track, away from other ways and as far as `earth_m` allows.
        max_grade: f64 = 0.2, Real(0.02, 1.0), "our choice: 20 %";
        /// How far tracks, forest roads and skid trails may lie above or below the smoothed ground,
        /// to keep to their steepest runs.
        earth_m: f64 = 3.0, Real(0.2, 30.0), "our choice: deeper cuts are rare on forest ways";
        /// Standard deviation with which the ground along a track is smoothed.
        smoothing_m: f64 = 8.0, Real(1.0, 50.0), "our choice";
        /// Slope across a track towards the downhill side.
        crossfall: f64 = 0.03, Real(0.0, 0.2), "our choice: 3 %, to drain";
        /// A curve that is added to a track's section: offset to the left and height in metres, by
        /// rising offset, as in "-1.3 0.1, 0 0, 1.3 0.1"; constant beyond its ends.
        curve: String = String::new(), Text, "none; paper, III";
    }
}

section! {
    /// Footpaths, worn by feet.
    Footpath at "trails.footpath" {
        /// Mean width.
        width_m: f64 = 0.8, Real(0.4, 1.5), "our choice: 0.4-1.2 m";
        /// How much the width varies along the path, relative to it.
        width_variation: f64 = 0.4, Real(0.0, 0.6), "our choice";
        /// Depth below the ground.
        sink_m: f64 = 0.06, Real(0.0, 0.4), "our choice: trodden litter and soil";
        /// Further depth where the path is steep.
        hollow_m: f64 = 0.4, Real(0.0, 1.5), "our choice: a hollow way from 20 % on";
        /// Roots across a metre of the path, whatever grows beside it; on a path that changes, half
        /// as many, in patches.
        roots_per_m: f64 = 1.0, Real(0.0, 5.0), "our choice: bare roots among trees";
        /// The grade from which about two thirds of the runs have steps of logs; 0 for none.
        steps_from_grade: f64 = 0.2, Real(0.0, 1.0), "our choice: steeper paths wash out";
    }
}

section! {
    /// Forest roads.
    ForestRoad at "trails.forest_road" {
        /// Width of the carriageway.
        width_m: f64 = 3.6, Real(2.5, 6.0), "3.5 m are usual for lorries";
        /// Slope from the middle to the edges.
        camber: f64 = 0.04, Real(0.0, 0.1), "our choice: 3-5 %";
        /// Depth of the ditch along the uphill edge, on level ground along both; 0 for none.
        ditch_depth_m: f64 = 0.35, Real(0.0, 0.8), "0.3 m and more are usual";
        /// Width of the ditch.
        ditch_width_m: f64 = 1.2, Real(0.4, 1.5), "0.6-1.2 m are usual";
        /// About the share of the ditches in which stones lie side by side.
        stone_beds: f64 = 0.35, Real(0.0, 1.0), "our choice: where water runs";
        /// Distance of the culverts that lead its ditch's water under it, on slopes; 0 for none.
        culvert_spacing_m: f64 = 60.0, Real(0.0, 500.0), "our choice: 50-100 m are usual on slopes";
        /// Radius of the loops at its ends, on which vehicles turn, less in small chunks; 0 for
        /// none.
        turning_radius_m: f64 = 7.0, Real(0.0, 15.0), "our choice: 6-12 m are usual for lorries";
    }
}

section! {
    /// Skid trails.
    SkidTrail at "trails.skid_trail" {
        /// Width.
        width_m: f64 = 4.0, Real(2.5, 6.0), "4 m are usual for harvesters";
        /// Mean depth of the ruts; in mud they are 2.5 times as deep.
        rut_depth_m: f64 = 0.12, Real(0.0, 0.4), "our choice: 0.1-0.4 m when wet";
        /// Share of skid trails that is covered with mats of brash.
        brash: f64 = 0.35, Real(0.0, 1.0), "our choice";
    }
}

section! {
    /// Paths of deer.
    DeerPath at "trails.deer_path" {
        /// Width.
        width_m: f64 = 0.4, Real(0.3, 0.8), "our choice: 0.25-0.4 m, and not less than a cell";
    }
}

section! {
    /// Firebreaks.
    Firebreak at "trails.firebreak" {
        /// Width.
        width_m: f64 = 6.0, Real(3.0, 12.0), "our choice";
    }
}

section! {
    /// Along the nearest trail; a wander if there is none.
    PathTrail at "robot.trail", one of "the robot's path" {
        /// Distance from the start within which a trail is searched.
        search_radius_m: f64 = 500.0, Real(0.0, 2000.0), "our choice";
        /// The kind of way that is searched.
        way: String = ANY_WAY.into(), OneOf(&WAYS), "the nearest, whichever it is";
    }
}

impl TrailSection {
    /// The points of the curve.
    pub(crate) fn points(&self) -> Result<Vec<[f64; 2]>, String> {
        if self.curve.trim().is_empty() {
            return Ok(Vec::new());
        }
        let point = |text: &str| {
            let numbers: Vec<f64> = (text.split_whitespace())
                .filter_map(|word| word.parse().ok())
                .collect();
            match (numbers[..].try_into(), text.split_whitespace().count()) {
                (Ok(point), 2) => Ok(point),
                _ => Err(format!("{text:?} is not an offset and a height in metres")),
            }
        };
        let points: Vec<[f64; 2]> = self.curve.split(',').map(point).collect::<Result<_, _>>()?;
        let mut last = f64::NEG_INFINITY;
        for [offset, height] in &points {
            if !(-10.0..=10.0).contains(offset) || *offset < last + 0.01 {
                return Err(format!(
                    "offset {offset} is not within -10..=10 m and 1 cm more than the one before"
                ));
            }
            if !(-2.0..=2.0).contains(height) {
                return Err(format!("height {height} is not within -2..=2 m"));
            }
            last = *offset;
        }
        Ok(points)
    }
}

impl TrailKinds {
    /// Machine tracks only.
    #[must_use]
    pub fn tracks_only() -> Self {
        Self {
            forest_road: 0.0,
            track: 1.0,
            skid_trail: 0.0,
            firebreak: 0.0,
            footpath: 0.0,
            deer_path: 0.0,
        }
    }

    /// The shares, in the order of the kinds' numbers.
    #[must_use]
    pub fn shares(&self) -> [f64; 6] {
        [
            self.forest_road,
            self.track,
            self.skid_trail,
            self.firebreak,
            self.footpath,
            self.deer_path,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_read_or_refused() {
        let of = |curve: &str| {
            let curve = curve.to_owned();
            TrailSection {
                curve,
                ..TrailSection::default()
            }
            .points()
        };
        assert_eq!(of(" "), Ok(Vec::new()));
        assert_eq!(
            of("-1 0.1, 0 0,1 .1"),
            Ok(vec![[-1.0, 0.1], [0.0, 0.0], [1.0, 0.1]])
        );
        for bad in [
            "1", "1 2 3", "a b", "1 0, 1 0", "0 3", "0 nan", "11 0", "0 0,",
        ] {
            assert!(of(bad).is_err(), "{bad}");
        }
    }
}
