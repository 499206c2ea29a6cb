//! Stem maps: where the trees of a plot stand, and what was measured of each.

use std::collections::BTreeMap;

use crate::ImportError;
use crate::table::Table;

/// The most rows of a stem map.
pub const MAX_STEMS: usize = 200_000;
/// The longest name of a tree.
const MAX_ID_BYTES: usize = 64;
/// The farthest that a tree stands from the middle one along each axis, metres.
const SPREAD_M: f64 = 50_000.0;
const DBH: [&str; 6] = [
    "dbh_m",
    "dbh_cm",
    "dbh_mm",
    "diameter_m",
    "diameter_cm",
    "diameter_mm",
];
const HEIGHT: [&str; 2] = ["height_m", "height"];
const X: [&str; 3] = ["x_m", "x", "easting"];
const Y: [&str; 3] = ["y_m", "y", "northing"];
const ID: [&str; 4] = ["id", "tree_id", "tree", "stem_id"];
const SPECIES: &str = "species";
const ALIVE: &str = "alive";
const AGE_CLASS: &str = "age_class";
/// Coordinates are within this, metres: projected ones are.
pub(crate) const REACH_M: f64 = 5e7;

/// A tree of a stem map.
#[derive(Clone, Debug, PartialEq)]
pub struct Stem {
    /// Its line in the file, from 1.
    pub line: u64,
    /// What the file calls it.
    pub id: Option<String>,
    /// Easting of its foot, metres.
    pub x_m: f64,
    /// Northing of its foot, metres.
    pub y_m: f64,
    /// The name of its species, as the file has it.
    pub species: Option<String>,
    /// Diameter at breast height, metres.
    pub dbh_m: Option<f64>,
    /// Height, metres.
    pub height_m: Option<f64>,
    /// Whether it is alive; it is where the file does not say.
    pub is_alive: bool,
}

/// Reads a stem map: CSV with a header, separated by commas, semicolons (then with decimal points
/// or commas) or tabs. Lines that start with `#` are skipped.
///
/// | column | content |
/// |---|---|
/// | `x_m` or `x`, `easting` | metres east |
/// | `y_m` or `y`, `northing` | metres north |
/// | `species` | its name |
/// | `dbh_m`, `dbh_cm`, `dbh_mm` (or `diameter_m` and so on) | diameter at breast height, 5 mm to 5 m |
/// | `height_m` or `height` | metres, 2 to 120 |
/// | `alive` | true or false, 1 or 0, yes or no |
/// | `id` or `tree_id`, `tree`, `stem_id` | what the tree is called, at most 64 bytes |
///
/// Only x and y are needed; other columns are ignored: [`unread_columns`] names them. Cells may be
/// empty. The `trees.csv` of a data set is a stem map, of which rows whose `age_class` is `sapling`
/// are left out.
///
/// # Errors
/// A column is missing or has no unit, a row is malformed, a value is out of its range, two trees
/// stand at one place, one is more than 50 km from the middle one, all are within centimetres as if
/// in degrees, there are none, or more than [`MAX_STEMS`].
pub fn read_stem_map(bytes: &[u8]) -> Result<Vec<Stem>, ImportError> {
    let mut table = Table::new(bytes)?;
    let x = table.needed(&X)?;
    let y = table.needed(&Y)?;
    let species = table.column(&[SPECIES])?;
    let height = table.column(&HEIGHT)?;
    let age_class = table.column(&[AGE_CLASS])?;
    let alive = table.column(&[ALIVE])?;
    let id = table.column(&ID)?;
    let without_unit = |c: &&String| ["dbh", "diameter"].contains(&c.as_str());
    if let Some(column) = table.columns().iter().find(without_unit) {
        return Err(ImportError::file(format!(
            "has a column `{column}`, whose unit is not known: call it dbh_m, dbh_cm or dbh_mm"
        )));
    }
    let dbh = table.column(&DBH)?;
    let dbh = dbh.map(|column| {
        let per_m = match table.columns()[column].as_str() {
            name if name.ends_with("_cm") => 100.0,
            name if name.ends_with("_mm") => 1000.0,
            _ => 1.0,
        };
        (column, table.columns()[column].clone(), per_m)
    });
    let mut stems: Vec<Stem> = Vec::new();
    let mut saplings = 0;
    let mut places: BTreeMap<[u64; 2], u64> = BTreeMap::new();
    table.rows(|row| {
        if age_class.and_then(|column| row.text(column)) == Some("sapling") {
            saplings += 1;
            return Ok(());
        }
        if stems.len() == MAX_STEMS {
            return Err(row.error(format!("a stem map has at most {MAX_STEMS} trees")));
        }
        let place = |column, name| {
            let found = row.number(column, name, [-REACH_M, REACH_M])?;
            found.ok_or_else(|| row.error(format!("{name} is missing")))
        };
        let (x_m, y_m) = (place(x, "x")?, place(y, "y")?);
        // The sum turns -0 into 0.
        let at = [x_m, y_m].map(|m| (m + 0.0).to_bits());
        if let Some(other) = places.insert(at, row.line) {
            let message = format!("stands where the tree of line {other} does");
            return Err(row.error(message));
        }
        let dbh_m = match &dbh {
            None => None,
            Some((column, name, per_m)) => {
                let range = [0.005 * per_m, 5.0 * per_m];
                row.number(*column, name, range)?.map(|d| d / per_m)
            }
        };
        let height_m = match height {
            None => None,
            Some(column) => row.number(column, "height_m", [2.0, 120.0])?,
        };
        let is_alive = match alive.and_then(|column| row.text(column)) {
            None => true,
            Some(word) => match word.to_lowercase().as_str() {
                "true" | "1" | "yes" => true,
                "false" | "0" | "no" => false,
                _ => {
                    let word = crate::error::shown(word);
                    return Err(row.error(format!("alive = {word}: must be true or false")));
                }
            },
        };
        let id = id.and_then(|column| row.text(column));
        if let Some(long) = id.filter(|id| id.len() > MAX_ID_BYTES) {
            let message = format!(
                "the id {} has {} bytes: at most {MAX_ID_BYTES} are read",
                crate::error::shown(long),
                long.len()
            );
            return Err(row.error(message));
        }
        stems.push(Stem {
            line: row.line,
            id: id.map(str::to_owned),
            x_m,
            y_m,
            species: species
                .and_then(|column| row.text(column))
                .map(str::to_owned),
            dbh_m,
            height_m,
            is_alive,
        });
        Ok(())
    })?;
    if stems.is_empty() && saplings > 0 {
        let message = format!("has {saplings} saplings and no tree: saplings are left out");
        return Err(ImportError::file(message));
    }
    if stems.is_empty() {
        return Err(ImportError::file("has no trees below its header"));
    }
    if stems.len() > 1 && seems_in_degrees(&stems) {
        let message = "seems to be in degrees: project it to metres first, such as UTM";
        return Err(ImportError::file(message));
    }
    if let Some(far) = stray(&stems) {
        let message = format!(
            "line {}: stands at ({}, {}), more than {} km from the middle of the other trees",
            far.line,
            far.x_m,
            far.y_m,
            SPREAD_M / 1000.0
        );
        return Err(ImportError::file(message));
    }
    Ok(stems)
}

