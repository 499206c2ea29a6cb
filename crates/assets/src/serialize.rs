//! A library as bytes, to be stored between runs.

use std::borrow::Cow;
use std::io;
use std::sync::Arc;

use nemoral_scene::{
    AlphaMask, AmbientOcclusion, Card, DecayStage, Liquid, Material, MaterialId, MaterialLibrary,
    Mesh, Occluder, Optics, PlantCommunity, Prototype, PrototypeError, Semantic, Texture,
    TextureWindow,
};
use serde::{Deserialize, Serialize};

use crate::{
    Climbers, CommunityTiles, Deadwood, FlareLobe, GroundMaterials, Library, LitterPatches,
    LogAsset, PlantAsset, SizeClass, StemProfile, StreamStones, TreeAsset, TreeClimbers, TreeSize,
    WoodVolume,
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
    /// The kinds of plants, in the order of [`Library`]'s fields.
    plants: [Vec<StoredPlant<'a>>; 24],
    /// Logs, and stems of thrown trees.
    logs: [Vec<StoredLog<'a>>; 2],
    /// What grows on each tree, and on each snag, in the order of [`TreeClimbers`]' fields.
    climbers: [Vec<[Vec<StoredShape<'a>>; 5]>; 2],
    /// Wide and narrow patches of what each species sheds.
    shed: Vec<[Vec<StoredPlant<'a>>; 2]>,
    /// Wide and narrow tiles of each community.
    communities: [[Vec<StoredPlant<'a>>; 2]; PlantCommunity::ALL.len()],
    ground: Cow<'a, GroundMaterials>,
}

#[derive(Serialize, Deserialize)]
struct StoredMaterial<'a> {
    name: Cow<'a, str>,
    semantic: u8,
    support: Option<u8>,
    /// Index into `textures`.
    albedo: usize,
    transmittance: [f32; 3],
    roughness: f32,
    mask: Option<Cow<'a, AlphaMask>>,
    ground: bool,
    tile_m: f32,
    optics: Optics,
    liquid: Option<Liquid>,
}

#[derive(Serialize, Deserialize)]
struct StoredShape<'a> {
    name: Cow<'a, str>,
    mesh: Cow<'a, Mesh>,
    cards: Cow<'a, [Card]>,
    card_windows: Cow<'a, [TextureWindow]>,
    ambient_occlusion: Option<Cow<'a, AmbientOcclusion>>,
    occluders: Cow<'a, [Occluder]>,
}

#[derive(Serialize, Deserialize)]
struct StoredTree<'a> {
    shape: StoredShape<'a>,
    species: Cow<'a, str>,
    size: TreeSize,
    class: SizeClass,
    alive: bool,
    stem: Cow<'a, StemProfile>,
    stem_volume_m3: f64,
    wood: Option<Cow<'a, WoodVolume>>,
    radius_m: f64,
    flare_lobes: Cow<'a, [FlareLobe]>,
}

#[derive(Serialize, Deserialize)]
struct StoredPlant<'a> {
    shape: StoredShape<'a>,
    name: Cow<'a, str>,
    radius_m: f64,
    height_m: f64,
}

#[derive(Serialize, Deserialize)]
struct StoredLog<'a> {
    shape: StoredShape<'a>,
    species: Cow<'a, str>,
    /// 1 to 5.
    stage: u8,
    length_m: f64,
    diameter_m: [f64; 2],
    half_height_m: [f64; 2],
    volume_m3: f64,
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

    fn stored(&self) -> StoredLibrary<'_> {
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
            materials.push(StoredMaterial {
                name: Cow::Borrowed(&material.name),
                semantic: material.semantic as u8,
                support: material.support.map(|s| s as u8),
                albedo,
                transmittance: material.transmittance.to_array(),
                roughness: material.roughness,
                mask: material.mask.as_deref().map(Cow::Borrowed),
                ground: material.ground,
                tile_m: material.tile_m,
                liquid: material.liquid,
                optics: material.optics,
            });
        }
        StoredLibrary {
            textures: textures.into_iter().map(|t| Cow::Borrowed(&**t)).collect(),
            materials,
            full_leaf_masks: (self.full_leaf_masks.iter())
                .map(|(material, mask)| (*material, Cow::Borrowed(&**mask)))
                .collect(),
            always_wet: Cow::Borrowed(&self.always_wet),
            trees: [&self.trees, &self.saplings, &self.snags]
                .map(|trees| trees.iter().map(StoredTree::of).collect()),
            plants: [
                &self.shrubs,
                &self.stumps,
                &self.rocks,
                &self.grass,
                &self.herbs,
                &self.ferns,
                &self.seedlings,
                &self.litter,
                &self.trail_tufts,
                &self.strip_mats,
                &self.trail_stones,
                &self.trail_roots,
                &self.culverts,
                &self.trail_steps,
                &self.surface_roots,
                &self.stone_beds,
                &self.banks,
                &self.deadwood.root_plates,
                &self.deadwood.branches,
                &self.deadwood.brash,
                &self.climbers.carpets,
                &self.stream_stones.rocks,
                &self.stream_stones.stones,
                &self.stream_stones.beds,
            ]
            .map(|plants| plants.iter().map(StoredPlant::of).collect()),
            climbers: [&self.climbers.trees, &self.climbers.snags]
                .map(|trees| trees.iter().map(stored_climbers).collect()),
            logs: [&self.deadwood.logs, &self.deadwood.thrown]
                .map(|logs| logs.iter().map(StoredLog::of).collect()),
            shed: (self.shed.iter())
                .map(|of| [&of.wide, &of.narrow].map(|p| p.iter().map(StoredPlant::of).collect()))
                .collect(),
            communities: (self.communities.each_ref()).map(|tiles| {
                [&tiles.wide, &tiles.narrow].map(|t| t.iter().map(StoredPlant::of).collect())
            }),
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
        let ground = &stored.ground;
        let trails = ground
            .trails
            .iter()
            .flat_map(|t| [t.surface, t.rut, t.strip]);
        let mut of_ground = ground
            .floor
            .iter()
            .copied()
            .chain([ground.cut_slope, ground.bare_soil])
            .chain(ground.rock_face)
            .chain(trails);
        if of_ground.any(|m| usize::from(m.0) >= materials.materials().len()) {
            return Err(DeserializeError::Ground);
        }
        let [trees, saplings, snags] = stored.trees.map(|trees| {
            let trees = trees.into_iter().map(|tree| tree.restore(&materials));
            trees.collect::<Result<Vec<_>, _>>()
        });
        let plants = stored.plants.map(|plants| {
            let plants = plants.into_iter().map(|plant| plant.restore(&materials));
            plants.collect::<Result<Vec<_>, _>>()
        });
        let [
            shrubs,
            stumps,
            rocks,
            grass,
            herbs,
            ferns,
            seedlings,
            litter,
            trail_tufts,
            strip_mats,
            trail_stones,
            trail_roots,
            culverts,
            trail_steps,
            surface_roots,
            stone_beds,
            banks,
            root_plates,
            branches,
            brash,
            carpets,
            wet_rocks,
            wet_stones,
            wet_beds,
        ] = plants;
        let [on_trees, on_snags] = stored.climbers.map(|trees| {
            let trees = trees.into_iter().map(|shapes| {
                let [ivy, moss, honeysuckle, clematis, resin] = shapes.map(|shapes| {
                    let shapes = shapes.into_iter().map(|s| s.restore(&materials));
                    shapes.collect::<Result<Vec<_>, _>>()
                });
                Ok(TreeClimbers {
                    ivy: ivy?,
                    moss: moss?,
                    honeysuckle: honeysuckle?.pop(),
                    clematis: clematis?.pop(),
                    resin: resin?.pop(),
                })
            });
            trees.collect::<Result<Vec<_>, DeserializeError>>()
        });
        let restored = |plants: Vec<StoredPlant<'_>>| {
            let plants = plants.into_iter().map(|plant| plant.restore(&materials));
            plants.collect::<Result<Vec<_>, _>>()
        };
        let shed = stored.shed.into_iter().map(|[wide, narrow]| {
            Ok(LitterPatches {
                wide: restored(wide)?,
                narrow: restored(narrow)?,
            })
        });
        let shed = shed.collect::<Result<Vec<_>, DeserializeError>>()?;
        let mut communities: [CommunityTiles; PlantCommunity::ALL.len()] = Default::default();
        for (tiles, stored) in communities.iter_mut().zip(stored.communities) {
            let [wide, narrow] = stored.map(|plants| {
                let plants = plants.into_iter().map(|plant| plant.restore(&materials));
                plants.collect::<Result<Vec<_>, _>>()
            });
            *tiles = CommunityTiles {
                wide: wide?,
                narrow: narrow?,
            };
        }
        let [logs, thrown] = stored.logs.map(|logs| {
            let logs = logs.into_iter().map(|log| log.restore(&materials));
            logs.collect::<Result<Vec<_>, _>>()
        });
        Ok(Self {
            full_leaf_masks,
            always_wet: stored.always_wet.into_owned(),
            trees: trees?,
            saplings: saplings?,
            snags: snags?,
            shrubs: shrubs?,
            stumps: stumps?,
            rocks: rocks?,
            grass: grass?,
            herbs: herbs?,
            ferns: ferns?,
            seedlings: seedlings?,
            litter: litter?,
            shed,
            trail_tufts: trail_tufts?,
            strip_mats: strip_mats?,
            trail_stones: trail_stones?,
            trail_roots: trail_roots?,
            culverts: culverts?,
            trail_steps: trail_steps?,
            surface_roots: surface_roots?,
            stone_beds: stone_beds?,
            stream_stones: StreamStones {
                rocks: wet_rocks?,
                stones: wet_stones?,
                beds: wet_beds?,
            },
            banks: banks?,
            climbers: Climbers {
                trees: on_trees?,
                snags: on_snags?,
                carpets: carpets?,
            },
            deadwood: Deadwood {
                logs: logs?,
                thrown: thrown?,
                root_plates: root_plates?,
                branches: branches?,
                brash: brash?,
            },
            communities,
            ground: stored.ground.into_owned(),
            materials,
        })
    }
}

