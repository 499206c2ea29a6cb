//! Class tables, which map fine semantics to the classes on disk.

mod built_in;

use crate::Semantic;

/// One class of an [`Ontology`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Class {
    /// The number written to `.label` files and semantic images.
    pub id: u8,
    /// The name for human readers.
    pub name: String,
    /// The colour of palettes and pictures, sRGB.
    pub colour: [u8; 3],
}

/// A named table from fine semantics to classes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ontology {
    name: String,
    classes: Vec<Class>,
    /// Index into `classes` by `Semantic as u8`.
    class_of: [u8; Semantic::ALL.len()],
}

impl Ontology {
    /// A table. `class_of` gives the id of the class of each semantic; `None` if it names an id
    /// that `classes` lacks, if ids or names repeat, or if a name has a control character.
    #[must_use]
    pub fn new(name: &str, classes: Vec<Class>, class_of: impl Fn(Semantic) -> u8) -> Option<Self> {
        // Names of strangers' tables are shown in terminals.
        let is_plain = |name: &str| !name.contains(char::is_control);
        if !is_plain(name) || !classes.iter().all(|class| is_plain(&class.name)) {
            return None;
        }
        for (i, a) in classes.iter().enumerate() {
            if classes[..i]
                .iter()
                .any(|b| a.id == b.id || a.name == b.name)
            {
                return None;
            }
        }
        let mut table = [0; Semantic::ALL.len()];
        for (&semantic, slot) in Semantic::ALL.iter().zip(&mut table) {
            *slot = classes.iter().position(|c| c.id == class_of(semantic))? as u8;
        }
        Some(Self {
            name: name.to_owned(),
            classes,
            class_of: table,
        })
    }

    /// The table's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// All classes, in the table's order.
    #[must_use]
    pub fn classes(&self) -> &[Class] {
        &self.classes
    }

    /// The class of a semantic.
    #[inline]
    #[must_use]
    pub fn class(&self, semantic: Semantic) -> &Class {
        &self.classes[usize::from(self.class_of[semantic as usize])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_stable() {
        for (i, &s) in Semantic::ALL.iter().enumerate() {
            assert_eq!(s as usize, i);
            assert_eq!(Semantic::from_u8(i as u8), Some(s));
        }
        assert_eq!(Semantic::from_u8(Semantic::ALL.len() as u8), None);
    }

    #[test]
    fn the_paper_has_eight_classes_and_each_is_used() {
        let paper = Ontology::paper();
        assert_eq!(paper.classes().len(), 8);
        for class in paper.classes() {
            assert!(
                Semantic::ALL.iter().any(|&s| paper.class(s) == class),
                "{}",
                class.name
            );
        }
    }

    #[test]
    fn what_lies_falls_and_flows_has_the_class_of_its_kind() {
        let paper = Ontology::paper();
        for (semantic, class) in [
            (Semantic::Log, "Trunks"),
            (Semantic::RootPlate, "Trunks"),
            (Semantic::FallenBranch, "Terrain"),
            (Semantic::SurfaceRoot, "Terrain"),
            (Semantic::FallenBark, "Terrain"),
            (Semantic::Water, "Terrain"),
            (Semantic::Ice, "Terrain"),
            (Semantic::Snow, "Terrain"),
            (Semantic::AirborneEcho, "Background"),
        ] {
            assert_eq!(paper.class(semantic).name, class, "{}", semantic.name());
        }
    }

    #[test]
    fn fuel_merges_shrubs_and_herbs_alone() {
        let (paper, fuel) = (Ontology::paper(), Ontology::fuel());
        for &s in Semantic::ALL {
            let expected = if paper.class(s).id == 6 {
                5
            } else {
                paper.class(s).id
            };
            assert_eq!(fuel.class(s).id, expected);
        }
        assert_eq!(fuel.class(Semantic::Fern).name, "Fuel");
    }

    #[test]
    fn semantics_are_told_apart_by_number_name_and_colour() {
        let fine = Ontology::semantics();
        assert_eq!(fine.classes().len(), Semantic::ALL.len());
        let mut colours = std::collections::BTreeSet::new();
        for &semantic in Semantic::ALL {
            let class = fine.class(semantic);
            assert_eq!(class.id, semantic as u8);
            assert_eq!(class.name, semantic.name());
            assert!(colours.insert(class.colour), "{}", class.name);
        }
    }

    #[test]
    fn built_in_tables_are_found_by_their_names() {
        for table in Ontology::built_in() {
            assert_eq!(Ontology::by_name(table.name()), Some(table));
        }
        assert_eq!(Ontology::by_name("Paper"), None);
    }

    #[test]
    fn incomplete_or_ambiguous_tables_are_refused() {
        let one = |id| Class {
            id,
            name: format!("c{id}"),
            colour: [0; 3],
        };
        assert_eq!(Ontology::new("x", vec![one(1)], |_| 2), None);
        assert_eq!(Ontology::new("x", vec![one(1), one(1)], |_| 1), None);
        assert!(Ontology::new("x", vec![one(1)], |_| 1).is_some());
        let named = |name: &str| Class {
            name: name.to_owned(),
            ..one(1)
        };
        assert_eq!(Ontology::new("x", vec![named("a\u{1b}[2J")], |_| 1), None);
        assert_eq!(Ontology::new("x\n", vec![one(1)], |_| 1), None);
        assert!(Ontology::new("Wald", vec![named("Bäume: \"x\"")], |_| 1).is_some());
    }
}
