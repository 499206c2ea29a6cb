//! The thread pool that stages compute in.

use std::sync::{Arc, PoisonError, RwLock};

use rayon::ThreadPool;

static POOL: RwLock<Option<Arc<ThreadPool>>> = RwLock::new(None);

/// Lets the stages of all plans of this process compute in a pool, or in rayon's global pool again
/// if it is `None`. The result is the pool that was used before.
///
/// Programs do not need this. A library that is loaded into other programs does: rayon's global
/// pool cannot be replaced, but the threads of a pool do not survive a `fork`. No pool changes a
/// result.
pub fn use_thread_pool(pool: Option<Arc<ThreadPool>>) -> Option<Arc<ThreadPool>> {
    let mut current = POOL.write().unwrap_or_else(PoisonError::into_inner);
    std::mem::replace(&mut current, pool)
}

/// Computes in the pool. `work` must not ask for a node of a plan: it might wait for another thread
/// that waits for the pool.
pub(crate) fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = POOL.read().unwrap_or_else(PoisonError::into_inner).clone();
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pool_is_used_until_it_is_replaced() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build();
        let pool = Arc::new(pool.expect("threads"));
        let before = use_thread_pool(Some(Arc::clone(&pool)));
        assert_eq!(in_pool(rayon::current_num_threads), 3);
        let mine = use_thread_pool(before).expect("it was in use");
        assert!(Arc::ptr_eq(&mine, &pool));
    }
}
