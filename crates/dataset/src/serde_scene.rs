//! How the vocabulary's types look in `dataset.json`.

/// `{ "translation_m": [x, y, z], "rotation_xyzw": [x, y, z, w] }`: the bits survive.
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

/// `{ "sky", "flow", "trunks", "boxes" }`, each true or false; `"radiance"` if it is true.
pub(crate) mod extra_kinds {
    use nemoral_scene::ExtraKinds;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Form {
        sky: bool,
        flow: bool,
        trunks: bool,
        boxes: bool,
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        radiance: bool,
    }

    pub(crate) fn serialize<S: Serializer>(k: &ExtraKinds, s: S) -> Result<S::Ok, S::Error> {
        Form {
            sky: k.sky,
            flow: k.flow,
            trunks: k.trunks,
            boxes: k.boxes,
            radiance: k.radiance,
        }
        .serialize(s)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<ExtraKinds, D::Error> {
        let form = Form::deserialize(d)?;
        Ok(ExtraKinds {
            sky: form.sky,
            flow: form.flow,
            trunks: form.trunks,
            boxes: form.boxes,
            radiance: form.radiance,
        })
    }
}

/// `{ "exposure_s", "readout_s" }`.
pub(crate) mod shutter {
    use nemoral_scene::Shutter;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Form {
        exposure_s: f64,
        readout_s: f64,
    }

    pub(crate) fn is_instant(shutter: &Shutter) -> bool {
        *shutter == Shutter::INSTANT
    }

    pub(crate) fn serialize<S: Serializer>(shutter: &Shutter, s: S) -> Result<S::Ok, S::Error> {
        Form {
            exposure_s: shutter.exposure_s,
            readout_s: shutter.readout_s,
        }
        .serialize(s)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Shutter, D::Error> {
        let form = Form::deserialize(d)?;
        Ok(Shutter {
            exposure_s: form.exposure_s,
            readout_s: form.readout_s,
        })
    }
}

/// `{ "linear_m_s": [x, y, z], "angular_rad_s": [x, y, z] }`.
pub(crate) mod twist {
    use nemoral_scene::Twist;
    use nemoral_scene::glam::DVec3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Form {
        linear_m_s: [f64; 3],
        angular_rad_s: [f64; 3],
    }

    pub(crate) fn is_still(twist: &Twist) -> bool {
        *twist == Twist::STILL
    }

    pub(crate) fn serialize<S: Serializer>(twist: &Twist, s: S) -> Result<S::Ok, S::Error> {
        Form {
            linear_m_s: twist.linear_m_s.to_array(),
            angular_rad_s: twist.angular_rad_s.to_array(),
        }
        .serialize(s)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Twist, D::Error> {
        let form = Form::deserialize(d)?;
        Ok(Twist {
            linear_m_s: DVec3::from_array(form.linear_m_s),
            angular_rad_s: DVec3::from_array(form.angular_rad_s),
        })
    }
}

/// `{ "width", "height", "fx", "fy", "cx", "cy" }`, pixels; behind a lens also `"distortion":
/// { "model", "k1", … }`.
pub(crate) mod intrinsics {
    use nemoral_scene::{Distortion, Intrinsics};
    use serde::ser::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Form {
        width: u32,
        height: u32,
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        #[serde(default, skip_serializing_if = "Lens::is_none")]
        distortion: Lens,
    }

    /// OpenCV's coefficients by name.
    #[derive(Default, Serialize, Deserialize)]
    #[serde(tag = "model", rename_all = "snake_case")]
    enum Lens {
        #[default]
        None,
        BrownConrady {
            k1: f64,
            k2: f64,
            k3: f64,
            p1: f64,
            p2: f64,
        },
        Fisheye {
            k1: f64,
            k2: f64,
            k3: f64,
            k4: f64,
        },
    }

    impl Lens {
        fn is_none(&self) -> bool {
            matches!(self, Self::None)
        }
    }

    pub(crate) fn serialize<S: Serializer>(k: &Intrinsics, s: S) -> Result<S::Ok, S::Error> {
        Form {
            width: k.width,
            height: k.height,
            fx: k.fx,
            fy: k.fy,
            cx: k.cx,
            cy: k.cy,
            distortion: match k.distortion {
                Distortion::None => Lens::None,
                Distortion::BrownConrady { k1, k2, k3, p1, p2 } => {
                    Lens::BrownConrady { k1, k2, k3, p1, p2 }
                }
                Distortion::Fisheye { k1, k2, k3, k4 } => Lens::Fisheye { k1, k2, k3, k4 },
                other => return Err(S::Error::custom(format!("{other:?} has no name"))),
            },
        }
        .serialize(s)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Intrinsics, D::Error> {
        let form = Form::deserialize(d)?;
        Ok(Intrinsics {
            width: form.width,
            height: form.height,
            fx: form.fx,
            fy: form.fy,
            cx: form.cx,
            cy: form.cy,
            distortion: match form.distortion {
                Lens::None => Distortion::None,
                Lens::BrownConrady { k1, k2, k3, p1, p2 } => {
                    Distortion::BrownConrady { k1, k2, k3, p1, p2 }
                }
                Lens::Fisheye { k1, k2, k3, k4 } => Distortion::Fisheye { k1, k2, k3, k4 },
            },
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
