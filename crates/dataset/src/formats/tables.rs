//! `trees.csv`, `deadwood.csv` and `instances.csv` (RFC 4180, with line feeds).

use std::collections::BTreeMap;
use std::path::Path;

use csv::StringRecord;
use nemoral_scene::glam::DVec3;
use nemoral_scene::{
    ChunkCoord, DeadwoodRecord, DecayStage, ObjectId, ObjectKind, ObjectRecord, TreeRecord, excerpt,
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

fn numbers(values: &[f64]) -> impl Iterator<Item = String> {
    values.iter().map(|v| (v + 0.0).to_string())
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

pub(crate) fn read_tree_rows(path: &Path, text: &str) -> Result<Rows, Error> {
    read(path, text, "trees", &format!("{ID_COLUMNS},{TREE_COLUMNS}"))
}

pub(crate) fn read_deadwood_rows(path: &Path, text: &str) -> Result<Rows, Error> {
    let columns = format!("{ID_COLUMNS},{DEADWOOD_COLUMNS}");
    read(path, text, "deadwood", &columns)
}

pub(crate) fn read_object_rows(path: &Path, text: &str) -> Result<Rows, Error> {
    let columns = format!("{ID_COLUMNS},{OBJECT_COLUMNS}");
    read(path, text, "instances", &columns)
}

fn read(path: &Path, text: &str, table: &str, columns: &str) -> Result<Rows, Error> {
    let (found, text) = text.split_once('\n').unwrap_or((text, ""));
    if found != columns {
        let found = excerpt(found, 200);
        return Err(Error::malformed(
            path,
            format!("columns are '{found}', must be '{columns}'"),
        ));
    }
    let width = columns.split(',').count();
    let mut rows = Rows::new();
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(text.as_bytes());
    for row in reader.records() {
        let row = row.map_err(|e| Error::malformed(path, e))?;
        let line = line(&row);
        if row.len() != width {
            let message = format!("line {line}: has {} fields, must have {width}", row.len());
            return Err(Error::malformed(path, message));
        }
        let wrong = |e: Error| Error::malformed(path, format!("line {line}: {e}"));
        insert(&mut rows, table, row).map_err(wrong)?;
    }
    Ok(rows)
}

/// The line of a row in its file, whose first line has the names of the columns.
fn line(row: &StringRecord) -> u64 {
    row.position().map_or(0, |at| at.line() + 1)
}

/// Reads the fields of a row one after the other.
struct Fields<'a> {
    path: &'a Path,
    row: &'a StringRecord,
    /// The names of the columns after those of the id.
    columns: &'static str,
    /// How many fields have been taken.
    taken: usize,
}

impl<'a> Fields<'a> {
    fn new(path: &'a Path, row: &'a StringRecord, columns: &'static str) -> Self {
        Self {
            path,
            row,
            columns,
            taken: 0,
        }
    }

    fn text(&mut self) -> &'a str {
        let text = self.row.get(self.taken).unwrap_or_default();
        self.taken += 1;
        text
    }

    /// The error of the field that was taken last, which must be what `allowed` says.
    fn wrong(&self, allowed: &str) -> Error {
        let last = self.taken.saturating_sub(1);
        let mut columns = ID_COLUMNS.split(',').chain(self.columns.split(','));
        let column = columns.nth(last).unwrap_or_default();
        let value = shown(self.row.get(last).unwrap_or_default());
        let line = line(self.row);
        let message = format!("line {line}, {column} = '{value}': must be {allowed}");
        Error::malformed(self.path, message)
    }

    fn parse<T: std::str::FromStr>(&mut self, allowed: &str) -> Result<T, Error> {
        self.text().parse().map_err(|_| self.wrong(allowed))
    }

    fn number(&mut self) -> Result<f64, Error> {
        const ALLOWED: &str = "a finite number";
        let number: f64 = self.parse(ALLOWED)?;
        if number.is_finite() {
            Ok(number)
        } else {
            Err(self.wrong(ALLOWED))
        }
    }

    /// A number, or nothing.
    fn optional_number(&mut self) -> Result<Option<f64>, Error> {
        if self.row.get(self.taken).is_some_and(str::is_empty) {
            self.taken += 1;
            return Ok(None);
        }
        self.number().map(Some)
    }

    fn flag(&mut self) -> Result<bool, Error> {
        self.parse("true or false")
    }

    fn kind(&mut self) -> Result<ObjectKind, Error> {
        let name = self.text();
        let kind = ObjectKind::ALL.iter().find(|k| k.name() == name);
        kind.copied().ok_or_else(|| {
            let names: Vec<&str> = ObjectKind::ALL.iter().map(|k| k.name()).collect();
            self.wrong(&format!("one of {}", names.join(", ")))
        })
    }

    fn decay(&mut self) -> Result<DecayStage, Error> {
        const ALLOWED: &str = "1 to 5";
        let number = self.parse(ALLOWED)?;
        DecayStage::from_number(number).ok_or_else(|| self.wrong(ALLOWED))
    }

    fn position(&mut self) -> Result<DVec3, Error> {
        Ok(DVec3::new(self.number()?, self.number()?, self.number()?))
    }

    /// The columns of the id, which must agree with each other.
    fn object(&mut self) -> Result<ObjectId, Error> {
        const ALLOWED: &str = "a whole number of a true id";
        self.text();
        let chunk = ChunkCoord::new(self.parse(ALLOWED)?, self.parse(ALLOWED)?);
        let id = ObjectId::new(chunk, self.parse(ALLOWED)?);
        // The ids of images and labels follow from the true id.
        self.taken += 2;
        id.filter(|&id| self.row.iter().zip(id_fields(id)).all(|(a, b)| a == b))
            .ok_or_else(|| {
                let message = format!(
                    "line {}: the id columns of row '{}' contradict each other",
                    line(self.row),
                    shown(&self.row[0])
                );
                Error::malformed(self.path, message)
            })
    }
}

