//! What glTF has no words for: ids, semantics, the inventory.

use nemoral_scene::{Material, ObjectId, Ontology};
use serde_json::{Value, json};

use crate::scene::{ExportScene, Inventory};

/// What a surface is.
pub(super) fn about_material(material: &Material, ontology: &Ontology) -> Value {
    let class = ontology.class(material.semantic);
    let band = |band: nemoral_scene::LaserBand| json!([band.reflectance, band.transmittance]);
    let mut extras = json!({
        "semantic": material.semantic.name(),
        "semantic_id": material.semantic as u8,
        "class": class.name,
        "class_id": class.id,
        "transmittance": material.transmittance.to_array(),
        "laser_905_nm": band(material.optics.nm905),
        "laser_1550_nm": band(material.optics.nm1550),
    });
    if let Some(support) = material.support {
        extras["support"] = json!(support.name());
    }
    extras
}

/// Which object a node is; `None` if it is none. The id has 64 bits, more than JSON's readers keep
/// of a number, and is text.
pub(super) fn about_object(object: ObjectId, variation: f32, inventory: &Inventory<'_>) -> Value {
    let mut extras = json!({ "variation": variation });
    if object.is_none() {
        return extras;
    }
    extras["object"] = json!(object.to_u64().to_string());
    extras["image_id"] = json!(object.to_image_id());
    if let Some(record) = inventory.object(object) {
        extras["kind"] = json!(record.kind.name());
        extras["species"] = json!(record.species);
    }
    extras
}

/// What the scene is: where, of which world, its classes and its objects.
pub(super) fn about_scene(scene: &ExportScene, inventory: &Inventory<'_>) -> Value {
    let classes = scene
        .ontology
        .classes()
        .iter()
        .map(|class| json!({ "id": class.id, "name": class.name, "colour": class.colour }));
    let objects = inventory.objects().map(|record| {
        let mut object = json!({
            "object": record.object.to_u64().to_string(),
            "image_id": record.object.to_image_id(),
            "kind": record.kind.name(),
            "species": record.species,
            "world_position_m": record.position_m.to_array(),
            "radius_m": record.radius_m,
            "height_m": record.height_m,
        });
        if let Some(tree) = inventory.tree(record.object) {
            object["dbh_m"] = json!(tree.dbh_m);
            object["crown_base_m"] = json!(tree.crown_base_m);
            object["crown_radius_m"] = json!(tree.crown_radius_m);
            object["leaf_area_m2"] = json!(tree.leaf_area_m2);
            object["stem_volume_m3"] = json!(tree.stem_volume_m3);
            if let Some(volume_m3) = tree.wood_volume_m3 {
                object["wood_volume_m3"] = json!(volume_m3);
            }
            object["age_class"] = json!(tree.age_class);
            object["alive"] = json!(tree.alive);
        }
        object
    });
    json!({
        "world_origin_m": scene.origin_m.to_array(),
        "seed": scene.seed,
        "ontology": scene.ontology.name(),
        "classes": classes.collect::<Vec<_>>(),
        "objects": objects.collect::<Vec<_>>(),
    })
}
