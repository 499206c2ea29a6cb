//! What is wrong with models of users.

use super::quotations::cut;
use super::{Config, InputFiles, Model, ModelKind};

/// The most models of a config.
const MOST: usize = 64;
/// The largest radii that models may occupy at the ground: those of a tree, a shrub and a rock, as
/// placed, metres.
const MOST_RADIUS_M: f64 = 3.0;
/// The longest log that a model may be, and that a forest has, metres.
pub const LONGEST_LOG_M: f64 = 19.0;

/// The kind as readers of models know it.
impl From<ModelKind> for nemoral_import::ModelKind {
    fn from(kind: ModelKind) -> Self {
        match kind {
            ModelKind::Tree => Self::Tree,
            ModelKind::Shrub => Self::Shrub,
            ModelKind::Rock => Self::Rock,
            ModelKind::Log => Self::Log,
        }
    }
}

impl Model {
    /// The name of its species in inventories; `name` is that of its table.
    #[must_use]
    pub fn species_or<'a>(&'a self, name: &'a str) -> &'a str {
        if self.species.is_empty() {
            name
        } else {
            &self.species
        }
    }
}

impl Config {
    /// The share of the models of a kind among all of the kind.
    pub(super) fn share_of_models(&self, kind: ModelKind) -> f64 {
        let of_kind = self.models.values().filter(|m| m.kind == kind);
        of_kind.map(|m| m.share).sum()
    }

    /// The names of the models of trees, which a stem map may name.
    #[must_use]
    pub fn tree_models(&self) -> Vec<String> {
        let trees = self
            .models
            .iter()
            .filter(|(_, m)| m.kind == ModelKind::Tree);
        trees.map(|(name, _)| name.clone()).collect()
    }

    /// What is wrong with the models: the key and the message, which starts with it.
    pub(super) fn model_problems(&self, inputs: &InputFiles) -> Vec<(String, String)> {
        let mut out = Vec::new();
        let mut refuse = |path: String, message: String| {
            let message = format!("{path}{message}");
            out.push((path, message));
        };
        if self.models.len() > MOST {
            let message = format!(
                ": {} models, and at most {MOST} are allowed",
                self.models.len()
            );
            refuse("models".to_owned(), message);
        }
        for kind in [
            ModelKind::Tree,
            ModelKind::Shrub,
            ModelKind::Rock,
            ModelKind::Log,
        ] {
            let share = self.share_of_models(kind);
            if share > 1.0 + SLACK {
                let word = kind.word();
                let message = format!(
                    ": the shares of the models with kind = \"{word}\" add up to {share}: must be \
                     at most 1"
                );
                refuse("models".to_owned(), message);
            }
        }
        let plain = |name: &str| {
            let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            (1..=32).contains(&name.len()) && name.chars().all(allowed)
        };
        for (name, model) in &self.models {
            let path = format!("models.{name}");
            if !plain(name) {
                let message = ": a model's name must be 1 to 32 of a-z, 0-9 and _";
                refuse(path.clone(), message.to_owned());
            }
            if !plain(model.species_or("_")) {
                let species = cut(&model.species);
                let message = format!(" = \"{species}\": must be 1 to 32 of a-z, 0-9 and _");
                refuse(format!("{path}.species"), message);
            }
            let (low, high) = (model.scale_min, model.scale_max);
            if low > high {
                let message = format!(" = {low}: must be at most {path}.scale_max = {high}");
                refuse(format!("{path}.scale_min"), message);
            }
            let Some(file) = inputs.get(&model.file) else {
                let message = " = \"\": must name a glTF, GLB or OBJ file".to_owned();
                refuse(format!("{path}.file"), message);
                continue;
            };
            match file.model(model.kind.into()) {
                Err(e) => {
                    let message = format!(" = \"{}\": {e}", cut(model.file.as_str()));
                    refuse(format!("{path}.file"), message);
                }
                Ok(read) if let Some(log) = read.log => {
                    let length_m = high * log.length_m;
                    if length_m > LONGEST_LOG_M {
                        let message = format!(
                            " = {high}: its largest copy is {length_m:.2} m long, and at most \
                             {LONGEST_LOG_M} m are allowed; is its unit right?"
                        );
                        refuse(format!("{path}.scale_max"), message);
                    }
                }
                Ok(read) => {
                    let tree_m = read.tree.as_ref().map(|tree| tree.foot_radius_m);
                    let radius_m = high * tree_m.unwrap_or(read.extent.radius_m);
                    let most_m = MOST_RADIUS_M.min(self.chunks.size_m / 8.0);
                    if radius_m > most_m {
                        let message = format!(
                            " = {high}: its largest copy has a radius of {radius_m:.2} m at the \
                             ground, and at most {most_m} m are allowed; is its unit right? (it is \
                             {:.2} m high)",
                            read.extent.height_m
                        );
                        refuse(format!("{path}.scale_max"), message);
                    }
                }
            }
        }
        out
    }
}

/// Sums of decimal fractions are off by this at most.
const SLACK: f64 = 1e-9;
