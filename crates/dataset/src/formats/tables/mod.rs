//! `trees.csv`, `deadwood.csv` and `instances.csv` (RFC 4180, with line feeds).

mod decode;
mod encode;

use std::collections::BTreeMap;

use csv::StringRecord;
use nemoral_scene::ObjectId;

pub(crate) use self::decode::{
    deadwood, objects, read_deadwood_rows, read_object_rows, read_tree_rows, trees,
};
pub use self::encode::{deadwood_csv, trees_csv};
pub(crate) use self::encode::{
    deadwood_rows, encode_deadwood, encode_objects, encode_trees, encode_trees_and, object_rows,
    tree_rows,
};

use crate::Error;
use crate::error::shown;

/// The columns with which every row starts.
const ID_COLUMNS: &str = "id,chunk_x,chunk_y,item,image_id,label_id";
const TREE_COLUMNS: &str = "species,x_m,y_m,z_m,dbh_m,height_m,crown_base_m,crown_radius_m,\
                            leaf_area_m2,stem_volume_m3,wood_volume_m3,merchantable_volume_m3,\
                            lean_deg,age_class,alive,field_id";
const DEADWOOD_COLUMNS: &str = "kind,species,x_m,y_m,z_m,azimuth_deg,length_m,large_diameter_m,\
                                small_diameter_m,decay,volume_m3,thrown";
const OBJECT_COLUMNS: &str = "kind,species,x_m,y_m,z_m,radius_m,height_m";

/// The tables of a sequence.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tables {
    pub(crate) trees: Rows,
    pub(crate) deadwood: Rows,
    pub(crate) objects: Rows,
}

/// Rows by true id, before they are written as text. Parts of a table are united by id.
pub(crate) type Rows = BTreeMap<u64, StringRecord>;

fn id_fields(id: ObjectId) -> [String; 6] {
    let chunk = id.chunk();
    [
        id.to_u64().to_string(),
        chunk.x.to_string(),
        chunk.y.to_string(),
        id.item().to_string(),
        id.to_image_id().to_string(),
        id.to_label_id(chunk).to_string(),
    ]
}

/// Adds a row; two different rows of one id are an error.
pub(crate) fn insert(rows: &mut Rows, table: &str, row: StringRecord) -> Result<(), Error> {
    let id: u64 = row[0].parse().map_err(|_| {
        let found = format!("'{}'", shown(&row[0]));
        Error::invalid(format!("{table}.id"), found, "a true id")
    })?;
    match rows.insert(id, row) {
        Some(old) if old != rows[&id] => {
            let mut fields = old.iter().zip(&rows[&id]);
            let (a, b) = fields.find(|(a, b)| a != b).unwrap_or_default();
            let found = format!("'{}' and '{}'", shown(a), shown(b));
            Err(Error::invalid(format!("{table}.{id}"), found, "one thing"))
        }
        _ => Ok(()),
    }
}

/// A number in whole steps, of which there are so many in one, and never -0. One that is too large
/// for that has no finer part, and stays.
pub(crate) fn rounded(value: f64, steps: f64) -> f64 {
    let whole = (value * steps).round();
    let rounded = if whole.is_finite() {
        whole / steps
    } else {
        value
    };
    rounded + 0.0
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nemoral_scene::glam::DVec3;
    use nemoral_scene::{ChunkCoord, ObjectKind, ObjectRecord, TreeRecord};
    use proptest::prelude::*;

    use super::*;

    fn object() -> impl Strategy<Value = ObjectRecord> {
        let number = || prop::num::f64::NORMAL;
        let place = (-2_000_000..2_000_000, -2_000_000..2_000_000, 1_u16..);
        let name = "[a-z,\"\n é]{0,8}";
        (
            place,
            name,
            0..ObjectKind::ALL.len(),
            [number(), number(), number(), number(), number()],
        )
            .prop_map(|((x, y, item), species, kind, v)| ObjectRecord {
                object: ObjectId::new(ChunkCoord::new(x, y), item).expect("in range"),
                kind: ObjectKind::ALL[kind],
                species,
                position_m: DVec3::new(v[0], v[1], v[2]),
                radius_m: v[3],
                height_m: v[4],
            })
    }

    proptest! {
        #[test]
        fn tables_come_back_sorted(mut objects_in in prop::collection::vec(object(), 0..20)) {
            objects_in.sort_by_key(|o| o.object);
            objects_in.dedup_by_key(|o| o.object);
            let trees_in: Vec<_> = objects_in
                .iter()
                .map(|o| (o, o.object.item().is_multiple_of(2)))
                .map(|(o, alive)| TreeRecord {
                    object: o.object,
                    species: o.species.clone(),
                    position_m: o.position_m,
                    dbh_m: o.radius_m,
                    height_m: o.height_m,
                    crown_base_m: 0.1,
                    crown_radius_m: 2.0,
                    leaf_area_m2: 1e-7,
                    stem_volume_m3: 1.0 / 3.0,
                    wood_volume_m3: alive.then_some(2.0 / 3.0),
                    merchantable_volume_m3: alive.then_some(0.0),
                    lean_rad: 0.0,
                    age_class: "young".to_owned(),
                    alive,
                    field_id: String::new(),
                })
                .collect();
            let mut shuffled = objects_in.clone();
            shuffled.reverse();
            let path = Path::new("x.csv");
            let text = encode_objects(&object_rows(&shuffled).expect("no repeats"));
            prop_assert_eq!(
                objects(path, &read_object_rows(path, &text).expect("valid")).expect("valid"),
                objects_in
            );
            let text = encode_trees(&tree_rows(&trees_in).expect("no repeats"));
            prop_assert_eq!(
                trees(path, &read_tree_rows(path, &text).expect("valid")).expect("valid"),
                trees_in
            );
        }
    }

    #[test]
    fn numbers_are_rounded_whatever_their_size() {
        assert_eq!(rounded(1.23456, 1e3), 1.235);
        assert_eq!(rounded(-0.0, 1e3).to_string(), "0");
        assert_eq!(rounded(-1e306, 1e3), -1e306);
    }
}
