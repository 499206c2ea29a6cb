//! Tests of plans and of what runs them; those of whole worlds are in `worlds`.

mod faults;
mod keys;
mod observe;
