//! This crate gives every random decision its own key, so that order cannot matter.
//!
//! Nothing is ever drawn from a shared stream. A [`Key`] names *what a number is for*: the world,
//! the purpose (its *domain*, as in domain separation), the chunk, the item. Keys are `Copy`,
//! cannot be advanced, only derived; the same path gives the same numbers whichever thread asks
//! first, and whatever else was asked before.
//!
//! ```
//! use nemoral_seed::{Draw, Key, Domain};
//!
//! const TREES: Domain = Domain::new("example.trees");
//! let world = Key::world(7);
//! let mut rng = world.domain(TREES).chunk([3, -1]).item(12).rng();
//! let height_m = rng.range_f64(8.0, 25.0);
//! // Asking again, later, from another thread, gives the same tree.
//! let mut again = world.domain(TREES).chunk([3, -1]).item(12).rng();
//! assert_eq!(height_m, again.range_f64(8.0, 25.0));
//! ```
//!
//! The generator is Philox4x32-10 (Salmon, Moraes, Dror, Shaw 2011, "Parallel random numbers: as
//! easy as 1, 2, 3"), a counter-based bijection that passes its published known-answer tests.
//! [`PhiloxRng`] implements rand's traits. Distributions that decide the content of a world are
//! [`Draw`]'s, with golden values, because rand's may change between its minor releases.

mod draw;
mod key;
mod philox;

pub use draw::Draw;
pub use key::{Domain, Key};
pub use philox::{PhiloxRng, philox4x32};
pub use rand::Rng;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
