//! Keys of models that users bring.

use nemoral_import::MAX_MODEL_BYTES;

use crate::schema::AllowedValues::{Model as ModelFile, OneOf, Real, Text, Whole};
use crate::schema::{SectionSpec, section};
use crate::{InputPath, ModelKind};

/// Models, by name.
pub(super) const MODELS: SectionSpec = SectionSpec {
    path: "models",
    doc: " Your own trees, shrubs, rocks and logs, beside the grown ones or instead of them: a \
        table \
        `[models.NAME]` for each model.",
    choice: None,
    keys: &[],
    named: None,
    defaults: toml::Table::new,
};

section! {
    /// A model of yours, called NAME. It is placed, numbered, listed and labelled as what is grown.
    /// What its materials are is read from their names, or from a file beside it, as on the guide's
    /// page on your own models.
    Model at "models.NAME" {
        /// The model: glTF, GLB or OBJ.
        file: InputPath = InputPath::default(), ModelFile(MAX_MODEL_BYTES), "none";
        /// What it is.
        kind: ModelKind = ModelKind::Tree, OneOf(ModelKind::WORDS), "most models are trees";
        /// Its share among all trees, shrubs, rocks or logs. What the models of a kind leave of 1
        /// is grown.
        share: f64 = 0.2, Real(0.0, 1.0), "every fifth";
        /// The name of its species in inventories; empty for NAME.
        species: String = String::new(), Text, "its own name";
        /// The stage of decay of a log: 1 fresh, 2 losing its bark, 3 bare, 4 soft, 5 rotten.
        decay: u32 = 3, Whole(1, 5), "what is scanned has lain for some years";
        /// Size of the smallest copy, relative to the model.
        scale_min: f64 = 0.9, Real(0.05, 20.0), "as grown trees vary";
        /// Size of the largest copy, relative to the model.
        scale_max: f64 = 1.1, Real(0.05, 20.0), "as grown trees vary";
    }
}
