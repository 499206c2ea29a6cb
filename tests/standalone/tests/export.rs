//! Use of `nemoral-export` alone: another program's scene becomes files of other programs.

use std::sync::Arc;

use nemoral_export::{ExportScene, GltfParams, UsdParams, write_glb, write_sdf, write_usd};
use nemoral_scene::glam::{DVec3, Vec2, Vec3};
use nemoral_scene::{
    Card, Instance, InstancePlace, Material, MaterialLibrary, Mesh, Ontology, Prototype, Semantic,
};

#[test]
fn a_scene_of_my_own_is_written() -> Result<(), Box<dyn std::error::Error>> {
    let mut materials = MaterialLibrary::new();
    let leaf = Material::plain("fern", Semantic::Fern, Vec3::new(0.1, 0.2, 0.05));
    let card = Card {
        corner: Vec3::ZERO,
        edge_u: Vec3::X,
        edge_v: Vec3::new(0.0, 0.3, 0.6),
        material: materials.add(leaf),
    };
    let fern = Prototype::new("fern", Mesh::default(), vec![card], &materials)?;
    let fern = Arc::new(fern);
    let places = [
        InstancePlace::at(Vec3::X),
        InstancePlace {
            linear: Instance::upright(0.5, 1.0, Vec2::new(0.3, 0.0)),
            ..InstancePlace::at(Vec3::Y)
        },
    ];
    let scene = ExportScene {
        name: "ferns".to_owned(),
        origin_m: DVec3::ZERO,
        seed: 0,
        materials,
        ontology: Ontology::paper(),
        instances: places
            .map(|place| Instance::new(Arc::clone(&fern), place))
            .to_vec(),
        objects: Vec::new(),
        trees: Vec::new(),
        cameras: Vec::new(),
    };
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    write_glb(&scene, &path("ferns.glb"), GltfParams::default())?;
    write_usd(&scene, &path("usd"), UsdParams::default())?;
    write_sdf(&scene, &path("sdf"))?;
    for file in ["ferns.glb", "usd/forest.usda", "sdf/world.sdf"] {
        assert!(path(file).is_file(), "{file}");
    }
    Ok(())
}