/// The names of a stem map's columns that [`read_stem_map`] does not read, and whether there are
/// columns of diameters or heights.
///
/// # Errors
/// There is no header.
pub fn unread_columns(bytes: &[u8]) -> Result<(Vec<String>, bool), ImportError> {
    let table = Table::new(bytes)?;
    let is_size = |name: &str| DBH.contains(&name) || HEIGHT.contains(&name);
    let is_other = |name: &str| {
        X.contains(&name)
            || Y.contains(&name)
            || ID.contains(&name)
            || [SPECIES, ALIVE, AGE_CLASS].contains(&name)
    };
    let names = table.columns().iter().map(String::as_str);
    let has_sizes = names.clone().any(is_size);
    let unread = names.filter(|name| !is_size(name) && !is_other(name));
    Ok((unread.map(str::to_owned).collect(), has_sizes))
}

/// The first tree that is too far from the middle one.
fn stray(stems: &[Stem]) -> Option<&Stem> {
    let middle = |of: fn(&Stem) -> f64| {
        let mut all: Vec<f64> = stems.iter().map(of).collect();
        all.sort_unstable_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let (x_m, y_m) = (middle(|s| s.x_m), middle(|s| s.y_m));
    let is_far = |s: &&Stem| (s.x_m - x_m).abs().max((s.y_m - y_m).abs()) > SPREAD_M;
    stems.iter().find(is_far)
}

/// Whether all places could be degrees, and would be a few centimetres apart if they were metres.
fn seems_in_degrees(stems: &[Stem]) -> bool {
    let range = |of: fn(&Stem) -> f64| {
        let least = stems.iter().map(of).fold(f64::INFINITY, f64::min);
        let most = stems.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        (least.abs().max(most.abs()), most - least)
    };
    let [(x, width), (y, height)] = [range(|s| s.x_m), range(|s| s.y_m)];
    x <= 180.0 && y <= 90.0 && width.max(height) < 0.05
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        read_stem_map(text.as_bytes()).expect_err(text).to_string()
    }

    #[test]
    fn degrees_are_refused() {
        let degrees = "x,y,dbh_cm\n8.1,49.2,30\n8.1003,49.2002,40\n8.1001,49.2001,30\n";
        assert!(refused(degrees).contains("in degrees"));
        let metres = "x,y\n8.1,49.2\n8.1003,49.3\n";
        assert_eq!(read_stem_map(metres.as_bytes()).expect("metres").len(), 2);
        assert!(read_stem_map(b"x,y\n8.1,49.2\n").is_ok());
    }

    #[test]
    fn spreadsheets_of_all_countries_are_read() {
        let comma = "x,y,species,dbh_cm,height,plot\n1,2,beech,31.5,24.5,A\n-3.5,0,,,,B\n";
        let semicolon = "\u{feff}X;Y;Species;DBH_cm;Height;Plot\r\n1;2;beech;31,5;24,5;A\r\n\
                         -3,5;0;;;;B\r\n";
        let tab = "# exported\nx_m\ty_m\tspecies\tdbh_mm\theight_m\n1\t2\tbeech\t315\t24.5\n\
                   -3.5\t0\tNA\t-\tnan\n";
        let carriage = "x,y,species,dbh_cm,height\r1,2,beech,31.5,24.5\r\r-3.5,0,,,\r";
        let expected = |lines: [u64; 2]| {
            let stem = |line, x_m, y_m| Stem {
                line,
                id: None,
                x_m,
                y_m,
                species: None,
                dbh_m: None,
                height_m: None,
                is_alive: true,
            };
            let first = Stem {
                species: Some("beech".to_owned()),
                dbh_m: Some(0.315),
                height_m: Some(24.5),
                ..stem(lines[0], 1.0, 2.0)
            };
            vec![first, stem(lines[1], -3.5, 0.0)]
        };
        for (text, lines) in [
            (comma, [2, 3]),
            (semicolon, [2, 3]),
            (tab, [3, 4]),
            (carriage, [2, 4]),
        ] {
            assert_eq!(
                read_stem_map(text.as_bytes()),
                Ok(expected(lines)),
                "{text}"
            );
        }
        let diameters = read_stem_map(b"x,y,Diameter_cm\n1,2,31.5\n").expect("a stem map");
        assert_eq!(diameters[0].dbh_m, Some(0.315));
        // The inventory of a data set, whose saplings have no diameter.
        let trees = "id,x_m,y_m,dbh_m,height_m,age_class\n1,0,1,0,0.4,sapling\n2,3,4,0.3,20,old\n";
        let stems = read_stem_map(trees.as_bytes()).expect("a stem map");
        assert_eq!((stems.len(), stems[0].line), (1, 3));
        let trees = "id,species,x_m,y_m,z_m,dbh_m,height_m,alive\n1,beech,0,1,2,0.3,20,false\n";
        assert!(!read_stem_map(trees.as_bytes()).expect("a stem map")[0].is_alive);
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert!(refused("").contains("is empty"));
        assert!(refused("x,y\n").contains("has no trees"));
        assert!(refused("x,species\n1,beech\n").contains("no column `y_m`"));
        assert!(refused("x,x_m,y\n1,1,1\n").contains("say the same"));
        assert!(refused("x,y,dbh\n1,1,30\n").contains("dbh_cm"));
        assert!(refused("x,y,Diameter\n1,1,30\n").contains("`diameter`"));
        assert!(refused("x,y,age_class\n1,1,sapling\n").contains("has 1 saplings"));
        assert!(refused("x,y,dbh_cm\n1,1,30\n2,2,3000\n").contains("line 3: dbh_cm = 3000"));
        assert!(refused("x,y,height\n1,1,0.4\n").contains("line 2: height_m = 0.4"));
        assert!(refused("x,y\n1,\n").contains("line 2: y is missing"));
        assert!(refused("x,y\n1,inf\n").contains("line 2: y = inf"));
        assert!(refused("x,y\n1,2,3\n").contains("has 3 columns"));
        assert!(
            refused("x,y\n0,0\n1,1\n-0,0\n").contains("line 4: stands where the tree of line 2")
        );
        assert!(refused("x,y,alive\n0,0,maybe\n").contains("alive = maybe"));
        // Two of its coordinates are exchanged.
        let exchanged = "x,y\n553200,4450300\n553210,4450310\n4450305,553202\n";
        assert!(
            refused(exchanged).contains("line 4: stands at (4450305, 553202), more than 50 km")
        );
    }

    #[test]
    fn columns_that_are_not_read_are_named() {
        let columns = |text: &str| unread_columns(text.as_bytes()).expect("a header");
        let german = "Tree;X;Y;Baumart;BHD;Hoehe\n1;1;2;Buche;35,2;22\n";
        let unread = ["baumart", "bhd", "hoehe"].map(str::to_owned).to_vec();
        assert_eq!(columns(german), (unread, false));
        assert_eq!(
            columns("id,easting,northing,species,height\n"),
            (vec![], true)
        );
        assert!(unread_columns(b"").is_err());
    }
}
