//! glTF 2.0, as JSON or binary.

use std::sync::Arc;

use nemoral_scene::excerpt;
use nemoral_scene::glam::{DMat2, DMat3, DMat4, DQuat, DVec2, DVec3, Vec3};

use super::buffers::{Buffers, content, decoded, item};
use super::gltf_material;
use super::json::{Document, Image, Material, Node, Primitive, TextureTransform};
use super::model_files::{GLB_MAGIC, ModelFiles};
use super::picture::Picture;
use super::raw::{RawMaterial, RawModel, RawPart, cut};
use super::{MAX_DEPTH, MAX_PARTS, MAX_PICTURE_PIXELS, MAX_TRIANGLES};
use crate::ImportError;
use crate::error::shown;

/// What a file may require of its readers.
const UNDERSTOOD: [&str; 3] = [
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_materials_unlit",
];

/// The JSON of a file, and its binary part.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ImportError> {
    let Some(rest) = bytes.strip_prefix(GLB_MAGIC) else {
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None));
    };
    let wrong = |what: &str| ImportError::file(format!("is no GLB file: {what}"));
    let word = |bytes: &[u8]| bytes.first_chunk().copied().map(u32::from_le_bytes);
    let version = word(rest).ok_or_else(|| wrong("its header is cut off"))?;
    if version != 2 {
        return Err(wrong(&format!("its version is {version}, and must be 2")));
    }
    let mut rest = rest
        .get(8..)
        .ok_or_else(|| wrong("its header is cut off"))?;
    let mut chunk = |kind: &[u8; 4]| -> Option<&[u8]> {
        let size = word(rest)? as usize;
        let of = rest.get(4..8)?;
        let content = rest.get(8..)?.get(..size)?;
        rest = &rest[8 + size..];
        (of == kind).then_some(content)
    };
    let json = chunk(b"JSON").ok_or_else(|| wrong("its JSON chunk is missing or cut off"))?;
    Ok((json, chunk(b"BIN\0")))
}

fn parse(json: &[u8]) -> Result<Document, ImportError> {
    let document: Document = serde_json::from_slice(json)
        .map_err(|e| ImportError::file(format!("is no glTF: {}", excerpt(&e.to_string(), 200))))?;
    let version = &document.asset.version;
    if !version.starts_with("2.") {
        let reason = format!("is glTF {}, and must be 2.0", shown(version));
        return Err(ImportError::file(reason));
    }
    let unknown = document
        .extensions_required
        .iter()
        .find(|name| !UNDERSTOOD.contains(&name.as_str()));
    if let Some(name) = unknown {
        return Err(ImportError::file(format!(
            "requires the extension {}, which is not read: export it without compression and \
             instancing",
            shown(name)
        )));
    }
    Ok(document)
}

/// The names of the files that a file needs.
pub(super) fn names(bytes: &[u8]) -> Result<Vec<String>, ImportError> {
    let document = parse(chunks(bytes)?.0)?;
    let buffers = document.buffers.iter().filter_map(|b| b.uri.as_deref());
    let used = used_images(&document);
    let images = (document.images.iter().zip(used))
        .filter(|(_, used)| *used)
        .filter_map(|(image, _)| image.uri.as_deref());
    let outside = buffers
        .chain(images)
        .filter(|uri| !uri.starts_with("data:"));
    outside.map(decoded).collect()
}

/// Which images are colours of materials: nothing else is read.
fn used_images(document: &Document) -> Vec<bool> {
    let mut used = vec![false; document.images.len()];
    for material in document.materials.iter() {
        if let Some(image) = image_of(document, material)
            && let Some(used) = used.get_mut(image as usize)
        {
            *used = true;
        }
    }
    used
}

fn image_of(document: &Document, material: &Material) -> Option<u32> {
    let colour = material
        .pbr_metallic_roughness
        .base_color_texture
        .as_ref()?;
    document.textures.get(colour.index as usize)?.source
}

