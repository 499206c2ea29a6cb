//! A survey of a world's stand for measures.

use std::collections::BTreeMap;
use std::sync::Arc;

use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectKind, TreeRecord};

use super::Standing;
use crate::world::World;

/// The trees of a square of chunks around the world's origin.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The grown living trees by the inventory.
    pub trees: Vec<TreeRecord>,
    /// Trees with leaves: grown living ones and saplings.
    pub leafy: Vec<Standing>,
    /// All standing trees: grown living ones, saplings and dead ones.
    pub copies: Vec<Copied>,
    /// Volume of lying deadwood in it, m³/ha.
    pub deadwood_m3_ha: f64,
    /// The square's south-west corner and edge, metres.
    pub square: (DVec2, f64),
}

/// The kind of individual that a tree is a copy of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CopyKind {
    /// A grown living individual.
    Grown,
    /// A sapling.
    Sapling,
    /// A dead individual.
    Dead,
}

/// A tree as a copy of one of a few individuals.
#[derive(Clone, Debug)]
pub struct Copied {
    /// Number of the individual. Saplings, dead trees and grown living trees have different ones.
    pub individual: usize,
    /// Kind of the individual.
    pub kind: CopyKind,
    /// Position and transform of the copy.
    pub standing: Standing,
}

impl Survey {
    /// Surveys a square of `side` x `side` chunks.
    ///
    /// # Panics
    /// If the world cannot be grown.
    #[must_use]
    pub fn of(world: &World, runner: &Runner<'_>, assets: &WorldAssets, side: i32) -> Self {
        let half = side / 2;
        let square: Vec<ChunkCoord> = (0..side * side)
            .map(|i| ChunkCoord::new(i % side - half, i / side - half))
            .collect();
        let size_m = world.config.chunks.size_m;
        let things = runner.demand(world.forest.objects).all(&square);
        let things = things.expect("things");
        let mut out = Self {
            trees: Vec::new(),
            leafy: Vec::new(),
            copies: Vec::new(),
            deadwood_m3_ha: 0.0,
            square: (
                DVec2::splat(-f64::from(half) * size_m),
                size_m * f64::from(side),
            ),
        };
        let hectares = out.square.1 * out.square.1 / 10_000.0;
        for thing in things.iter().flat_map(|t| t.0.iter()) {
            if let Some(wood) = assets.deadwood_record(thing) {
                out.deadwood_m3_ha += wood.volume_m3 / hectares;
            }
            let Some(record) = assets.tree_record(thing) else {
                continue;
            };
            debug_assert_eq!(thing.kind, ObjectKind::Tree);
            let standing = Standing {
                shape: Arc::clone(assets.shape(thing).prototype()),
                foot_m: thing.position_m.truncate(),
                linear: thing.linear,
                leaf_area_m2: record.leaf_area_m2,
            };
            let kind = match (record.alive, record.age_class.as_str()) {
                (false, _) => CopyKind::Dead,
                (true, "sapling") => CopyKind::Sapling,
                (true, _) => CopyKind::Grown,
            };
            out.copies.push(Copied {
                individual: thing.asset,
                kind,
                standing: standing.clone(),
            });
            if kind != CopyKind::Dead {
                out.leafy.push(standing.clone());
            }
            if kind == CopyKind::Grown {
                out.trees.push(record);
            }
        }
        out
    }

    /// Positions of the feet of the living trees.
    #[must_use]
    pub fn places(&self) -> Vec<DVec2> {
        self.trees.iter().map(|t| t.position_m.truncate()).collect()
    }

    /// The mean height of the 100 thickest trees per hectare (Assmann), metres.
    #[must_use]
    pub fn dominant_height_m(&self) -> f64 {
        let hectares = self.square.1 * self.square.1 / 10_000.0;
        let mut by_diameter: Vec<&TreeRecord> = self.trees.iter().collect();
        by_diameter.sort_by(|a, b| b.dbh_m.total_cmp(&a.dbh_m));
        by_diameter.truncate((100.0 * hectares) as usize);
        by_diameter.iter().map(|t| t.height_m).sum::<f64>() / by_diameter.len() as f64
    }

    /// The numbers of pairs of trees that look alike (copies of the same individual whose rotations
    /// are within 2° and whose sizes are within half a percent of each other) and of all pairs of
    /// the same individual, among the trees that `which` selects, of pairs within this distance,
    /// metres.
    #[must_use]
    pub fn alike(&self, which: impl Fn(CopyKind) -> bool, within_m: f64) -> (usize, usize) {
        const TURN_DEG: f64 = 2.0;
        const SIZE: f64 = 0.005;
        let mut of: BTreeMap<usize, Vec<&Standing>> = BTreeMap::new();
        for tree in self.copies.iter().filter(|t| which(t.kind)) {
            of.entry(tree.individual).or_default().push(&tree.standing);
        }
        let (mut alike, mut same) = (0, 0);
        for trees in of.values() {
            for (i, a) in trees.iter().enumerate() {
                for b in &trees[..i] {
                    if a.foot_m.distance(b.foot_m) >= within_m {
                        continue;
                    }
                    same += 1;
                    let (x, y) = (a.linear.x_axis, b.linear.x_axis);
                    let turned = x.angle_between(y).to_degrees();
                    let larger = a.linear.z_axis.length() / b.linear.z_axis.length() - 1.0;
                    let near = f64::from(turned) < TURN_DEG && f64::from(larger.abs()) < SIZE;
                    alike += usize::from(near);
                }
            }
        }
        (alike, same)
    }
}
