//! How the types of `nemoral-scene` are written in `dataset.json`.

/// `{ "translation_m": [x, y, z], "rotation_xyzw": [x, y, z, w] }`, read back to the bit.
pub(crate) mod rigid_transform {
    use nemoral_scene::RigidTransform;
    use nemoral_scene::glam::{DQuat, DVec3};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Form {
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
    }

    pub(crate) fn serialize<S: Serializer>(t: &RigidTransform, s: S) -> Result<S::Ok, S::Error> {
        Form {
            translation_m: t.translation_m.to_array(),
            rotation_xyzw: t.rotation.to_array(),
        }
        .serialize(s)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<RigidTransform, D::Error> {
        let form = Form::deserialize(d)?;
        Ok(RigidTransform {
            rotation: DQuat::from_array(form.rotation_xyzw),
            translation_m: DVec3::from_array(form.translation_m),
        })
    }
}

/// Name, classes with colours, and the class id of every fine semantic by name.
pub(crate) mod ontology {
    use std::collections::BTreeMap;

    use nemoral_scene::{Class, Ontology, Semantic};
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::error::shown;

    /// The last semantic that every manifest names. A manifest made before one was added lacks it,
    /// and its data set has no such surface: the class of the sky stands for it.
    const LAST_OF_FIRST: Semantic = Semantic::Stone;

    #[derive(Serialize, Deserialize)]
    struct Form {
        name: String,
        classes: Vec<ClassForm>,
        semantics: BTreeMap<String, u8>,
    }

    #[derive(Serialize, Deserialize)]
    struct ClassForm {
        id: u8,
        name: String,
        colour: [u8; 3],
    }

    pub(crate) fn serialize<S: Serializer>(o: &Ontology, s: S) -> Result<S::Ok, S::Error> {
        let class = |c: &Class| ClassForm {
            id: c.id,
            name: c.name.clone(),
            colour: c.colour,
        };
        Form {
            name: o.name().to_owned(),
            classes: o.classes().iter().map(class).collect(),
            semantics: Semantic::ALL
                .iter()
                .map(|&s| (s.name().to_owned(), o.class(s).id))
                .collect(),
        }
        .serialize(s)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Ontology, D::Error> {
        let form = Form::deserialize(d)?;
        let names = form.classes.iter().map(|c| &c.name);
        let mut names = names.chain(std::iter::once(&form.name));
        if let Some(name) = names.find(|name| name.contains(char::is_control)) {
            let name = shown(name);
            let message = format!("ontology: name '{name}': must have no control characters");
            return Err(D::Error::custom(message));
        }
        for s in Semantic::ALL.iter().filter(|&&s| s <= LAST_OF_FIRST) {
            if !form.semantics.contains_key(s.name()) {
                return Err(D::Error::custom(format!(
                    "semantic '{}' has no class",
                    s.name()
                )));
            }
        }
        let sky = form.semantics[Semantic::Sky.name()];
        let class_of = |s: Semantic| form.semantics.get(s.name()).copied().unwrap_or(sky);
        let classes = form.classes.into_iter().map(|c| Class {
            id: c.id,
            name: c.name,
            colour: c.colour,
        });
        Ontology::new(&form.name, classes.collect(), class_of)
            .ok_or_else(|| D::Error::custom("classes repeat, or a semantic names an unknown class"))
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::{Ontology, Semantic};
    use serde_json::Value;

    #[derive(Debug, serde::Serialize, serde::Deserialize)]
    struct Header {
        #[serde(with = "super::ontology")]
        ontology: Ontology,
    }

    fn written() -> Value {
        let ontology = Ontology::paper();
        serde_json::to_value(Header { ontology }).expect("it is written")
    }

    fn without(semantic: Semantic) -> Result<Ontology, serde_json::Error> {
        let mut json = written();
        let semantics = json["ontology"]["semantics"].as_object_mut();
        semantics.expect("a table").remove(semantic.name());
        serde_json::from_value(json).map(|h: Header| h.ontology)
    }

    #[test]
    fn ontologies_are_read_as_written() {
        let read: Header = serde_json::from_value(written()).expect("it is read");
        assert_eq!(read.ontology, Ontology::paper());
    }

    #[test]
    fn what_an_older_manifest_could_not_know_is_background() {
        let old = without(Semantic::Log).expect_err("it was always there");
        assert!(old.to_string().contains("'log' has no class"), "{old}");
        let read = without(Semantic::RootPlate).expect("it came later");
        assert_eq!(read.class(Semantic::RootPlate).name, "Background");
        assert_eq!(read.class(Semantic::Log).name, "Trunks");
    }
}
