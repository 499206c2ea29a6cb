//! Open land: where woods end, and how layers thin out or close up towards it.

use std::fmt::Debug;

use glam::DVec2;
use nemoral_scene::ParamError;

/// How far a place is within open land: the port through which meadows, fields, lakes or a map
/// reach [`Placement`](crate::Placement).
pub trait OpenLand: Send + Sync + Debug {
    /// Signed distance from the edge of the wood at a world position, metres: negative in the wood,
    /// positive in the open. It must be a pure function.
    fn depth_m(&self, world_m: DVec2) -> f64;
}

/// The density of a layer across the edge of a wood, relative to that in the wood.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeProfile {
    /// Distances from the edge (metres, ascending, negative in the wood), each with the density
    /// there, 0 to 20. Between them it is linear, and beyond the outermost as there.
    pub points: Vec<(f64, f64)>,
}

impl EdgeProfile {
    pub(crate) fn check(&self, path: &str) -> Result<(), ParamError> {
        let field = format!("{path}.points");
        let is_ascending = self.points.windows(2).all(|pair| pair[0].0 < pair[1].0);
        let is_finite = self.points.iter().all(|point| point.0.is_finite());
        if self.points.is_empty() || !is_ascending || !is_finite {
            let allowed = "at least one point, by ascending distance";
            return Err(ParamError::new(
                field,
                format!("{:?}", self.points),
                allowed,
            ));
        }
        for (i, point) in self.points.iter().enumerate() {
            ParamError::check_within(format!("{field}[{i}].1"), point.1, 0.0, 20.0)?;
        }
        Ok(())
    }

    /// The density at a distance from the edge.
    pub(crate) fn at(&self, depth_m: f64) -> f64 {
        let after = self.points.partition_point(|point| point.0 <= depth_m);
        let Some(&(end_m, to)) = self.points.get(after) else {
            return self.points.last().map_or(1.0, |point| point.1);
        };
        let Some(&(start_m, from)) = after.checked_sub(1).and_then(|i| self.points.get(i)) else {
            return to;
        };
        from + (to - from) * (depth_m - start_m) / (end_m - start_m)
    }

    /// The greatest density.
    pub(crate) fn most(&self) -> f64 {
        self.points.iter().map(|point| point.1).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_linear_between_its_points() {
        let profile = EdgeProfile {
            points: vec![(-4.0, 1.0), (0.0, 5.0), (2.0, 0.0)],
        };
        for (depth_m, density) in [
            (-90.0, 1.0),
            (-4.0, 1.0),
            (-2.0, 3.0),
            (0.0, 5.0),
            (1.0, 2.5),
            (2.0, 0.0),
            (f64::INFINITY, 0.0),
        ] {
            assert_eq!(profile.at(depth_m), density, "{depth_m}");
        }
        assert_eq!(profile.most(), 5.0);
    }
}
