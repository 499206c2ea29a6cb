//! The diameters that a config asks for.

use nemoral_assets::Species;
use nemoral_pipeline::config::Assets;
use nemoral_seed::{Draw, Key};

use super::ranges::Range;
use super::weibull_fit;

/// A sample of the diameters that a config asks for, whose trees are scaled by up to a tenth.
///
/// # Panics
/// If it asks for the user's species.
#[must_use]
pub fn asked_diameters(assets: &Assets) -> Vec<f64> {
    const SAMPLE: f64 = 6000.0;
    let limits = [assets.dbh_min_m, assets.dbh_max_m];
    let shares: Vec<_> = assets.shares().into_iter().filter(|s| s.1 > 0.0).collect();
    let all: f64 = shares.iter().map(|s| s.1).sum();
    let mut out = Vec::new();
    for (name, share) in shares {
        let species = name
            .and_then(Species::built_in)
            .expect("a built-in species");
        let n = (SAMPLE * share / all).round();
        for i in 0..n as u32 {
            let rank = (f64::from(i) + 0.5) / n;
            let dbh_m = species.dbh_of_rank(assets.dbh_mean_m, assets.dbh_shape, limits, rank);
            // Van der Corput's sequence gives scales like random ones, but none twice.
            let scale = 0.9 + 0.2 * f64::from(i.reverse_bits()) / f64::from(u32::MAX);
            out.push(dbh_m * scale);
        }
    }
    out
}

/// The range of 95 of 100 fitted shapes if the stand's individuals are drawn repeatedly. It is
/// wide, as few trees, one from each part of the distribution, determine its shape poorly.
///
/// # Panics
/// If it asks for the user's species.
#[must_use]
pub fn asked_shapes(a: &Assets) -> Range {
    const AGAIN: u64 = 400;
    let limits = [a.dbh_min_m, a.dbh_max_m];
    let shares: Vec<_> = a.shares().into_iter().filter(|s| s.1 > 0.0).collect();
    let all: f64 = shares.iter().map(|s| s.1).sum();
    let mut fits: Vec<f64> = (0..AGAIN)
        .map(|again| {
            let key = Key::world(31).item(again);
            let mut rng = key.rng();
            let mut diameters = Vec::new();
            for (k, (name, share)) in shares.iter().enumerate() {
                let species = name.and_then(Species::built_in).expect("built in");
                let of_species = (400.0 * share / all).ceil() as u32;
                let key = key.item(k as u64);
                let individual = |i: u32| {
                    let (mean_m, of) = (a.dbh_mean_m, [i, a.individuals]);
                    species.dbh_of_individual(mean_m, a.dbh_shape, limits, of, key)
                };
                let grown: Vec<f64> = (0..a.individuals).map(individual).collect();
                // As in a forest, not all individuals stand equally often.
                diameters.extend((0..of_species).map(|_| {
                    let d = grown[rng.below(a.individuals) as usize];
                    d * rng.range_f64(0.9, 1.1)
                }));
            }
            weibull_fit(&diameters).0
        })
        .collect();
    fits.sort_by(f64::total_cmp);
    (fits[AGAIN as usize / 40], fits[AGAIN as usize * 39 / 40])
}
