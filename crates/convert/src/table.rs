//! Class tables: other data sets' classes, and which of ours each is made of.

use std::collections::BTreeSet;
use std::path::Path;

use nemoral_scene::{Ontology, Semantic, on_deep_stack};
use serde::Deserialize;

use crate::Error;

/// The most bytes of a table.
const TABLE_BYTES: u64 = 1 << 20;

/// The tables that are built in, by name.
const BUILT_IN: [(&str, &str); 8] = [
    (
        "semantickitti",
        include_str!("../ontologies/semantickitti.toml"),
    ),
    ("rellis", include_str!("../ontologies/rellis.toml")),
    ("goose", include_str!("../ontologies/goose.toml")),
    ("rugd", include_str!("../ontologies/rugd.toml")),
    ("wildscenes", include_str!("../ontologies/wildscenes.toml")),
    (
        "wildscenes-3d",
        include_str!("../ontologies/wildscenes-3d.toml"),
    ),
    (
        "for-instance",
        include_str!("../ontologies/for-instance.toml"),
    ),
    ("asprs", include_str!("../ontologies/asprs.toml")),
];

/// A class table, read from TOML:
/// ```toml
/// name = "mine"
/// source = "where ids, names and colours come from"
/// rest = "void"            # the class of everything that no class lists; optional
/// outside = "beyond"       # the class of trees that stand outside of a cropped cloud; optional
///
/// [[class]]
/// id = 0                   # 0 to 65535
/// name = "void"
/// colour = [0, 0, 0]       # sRGB
/// from = []                # classes of the data set, or fine semantics
/// ignored = true           # neither learnt nor evaluated; optional
///
/// [[class]]
/// id = 4
/// name = "tree"
/// colour = [0, 255, 0]
/// from = ["Trunks", "Canopy", "stem", "leaf"]
///
/// [[class]]
/// id = 5
/// name = "beyond"
/// colour = [90, 90, 90]
/// from = []
/// ```
/// A name of `from` is that of a class of the data set. A table may have names for several
/// ontologies at once, such as the paper's classes and fine semantics.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClassMapping {
    /// Its name.
    pub name: String,
    /// Where its ids, names and colours come from.
    pub source: String,
    /// The name of the class of everything that no class lists.
    pub rest: Option<String>,
    /// The name of the class of trees whose foot is outside of the part of the world that a cloud
    /// is cropped to ([`laz_cloud`](crate::laz_cloud)). `None` if they have the classes of others.
    pub outside: Option<String>,
    /// The classes, in the file's order.
    pub classes: Vec<MappedClass>,
    text: String,
}

/// A class of a [`ClassMapping`].
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MappedClass {
    /// The number that is written.
    pub id: u16,
    /// The name.
    pub name: String,
    /// The colour, sRGB.
    pub colour: [u8; 3],
    /// Names of the data set's classes that it is made of.
    pub from: Vec<String>,
    /// Whether it is neither learnt nor evaluated.
    #[serde(default)]
    pub ignored: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    source: String,
    rest: Option<String>,
    outside: Option<String>,
    class: Vec<MappedClass>,
}

