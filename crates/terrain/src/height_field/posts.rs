//! Measured heights on a grid.

use glam::DVec2;
use nemoral_scene::ParamError;

/// The most posts of a grid with its surroundings.
const MAX_POSTS: usize = 1 << 25;

/// Measured heights on a grid, row by row from the north, each row from the west.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightPosts {
    /// Posts in a row, at least 2.
    pub columns: usize,
    /// World position of the first post, the north-west one, metres.
    pub first_m: DVec2,
    /// Distance between posts, metres, 0.01 to 1000.
    pub spacing_m: f64,
    /// Height of each post, metres; NaN where nothing was measured.
    pub heights_m: Vec<f32>,
}

impl HeightPosts {
    /// What [`HeightField::new`](crate::HeightField::new) refuses; the result is the width of the
    /// surroundings in posts, and the numbers of columns and rows with them.
    pub(super) fn check(&self, blend_m: f64) -> Result<(usize, [usize; 2]), ParamError> {
        ParamError::check_within("spacing_m", self.spacing_m, 0.01, 1000.0)?;
        ParamError::check_within("blend_m", blend_m, 0.1, 5000.0)?;
        let (columns, count) = (self.columns, self.heights_m.len());
        if columns < 2 || count < 2 * columns || count % columns != 0 {
            let allowed = "at least two rows of columns >= 2 posts";
            return Err(ParamError::new("heights_m.len()", count, allowed));
        }
        if !self.first_m.is_finite() {
            return Err(ParamError::new("first_m", self.first_m, "finite"));
        }
        if let Some(h) = self.heights_m.iter().find(|h| h.is_infinite()) {
            return Err(ParamError::new("heights_m", h, "finite, or NaN for none"));
        }
        if self.heights_m.iter().all(|h| h.is_nan()) {
            return Err(ParamError::new("heights_m", "NaN", "measured somewhere"));
        }
        // The outermost posts, which the spline needs, are beyond the blending distance.
        let margin = (blend_m / self.spacing_m).ceil() as usize + 2;
        let size = [columns, count / columns].map(|n| n + 2 * margin);
        if size[0].saturating_mul(size[1]) > MAX_POSTS {
            let value = format!("{} x {}", size[0], size[1]);
            let allowed = format!("at most {MAX_POSTS} posts; lower blend_m");
            return Err(ParamError::new(
                "posts with their surroundings",
                value,
                allowed,
            ));
        }
        Ok((margin, size))
    }

    /// Checks what [`HeightField::new`](crate::HeightField::new) checks, without its work.
    ///
    /// # Errors
    /// As [`HeightField::new`](crate::HeightField::new).
    pub fn validate(&self, blend_m: f64) -> Result<(), ParamError> {
        self.check(blend_m).map(drop)
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::FlatSurface;

    use super::*;
    use crate::HeightField;
    use crate::height_field::tests::hills;

    #[test]
    fn impossible_grids_are_refused() {
        let (posts, _) = hills(6.0);
        let refused = |change: &dyn Fn(&mut HeightPosts), blend_m: f64| {
            let mut posts = posts.clone();
            change(&mut posts);
            let field = HeightField::new(&posts, blend_m, FlatSurface::default());
            field.expect_err("it is refused").to_string()
        };
        assert!(refused(&|p| p.columns = 1, 6.0).contains("two rows"));
        assert!(refused(&|p| p.columns = 22, 6.0).contains("two rows"));
        assert!(refused(&|p| p.heights_m.fill(f32::NAN), 6.0).contains("measured somewhere"));
        assert!(refused(&|p| p.heights_m[0] = f32::INFINITY, 6.0).contains("finite"));
        assert!(refused(&|p| p.spacing_m = 0.0, 6.0).contains("spacing_m"));
        assert!(refused(&|p| p.first_m.x = f64::NAN, 6.0).contains("first_m"));
        assert!(refused(&|p| p.spacing_m = 0.01, 5000.0).contains("lower blend_m"));
        assert!(refused(&|_| {}, 0.0).contains("blend_m"));
    }
}
