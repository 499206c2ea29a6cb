//! How far one sees through air.

/// The extinction of air with a visibility, 1/m: 2 % of the contrast is left there, −ln 0.02 =
/// 3.912 (Koschmieder 1924).
///
/// # Examples
/// ```
/// let fog_per_m = nemoral_scene::extinction_per_m(50.0);
/// assert!(((-50.0 * fog_per_m).exp() - 0.02).abs() < 1e-5);
/// ```
pub const fn extinction_per_m(visibility_m: f64) -> f64 {
    KOSCHMIEDER / visibility_m
}

/// The visibility through air with an extinction, metres.
pub const fn visibility_m(extinction_per_m: f64) -> f64 {
    KOSCHMIEDER / extinction_per_m
}

const KOSCHMIEDER: f64 = 3.912;
