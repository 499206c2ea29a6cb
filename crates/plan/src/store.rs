//! The store of computed values.

use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};

use crate::node::Value;
use crate::{AnyCoordinate, Cache, Fingerprint, Plan, PlanTypes, StageError};

/// A thread-safe store of node values. A value is computed by one thread; others that want it
/// meanwhile wait. Evicting a value never changes a result, only the work.
pub struct Store<P: PlanTypes> {
    capacity: usize,
    cache: Option<Arc<Cache>>,
    inner: Mutex<Inner<P>>,
}

impl<P: PlanTypes> fmt::Debug for Store<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Store")
            .field("capacity", &self.capacity)
            .field("cache", &self.cache)
            .field("len", &self.len())
            .finish()
    }
}

struct Inner<P: PlanTypes> {
    slots: HashMap<Fingerprint, Slot<P>>,
    /// Counts insertions, to find the oldest.
    clock: u64,
    computed: u64,
}

enum Slot<P: PlanTypes> {
    /// Another thread computes it; one waits for this promise.
    Pending(Arc<Promise<P::Error>>),
    Ready {
        value: Value,
        id: &'static str,
        at: P::At,
        age: u64,
    },
}

/// A value that a thread computes while others may wait for it.
pub(crate) struct Promise<E> {
    result: Mutex<Option<Result<Value, E>>>,
    done: Condvar,
}

/// What a store says if it is asked for a value.
pub(crate) enum Answer<E> {
    /// It was there, or was computed.
    Settled(Result<Value, E>),
    /// Another thread computes it.
    Pending(Arc<Promise<E>>),
}

impl<E: Clone> Answer<E> {
    /// The value, for which one waits if another thread computes it.
    pub(crate) fn wait(self) -> Result<Value, E> {
        match self {
            Self::Settled(result) => result,
            Self::Pending(promise) => promise.wait(),
        }
    }
}

impl<E: Clone> Promise<E> {
    fn new() -> Self {
        Self {
            result: Mutex::new(None),
            done: Condvar::new(),
        }
    }

    fn wait(&self) -> Result<Value, E> {
        let mut result = lock(&self.result);
        loop {
            if let Some(result) = &*result {
                return result.clone();
            }
            result = self
                .done
                .wait(result)
                .unwrap_or_else(std::sync::PoisonError::into_inner);
        }
    }

    fn fulfil(&self, result: Result<Value, E>) {
        *lock(&self.result) = Some(result);
        self.done.notify_all();
    }
}

/// A panic of another thread leaves these maps consistent, as every change is one statement.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Fulfils a promise even if the computation panics, so that waiting threads get an error.
struct Obligation<'a, P: PlanTypes> {
    store: &'a Store<P>,
    key: Fingerprint,
    id: &'static str,
    at: P::At,
    promise: Arc<Promise<P::Error>>,
    kept: bool,
}

impl<P: PlanTypes> Drop for Obligation<'_, P> {
    fn drop(&mut self) {
        if !self.kept {
            lock(&self.store.inner).slots.remove(&self.key);
            self.promise
                .fulfil(Err(P::Error::panicked(self.id, self.at)));
        }
    }
}

impl<P: PlanTypes> Store<P> {
    /// A store that keeps everything until [`Store::retain`] says otherwise.
    #[must_use]
    pub fn unlimited() -> Self {
        Self::with_capacity(usize::MAX)
    }

