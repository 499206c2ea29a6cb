//! Grows what climbs on trees, for each tree.

use std::sync::Arc;

use nemoral_scene::Prototype;
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

use super::plants::PlantGrower;
use super::{PlantAsset, TreeAsset, prototype, with_occluders, with_occlusion};
use crate::ambient_occlusion::{OcclusionParams, Thickness};
use crate::materials::ClimberMaterials;
use crate::plant::climber::{Bark, WOUNDS_M, carpet, ivy, moss, resin};
use crate::plant::liana::{clematis, honeysuckle};
use crate::plant::shape::Shape;

const IVY: Domain = Domain::new("assets.ivy");
const MOSS: Domain = Domain::new("assets.stem_moss");
const HONEYSUCKLE: Domain = Domain::new("assets.honeysuckle");
const CLEMATIS: Domain = Domain::new("assets.clematis");
const RESIN: Domain = Domain::new("assets.resin");
const CARPET: Domain = Domain::new("assets.ivy_carpet");

/// How high the two ivies of a tree climb, as shares of the height of its crown's base.
const REACHES: [f64; 2] = [0.35, 1.05];
/// Variants of carpets of ivy.
const CARPETS: u32 = 6;

/// What may grow on one tree; shapes are in the tree's own frame.
#[derive(Clone, Debug, Default)]
pub struct TreeClimbers {
    /// Ivy that climbs a third of the stem, and ivy that climbs into the crown.
    pub ivy: Vec<Arc<Prototype>>,
    /// Moss on the foot of the stem, densest towards the tree's own azimuths 0, a quarter turn, a
    /// half turn and three quarters; nothing without moss.
    pub moss: Vec<Arc<Prototype>>,
    /// Honeysuckle that winds up the stem.
    pub honeysuckle: Option<Arc<Prototype>>,
    /// Clematis that hangs from the crown; `None` also where the crown begins too high for it.
    pub clematis: Option<Arc<Prototype>>,
    /// Runs of resin on the bark of a conifer.
    pub resin: Option<Arc<Prototype>>,
}

/// What grows on trees besides ivy, which is always made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClimberParams {
    /// How moss grows.
    pub moss: StemMoss,
    /// Whether clematis and honeysuckle are made.
    pub lianas: bool,
    /// Whether resin runs down the bark of conifers.
    pub resin: bool,
}

/// What climbs on all trees.
#[derive(Clone, Debug, Default)]
pub struct Climbers {
    /// Of each living tree.
    pub trees: Vec<TreeClimbers>,
    /// Of each standing dead tree.
    pub snags: Vec<TreeClimbers>,
}

/// How moss grows on stems.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StemMoss {
    /// How dense: 1 as in a moist forest, 0 for none.
    pub amount: f64,
    /// How high it reaches on the moist side, metres.
    pub height_m: f64,
}

