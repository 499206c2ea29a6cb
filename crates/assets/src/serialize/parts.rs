//! The parts of a stored library: borrowed when they are written, owned when they are read.

use std::borrow::Cow;
use std::sync::Arc;

use nemoral_scene::{
    AlphaMask, AmbientOcclusion, Card, DecayStage, Liquid, Material, MaterialLibrary, Mesh,
    Occluder, Optics, Prototype, Semantic, Texture, TextureWindow,
};
use serde::{Deserialize, Serialize};

use super::DeserializeError;
use crate::{
    FlareLobe, LogAsset, PlantAsset, SizeClass, StemProfile, TreeAsset, TreeClimbers, TreeSize,
    WoodVolume,
};

#[derive(Serialize, Deserialize)]
pub(super) struct StoredMaterial<'a> {
    name: Cow<'a, str>,
    semantic: u8,
    support: Option<u8>,
    /// Index into the stored library's textures.
    albedo: usize,
    transmittance: [f32; 3],
    roughness: f32,
    mask: Option<Cow<'a, AlphaMask>>,
    ground: bool,
    tile_m: f32,
    optics: Optics,
    liquid: Option<Liquid>,
}

impl<'a> StoredMaterial<'a> {
    /// A material whose texture has this index.
    pub(super) fn of(material: &'a Material, albedo: usize) -> Self {
        Self {
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
        }
    }

    pub(super) fn restore(self, textures: &[Arc<Texture>]) -> Result<Material, DeserializeError> {
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

#[derive(Serialize, Deserialize)]
pub(super) struct StoredShape<'a> {
    name: Cow<'a, str>,
    mesh: Cow<'a, Mesh>,
    cards: Cow<'a, [Card]>,
    card_windows: Cow<'a, [TextureWindow]>,
    ambient_occlusion: Option<Cow<'a, AmbientOcclusion>>,
    occluders: Cow<'a, [Occluder]>,
}

impl<'a> StoredShape<'a> {
    pub(super) fn of(prototype: &'a Prototype) -> Self {
        Self {
            name: Cow::Borrowed(prototype.name()),
            mesh: Cow::Borrowed(prototype.mesh()),
            cards: Cow::Borrowed(prototype.cards()),
            card_windows: Cow::Borrowed(prototype.card_windows()),
            ambient_occlusion: prototype.ambient_occlusion().map(Cow::Borrowed),
            occluders: Cow::Borrowed(prototype.occluders()),
        }
    }

    pub(super) fn restore(
        self,
        materials: &MaterialLibrary,
    ) -> Result<Arc<Prototype>, DeserializeError> {
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

#[derive(Serialize, Deserialize)]
pub(super) struct StoredTree<'a> {
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

impl<'a> StoredTree<'a> {
    pub(super) fn of(tree: &'a TreeAsset) -> Self {
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

    pub(super) fn restore(
        self,
        materials: &MaterialLibrary,
    ) -> Result<TreeAsset, DeserializeError> {
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

#[derive(Serialize, Deserialize)]
pub(super) struct StoredPlant<'a> {
    shape: StoredShape<'a>,
    name: Cow<'a, str>,
    radius_m: f64,
    height_m: f64,
}

impl<'a> StoredPlant<'a> {
    pub(super) fn of(plant: &'a PlantAsset) -> Self {
        Self {
            shape: StoredShape::of(&plant.prototype),
            name: Cow::Borrowed(&plant.name),
            radius_m: plant.radius_m,
            height_m: plant.height_m,
        }
    }

    pub(super) fn restore(
        self,
        materials: &MaterialLibrary,
    ) -> Result<PlantAsset, DeserializeError> {
        Ok(PlantAsset {
            prototype: self.shape.restore(materials)?,
            name: self.name.into_owned(),
            radius_m: self.radius_m,
            height_m: self.height_m,
        })
    }
}

#[derive(Serialize, Deserialize)]
pub(super) struct StoredLog<'a> {
    shape: StoredShape<'a>,
    species: Cow<'a, str>,
    /// 1 to 5.
    stage: u8,
    length_m: f64,
    diameter_m: [f64; 2],
    half_height_m: [f64; 2],
    volume_m3: f64,
}

impl<'a> StoredLog<'a> {
    pub(super) fn of(log: &'a LogAsset) -> Self {
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

    pub(super) fn restore(self, materials: &MaterialLibrary) -> Result<LogAsset, DeserializeError> {
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

/// What grows on a tree, in the order of [`TreeClimbers`]' fields.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredClimbers<'a>([Vec<StoredShape<'a>>; 5]);

impl<'a> StoredClimbers<'a> {
    pub(super) fn of(climbers: &'a TreeClimbers) -> Self {
        let TreeClimbers {
            ivy,
            moss,
            honeysuckle,
            clematis,
            resin,
        } = climbers;
        let [honeysuckle, clematis, resin] = [honeysuckle, clematis, resin].map(Option::as_slice);
        let all = [ivy, moss, honeysuckle, clematis, resin];
        Self(all.map(|shapes| shapes.iter().map(|s| StoredShape::of(s)).collect()))
    }

    pub(super) fn restore(
        self,
        materials: &MaterialLibrary,
    ) -> Result<TreeClimbers, DeserializeError> {
        let [ivy, moss, honeysuckle, clematis, resin] = self.0.map(|shapes| {
            let shapes = shapes.into_iter().map(|s| s.restore(materials));
            shapes.collect::<Result<Vec<_>, _>>()
        });
        Ok(TreeClimbers {
            ivy: ivy?,
            moss: moss?,
            honeysuckle: honeysuckle?.pop(),
            clematis: clematis?.pop(),
            resin: resin?.pop(),
        })
    }
}
