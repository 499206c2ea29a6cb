//! A world whose chunks are made on demand.

use std::collections::HashMap;

use glam::DVec2;
use nemoral_placement::{
    DiskKind, LayerParams, Placement, PlacementParams, RockParams, Site, SiteFilter,
};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;

pub(crate) fn variety(weight: f64, low_m: f64, high_m: f64) -> DiskKind {
    DiskKind {
        weight,
        radius_m: (low_m, high_m),
    }
}

pub(crate) fn layer(name: &str, per_chunk: f64, varieties: Vec<DiskKind>) -> LayerParams {
    LayerParams::new(name, per_chunk, varieties)
}

/// Trees of three sizes, stumps, shrubs and rocks, so many that they restrict each other.
pub(crate) fn forest(trees: f64) -> PlacementParams {
    let sizes = vec![
        variety(3.0, 0.1, 0.2),
        variety(2.0, 0.2, 0.4),
        variety(1.0, 0.4, 0.6),
    ];
    PlacementParams {
        rocks: RockParams {
            min_per_chunk: 5,
            max_per_chunk: 25,
            varieties: vec![variety(1.0, 0.2, 1.2)],
        },
        layers: vec![
            layer("trees", trees, sizes),
            layer("stumps", 12.0, vec![variety(1.0, 0.1, 0.3)]),
            layer("shrubs", 300.0, vec![variety(1.0, 0.2, 0.5)]),
        ],
        ..PlacementParams::default()
    }
}

/// Trees alone.
pub(crate) fn trees(per_chunk: f64) -> PlacementParams {
    let mut params = forest(per_chunk);
    params.layers.truncate(1);
    params.rocks.min_per_chunk = 0;
    params.rocks.max_per_chunk = 0;
    params
}

pub(crate) struct World<'a> {
    pub(crate) placement: Placement,
    allowed: &'a dyn SiteFilter,
    rocks: HashMap<ChunkCoord, Vec<Site>>,
}

impl<'a> World<'a> {
    pub(crate) fn new(params: PlacementParams, seed: u64, allowed: &'a dyn SiteFilter) -> Self {
        Self {
            placement: Placement::new(params, Key::world(seed)).expect("valid parameters"),
            allowed,
            rocks: HashMap::new(),
        }
    }

    pub(crate) fn rocks(&mut self, coord: ChunkCoord) -> Vec<Site> {
        if let Some(rocks) = self.rocks.get(&coord) {
            return rocks.clone();
        }
        let neighbours: Vec<Vec<Site>> = Placement::lower_phase_neighbours(coord)
            .into_iter()
            .map(|c| self.rocks(c))
            .collect();
        let neighbours: Vec<&[Site]> = neighbours.iter().map(Vec::as_slice).collect();
        let rocks = self.placement.rocks(coord, self.allowed, &neighbours);
        self.rocks.insert(coord, rocks.clone());
        rocks
    }

    pub(crate) fn woody(&mut self, coord: ChunkCoord) -> Vec<Site> {
        let mut rocks = Vec::new();
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            rocks.extend(self.rocks(coord.offset(dx, dy)));
        }
        self.placement.woody(coord, self.allowed, &rocks)
    }

    /// Drops all chunks.
    pub(crate) fn evict(&mut self) {
        self.rocks.clear();
    }
}

pub(crate) fn everywhere(_: DVec2, _: f64) -> bool {
    true
}

/// Winding trails, 3 m wide, that take about an eighth of the plane.
pub(crate) fn beside_trails(position_m: DVec2, radius_m: f64) -> bool {
    let centre_m = 6.0 * (position_m.x / 17.0).sin();
    let across_m = (position_m.y - centre_m).rem_euclid(27.0) - 13.5;
    across_m.abs() > 1.5 + radius_m
}

/// The share of the plane where `beside_trails` allows the trees of [`forest`].
pub(crate) fn allowed_fraction() -> f64 {
    // The mean radius of the three sizes, by weight.
    let mean_radius_m = (3.0 * 0.15 + 2.0 * 0.3 + 0.5) / 6.0;
    1.0 - 2.0 * (1.5 + mean_radius_m) / 27.0
}

pub(crate) fn square(corner: ChunkCoord, side: i32) -> Vec<ChunkCoord> {
    (0..side)
        .flat_map(|y| (0..side).map(move |x| corner.offset(x, y)))
        .collect()
}