impl ClassMapping {
    /// The names of the built-in tables.
    pub fn built_in() -> impl Iterator<Item = &'static str> {
        BUILT_IN.into_iter().map(|(name, _)| name)
    }

    /// A built-in table by its name, or the table in a file.
    ///
    /// # Errors
    /// [`Error::Ontology`] if it is not valid, [`Error::Files`] if it cannot be read.
    pub fn load(name_or_file: &str) -> Result<Self, Error> {
        let built_in = BUILT_IN.into_iter().find(|(name, _)| *name == name_or_file);
        if let Some((name, text)) = built_in {
            return Self::parse(name, text);
        }
        let path = Path::new(name_or_file);
        match nemoral_files::read_text(path, TABLE_BYTES) {
            Err(e) if e.is_not_found() => {
                let names: Vec<_> = Self::built_in().collect();
                let reason = format!(
                    "there is no such file, and tables are: {}",
                    names.join(", ")
                );
                Err(error(name_or_file, reason))
            }
            text => Self::parse(name_or_file, &text?),
        }
    }

    /// A table from its text; `name_or_file` is what errors call it.
    ///
    /// # Errors
    /// [`Error::Ontology`] if it is not valid.
    pub fn parse(name_or_file: &str, text: &str) -> Result<Self, Error> {
        let read = on_deep_stack(|| toml::from_str::<File>(text));
        let read = read.map_err(|e| error(name_or_file, e.to_string()))?;
        let file = read.map_err(|e| error(name_or_file, e.to_string()))?;
        let table = Self {
            name: file.name,
            source: file.source,
            rest: file.rest,
            outside: file.outside,
            classes: file.class,
            text: text.to_owned(),
        };
        let twice = |names: Vec<String>| {
            let mut seen = BTreeSet::new();
            names.into_iter().find(|name| !seen.insert(name.clone()))
        };
        let classes = &table.classes;
        let listed = || classes.iter().flat_map(|c| c.from.iter().cloned());
        for (what, found) in [
            (
                "id",
                twice(classes.iter().map(|c| c.id.to_string()).collect()),
            ),
            (
                "name",
                twice(classes.iter().map(|c| c.name.clone()).collect()),
            ),
            ("source class", twice(listed().collect())),
        ] {
            if let Some(found) = found {
                return Err(error(
                    name_or_file,
                    format!("the {what} {found} is there twice"),
                ));
            }
        }
        for (key, name) in [("rest", &table.rest), ("outside", &table.outside)] {
            if let Some(name) = name
                && classes.iter().all(|c| c.name != *name)
            {
                let reason = format!("{key} = \"{name}\" is none of its classes");
                return Err(error(name_or_file, reason));
            }
        }
        Ok(table)
    }

    /// The id of the class of trees that stand [outside](Self::outside), if it has one.
    #[must_use]
    pub fn outside_id(&self) -> Option<u16> {
        let name = self.outside.as_ref()?;
        let class = self.classes.iter().find(|c| c.name == *name);
        class.map(|c| c.id)
    }

    /// Its text.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The id for each class of an ontology, in its order. A class that is a semantic
    /// ([`Ontology::semantics`]) has the id of the class which lists it, or else of the one which
    /// lists the paper's class of it.
    ///
    /// # Errors
    /// [`Error::Ontology`] with the names that the table lists and nobody knows, or the classes
    /// that it does not list although it has no `rest`; also if it lists none of the classes,
    /// because it is made for another ontology.
    pub fn ids_for(&self, own: &Ontology) -> Result<Vec<u16>, Error> {
        let built_in = Ontology::built_in();
        let is_known = |name: &str| {
            let known = built_in.iter().chain([own]);
            known.flat_map(Ontology::classes).any(|c| c.name == name)
        };
        let listed = self.classes.iter().flat_map(|c| &c.from);
        let unknown: Vec<_> = listed.filter(|n| !is_known(n)).map(|n| &**n).collect();
        if !unknown.is_empty() {
            let reason = format!("from: no ontology has the classes {}", unknown.join(", "));
            return Err(error(&self.name, reason));
        }
        let paper = Ontology::paper();
        let named = |name: &String| self.classes.iter().find(|c| c.from.contains(name));
        // A semantic that the table does not list belongs to the class of the paper's that it does.
        let listing = |name: &String| {
            let semantic = Semantic::ALL.iter().find(|s| s.name() == name);
            named(name).or_else(|| semantic.and_then(|s| named(&paper.class(*s).name)))
        };
        let names = || own.classes().iter().map(|c| &c.name);
        let missing: Vec<_> = names()
            .filter(|n| listing(n).is_none())
            .map(|n| &**n)
            .collect();
        let is_foreign = missing.len() == own.classes().len();
        if is_foreign || (self.rest.is_none() && !missing.is_empty()) {
            let reason = format!(
                "the data set's ontology '{}' has classes that the table does not list: {}; list \
                 them, or make the data set with output.ontology = one whose classes it lists",
                own.name(),
                missing.join(", ")
            );
            return Err(error(&self.name, reason));
        }
        let rest = (self.rest.as_ref()).and_then(|r| self.classes.iter().find(|c| c.name == *r));
        let ids = names().map(|n| listing(n).or(rest).map_or(0, |c| c.id));
        Ok(ids.collect())
    }
}

impl ClassMapping {
    /// The id for each fine semantic, by its number: of the class that lists it, or else of that
    /// which lists the ontology's class of it, or else of the rest.
    ///
    /// # Errors
    /// As [`ids_for`](Self::ids_for).
    pub fn ids_for_semantics(&self, own: &Ontology) -> Result<Vec<u16>, Error> {
        let of_class = self.ids_for(own)?;
        let id = |semantic: &Semantic| {
            let name = semantic.name().to_owned();
            let finer = self.classes.iter().find(|c| c.from.contains(&name));
            let class = own.class(*semantic);
            let position = own.classes().iter().position(|c| c.id == class.id);
            finer.map_or(of_class[position.expect("a class of its own")], |c| c.id)
        };
        Ok(Semantic::ALL.iter().map(id).collect())
    }
}

