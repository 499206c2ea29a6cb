//! Wavefront OBJ: polygons, by object, group and material.
//!
//! The crate tobj panics on some malformed lines and keeps lists without bounds, so files of
//! strangers are read here.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use nemoral_scene::glam::{DVec2, DVec3, Vec3};

use super::model_files::ModelFiles;
use super::mtl::{self, Mtl, split};
use super::picture::Picture;
use super::raw::{Alpha, RawMaterial, RawModel, RawPart, cut};
use super::{MAX_MATERIALS, MAX_PARTS, MAX_PICTURE_PIXELS, MAX_PICTURES, MAX_TRIANGLES};
use crate::ImportError;
use crate::error::shown;

/// The most positions, texture coordinates and normals, of each.
const MAX_LIST: usize = 3 * MAX_TRIANGLES;

/// The lines of a file.
fn lines(bytes: &[u8]) -> impl Iterator<Item = std::borrow::Cow<'_, str>> {
    bytes
        .split(|&b| b == b'\n')
        .map(|line| String::from_utf8_lossy(line))
}

/// A relative path as a file has it, whose folders Windows may have told apart.
fn path(text: &str) -> String {
    let path = text.trim().replace('\\', "/");
    path.strip_prefix("./").unwrap_or(&path).to_owned()
}

/// The names of the files that a file needs, as far as they are there.
pub(super) fn names(files: &ModelFiles) -> Result<Vec<String>, ImportError> {
    let mut names = BTreeSet::new();
    for library in libraries(files.bytes())? {
        if let Ok(materials) = files.get(&library) {
            for material in mtl::read(materials, &library)? {
                names.extend(material.picture.map(|p| near(&library, &p)));
                names.extend(material.holes.map(|p| near(&library, &p)));
            }
        }
        names.insert(library);
    }
    Ok(names.into_iter().collect())
}

/// The files of materials that a file names, each once.
fn libraries(obj: &[u8]) -> Result<Vec<String>, ImportError> {
    let mut libraries = Vec::new();
    for line in lines(obj) {
        let (word, rest) = split(&line);
        if word != "mtllib" {
            continue;
        }
        let library = path(rest);
        if !libraries.contains(&library) {
            if libraries.len() == MAX_MATERIALS {
                let reason = format!("names more than {MAX_MATERIALS} files of materials");
                return Err(ImportError::file(reason));
            }
            libraries.push(library);
        }
    }
    Ok(libraries)
}

/// A picture's path, which is relative to that of the file of materials.
fn near(library: &str, picture: &str) -> String {
    let picture = path(picture);
    match library.rsplit_once('/') {
        Some((folder, _)) => format!("{folder}/{picture}"),
        None => picture,
    }
}

/// Reads a file.
pub(super) fn read(files: &ModelFiles) -> Result<RawModel, ImportError> {
    let mut reader = Reader::default();
    reader.materials(files)?;
    for (i, line) in lines(files.bytes()).enumerate() {
        (reader.line(&line)).map_err(|why| ImportError::file(format!("line {}: {why}", i + 1)))?;
    }
    if reader.triangles == 0 {
        return Err(ImportError::file(
            "has no faces: it is no OBJ, or has points alone",
        ));
    }
    reader.model.parts = reader.parts.into_iter().map(|part| part.raw).collect();
    Ok(reader.model)
}

#[derive(Default)]
struct Reader {
    positions: Vec<DVec3>,
    uvs: Vec<DVec2>,
    normals: Vec<DVec3>,
    object: Arc<str>,
    group: Arc<str>,
    material: Option<usize>,
    triangles: usize,
    vertices: usize,
    parts: Vec<Part>,
    known: HashMap<PartKey, usize>,
    model: RawModel,
}

/// Object, group, material, and whether faces have texture coordinates and normals.
type PartKey = (Arc<str>, Arc<str>, usize, [bool; 2]);

/// A corner's numbers of position, texture coordinates and normal, from 0.
type Corner = (u32, Option<u32>, Option<u32>);

struct Part {
    raw: RawPart,
    known: HashMap<Corner, u32>,
}

