//! What a species looks like: numbers for the painters of leaves and bark.

use glam::Vec3;
use serde::Deserialize;

use nemoral_scene::ParamError;

/// How the leaves of an image are arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LeafKind {
    /// Needles around the end of a shoot (pines).
    NeedleTuft,
    /// A flat spray of side shoots with needles on both sides (spruce, firs); `count` side shoots.
    NeedleSpray,
    /// Leaves along a twig and its side twigs (beech, birch, cork oak).
    LeafSpray,
    /// Lobed leaves crowded at the ends of a twig and its side twigs (oaks).
    LeafRosettes,
    /// Sickle leaves hanging from a twig (eucalypts).
    HangingLeaves,
}

impl LeafKind {
    /// Whether they are needles, as all conifers here have.
    #[must_use]
    pub const fn is_needle(self) -> bool {
        matches!(self, Self::NeedleTuft | Self::NeedleSpray)
    }
}

/// The image of a leafy twig.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafLook {
    /// Their arrangement.
    pub kind: LeafKind,
    /// Length of a leaf or needle, least and most, metres, 0.005..=0.6.
    pub length_m: [f64; 2],
    /// Its width over its length, least and most, 0.004..=1.5.
    pub width_ratio: [f64; 2],
    /// Exponents of the outline t^a (1 − t)^b, each 0.2..=3; not used by needles.
    #[serde(default = "ovate")]
    pub outline: [f64; 2],
    /// Lobes on each side, 0..=12; used by rosettes alone.
    #[serde(default)]
    pub lobes: f64,
    /// How deep the lobes are cut, 0..=0.9.
    #[serde(default)]
    pub lobe_depth: f64,
    /// Teeth on each side, 0..=40.
    #[serde(default)]
    pub teeth: f64,
    /// How deep the teeth are cut, 0..=0.5.
    #[serde(default)]
    pub tooth_depth: f64,
    /// Leaves, needles or side shoots in an image, least and most, 1..=600.
    pub count: [u32; 2],
    /// Length of the twig, metres, 0.03..=1.
    pub twig_m: f64,
    /// Leaf stalk over leaf length, 0..=1.
    #[serde(default = "short_stalk")]
    pub stalk: f64,
    /// How much side shoots and leaves hang, 0..=1.
    #[serde(default)]
    pub hang: f64,
    /// Are the leaves in two rows?
    #[serde(default)]
    pub distichous: bool,
    /// Linear RGB albedo of the twig, 0..=0.7.
    pub twig_albedo: [f64; 3],
    /// Linear RGB reflectance of a leaf, 0..=0.7.
    pub albedo: [f64; 3],
    /// Share of a bluish wax (.30, .34, .33) over it, 0..=0.6.
    #[serde(default)]
    pub glaucous: f64,
    /// Linear RGB transmittance of a leaf, 0..=0.7; with its reflectance, wax included, at most
    /// 0.99.
    pub transmittance: [f64; 3],
    /// Reflectance and transmittance at 905 nm, together at most 1.
    pub nm905: [f64; 2],
    /// Reflectance and transmittance at 1550 nm, together at most 1.
    pub nm1550: [f64; 2],
    /// Roughness of the surface, from 0 (a mirror) to 1 (matt); for needles, which face all ways,
    /// nearly 1. It decides how much of the surface reflection, which the reflectance contains,
    /// appears as gloss.
    pub roughness: f64,
}

const fn ovate() -> [f64; 2] {
    [0.8, 0.9]
}

const fn short_stalk() -> f64 {
    0.12
}

/// The relief of a bark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BarkKind {
    /// Long plates of flaking layers between dark fissures (maritime pine, Scots pine's foot).
    Plates,
    /// Thin papery flakes (Scots pine's upper stem).
    Flakes,
    /// Small rounded scales (spruce).
    Scales,
    /// Long, deep, corky furrows, rusty inside (Douglas fir).
    Furrows,
    /// Grey ridges that run together and part again (oak).
    Ridges,
    /// Smooth, with faint level wrinkles, branch scars and lichens (beech).
    Smooth,
    /// White paper with level pores and black scars (birch).
    Birch,
    /// Black, broken into blocks with white between (the foot of an old birch).
    Fissured,
    /// Patches of several ages, shed in strips (eucalypt).
    Patches,
    /// Rough long fibres (a eucalypt's foot).
    Fibrous,
    /// Thick cork with deep, knotty furrows.
    Cork,
    /// Where cork was stripped some years ago: smooth, with fine cracks.
    StrippedCork,
}

