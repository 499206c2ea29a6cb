//! Our materials and one mesh from the parts of a file.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use nemoral_scene::glam::{DVec2, DVec3, IVec2, Vec2, Vec3};
use nemoral_scene::{AlphaMask, Material, MaterialId, Mesh, Semantic, Texture, Triangle};

use super::picture::Picture;
use super::raw::{Alpha, RawMaterial, RawModel, RawPart};
use super::{MAX_MATERIALS, optics};
use crate::ImportError;
use crate::error::shown;

/// A mesh with its materials.
#[derive(Debug, Default)]
pub(super) struct Baked {
    pub(super) mesh: Mesh,
    pub(super) materials: Vec<Material>,
}

/// The longest side of a colour texture, texels. Masks keep the size of their pictures.
const MAX_TEXTURE_SIDE: usize = 4096;
/// The longest side of a mask whose picture is repeated.
const MAX_REPEATED_SIDE: usize = 8192;

/// The most texels of a model's textures together, of which four of a mask count as one.
const MAX_TEXELS: usize = 1 << 27;

/// Bakes parts that have these semantics.
pub(super) fn bake(raw: &RawModel, semantics: &[Semantic]) -> Result<Baked, ImportError> {
    // Of each material, how often its picture is repeated along its sides.
    let mut repeats: BTreeMap<usize, [usize; 2]> = BTreeMap::new();
    for part in &raw.parts {
        let [u, v] = repetitions(raw, part)?;
        let of = repeats.entry(part.material).or_insert([1, 1]);
        *of = [of[0].max(u), of[1].max(v)];
    }
    let mut baked = Baked::default();
    let mut looks: BTreeMap<LookKey, Look> = BTreeMap::new();
    let mut texels = MAX_TEXELS;
    let mut known: BTreeMap<(usize, Semantic), MaterialId> = BTreeMap::new();
    for (part, &semantic) in raw.parts.iter().zip(semantics) {
        let material = &raw.materials[part.material];
        let repeats = repeats[&part.material];
        let look = match looks.entry(look_key(material, repeats)) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => new.insert(Look::of(material, raw, repeats, &mut texels)?),
        };
        let next = MaterialId(baked.materials.len() as u16);
        let id = *known.entry((part.material, semantic)).or_insert(next);
        if id == next {
            if baked.materials.len() == MAX_MATERIALS {
                return Err(ImportError::file(format!(
                    "its materials have so many meanings that there are more than {MAX_MATERIALS}"
                )));
            }
            baked.materials.push(look.material(material, semantic));
        }
        let fit = look.mask.is_some().then_some(repeats);
        append(&mut baked.mesh, part, id, fit);
    }
    if baked.mesh.triangles.is_empty() {
        return Err(ImportError::file("has no triangles, or none is left"));
    }
    Ok(baked)
}

/// How often a part's pictures are repeated within any of its triangles, if one of them cuts the
/// part out: a mask shows itself once, with the colours over it.
fn repetitions(raw: &RawModel, part: &RawPart) -> Result<[usize; 2], ImportError> {
    let material = &raw.materials[part.material];
    let pictures = match material.alpha {
        Alpha::From(_) => [material.picture, None],
        Alpha::White(mask) => [Some(mask), material.picture],
        Alpha::Everywhere | Alpha::Nowhere => [None, None],
    };
    let pictures = pictures.into_iter().flatten().map(|i| &raw.pictures[i]);
    let Some(sides) = pictures
        .map(|picture| [picture.width, picture.height])
        .reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])
    else {
        return Ok([1, 1]);
    };
    let mut most = [1.0, 1.0_f64];
    for triangle in &part.triangles {
        let [least, end] = tiles(part, triangle);
        let span = end - least;
        most = [most[0].max(span.x), most[1].max(span.y)];
    }
    for (repeated, side) in most.into_iter().zip(sides) {
        if repeated * side as f64 > MAX_REPEATED_SIDE as f64 {
            return Err(ImportError::file(format!(
                "material {}: a triangle, which is cut out, shows its picture of {side} pixels \
                 {repeated} times along a side: at most {MAX_REPEATED_SIDE} pixels are allowed",
                shown(&material.name)
            )));
        }
    }
    Ok(most.map(|n| n as usize))
}

/// The first and the end of the repetitions of a picture that a triangle shows.
fn tiles(part: &RawPart, triangle: &[u32; 3]) -> [DVec2; 2] {
    /// Texture coordinates are often beyond a border by rounding.
    const SLACK: f64 = 1e-3;
    let [a, b, c] = triangle.map(|i| part.uvs.get(i as usize).copied().unwrap_or_default());
    let (least, most) = (a.min(b).min(c), a.max(b).max(c));
    let least = (least + SLACK).floor();
    [least, (most - SLACK).ceil().max(least + 1.0)]
}

