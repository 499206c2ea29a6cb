//! Areas of leaves and wood by height above the ground.

use std::collections::HashMap;

use nemoral_scene::glam::{DVec3, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Instance, Material, MaterialId, MaterialLibrary, ParamError, Prototype, Semantic,
    TextureWindow,
};

use crate::MapGrid;

/// What a part of a plant is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tissue {
    Leaf,
    Wood,
}

/// The flat parts of a shape that are leaves or wood, each with its opaque area.
#[derive(Clone, Debug)]
pub struct ShapeAreas {
    parts: Vec<Part>,
}

#[derive(Clone, Copy, Debug)]
struct Part {
    middle_m: Vec3,
    /// Along the normal, as long as the area counts, m².
    area_m2: Vec3,
    tissue: Tissue,
}

/// Leaf and wood area in horizontal layers above a map.
///
/// A leaf counts with one side. Wood counts with half of its surface, as in the plant area index
/// (Jonckheere et al. 2004, *Agricultural and Forest Meteorology* 121).
#[derive(Clone, Debug, PartialEq)]
pub struct AreaProfile {
    /// Thickness of a layer, metres.
    pub layer_m: f64,
    /// Area of the map, m².
    pub ground_m2: f64,
    /// One-sided leaf area in each layer from the ground up, m².
    pub leaf_m2: Vec<f64>,
    /// Half of the surface of stems, branches and twigs in the same layers, m².
    pub wood_m2: Vec<f64>,
}

impl ShapeAreas {
    /// Those of a shape whose materials are in a library.
    #[must_use]
    pub fn of(shape: &Prototype, materials: &MaterialLibrary) -> Self {
        let mut parts = Vec::new();
        let mut shares: HashMap<(MaterialId, [u32; 6]), f32> = HashMap::new();
        for (i, card) in shape.cards().iter().enumerate() {
            let material = materials.get(card.material);
            let Some(tissue) = tissue(material) else {
                continue;
            };
            let window = shape.card_windows().get(i).copied();
            let window = window.unwrap_or(TextureWindow::WHOLE);
            let share = *shares
                .entry((card.material, bits(&window)))
                .or_insert_with(|| share_of_window(material.mask.as_deref(), &window));
            parts.push(Part {
                middle_m: card.corner + 0.5 * (card.edge_u + card.edge_v),
                area_m2: share * card.edge_u.cross(card.edge_v),
                tissue,
            });
        }
        let mesh = shape.mesh();
        for triangle in &mesh.triangles {
            let material = materials.get(triangle.material);
            let Some(tissue) = tissue(material) else {
                continue;
            };
            let [a, b, c] = triangle
                .corners
                .map(|corner| mesh.positions[corner as usize]);
            let mask = material.mask.as_deref();
            let share = share_of_triangle(mask, triangle.corners.map(|corner| mesh.uv(corner)));
            // A leaf is one sheet; what has no mask and is wood closes around its inside.
            let sides = match (tissue, mask) {
                (Tissue::Wood, None) => 0.5,
                _ => 1.0,
            };
            parts.push(Part {
                middle_m: (a + b + c) / 3.0,
                area_m2: sides * share * 0.5 * (b - a).cross(c - a),
                tissue,
            });
        }
        Self { parts }
    }
}

impl AreaProfile {
    /// An empty profile of layers so thick over a map.
    ///
    /// # Errors
    /// If `layer_m` is not 0.01 to 100 m.
    pub fn new(layer_m: f64, grid: &MapGrid) -> Result<Self, ParamError> {
        ParamError::check_within("layer_m", layer_m, 0.01, 100.0)?;
        Ok(Self {
            layer_m,
            ground_m2: grid.area_m2(),
            leaf_m2: Vec::new(),
            wood_m2: Vec::new(),
        })
    }

    /// Adds an instance: each of its parts to the layer that its middle is in, above the ground of
    /// the map's cell there. Parts outside of the map do not count.
    ///
    /// `origin_m` is the world position of the origin that the instance's place is relative to,
    /// `ground_m` has the height of the ground for each cell, and `leaf_per_silhouette` is the
    /// one-sided leaf area that a drawn leaf or shoot stands for, in its silhouette (1 for flat
    /// leaves; needles of a shoot hide each other).
    pub fn add(
        &mut self,
        (shape, instance): (&ShapeAreas, &Instance),
        origin_m: DVec3,
        (grid, ground_m): (&MapGrid, &[f64]),
        leaf_per_silhouette: f64,
    ) {
        let to_world = instance.linear;
        // Normals, as long as areas, turn with the cofactors.
        let [x, y, z] = [to_world.x_axis, to_world.y_axis, to_world.z_axis];
        let cofactors = [y.cross(z), z.cross(x), x.cross(y)];
        for part in &shape.parts {
            let here_m = to_world * part.middle_m + instance.position_m;
            let place_m = origin_m + here_m.as_dvec3();
            let Some(cell) = grid.cell_at(place_m.truncate()) else {
                continue;
            };
            let [a, b, c] = part.area_m2.to_array();
            let area_m2 = (a * cofactors[0] + b * cofactors[1] + c * cofactors[2]).length();
            let above_m = (place_m.z - ground_m[cell]).max(0.0);
            let layer = (above_m / self.layer_m) as usize;
            let (sums, factor) = match part.tissue {
                Tissue::Leaf => (&mut self.leaf_m2, leaf_per_silhouette),
                Tissue::Wood => (&mut self.wood_m2, 1.0),
            };
            if sums.len() <= layer {
                sums.resize(layer + 1, 0.0);
            }
            sums[layer] += factor * f64::from(area_m2);
        }
    }