fn error(table: &str, reason: String) -> Error {
    Error::Ontology {
        table: table.to_owned(),
        reason,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_tables_fit_every_built_in_ontology() {
        for name in ClassMapping::built_in() {
            let table = ClassMapping::load(name).expect(name);
            assert_eq!(table.name, name);
            assert!(table.source.len() > 10, "{name} cites its source");
            for own in Ontology::built_in() {
                table.ids_for(&own).unwrap_or_else(|e| panic!("{e}"));
            }
            // Each names every semantic itself.
            for semantic in Semantic::ALL {
                let listed = table
                    .classes
                    .iter()
                    .any(|c| c.from.iter().any(|f| f == semantic.name()));
                assert!(
                    listed || table.rest.is_some(),
                    "{name}: {}",
                    semantic.name()
                );
            }
        }
    }

    #[test]
    fn trees_outside_have_a_class_where_a_table_names_one() {
        let of = |name: &str| ClassMapping::load(name).expect("built in").outside_id();
        assert_eq!(of("for-instance"), Some(3));
        let mut others = ClassMapping::built_in().filter(|name| *name != "for-instance");
        assert!(others.all(|name| of(name).is_none()));
    }

    #[test]
    fn semantics_are_finer_than_classes() {
        let table = ClassMapping::load("for-instance").expect("built in");
        let ids = table
            .ids_for_semantics(&Ontology::paper())
            .expect("it fits");
        let of = |semantic: Semantic| ids[semantic as usize];
        // In the paper's classes all three are Canopy.
        assert_eq!(
            [Semantic::Leaf, Semantic::Needle, Semantic::Twig].map(of),
            [5, 5, 6]
        );
        assert_eq!(
            [Semantic::Stem, Semantic::Limb, Semantic::Stump].map(of),
            [4, 6, 0]
        );
        // A data set whose classes are semantics has the same ids.
        let fine = table.ids_for(&Ontology::semantics()).expect("it fits");
        assert_eq!(fine, ids);
        let coarse = "name = \"x\"\nsource = \"s\"\nrest = \"a\"\n[[class]]\nid = 7\n\
                      name = \"a\"\ncolour = [0, 0, 0]\nfrom = [\"Trunks\"]\n";
        let table = ClassMapping::parse("x", coarse).expect("valid");
        let ids = table.ids_for_semantics(&Ontology::paper()).expect("fits");
        assert!(ids.iter().all(|id| *id == 7));
        let both = coarse.replace("[\"Trunks\"]", "[\"Trunks\", \"leaf\"]")
            + "[[class]]\nid = 9\nname = \"b\"\ncolour = [0, 0, 0]\nfrom = [\"Canopy\"]\n";
        let table = ClassMapping::parse("x", &both).expect("valid");
        let ids = table.ids_for(&Ontology::semantics()).expect("fits");
        let of = |semantic: Semantic| ids[semantic as usize];
        assert_eq!(
            [
                Semantic::Leaf,
                Semantic::Needle,
                Semantic::Log,
                Semantic::Water
            ]
            .map(of),
            [7, 9, 7, 7]
        );
    }

    #[test]
    fn what_a_table_lacks_or_invents_is_listed() {
        let head = "name = \"x\"\nsource = \"s\"\n";
        let class = |id: u16, from: &str| {
            format!("[[class]]\nid = {id}\nname = \"c{id}\"\ncolour = [0, 0, 0]\nfrom = [{from}]\n")
        };
        let ids = |text: &str| ClassMapping::parse("x", text)?.ids_for(&Ontology::paper());
        let e = ids(&format!("{head}{}", class(1, "\"Trunks\", \"Canopy\""))).expect_err("lacks");
        assert!(
            e.to_string()
                .contains("Background, Terrain, Traversable, Shrubs"),
            "{e}"
        );
        let e = ids(&format!("{head}{}", class(1, "\"Trunk\", \"Treetop\""))).expect_err("invents");
        assert!(e.to_string().contains("Trunk, Treetop"), "{e}");
        let rest = format!("rest = \"c0\"\n{}", class(0, ""));
        let e = ids(&format!("{head}{rest}{}", class(1, "\"stem\""))).expect_err("other classes");
        assert!(e.to_string().contains("output.ontology"), "{e}");
        let found = ids(&format!("{head}{rest}{}", class(9, "\"Trunks\""))).expect("fits");
        assert_eq!(found, [0, 0, 0, 9, 0, 0, 0, 0]);
        for (text, said) in [
            (format!("{head}{}{}", class(1, ""), class(1, "")), "twice"),
            (
                format!("{head}{}{}", class(1, "\"a\""), class(2, "\"a\"")),
                "twice",
            ),
            (
                format!("{head}rest = \"b\"\n{}", class(1, "")),
                "rest = \"b\" is none of its classes",
            ),
            (
                format!("{head}outside = \"c2\"\n{}", class(1, "")),
                "outside = \"c2\" is none of its classes",
            ),
            (format!("{head}typo = 1\n{}", class(1, "")), "typo"),
        ] {
            let e = ClassMapping::parse("x", &text).expect_err("invalid");
            assert!(e.to_string().contains(said), "{e}");
        }
    }
}