impl StoredMaterial<'_> {
    fn restore(self, textures: &[Arc<Texture>]) -> Result<Material, DeserializeError> {
        let semantic = Semantic::from_u8(self.semantic);
        let support = self.support.map(Semantic::from_u8);
        let (Some(semantic), Some(albedo)) = (semantic, textures.get(self.albedo)) else {
            return Err(DeserializeError::Material {
                name: self.name.into_owned(),
            });
        };
        if support == Some(None) {
            return Err(DeserializeError::Material {
                name: self.name.into_owned(),
            });
        }
        Ok(Material {
            name: self.name.into_owned(),
            semantic,
            support: support.flatten(),
            albedo: Arc::clone(albedo),
            transmittance: self.transmittance.into(),
            roughness: self.roughness,
            mask: self.mask.map(|mask| Arc::new(mask.into_owned())),
            ground: self.ground,
            tile_m: self.tile_m,
            liquid: self.liquid,
            optics: self.optics,
        })
    }
}

impl<'a> StoredShape<'a> {
    fn of(prototype: &'a Prototype) -> Self {
        Self {
            name: Cow::Borrowed(prototype.name()),
            mesh: Cow::Borrowed(prototype.mesh()),
            cards: Cow::Borrowed(prototype.cards()),
            card_windows: Cow::Borrowed(prototype.card_windows()),
            ambient_occlusion: prototype.ambient_occlusion().map(Cow::Borrowed),
            occluders: Cow::Borrowed(prototype.occluders()),
        }
    }

