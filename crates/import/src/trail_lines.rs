//! Trail lines: the middles of trails, from GeoJSON or CSV.

use serde_json::Value;

use crate::ImportError;
use crate::epsg::code_of_name;
use crate::error::shown;
use crate::stem_map::REACH_M;
use crate::table::Table;

/// The most lines of a file.
pub const MAX_LINES: usize = 10_000;

/// The most vertices of all lines of a file.
pub const MAX_VERTICES: usize = 200_000;

/// The greatest length of all lines of a file together, metres.
pub const MAX_LENGTH_M: f64 = 500_000.0;

/// The middle of a trail.
#[derive(Clone, Debug, PartialEq)]
pub struct TrailLine {
    /// Easting and northing of its vertices in order, metres; at least two.
    pub vertices_m: Vec<[f64; 2]>,
}

/// The trails of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct TrailLines {
    /// All lines, in the file's order.
    pub lines: Vec<TrailLine>,
    /// The EPSG code of their coordinates, if the file has one: CSV has none.
    pub epsg: Option<u16>,
}

/// Reads trail lines, in metres as the other files are.
///
/// GeoJSON: every `LineString` and `MultiLineString`, alone or in features and collections; other
/// geometries are an error, and properties and heights are ignored. (RFC 7946 has degrees only; as
/// `ogr2ogr -f GeoJSON -t_srs EPSG:…` writes it, a file may have projected metres, whose code its
/// member `crs` has.)
///
/// CSV: a header with `x_m`, `y_m` (or `x`, `y`; `easting`, `northing`), and `trail`, if there are
/// several: a row is a vertex, and rows with the same name, one after the other, are a line.
///
/// # Errors
/// The file is neither, is in degrees, has a vertex that is no place, a line with less than two
/// vertices, no line at all, more than [`MAX_LINES`] lines or [`MAX_VERTICES`] vertices, or lines
/// longer than [`MAX_LENGTH_M`] together.
pub fn read_trail_lines(bytes: &[u8]) -> Result<TrailLines, ImportError> {
    let (lines, epsg) = if bytes.trim_ascii_start().starts_with(b"{") {
        let json: Value = serde_json::from_slice(bytes)
            .map_err(|e| ImportError::file(format!("is no GeoJSON: {}", shown(&e.to_string()))))?;
        let mut lines = Lines::default();
        lines.add(&json)?;
        let name = json.pointer("/crs/properties/name").and_then(Value::as_str);
        (lines.0, name.and_then(code_of_name))
    } else {
        (of_table(bytes)?, None)
    };
    let vertices: usize = lines.iter().map(Vec::len).sum();
    if lines.is_empty() {
        return Err(ImportError::file("has no line"));
    }
    if lines.len() > MAX_LINES || vertices > MAX_VERTICES {
        let message = format!(
            "has {} lines with {vertices} vertices: at most {MAX_LINES} with {MAX_VERTICES}",
            lines.len()
        );
        return Err(ImportError::file(message));
    }
    if let Some(short) = lines.iter().position(|line| line.len() < 2) {
        let vertices = lines[short].len();
        let message = format!("line {short}, from 0, has {vertices} of at least 2 vertices");
        return Err(ImportError::file(message));
    }
    let is_degrees = |v: &[f64; 2]| v[0].abs() <= 180.0 && v[1].abs() <= 90.0;
    let length = |pair: &[[f64; 2]]| {
        let [dx, dy] = [0, 1].map(|k| pair[1][k] - pair[0][k]);
        (dx * dx + dy * dy).sqrt()
    };
    let lengths = || lines.iter().flat_map(|line| line.windows(2).map(length));
    let longest = lengths().fold(0.0, f64::max);
    if lines.iter().flatten().all(is_degrees) && longest < 0.05 {
        let message = "seems to be in degrees: project it to metres first, such as UTM";
        return Err(ImportError::file(message));
    }
    let total_m: f64 = lengths().sum();
    if total_m > MAX_LENGTH_M {
        let message = format!("has {total_m:.0} m of lines: at most {MAX_LENGTH_M}");
        return Err(ImportError::file(message));
    }
    let lines = lines.into_iter();
    Ok(TrailLines {
        lines: lines.map(|vertices_m| TrailLine { vertices_m }).collect(),
        epsg,
    })
}

