//! Materials: what a surface is, how it looks, and how it reflects lasers.

use std::sync::Arc;

use glam::Vec3;

use crate::{AlphaMask, LaserBand, Optics, ParamError, Semantic, Texture};

/// The index of a material in a [`MaterialLibrary`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MaterialId(pub u16);

/// What light does at and below the smooth surface of a liquid.
///
/// The surface is opaque in truth: rays end there. Pictures show what it mirrors, and its bed
/// through it; a laser's echo may come from what it mirrors. The light that the liquid itself
/// scatters back is the material's albedo and its reflectance at laser wavelengths, for a liquid
/// so deep that no bed is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Liquid {
    /// Refractive index over that of air, above 1: 1.33 for water.
    pub refractive_index: f32,
    /// Absorption of red, green and blue light on the way through it, per metre.
    pub absorption_per_m: Vec3,
    /// Root mean square of the slope of its ripples; 0 for a mirror.
    pub ripple_slope: f32,
    /// Length of its longest ripples, metres.
    pub ripple_m: f32,
}

impl Liquid {
    /// Share of unpolarised light that the surface mirrors, by the cosine of the angle of incidence
    /// in air (Fresnel's equations), 0..=1.
    #[must_use]
    pub fn mirrored(&self, cos: f32) -> f32 {
        let n = self.refractive_index;
        let cos = cos.clamp(0.0, 1.0);
        let below = (1.0 - (1.0 - cos * cos) / (n * n)).max(0.0).sqrt();
        let across = (cos - n * below) / (cos + n * below);
        let along = (n * cos - below) / (n * cos + below);
        0.5 * (across * across + along * along)
    }
}

/// What a surface is and how it looks: one semantic, one mask, one appearance.
#[derive(Clone, Debug)]
pub struct Material {
    /// A name for logs and exports, such as `maritime_pine.bark`.
    pub name: String,
    /// What the surface is.
    pub semantic: Semantic,
    /// What it grows on, where it grows on something (a climber on a stem: `Stem`).
    pub support: Option<Semantic>,
    /// Diffuse albedo, linear when sampled.
    pub albedo: Arc<Texture>,
    /// The share of light that is diffusely transmitted, linear RGB. Leaves are two-sided: a leaf
    /// reflects `albedo` and transmits `transmittance`, whose sum is at most 1 per channel.
    pub transmittance: Vec3,
    /// Roughness from 0, a mirror, to 1, matt.
    pub roughness: f32,
    /// Where the surface is opaque; `None` is everywhere.
    pub mask: Option<Arc<AlphaMask>>,
    /// True for the ground, whose uv are world x and y in metres (modulo 1024). The texture repeats
    /// every `tile_m`, and the renderer hides the repetition.
    pub ground: bool,
    /// Metres of surface that one repetition of the texture covers (1 for cards, whose uv is 0..1).
    pub tile_m: f32,
    /// Its reflectances and transmittances at laser wavelengths.
    pub optics: Optics,
    /// What it does with light if it is the surface of a liquid; `None` for everything solid.
    pub liquid: Option<Liquid>,
}

impl Liquid {
    fn check(&self) -> Result<(), ParamError> {
        let bends = self.refractive_index.is_finite() && self.refractive_index > 1.0;
        let (field, allowed) = ("liquid.refractive_index", "finite and greater than 1");
        ParamError::check(bends, field, self.refractive_index, allowed)?;
        for absorption in self.absorption_per_m.to_array() {
            ParamError::check_at_least_zero("liquid.absorption_per_m", absorption.into())?;
        }
        ParamError::check_at_least_zero("liquid.ripple_slope", self.ripple_slope.into())?;
        if self.ripple_slope > 0.0 {
            ParamError::check_positive("liquid.ripple_m", self.ripple_m.into())?;
        }
        Ok(())
    }
}

/// All materials of a world; a [`MaterialId`] is an index into it.
#[derive(Clone, Debug, Default)]
pub struct MaterialLibrary {
    materials: Vec<Material>,
}

