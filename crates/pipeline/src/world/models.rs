//! Models of users among what is grown.

use std::fmt;
use std::sync::Arc;

use nemoral_assets::{
    Library, LogAsset, PlantAsset, PlantKind, ShapeKind, SizeClass, StemProfile, TreeAsset,
    TreeClimbers, TreeSize, with_occlusion,
};
use nemoral_import::{self as import, LogMeasures, TreeMeasures};
use nemoral_placement::DiskKind;
use nemoral_scene::{DecayStage, ObjectKind, Prototype};
use nemoral_stand::{ObjectSize, StemKind, StemScale};

use crate::config::{self, Config};
use crate::plan::{Encode, Encoder, Hasher};
use crate::{Error, InputFiles};

/// The models of a config.
#[derive(Clone, Debug)]
pub(crate) struct ModelRecipe {
    models: Vec<(String, config::Model)>,
    inputs: InputFiles,
}

/// The models of a world.
#[derive(Clone, Debug, Default)]
pub(crate) struct WorldModels {
    placed: Vec<PlacedModel>,
    /// What was guessed about them, for the user.
    pub(crate) notes: Vec<String>,
}

/// Where a model is in the library, how often it stands, and how large.
#[derive(Clone, Debug)]
struct PlacedModel {
    name: String,
    kind: ObjectKind,
    /// Its index among the library's assets of its kind.
    asset: usize,
    /// Its share among all of its kind.
    share: f64,
    /// The least and the greatest scale of a copy.
    scale: [f64; 2],
}

impl Encode for ModelRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self { models, inputs: _ } = self;
        for (name, model) in models {
            encoder.field(name, model);
        }
    }
}

impl ModelRecipe {
    pub(crate) fn new(config: &Config, inputs: &InputFiles) -> Self {
        let models = config.models.iter();
        Self {
            models: models.map(|(name, m)| (name.clone(), m.clone())).collect(),
            inputs: inputs.clone(),
        }
    }

    /// A world without models has the key that it had before there were any.
    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        if !self.models.is_empty() {
            self.inputs.encode(hasher, self);
        }
    }

    /// Adds the models to a library, where each is the last of its kind in turn.
    pub(crate) fn add_to(
        &self,
        library: Arc<Library>,
    ) -> Result<(Arc<Library>, WorldModels), Error> {
        let mut added = WorldModels::default();
        if self.models.is_empty() {
            return Ok((library, added));
        }
        let mut all = Library::clone(&library);
        for (name, wanted) in &self.models {
            let wrong = |e: &dyn fmt::Display| Error::request(format!("models.{name}: {e}"));
            let file = self.inputs.get(&wanted.file);
            let file = file.ok_or_else(|| wrong(&"it names no file"))?;
            let kind = import::ModelKind::from(wanted.kind);
            let model = file.model(kind).map_err(|e| wrong(&e))?;
            let notes = model.notes.iter();
            added
                .notes
                .extend(notes.map(|note| format!("models.{name}: {note}")));
            let shape = model.prototype(&format!("models.{name}"), &mut all.materials);
            let shape = shape.map_err(|e| wrong(&e))?;
            let scale = (wanted.scale_min * wanted.scale_max).sqrt() as f32;
            let of_kind = match kind {
                import::ModelKind::Tree => ShapeKind::Tree,
                import::ModelKind::Shrub => ShapeKind::Shrub,
                import::ModelKind::Rock | import::ModelKind::Log => ShapeKind::Solid,
            };
            let shape = Arc::new(with_occlusion(shape, &all.materials, of_kind, scale));
            let species = wanted.species_or(name).to_owned();
            let (kind, asset) = match (kind, &model.tree, model.log) {
                (_, _, Some(measures)) => {
                    let of = DecayStage::ALL
                        .into_iter()
                        .find(|s| u32::from(s.number()) == wanted.decay);
                    let LogMeasures {
                        length_m,
                        diameter_m,
                        half_height_m,
                        volume_m3,
                    } = measures;
                    all.deadwood.logs.push(LogAsset {
                        prototype: shape,
                        species,
                        stage: of.unwrap_or(DecayStage::Bare),
                        length_m,
                        diameter_m,
                        half_height_m,
                        volume_m3,
                    });
                    (ObjectKind::Log, all.deadwood.logs.len() - 1)
                }
                (import::ModelKind::Tree, Some(measures), _) => {
                    // Climbers are drawn on bark that is known to be one.
                    if !all.climbers.trees.is_empty() {
                        all.climbers.trees.push(TreeClimbers::default());
                    }
                    let height_m = model.extent.height_m;
                    all.trees.push(tree(species, shape, measures, height_m));
                    (ObjectKind::Tree, all.trees.len() - 1)
                }
                (kind, ..) => {
                    let (kind, of) = match kind {
                        import::ModelKind::Rock => (ObjectKind::Rock, PlantKind::Rock),
                        _ => (ObjectKind::Shrub, PlantKind::Shrub),
                    };
                    let plants = &mut all.plants[of];
                    plants.push(PlantAsset {
                        prototype: shape,
                        name: species,
                        radius_m: model.extent.radius_m.max(LEAST_RADIUS_M),
                        height_m: model.extent.height_m,
                    });
                    (kind, plants.len() - 1)
                }
            };
            added.placed.push(PlacedModel {
                name: name.clone(),
                kind,
                asset,
                share: wanted.share,
                scale: [wanted.scale_min, wanted.scale_max],
            });
        }
        Ok((Arc::new(all), added))
    }
}

