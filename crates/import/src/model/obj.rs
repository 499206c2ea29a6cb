//! Wavefront OBJ, with the materials of MTL files.

use std::collections::BTreeSet;

use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use tobj::{LoadError, LoadOptions};

use super::bundle::ModelFiles;
use super::picture::Picture;
use super::raw::{Alpha, RawMaterial, RawModel, RawPart};
use super::{MAX_MATERIALS, MAX_PICTURE_PIXELS, MAX_PICTURES, MAX_TRIANGLES};
use crate::ImportError;
use crate::error::shown;

/// The most bytes of a file of materials.
const MAX_MTL_BYTES: usize = 1 << 20;
/// The most objects, groups and changes of the material.
const MAX_GROUPS: usize = 20_000;

/// The rests of the lines of a text that start with a word.
fn rests<'a>(bytes: &'a [u8], word: &'a str) -> impl Iterator<Item = &'a [u8]> {
    bytes.split(|&b| b == b'\n').filter_map(move |line| {
        let rest = line.trim_ascii().strip_prefix(word.as_bytes())?;
        rest.first()
            .is_some_and(u8::is_ascii_whitespace)
            .then(|| rest.trim_ascii())
    })
}

fn text<'a>(bytes: &'a [u8], what: &str) -> Result<&'a str, ImportError> {
    std::str::from_utf8(bytes).map_err(|_| ImportError::file(format!("{what} is not UTF-8 text")))
}

/// A relative path as a file has it, whose folders Windows may have told apart.
fn path(bytes: &[u8], what: &str) -> Result<String, ImportError> {
    let path = text(bytes, what)?.replace('\\', "/");
    Ok(path.strip_prefix("./").unwrap_or(&path).to_owned())
}

/// The names of the files that a file needs, as far as they are there.
pub(super) fn names(files: &ModelFiles) -> Result<Vec<String>, ImportError> {
    let mut names = BTreeSet::new();
    for library in libraries(files.bytes())? {
        if let Ok(materials) = files.get(&library) {
            for material in materials_of(materials, &library)? {
                names.extend(material.diffuse_texture.map(|p| near(&library, &p)));
                names.extend(material.dissolve_texture.map(|p| near(&library, &p)));
            }
        }
        names.insert(library);
    }
    Ok(names.into_iter().collect())
}

fn libraries(obj: &[u8]) -> Result<Vec<String>, ImportError> {
    let libraries: Vec<String> = rests(obj, "mtllib")
        .take(MAX_MATERIALS)
        .map(|rest| path(rest, "the name after mtllib"))
        .collect::<Result<_, _>>()?;
    Ok(libraries)
}

/// A picture's path, which is relative to that of the file of materials.
fn near(library: &str, picture: &str) -> String {
    let picture = picture.trim().replace('\\', "/");
    let picture = picture.strip_prefix("./").unwrap_or(&picture);
    match library.rsplit_once('/') {
        Some((folder, _)) => format!("{folder}/{picture}"),
        None => picture.to_owned(),
    }
}

fn materials_of(mtl: &[u8], name: &str) -> Result<Vec<tobj::Material>, ImportError> {
    let wrong = |why: &str| ImportError::file(format!("materials {}: {why}", shown(name)));
    if mtl.len() > MAX_MTL_BYTES || rests(mtl, "newmtl").count() > MAX_MATERIALS {
        let most = format!("at most {MAX_MATERIALS} materials in 1 MiB are read");
        return Err(wrong(&most));
    }
    let (materials, _) =
        tobj::load_mtl_buf(&mut &*mtl).map_err(|e| wrong(&shown(&e.to_string())))?;
    Ok(materials)
}

