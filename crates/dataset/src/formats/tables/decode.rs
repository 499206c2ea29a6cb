//! The text of a table as rows, and rows as records.

use std::path::Path;

use csv::StringRecord;
use nemoral_scene::glam::DVec3;
use nemoral_scene::{
    ChunkCoord, DeadwoodRecord, DecayStage, ObjectId, ObjectKind, ObjectRecord, TreeRecord, excerpt,
};

use super::{DEADWOOD_COLUMNS, ID_COLUMNS, OBJECT_COLUMNS, Rows, TREE_COLUMNS, id_fields, insert};
use crate::Error;
use crate::error::shown;

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
    use crate::formats::tables::{
        deadwood_rows, encode_deadwood, encode_objects, encode_trees, object_rows, tree_rows,
    };

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
