//! What makes a species.

use nemoral_seed::Key;

use super::TreeSize;

/// A species: numbers from the literature, no code of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Species {
    /// `snake_case`, for files and names of prototypes.
    pub name: &'static str,
}

impl Species {
    /// All species, in a fixed order: maritime pine, eucalyptus, English oak.
    #[must_use]
    pub fn all() -> Vec<Self> {
        vec![Self::maritime_pine(), Self::eucalyptus(), Self::english_oak()]
    }
    /// Maritime pine, *Pinus pinaster*.
    #[must_use]
    pub fn maritime_pine() -> Self {
        Self { name: "maritime_pine" }
    }
    /// Blue gum, *Eucalyptus globulus*.
    #[must_use]
    pub fn eucalyptus() -> Self {
        Self { name: "eucalyptus" }
    }
    /// English oak, *Quercus robur*.
    #[must_use]
    pub fn english_oak() -> Self {
        Self { name: "english_oak" }
    }
    /// A diameter at breast height, metres: Weibull with this mean and shape, truncated to `limits_m`.
    #[must_use]
    pub fn draw_dbh(&self, mean_m: f64, shape: f64, limits_m: [f64; 2], key: Key) -> f64 {
        let _ = (mean_m, shape, key);
        limits_m[0]
    }
    /// The size of a tree of this diameter.
    #[must_use]
    pub fn draw_size(&self, dbh_m: f64, key: Key) -> TreeSize {
        let _ = key;
        TreeSize { dbh_m, height_m: 0.0, crown_base_m: 0.0, crown_radius_m: 0.0, leaf_area_m2: 0.0, lean_rad: 0.0 }
    }
}