/// Sums of decimal fractions are off by this at most.
const SLACK: f64 = 1e-9;

/// No copy of what is grown is larger: see [`ObjectSize::Grown`] and [`StemScale::GROWN`].
const LARGEST_GROWN: f64 = 1.2;

/// Nothing occupies less than this at the ground.
const LEAST_RADIUS_M: f64 = 0.01;

/// Diameters from which trees of unknown species are young, middle-aged and mature, metres.
const CLASS_DBH_M: [f64; 3] = [0.0, 0.2, 0.4];

fn tree(species: String, shape: Arc<Prototype>, of: &TreeMeasures, height_m: f64) -> TreeAsset {
    let class = CLASS_DBH_M
        .iter()
        .filter(|&&least| of.dbh_m >= least)
        .count();
    TreeAsset {
        prototype: shape,
        species,
        size: TreeSize {
            dbh_m: of.dbh_m,
            height_m,
            crown_base_m: of.crown_base_m,
            crown_radius_m: of.crown_radius_m,
            leaf_area_m2: of.leaf_area_m2,
            lean_rad: of.lean_rad,
        },
        class: SizeClass::ALL[class],
        alive: of.is_alive,
        stem: StemProfile::new(of.stem_cuts_m.clone(), height_m),
        stem_volume_m3: of.stem_volume_m3,
        wood: None,
        radius_m: of.foot_radius_m.max(LEAST_RADIUS_M),
        flare_lobes: Vec::new(),
    }
}

impl WorldModels {
    /// The name and the index among the library's trees of each model of a tree.
    pub(crate) fn trees(&self) -> impl Iterator<Item = (&str, usize)> {
        let trees = self.placed.iter().filter(|m| m.kind == ObjectKind::Tree);
        trees.map(|model| (model.name.as_str(), model.asset))
    }

    fn find(&self, kind: ObjectKind, asset: usize) -> Option<&PlacedModel> {
        let mut placed = self.placed.iter();
        placed.find(|model| model.kind == kind && model.asset == asset)
    }

    /// What decides the size of a copy: that of a model, its config.
    pub(crate) fn size(&self, kind: ObjectKind, asset: usize) -> ObjectSize {
        let model = self.find(kind, asset);
        model.map_or(ObjectSize::Grown, |model| ObjectSize::Between(model.scale))
    }

