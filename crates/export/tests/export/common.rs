//! A scene with everything that formats find difficult, and its triangles as rays meet them.

use std::collections::BTreeMap;
use std::sync::Arc;

use nemoral_export::{ExportCamera, ExportScene};
use nemoral_scene::glam::{DVec3, Mat3, Quat, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Card, ChunkCoord, Instance, InstancePlace, Intrinsics, Material, MaterialLibrary,
    Mesh, ObjectId, ObjectKind, ObjectRecord, Ontology, Prototype, RigidTransform, Semantic,
    Texture, TextureWindow, TreeRecord, Triangle,
};

/// A triangle with the object and the fine semantic that it has.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Labelled {
    pub(crate) corners: [DVec3; 3],
    pub(crate) object: u64,
    pub(crate) semantic: String,
}

pub(crate) fn id(item: u16) -> ObjectId {
    ObjectId::new(ChunkCoord::new(-3, 2_000), item).expect("in range")
}

/// Ground, two plain trees and a mirrored one, a sheared patch without an id, a rock that is
/// stretched, cameras.
pub(crate) fn scene() -> ExportScene {
    let mut materials = MaterialLibrary::new();
    let bark = Texture::from_linear(2, 2, &[Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE]);
    let bark = materials.add(Material {
        albedo: Arc::new(bark.expect("sides")),
        ..Material::plain("pine.stem", Semantic::Stem, Vec3::splat(0.2))
    });
    let mask = AlphaMask::from_fn(4, 4, |column, row| column <= row).expect("sides");
    let leaf = materials.add(Material {
        mask: Some(Arc::new(mask)),
        transmittance: Vec3::splat(0.1),
        ..Material::plain("pine.foliage", Semantic::Needle, Vec3::new(0.1, 0.2, 0.05))
    });
    let soil = materials.add(Material {
        ground: true,
        tile_m: 2.0,
        ..Material::plain("soil", Semantic::Soil, Vec3::splat(0.1))
    });
    let stone = Material::plain("stone", Semantic::Rock, Vec3::splat(0.4));
    let stone = materials.add(stone);
    let tree = {
        let mesh = tetrahedron(bark, Vec3::new(0.3, 0.3, 12.0));
        let card = Card {
            corner: Vec3::new(-1.0, -0.5, 9.0),
            edge_u: Vec3::new(2.0, 0.3, 0.1),
            edge_v: Vec3::new(-0.2, 1.1, 0.6),
            material: leaf,
        };
        let cards = vec![
            card,
            Card {
                edge_u: -card.edge_u,
                ..card
            },
        ];
        let shape = Prototype::new("pine.0", mesh, cards, &materials).expect("sound");
        let half = TextureWindow::rectangle(Vec2::ZERO, Vec2::new(0.5, 1.0));
        let windows = vec![TextureWindow::WHOLE, half];
        Arc::new(shape.with_card_windows(windows).expect("two"))
    };
    let shape = |name: &str, material| {
        let mesh = tetrahedron(material, Vec3::new(1.0, 0.7, 0.4));
        Arc::new(Prototype::new(name, mesh, Vec::new(), &materials).expect("sound"))
    };
    let (ground, rock, patch) = (
        shape("ground", soil),
        shape("rock.2", stone),
        shape("patch", leaf),
    );
    let turned = |yaw: f32, scale: Vec3, at: Vec3| {
        InstancePlace::new(Quat::from_rotation_z(yaw), scale, at).expect("can be inverted")
    };
    let sheared = |at: Vec3| InstancePlace {
        linear: Instance::upright(1.2, 0.9, Vec2::new(0.3, -0.2)),
        ..InstancePlace::at(at)
    };
    let tilted = Mat3::from_axis_angle(Vec3::X, 0.4);
    let stretched = InstancePlace {
        linear: Mat3::from_diagonal(Vec3::new(1.0, 2.0, 0.5)) * tilted,
        ..InstancePlace::at(Vec3::new(-8.0, 3.0, 1.0))
    };
    let places = [
        (&ground, InstancePlace::at(Vec3::new(0.0, 0.0, 5.0))),
        (
            &tree,
            turned(0.3, Vec3::ONE, Vec3::new(3.0, 4.0, 5.0)).with_object(id(1)),
        ),
        (&rock, stretched.with_object(id(3))),
        (
            &tree,
            turned(-2.0, Vec3::splat(1.1), Vec3::new(200.0, -150.0, 6.0)).with_object(id(2)),
        ),
        (&patch, sheared(Vec3::new(1.0, 1.0, 5.2))),
        (
            &patch,
            sheared(Vec3::new(2.0, 1.0, 5.1)).with_variation(0.25),
        ),
        (
            &tree,
            turned(0.0, Vec3::new(-1.0, 1.0, 0.9), Vec3::new(7.0, 0.0, 5.0)).with_object(id(4)),
        ),
    ];
    let instances = places.map(|(shape, place)| Instance::new(Arc::clone(shape), place));
    let record = |item: u16, kind, species: &str| ObjectRecord {
        object: id(item),
        kind,
        species: species.to_owned(),
        position_m: DVec3::new(f64::from(item), 0.0, 5.0),
        radius_m: 0.3,
        height_m: 12.0,
    };
    let tree_record = |item: u16| TreeRecord {
        object: id(item),
        species: "maritime_pine".to_owned(),
        position_m: DVec3::new(f64::from(item), 0.0, 5.0),
        dbh_m: 0.25,
        height_m: 12.0,
        crown_base_m: 7.0,
        crown_radius_m: 2.0,
        leaf_area_m2: 30.0,
        stem_volume_m3: 0.3,
        wood_volume_m3: None,
        merchantable_volume_m3: None,
        lean_rad: 0.0,
        age_class: "middle".to_owned(),
        alive: true,
        field_id: String::new(),
    };
    ExportScene {
        name: "a scene & <more>".to_owned(),
        origin_m: DVec3::new(-150.0, 100_000.0, 0.0),
        seed: 11,
        materials,
        ontology: Ontology::paper(),
        instances: instances.to_vec(),
        objects: vec![
            record(1, ObjectKind::Tree, "maritime_pine"),
            record(2, ObjectKind::Tree, "maritime_pine"),
            record(3, ObjectKind::Rock, "rock"),
            record(4, ObjectKind::Tree, "maritime_pine"),
        ],
        trees: vec![tree_record(1), tree_record(2), tree_record(4)],
        cameras: vec![ExportCamera {
            name: "camera".to_owned(),
            intrinsics: Intrinsics::from_fov(640, 360, 1.2).expect("sound"),
            scene_from_camera: RigidTransform::from_xyz_rpy(DVec3::Z * 6.0, 0.0, 0.1, 0.5)
                * RigidTransform::body_from_optical(),
        }],
    }
}

