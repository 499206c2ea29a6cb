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
        for s in Semantic::ALL {
            if !form.semantics.contains_key(s.name()) {
                return Err(D::Error::custom(format!(
                    "semantic '{}' has no class",
                    s.name()
                )));
            }
        }
        let classes = form.classes.into_iter().map(|c| Class {
            id: c.id,
            name: c.name,
            colour: c.colour,
        });
        Ontology::new(&form.name, classes.collect(), |s| form.semantics[s.name()])
            .ok_or_else(|| D::Error::custom("classes repeat, or a semantic names an unknown class"))
    }
}
