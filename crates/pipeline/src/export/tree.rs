//! One tree, for people who only want trees.

use std::path::Path;

use nemoral_assets::{SingleTree, Species, WoodVolume};
use nemoral_export::ExportScene;
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    ChunkCoord, Instance, InstancePlace, ObjectId, ObjectKind, ObjectRecord, Ontology, TreeRecord,
};
use nemoral_seed::Key;

use crate::Error;
use crate::pool::in_pool;

/// The largest file of a species, bytes.
const MOST_BYTES: u64 = 1 << 20;

/// Grows one tree: a built-in species or a file of one, its diameter at breast height in metres
/// (the species' typical mature one if not given), living or dead. It stands at the origin.
///
/// # Errors
/// If the species is not known, its file is invalid, or the diameter is out of its range.
pub fn tree_scene(
    species: &str,
    dbh_m: Option<f64>,
    alive: bool,
    seed: u64,
) -> Result<ExportScene, Error> {
    let species = find(species)?;
    let mature_m = species.class_dbh_m(nemoral_assets::SizeClass::Mature);
    let dbh_m = dbh_m.unwrap_or(mature_m);
    let grown = in_pool(|| SingleTree::grow(&species, dbh_m, alive, Key::world(seed)));
    let SingleTree { tree, materials } =
        grown.map_err(|e| Error::request(format!("{}: {e}", species.name)))?;
    let object = ObjectId::new(ChunkCoord::new(0, 0), 1).expect("in range");
    let place = InstancePlace::at(Vec3::ZERO).with_object(object);
    let record = ObjectRecord {
        object,
        kind: ObjectKind::Tree,
        species: tree.species.clone(),
        position_m: DVec3::ZERO,
        radius_m: tree.radius_m,
        height_m: tree.size.height_m,
    };
    let size = &tree.size;
    let measured = TreeRecord {
        object,
        species: tree.species.clone(),
        position_m: DVec3::ZERO,
        dbh_m: size.dbh_m,
        height_m: size.height_m,
        crown_base_m: size.crown_base_m,
        crown_radius_m: size.crown_radius_m,
        leaf_area_m2: size.leaf_area_m2,
        stem_volume_m3: tree.stem_volume_m3,
        wood_volume_m3: tree.wood.as_ref().map(WoodVolume::total_m3),
        merchantable_volume_m3: (tree.wood.as_ref())
            .map(|wood| wood.volume_above_diameter_m3(WoodVolume::MERCHANTABLE_M)),
        lean_rad: size.lean_rad,
        age_class: tree.class.name().to_owned(),
        alive: tree.alive,
        field_id: String::new(),
    };
    Ok(ExportScene {
        name: tree.species,
        origin_m: DVec3::ZERO,
        seed,
        materials,
        ontology: Ontology::paper(),
        instances: vec![Instance::new(tree.prototype, place)],
        objects: vec![record],
        trees: vec![measured],
        cameras: Vec::new(),
    })
}

/// A built-in species, or that of a file whose name ends in `.toml`.
fn find(species: &str) -> Result<Species, Error> {
    let path = Path::new(species);
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    {
        let text = nemoral_files::read_text(path, MOST_BYTES)?;
        return Species::from_toml(&text, species).map_err(|e| Error::request(e.to_string()));
    }
    Species::built_in(species).ok_or_else(|| {
        let names: Vec<_> = Species::names().collect();
        Error::request(format!(
            "species = \"{species}\": must be one of {}, or the name of a species' file, which \
             ends in .toml",
            names.join(", ")
        ))
    })
}