impl Reader {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let (word, rest) = split(line);
        let three = || numbers::<3>(rest).map(DVec3::from_array);
        match word {
            "v" => add(&mut self.positions, three()?),
            "vn" => add(&mut self.normals, three()?),
            "vt" => {
                // Row 0 of a picture is at the top, where OBJ has v = 1.
                let [u, v] = match split(rest).1 {
                    "" => [numbers::<1>(rest)?[0], 0.0],
                    _ => numbers::<2>(rest)?,
                };
                add(&mut self.uvs, DVec2::new(u, 1.0 - v))
            }
            "o" => {
                self.object = cut(rest);
                Ok(())
            }
            "g" => {
                self.group = cut(rest);
                Ok(())
            }
            "usemtl" => self.use_material(rest),
            "f" => self.face(rest),
            _ => Ok(()),
        }
    }

    fn use_material(&mut self, name: &str) -> Result<(), String> {
        let materials = &mut self.model.materials;
        let number = materials.iter().position(|m| m.name == name);
        self.material = Some(match number {
            Some(number) => number,
            None if materials.len() >= MAX_MATERIALS => {
                return Err(format!("more than {MAX_MATERIALS} materials"));
            }
            None => {
                materials.push(RawMaterial::plain(name));
                let number = materials.len() - 1;
                if !name.is_empty() {
                    let name = shown(name);
                    self.model.note(format!(
                        "material {name} is in no file of materials: it is grey"
                    ));
                }
                number
            }
        });
        Ok(())
    }

    /// A polygon, as a fan of triangles.
    fn face(&mut self, text: &str) -> Result<(), String> {
        if self.material.is_none() {
            self.use_material("")?;
        }
        let mut corners = text.split_whitespace().map(|word| self.corner(word));
        let mut next = || corners.next().transpose();
        let (Some(first), Some(mut last)) = (next()?, next()?) else {
            return Err("a face has less than three corners".to_owned());
        };
        let mut fan = Vec::new();
        while let Some(corner) = next()? {
            if self.triangles + fan.len() == MAX_TRIANGLES {
                return Err(format!("more than {MAX_TRIANGLES} triangles"));
            }
            fan.push([first, last, corner]);
            last = corner;
        }
        if fan.is_empty() {
            return Err("a face has less than three corners".to_owned());
        }
        self.triangles += fan.len();
        let has = |c: Corner| [c.1.is_some(), c.2.is_some()];
        if fan.iter().flatten().any(|&c| has(c) != has(first)) {
            return Err("a face has corners of different kinds".to_owned());
        }
        let part = self.part(has(first))?;
        for triangle in fan {
            let mut numbers = [0; 3];
            for (number, corner) in numbers.iter_mut().zip(triangle) {
                *number = self.vertex(part, corner)?;
            }
            self.parts[part].raw.triangles.push(numbers);
        }
        Ok(())
    }

    /// The numbers of a corner, `1`, `1/2`, `1//3` or `1/2/3`; negative ones count from the last.
    fn corner(&self, word: &str) -> Result<Corner, String> {
        let number = |text: &str, count: usize, of: &str| {
            let number: i64 =
                (text.parse()).map_err(|_| format!("{} is no corner", shown(word)))?;
            let index = if number < 0 {
                count as i64 + number.max(-(1 << 32))
            } else {
                number - 1
            };
            if (0..count as i64).contains(&index) {
                Ok(index as u32)
            } else {
                Err(format!("{} of {count} {of} is none", shown(text)))
            }
        };
        let mut words = word.split('/');
        let position = words.next().unwrap_or_default();
        let position = number(position, self.positions.len(), "positions")?;
        let mut further = |count: usize, of: &str| match words.next() {
            None | Some("") => Ok(None),
            Some(text) => number(text, count, of).map(Some),
        };
        let uv = further(self.uvs.len(), "texture coordinates")?;
        let normal = further(self.normals.len(), "normals")?;
        Ok((position, uv, normal))
    }

    /// The number of the part that the present face belongs to.
    fn part(&mut self, has: [bool; 2]) -> Result<usize, String> {
        let material = self.material.unwrap_or_default();
        let key = (
            Arc::clone(&self.object),
            Arc::clone(&self.group),
            material,
            has,
        );
        if let Some(&part) = self.known.get(&key) {
            return Ok(part);
        }
        if self.parts.len() == MAX_PARTS {
            return Err(format!(
                "more than {MAX_PARTS} parts of other objects, groups or materials"
            ));
        }
        let names = [&self.group, &self.object].into_iter();
        self.parts.push(Part {
            raw: RawPart {
                names: names.filter(|n| !n.is_empty()).cloned().collect(),
                material,
                positions: Vec::new(),
                normals: Vec::new(),
                uvs: Vec::new(),
                triangles: Vec::new(),
            },
            known: HashMap::new(),
        });
        self.known.insert(key, self.parts.len() - 1);
        Ok(self.parts.len() - 1)
    }

    /// The number of a corner's vertex in a part.
    fn vertex(&mut self, part: usize, corner: Corner) -> Result<u32, String> {
        let part = &mut self.parts[part];
        if let Some(&vertex) = part.known.get(&corner) {
            return Ok(vertex);
        }
        if self.vertices == MAX_LIST {
            return Err(format!("more than {MAX_LIST} vertices"));
        }
        self.vertices += 1;
        let (position, uv, normal) = corner;
        let raw = &mut part.raw;
        raw.positions.push(self.positions[position as usize]);
        raw.uvs.extend(uv.map(|i| self.uvs[i as usize]));
        raw.normals.extend(normal.map(|i| self.normals[i as usize]));
        let vertex = raw.positions.len() as u32 - 1;
        part.known.insert(corner, vertex);
        Ok(vertex)
    }

    /// The materials of all files of materials.
    fn materials(&mut self, files: &ModelFiles) -> Result<(), ImportError> {
        let mut left = MAX_PICTURE_PIXELS;
        let mut pictures: Vec<String> = Vec::new();
        for library in libraries(files.bytes())? {
            for material in mtl::read(files.get(&library)?, &library)? {
                if self.model.materials.iter().any(|m| m.name == material.name) {
                    continue;
                }
                if self.model.materials.len() == MAX_MATERIALS {
                    let reason = format!("has more than {MAX_MATERIALS} materials");
                    return Err(ImportError::file(reason));
                }
                let mut number = |picture: &str, model: &mut RawModel| {
                    let name = near(&library, picture);
                    if let Some(known) = pictures.iter().position(|p| *p == name) {
                        return Ok(known);
                    }
                    if pictures.len() == MAX_PICTURES {
                        let reason = format!("has more than {MAX_PICTURES} pictures");
                        return Err(ImportError::file(reason));
                    }
                    let picture = Picture::read(files.get(&name)?, &name, &mut left)?;
                    model.pictures.push(picture);
                    pictures.push(name);
                    Ok(pictures.len() - 1)
                };
                let material = read_material(&material, &mut self.model, &mut number)?;
                self.model.materials.push(material);
            }
        }
        Ok(())
    }
}