/// Adds a part to a mesh. `fit` are the repetitions of a picture that make up its mask: texture
/// coordinates are then moved into 0..1.
fn append(mesh: &mut Mesh, part: &RawPart, material: MaterialId, fit: Option<[usize; 2]>) {
    let mut known: HashMap<(u32, IVec2, u32), u32> = HashMap::new();
    for (number, triangle) in part.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|i| part.positions[i as usize]);
        let flat = (b - a).cross(c - a).normalize_or_zero();
        // What has no area is not seen; nor is it when its points are not finite numbers of f32.
        if flat == DVec3::ZERO {
            continue;
        }
        let tile = fit.map_or(DVec2::ZERO, |_| tiles(part, triangle)[0]);
        // A triangle without normals has vertices of its own, which are shaded flat.
        let own = if part.normals.is_empty() {
            number as u32
        } else {
            u32::MAX
        };
        let corner = |&vertex: &u32| {
            let key = (vertex, tile.as_ivec2(), own);
            *known.entry(key).or_insert_with(|| {
                let i = vertex as usize;
                let uv = part.uvs.get(i).copied().unwrap_or_default();
                let uv = match fit {
                    Some([u, v]) => {
                        let of = DVec2::new(u as f64, v as f64);
                        ((uv - tile) / of).clamp(DVec2::ZERO, DVec2::ONE)
                    }
                    None => uv,
                };
                let normal = part.normals.get(i).and_then(|n| n.try_normalize());
                mesh.positions.push(part.positions[i].as_vec3());
                mesh.normals.push(normal.unwrap_or(flat).as_vec3());
                mesh.uvs.push(finite(uv.as_vec2()));
                mesh.positions.len() as u32 - 1
            })
        };
        let mut corners = [0; 3];
        for (to, from) in corners.iter_mut().zip(triangle.iter().map(corner)) {
            *to = from;
        }
        mesh.triangles.push(Triangle { corners, material });
    }
}

fn finite(uv: Vec2) -> Vec2 {
    if uv.is_finite() { uv } else { Vec2::ZERO }
}

/// What a look depends on: a picture, where it is opaque, its colour, and its repetitions.
type LookKey = (Option<usize>, (u8, u64), [u32; 3], [usize; 2]);

fn look_key(material: &RawMaterial, repeats: [usize; 2]) -> LookKey {
    let alpha = match material.alpha {
        Alpha::Everywhere => (0, 0),
        Alpha::Nowhere => (1, 0),
        Alpha::From(least) => (2, least.to_bits().into()),
        Alpha::White(picture) => (3, picture as u64),
    };
    let colour = material.colour.to_array().map(f32::to_bits);
    (material.picture, alpha, colour, repeats)
}

/// How a material looks, whatever it is.
struct Look {
    albedo: Arc<Texture>,
    mask: Option<Arc<AlphaMask>>,
}

impl Look {
    fn of(
        material: &RawMaterial,
        raw: &RawModel,
        repeats: [usize; 2],
        texels: &mut usize,
    ) -> Result<Self, ImportError> {
        let picture = material.picture.map(|i| &raw.pictures[i]);
        let holes = match material.alpha {
            Alpha::White(number) => Some(&raw.pictures[number]),
            _ => None,
        };
        let size = |p: &Picture| p.width * repeats[0] * p.height * repeats[1];
        let most = MAX_TEXTURE_SIDE * MAX_TEXTURE_SIDE;
        let needed = picture.map_or(0, |p| size(p).min(most)) + holes.map_or(0, size) / 4;
        *texels = texels.checked_sub(needed).ok_or_else(|| {
            ImportError::file(format!(
                "material {}: its textures and those before it have more than {MAX_TEXELS} texels",
                shown(&material.name)
            ))
        })?;
        let mask = match material.alpha {
            Alpha::Everywhere | Alpha::Nowhere => None,
            Alpha::From(least) => picture.map(|p| mask(p, repeats, |p| f32::from(p[3]) >= least)),
            Alpha::White(number) => Some(mask(&raw.pictures[number], repeats, |[r, g, b, a]| {
                a >= 128 && u32::from(r) + u32::from(g) + u32::from(b) >= 3 * 128
            })),
        };
        let mask = mask.transpose()?;
        // What is opaque everywhere needs no mask, which casters would look at.
        let mask = mask.filter(|m| m.opaque_fraction() < 1.0);
        if mask.as_ref().is_some_and(|m| m.opaque_fraction() == 0.0) {
            return Err(ImportError::file(format!(
                "material {}: its picture is transparent everywhere",
                shown(&material.name)
            )));
        }
        let repeats = if mask.is_some() { repeats } else { [1, 1] };
        let albedo = match picture {
            None => Texture::plain(material.colour),
            Some(picture) => texture(picture, material.colour, mask.as_ref(), repeats),
        };
        Ok(Self {
            albedo: Arc::new(albedo),
            mask: mask.map(Arc::new),
        })
    }