/// The lines of a GeoJSON so far.
#[derive(Default)]
struct Lines(Vec<Vec<[f64; 2]>>);

impl Lines {
    /// Adds the lines of an object. The depth is bounded by that of the parser.
    fn add(&mut self, object: &Value) -> Result<(), ImportError> {
        let kind = object
            .get("type")
            .and_then(Value::as_str)
            .unwrap_or_default();
        let list = |key: &str| {
            let found = object.get(key).and_then(Value::as_array);
            found.ok_or_else(|| ImportError::file(format!("has a {kind} without `{key}`")))
        };
        match kind {
            "FeatureCollection" => list("features")?.iter().try_for_each(|f| self.add(f)),
            "GeometryCollection" => list("geometries")?.iter().try_for_each(|g| self.add(g)),
            "Feature" => match object.get("geometry") {
                None | Some(Value::Null) => Ok(()),
                Some(geometry) => self.add(geometry),
            },
            "LineString" => {
                self.0.push(line(list("coordinates")?)?);
                Ok(())
            }
            "MultiLineString" => list("coordinates")?.iter().try_for_each(|of_line| {
                let vertices = of_line.as_array();
                let vertices =
                    vertices.ok_or_else(|| ImportError::file("has a line without vertices"))?;
                self.0.push(line(vertices)?);
                Ok(())
            }),
            other => Err(ImportError::file(format!(
                "has a {:?}: must be LineString, MultiLineString, or features of these",
                shown(other)
            ))),
        }
    }
}

/// The vertices of a line.
fn line(vertices: &[Value]) -> Result<Vec<[f64; 2]>, ImportError> {
    let vertex = |value: &Value| {
        let numbers = value.as_array().map(Vec::as_slice).unwrap_or_default();
        let number = |k: usize| numbers.get(k).and_then(Value::as_f64);
        let is_place = |m: &f64| (-REACH_M..=REACH_M).contains(m);
        match (number(0).filter(is_place), number(1).filter(is_place)) {
            (Some(x), Some(y)) => Ok([x, y]),
            _ => Err(ImportError::file(format!(
                "has the vertex {}: must be [x, y], within {REACH_M} m",
                shown(&value.to_string())
            ))),
        }
    };
    vertices.iter().map(vertex).collect()
}

