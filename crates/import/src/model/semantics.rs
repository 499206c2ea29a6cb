//! What the parts of a model are, by the names of their materials and nodes.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use nemoral_scene::Semantic;

use super::ModelKind;
use super::raw::{RawModel, RawPart, first_part};
use super::sidecar::{ModelSidecar, names};
use crate::ImportError;
use crate::error::shown;

/// Words of names, and what they mean on a tree. The first word of this list that a name has
/// decides.
const WORDS: [(&str, Semantic); 25] = [
    ("needle", Semantic::Needle),
    ("needles", Semantic::Needle),
    ("leaf", Semantic::Leaf),
    ("leafs", Semantic::Leaf),
    ("leaves", Semantic::Leaf),
    ("foliage", Semantic::Leaf),
    ("frond", Semantic::Leaf),
    ("fronds", Semantic::Leaf),
    ("blossom", Semantic::Leaf),
    ("flower", Semantic::Leaf),
    ("flowers", Semantic::Leaf),
    ("ivy", Semantic::Climber),
    ("moss", Semantic::StemGrowth),
    ("lichen", Semantic::StemGrowth),
    ("twig", Semantic::Twig),
    ("twigs", Semantic::Twig),
    ("branch", Semantic::Branch),
    ("branches", Semantic::Branch),
    ("limb", Semantic::Limb),
    ("root", Semantic::RootFlare),
    ("roots", Semantic::RootFlare),
    ("bark", Semantic::Stem),
    ("trunk", Semantic::Stem),
    ("stem", Semantic::Stem),
    ("wood", Semantic::Stem),
];

/// The names of a part: its material's, then its nodes', the nearest first.
fn names_of<'a>(raw: &'a RawModel, part: &'a RawPart) -> impl Iterator<Item = &'a str> {
    let material = first_part(&raw.materials[part.material].name);
    let nodes = part.names.iter().map(|name| &**name);
    std::iter::once(material)
        .chain(nodes)
        .filter(|name| !name.is_empty())
}

impl ModelSidecar {
    /// What the sidecar says of a name: by the name itself, else by the longest pattern.
    fn of(&self, name: &str) -> Option<Option<Semantic>> {
        if let Some(&told) = self.semantics.get(name) {
            return Some(told);
        }
        let fits = |pattern: &str| match (pattern.strip_prefix('*'), pattern.strip_suffix('*')) {
            (Some(_), Some(_)) => name.contains(pattern.trim_matches('*')),
            (Some(end), None) => name.ends_with(end),
            (None, Some(start)) => name.starts_with(start),
            (None, None) => false,
        };
        let fitting = self.semantics.iter().filter(|(pattern, _)| fits(pattern));
        fitting
            .max_by_key(|(pattern, _)| pattern.len())
            .map(|(_, &told)| told)
    }
}

/// What a sidecar says of names, each of which it is asked for once.
struct SidecarSemantics<'a> {
    sidecar: &'a ModelSidecar,
    known: HashMap<Arc<str>, Option<Option<Semantic>>>,
}

impl<'a> SidecarSemantics<'a> {
    fn new(sidecar: &'a ModelSidecar) -> Self {
        Self {
            sidecar,
            known: HashMap::new(),
        }
    }

    fn of_part(&mut self, raw: &RawModel, part: &RawPart) -> Option<Option<Semantic>> {
        if self.sidecar.semantics.is_empty() {
            return None;
        }
        let mut of = |name: &str| {
            if let Some(&told) = self.known.get(name) {
                return told;
            }
            let told = self.sidecar.of(name);
            self.known.insert(name.into(), told);
            told
        };
        names_of(raw, part).find_map(&mut of)
    }
}

/// Removes what the sidecar leaves out, and what is seen nowhere.
pub(super) fn leave_out(raw: &mut RawModel, sidecar: &ModelSidecar) {
    let mut parts = std::mem::take(&mut raw.parts);
    let mut of_sidecar = SidecarSemantics::new(sidecar);
    parts.retain(|part| {
        let is_seen = raw.materials[part.material].alpha != super::raw::Alpha::Nowhere;
        is_seen && of_sidecar.of_part(raw, part) != Some(None)
    });
    raw.parts = parts;
}

