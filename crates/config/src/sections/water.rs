//! Keys of streams, ponds and puddles.

use crate::schema::AllowedValues::Real;
use crate::schema::section;

section! {
    /// Streams, ponds and puddles. Water is opaque in depth, classes and scans, pictures show it
    /// mirroring and its bed through it. There is none but puddles on a site of your own, with
    /// stems or heights.
    Water at "water" {
        /// Mean number of springs on a square kilometre. Each gives a stream to the next hollow of
        /// the terrain, where there is a pond, if that is within 360 m.
        springs_per_km2: f64 = 14.0, Real(0.0, 400.0), "our choice: a stream in view now and then";
        /// Width of the water of a stream 100 m below its spring; it grows with the square root of
        /// the length of streams above.
        stream_width_m: f64 = 0.8, Real(0.3, 4.0),
            "our choice; headwaters, Leopold and Maddock 1953 for the square root";
        /// Share of the terrain's hollows that hold a pond without a stream.
        ponds: f64 = 0.05, Real(0.0, 1.0), "our choice: rare";
        /// Mean radius of the largest ponds.
        pond_radius_m: f64 = 7.0, Real(2.0, 12.0), "our choice";
        /// How many of the places of trails that can hold a puddle have one, where it is wettest.
        puddles: f64 = 0.7, Real(0.0, 1.0), "our choice: some days after rain";
    }
}

impl Water {
    /// No water at all.
    #[must_use]
    pub fn none() -> Self {
        Self {
            springs_per_km2: 0.0,
            ponds: 0.0,
            puddles: 0.0,
            ..Self::default()
        }
    }

    /// Whether there are streams or ponds.
    #[must_use]
    pub fn has_beds(&self) -> bool {
        self.springs_per_km2 > 0.0 || self.ponds > 0.0
    }

    /// Whether there is any water.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.has_beds() || self.puddles > 0.0
    }
}