impl MaterialLibrary {
    /// An empty library.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a material.
    ///
    /// # Panics
    /// If there are 65,536 already.
    pub fn add(&mut self, material: Material) -> MaterialId {
        let id = u16::try_from(self.materials.len()).expect("at most 65,536 materials");
        self.materials.push(material);
        MaterialId(id)
    }

    /// Takes back the material that was added last; `None` if there is none.
    pub fn pop(&mut self) -> Option<Material> {
        self.materials.pop()
    }

    /// The material of an id that this library gave out.
    ///
    /// # Panics
    /// If the id is another library's and out of range here.
    #[inline]
    #[must_use]
    pub fn get(&self, id: MaterialId) -> &Material {
        &self.materials[usize::from(id.0)]
    }

    /// All materials in order of their ids.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }
}

impl Material {
    /// Checks the numbers.
    ///
    /// # Errors
    /// If one is not in its range.
    pub fn check(&self) -> Result<(), ParamError> {
        let share =
            |field: &str, value: f32| ParamError::check_within(field, value.into(), 0.0, 1.0);
        share("roughness", self.roughness)?;
        for of_band in self.transmittance.to_array() {
            share("transmittance", of_band)?;
        }
        for (name, band) in [("nm905", self.optics.nm905), ("nm1550", self.optics.nm1550)] {
            share(&format!("optics.{name}.reflectance"), band.reflectance)?;
            share(&format!("optics.{name}.transmittance"), band.transmittance)?;
        }
        ParamError::check_positive("tile_m", self.tile_m.into())?;
        self.liquid.as_ref().map_or(Ok(()), Liquid::check)
    }

    /// A matt material of one colour, opaque everywhere.
    #[must_use]
    pub fn plain(name: &str, semantic: Semantic, albedo: Vec3) -> Self {
        let grey = (albedo.x + albedo.y + albedo.z) / 3.0;
        let band = LaserBand {
            reflectance: grey,
            transmittance: 0.0,
        };
        Self {
            name: name.to_owned(),
            semantic,
            support: None,
            albedo: Arc::new(Texture::plain(albedo)),
            transmittance: Vec3::ZERO,
            roughness: 1.0,
            mask: None,
            ground: false,
            tile_m: 1.0,
            optics: Optics {
                nm905: band,
                nm1550: band,
            },
            liquid: None,
        }
    }

    /// Whether its surfaces are the ground, or lie on it within a hand's breadth of height: what
    /// stands around hides light from them as it does from the ground, and they hide none.
    #[must_use]
    pub const fn lies_on_ground(&self) -> bool {
        use Semantic as S;
        self.ground
            || matches!(
                self.semantic,
                S::Soil | S::Litter | S::FallenTwig | S::FallenBark | S::SurfaceRoot | S::Stone
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_material_can_be_taken_back() {
        let grey = |name| Material::plain(name, Semantic::Stone, Vec3::splat(0.5));
        let mut library = MaterialLibrary::new();
        assert_eq!(library.add(grey("first")), MaterialId(0));
        assert_eq!(library.add(grey("second")), MaterialId(1));
        assert_eq!(library.pop().expect("a material").name, "second");
        assert_eq!(library.add(grey("third")), MaterialId(1));
        assert_eq!(library.get(MaterialId(1)).name, "third");
        assert!(MaterialLibrary::new().pop().is_none());
    }

    #[test]
    fn water_mirrors_as_tables_say() {
        let water = Liquid {
            refractive_index: 1.33,
            absorption_per_m: Vec3::ZERO,
            ripple_slope: 0.0,
            ripple_m: 1.0,
        };
        // Reflectance of still water at angles from the vertical (Hecht, "Optics", with n = 1.33).
        for (degrees, share) in [
            (0.0_f32, 0.0200),
            (30.0, 0.0211),
            (60.0, 0.0591),
            (80.0, 0.3471),
        ] {
            let found = water.mirrored(degrees.to_radians().cos());
            assert!((found - share).abs() < 6e-4, "{degrees}: {found}");
        }
        assert_eq!(water.mirrored(0.0), 1.0);
    }
}
