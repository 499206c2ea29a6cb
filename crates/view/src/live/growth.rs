//! What is grown next, and growing it.

use std::sync::Arc;

use nemoral_pipeline::ChunkManager;
use nemoral_pipeline::config::Config;
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;

use super::shadow_cache::ShadowCache;
use super::world::{World, WorldSnapshot};
use super::{GrowthProgress, GrowthStage, Shared, SharedState, lock};
use crate::Error;

/// After this many metres the land ahead is grown.
const STEP_M: f64 = 8.0;
/// The land is seen when it has grown to these distances, metres, and to the visible radius.
const RINGS_M: [f64; 4] = [30.0, 70.0, 130.0, 210.0];
/// A changed land is seen once it has grown this far, metres.
const CHANGED_M: f64 = 70.0;

/// Something to grow.
#[derive(Debug)]
pub(super) struct Task {
    config: Config,
    pub(super) revision: u64,
    /// `None` for the start of the robot's path.
    place_m: Option<DVec2>,
    shown: Option<Arc<WorldSnapshot>>,
}

/// Waits until there is something to grow; `None` at the end.
pub(super) fn next(shared: &Shared) -> Option<Task> {
    let mut state = lock(&shared.state);
    loop {
        if state.stopping {
            return None;
        }
        if is_due(&state) {
            return Some(Task {
                config: state.wanted.clone(),
                revision: state.revision,
                place_m: state.place_m,
                shown: state.shown.clone(),
            });
        }
        let woken = shared.changed.wait(state);
        state = woken.unwrap_or_else(std::sync::PoisonError::into_inner);
    }
}

fn is_due(state: &SharedState) -> bool {
    if state.failed == Some(state.revision) {
        return false;
    }
    let Some(shown) = &state.shown else {
        return true;
    };
    let moved_m = state.place_m.map_or(0.0, |p| p.distance(shown.centre_m));
    let reach_m = if state.rests { 0.0 } else { STEP_M };
    shown.world.revision != state.revision || !shown.complete || moved_m > reach_m
}

/// Grows a task's land ring by ring, and shows each. Gives up if something newer is wanted.
pub(super) fn grow(shared: &Shared, task: &Task) -> Result<(), Error> {
    let same = task
        .shown
        .as_ref()
        .filter(|s| s.world.revision == task.revision);
    let world = match same {
        Some(shown) => Arc::clone(&shown.world),
        None => {
            if task.shown.is_none() {
                report(shared, GrowthStage::Plants, 0, 0);
            }
            Arc::new(World::grow(shared, task.config.clone(), task.revision)?)
        }
    };
    if let (None, Some(shown)) = (same, &task.shown)
        && world.has_land_of(&shown.world)
    {
        // The light has changed, and nothing grows.
        show(
            shared,
            WorldSnapshot {
                world: Arc::clone(&world),
                scene: Arc::clone(&shown.scene),
                centre_m: shown.centre_m,
                complete: shown.complete,
                shadows: ShadowCache::new(),
            },
        );
        shared.store.retain_plan(world.forest.plan());
        return Ok(());
    }
    let (x, y, _) = world.start;
    let place_m = task.place_m.unwrap_or(DVec2::new(x, y));
    let chunks = &world.config.chunks;
    let visible_m = chunks.visible_radius_m;
    // Who walks has land around, and who has none sees the nearest first.
    let first_m = match (same, &task.shown) {
        (Some(s), _) if s.complete && s.centre_m.distance(place_m) < visible_m / 2.0 => visible_m,
        (None, Some(_)) => CHANGED_M.min(visible_m),
        _ => 0.0,
    };
    let rings = RINGS_M.iter().copied();
    let rings = rings.filter(|&r| r >= first_m && r < visible_m);
    // Whoever looks needs a processor, too.
    let threads = if task.shown.is_some() {
        shared.threads.saturating_sub(1).max(1)
    } else {
        shared.threads
    };
    let runner = world.runner(shared, threads);
    let mut order = ChunkCoord::within(place_m, visible_m, chunks.size_m);
    let total = order.len();
    let distance_m = |c: &ChunkCoord| c.distance_m(place_m, chunks.size_m);
    order.sort_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
    let mut grown = 0;
    for reach_m in rings.chain([visible_m]) {
        let of_ring = order.iter().filter(|c| distance_m(c) <= reach_m).count();
        while grown < of_ring {
            let some = &order[grown..(grown + threads).min(of_ring)];
            let is_near = |c: &&ChunkCoord| distance_m(c) <= chunks.undergrowth_radius_m;
            let near: Vec<ChunkCoord> = some.iter().filter(is_near).copied().collect();
            let has_litter = |c: &&ChunkCoord| distance_m(c) <= chunks.litter_radius_m;
            let littered: Vec<ChunkCoord> = near.iter().filter(has_litter).copied().collect();
            let forest = &world.forest;
            let solid = runner.demand(forest.object_geometry).batch(some);
            let lit = runner.demand(forest.sky_view_factor).batch(some);
            let low = runner.demand(forest.undergrowth_geometry).batch(&near);
            let shade = runner.demand(forest.ground_occlusion).batch(&near);
            let shed = runner.demand(forest.litter_geometry).batch(&littered);
            solid.and(lit).and(low).and(shade).and(shed).compute()?;
            grown += some.len();
            if !report(shared, GrowthStage::Land, grown, total)
                || lock(&shared.state).revision != task.revision
            {
                return Ok(());
            }
        }
        let scene = world.forest.scene_around(&runner, place_m, reach_m, true)?;
        show(
            shared,
            WorldSnapshot {
                world: Arc::clone(&world),
                scene: Arc::new(scene),
                centre_m: place_m,
                complete: reach_m >= visible_m,
                shadows: ShadowCache::new(),
            },
        );
    }
    ChunkManager::new(chunks.clone()).evict(&shared.store, place_m, &[]);
    if same.is_none() {
        shared.store.retain_plan(world.forest.plan());
    }
    Ok(())
}

/// Shows a world unless something newer is wanted.
fn show(shared: &Shared, shown: WorldSnapshot) {
    let mut state = lock(&shared.state);
    if state.revision == shown.world.revision {
        state.shown = Some(Arc::new(shown));
    }
}

/// Says how far growing is. The result is `false` if it should end.
fn report(shared: &Shared, what: GrowthStage, done: usize, total: usize) -> bool {
    let mut state = lock(&shared.state);
    state.growing = Some(GrowthProgress { what, done, total });
    !state.stopping
}
