//! Areas of leaves and wood by height above the ground.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

use nemoral_scene::glam::{DVec2, DVec3, Vec2, Vec3};
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

/// A triangle or a card.
#[derive(Clone, Copy, Debug)]
struct Part {
    corner_m: Vec3,
    /// The vectors from there to the next corners, metres.
    edges_m: [Vec3; 2],
    /// Whether there is a fourth corner, opposite to the first.
    is_card: bool,
    /// What is counted, in the area of the parallelogram of both edges.
    share: f64,
    tissue: Tissue,
}

/// Leaf and wood area in horizontal layers above a map.
///
/// Leaves count with one side: half of the whole surface, for needles too. Wood counts with half of
/// its surface, as in the plant area index (Jonckheere et al. 2004, *Agricultural and Forest
/// Meteorology* 121).
#[derive(Clone, Debug, PartialEq)]
pub struct AreaProfile {
    /// Thickness of a layer, metres.
    pub layer_m: f64,
    /// Area of the map, m².
    pub ground_m2: f64,
    /// Leaf area in each layer from the ground up, m².
    pub leaf_m2: Vec<f64>,
    /// Half of the surface of stems, branches and twigs in the same layers, m².
    pub wood_m2: Vec<f64>,
}

impl ShapeAreas {
    /// Those of a shape whose materials are in a library.
    ///
    /// `is_cover` says whether a material is that of something that lies on others, as snow on
    /// shoots, and has their semantic. A card of such a material lies over one that counts already,
    /// and does not count; a triangle is the covered wood itself, of which nothing else is there.
    ///
    /// # Panics
    /// If the shape has materials that the library has not.
    #[must_use]
    pub fn of(
        shape: &Prototype,
        materials: &MaterialLibrary,
        is_cover: &dyn Fn(MaterialId) -> bool,
    ) -> Self {
        let mut parts = Vec::new();
        let mut shares: HashMap<(MaterialId, [u32; 6]), f64> = HashMap::new();
        let cards = shape.cards().iter().enumerate();
        for (i, card) in cards.filter(|(_, card)| !is_cover(card.material)) {
            let material = materials.get(card.material);
            let Some(tissue) = tissue(material) else {
                continue;
            };
            let window = shape.card_windows().get(i).copied();
            let window = window.unwrap_or(TextureWindow::WHOLE);
            let mask = material.mask.as_deref();
            let opaque = *shares
                .entry((card.material, bits(&window)))
                .or_insert_with(|| mask.map_or(1.0, |mask| share_of_window(mask, &window)));
            parts.push(Part {
                corner_m: card.corner,
                edges_m: [card.edge_u, card.edge_v],
                is_card: true,
                share: opaque * drawn(tissue),
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
            let uvs = triangle.corners.map(|corner| mesh.uv(corner));
            let share = match (&material.mask, tissue) {
                (Some(mask), _) => share_of_triangle(mask, uvs) * drawn(tissue),
                (None, Tissue::Leaf) => 1.0,
                // It closes around its inside.
                (None, Tissue::Wood) => 0.5,
            };
            parts.push(Part {
                corner_m: a,
                edges_m: [b - a, c - a],
                is_card: false,
                share: 0.5 * share,
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
    /// If `layer_m` is not 0.1 to 100 m.
    pub fn new(layer_m: f64, grid: &MapGrid) -> Result<Self, ParamError> {
        ParamError::check_within("layer_m", layer_m, 0.1, 100.0)?;
        Ok(Self {
            layer_m,
            ground_m2: grid.area_m2(),
            leaf_m2: Vec::new(),
            wood_m2: Vec::new(),
        })
    }

    /// Adds an instance. The area of each of its parts is spread evenly over the heights that it
    /// spans above the ground at its middle; what is below counts nowhere, and neither does a part
    /// whose middle is outside of the map.
    ///
    /// `origin_m` is the world position of the origin that the instance's place is relative to,
    /// `ground_m` the height of the ground at a place of the world, and `leaf_per_silhouette` is
    /// the leaf area that a drawn leaf or shoot stands for, in its silhouette: 1 for single flat
    /// leaves, and more where those of a shoot hide each other, as needles do.
    pub fn add(
        &mut self,
        (shape, instance): (&ShapeAreas, &Instance),
        origin_m: DVec3,
        (grid, ground_m): (&MapGrid, &dyn Fn(DVec2) -> f64),
        leaf_per_silhouette: f64,
    ) {
        for part in &shape.parts {
            let [u, v] = part.edges_m.map(|edge| instance.linear * edge);
            let corner = instance.linear * part.corner_m + instance.position_m;
            let middle = corner + (u + v) * if part.is_card { 0.5 } else { 1.0 / 3.0 };
            let place_m = (origin_m + middle.as_dvec3()).truncate();
            if grid.cell_at(place_m).is_none() {
                continue;
            }
            // Heights of its corners above the first one's.
            let corners_m = [0.0, u.z, v.z, if part.is_card { u.z + v.z } else { 0.0 }];
            let low_m = corners_m.into_iter().fold(0.0, f32::min);
            let high_m = corners_m.into_iter().fold(0.0, f32::max);
            let above_m = origin_m.z + f64::from(corner.z) - ground_m(place_m);
            let (sums, factor) = match part.tissue {
                Tissue::Leaf => (&mut self.leaf_m2, leaf_per_silhouette),
                Tissue::Wood => (&mut self.wood_m2, 1.0),
            };
            let area_m2 = factor * part.share * f64::from(u.cross(v).length());
            let span_m = [low_m, high_m].map(|m| above_m + f64::from(m));
            spread(sums, self.layer_m, span_m, area_m2);
        }
    }

    /// Adds another profile of the same map and layers.
    ///
    /// # Panics
    /// If map or layers are others.
    pub fn join(&mut self, other: &Self) {
        assert_eq!(
            (self.layer_m, self.ground_m2),
            (other.layer_m, other.ground_m2),
            "profiles of one map"
        );
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

    /// Leaf area and half of the wood's surface in a layer, m² per m³.
    #[must_use]
    pub fn densities_m2_m3(&self, layer: usize) -> [f64; 2] {
        let volume_m3 = self.ground_m2 * self.layer_m;
        [&self.leaf_m2, &self.wood_m2]
            .map(|areas| areas.get(layer).copied().unwrap_or(0.0) / volume_m3)
    }

    /// Leaf area of all that grows, low plants included, over the area of the map.
    #[must_use]
    pub fn leaf_area_index(&self) -> f64 {
        self.leaf_m2.iter().sum::<f64>() / self.ground_m2
    }
}

/// Adds an area to layers, spread evenly between two heights.
fn spread(sums: &mut Vec<f64>, layer_m: f64, [low_m, high_m]: [f64; 2], area_m2: f64) {
    if high_m < 0.0 {
        return;
    }
    let [first, last] = [low_m.max(0.0), high_m].map(|m| (m / layer_m) as usize);
    if sums.len() <= last {
        sums.resize(last + 1, 0.0);
    }
    let span_m = high_m - low_m;
    if first == last && low_m >= 0.0 {
        sums[first] += area_m2;
        return;
    }
    for (layer, sum) in sums.iter_mut().enumerate().take(last + 1).skip(first) {
        let [from_m, to_m] = [layer, layer + 1].map(|n| n as f64 * layer_m);
        let inside_m = high_m.min(to_m) - low_m.max(from_m);
        *sum += area_m2 * inside_m / span_m;
    }
}

/// What is counted of an opaque area. Twigs are drawn as silhouettes: half of the surface of
/// something round is π/2 times as large.
const fn drawn(tissue: Tissue) -> f64 {
    match tissue {
        Tissue::Leaf => 1.0,
        Tissue::Wood => FRAC_PI_2,
    }
}

/// Whether a surface is that of leaves or of wood that stands. Moss on bark is neither.
fn tissue(material: &Material) -> Option<Tissue> {
    use Semantic as S;
    match material.semantic {
        S::Leaf | S::Needle => Some(Tissue::Leaf),
        // Whole plants have one semantic: light passes through their leaves alone.
        S::Shrub | S::Bramble | S::Grass | S::Herb | S::Fern | S::Seedling | S::Climber => {
            let is_leaf = material.transmittance.max_element() > 0.0;
            Some(if is_leaf { Tissue::Leaf } else { Tissue::Wood })
        }
        S::Stem | S::Limb | S::RootFlare | S::Snag | S::Branch | S::Twig => Some(Tissue::Wood),
        _ => None,
    }
}

/// The bits of a window, by which it is known.
fn bits(window: &TextureWindow) -> [u32; 6] {
    let [a, b, c] = [window.origin, window.along_u, window.along_v];
    [a.x, a.y, b.x, b.y, c.x, c.y].map(f32::to_bits)
}

/// The opaque share of a card.
fn share_of_window(mask: &AlphaMask, window: &TextureWindow) -> f64 {
    const SIDE: usize = 256;
    if *window == TextureWindow::WHOLE {
        return mask.opaque_fraction();
    }
    let at = |i: usize| (i as f64 + 0.5) / SIDE as f64;
    let opaque = (0..SIDE * SIDE).filter(|i| {
        let uv = window.uv(at(i % SIDE), at(i / SIDE));
        mask.is_opaque(uv.x, uv.y)
    });
    opaque.count() as f64 / (SIDE * SIDE) as f64
}

/// The opaque share of a triangle, by the middles of 64 equal parts.
fn share_of_triangle(mask: &AlphaMask, uvs: [Vec2; 3]) -> f64 {
    const SIDE: usize = 8;
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
    f64::from(opaque) / (SIDE * SIDE) as f64
}