pub(crate) fn trees(path: &Path, rows: &Rows) -> Result<Vec<TreeRecord>, Error> {
    let tree = |row| {
        let mut f = Fields::new(path, row, TREE_COLUMNS);
        Ok(TreeRecord {
            object: f.object()?,
            species: f.text().to_owned(),
            position_m: f.position()?,
            dbh_m: f.number()?,
            height_m: f.number()?,
            crown_base_m: f.number()?,
            crown_radius_m: f.number()?,
            leaf_area_m2: f.number()?,
            stem_volume_m3: f.number()?,
            wood_volume_m3: f.optional_number()?,
            merchantable_volume_m3: f.optional_number()?,
            lean_rad: f.number()?.to_radians(),
            age_class: f.text().to_owned(),
            alive: f.flag()?,
            field_id: f.text().to_owned(),
        })
    };
    rows.values().map(tree).collect()
}

pub(crate) fn deadwood(path: &Path, rows: &Rows) -> Result<Vec<DeadwoodRecord>, Error> {
    let record = |row| {
        let mut f = Fields::new(path, row, DEADWOOD_COLUMNS);
        Ok(DeadwoodRecord {
            object: f.object()?,
            kind: f.kind()?,
            species: f.text().to_owned(),
            position_m: f.position()?,
            azimuth_deg: f.number()?,
            length_m: f.number()?,
            diameter_m: [f.number()?, f.number()?],
            decay: f.decay()?,
            volume_m3: f.number()?,
            is_thrown: f.flag()?,
        })
    };
    rows.values().map(record).collect()
}

