//! A user's site: where the trees of its stem map stand, what is drawn for them, and what is wrong
//! with its files.

mod measured;
pub(crate) mod plot;
mod problems;
mod species;

pub(crate) use measured::{MeasuredStem, MeasuredStems, ModelStem};
pub(crate) use plot::{PLOT_LAYER, Plot};
pub(crate) use problems::problems;
pub(crate) use species::SiteSpecies;
