//! Tests of measures of stands and canopies, in one program.

mod canopy;
mod stand;
