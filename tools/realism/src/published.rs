//! Height curves as their authors have them, which those of some species were fitted to or stand
//! for.

/// The mean height, metres, of trees of a species with this diameter at breast height, metres, by
/// the formula of a publication: Pukkala et al. 2009 for Scots pine and silver birch, SEEM (south-
/// west Oregon) for Douglas fir, Bartelink 1997 for beech; `None` for other species.
#[must_use]
pub fn published_height_m(species: &str, dbh_m: f64) -> Option<f64> {
    let d = 100.0 * dbh_m;
    Some(match species {
        "scots_pine" => 31.4 / (1.0 + 19.26 / d + 31.72 / (d * d)),
        "silver_birch" => 37.1 / (1.0 + 22.64 / d - 8.0 / (d * d)),
        "douglas_fir" => 1.3 + (5.7567 - 6.7792 * d.powf(-0.2795)).exp(),
        "beech" => 1.732 * d.powf(0.769),
        _ => return None,
    })
}
