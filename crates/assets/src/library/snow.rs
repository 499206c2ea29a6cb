//! Snow that lies on the ground, on what lies there, and on crowns.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{
    AmbientOcclusion, Card, Material, MaterialId, MaterialLibrary, Occluder, Optics,
    PlantCommunity, Prototype, Semantic, Texture, TextureWindow,
};
use nemoral_seed::{Domain, Draw, Key};
use rayon::prelude::*;

use self::UnderSnow::{Covered, Folded, Unchanged};
use super::{Library, PlantAsset, PlantKind};
use crate::plant::shape::Shape;
use crate::textures::snow::{SNOW_M, snow};

/// Trodden snow is dirtier.
const TRODDEN: f32 = 0.9;

/// Snow lies on what is less steep than some 55 degrees.
const LEAST_RISE: f32 = 0.57;

/// The height of grass, herbs and ferns over that without snow, where it is at least so deep,
/// metres (our choice).
const FOLDED: f32 = 0.35;
const FOLDS_M: f64 = 0.1;

/// Snow lies on shoots that are so much less than upright, and about so high on them, metres.
const SHOOT_RISE: f32 = 0.3;
const ON_SHOOT_M: [f32; 2] = [0.010, 0.022];
/// The size of the cover of a shoot over that of the shoot.
const COVERED_SHARE: f32 = 0.92;

const ON_CROWNS: Domain = Domain::new("assets.snow.on_crowns");

/// How much snow lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnowParams<'a> {
    /// Its depth on level ground in the open, metres, more than 0.
    pub depth_m: f64,
    /// The share of needled shoots that hold snow, 0..=1; with any, branches do, too.
    pub on_crowns: f64,
    /// Further materials of the ground, such as the beds of waters.
    pub beds: &'a [MaterialId],
    /// Whether it has a texture.
    pub textures: bool,
}

/// The materials of snow, by what it lies on.
#[derive(Clone, Debug, Default)]
pub struct SnowMaterials {
    /// What is covered, and its cover; in order.
    covers: Vec<(MaterialId, MaterialId)>,
}

impl SnowMaterials {
    /// What covers a material; the material itself, if nothing does.
    #[must_use]
    pub fn over(&self, below: MaterialId) -> MaterialId {
        let found = self.covers.binary_search_by_key(&below.0, |(of, _)| of.0);
        found.map_or(below, |i| self.covers[i].1)
    }

