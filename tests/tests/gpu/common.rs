//! Random forests, and the two renderers that look at them.

use std::sync::Arc;

use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_render::{
    CameraRenderer, Gpu, GpuCamera, GpuParams, Lighting, OpenSky, RayCastCamera, RayCastParams,
    SceneView, View,
};
use nemoral_scene::glam::{DVec3, Mat3, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Blend, Card, ChunkCoord, InstancePlace, Intrinsics, Material, MaterialId,
    MaterialLibrary, Mesh, ObjectId, Prototype, RigidTransform, Semantic, Triangle, TruthImages,
};
use nemoral_seed::{Domain, Draw, Key, PhiloxRng, Rng};

/// Least number of pixels of a class whose own share is tested.
pub(super) const LEAST: usize = 300;

pub(super) fn camera(gpu: &Gpu, params: GpuParams) -> GpuCamera {
    GpuCamera::new(gpu, params, Lighting::uniform(Vec3::ONE)).unwrap_or_else(|e| panic!("{e}"))
}

pub(super) fn cast(scene: &SceneView<'_>, view: &View) -> TruthImages {
    let camera = RayCastCamera::new(RayCastParams::draft(), Lighting::uniform(Vec3::ONE));
    let images = camera.expect("allowed").render(scene, view, Key::world(1));
    images.expect("a picture").truth
}

/// A random forest in two chunks: sloping planes of ground, masked cards and triangles, rotated,
/// sheared and mirrored.
pub(super) struct RandomForest {
    pub(super) materials: MaterialLibrary,
    pub(super) forest: RayScene,
}

/// A random mask of blobs of some texels, with borders everywhere.
pub(super) fn mask(rng: &mut PhiloxRng, width: usize, height: usize) -> AlphaMask {
    let salt = rng.next_u32();
    let blob = |c: usize, r: usize| {
        let h = (c as u32 / 3).wrapping_mul(0x9E37_79B1) ^ (r as u32 / 4).wrapping_mul(salt | 1);
        (h ^ h >> 15).wrapping_mul(0x85EB_CA6B) >> 31 == 0
    };
    AlphaMask::from_fn(width, height, blob).expect("allowed")
}

impl RandomForest {
    pub(super) fn new(seed: u64, change: impl Fn(AlphaMask) -> AlphaMask) -> Self {
        let mut rng = Key::world(seed).domain(Domain::new("test.wood")).rng();
        let rng = &mut rng;
        let mut materials = MaterialLibrary::new();
        let mut floor = |name, albedo| {
            materials.add(Material {
                ground: true,
                ..Material::plain(name, Semantic::Soil, albedo)
            })
        };
        let soil = floor("soil", Vec3::splat(0.2));
        let moss = floor("moss", Vec3::new(0.02, 0.1, 0.02));
        let litter = floor("litter", Vec3::new(0.4, 0.2, 0.1));
        let bark = materials.add(Material::plain("bark", Semantic::Stem, Vec3::splat(0.1)));
        let leaf = |rng: &mut PhiloxRng, semantic, width, height| Material {
            mask: Some(Arc::new(change(mask(rng, width, height)))),
            ..Material::plain("leaf", semantic, Vec3::splat(0.3))
        };
        let leaves = [
            materials.add(leaf(rng, Semantic::Leaf, 37, 64)),
            materials.add(leaf(rng, Semantic::Grass, 64, 31)),
        ];
        let shapes: Vec<Arc<Blas>> = (0..6)
            .map(|_| plant(rng, bark, leaves, &materials))
            .collect();
        let ground = ground(rng, [soil, moss, litter], &materials);
        let group = |chunk: i32, rng: &mut PhiloxRng| {
            let mut instances = vec![placed(&ground, Vec3::ZERO, Mat3::IDENTITY, ObjectId::NONE)];
            for item in 1..=30_u16 {
                let at = Vec3::new(50.0 * unit(rng), 50.0 * unit(rng), 2.0 * unit(rng));
                let turn = Mat3::from_rotation_z(6.3 * unit(rng));
                let shear = Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::new(0.2, -0.1, 1.1));
                let mirror = Mat3::from_diagonal(Vec3::new(-0.9, 1.2, 1.0));
                let linear = if item % 3 == 0 {
                    turn * mirror
                } else {
                    shear * turn
                };
                let shape = &shapes[rng.next_u32() as usize % shapes.len()];
                let object = ObjectId::new(ChunkCoord::new(chunk, 3), item);
                instances.push(placed(shape, at, linear, object.expect("in range")));
            }
            Arc::new(Group::build(instances))
        };
        let groups = vec![
            (Vec3::new(-50.0, -25.0, 0.0), group(-1, rng)),
            (Vec3::new(0.0, -25.0, 0.0), group(0, rng)),
        ];
        Self {
            materials,
            forest: RayScene::new(groups),
        }
    }

    pub(super) fn scene(&self) -> SceneView<'_> {
        SceneView {
            caster: &self.forest,
            instances: Some(&self.forest),
            materials: &self.materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        }
    }
}

