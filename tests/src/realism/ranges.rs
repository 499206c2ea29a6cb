//! The ranges that measures are held to: the page's and the tests'.

/// A diameter at breast height from a scan, root mean square error, metres.
pub const DBH_RMSE_M: (f64, f64) = (0.0, 0.02);
/// And its mean error, metres: none, as well as some tens of stems tell.
pub const DBH_BIAS_M: (f64, f64) = (-0.003, 0.003);