/// Reads a file.
pub(super) fn read(files: &ModelFiles) -> Result<RawModel, ImportError> {
    let bytes = files.bytes();
    let faces = check_size(bytes)?;
    let mut model = RawModel::default();
    let mut left = MAX_PICTURE_PIXELS;
    let mut pictures: Vec<String> = Vec::new();
    for library in libraries(bytes)? {
        for material in materials_of(files.get(&library)?, &library)? {
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
            let material = read_material(&material, &mut model, &mut number)?;
            model.materials.push(material);
        }
    }
    if model.materials.len() > MAX_MATERIALS {
        let reason = format!("has more than {MAX_MATERIALS} materials");
        return Err(ImportError::file(reason));
    }
    let options = LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    // Materials were read already; here only their order counts.
    let known = |library: &std::path::Path| {
        let library = library.to_str().unwrap_or_default().replace('\\', "/");
        let library = library.strip_prefix("./").unwrap_or(&library);
        let bytes = files.get(library).map_err(|_| LoadError::OpenFileFailed)?;
        tobj::load_mtl_buf(&mut &*bytes)
    };
    let (objects, materials) = tobj::load_obj_buf(&mut &*bytes, &options, known)
        .map_err(|e| ImportError::file(format!("is no OBJ: {}", shown(&e.to_string()))))?;
    let materials = match materials {
        Ok(materials) => materials,
        Err(_) if libraries(bytes)?.is_empty() => Vec::new(),
        Err(e) => {
            let reason = format!("its materials cannot be read: {}", shown(&e.to_string()));
            return Err(ImportError::file(reason));
        }
    };
    if materials.len() != model.materials.len() {
        return Err(ImportError::file(
            "names a file of materials in an unknown way",
        ));
    }
    let mut plain = None;
    for tobj::Model { mesh, name } in objects {
        let material = mesh.material_id.filter(|&i| i < materials.len());
        let material = material.unwrap_or_else(|| {
            *plain.get_or_insert_with(|| {
                model.materials.push(RawMaterial::plain(""));
                model.materials.len() - 1
            })
        });
        let part = part(mesh, name, material)?;
        if !part.triangles.is_empty() {
            model.parts.push(part);
        }
    }
    let triangles = model.parts.iter().map(|p| p.triangles.len()).sum();
    let vertices = model.parts.iter().map(|p| p.positions.len()).sum();
    super::check_size(triangles, vertices)?;
    if faces == 0 {
        return Err(ImportError::file(
            "has no faces: it is no OBJ, or has points alone",
        ));
    }
    Ok(model)
}

/// Bounds what a reader would have to keep, and counts faces.
fn check_size(obj: &[u8]) -> Result<usize, ImportError> {
    let (mut groups, mut faces) = (0, 0);
    for line in obj.split(|&b| b == b'\n') {
        let line = line.trim_ascii_start();
        let word = line.split(u8::is_ascii_whitespace).next();
        match word {
            Some(b"o" | b"g" | b"usemtl" | b"mtllib") => groups += 1,
            Some(b"f") => faces += 1,
            _ => {}
        }
    }
    if groups > MAX_GROUPS {
        return Err(ImportError::file(format!(
            "has {groups} objects, groups and changes of the material: at most {MAX_GROUPS} are \
             read"
        )));
    }
    if faces > MAX_TRIANGLES {
        return Err(ImportError::file(format!(
            "has {faces} faces: at most {MAX_TRIANGLES} triangles are read"
        )));
    }
    Ok(faces)
}

fn read_material(
    material: &tobj::Material,
    model: &mut RawModel,
    number: &mut dyn FnMut(&str, &mut RawModel) -> Result<usize, ImportError>,
) -> Result<RawMaterial, ImportError> {
    let name = &material.name;
    let picture = match &material.diffuse_texture {
        Some(picture) => Some(number(picture, model)?),
        None => None,
    };
    let holes = match &material.dissolve_texture {
        Some(picture) => Some(number(picture, model)?),
        None => None,
    };
    let is_seen = material.dissolve.is_none_or(|d| d >= 0.5);
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
    // Beside a picture, colours are often left at grey or black by mistake.
    let colour = match (picture, material.diffuse) {
        (Some(_), _) => Vec3::ONE,
        (None, Some(colour)) => Vec3::from_array(colour.map(|c| {
            if c.is_finite() {
                c.clamp(0.0, 1.0)
            } else {
                0.0
            }
        })),
        (None, None) => Vec3::splat(0.5),
    };
    Ok(RawMaterial {
        colour,
        picture,
        alpha,
        ..RawMaterial::plain(name)
    })
}

fn part(mesh: tobj::Mesh, name: String, material: usize) -> Result<RawPart, ImportError> {
    let vector = |p: &[f32]| DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
    let positions: Vec<DVec3> = mesh.positions.chunks_exact(3).map(vector).collect();
    let normals: Vec<DVec3> = mesh.normals.chunks_exact(3).map(vector).collect();
    // Row 0 of a picture is at the top, where OBJ has v = 1.
    let place = |t: &[f32]| DVec2::new(f64::from(t[0]), 1.0 - f64::from(t[1]));
    let uvs: Vec<DVec2> = mesh.texcoords.chunks_exact(2).map(place).collect();
    let triangles: Vec<[u32; 3]> = mesh
        .indices
        .chunks_exact(3)
        .map(|t| [t[0], t[1], t[2]])
        .collect();
    let as_long = |n: usize| n == 0 || n == positions.len();
    let count = positions.len() as u32;
    if !as_long(normals.len()) || !as_long(uvs.len()) {
        return Err(ImportError::file(format!(
            "object {}: some of its faces have texture coordinates or normals, and some have not",
            shown(&name)
        )));
    }
    if triangles.iter().flatten().any(|&i| i >= count) {
        return Err(ImportError::file("a face has a vertex that does not exist"));
    }
    Ok(RawPart {
        names: vec![name],
        material,
        positions,
        normals,
        uvs,
        triangles,
    })
}