pub(super) fn unit(rng: &mut PhiloxRng) -> f32 {
    rng.unit_f64() as f32
}

pub(super) fn placed(
    shape: &Arc<Blas>,
    position_m: Vec3,
    linear: Mat3,
    object: ObjectId,
) -> (InstancePlace, Arc<Blas>) {
    let instance = InstancePlace {
        position_m,
        linear,
        object,
        variation: 0.5,
    };
    (instance, Arc::clone(shape))
}

pub(super) fn shape(mesh: Mesh, cards: Vec<Card>, materials: &MaterialLibrary) -> Arc<Blas> {
    let shape = Prototype::new("shape", mesh, cards, materials).expect("a sound shape");
    Arc::new(Blas::build(Arc::new(shape), materials))
}

/// A six-sided trunk of triangles with cards around its top and masked triangles at its foot.
pub(super) fn plant(
    rng: &mut PhiloxRng,
    bark: MaterialId,
    leaves: [MaterialId; 2],
    materials: &MaterialLibrary,
) -> Arc<Blas> {
    let mut mesh = Mesh::default();
    let mut add = |p: Vec3, uv: Vec2| {
        mesh.positions.push(p);
        mesh.normals.push(p.with_z(0.1).normalize_or(Vec3::Z));
        mesh.uvs.push(uv);
        mesh.positions.len() as u32 - 1
    };
    let (height, radius) = (2.0 + 4.0 * unit(rng), 0.1 + 0.3 * unit(rng));
    let mut triangles = Vec::new();
    for k in 0..6 {
        let at = |k: i32, z: f32| {
            let angle = k as f32 * std::f32::consts::FRAC_PI_3;
            Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
        };
        let q = [at(k, 0.0), at(k + 1, 0.0), at(k + 1, height), at(k, height)]
            .map(|p| add(p, Vec2::new(p.x, p.z)));
        for corners in [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] {
            let material = bark;
            triangles.push(Triangle { corners, material });
        }
    }
    for _ in 0..12 {
        let mut corner = || Vec3::new(unit(rng) * 2.0 - 1.0, unit(rng) * 2.0 - 1.0, unit(rng));
        let corners = [
            add(corner(), Vec2::ZERO),
            add(corner(), Vec2::X),
            add(corner(), Vec2::ONE),
        ];
        let material = leaves[1];
        triangles.push(Triangle { corners, material });
    }
    mesh.triangles = triangles;
    let cards = (0..60)
        .map(|_| {
            let mut any = |size: f32| {
                Vec3::from_array(std::array::from_fn(|_| size * (2.0 * unit(rng) - 1.0)))
            };
            Card {
                corner: any(1.5) + Vec3::Z * height,
                edge_u: any(0.6),
                edge_v: any(0.6),
                material: leaves[0],
            }
        })
        .collect();
    shape(mesh, cards, materials)
}

/// A chunk of bumpy ground, of the class of soil in the south and of moss in the north, with
/// patches of soil, moss and litter.
pub(super) fn ground(
    rng: &mut PhiloxRng,
    [soil, moss, litter]: [MaterialId; 3],
    materials: &MaterialLibrary,
) -> Arc<Blas> {
    const SIDE: u32 = 25;
    let mut mesh = Mesh::default();
    for i in 0..=SIDE {
        for j in 0..=SIDE {
            // The borders are level, so that chunks fit together.
            let inner = (1..SIDE).contains(&i) && (1..SIDE).contains(&j);
            let z = if inner { unit(rng) } else { 0.5 };
            mesh.positions
                .push(Vec3::new(2.0 * i as f32, 2.0 * j as f32, z));
            mesh.normals.push(Vec3::Z);
            mesh.uvs.push(Vec2::new(2.0 * i as f32, 2.0 * j as f32));
        }
    }
    for i in 0..SIDE {
        for j in 0..SIDE {
            let k = i * (SIDE + 1) + j;
            for corners in [[k, k + SIDE + 1, k + SIDE + 2], [k, k + SIDE + 2, k + 1]] {
                let material = if j <= SIDE / 2 { soil } else { moss };
                // Three grounds, of which two meet in many triangles, and all in some.
                let of_corner = |corner: u32| {
                    let (column, row) = (corner / (SIDE + 1), corner % (SIDE + 1));
                    let halves = |n: u32| if n % 5 < 2 { soil } else { moss };
                    if (column + 2 * row) % 7 == 3 {
                        [litter; 2]
                    } else {
                        [halves(row), halves(row + column / 3)]
                    }
                };
                mesh.triangles.push(Triangle { corners, material });
                mesh.blends.push(Blend {
                    corners: corners.map(of_corner),
                });
            }
        }
    }
    shape(mesh, Vec::new(), materials)
}

/// A view from the edge of the forest into it.
pub(super) fn view(width: u32, height: u32) -> View {
    let k = Intrinsics::from_fov(width, height, 1.3).expect("valid");
    let body = RigidTransform::from_xyz_rpy(DVec3::new(-45.3, 1.7, 2.9), 0.02, 0.03, 0.05);
    View::new(k, body * RigidTransform::body_from_optical())
}