    /// The scale of the largest copy.
    pub(crate) fn largest(&self, kind: ObjectKind, asset: usize) -> f64 {
        let model = self.find(kind, asset);
        model.map_or(LARGEST_GROWN, |model| model.scale[1])
    }

    /// Gives the models of a kind the room that their largest copies need.
    pub(crate) fn widen(&self, kind: ObjectKind, varieties: &mut [DiskKind]) {
        for model in self.placed.iter().filter(|model| model.kind == kind) {
            let DiskKind { radius_m, .. } = &mut varieties[model.asset];
            *radius_m = (radius_m.0 * model.scale[1], radius_m.1 * model.scale[1]);
        }
    }

    /// The same, and the weights that make their shares of all.
    pub(crate) fn mix_in(&self, kind: ObjectKind, varieties: &mut [DiskKind]) {
        let mut weights: Vec<f64> = varieties.iter().map(|v| v.weight).collect();
        self.weigh(kind, &mut weights);
        for (variety, weight) in varieties.iter_mut().zip(weights) {
            variety.weight = weight;
        }
        self.widen(kind, varieties);
    }

    /// The same of logs, whose copies keep the form of their model.
    pub(crate) fn mix_in_logs(&self, kinds: &mut [StemKind]) {
        let mut weights: Vec<f64> = kinds.iter().map(|k| k.weight).collect();
        self.weigh(ObjectKind::Log, &mut weights);
        for (asset, (kind, weight)) in kinds.iter_mut().zip(weights).enumerate() {
            kind.weight = weight;
            if let Some(model) = self.find(ObjectKind::Log, asset) {
                let [low, high] = model.scale;
                kind.scale = StemScale::Together(low, high);
            }
        }
    }

    /// Whether an asset of a kind is a model.
    pub(crate) fn contain(&self, kind: ObjectKind, asset: usize) -> bool {
        self.find(kind, asset).is_some()
    }

    /// Gives the models of a kind the weights that make their shares of all. `weights` are those of
    /// all assets, which are those of what is grown until now.
    pub(crate) fn weigh(&self, kind: ObjectKind, weights: &mut [f64]) {
        let models = || self.placed.iter().filter(|model| model.kind == kind);
        let share: f64 = models().map(|model| model.share).sum();
        for model in models() {
            weights[model.asset] = 0.0;
        }
        let grown: f64 = weights.iter().sum();
        let left = 1.0 - share;
        if left < SLACK && share > 0.0 {
            weights.fill(0.0);
        }
        let unit = if left < SLACK || grown <= 0.0 {
            1.0
        } else {
            grown / left
        };
        for model in models() {
            weights[model.asset] = unit * model.share;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_have_their_shares() {
        let model = |asset, share| PlacedModel {
            name: String::new(),
            kind: ObjectKind::Rock,
            asset,
            share,
            scale: [1.0; 2],
        };
        let weighed = |models: &[PlacedModel], mut weights: Vec<f64>| {
            let models = WorldModels {
                placed: models.to_vec(),
                notes: Vec::new(),
            };
            models.weigh(ObjectKind::Rock, &mut weights);
            weights
        };
        let grown = vec![1.0, 1.0, 1.0];
        assert_eq!(weighed(&[], grown.clone()), grown);
        let some = weighed(&[model(2, 0.2), model(3, 0.3)], vec![1.0; 4]);
        assert_eq!((some[0], some[1]), (1.0, 1.0));
        let all: f64 = some.iter().sum();
        assert!((some[2] / all - 0.2).abs() < 1e-12 && (some[3] / all - 0.3).abs() < 1e-12);
        assert_eq!(
            weighed(&[model(2, 0.7), model(1, 0.3)], vec![1.0; 3]),
            [0.0, 0.3, 0.7]
        );
        assert_eq!(weighed(&[model(1, 0.4)], vec![0.0; 2]), [0.0, 0.4]);
        assert_eq!(weighed(&[model(1, 0.0)], vec![1.0; 2]), [1.0, 0.0]);
    }
}
