//! What a user says of a model: the file `NAME.toml` beside it.

use std::collections::BTreeMap;

use nemoral_scene::glam::{DMat3, DVec3, Vec3};
use nemoral_scene::{Mesh, Semantic, on_deep_stack};
use serde::Deserialize;

use crate::ImportError;
use crate::error::shown;

/// The most bytes of a sidecar.
const MAX_BYTES: usize = 64 << 10;
/// The most names that it may tell the meaning of.
const MAX_SEMANTICS: usize = 256;

/// The axis that points up in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// +y, as in glTF.
    Y,
    /// +z.
    Z,
}

/// What a user says of a model. All of it can be left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelSidecar {
    /// The axis that points up.
    pub up: Option<UpAxis>,
    /// How long the file's unit is, metres.
    pub metres_per_unit: Option<f64>,
    /// Diameter at breast height, metres.
    pub dbh_m: Option<f64>,
    /// The radius that it occupies at the ground, metres.
    pub radius_m: Option<f64>,
    /// What materials and nodes are, by their names; `None` for what is left out. A name may start
    /// or end with `*`, which stands for any text.
    pub semantics: BTreeMap<String, Option<Semantic>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    up: Option<UpAxis>,
    metres_per_unit: Option<f64>,
    dbh_m: Option<f64>,
    radius_m: Option<f64>,
    #[serde(default)]
    semantics: BTreeMap<String, String>,
}

impl ModelSidecar {
    /// The word for what is left out.
    const NOTHING: &str = "nothing";

    /// Reads a sidecar.
    ///
    /// # Errors
    /// If it is not TOML of this form, or a value is out of its range.
    pub fn read(bytes: &[u8]) -> Result<Self, ImportError> {
        if bytes.len() > MAX_BYTES {
            return Err(ImportError::file(format!(
                "its sidecar has {} bytes: at most {MAX_BYTES} are read",
                bytes.len()
            )));
        }
        let text = std::str::from_utf8(bytes)
            .map_err(|_| ImportError::file("its sidecar is not UTF-8 text"))?;
        let read = on_deep_stack(|| toml::from_str::<Written>(text));
        let read = read.map_err(|e| ImportError::file(format!("its sidecar: {e}")))?;
        let written = read.map_err(|e| {
            let before = e.span().and_then(|span| text.get(..span.start));
            let line = before.map_or(1, |before| 1 + before.matches('\n').count());
            let message = shown(e.message());
            ImportError::file(format!("its sidecar: line {line}: {message}"))
        })?;
        if written.semantics.len() > MAX_SEMANTICS {
            return Err(ImportError::file(format!(
                "its sidecar: semantics has {} names: at most {MAX_SEMANTICS} are read",
                written.semantics.len()
            )));
        }
        let within = |name: &str, value: Option<f64>, [least, most]: [f64; 2]| match value {
            Some(value) if !(least..=most).contains(&value) => Err(ImportError::file(format!(
                "its sidecar: {name} = {value}: must be a number from {least} to {most}"
            ))),
            value => Ok(value),
        };
        let semantic = |(name, word): (String, String)| {
            if word == Self::NOTHING {
                return Ok((name, None));
            }
            match semantic(&word) {
                Some(semantic) => Ok((name, Some(semantic))),
                None => Err(ImportError::file(format!(
                    "its sidecar: semantics.\"{}\" = \"{}\": must be \"{}\" or one of {}",
                    shown(&name),
                    shown(&word),
                    Self::NOTHING,
                    names()
                ))),
            }
        };
        Ok(Self {
            up: written.up,
            metres_per_unit: within("metres_per_unit", written.metres_per_unit, [1e-6, 1e4])?,
            dbh_m: within("dbh_m", written.dbh_m, [0.005, 5.0])?,
            radius_m: within("radius_m", written.radius_m, [0.001, 50.0])?,
            semantics: written
                .semantics
                .into_iter()
                .map(semantic)
                .collect::<Result<_, _>>()?,
        })
    }

    /// Brings a mesh to metres with z up. What is not told is guessed, and noted.
    pub(super) fn to_our_axes(&self, mesh: &mut Mesh, is_obj: bool, notes: &mut Vec<String>) {
        if is_obj && (self.up.is_none() || self.metres_per_unit.is_none()) {
            let what = match (self.up, self.metres_per_unit) {
                (None, None) => "that +y is up and that its unit is the metre",
                (None, _) => "that +y is up",
                _ => "that its unit is the metre",
            };
            notes.push(format!(
                "OBJ files do not say their axes and unit; it is guessed {what}: say up and \
                 metres_per_unit in the sidecar"
            ));
        }
        let turn = match self.up.unwrap_or(UpAxis::Y) {
            UpAxis::Y => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
            UpAxis::Z => DMat3::IDENTITY,
        };
        let scale = self.metres_per_unit.unwrap_or(1.0);
        let turned = |v: Vec3, scale: f64| (turn * v.as_dvec3() * scale).as_vec3();
        for position in &mut mesh.positions {
            *position = turned(*position, scale);
        }
        for normal in &mut mesh.normals {
            *normal = turned(*normal, 1.0);
        }
    }
}

/// The semantic of this name that a shape of a user may have: neither sky nor echoes in the air.
pub(super) fn semantic(name: &str) -> Option<Semantic> {
    allowed().find(|s| s.name() == name)
}

fn allowed() -> impl Iterator<Item = Semantic> {
    let all = Semantic::ALL.iter().copied();
    all.filter(|s| !matches!(s, Semantic::Sky | Semantic::AirborneEcho))
}

/// The names of all semantics, for messages.
pub(super) fn names() -> String {
    allowed().map(Semantic::name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_named() {
        let refused = |text: &str| {
            let refused = ModelSidecar::read(text.as_bytes());
            refused.expect_err(text).to_string()
        };
        assert!(refused("\nup = \"x\"").contains("line 2: unknown variant `x`"));
        assert!(refused("dbh_m = \"a\"").contains("line 1: "));
        assert!(refused("metres_per_unit = 0").contains("metres_per_unit = 0"));
        assert!(refused("height = 3").contains("unknown field `height`"));
        let message = refused("[semantics]\nleaf = \"leafs\"");
        assert!(message.contains("\"leafs\": must be") && message.contains("needle"));
        assert!(refused("[semantics]\nleaf = \"sky\"").contains("must be"));
    }
}
