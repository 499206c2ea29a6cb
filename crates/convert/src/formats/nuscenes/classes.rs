//! Categories: the kinds of objects that have boxes, and the classes of points (`lidarseg`).

use nemoral_dataset::LidarFrame;
use nemoral_scene::{ObjectKind, Ontology};

use super::{VERSION, unsuitable};
use crate::labels::Labels;
use crate::{ClassMapping, Error};

/// A category.
#[derive(Clone, Debug)]
pub(super) struct Category {
    pub(super) name: String,
    pub(super) description: String,
    pub(super) colour: [u8; 3],
}

/// The classes of points, with the kinds of objects behind them.
#[derive(Debug)]
pub(super) struct Classes {
    labels: Labels,
    /// By `index`: first classes, whose index is what `lidarseg` has of a point, then kinds, which
    /// no point has. The development kit wants indices without gaps.
    pub(super) categories: Vec<Category>,
    /// The index of each class's id.
    index_of: Vec<u8>,
}

impl Classes {
    pub(super) fn of(own: &Ontology, table: Option<&ClassMapping>) -> Result<Self, Error> {
        let labels = Labels::of(own, table)?;
        if labels.classes.len() > 256 {
            return Err(unsuitable(format!(
                "the ontology {} has {} classes: at most 256 fit",
                labels.name,
                labels.classes.len()
            )));
        }
        let most = labels.classes.iter().map(|c| c.id).max().unwrap_or(0);
        let mut index_of = vec![0; usize::from(most) + 1];
        let mut categories = Vec::new();
        for (index, class) in labels.classes.iter().enumerate() {
            index_of[usize::from(class.id)] = index as u8;
            categories.push(Category {
                name: class.name.clone(),
                description: format!("class {} of {}, of points", class.id, labels.name),
                colour: class.colour,
            });
        }
        for &kind in ObjectKind::ALL {
            let name = kind_name(kind);
            if categories.iter().any(|c| c.name == name) {
                return Err(unsuitable(format!(
                    "the ontology {} has a class {name}, as boxes have; call it otherwise",
                    labels.name
                )));
            }
            categories.push(Category {
                description: format!("objects with boxes: {}", kind.name()),
                colour: kind_colour(kind),
                name,
            });
        }
        Ok(Self {
            labels,
            categories,
            index_of,
        })
    }

    /// The content of a `_lidarseg.bin`.
    pub(super) fn of_points(&self, scan: &LidarFrame) -> Vec<u8> {
        let index = |(i, &(class, _)): (usize, &(u16, u16))| {
            // The fine semantics, where the data set has them, tell more.
            let id = match scan.ply.get(i) {
                Some(fine) => self.labels.id_of_semantic(fine.point.semantic),
                // The scan was read with the data set's own classes alone, whose ids are bytes.
                None => self.labels.id(class as u8),
            };
            self.index_of[usize::from(id)]
        };
        scan.labels.iter().enumerate().map(index).collect()
    }
}

/// The place of the classes of a scan.
pub(super) fn file(token: &str) -> String {
    format!("lidarseg/{VERSION}/{token}_lidarseg.bin")
}

/// The category of a kind.
pub(super) fn kind_name(kind: ObjectKind) -> String {
    let group = match kind {
        ObjectKind::Rock => "ground",
        ObjectKind::Log | ObjectKind::RootPlate => "deadwood",
        _ => "vegetation",
    };
    format!("{group}.{}", kind.name())
}

fn kind_colour(kind: ObjectKind) -> [u8; 3] {
    match kind {
        ObjectKind::Rock => [128, 128, 128],
        ObjectKind::Log => [165, 42, 42],
        ObjectKind::RootPlate => [210, 105, 30],
        ObjectKind::Stump => [255, 158, 0],
        ObjectKind::Shrub => [154, 205, 50],
        _ => [34, 139, 34],
    }
}