fn add<T>(list: &mut Vec<T>, item: T) -> Result<(), String> {
    if list.len() == MAX_LIST {
        return Err(format!(
            "more than {MAX_LIST} positions, normals or texture coordinates"
        ));
    }
    list.push(item);
    Ok(())
}

/// The first numbers of a text. They are kept as accurate as other formats have them.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let mut numbers = [0.0; N];
    let mut words = text.split_whitespace();
    for number in &mut numbers {
        let word = words.next().map(str::parse::<f32>);
        let Some(Ok(found)) = word else {
            return Err(format!("{}: must be {N} numbers", shown(text)));
        };
        *number = f64::from(found);
    }
    Ok(numbers)
}

fn read_material(
    material: &Mtl,
    model: &mut RawModel,
    number: &mut dyn FnMut(&str, &mut RawModel) -> Result<usize, ImportError>,
) -> Result<RawMaterial, ImportError> {
    let name = &material.name;
    let picture = match &material.picture {
        Some(picture) => Some(number(picture, model)?),
        None => None,
    };
    let holes = match &material.holes {
        Some(picture) => Some(number(picture, model)?),
        None => None,
    };
    let is_seen = material.opacity.is_none_or(|d| d >= 0.5);
    if !is_seen {
        let name = shown(name);
        model.note(format!(
            "material {name} is less than half opaque, and is left out"
        ));
    }
    let alpha = match (picture, holes) {
        _ if !is_seen => Alpha::Nowhere,
        // The usual picture of both: alpha says where, not its colours.
        (Some(colour), Some(holes)) if colour == holes => Alpha::From(127.5),
        (_, Some(holes)) => Alpha::White(holes),
        (Some(picture), None) if model.pictures[picture].has_holes() => {
            model.note(format!(
                "material {}: its picture has transparent pixels, and cuts it out",
                shown(name)
            ));
            Alpha::From(127.5)
        }
        _ => Alpha::Everywhere,
    };
    let channel = |c: f32| {
        if c.is_finite() {
            c.clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    // Beside a picture, colours are often left at grey or black by mistake.
    let colour = match (picture, material.diffuse) {
        (Some(_), _) => Vec3::ONE,
        (None, Some(colour)) => Vec3::from_array(colour.map(channel)),
        (None, None) => Vec3::splat(0.5),
    };
    Ok(RawMaterial {
        colour,
        picture,
        alpha,
        ..RawMaterial::plain(name)
    })
}
