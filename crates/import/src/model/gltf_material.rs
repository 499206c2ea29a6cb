//! Materials of glTF.

use nemoral_scene::glam::Vec3;
use nemoral_scene::{LaserBand, Optics};

use super::buffers::item;
use super::json::{Document, Material, MaterialExtras};
use super::raw::{Alpha, MaterialHints, RawMaterial, RawModel};
use super::sidecar::semantic;
use crate::ImportError;
use crate::error::shown;

/// Reads a material. `places` are the numbers of images among the model's pictures.
pub(super) fn read(
    document: &Document,
    material: &Material,
    places: &[Option<usize>],
    model: &mut RawModel,
) -> Result<RawMaterial, ImportError> {
    let surface = &material.pbr_metallic_roughness;
    let picture = match &surface.base_color_texture {
        None => None,
        Some(colour) => {
            let texture = item(&document.textures, colour.index, "textures")?;
            match texture.source {
                Some(image) => *item(places, image, "images")?,
                None => {
                    let name = shown(&material.name);
                    model.note(format!(
                        "material {name}: its texture has no PNG or JPEG, and is left out"
                    ));
                    None
                }
            }
        }
    };
    let [r, g, b, alpha] = surface.base_color_factor.unwrap_or([1.0; 4]);
    let mode = material.alpha_mode.as_deref().unwrap_or("OPAQUE");
    let least = match mode {
        "OPAQUE" => None,
        "MASK" => Some(material.alpha_cutoff.unwrap_or(0.5)),
        "BLEND" => {
            let name = shown(&material.name);
            model.note(format!(
                "material {name}: it blends; it is cut out where its alpha is at least 0.5"
            ));
            Some(0.5)
        }
        other => {
            return Err(ImportError::file(format!(
                "material {}: alphaMode = {}: must be OPAQUE, MASK or BLEND",
                shown(&material.name),
                shown(other)
            )));
        }
    };
    // NaN counts as transparent.
    let visible = |least: f32| alpha >= least;
    let alpha = match (least, picture) {
        (None, _) => Alpha::Everywhere,
        (Some(least), None) if visible(least) => Alpha::Everywhere,
        (Some(least), Some(_)) if least <= 0.0 => Alpha::Everywhere,
        (Some(least), Some(_)) if visible(least) => Alpha::From(255.0 * least / alpha),
        (Some(_), _) => {
            let name = shown(&material.name);
            model.note(format!("material {name} is transparent, and is left out"));
            Alpha::Nowhere
        }
    };
    let channel = |c: f32| {
        if c.is_finite() {
            c.clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    let roughness = surface.roughness_factor.unwrap_or(1.0);
    Ok(RawMaterial {
        name: material.name.clone(),
        colour: Vec3::new(channel(r), channel(g), channel(b)),
        picture,
        alpha,
        roughness: channel(roughness),
        hints: hints(material),
    })
}

/// What our own export says of a material.
fn hints(material: &Material) -> MaterialHints {
    let extras = material.extras.as_ref();
    let extras = extras.and_then(|e| serde_json::from_str::<MaterialExtras>(e.get()).ok());
    let Some(extras) = extras else {
        return MaterialHints::default();
    };
    let share = |x: f32| (0.0..=1.0).contains(&x);
    let band = |[reflectance, transmittance]: [f32; 2]| {
        let is_possible = share(reflectance) && share(transmittance);
        let is_possible = is_possible && reflectance + transmittance <= 1.001;
        is_possible.then_some(LaserBand {
            reflectance,
            transmittance,
        })
    };
    let optics = (extras.laser_905_nm.and_then(band)).zip(extras.laser_1550_nm.and_then(band));
    MaterialHints {
        semantic: semantic(&extras.semantic),
        support: extras.support.as_deref().and_then(semantic),
        transmittance: extras
            .transmittance
            .filter(|t| t.iter().all(|&c| share(c)))
            .map(Vec3::from_array),
        optics: optics.map(|(nm905, nm1550)| Optics { nm905, nm1550 }),
    }
}
