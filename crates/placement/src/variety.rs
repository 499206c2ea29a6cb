//! Varieties: the kinds of disks or plants that are drawn by weight.

use nemoral_scene::ParamError;

/// One kind of disk in a sample, or of plant in a layer: a species, a prototype, a size class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiskKind {
    /// Its share among a layer's sites, or among the darts of
    /// [`PoissonDisks`](crate::PoissonDisks), relative to the other varieties' weights; at least 0.
    pub weight: f64,
    /// The range of its radius in metres, more than 0, drawn uniformly; of a plant, the radius that
    /// its trunk or foot occupies, not its crown's.
    pub radius_m: (f64, f64),
}

/// Checks weights and radii; no radius may be larger than `max_m`, which `what_max` explains.
pub(crate) fn check_varieties(
    path: &str,
    varieties: &[DiskKind],
    max_m: f64,
    what_max: &str,
) -> Result<(), ParamError> {
    check_weights(path, varieties.iter().map(|v| v.weight))?;
    for (i, v) in varieties.iter().enumerate() {
        let (low, high) = v.radius_m;
        if !(low > 0.0 && low <= high && high <= max_m) {
            return Err(ParamError::new(
                format!("{path}[{i}].radius_m"),
                format!("{:?}", v.radius_m),
                format!("a range (low, high) with 0 < low <= high <= {max_m} ({what_max})"),
            ));
        }
    }
    Ok(())
}

/// Checks that no weight is negative, and at least one is positive.
pub(crate) fn check_weights(
    path: &str,
    weights: impl ExactSizeIterator<Item = f64>,
) -> Result<(), ParamError> {
    if weights.len() > usize::from(u16::MAX) {
        return Err(ParamError::new(
            format!("{path}.len()"),
            weights.len(),
            "at most 65535",
        ));
    }
    let mut total = 0.0;
    for (i, weight) in weights.enumerate() {
        ParamError::check_within(format!("{path}[{i}].weight"), weight, 0.0, 1e9)?;
        total += weight;
    }
    if total > 0.0 {
        return Ok(());
    }
    Err(ParamError::new(
        path,
        total,
        "at least one variety with a positive weight",
    ))
}

/// The mean of a function of a variety's radius: uniform in its range.
pub(crate) fn mean_over_radius(variety: &DiskKind, f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 16;
    let (low, high) = variety.radius_m;
    let at = |i: u32| low + (high - low) * (f64::from(i) + 0.5) / f64::from(STEPS);
    (0..STEPS).map(|i| f(at(i))).sum::<f64>() / f64::from(STEPS)
}
