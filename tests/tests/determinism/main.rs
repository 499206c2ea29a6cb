//! The bytes of a recording depend on its config alone: not on threads, order, memory or time.

mod ahead;
mod evicted;
mod order;
mod seen;