fn of_table(bytes: &[u8]) -> Result<Vec<Vec<[f64; 2]>>, ImportError> {
    let mut table = Table::new(bytes)?;
    let x = table.needed(&["x_m", "x", "easting"])?;
    let y = table.needed(&["y_m", "y", "northing"])?;
    let trail = table.column(&["trail"])?;
    let mut lines: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut last: Option<String> = None;
    let mut vertices = 0;
    table.rows(|row| {
        vertices += 1;
        if vertices > MAX_VERTICES || lines.len() > MAX_LINES {
            let message = format!("at most {MAX_LINES} lines with {MAX_VERTICES} vertices");
            return Err(row.error(message));
        }
        let place = |column, name| {
            let found = row.number(column, name, [-REACH_M, REACH_M])?;
            found.ok_or_else(|| row.error(format!("{name} is missing")))
        };
        let vertex = [place(x, "x")?, place(y, "y")?];
        let name = trail
            .and_then(|column| row.text(column))
            .unwrap_or_default();
        match lines.last_mut() {
            Some(line) if last.as_deref() == Some(name) => line.push(vertex),
            _ => {
                lines.push(vec![vertex]);
                last = Some(name.to_owned());
            }
        }
        Ok(())
    })?;
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Vec<[f64; 2]>>, String> {
        let trails = read_trail_lines(text.as_bytes()).map_err(|e| e.to_string())?;
        Ok(trails.lines.into_iter().map(|l| l.vertices_m).collect())
    }

    #[test]
    fn lines_of_all_kinds_are_read() {
        let a = vec![[0.0, 1.0], [20.5, 3.0], [40.0, -2.0]];
        let b = vec![[500.0, 500.0], [510.0, 520.0]];
        let collection = r#"{ "type": "FeatureCollection", "features": [
            { "type": "Feature", "properties": { "name": "north" }, "geometry":
              { "type": "LineString", "coordinates": [[0, 1, 80.5], [20.5, 3], [40, -2]] } },
            { "type": "Feature", "geometry": null },
            { "type": "GeometryCollection", "geometries": [
              { "type": "MultiLineString", "coordinates": [[[500, 500], [510, 520]]] } ] } ] }"#;
        assert_eq!(read(collection), Ok(vec![a.clone(), b.clone()]));
        let table = "trail,x,y\nnorth,0,1\nnorth,20.5,3\nnorth,40,-2\nb,500,500\nb,510,520\n";
        assert_eq!(read(table), Ok(vec![a.clone(), b]));
        assert_eq!(read("x_m;y_m\n0;1\n20,5;3\n40;-2\n"), Ok(vec![a]));
    }

    #[test]
    fn the_member_crs_says_which_coordinates_they_are() {
        let epsg = |crs: &str| {
            let text = format!(
                r#"{{ "type": "FeatureCollection", "name": "trails", "crs": {crs}, "features": [
                {{ "type": "Feature", "geometry": {{ "type": "LineString",
                   "coordinates": [[553200, 4450300], [553250, 4450310]] }} }}] }}"#
            );
            read_trail_lines(text.as_bytes()).expect("lines").epsg
        };
        let named = |name: &str| {
            epsg(&format!(
                r#"{{"type":"name","properties":{{"name":"{name}"}}}}"#
            ))
        };
        assert_eq!(named("urn:ogc:def:crs:EPSG::25829"), Some(25_829));
        assert_eq!(named("EPSG:32629"), Some(32_629));
        for crs in [
            "null",
            "7",
            "[]",
            r#"{"type":"name","properties":{"name":25829}}"#,
        ] {
            assert_eq!(epsg(crs), None, "{crs}");
        }
        let table = read_trail_lines(b"x,y\n0,0\n30,40\n").expect("a line");
        assert_eq!(table.epsg, None);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let refused = |text: &str| read(text).expect_err(text);
        assert!(refused("{").contains("no GeoJSON"));
        assert!(refused("{}").contains("must be LineString"));
        assert!(refused(r#"{"type":"Point","coordinates":[1,2]}"#).contains("Point"));
        assert!(refused(r#"{"type":"LineString"}"#).contains("without `coordinates`"));
        let wrong = r#"{"type":"LineString","coordinates":[[1,2],[3]]}"#;
        assert!(refused(wrong).contains("[3]"));
        let short = r#"{"type":"LineString","coordinates":[[1,2]]}"#;
        assert!(refused(short).contains("has 1 of at least 2 vertices"));
        let empty = short.replace("[[1,2]]", "[]");
        assert!(refused(&empty).contains("has 0 of at least 2 vertices"));
        let degrees = r#"{"type":"LineString","coordinates":[[-8.4,40.2],[-8.401,40.201]]}"#;
        assert!(refused(degrees).contains("degrees"));
        let long = r#"{"type":"LineString","coordinates":[[0,0],[9e6,0]]}"#;
        assert!(refused(long).contains("has 9000000 m of lines: at most 500000"));
        let together = "trail,x,y\na,0,0\na,0,300000\nb,0,0\nb,0,300000\n";
        assert!(refused(together).contains("has 600000 m of lines"));
        assert!(refused("x,y\n").contains("has no line"));
        assert!(refused("x,y\n1,2\n1,\n").contains("line 3: y is missing"));
    }
}