    fn restore(self, materials: &MaterialLibrary) -> Result<Arc<Prototype>, DeserializeError> {
        let (mesh, cards) = (self.mesh.into_owned(), self.cards.into_owned());
        let mut prototype = Prototype::new(self.name, mesh, cards, materials)?;
        if !self.card_windows.is_empty() {
            prototype = prototype.with_card_windows(self.card_windows.into_owned())?;
        }
        prototype = prototype.with_occluders(self.occluders.into_owned());
        Ok(Arc::new(match self.ambient_occlusion {
            Some(near) => prototype.with_ambient_occlusion(near.into_owned())?,
            None => prototype,
        }))
    }
}

impl<'a> StoredTree<'a> {
    fn of(tree: &'a TreeAsset) -> Self {
        Self {
            shape: StoredShape::of(&tree.prototype),
            species: Cow::Borrowed(&tree.species),
            size: tree.size,
            class: tree.class,
            alive: tree.alive,
            stem: Cow::Borrowed(&tree.stem),
            stem_volume_m3: tree.stem_volume_m3,
            wood: tree.wood.as_ref().map(Cow::Borrowed),
            radius_m: tree.radius_m,
            flare_lobes: Cow::Borrowed(&tree.flare_lobes),
        }
    }

    fn restore(self, materials: &MaterialLibrary) -> Result<TreeAsset, DeserializeError> {
        Ok(TreeAsset {
            prototype: self.shape.restore(materials)?,
            species: self.species.into_owned(),
            size: self.size,
            class: self.class,
            alive: self.alive,
            stem: self.stem.into_owned(),
            stem_volume_m3: self.stem_volume_m3,
            wood: self.wood.map(Cow::into_owned),
            radius_m: self.radius_m,
            flare_lobes: self.flare_lobes.into_owned(),
        })
    }
}

impl<'a> StoredPlant<'a> {
    fn of(plant: &'a PlantAsset) -> Self {
        Self {
            shape: StoredShape::of(&plant.prototype),
            name: Cow::Borrowed(&plant.name),
            radius_m: plant.radius_m,
            height_m: plant.height_m,
        }
    }

