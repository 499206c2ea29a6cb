//! Values that are wanted together, computed by several threads.

use std::collections::VecDeque;
use std::fmt;
use std::panic::resume_unwind;
use std::sync::Mutex;
use std::thread::ScopedJoinHandle;

use crate::PlanTypes;
use crate::node::Value;
use crate::plan::Runner;
use crate::store::lock;

/// Values of nodes that are wanted together; see [`Demand::batch`](crate::Demand::batch).
pub struct DemandBatch<'a, P: PlanTypes> {
    runner: Runner<'a, P>,
    /// The node and the coordinates of each demand.
    of_demands: Vec<(usize, Vec<P::At>)>,
}

impl<P: PlanTypes> fmt::Debug for DemandBatch<'_, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("DemandBatch")
            .field(&self.of_demands)
            .finish()
    }
}

impl<'a, P: PlanTypes> DemandBatch<'a, P> {
    pub(crate) fn new(runner: Runner<'a, P>, node: usize, places: Vec<P::At>) -> Self {
        let of_demands = vec![(node, places)];
        Self { runner, of_demands }
    }

    /// These, and then those.
    #[must_use]
    pub fn and(mut self, then: Self) -> Self {
        self.of_demands.extend(then.of_demands);
        self
    }

    /// Computes all of them by the runner's threads, so that they are in the store.
    ///
    /// # Errors
    /// The error of the first of them, in their order, that has one.
    pub fn compute(self) -> Result<(), P::Error> {
        self.values()
            .into_iter()
            .try_for_each(|value| value.map(drop))
    }

    /// All of them, in their order.
    pub(crate) fn values(&self) -> Vec<Result<Value, P::Error>> {
        let of_demand = |(node, places): &(usize, Vec<P::At>)| {
            let node = *node;
            places.iter().map(move |&at| (node, at)).collect::<Vec<_>>()
        };
        let all: Vec<(usize, P::At)> = self.of_demands.iter().flat_map(of_demand).collect();
        // One more than the threads that compute at once, as one or the other waits for a neighbour
        // or for a pool.
        let threads = self.runner.threads();
        let spare = usize::from(threads > 1);
        let workers = threads.saturating_add(spare).min(all.len()).max(1);
        let shares = self.shares(workers);
        // A worker that is done with its share helps the next ones, from their ends.
        let next = |worker: usize| {
            let helped = |k: usize| lock(&shares[(worker + k) % workers]).pop_back();
            let own = lock(&shares[worker]).pop_front();
            own.or_else(|| (1..workers).find_map(helped))
        };
        // What another thread computes is waited for at last, so that threads whose wants overlap
        // share the work rather than wait for each other at each of them.
        let work = |worker: usize| {
            let mine = std::iter::from_fn(|| next(worker));
            let answers: Vec<_> = mine
                .map(|i| (i, self.runner.ask(all[i].0, all[i].1)))
                .collect();
            let settled = answers.into_iter().map(|(i, answer)| (i, answer.wait()));
            settled.collect::<Vec<_>>()
        };
        let mut values = if workers == 1 {
            work(0)
        } else {
            // These are threads of their own, not those of a shared pool, because a node may wait
            // here for a node of another thread.
            std::thread::scope(|scope| {
                let work = &work;
                let workers: Vec<_> = (0..workers).map(|w| scope.spawn(move || work(w))).collect();
                let done = workers.into_iter().map(ScopedJoinHandle::join);
                done.flat_map(|values| values.unwrap_or_else(|panic| resume_unwind(panic)))
                    .collect()
            })
        };
        values.sort_unstable_by_key(|&(i, _)| i);
        values.into_iter().map(|(_, value)| value).collect()
    }

    /// The numbers of what each worker begins with: of every demand a part of its own without gaps,
    /// as neighbours often need the same inputs.
    fn shares(&self, workers: usize) -> Vec<Mutex<VecDeque<usize>>> {
        let mut shares = vec![VecDeque::new(); workers];
        let mut first = 0;
        for (_, places) in &self.of_demands {
            for i in 0..places.len() {
                shares[i * workers / places.len()].push_back(first + i);
            }
            first += places.len();
        }
        shares.into_iter().map(Mutex::new).collect()
    }
}
