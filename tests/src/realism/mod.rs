//! Measures of realism that need no photograph (`reference/vegetation.md` section 7): how stems stand, how
//! light is spread over a picture, how thick a stem is in a scan. None of this is from the crates under test.

mod circle;
mod picture;
mod plot;
mod stems;

pub use circle::{Circle, circle};
pub use picture::{Colour, amplitude_slope, colour, luminance, spectrum};
pub use plot::{Plot, Series};
pub use stems::{clark_evans, pair_correlation, row_power, weibull_fit};