    /// Adds another profile of the same map and layers.
    pub fn join(&mut self, other: &Self) {
        for (sums, more) in [
            (&mut self.leaf_m2, &other.leaf_m2),
            (&mut self.wood_m2, &other.wood_m2),
        ] {
            if sums.len() < more.len() {
                sums.resize(more.len(), 0.0);
            }
            for (sum, more) in sums.iter_mut().zip(more) {
                *sum += more;
            }
        }
    }

    /// How many layers anything is in.
    #[must_use]
    pub fn layers(&self) -> usize {
        self.leaf_m2.len().max(self.wood_m2.len())
    }

    /// One-sided leaf area and half of the wood's surface in a layer, m² per m³.
    #[must_use]
    pub fn densities_m2_m3(&self, layer: usize) -> [f64; 2] {
        let volume_m3 = self.ground_m2 * self.layer_m;
        [&self.leaf_m2, &self.wood_m2]
            .map(|areas| areas.get(layer).copied().unwrap_or(0.0) / volume_m3)
    }

    /// One-sided leaf area of all plants over that of the map, undergrowth included.
    #[must_use]
    pub fn leaf_area_index(&self) -> f64 {
        self.leaf_m2.iter().sum::<f64>() / self.ground_m2
    }
}

/// Whether a surface is that of leaves or of wood that stands.
fn tissue(material: &Material) -> Option<Tissue> {
    use Semantic as S;
    match material.semantic {
        S::Leaf | S::Needle => Some(Tissue::Leaf),
        // Whole plants have one semantic: light passes through their leaves alone.
        S::Shrub | S::Bramble | S::Grass | S::Herb | S::Fern | S::Seedling | S::Climber => {
            let is_leaf = material.transmittance.max_element() > 0.0;
            Some(if is_leaf { Tissue::Leaf } else { Tissue::Wood })
        }
        S::Stem | S::Limb | S::RootFlare | S::Snag | S::Branch | S::Twig | S::StemGrowth => {
            Some(Tissue::Wood)
        }
        _ => None,
    }
}

/// The bits of a window, by which it is known.
fn bits(window: &TextureWindow) -> [u32; 6] {
    let [a, b, c] = [window.origin, window.along_u, window.along_v];
    [a.x, a.y, b.x, b.y, c.x, c.y].map(f32::to_bits)
}

/// The opaque share of a card.
fn share_of_window(mask: Option<&AlphaMask>, window: &TextureWindow) -> f32 {
    const SIDE: usize = 256;
    let Some(mask) = mask else { return 1.0 };
    if *window == TextureWindow::WHOLE {
        return mask.opaque_fraction() as f32;
    }
    let at = |i: usize| (i as f64 + 0.5) / SIDE as f64;
    let opaque = (0..SIDE * SIDE).filter(|i| {
        let uv = window.uv(at(i % SIDE), at(i / SIDE));
        mask.is_opaque(uv.x, uv.y)
    });
    opaque.count() as f32 / (SIDE * SIDE) as f32
}

/// The opaque share of a triangle, by the middles of 64 equal parts.
fn share_of_triangle(mask: Option<&AlphaMask>, uvs: [Vec2; 3]) -> f32 {
    const SIDE: usize = 8;
    let Some(mask) = mask else { return 1.0 };
    let mut opaque = 0;
    for i in 0..SIDE {
        for j in 0..SIDE - i {
            // One that points up, and beside it one that points down.
            for (third, is_there) in [(1.0 / 3.0, true), (2.0 / 3.0, i + j + 1 < SIDE)] {
                let [u, v] = [i, j].map(|k| (k as f32 + third) / SIDE as f32);
                let uv = uvs[0] + u * (uvs[1] - uvs[0]) + v * (uvs[2] - uvs[0]);
                opaque += u32::from(is_there && mask.is_opaque(uv.x, uv.y));
            }
        }
    }
    opaque as f32 / (SIDE * SIDE) as f32
}
