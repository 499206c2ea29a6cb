//! A bounded cache of pure functions.

use std::collections::{HashMap, VecDeque};
use std::hash::Hash;
use std::sync::{Mutex, PoisonError};

/// Keeps the last `capacity` values that were made. Values must be pure functions of their keys, so
/// that neither evictions nor two threads that make the same value can change a result.
pub(crate) struct Cache<K, V> {
    capacity: usize,
    state: Mutex<State<K, V>>,
}

struct State<K, V> {
    values: HashMap<K, V>,
    /// Keys of `values`, oldest first.
    order: VecDeque<K>,
}

impl<K: Copy + Eq + Hash, V: Clone> Cache<K, V> {
    pub(crate) fn new(capacity: usize) -> Self {
        let state = State {
            values: HashMap::new(),
            order: VecDeque::new(),
        };
        Self {
            capacity,
            state: Mutex::new(state),
        }
    }

    pub(crate) fn get_or_make(&self, key: K, make: impl FnOnce() -> V) -> V {
        // A panic while the lock is held leaves the state consistent, as no code of values runs
        // inside.
        let lock = || self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = lock().values.get(&key) {
            return value.clone();
        }
        let value = make();
        let mut state = lock();
        if state.values.insert(key, value.clone()).is_none() {
            state.order.push_back(key);
        }
        if state.order.len() > self.capacity {
            let oldest = state.order.pop_front().expect("it is longer than 0");
            state.values.remove(&oldest);
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_forgets_the_oldest() {
        let cache = Cache::new(2);
        for key in [1, 2, 1, 3] {
            assert_eq!(cache.get_or_make(key, || key * 10), key * 10);
        }
        assert_eq!(cache.get_or_make(3, || 0), 30);
        assert_eq!(cache.get_or_make(1, || 7), 7);
    }
}
