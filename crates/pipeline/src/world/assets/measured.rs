//! The trees of a stem map as objects.

use nemoral_stand::MeasuredSize;

use super::StandingTree;
use crate::config::{MeasuredStem, MeasuredStems, ModelStem};
use crate::world::models::WorldModels;

/// A tree of a stem map as an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredObject {
    /// Its shape in [`WorldAssets::standing`](super::WorldAssets::standing).
    pub(crate) asset: usize,
    pub(crate) size: MeasuredSize,
    /// The radius of its foot, metres.
    pub(crate) radius_m: f64,
}

/// The trees of a stem map that are grown, as objects. `first` are the places of their first living
/// and their first dead shape among the standing trees.
pub(super) fn objects_of(
    measured: &MeasuredStems,
    first: [usize; 2],
    standing: &[StandingTree],
) -> Vec<MeasuredObject> {
    let mut next = first;
    let place = |alive: bool| usize::from(!alive);
    let assets: Vec<usize> = (measured.shapes.iter())
        .map(|shape| {
            let next = &mut next[place(shape.alive)];
            *next += 1;
            *next - 1
        })
        .collect();
    let object = |stem: &MeasuredStem| {
        let asset = assets[stem.shape];
        let tree = &standing[asset].tree;
        let along = stem.height_m / tree.size.height_m;
        // The shape's stem where the copy's breast height is.
        let across = stem.dbh_m / tree.stem.dbh_m(along);
        MeasuredObject {
            asset,
            size: MeasuredSize {
                number: stem.number as u32,
                dbh_m: stem.dbh_m,
                height_m: stem.height_m,
                across,
                along,
            },
            radius_m: tree.radius_m * across,
        }
    };
    measured.stems.iter().map(object).collect()
}

/// A tree of a stem map that is a copy of a model.
pub(super) fn copy_of(
    stem: &ModelStem,
    models: &WorldModels,
    standing: &[StandingTree],
) -> Result<MeasuredObject, String> {
    let mut trees = models.trees();
    let (name, asset) = trees.nth(stem.model).ok_or("the model is not there")?;
    let tree = &standing[asset].tree;
    let stretch = stem.stretch(name, &tree.stem, tree.size.height_m)?;
    let ([across, along], size) = (stretch, tree.size_of_copy(stretch));
    Ok(MeasuredObject {
        asset,
        size: MeasuredSize {
            number: stem.number as u32,
            dbh_m: size.dbh_m,
            height_m: size.height_m,
            across,
            along,
        },
        radius_m: tree.radius_m * across,
    })
}
