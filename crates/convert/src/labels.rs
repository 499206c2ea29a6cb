//! The classes that a conversion writes: the data set's own, or those of a table.

use nemoral_scene::{Ontology, Semantic};

use crate::{ClassMapping, Error};

/// A class that is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LabelClass {
    pub(crate) id: u16,
    pub(crate) name: String,
    pub(crate) colour: [u8; 3],
    /// Whether it is neither learnt nor evaluated.
    pub(crate) ignored: bool,
}

/// From the class ids on disk to those that are written.
#[derive(Clone, Debug)]
pub(crate) struct Labels {
    /// The table's name, or the ontology's.
    pub(crate) name: String,
    /// In the table's order.
    pub(crate) classes: Vec<LabelClass>,
    id_of: [u16; 256],
    /// By the number of the fine semantic.
    id_of_semantic: Vec<u16>,
    /// Of trees that stand outside of a cropped cloud, if the table has a class for them.
    pub(crate) outside: Option<u16>,
}

impl Labels {
    /// The classes of a data set's ontology, through a table if there is one.
    pub(crate) fn of(own: &Ontology, table: Option<&ClassMapping>) -> Result<Self, Error> {
        let mut id_of = [0; 256];
        let Some(table) = table else {
            for class in own.classes() {
                id_of[usize::from(class.id)] = u16::from(class.id);
            }
            let sky = own.class(Semantic::Sky);
            let classes = own.classes().iter().map(|c| LabelClass {
                id: u16::from(c.id),
                name: c.name.clone(),
                colour: c.colour,
                ignored: c == sky,
            });
            let id = |s: &Semantic| u16::from(own.class(*s).id);
            return Ok(Self {
                name: own.name().to_owned(),
                classes: classes.collect(),
                id_of,
                id_of_semantic: Semantic::ALL.iter().map(id).collect(),
                outside: None,
            });
        };
        let ids = table.ids_for(own)?;
        for (class, id) in own.classes().iter().zip(ids) {
            id_of[usize::from(class.id)] = id;
        }
        let classes = table.classes.iter().map(|c| LabelClass {
            id: c.id,
            name: c.name.clone(),
            colour: c.colour,
            ignored: c.ignored,
        });
        Ok(Self {
            name: table.name.clone(),
            classes: classes.collect(),
            id_of,
            id_of_semantic: table.ids_for_semantics(own)?,
            outside: table.outside_id(),
        })
    }

    /// The same, for a place of 8 bits a class.
    pub(crate) fn in_bytes(self) -> Result<Self, Error> {
        match self.classes.iter().find(|c| c.id > 255) {
            None => Ok(self),
            Some(class) => Err(Error::Ontology {
                reason: format!("class {} has id {}: 0 to 255 fit", class.name, class.id),
                table: self.name,
            }),
        }
    }

    /// The id that is written for a fine semantic.
    pub(crate) fn id_of_semantic(&self, semantic: Semantic) -> u16 {
        self.id_of_semantic[semantic as usize]
    }

    /// The id that is written for a class on disk.
    pub(crate) fn id(&self, class: u8) -> u16 {
        self.id_of[usize::from(class)]
    }
}