/// One bark.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BarkLayer {
    /// Its relief.
    pub kind: BarkKind,
    /// Its mean linear RGB albedo, 0.005..=0.8.
    pub albedo: [f64; 3],
}

/// The bark of a species.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BarkLook {
    /// The bark at the foot.
    pub lower: BarkLayer,
    /// The bark higher up and on limbs, if it is a different one.
    pub upper: Option<BarkLayer>,
    /// Share of the tree's height at which the upper bark begins, 0..=1. The transition takes one
    /// repetition of the image (2 m on a thick stem).
    #[serde(default)]
    pub upper_from: f64,
    /// Linear RGB albedo of wood too thin for a bark, 0.005..=0.7.
    pub branch: [f64; 3],
    /// Moss at the foot: 1 as on an oak, 0 none, up to 2.
    pub moss: f64,
    /// Roughness of the surface, from 0 (a mirror) to 1 (matt).
    pub roughness: f64,
    /// Reflectance at 905 nm, 0..=1.
    pub nm905: f64,
    /// Reflectance at 1550 nm, 0..=1.
    pub nm1550: f64,
}

/// The bluish wax of glaucous leaves.
const WAX: Vec3 = Vec3::new(0.30, 0.34, 0.33);

impl LeafLook {
    /// Reflectance, wax included, linear RGB.
    #[must_use]
    pub fn reflectance(&self) -> Vec3 {
        linear(self.albedo).lerp(WAX, self.glaucous as f32)
    }

    /// Share of the light on a leaf that leaves it again on either side, linear RGB.
    #[must_use]
    pub fn scattering(&self) -> Vec3 {
        self.reflectance() + linear(self.transmittance)
    }

    /// These leaves with the reflectance and transmittance of their shoot. `silhouette_factor` is
    /// the silhouette of the shoot over the area of its leaves. A photon that leaves one leaf meets
    /// another leaf of the shoot with a probability of p = 1 - `silhouette_factor`, where it may be
    /// scattered again, so that of a scattered share w the part (1 - p) / (1 - p w) escapes
    /// (Smolander and Stenberg 2003, "A method to account for shoot scale clumping in coniferous
    /// canopy reflectance models"). This is why trees with needles are darker than single needles.
    /// A laser looks from where it shines and sees no shadow of one leaf on another, so its bands
    /// do not change.
    #[must_use]
    pub fn in_shoot(&self, silhouette_factor: f64) -> Self {
        let out = silhouette_factor.min(1.0);
        let seen = |[r, t]: [f64; 2]| {
            let share = out / (1.0 - (1.0 - out) * (r + t));
            [r * share, t * share]
        };
        let (own, through) = (self.reflectance().to_array(), self.transmittance);
        let visible: [[f64; 2]; 3] = std::array::from_fn(|k| seen([f64::from(own[k]), through[k]]));
        Self {
            albedo: visible.map(|[r, _]| r),
            glaucous: 0.0,
            transmittance: visible.map(|[_, t]| t),
            ..*self
        }
    }

