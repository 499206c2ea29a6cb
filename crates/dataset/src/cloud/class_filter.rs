//! The classes whose points a cloud keeps.

use nemoral_scene::{Ontology, Semantic};

use crate::error::shown;
use crate::{Error, PlyPoint};

/// The classes and fine semantics that are kept.
#[derive(Clone, Debug)]
pub(super) struct ClassFilter {
    classes: Vec<u8>,
    semantics: Vec<Semantic>,
}

impl ClassFilter {
    pub(super) fn new(names: &[String], ontology: &Ontology) -> Result<Self, Error> {
        let mut filter = Self {
            classes: Vec::new(),
            semantics: Vec::new(),
        };
        for name in names {
            let class = (ontology.classes().iter()).find(|c| c.name.eq_ignore_ascii_case(name));
            let semantic = Semantic::ALL.iter().find(|s| s.name() == name);
            match (class, semantic) {
                (Some(class), _) => filter.classes.push(class.id),
                (None, Some(semantic)) => filter.semantics.push(*semantic),
                (None, None) => {
                    let classes = ontology.classes().iter().map(|c| shown(&c.name));
                    let all = classes.chain(Semantic::ALL.iter().map(|s| s.name().to_owned()));
                    let allowed = format!("one of {}", all.collect::<Vec<_>>().join(", "));
                    return Err(Error::invalid("only", format!("'{name}'"), allowed));
                }
            }
        }
        Ok(filter)
    }

    pub(super) fn has(&self, p: &PlyPoint) -> bool {
        (self.classes.is_empty() && self.semantics.is_empty())
            || self.classes.contains(&p.class)
            || self.semantics.contains(&p.point.semantic)
    }
}
