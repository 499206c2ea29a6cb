//! Nothing: see `tests/`, where each file uses one crate, with the vocabulary and the keys.