/// Reads a file. Its up is +y, its unit the metre.
pub(super) fn read(files: &ModelFiles) -> Result<RawModel, ImportError> {
    let (json, binary) = chunks(files.bytes())?;
    let document = parse(json)?;
    let buffers = Buffers::new(&document, binary, files)?;
    let mut model = RawModel::default();
    let mut left = MAX_PICTURE_PIXELS;
    let mut places = Vec::new();
    for (i, (image, used)) in document
        .images
        .iter()
        .zip(used_images(&document))
        .enumerate()
    {
        places.push(used.then_some(model.pictures.len()));
        if used {
            let picture = picture(image, i, &buffers, files, &mut left)?;
            model.pictures.push(picture);
        }
    }
    for material in document.materials.iter() {
        let material = gltf_material::read(&document, material, &places, &mut model)?;
        model.materials.push(material);
    }
    let mut reader = Reader {
        document: &document,
        buffers: &buffers,
        seen: vec![false; document.nodes.len()],
        names: Vec::new(),
        primitives: 0,
        triangles: 0,
        vertices: 0,
        model,
    };
    let mut is_child = vec![false; document.nodes.len()];
    for &child in document.nodes.iter().flat_map(|of| of.children.iter()) {
        if let Some(is_child) = is_child.get_mut(child as usize) {
            *is_child = true;
        }
    }
    let roots: Vec<u32> = match (document.scene, document.scenes.first()) {
        (Some(scene), _) => item(&document.scenes, scene, "scenes")?.nodes.to_vec(),
        (None, Some(first)) => first.nodes.to_vec(),
        (None, None) => (0..document.nodes.len() as u32)
            .filter(|&n| !is_child[n as usize])
            .collect(),
    };
    if document.scenes.len() > 1 {
        reader.model.note("only one of its scenes is read");
    }
    for root in roots {
        reader.node(root, DMat4::IDENTITY, 0)?;
    }
    Ok(reader.model)
}

fn picture(
    image: &Image,
    number: usize,
    buffers: &Buffers<'_>,
    files: &ModelFiles,
    left: &mut u64,
) -> Result<Picture, ImportError> {
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => {
            let name = if uri.starts_with("data:") {
                "in a data URI"
            } else {
                uri
            };
            Picture::read(&content(uri, files)?, name, left)
        }
        (None, Some(view)) => {
            Picture::read(buffers.view(view)?.0, &format!("images[{number}]"), left)
        }
        (None, None) => Err(ImportError::file(format!("images[{number}] is nowhere"))),
    }
}

/// Walks through the nodes of a document.
struct Reader<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    seen: Vec<bool>,
    /// Of the nodes from the root to the present one.
    names: Vec<Arc<str>>,
    primitives: usize,
    triangles: usize,
    vertices: usize,
    model: RawModel,
}

impl<'a> Reader<'a> {
    fn node(&mut self, number: u32, parent: DMat4, depth: usize) -> Result<(), ImportError> {
        let node: &'a Node = item(&self.document.nodes, number, "nodes")?;
        if depth == MAX_DEPTH {
            let reason = format!("its nodes are nested deeper than {MAX_DEPTH}");
            return Err(ImportError::file(reason));
        }
        if std::mem::replace(&mut self.seen[number as usize], true) {
            let reason = format!("nodes[{number}] is in the scene twice, and must be once");
            return Err(ImportError::file(reason));
        }
        if node.extensions.instancing.is_some() {
            return Err(ImportError::file(format!(
                "nodes[{number}] has instances (EXT_mesh_gpu_instancing), which are not read: \
                 export each as a node"
            )));
        }
        if node.skin.is_some() {
            self.model.note("it has skins, which are left out");
        }
        let matrix = parent * local(node);
        if !matrix.is_finite() {
            let reason = format!("nodes[{number}] has a transform that is not finite");
            return Err(ImportError::file(reason));
        }
        self.names.push(cut(&node.name));
        if let Some(mesh) = node.mesh {
            let mesh = item(&self.document.meshes, mesh, "meshes")?;
            self.names.push(cut(&mesh.name));
            for primitive in mesh.primitives.iter() {
                self.primitive(primitive, matrix)?;
            }
            self.names.pop();
        }
        for &child in node.children.iter() {
            self.node(child, matrix, depth + 1)?;
        }
        self.names.pop();
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, matrix: DMat4) -> Result<(), ImportError> {
        self.primitives += 1;
        if self.primitives > MAX_PARTS {
            let reason = format!("its nodes have more than {MAX_PARTS} primitives altogether");
            return Err(ImportError::file(reason));
        }
        let of = &primitive.attributes;
        let position = match (of.position, primitive.mode.unwrap_or(4)) {
            (Some(position), 4..=6) => position,
            _ => {
                self.model
                    .note("points, lines and what has no positions are left out");
                return Ok(());
            }
        };
        if of.color_0.is_some() {
            self.model.note("colours of vertices are left out");
        }
        let vertices = self.buffers.count(position)?;
        let corners = match primitive.indices {
            Some(indices) => self.buffers.count(indices)?,
            None => vertices,
        };
        let is_list = primitive.mode.unwrap_or(4) == 4;
        self.triangles += if is_list { corners / 3 } else { corners };
        self.vertices += vertices;
        super::check_size(self.triangles, self.vertices)?;
        let positions = self.buffers.vectors::<3>(position, "VEC3")?;
        let normals = match of.normal {
            Some(normal) => self.buffers.vectors::<3>(normal, "VEC3")?,
            None => Vec::new(),
        };
        let material = primitive.material;
        let material = match material {
            Some(number) => {
                item(&self.document.materials, number, "materials")?;
                number as usize
            }
            None => self.without_material(),
        };
        let (uvs, transform) = self.uvs(primitive)?;
        let as_long = |n: usize| n == 0 || n == positions.len();
        if !as_long(normals.len()) || !as_long(uvs.len()) {
            let reason = "a mesh has other numbers of positions, normals and texture coordinates";
            return Err(ImportError::file(reason));
        }
        let indices = match primitive.indices {
            Some(indices) => self.buffers.indices(indices)?,
            None => (0..positions.len() as u32).collect(),
        };
        let mut triangles = triangles(&indices, primitive.mode.unwrap_or(4));
        if let Some(&index) = triangles
            .iter()
            .flatten()
            .find(|&&i| i as usize >= vertices)
        {
            let reason = format!("a mesh has the index {index} and {vertices} vertices");
            return Err(ImportError::file(reason));
        }
        if triangles.is_empty() {
            return Ok(());
        }
        let linear = DMat3::from_mat4(matrix);
        if linear.determinant() < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        // Cofactors turn normals right under any map, even one that flattens.
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        ) * linear.determinant().signum();
        let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        let names = self.names.iter().rev().filter(|name| !name.is_empty());
        self.model.parts.push(RawPart {
            names: names.cloned().collect(),
            material,
            positions: positions
                .into_iter()
                .map(|p| matrix.transform_point3(vector(p)))
                .collect(),
            normals: normals.into_iter().map(|n| cofactors * vector(n)).collect(),
            uvs: uvs
                .into_iter()
                .map(|uv| transformed(uv, transform))
                .collect(),
            triangles,
        });
        Ok(())
    }

    fn without_material(&mut self) -> usize {
        let own = self.document.materials.len();
        if self.model.materials.len() == own {
            self.model.materials.push(RawMaterial {
                colour: Vec3::ONE,
                ..RawMaterial::plain("")
            });
        }
        own
    }

    /// The texture coordinates of the material's picture, and their transform.
    fn uvs(
        &self,
        primitive: &Primitive,
    ) -> Result<(Vec<[f32; 2]>, Option<&'a TextureTransform>), ImportError> {
        let material = (primitive.material)
            .and_then(|material| self.document.materials.get(material as usize));
        let colour = material.and_then(|m| m.pbr_metallic_roughness.base_color_texture.as_ref());
        let transform = colour.and_then(|c| c.extensions.transform.as_ref());
        let set = transform.and_then(|t| t.tex_coord);
        let set = set.or(colour.map(|c| c.tex_coord)).unwrap_or(0);
        let accessor = match set {
            0 => primitive.attributes.texcoord_0,
            1 => primitive.attributes.texcoord_1,
            _ => {
                let reason = format!("a material uses TEXCOORD_{set}: only 0 and 1 are read");
                return Err(ImportError::file(reason));
            }
        };
        match accessor {
            Some(accessor) => Ok((self.buffers.vectors::<2>(accessor, "VEC2")?, transform)),
            None => Ok((Vec::new(), None)),
        }
    }
}