    /// All covers.
    pub fn covers(&self) -> impl Iterator<Item = MaterialId> + '_ {
        self.covers.iter().map(|(_, cover)| *cover)
    }

    fn new(
        library: &mut MaterialLibrary,
        below: Vec<MaterialId>,
        textures: [Arc<Texture>; 2],
    ) -> Self {
        let mut below = below;
        below.sort_unstable_by_key(|of| of.0);
        below.dedup();
        let cover = |of: MaterialId| {
            let below = library.get(of).clone();
            let is_trail = matches!(
                below.semantic,
                Semantic::TrailSurface | Semantic::TrailRut | Semantic::TrailStrip
            );
            // A trail is one whatever it is made of, and a log with snow on it a log. What lies on
            // other ground is snow, which the ground holds.
            let is_ground = below.ground && !is_trail;
            let (semantic, support) = if is_ground {
                (Semantic::Snow, Some(below.semantic))
            } else {
                (below.semantic, below.support)
            };
            let cover = Material {
                name: format!("{}.snow", below.name),
                semantic,
                support,
                albedo: Arc::clone(&textures[usize::from(is_trail)]),
                transmittance: Vec3::ZERO,
                roughness: 1.0,
                // Shoots keep their outline.
                tile_m: if below.mask.is_some() { 1.0 } else { SNOW_M },
                mask: below.mask,
                optics: Optics::SNOW,
                liquid: None,
                ground: below.ground,
            };
            (of, library.add(cover))
        };
        Self {
            covers: below.into_iter().map(cover).collect(),
        }
    }

    /// A tree with snow on its branches and on a share of its shoots with needles: on these lies a
    /// second card with the same outline.
    fn snowy(
        &self,
        tree: &Prototype,
        library: &MaterialLibrary,
        share: f64,
        key: Key,
    ) -> Prototype {
        let mut parts = self.covered(tree, library);
        let mut rng = key.rng();
        for (i, card) in tree.cards().iter().enumerate() {
            let (holds, lift_m) = (
                rng.chance(share),
                rng.range_f32(ON_SHOOT_M[0], ON_SHOOT_M[1]),
            );
            let cover = self.over(card.material);
            let rise = card.edge_u.cross(card.edge_v).normalize_or_zero().z.abs();
            if !holds || cover == card.material || rise < SHOOT_RISE {
                continue;
            }
            let rim = 0.5 * (1.0 - COVERED_SHARE);
            parts.shape.cards.push(Card {
                corner: card.corner + rim * (card.edge_u + card.edge_v) + lift_m * Vec3::Z,
                edge_u: COVERED_SHARE * card.edge_u,
                edge_v: COVERED_SHARE * card.edge_v,
                material: cover,
            });
            if let Some(occlusion) = &mut parts.occlusion {
                occlusion.cards.push(occlusion.cards[i]);
            }
            if !parts.windows.is_empty() {
                parts.windows.push(parts.windows[i]);
            }
        }
        parts.made(tree.name(), library)
    }

    /// The parts of a shape with snow on the upper sides of its wood and stone.
    fn covered(&self, shape: &Prototype, library: &MaterialLibrary) -> Parts {
        let mut parts = Parts::of(shape);
        let mesh = &mut parts.shape.mesh;
        for triangle in &mut mesh.triangles {
            let [a, b, c] = triangle.corners.map(|i| mesh.positions[i as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal.z > LEAST_RISE && library.get(triangle.material).mask.is_none() {
                triangle.material = self.over(triangle.material);
            }
        }
        parts
    }
}

/// All that a shape is made of.
struct Parts {
    shape: Shape,
    windows: Vec<TextureWindow>,
    occlusion: Option<AmbientOcclusion>,
    occluders: Vec<Occluder>,
}

impl Parts {
    fn of(shape: &Prototype) -> Self {
        Self {
            shape: Shape::of(shape),
            windows: shape.card_windows().to_vec(),
            occlusion: shape.ambient_occlusion().cloned(),
            occluders: shape.occluders().to_vec(),
        }
    }

    /// Presses it towards the ground: heights are multiplied by a share.
    fn flatten(&mut self, share: f32) {
        self.shape.flatten(share);
        for occluder in &mut self.occluders {
            occluder.position_m.z *= share;
        }
    }

    fn made(self, name: &str, library: &MaterialLibrary) -> Prototype {
        let Shape { mesh, cards } = self.shape;
        let made = Prototype::new(name.to_owned(), mesh, cards, library)
            .and_then(|made| match &self.windows[..] {
                [] => Ok(made),
                _ => made.with_card_windows(self.windows),
            })
            .and_then(|made| match self.occlusion {
                None => Ok(made),
                Some(occlusion) => made.with_ambient_occlusion(occlusion),
            });
        let made = made.expect("its parts are those of a shape, of this library's materials");
        made.with_occluders(self.occluders)
    }
}

impl Library {
    /// Lets it snow: adds the materials of snow on the ground, and covers the upper sides of rocks,
    /// stones, stumps, logs, root plates, lying branches and, if it is asked for, crowns; grass,
    /// herbs and ferns are folded down.
    pub fn add_snow(&mut self, params: &SnowParams<'_>, key: Key) -> SnowMaterials {
        let fresh = match params.textures {
            true => snow(key.to_u64() as u32).texture(),
            false => Texture::plain(Vec3::splat(0.86)),
        };
        let trodden = fresh.with_curve(|c| c * TRODDEN);
        let beds = params.beds.iter().copied();
        let mut below: Vec<MaterialId> = self.ground.all().chain(beds).collect();
        let covered = PlantKind::ALL
            .into_iter()
            .filter(|kind| kind.under_snow() == Covered);
        for plant in covered.flat_map(|kind| &self.plants[kind]) {
            below.extend(materials_of(&plant.prototype));
        }
        let logs = self.deadwood.logs.iter().chain(&self.deadwood.thrown);
        below.extend(logs.flat_map(|log| materials_of(&log.prototype)));
        if params.on_crowns > 0.0 {
            for tree in self.trees.iter().chain(&self.saplings).chain(&self.snags) {
                below.extend(materials_of(&tree.prototype));
                let needles = tree.prototype.cards().iter().map(|card| card.material);
                let is_needle =
                    |of: &MaterialId| self.materials.get(*of).semantic == Semantic::Needle;
                below.extend(needles.filter(is_needle));
            }
        }
        let snow = SnowMaterials::new(&mut self.materials, below, [fresh, trodden].map(Arc::new));
        let library = self.materials.clone();
        let cap = |shape: &mut Arc<Prototype>| {
            *shape = Arc::new(snow.covered(shape, &library).made(shape.name(), &library));
        };
        let folded = 1.0 - (1.0 - FOLDED) * (params.depth_m / FOLDS_M).min(1.0) as f32;
        let fold = |plant: &mut PlantAsset| {
            let mut low = Parts::of(&plant.prototype);
            low.flatten(folded);
            plant.prototype = Arc::new(low.made(plant.prototype.name(), &library));
            plant.height_m *= f64::from(folded);
        };
        for kind in PlantKind::ALL {
            let plants = self.plants[kind].par_iter_mut();
            match kind.under_snow() {
                Covered => plants.for_each(|plant| cap(&mut plant.prototype)),
                Folded => plants.for_each(fold),
                Unchanged => {}
            }
        }
        for community in PlantCommunity::ALL.into_iter().filter(|of| of.is_grass()) {
            let tiles = &mut self.communities[community.index()];
            let tiles = tiles.wide.par_iter_mut().chain(&mut tiles.narrow);
            tiles.for_each(fold);
        }
        let deadwood = &mut self.deadwood;
        let logs = deadwood.logs.par_iter_mut().chain(&mut deadwood.thrown);
        logs.for_each(|log| cap(&mut log.prototype));
        if params.on_crowns > 0.0 {
            for (kind, trees) in [&mut self.trees, &mut self.saplings, &mut self.snags]
                .into_iter()
                .enumerate()
            {
                let key = key.domain(ON_CROWNS).item(kind as u64);
                trees.par_iter_mut().enumerate().for_each(|(i, tree)| {
                    let (share, key) = (params.on_crowns, key.item(i as u64));
                    tree.prototype = Arc::new(snow.snowy(&tree.prototype, &library, share, key));
                });
            }
        }
        snow
    }
}

/// What lying snow does to plants of a kind.
#[derive(Clone, Copy, PartialEq, Eq)]
enum UnderSnow {
    /// Snow lies on their upper sides: they lie on the ground, or stand on it without leaves.
    Covered,
    /// Its weight folds them down.
    Folded,
    /// Nothing: they stand through it, lie below it, or lie in water.
    Unchanged,
}

impl PlantKind {
    const fn under_snow(self) -> UnderSnow {
        match self {
            Self::Stump
            | Self::Rock
            | Self::TrailStone
            | Self::TrailRoot
            | Self::Culvert
            | Self::TrailStep
            | Self::SurfaceRoot
            | Self::StoneBed
            | Self::Bank
            | Self::RootPlate
            | Self::Branch
            | Self::Brash => Covered,
            Self::Grass | Self::Herbs | Self::Ferns | Self::TrailTuft | Self::StripMat => Folded,
            Self::Shrub
            | Self::Seedling
            | Self::Litter
            | Self::IvyCarpet
            | Self::WetRock
            | Self::WetStone
            | Self::WetBed => Unchanged,
        }
    }
}

/// The materials of a shape's triangles.
fn materials_of(shape: &Prototype) -> impl Iterator<Item = MaterialId> + '_ {
    shape
        .mesh()
        .triangles
        .iter()
        .map(|triangle| triangle.material)
}
