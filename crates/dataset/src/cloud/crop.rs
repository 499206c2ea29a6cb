//! A part of the world, as plots are.

use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

use nemoral_scene::glam::DVec2;

use crate::Error;

/// A part of the world, seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crop {
    /// From one corner to the other, which does not belong to it.
    Rectangle {
        /// Least east and north, metres.
        low_m: DVec2,
        /// Greatest east and north, metres.
        high_m: DVec2,
    },
    /// A circular plot.
    Circle {
        /// East and north of its middle, metres.
        centre_m: DVec2,
        /// Its radius, metres.
        radius_m: f64,
    },
}

impl Crop {
    /// Whether a place belongs to it.
    #[must_use]
    pub fn contains(&self, place_m: DVec2) -> bool {
        match *self {
            Self::Rectangle { low_m, high_m } => {
                place_m.cmpge(low_m).all() && place_m.cmplt(high_m).all()
            }
            Self::Circle { centre_m, radius_m } => place_m.distance(centre_m) <= radius_m,
        }
    }

    /// The lowest and the highest corner of the rectangle around it, metres.
    #[must_use]
    pub fn bounds_m(&self) -> [DVec2; 2] {
        match *self {
            Self::Rectangle { low_m, high_m } => [low_m, high_m],
            Self::Circle { centre_m, radius_m } => [centre_m - radius_m, centre_m + radius_m],
        }
    }

    /// Its area, m².
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        match *self {
            Self::Rectangle { low_m, high_m } => (high_m - low_m).element_product(),
            Self::Circle { radius_m, .. } => PI * radius_m * radius_m,
        }
    }
}

/// The form that is read.
impl fmt::Display for Crop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rectangle { low_m, high_m } => {
                write!(f, "{},{},{},{}", low_m.x, low_m.y, high_m.x, high_m.y)
            }
            Self::Circle { centre_m, radius_m } => {
                write!(f, "{},{},{radius_m}", centre_m.x, centre_m.y)
            }
        }
    }
}

impl FromStr for Crop {
    type Err = Error;

    /// `WEST,SOUTH,EAST,NORTH` for a rectangle, `EAST,NORTH,RADIUS` for a circle, in metres.
    fn from_str(text: &str) -> Result<Self, Error> {
        let allowed = "WEST,SOUTH,EAST,NORTH of a rectangle or EAST,NORTH,RADIUS of a circle, in \
                       metres";
        let refused = || Error::invalid("crop", format!("'{text}'"), allowed);
        let numbers: Option<Vec<f64>> = text
            .split(',')
            .map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite()))
            .collect();
        match numbers.ok_or_else(refused)?[..] {
            [west, south, east, north] if west < east && south < north => Ok(Self::Rectangle {
                low_m: DVec2::new(west, south),
                high_m: DVec2::new(east, north),
            }),
            [x, y, radius_m] if radius_m > 0.0 => Ok(Self::Circle {
                centre_m: DVec2::new(x, y),
                radius_m,
            }),
            _ => Err(refused()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_and_circles() {
        let rectangle: Crop = "-10, 5, 20, 7.5".parse().expect("a rectangle");
        assert!(rectangle.contains(DVec2::new(-10.0, 5.0)));
        assert!(!rectangle.contains(DVec2::new(20.0, 6.0)));
        let circle: Crop = "3,4,5".parse().expect("a circle");
        assert!(circle.contains(DVec2::ZERO) && !circle.contains(DVec2::new(3.0, 9.1)));
        assert_eq!(
            rectangle.to_string().parse::<Crop>().expect("its own"),
            rectangle
        );
        assert_eq!(circle.to_string(), "3,4,5");
        assert_eq!(
            circle.bounds_m(),
            [DVec2::new(-2.0, -1.0), DVec2::new(8.0, 9.0)]
        );
        assert_eq!((rectangle.area_m2(), circle.area_m2()), (75.0, 25.0 * PI));
        for bad in [
            "",
            "1,2",
            "1,2,0",
            "1,2,-3",
            "5,0,1,9",
            "a,b,c",
            "1,2,inf",
            "1,2,3,4,5",
        ] {
            let error = bad.parse::<Crop>().expect_err(bad).to_string();
            assert!(error.contains("EAST,NORTH,RADIUS"), "{error}");
        }
    }
}
