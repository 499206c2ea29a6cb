//! The pass, and the scene that it is drawn of. The workspace's tests compare its map with rays.

use std::error::Error;
use std::sync::Arc;

use nemoral_render::{
    Gpu, GpuCamera, GpuImages, GpuParams, Lighting, OpenSky, Pass, SceneView, View,
};
use nemoral_scene::glam::{DVec3, Mat3, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Card, ChunkCoord, Hit, Instance, InstanceGroup, InstancedScene, Intrinsics,
    Material, MaterialId, MaterialLibrary, Mesh, ObjectId, PlacedGroup, Prototype, Ray, RayCaster,
    RigidTransform, Semantic, Triangle,
};

pub(crate) const SPECIES: [&str; 3] = ["beech", "oak", "pine"];

/// Writes 1, 2, 3 … for the species that a material's name begins with.
#[derive(Debug)]
struct SpeciesMap;

impl Pass for SpeciesMap {
    fn name(&self) -> &'static str {
        "species map"
    }

    fn wgsl(&self) -> &'static str {
        "fn paint(s: Surface) -> vec4u { return vec4u(table[s.material], 0u, 0u, 0u); }"
    }

    fn table(&self, materials: &MaterialLibrary) -> Vec<u32> {
        let number = |m: &Material| {
            let species = SPECIES.iter().position(|s| m.name.starts_with(s));
            species.map_or(0, |i| i as u32 + 1)
        };
        materials.materials().iter().map(number).collect()
    }
}

/// Trees in a row. They are only drawn here, so no rays can be cast at them.
pub(crate) struct Avenue {
    pub(crate) materials: MaterialLibrary,
    pub(crate) trees: Arc<Trees>,
}

pub(crate) struct Trees(pub(crate) Vec<Instance>);

impl InstanceGroup for Trees {
    fn instances(&self) -> Box<dyn ExactSizeIterator<Item = &Instance> + '_> {
        Box::new(self.0.iter())
    }
}

impl RayCaster for Avenue {
    fn closest_hit(&self, _: &Ray) -> Option<Hit> {
        None
    }
}

impl InstancedScene for Avenue {
    fn placed_groups(&self) -> Vec<PlacedGroup> {
        vec![(
            Vec3::ZERO,
            Arc::clone(&self.trees) as Arc<dyn InstanceGroup>,
        )]
    }
}

impl Avenue {
    pub(crate) fn new() -> Result<Self, Box<dyn Error>> {
        let mut materials = MaterialLibrary::new();
        let mut shapes = Vec::new();
        for (i, species) in SPECIES.iter().enumerate() {
            let bark = materials.add(Material::plain(
                &format!("{species}.bark"),
                Semantic::Stem,
                Vec3::splat(0.1),
            ));
            let round = |c: usize, r: usize| {
                (c as f32 - 15.5).hypot(r as f32 - 15.5) < 15.0 - 3.0 * i as f32
            };
            let leaf = materials.add(Material {
                mask: Some(Arc::new(AlphaMask::from_fn(32, 32, round)?)),
                ..Material::plain(
                    &format!("{species}.leaf"),
                    Semantic::Leaf,
                    Vec3::new(0.05, 0.1, 0.02),
                )
            });
            let (mesh, cards) = tree(bark, leaf, 4.0 + 2.0 * i as f32);
            shapes.push(Arc::new(Prototype::new(*species, mesh, cards, &materials)?));
        }
        let instances = (0..24_u16).map(|k| Instance {
            prototype: Arc::clone(&shapes[usize::from(k) % 3]),
            position_m: Vec3::new(
                6.0 + 3.0 * f32::from(k / 2),
                if k % 2 == 0 { 4.0 } else { -4.0 },
                0.0,
            ),
            linear: Mat3::from_rotation_z(f32::from(k)),
            object: ObjectId::new(ChunkCoord::new(0, 0), k + 1).unwrap_or(ObjectId::NONE),
            variation: 0.5,
        });
        let trees = Arc::new(Trees(instances.collect()));
        Ok(Self { materials, trees })
    }

    /// A view along the avenue, from its beginning.
    pub(crate) fn view(width: u32, height: u32) -> Result<View, Box<dyn Error>> {
        let body = RigidTransform::from_xyz_rpy(DVec3::new(0.0, 0.5, 1.6), 0.0, -0.1, 0.0);
        let pose = body * RigidTransform::body_from_optical();
        Ok(View::new(Intrinsics::from_fov(width, height, 1.3)?, pose))
    }

    /// The truth, and the species map as the first of the passes.
    pub(crate) fn draw(&self, gpu: &Gpu, view: &View) -> Result<GpuImages, Box<dyn Error>> {
        let camera = GpuCamera::new(gpu, GpuParams::default(), Lighting::uniform(Vec3::ONE))?;
        camera.add_pass(Box::new(SpeciesMap))?;
        let scene = SceneView {
            caster: self,
            instances: Some(self),
            materials: &self.materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        };
        Ok(camera.draw(&scene, view)?)
    }
}

/// A square stem with a ball of leaves.
fn tree(bark: MaterialId, leaf: MaterialId, height: f32) -> (Mesh, Vec<Card>) {
    let mut mesh = Mesh::default();
    for k in 0..4 {
        let at = |k: i32, z: f32| {
            let (sin, cos) = (k as f32 * std::f32::consts::FRAC_PI_2).sin_cos();
            Vec3::new(0.2 * cos, 0.2 * sin, z)
        };
        let first = mesh.positions.len() as u32;
        for p in [at(k, 0.0), at(k + 1, 0.0), at(k + 1, height), at(k, height)] {
            mesh.positions.push(p);
            mesh.normals.push(Vec3::new(p.x, p.y, 0.0) * 5.0);
            mesh.uvs.push(Vec2::ZERO);
        }
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let corners = corners.map(|c: u32| first + c);
            let material = bark;
            mesh.triangles.push(Triangle { corners, material });
        }
    }
    let cards = (0..400).map(|k| {
        // A Fibonacci ball.
        let z = 1.0 - (k as f32 + 0.5) / 200.0;
        let (sin, cos) = (k as f32 * 2.399_963).sin_cos();
        let out = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
        let (edge_u, edge_v) = out.any_orthonormal_pair();
        Card {
            corner: Vec3::Z * height + out * (0.3 * height),
            edge_u: edge_u * 0.4,
            edge_v: edge_v * 0.4,
            material: leaf,
        }
    });
    (mesh, cards.collect())
}