/// The transform of a node. Quarter turns are exact, so that what was turned there and back is the
/// same to the bit.
fn local(node: &Node) -> DMat4 {
    let exact = |m: f64| {
        let whole = m.round();
        if (m - whole).abs() < 1e-12 { whole } else { m }
    };
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(&matrix.map(exact));
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let rotation = DMat3::from_quat(rotation.normalize())
        .to_cols_array()
        .map(exact);
    let scale = DVec3::from_array(node.scale.unwrap_or([1.0; 3]));
    let linear = DMat3::from_cols_array(&rotation) * DMat3::from_diagonal(scale);
    let translation = DVec3::from_array(node.translation.unwrap_or([0.0; 3]));
    DMat4::from_mat3_translation(linear, translation)
}

/// The triangles of a list, a strip or a fan.
fn triangles(indices: &[u32], mode: u32) -> Vec<[u32; 3]> {
    match mode {
        5 => (indices.windows(3).enumerate())
            .map(|(i, t)| {
                if i % 2 == 0 {
                    [t[0], t[1], t[2]]
                } else {
                    [t[1], t[0], t[2]]
                }
            })
            .collect(),
        6 => indices
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|edge| [indices[0], edge[0], edge[1]])
            .collect(),
        _ => indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]])
            .collect(),
    }
}

fn transformed(uv: [f32; 2], transform: Option<&TextureTransform>) -> DVec2 {
    let uv = DVec2::from_array(uv.map(f64::from));
    let Some(transform) = transform else {
        return uv;
    };
    let scaled = uv * DVec2::from_array(transform.scale.unwrap_or([1.0; 2]));
    let (sin, cos) = libm::sincos(transform.rotation.unwrap_or(0.0));
    let turn = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    turn * scaled + DVec2::from_array(transform.offset.unwrap_or([0.0; 2]))
}

const _: () = assert!(3 * MAX_TRIANGLES < u32::MAX as usize);