    /// A store that keeps at most `capacity` values and drops the oldest. The values of global
    /// nodes, which are few and expensive, are always kept in addition to these.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        Self {
            capacity,
            cache: None,
            inner: Mutex::new(Inner {
                slots: HashMap::new(),
                clock: 0,
                computed: 0,
            }),
        }
    }

    /// The same store with a folder that stores values between runs.
    #[must_use]
    pub fn with_cache(mut self, cache: Option<Arc<Cache>>) -> Self {
        self.cache = cache;
        self
    }

    /// The folder that stores values between runs.
    #[must_use]
    pub fn cache(&self) -> Option<&Cache> {
        self.cache.as_deref()
    }

    /// Drops every value that `keep` (given the stage's id and the coordinate) refuses.
    pub fn retain(&self, keep: impl Fn(&'static str, P::At) -> bool) {
        // Dropped values are freed after the lock is released.
        let mut dropped = Vec::new();
        let mut inner = lock(&self.inner);
        inner.slots.retain(|_, slot| match slot {
            Slot::Ready { id, at, value, .. } if !keep(id, *at) => {
                dropped.push(Arc::clone(value));
                false
            }
            _ => true,
        });
        drop(inner);
    }

    /// Drops every value that is not one of this plan's, such as those of a plan before it. What
    /// both have in common stays.
    pub fn retain_plan(&self, plan: &Plan<P>) {
        let mut dropped = Vec::new();
        let mut inner = lock(&self.inner);
        inner.slots.retain(|&key, slot| match slot {
            Slot::Ready { id, at, value, .. } if !plan.has(key, id, *at) => {
                dropped.push(Arc::clone(value));
                false
            }
            _ => true,
        });
        drop(inner);
    }

    /// Takes over another store's values of a stage, so that both share them.
    pub fn adopt(&self, other: &Self, stage: &str) {
        if std::ptr::eq(self, other) {
            return;
        }
        let of_stage = |(key, slot): (&Fingerprint, &Slot<P>)| match slot {
            Slot::Ready { id, at, value, age } if *id == stage => {
                Some((*age, (*key, Arc::clone(value), *id, *at)))
            }
            _ => None,
        };
        let theirs = lock(&other.inner);
        let mut found: Vec<_> = theirs.slots.iter().filter_map(of_stage).collect();
        drop(theirs);
        found.sort_unstable_by_key(|&(age, _)| age);
        let mut inner = lock(&self.inner);
        for (_, (key, value, id, at)) in found {
            inner.clock += 1;
            let age = inner.clock;
            (inner.slots.entry(key)).or_insert(Slot::Ready { value, id, at, age });
        }
    }

    /// How many values are kept now.
    #[must_use]
    pub fn len(&self) -> usize {
        lock(&self.inner)
            .slots
            .values()
            .filter(|s| matches!(s, Slot::Ready { .. }))
            .count()
    }

    /// How many values of a stage are kept now.
    #[must_use]
    pub fn count(&self, stage: &str) -> usize {
        let of_stage = |s: &&Slot<P>| matches!(s, Slot::Ready { id, .. } if *id == stage);
        lock(&self.inner).slots.values().filter(of_stage).count()
    }

    /// Whether the store is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many values were computed so far, or read from the cache.
    #[must_use]
    pub fn computed(&self) -> u64 {
        lock(&self.inner).computed
    }

    /// Whether this value is in the store.
    #[must_use]
    pub fn contains(&self, key: Fingerprint) -> bool {
        matches!(lock(&self.inner).slots.get(&key), Some(Slot::Ready { .. }))
    }

    /// Gets a value, or computes it unless another thread does.
    pub(crate) fn get_or_compute(
        &self,
        key: Fingerprint,
        id: &'static str,
        at: P::At,
        compute: impl FnOnce() -> Result<Value, P::Error>,
    ) -> Answer<P::Error> {
        let promise = {
            let mut inner = lock(&self.inner);
            match inner.slots.get(&key) {
                Some(Slot::Ready { value, .. }) => {
                    return Answer::Settled(Ok(Arc::clone(value)));
                }
                Some(Slot::Pending(promise)) => return Answer::Pending(Arc::clone(promise)),
                None => {
                    let promise = Arc::new(Promise::new());
                    inner.slots.insert(key, Slot::Pending(Arc::clone(&promise)));
                    promise
                }
            }
        };
        let mut obligation = Obligation {
            store: self,
            key,
            id,
            at,
            promise,
            kept: false,
        };
        let result = compute();
        self.settle(key, id, at, &result);
        obligation.kept = true;
        obligation.promise.fulfil(result.clone());
        Answer::Settled(result)
    }

    fn settle(
        &self,
        key: Fingerprint,
        id: &'static str,
        at: P::At,
        result: &Result<Value, P::Error>,
    ) {
        let mut inner = lock(&self.inner);
        inner.computed += 1;
        inner.clock += 1;
        let age = inner.clock;
        match result {
            Ok(value) => {
                let value = Arc::clone(value);
                inner.slots.insert(key, Slot::Ready { value, id, at, age });
            }
            Err(_) => {
                inner.slots.remove(&key);
            }
        }
        if inner.slots.len() > self.capacity {
            let ready = |(&key, slot): (&Fingerprint, &Slot<P>)| match slot {
                Slot::Ready { age, at, .. } if *at != P::At::GLOBAL => Some((*age, key)),
                _ => None,
            };
            let mut oldest: Vec<_> = inner.slots.iter().filter_map(ready).collect();
            oldest.sort_unstable();
            let surplus = oldest.len().saturating_sub(self.capacity);
            for (_, key) in &oldest[..surplus] {
                inner.slots.remove(key);
            }
        }
    }
}