pub(crate) fn objects(path: &Path, rows: &Rows) -> Result<Vec<ObjectRecord>, Error> {
    let object = |row| {
        let mut f = Fields::new(path, row, OBJECT_COLUMNS);
        Ok(ObjectRecord {
            object: f.object()?,
            kind: f.kind()?,
            species: f.text().to_owned(),
            position_m: f.position()?,
            radius_m: f.number()?,
            height_m: f.number()?,
        })
    };
    rows.values().map(object).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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

    #[test]
    fn contradictions_are_found() {
        let path = Path::new("x.csv");
        let id = ObjectId::new(ChunkCoord::new(1, 2), 3).expect("in range");
        let record = |radius_m| ObjectRecord {
            object: id,
            kind: ObjectKind::Rock,
            species: "granite".to_owned(),
            position_m: DVec3::ZERO,
            radius_m,
            height_m: 1.0,
        };
        assert!(object_rows(&[record(1.0), record(1.0)]).is_ok());
        assert!(object_rows(&[record(1.0), record(2.0)]).is_err());
        let text = encode_objects(&object_rows(&[record(1.0)]).expect("one"));
        let wrong = text.replace(&format!("{},1,2,3", id.to_u64()), "99,1,2,3");
        assert_ne!(text, wrong);
        let rows = read_object_rows(path, &wrong).expect("well formed");
        assert!(objects(path, &rows).is_err());
        assert!(read_object_rows(path, &text.replace("granite,", "")).is_err());
        assert!(read_tree_rows(path, &text).is_err());
    }

    /// What is said of a table after a change of its text.
    fn told<T>(
        text: &str,
        (from, to): (&str, &str),
        rows: impl Fn(&Path, &str) -> Result<Rows, Error>,
        records: impl Fn(&Path, &Rows) -> Result<Vec<T>, Error>,
    ) -> String {
        let (path, changed) = (Path::new("x.csv"), text.replacen(from, to, 1));
        assert_ne!(text, changed, "{from}");
        let read = rows(path, &changed).and_then(|rows| records(path, &rows).map(drop));
        read.expect_err(to).to_string()
    }

    #[test]
    fn wrong_fields_are_named_by_line_and_column() {
        let object = ObjectId::new(ChunkCoord::new(1, 2), 3).expect("in range");
        let tree = TreeRecord {
            object,
            species: "oak".to_owned(),
            position_m: DVec3::ZERO,
            dbh_m: 0.3,
            height_m: 20.0,
            crown_base_m: 8.0,
            crown_radius_m: 2.5,
            leaf_area_m2: 120.0,
            stem_volume_m3: 0.7,
            wood_volume_m3: Some(0.9),
            merchantable_volume_m3: None,
            lean_rad: 0.0,
            age_class: "young".to_owned(),
            alive: true,
            field_id: String::new(),
        };
        let text = encode_trees(&tree_rows(&[tree]).expect("one"));
        for (from, to, says) in [
            ("oak,0,", "oak,NaN,", "x_m = 'NaN': must be a finite"),
            (",0.3,", ",inf,", "dbh_m = 'inf': must be a finite"),
            (",0,young", ",1e999,young", "lean_deg = '1e999': must"),
            (",0.9,", ",NaN,", "wood_volume_m3 = 'NaN': must be a finite"),
            (",true,", ",yes,", "alive = 'yes': must be true or false"),
            (",1,2,3,", ",1,x,3,", "chunk_y = 'x': must be a whole"),
        ] {
            let told = told(&text, (from, to), read_tree_rows, trees);
            assert!(told.contains(&format!("line 2, {says}")), "{told}");
        }
        let log = DeadwoodRecord {
            object,
            kind: ObjectKind::Log,
            species: "oak".to_owned(),
            position_m: DVec3::ZERO,
            azimuth_deg: 90.0,
            length_m: 4.0,
            diameter_m: [0.3, 0.25],
            decay: DecayStage::from_number(2).expect("a stage"),
            volume_m3: 0.21,
            is_thrown: false,
        };
        let text = encode_deadwood(&deadwood_rows(&[log]).expect("one"));
        for (from, to, says) in [
            (",90,", ",-inf,", "azimuth_deg = '-inf': must"),
            (",0.25,", ",nan,", "small_diameter_m = 'nan': must"),
            (",2,0.21,", ",7,0.21,", "decay = '7': must be 1 to 5"),
            ("log,oak", "twig,oak", "kind = 'twig': must be one of tree,"),
        ] {
            let told = told(&text, (from, to), read_deadwood_rows, deadwood);
            assert!(told.contains(&format!("line 2, {says}")), "{told}");
        }
    }

    #[test]
    fn long_fields_are_shortened_in_messages() {
        let rock = ObjectRecord {
            object: ObjectId::new(ChunkCoord::new(1, 2), 3).expect("in range"),
            kind: ObjectKind::Rock,
            species: "granite".to_owned(),
            position_m: DVec3::ZERO,
            radius_m: 1.5,
            height_m: 1.0,
        };
        let text = encode_objects(&object_rows(&[rock]).expect("one"));
        let row = text.lines().nth(1).expect("a row");
        let (id, _) = row.split_once(',').expect("several fields");
        let (long, zeros) = ("\u{1b}x".repeat(100_000), "0".repeat(100_000));
        for (from, to) in [
            ("rock".to_owned(), long.clone()),
            (",1.5,".to_owned(), format!(",{long},")),
            (format!("\n{id},"), format!("\n{long},")),
            (format!("\n{id},"), format!("\n{zeros}{id},")),
            (
                row.to_owned(),
                format!("{row}\n{}", row.replace("granite", &long)),
            ),
            ("radius_m".to_owned(), long.clone()),
        ] {
            let change = (from.as_str(), to.as_str());
            let told = told(&text, change, read_object_rows, objects);
            assert!(told.len() < 1500 && !told.contains('\u{1b}'), "{told}");
        }
    }
}
