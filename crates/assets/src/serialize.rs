//! A library as bytes, to be stored between runs.

mod parts;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::io;
use std::sync::Arc;

use nemoral_scene::{
    AlphaMask, MaterialId, MaterialLibrary, PlantCommunity, PrototypeError, Texture,
};
use serde::{Deserialize, Serialize};

use self::parts::{StoredClimbers, StoredLog, StoredMaterial, StoredPlant, StoredTree};
use crate::{
    ByKind, Climbers, CommunityTiles, Deadwood, GroundMaterials, Library, LitterPatches,
    PlantAsset, PlantKind,
};

/// Why bytes are not those of a [`Library`].
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeserializeError {
    /// They are not in the format of this version.
    #[error("not a library: {0}")]
    Format(#[from] postcard::Error),
    /// A material has an unknown semantic, or its texture is missing.
    #[error("not a library: material {name:?} is not whole")]
    Material {
        /// The material's name.
        name: String,
    },
    /// The ground refers to a material that is missing.
    #[error("not a library: a material of the ground is missing")]
    Ground,
    /// A log has a stage of decay that there is not.
    #[error("not a library: a log has the stage of decay {0}, must be 1 to 5")]
    DecayStage(u8),
    /// A prototype is not valid.
    #[error("not a library: {0}")]
    Shape(#[from] PrototypeError),
}

/// What [`Library::to_bytes`] writes: borrowed there, owned when it is read.
#[derive(Serialize, Deserialize)]
struct StoredLibrary<'a> {
    /// Each texture once, as several materials may share one.
    textures: Vec<Cow<'a, Texture>>,
    materials: Vec<StoredMaterial<'a>>,
    full_leaf_masks: Vec<(MaterialId, Cow<'a, AlphaMask>)>,
    always_wet: Cow<'a, [MaterialId]>,
    /// Trees, saplings and snags.
    trees: [Vec<StoredTree<'a>>; 3],
    /// In the order of [`PlantKind::ALL`].
    plants: [Vec<StoredPlant<'a>>; PlantKind::ALL.len()],
    /// Logs, and stems of thrown trees.
    logs: [Vec<StoredLog<'a>>; 2],
    /// What grows on each tree, and on each snag.
    climbers: [Vec<StoredClimbers<'a>>; 2],
    /// Wide and narrow patches of what each species sheds.
    shed: Vec<[Vec<StoredPlant<'a>>; 2]>,
    /// Wide and narrow tiles of each community.
    communities: [[Vec<StoredPlant<'a>>; 2]; PlantCommunity::ALL.len()],
    ground: Cow<'a, GroundMaterials>,
}

impl Library {
    /// The library as bytes for [`Library::from_bytes`] of the same version of this crate.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        postcard::to_stdvec(&self.stored()).expect("plain data can be written")
    }

    /// Writes the same bytes, in many small pieces: to a buffered writer, if it is a file.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write(&self, out: impl io::Write) -> io::Result<()> {
        let written = postcard::to_io(&self.stored(), out);
        written.map(drop).map_err(io::Error::other)
    }

    fn stored<'a>(&'a self) -> StoredLibrary<'a> {
        let mut textures: Vec<&Arc<Texture>> = Vec::new();
        let mut materials = Vec::new();
        for material in self.materials.materials() {
            let known = textures
                .iter()
                .position(|t| Arc::ptr_eq(t, &material.albedo));
            let albedo = known.unwrap_or_else(|| {
                textures.push(&material.albedo);
                textures.len() - 1
            });
            materials.push(StoredMaterial::of(material, albedo));
        }
        let plants = |plants: &'a [PlantAsset]| -> Vec<StoredPlant<'a>> {
            plants.iter().map(StoredPlant::of).collect()
        };
        StoredLibrary {
            textures: textures.into_iter().map(|t| Cow::Borrowed(&**t)).collect(),
            materials,
            full_leaf_masks: (self.full_leaf_masks.iter())
                .map(|(material, mask)| (*material, Cow::Borrowed(&**mask)))
                .collect(),
            always_wet: Cow::Borrowed(&self.always_wet),
            trees: [&self.trees, &self.saplings, &self.snags]
                .map(|trees| trees.iter().map(StoredTree::of).collect()),
            plants: PlantKind::ALL.map(|kind| plants(&self.plants[kind])),
            logs: [&self.deadwood.logs, &self.deadwood.thrown]
                .map(|logs| logs.iter().map(StoredLog::of).collect()),
            climbers: [&self.climbers.trees, &self.climbers.snags]
                .map(|trees| trees.iter().map(StoredClimbers::of).collect()),
            shed: (self.shed.iter())
                .map(|of| [plants(&of.wide), plants(&of.narrow)])
                .collect(),
            communities: (self.communities.each_ref())
                .map(|tiles| [plants(&tiles.wide), plants(&tiles.narrow)]),
            ground: Cow::Borrowed(&self.ground),
        }
    }

    /// Reads what [`Library::to_bytes`] wrote; the library is equal to the bit.
    ///
    /// # Errors
    /// If the bytes are not those of a library, or were written by another version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, DeserializeError> {
        let stored: StoredLibrary = postcard::from_bytes(bytes)?;
        let mut materials = MaterialLibrary::new();
        let textures = stored.textures.into_iter();
        let textures: Vec<_> = textures.map(|t| Arc::new(t.into_owned())).collect();
        for material in stored.materials {
            materials.add(material.restore(&textures)?);
        }
        let full_leaf_masks = (stored.full_leaf_masks.into_iter())
            .map(|(material, mask)| (material, Arc::new(mask.into_owned())))
            .collect();
        if (stored.ground.all()).any(|m| usize::from(m.0) >= materials.materials().len()) {
            return Err(DeserializeError::Ground);
        }
        let [trees, saplings, snags] = stored.trees.map(|trees| {
            let trees = trees.into_iter().map(|tree| tree.restore(&materials));
            trees.collect::<Result<Vec<_>, _>>()
        });
        let restored = |plants: Vec<StoredPlant<'_>>| {
            let plants = plants.into_iter().map(|plant| plant.restore(&materials));
            plants.collect::<Result<Vec<_>, _>>()
        };
        let mut plants = ByKind::new(|_| Vec::new());
        for (kind, stored) in PlantKind::ALL.into_iter().zip(stored.plants) {
            plants[kind] = restored(stored)?;
        }
        let [logs, thrown] = stored.logs.map(|logs| {
            let logs = logs.into_iter().map(|log| log.restore(&materials));
            logs.collect::<Result<Vec<_>, _>>()
        });
        let [on_trees, on_snags] = stored.climbers.map(|trees| {
            let trees = trees.into_iter().map(|on| on.restore(&materials));
            trees.collect::<Result<Vec<_>, _>>()
        });
        let shed = stored.shed.into_iter().map(|[wide, narrow]| {
            Ok(LitterPatches {
                wide: restored(wide)?,
                narrow: restored(narrow)?,
            })
        });
        let shed = shed.collect::<Result<Vec<_>, DeserializeError>>()?;
        let mut communities: [CommunityTiles; PlantCommunity::ALL.len()] = Default::default();
        for (tiles, [wide, narrow]) in communities.iter_mut().zip(stored.communities) {
            *tiles = CommunityTiles {
                wide: restored(wide)?,
                narrow: restored(narrow)?,
            };
        }
        Ok(Self {
            full_leaf_masks,
            always_wet: stored.always_wet.into_owned(),
            trees: trees?,
            saplings: saplings?,
            snags: snags?,
            plants,
            shed,
            deadwood: Deadwood {
                logs: logs?,
                thrown: thrown?,
            },
            climbers: Climbers {
                trees: on_trees?,
                snags: on_snags?,
            },
            communities,
            ground: stored.ground.into_owned(),
            materials,
        })
    }
}