/// One shape of one card, whose material has neither mask nor transmittance; both names are long.
pub(crate) fn long_named_card() -> ExportScene {
    let name = "n".repeat(260);
    let mut materials = MaterialLibrary::new();
    let material = materials.add(Material::plain(&name, Semantic::Leaf, Vec3::splat(0.2)));
    let card = Card {
        corner: Vec3::ZERO,
        edge_u: Vec3::X,
        edge_v: Vec3::Y,
        material,
    };
    let shape = Prototype::new(&name, Mesh::default(), vec![card], &materials).expect("sound");
    let place = InstancePlace::at(Vec3::Z).with_object(id(1));
    ExportScene {
        instances: vec![Instance::new(Arc::new(shape), place)],
        materials,
        ..scene()
    }
}

fn tetrahedron(material: nemoral_scene::MaterialId, size: Vec3) -> Mesh {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * size);
    Mesh {
        normals: positions
            .map(|p| (p - size * 0.25).normalize_or(Vec3::Z))
            .to_vec(),
        uvs: positions.map(|p| p.truncate()).to_vec(),
        positions: positions.to_vec(),
        triangles: [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
            .map(|corners| Triangle { corners, material })
            .to_vec(),
        blends: Vec::new(),
    }
}

/// All triangles of a scene, in its axes.
pub(crate) fn truth(scene: &ExportScene) -> Vec<Labelled> {
    let mut all = Vec::new();
    for instance in &scene.instances {
        let shape = &instance.prototype;
        let linear = instance.linear.as_dmat3();
        let place = |p: Vec3| linear * p.as_dvec3() + instance.position_m.as_dvec3();
        let mut add = |corners: [Vec3; 3], material| {
            all.push(Labelled {
                corners: corners.map(place),
                object: instance.object.to_u64(),
                semantic: scene.materials.get(material).semantic.name().to_owned(),
            });
        };
        for t in &shape.mesh().triangles {
            add(
                t.corners.map(|c| shape.mesh().positions[c as usize]),
                t.material,
            );
        }
        for card in shape.cards() {
            let [a, b, c, d] = card.corners();
            add([a, b, c], card.material);
            add([a, c, d], card.material);
        }
    }
    all
}

/// Expects two sets of triangles to be one, but for 0.1 mm and the order.
#[track_caller]
pub(crate) fn expect_equal(found: &[Labelled], expected: &[Labelled]) {
    let count = |all: &[Labelled]| {
        let mut counts = BTreeMap::new();
        for t in all {
            *counts.entry((t.object, t.semantic.clone())).or_insert(0) += 1;
        }
        counts
    };
    assert_eq!(count(found), count(expected));
    for t in expected {
        let is_it = |f: &&Labelled| {
            f.object == t.object
                && f.semantic == t.semantic
                && (0..3).all(|i| f.corners[i].distance(t.corners[i]) < 1e-4)
        };
        assert!(found.iter().any(|f| is_it(&f)), "{t:?} is missing");
    }
}