    fn material(&self, raw: &RawMaterial, semantic: Semantic) -> Material {
        let hints = &raw.hints;
        let mean = self.albedo.mean();
        let through = if optics::is_translucent(semantic) {
            // About as much as leaves reflect, and never more than all together.
            mean.min(Vec3::ONE - mean).max(Vec3::ZERO)
        } else {
            Vec3::ZERO
        };
        let name = if raw.name.is_empty() {
            "model"
        } else {
            &raw.name
        };
        Material {
            support: hints.support,
            albedo: Arc::clone(&self.albedo),
            // A rounded mean may be above 1.
            transmittance: (hints.transmittance)
                .map_or(through, |t| t.min(Vec3::ONE - mean).max(Vec3::ZERO)),
            roughness: raw.roughness,
            mask: self.mask.clone(),
            optics: hints.optics.unwrap_or_else(|| optics::at_lasers(semantic)),
            ..Material::plain(name, semantic, mean)
        }
    }
}

/// A mask of a picture that is repeated along both sides.
fn mask(
    picture: &Picture,
    [columns, rows]: [usize; 2],
    is_opaque: impl Fn([u8; 4]) -> bool,
) -> Result<AlphaMask, ImportError> {
    let (width, height) = (picture.width, picture.height);
    let opaque = |column: usize, row: usize| is_opaque(picture.at(column % width, row % height));
    AlphaMask::from_fn(width * columns, height * rows, opaque)
        .map_err(|e| ImportError::file(e.to_string()))
}

/// The colours of a picture that is repeated along both sides.
fn texture(
    picture: &Picture,
    factor: Vec3,
    mask: Option<&AlphaMask>,
    [columns, rows]: [usize; 2],
) -> Texture {
    let (width, height) = (picture.width * columns, picture.height * rows);
    let side = |n: usize| n.next_power_of_two().min(MAX_TEXTURE_SIDE);
    let (across, down) = (side(width), side(height));
    let linear: [f32; 256] = std::array::from_fn(|i| linear(i as f32 / 255.0));
    // Texel `i` of `n` stands for these pixels of `of`.
    let pixels = |i: usize, n: usize, of: usize| i * of / n..((i + 1) * of).div_ceil(n);
    let mut colours = Vec::with_capacity(across * down);
    for row in 0..down {
        for column in 0..across {
            let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
            for y in pixels(row, down, height) {
                for x in pixels(column, across, width) {
                    let [r, g, b, alpha] = picture.at(x % picture.width, y % picture.height);
                    // Colours under what is transparent count only where nothing else does.
                    let part = if mask.is_some() {
                        f32::from(alpha).max(1e-3)
                    } else {
                        1.0
                    };
                    let colour = [r, g, b].map(|c| linear[usize::from(c)]);
                    sum += part * Vec3::from_array(colour);
                    weight += part;
                }
            }
            colours.push(sum / weight * factor);
        }
    }
    let place = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
    let opaque = |column: usize, row: usize| {
        mask.is_none_or(|m| m.is_opaque(place(column, across), place(row, down)))
    };
    Texture::from_linear_where(across, down, &colours, opaque)
        .expect("sides are powers of two up to 4096, with as many texels")
}

/// Linear light of a share of sRGB (IEC 61966-2-1).
fn linear(s: f32) -> f32 {
    if s <= 0.040_45 {
        s / 12.92
    } else {
        libm::powf((s + 0.055) / 1.055, 2.4)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{ImageFormat, RgbaImage};

    use super::*;

    fn picture(width: u32, height: u32) -> Picture {
        let mut png = Cursor::new(Vec::new());
        let pixels = RgbaImage::new(width, height);
        pixels.write_to(&mut png, ImageFormat::Png).expect("a PNG");
        let mut left = u64::MAX;
        Picture::read(&png.into_inner(), "picture", &mut left).expect("a picture")
    }

    #[test]
    fn neither_a_mask_nor_the_colours_over_it_have_too_many_pixels() {
        let of = |repeats: f64, [colours, mask]: [u32; 2]| {
            let part = RawPart {
                names: Vec::new(),
                material: 0,
                positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
                normals: Vec::new(),
                uvs: vec![DVec2::ZERO, DVec2::X * repeats, DVec2::Y],
                triangles: vec![[0, 1, 2]],
            };
            let material = RawMaterial {
                picture: Some(0),
                alpha: Alpha::White(1),
                ..RawMaterial::plain("leaf")
            };
            let raw = RawModel {
                materials: vec![material],
                pictures: vec![picture(colours, 1), picture(mask, 1)],
                ..RawModel::default()
            };
            repetitions(&raw, &part).map_err(|e| e.to_string())
        };
        assert_eq!(of(2.0, [4096, 2]), Ok([2, 1]));
        for sides in [[4096, 2], [2, 4096]] {
            let refused = of(3.0, sides).expect_err("refused");
            assert!(refused.contains("of 4096 pixels 3 times"), "{refused}");
        }
    }
}
