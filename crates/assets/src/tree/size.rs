//! How big a tree is: drawn from published allometry, handed to the generator as a demand.

/// The size of one tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeSize {
    /// Diameter at breast height (1.3 m), over bark, metres.
    pub dbh_m: f64,
    /// Height of the highest twig or leaf, metres.
    pub height_m: f64,
    /// Height of the lowest living foliage, metres.
    pub crown_base_m: f64,
    /// Radius of the circle with the area of the crown's projection, metres.
    pub crown_radius_m: f64,
    /// One-sided leaf area, m².
    pub leaf_area_m2: f64,
    /// Angle between the vertical and the line from the foot to the top of the stem, radians.
    pub lean_rad: f64,
}