impl PlantGrower<'_> {
    /// What climbs on living and dead trees, if it was asked for.
    pub(super) fn climbers(&self, [trees, snags]: [&[TreeAsset]; 2]) -> Climbers {
        let (Some(wanted), Some(of)) = (&self.params.climbers, &self.materials.climbers) else {
            return Climbers::default();
        };
        let on = |trees: &[TreeAsset], part: u64| -> Vec<TreeClimbers> {
            let trees = trees.par_iter().enumerate();
            trees
                .map(|(i, tree)| self.on_tree(tree, i as u32, part, &wanted.moss, of))
                .collect()
        };
        Climbers {
            trees: on(trees, 0),
            snags: on(snags, 1),
        }
    }

    /// Carpets of ivy, if climbers were asked for.
    pub(super) fn ivy_carpets(&self) -> Vec<PlantAsset> {
        let Some(of) = &self.materials.climbers else {
            return Vec::new();
        };
        self.collect(CARPET, CARPETS, &|i, key| {
            self.patch("ivy_carpet", i, carpet(&of.carpet, &mut key.rng()))
        })
    }

    fn on_tree(
        &self,
        tree: &TreeAsset,
        number: u32,
        part: u64,
        growth: &StemMoss,
        of: &ClimberMaterials,
    ) -> TreeClimbers {
        let library = &self.materials.library;
        // The keys are the tree's own.
        let own = Domain::new(tree.prototype.name());
        let key = |domain: Domain, item: u64| -> Key {
            self.key.domain(domain).domain(own).item(2 * item + part)
        };
        let flat = |(name, shape): (String, Shape)| {
            let shape = prototype(&name, number, shape, library);
            Arc::new(with_occluders(
                shape,
                (library, self.masks),
                Thickness::Thin,
            ))
        };
        let leafy = |of: (String, Shape)| {
            let shape = Arc::unwrap_or_clone(flat(of));
            Arc::new(with_occlusion(shape, self.masks, &OcclusionParams::SHRUB))
        };
        let some = |(_, shape): &(String, Shape)| !shape.cards.is_empty();
        let name = tree.prototype.name();
        let ivy = (0..REACHES.len()).map(|i| {
            let top_m = (REACHES[i] * tree.size.crown_base_m)
                .clamp(1.0, 0.9 * tree.size.height_m)
                .min(16.0) as f32;
            let bark = Bark::of(&tree.prototype, library, top_m);
            let mut rng = key(IVY, i as u64).rng();
            (
                format!("{name}.ivy.{i}"),
                ivy(&bark, top_m, &of.ivy, &mut rng),
            )
        });
        let top_m = growth.height_m.min(0.6 * tree.size.height_m) as f32;
        let bark = Bark::of(&tree.prototype, library, 1.3 * top_m);
        let species = self.species.iter().find(|s| s.name == tree.species);
        let bark_suits = species.map_or(1.0, |s| s.bark.moss);
        let moss = (0..4).map(|i| {
            let side = 0.25 * std::f32::consts::TAU * i as f32;
            let mut rng = key(MOSS, i as u64).rng();
            let how = (side, top_m, (growth.amount * bark_suits) as f32);
            let shape = moss(&bark, how, &of.moss, &mut rng);
            (format!("{name}.moss.{i}"), shape)
        });
        // All sides have moss, or none: the choice is by side.
        let moss: Vec<_> = moss.filter(some).collect();
        let has_moss = moss.len() == 4;
        let lianas = self.materials.lianas.as_ref();
        let honeysuckle = lianas.map(|of| {
            let top_m = (0.9 * tree.size.crown_base_m).clamp(1.5, 6.5) as f32;
            let bark = Bark::of(&tree.prototype, library, top_m);
            let mut rng = key(HONEYSUCKLE, 0).rng();
            let shape = honeysuckle(&bark, top_m, of, &mut rng);
            (format!("{name}.honeysuckle"), shape)
        });
        let clematis = lianas.map(|of| {
            let mut rng = key(CLEMATIS, 0).rng();
            let shape = clematis(&tree.prototype, tree.radius_m as f32, of, &mut rng);
            (format!("{name}.clematis"), shape)
        });
        let runs = &self.materials.resin;
        let is_conifer = species.is_some_and(|s| s.leaves.kind.is_needle());
        let resin = (tree.alive && is_conifer && !runs.is_empty()).then(|| {
            let bark = Bark::of(&tree.prototype, library, WOUNDS_M[1]);
            let shape = resin(&bark, runs, &mut key(RESIN, 0).rng());
            (format!("{name}.resin"), shape)
        });
        TreeClimbers {
            honeysuckle: honeysuckle.filter(some).map(leafy),
            clematis: clematis.filter(some).map(leafy),
            // What is flat on the bark sees as much of the sky as the bark.
            resin: resin.filter(some).map(flat),
            ivy: ivy.filter(some).map(leafy).collect(),
            moss: (moss.into_iter().filter(|_| has_moss)).map(flat).collect(),
        }
    }
}
