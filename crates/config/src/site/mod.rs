//! A user's site: the sizes of the trees of its stem map, what is drawn for them, and what is wrong
//! with its files.

mod measured;
mod problems;
mod species;

pub use measured::{MeasuredStem, MeasuredStems, ModelStem};
pub(crate) use problems::problems;
pub use species::SiteSpecies;
