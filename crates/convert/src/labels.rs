//! The classes that a conversion writes: the data set's own, or those of a table.

use crate::{Error, Source, Table};

/// A class that is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LabelClass {
    pub(crate) id: u16,
    pub(crate) name: String,
    pub(crate) colour: [u8; 3],
}

/// From the class ids on disk to those that are written.
#[derive(Clone, Debug)]
pub(crate) struct Labels {
    /// In the table's order.
    pub(crate) classes: Vec<LabelClass>,
    id_of: [u16; 256],
}

impl Labels {
    /// The classes of a source, through a table if there is one.
    pub(crate) fn of(source: &Source, table: Option<&Table>) -> Result<Self, Error> {
        let mut id_of = [0; 256];
        let own = source.ontology();
        let Some(table) = table else {
            for class in own.classes() {
                id_of[usize::from(class.id)] = u16::from(class.id);
            }
            let classes = own.classes().iter().map(|c| LabelClass {
                id: u16::from(c.id),
                name: c.name.clone(),
                colour: c.colour,
            });
            return Ok(Self {
                classes: classes.collect(),
                id_of,
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
        });
        Ok(Self {
            classes: classes.collect(),
            id_of,
        })
    }

    /// The id that is written for a class on disk.
    pub(crate) fn id(&self, class: u8) -> u16 {
        self.id_of[usize::from(class)]
    }
}
