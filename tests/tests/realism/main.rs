//! Stands are what a forester asked for, and pictures of them have the statistics of photographs.

mod floor;
mod looks;
mod measures;
mod pictures;
mod placement;
mod relations;
mod seedlings;
mod stands;