    fn restore(self, materials: &MaterialLibrary) -> Result<PlantAsset, DeserializeError> {
        Ok(PlantAsset {
            prototype: self.shape.restore(materials)?,
            name: self.name.into_owned(),
            radius_m: self.radius_m,
            height_m: self.height_m,
        })
    }
}

/// What grows on a tree.
fn stored_climbers(tree: &TreeClimbers) -> [Vec<StoredShape<'_>>; 5] {
    let TreeClimbers {
        ivy,
        moss,
        honeysuckle,
        clematis,
        resin,
    } = tree;
    let [honeysuckle, clematis, resin] = [honeysuckle, clematis, resin].map(Option::as_slice);
    let all = [ivy, moss, honeysuckle, clematis, resin];
    all.map(|shapes| shapes.iter().map(|s| StoredShape::of(s)).collect())
}

impl<'a> StoredLog<'a> {
    fn of(log: &'a LogAsset) -> Self {
        Self {
            shape: StoredShape::of(&log.prototype),
            species: Cow::Borrowed(&log.species),
            stage: log.stage.number(),
            length_m: log.length_m,
            diameter_m: log.diameter_m,
            half_height_m: log.half_height_m,
            volume_m3: log.volume_m3,
        }
    }

    fn restore(self, materials: &MaterialLibrary) -> Result<LogAsset, DeserializeError> {
        Ok(LogAsset {
            prototype: self.shape.restore(materials)?,
            species: self.species.into_owned(),
            stage: DecayStage::from_number(self.stage)
                .ok_or(DeserializeError::DecayStage(self.stage))?,
            length_m: self.length_m,
            diameter_m: self.diameter_m,
            half_height_m: self.half_height_m,
            volume_m3: self.volume_m3,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AssetParams;
    use nemoral_seed::Key;

    #[test]
    fn a_library_comes_back_to_the_bit() {
        let params = AssetParams {
            individuals_per_species: 1,
            saplings_per_species: 1,
            seedlings_per_species: 1,
            snags_per_species: 1,
            deadwood: true,
            climbers: Some(crate::ClimberParams {
                lianas: true,
                resin: true,
                moss: crate::StemMoss {
                    amount: 1.0,
                    height_m: 1.0,
                },
            }),
            ..AssetParams::default()
        };
        let library = Library::grow(&params, Key::world(3)).expect("valid");
        let bytes = library.to_bytes();
        let back = Library::from_bytes(&bytes).expect("its own bytes");
        let mut written = Vec::new();
        back.write(&mut written).expect("memory");
        assert!(bytes == written);
        let texts = |library: &Library| {
            let trees = [&library.trees, &library.saplings, &library.snags].into_iter();
            let trees = trees.flatten().map(|t| {
                let name = t.prototype.name();
                format!(
                    "{:?}",
                    (
                        name,
                        &t.species,
                        t.size,
                        t.class,
                        t.alive,
                        (&t.stem, t.stem_volume_m3, &t.wood),
                        t.radius_m
                    )
                )
            });
            let plants = [
                &library.shrubs,
                &library.ferns,
                &library.seedlings,
                &library.rocks,
                &library.deadwood.root_plates,
                &library.deadwood.branches,
                &library.deadwood.brash,
            ];
            let plants = plants.into_iter().flatten().map(|p| {
                format!(
                    "{:?}",
                    (p.prototype.name(), &p.name, p.radius_m, p.height_m)
                )
            });
            let mut texts: Vec<String> = trees.chain(plants).collect();
            let dead = [&library.deadwood.logs, &library.deadwood.thrown];
            texts.extend(dead.into_iter().flatten().map(|l| {
                let sizes = (l.length_m, l.diameter_m, l.half_height_m, l.volume_m3);
                format!("{:?}", (l.prototype.name(), &l.species, l.stage, sizes))
            }));
            texts.push(format!("{:?}", (&library.ground, &library.materials)));
            texts
        };
        assert_eq!(texts(&library), texts(&back));
        let shapes = |library: &Library| library.trees[1].prototype.clone();
        let (grown, back) = (shapes(&library), shapes(&back));
        assert!(grown.mesh() == back.mesh() && grown.cards() == back.cards());
        assert!(
            grown.ambient_occlusion().is_some()
                && grown.ambient_occlusion() == back.ambient_occlusion()
        );
        for damaged in [&bytes[..bytes.len() / 2], &[], &bytes[1..]] {
            assert!(Library::from_bytes(damaged).is_err());
        }
    }
}
