//! Records as rows, and rows as the text of a table.

use csv::StringRecord;
use nemoral_scene::{DeadwoodRecord, ObjectRecord, TreeRecord};

use super::{DEADWOOD_COLUMNS, ID_COLUMNS, OBJECT_COLUMNS, Rows, TREE_COLUMNS, id_fields, insert};
use crate::Error;

fn numbers(values: &[f64]) -> impl Iterator<Item = String> {
    values.iter().map(|v| (v + 0.0).to_string())
}

fn tree_row(t: &TreeRecord) -> StringRecord {
    let mut row = StringRecord::from(&id_fields(t.object)[..]);
    row.push_field(&t.species);
    row.extend(numbers(&t.position_m.to_array()));
    row.extend(numbers(&[
        t.dbh_m,
        t.height_m,
        t.crown_base_m,
        t.crown_radius_m,
        t.leaf_area_m2,
        t.stem_volume_m3,
    ]));
    let volumes = [t.wood_volume_m3, t.merchantable_volume_m3];
    row.extend(volumes.map(|v| v.map_or(String::new(), |v| v.to_string())));
    row.extend(numbers(&[t.lean_rad.to_degrees()]));
    row.push_field(&t.age_class);
    row.push_field(&t.alive.to_string());
    row.push_field(&t.field_id);
    row
}

pub(crate) fn tree_rows(trees: &[TreeRecord]) -> Result<Rows, Error> {
    let mut rows = Rows::new();
    for tree in trees {
        insert(&mut rows, "trees", tree_row(tree))?;
    }
    Ok(rows)
}

pub(crate) fn deadwood_rows(deadwood: &[DeadwoodRecord]) -> Result<Rows, Error> {
    let mut rows = Rows::new();
    for d in deadwood {
        let mut row = StringRecord::from(&id_fields(d.object)[..]);
        row.extend([d.kind.name(), &d.species]);
        row.extend(numbers(&d.position_m.to_array()));
        row.extend(numbers(&[d.azimuth_deg, d.length_m]));
        row.extend(numbers(&d.diameter_m));
        row.push_field(&d.decay.number().to_string());
        row.extend(numbers(&[d.volume_m3]));
        row.push_field(&d.is_thrown.to_string());
        insert(&mut rows, "deadwood", row)?;
    }
    Ok(rows)
}

pub(crate) fn object_rows(objects: &[ObjectRecord]) -> Result<Rows, Error> {
    let mut rows = Rows::new();
    for o in objects {
        let mut row = StringRecord::from(&id_fields(o.object)[..]);
        row.extend([o.kind.name(), &o.species]);
        row.extend(numbers(&o.position_m.to_array()));
        row.extend(numbers(&[o.radius_m, o.height_m]));
        insert(&mut rows, "instances", row)?;
    }
    Ok(rows)
}

/// Trees as the text of a `trees.csv`.
///
/// # Errors
/// If two that differ have the same id.
pub fn trees_csv(trees: &[TreeRecord]) -> Result<String, Error> {
    Ok(encode_trees(&tree_rows(trees)?))
}

pub(crate) fn encode_trees(rows: &Rows) -> String {
    encode(&format!("{ID_COLUMNS},{TREE_COLUMNS}"), rows)
}

/// Trees as the text of a table with the columns of `trees.csv` and then others, with the fields of
/// these; an error if two that differ have the same id.
pub(crate) fn encode_trees_and(
    other_columns: &str,
    trees: impl IntoIterator<Item = (TreeRecord, Vec<String>)>,
) -> Result<String, Error> {
    let mut rows = Rows::new();
    for (tree, fields) in trees {
        let mut row = tree_row(&tree);
        row.extend(fields);
        insert(&mut rows, "trees", row)?;
    }
    let columns = format!("{ID_COLUMNS},{TREE_COLUMNS},{other_columns}");
    Ok(encode(&columns, &rows))
}

/// Logs and root plates as the text of a `deadwood.csv`.
///
/// # Errors
/// If two that differ have the same id.
pub fn deadwood_csv(deadwood: &[DeadwoodRecord]) -> Result<String, Error> {
    Ok(encode_deadwood(&deadwood_rows(deadwood)?))
}

pub(crate) fn encode_deadwood(rows: &Rows) -> String {
    encode(&format!("{ID_COLUMNS},{DEADWOOD_COLUMNS}"), rows)
}

pub(crate) fn encode_objects(rows: &Rows) -> String {
    encode(&format!("{ID_COLUMNS},{OBJECT_COLUMNS}"), rows)
}

fn encode(columns: &str, rows: &Rows) -> String {
    let mut out = csv::Writer::from_writer(format!("{columns}\n").into_bytes());
    for row in rows.values() {
        out.write_record(row)
            .expect("rows are as wide as their table, and memory takes them");
    }
    let bytes = out.into_inner().expect("memory takes all rows");
    String::from_utf8(bytes).expect("fields are text")
}
