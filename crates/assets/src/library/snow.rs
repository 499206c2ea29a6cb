//! Snow that lies on the ground and on what lies there.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{
    LaserBand, Material, MaterialId, MaterialLibrary, Optics, PlantCommunity, Prototype, Semantic,
    Texture,
};
use nemoral_seed::Key;
use rayon::prelude::*;

use super::{Library, PlantAsset};
use crate::plant::shape::Shape;
use crate::textures::snow::{SNOW_M, snow};

/// Snow of some days, with grains of 0.2 mm (Wiscombe and Warren 1980; Kokhanovsky and Zege 2004,
/// with the absorption of ice by Warren and Brandt 2008): at 905 nm the brightest thing in the
/// wood, at 1550 nm the darkest.
const OPTICS: Optics = Optics {
    nm905: band(0.81),
    nm1550: band(0.05),
};

const fn band(reflectance: f32) -> LaserBand {
    LaserBand {
        reflectance,
        transmittance: 0.0,
    }
}

/// Trodden snow is dirtier.
const TRODDEN: f32 = 0.82;

/// Snow lies on what is less steep than some 55 degrees.
const LEAST_RISE: f32 = 0.57;

/// The height of grass, herbs and ferns over that without snow, where it is at least so deep,
/// metres (our choice).
const FOLDED: f32 = 0.35;
const FOLDS_M: f64 = 0.1;

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
                mask: None,
                tile_m: SNOW_M,
                optics: OPTICS,
                liquid: None,
                ground: below.ground,
            };
            (of, library.add(cover))
        };
        Self {
            covers: below.into_iter().map(cover).collect(),
        }
    }

    /// A shape with snow on the upper sides of its wood and stone.
    fn capped(&self, shape: &Prototype, library: &MaterialLibrary) -> Prototype {
        let mut capped = Shape::of(shape);
        let mesh = &mut capped.mesh;
        for triangle in &mut mesh.triangles {
            let [a, b, c] = triangle.corners.map(|i| mesh.positions[i as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal.z > LEAST_RISE {
                triangle.material = self.over(triangle.material);
            }
        }
        like(shape, capped, library)
    }
}

/// A shape with other parts, which lie in the same order.
fn like(shape: &Prototype, parts: Shape, library: &MaterialLibrary) -> Prototype {
    let made = Prototype::new(shape.name().to_owned(), parts.mesh, parts.cards, library)
        .and_then(|made| match shape.card_windows() {
            [] => Ok(made),
            windows => made.with_card_windows(windows.to_vec()),
        })
        .and_then(|made| match shape.ambient_occlusion() {
            None => Ok(made),
            Some(occlusion) => made.with_ambient_occlusion(occlusion.clone()),
        });
    made.expect("it has as many parts, of this library's materials")
}

impl Library {
    /// Lets it snow: adds the materials of snow on the ground, and covers the upper sides of rocks,
    /// stones, stumps, logs, root plates and lying branches; grass, herbs and ferns are folded
    /// down. `depth_m` is its depth in the open; `beds` are further materials of the ground.
    /// Textures are made if they are wanted.
    pub fn add_snow(
        &mut self,
        (key, textures): (Key, bool),
        depth_m: f64,
        beds: &[MaterialId],
    ) -> SnowMaterials {
        let fresh = match textures {
            true => snow(key.to_u64() as u32).texture(),
            false => Texture::plain(Vec3::splat(0.86)),
        };
        let trodden = fresh.with_curve(|c| c * TRODDEN);
        let ground = &self.ground;
        let trails = ground
            .trails
            .iter()
            .flat_map(|t| [t.surface, t.rut, t.strip]);
        let mut below: Vec<MaterialId> = (ground.floor.iter().copied())
            .chain([ground.cut_slope, ground.bare_soil])
            .chain(ground.rock_face)
            .chain(trails)
            .chain(beds.iter().copied())
            .collect();
        for shape in self.covered().iter().flat_map(|plants| plants.iter()) {
            below.extend(materials_of(&shape.prototype));
        }
        let logs = self.deadwood.logs.iter().chain(&self.deadwood.thrown);
        below.extend(logs.flat_map(|log| materials_of(&log.prototype)));
        let snow = SnowMaterials::new(&mut self.materials, below, [fresh, trodden].map(Arc::new));
        let library = self.materials.clone();
        let cap = |shape: &mut Arc<Prototype>| *shape = Arc::new(snow.capped(shape, &library));
        for plants in self.covered() {
            plants
                .par_iter_mut()
                .for_each(|plant| cap(&mut plant.prototype));
        }
        let deadwood = &mut self.deadwood;
        let logs = deadwood.logs.par_iter_mut().chain(&mut deadwood.thrown);
        logs.for_each(|log| cap(&mut log.prototype));
        let folded = 1.0 - (1.0 - FOLDED) * (depth_m / FOLDS_M).min(1.0) as f32;
        for plants in self.folded() {
            plants.par_iter_mut().for_each(|plant| {
                let mut low = Shape::of(&plant.prototype);
                low.flatten(folded);
                plant.prototype = Arc::new(like(&plant.prototype, low, &library));
                plant.height_m *= f64::from(folded);
            });
        }
        snow
    }

    /// What the weight of snow folds down.
    fn folded(&mut self) -> impl Iterator<Item = &mut Vec<PlantAsset>> {
        let of_grass = PlantCommunity::ALL
            .map(PlantCommunity::is_grass)
            .into_iter();
        let swards = (self.communities.iter_mut().zip(of_grass))
            .filter(|(_, is_grass)| *is_grass)
            .flat_map(|(tiles, _)| [&mut tiles.wide, &mut tiles.narrow]);
        let patches = [
            &mut self.grass,
            &mut self.herbs,
            &mut self.ferns,
            &mut self.trail_tufts,
        ];
        patches.into_iter().chain(swards)
    }

    /// What lies on the ground or stands on it without leaves; not what lies in water.
    fn covered(&mut self) -> [&mut Vec<PlantAsset>; 12] {
        [
            &mut self.rocks,
            &mut self.stumps,
            &mut self.trail_stones,
            &mut self.trail_steps,
            &mut self.trail_roots,
            &mut self.culverts,
            &mut self.banks,
            &mut self.stone_beds,
            &mut self.surface_roots,
            &mut self.deadwood.root_plates,
            &mut self.deadwood.branches,
            &mut self.deadwood.brash,
        ]
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