    pub(super) fn check(&self, species: &str) -> Result<(), ParamError> {
        let range = |name: &str, value, low, high| {
            ParamError::check_within(format!("{species}.leaves.{name}"), value, low, high)
        };
        range("length_m", self.length_m[0], 0.005, self.length_m[1])?;
        range("length_m", self.length_m[1], 0.005, 0.6)?;
        range(
            "width_ratio",
            self.width_ratio[0],
            0.004,
            self.width_ratio[1],
        )?;
        range("width_ratio", self.width_ratio[1], 0.004, 1.5)?;
        for value in self.outline {
            range("outline", value, 0.2, 3.0)?;
        }
        range("lobes", self.lobes, 0.0, 12.0)?;
        range("lobe_depth", self.lobe_depth, 0.0, 0.9)?;
        range("teeth", self.teeth, 0.0, 40.0)?;
        range("tooth_depth", self.tooth_depth, 0.0, 0.5)?;
        let most = f64::from(self.count[1]);
        range("count", f64::from(self.count[0]), 1.0, most)?;
        range("count", most, 1.0, 600.0)?;
        range("twig_m", self.twig_m, 0.03, 1.0)?;
        range("stalk", self.stalk, 0.0, 1.0)?;
        range("hang", self.hang, 0.0, 1.0)?;
        range("glaucous", self.glaucous, 0.0, 0.6)?;
        for (name, colour) in [
            ("twig_albedo", self.twig_albedo),
            ("albedo", self.albedo),
            ("transmittance", self.transmittance),
        ] {
            for value in colour {
                range(name, value, 0.0, 0.7)?;
            }
        }
        for (r, t) in self
            .reflectance()
            .to_array()
            .into_iter()
            .zip(self.transmittance)
        {
            // Every leaf absorbs some light.
            let most = (0.99 - f64::from(r)).max(0.0);
            range("transmittance", t, 0.0, (most * 1000.0).floor() / 1000.0)?;
        }
        for (name, [r, t]) in [("nm905", self.nm905), ("nm1550", self.nm1550)] {
            range(name, r, 0.0, 1.0)?;
            range(name, t, 0.0, 1.0 - r)?;
        }
        range("roughness", self.roughness, 0.0, 1.0)
    }
}

impl BarkLook {
    pub(super) fn check(&self, species: &str) -> Result<(), ParamError> {
        let range = |name: &str, value, low, high| {
            ParamError::check_within(format!("{species}.bark.{name}"), value, low, high)
        };
        for value in self.lower.albedo {
            range("lower.albedo", value, 0.005, 0.8)?;
        }
        for value in self.upper.iter().flat_map(|u| u.albedo) {
            range("upper.albedo", value, 0.005, 0.8)?;
        }
        for value in self.branch {
            range("branch", value, 0.005, 0.7)?;
        }
        range("upper_from", self.upper_from, 0.0, 1.0)?;
        range("moss", self.moss, 0.0, 2.0)?;
        range("roughness", self.roughness, 0.0, 1.0)?;
        range("nm905", self.nm905, 0.0, 1.0)?;
        range("nm1550", self.nm1550, 0.0, 1.0)
    }
}

/// A colour of a species' file.
pub(crate) fn linear(rgb: [f64; 3]) -> Vec3 {
    Vec3::from(rgb.map(|c| c as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::Species;

    /// Follows photons from leaf to leaf of a shoot: the series whose sum the closed form is.
    #[test]
    fn a_shoot_sends_on_what_escapes_its_leaves() {
        for species in Species::all() {
            let (leaf, shoot) = (&species.leaves, species.shoot());
            let again = 1.0 - species.foliage.silhouette_factor;
            assert!((0.0..0.7).contains(&again), "{}", species.name);
            let of = |look: &LeafLook| look.scattering().to_array().map(f64::from);
            for (w, seen) in of(leaf).into_iter().zip(of(&shoot)) {
                let (mut under_way, mut out) = (1.0, 0.0);
                for _ in 0..200 {
                    under_way *= w;
                    out += under_way * (1.0 - again);
                    under_way *= again;
                }
                assert!((seen - out).abs() < 1e-6, "{}: {seen} {out}", species.name);
            }
            // Reflectance, with its wax, and transmittance fall by the same factor.
            let sides = |look: &LeafLook| look.transmittance[1] / f64::from(look.reflectance().y);
            assert!((sides(&shoot) - sides(leaf)).abs() < 1e-6);
            assert_eq!([shoot.nm905, shoot.nm1550], [leaf.nm905, leaf.nm1550]);
            let dark = (shoot.reflectance() / leaf.reflectance()).as_dvec3();
            assert!(dark.min_element() > 1.0 - again - 1e-6 && dark.max_element() < 1.0 + 1e-6);
        }
        let beech = &Species::all()[0].leaves;
        assert_eq!(beech.in_shoot(1.0).scattering(), beech.scattering());
    }
}