/// The semantic of each part.
pub(super) fn find(
    raw: &mut RawModel,
    sidecar: &ModelSidecar,
    kind: ModelKind,
) -> Result<Vec<Semantic>, ImportError> {
    let (mut unknown, mut guessed) = (BTreeSet::new(), BTreeSet::new());
    let mut semantics = Vec::new();
    let mut of_sidecar = SidecarSemantics::new(sidecar);
    for part in &raw.parts {
        let of_material = raw.materials[part.material].hints.semantic;
        if let Some(semantic) = of_sidecar.of_part(raw, part).flatten().or(of_material) {
            semantics.push(semantic);
            continue;
        }
        let semantic = match kind {
            ModelKind::Shrub => Some((Semantic::Shrub, None)),
            ModelKind::Rock => Some((Semantic::Rock, None)),
            ModelKind::Log => Some((Semantic::Log, None)),
            ModelKind::Tree => {
                let by_word = |name| by_word(name).map(|semantic| (semantic, Some(name)));
                names_of(raw, part).find_map(by_word)
            }
        };
        match semantic {
            Some((semantic, by)) => {
                semantics.push(semantic);
                if let Some(name) = by {
                    guessed.insert(format!("{} is {}", shown(name), semantic.name()));
                }
            }
            None => {
                let names: Vec<String> = names_of(raw, part).take(4).map(shown).collect();
                unknown.insert(match names.as_slice() {
                    [] => "one without a name".to_owned(),
                    [material, ..] if names.len() == 1 => material.clone(),
                    [first, rest @ ..] => format!("{first} (of {})", rest.join(", ")),
                });
            }
        }
    }
    if !unknown.is_empty() {
        let listed = unknown
            .iter()
            .take(20)
            .cloned()
            .collect::<Vec<_>>()
            .join("; ");
        return Err(ImportError::file(format!(
            "it is not known what these of its materials are: {listed}. Say it in the table \
             [semantics] of its sidecar, by the name of a material or a node: \"nothing\" leaves \
             it out, else it is one of {}",
            names()
        )));
    }
    for guess in guessed {
        raw.note(format!("guessed by its name that {guess}"));
    }
    Ok(semantics)
}

/// What a name means on a tree, by its words.
fn by_word(name: &str) -> Option<Semantic> {
    let words = words(name);
    let has = |&&(word, _): &&(&str, Semantic)| words.iter().any(|w| w == word);
    WORDS.iter().find(has).map(|&(_, semantic)| semantic)
}

/// The words of a name in lower case: `OakLeaf_02` has oak and leaf.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_lower = false;
    for c in name.chars() {
        if !c.is_alphabetic() || (was_lower && c.is_uppercase()) {
            words.push(String::new());
        }
        if c.is_alphabetic()
            && let Some(word) = words.last_mut()
        {
            word.extend(c.to_lowercase());
        }
        was_lower = c.is_lowercase();
    }
    words
}

#[cfg(test)]
mod tests {
    use super::super::raw::RawMaterial;
    use super::*;

    #[test]
    fn of_a_long_name_the_first_part_is_looked_at() {
        let raw = RawModel {
            materials: vec![RawMaterial::plain(&"0".repeat(1000))],
            ..RawModel::default()
        };
        let part = RawPart {
            names: Vec::new(),
            material: 0,
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            triangles: Vec::new(),
        };
        let names: Vec<&str> = names_of(&raw, &part).collect();
        assert_eq!(names, ["0".repeat(256)]);
    }

    #[test]
    fn words_of_names() {
        assert_eq!(by_word("OakLeaf_02"), Some(Semantic::Leaf));
        assert_eq!(by_word("pine-needles.001"), Some(Semantic::Needle));
        assert_eq!(by_word("bark (leaves)"), Some(Semantic::Leaf));
        assert_eq!(by_word("TreeBARK"), Some(Semantic::Stem));
        assert_eq!(by_word("tree_BARK"), Some(Semantic::Stem));
        assert_eq!(by_word("leaflet"), None);
    }

    #[test]
    fn the_longest_pattern_decides() {
        let sidecar = ModelSidecar {
            semantics: [
                ("oak*".to_owned(), Some(Semantic::Leaf)),
                ("*_bark".to_owned(), Some(Semantic::Stem)),
                ("oak_ground".to_owned(), None),
            ]
            .into(),
            ..ModelSidecar::default()
        };
        assert_eq!(sidecar.of("oak_bark"), Some(Some(Semantic::Stem)));
        assert_eq!(sidecar.of("oak_1"), Some(Some(Semantic::Leaf)));
        assert_eq!(sidecar.of("oak_ground"), Some(None));
        assert_eq!(sidecar.of("elm"), None);
    }
}
