//! Where each kind of low plants grows.

use nemoral_scene::PlantCommunity;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

use crate::{FieldParams, ScalarField};

const KIND: Domain = Domain::new("pipeline.undergrowth.kind");

/// The field that makes plants cluster.
pub const CLUMP_FIELD: FieldParams = FieldParams {
    octaves: 3,
    scale_m: 9.0,
    lacunarity: 2.0,
    persistence: 0.5,
};

/// The field of the preferred places of ferns, which form wider groups.
pub const FERN_FIELD: FieldParams = FieldParams {
    scale_m: 24.0,
    ..CLUMP_FIELD
};

/// The greatest distance of a patch from its cell's middle, in cells.
pub const PATCH_JITTER: f64 = 0.6;

/// The range of scales of patches.
pub const PATCH_SCALE: (f64, f64) = (0.75, 1.25);

/// What grows in a cell of the undergrowth's grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PatchKind {
    /// Grass.
    Grass,
    /// Herbs.
    Herbs,
    /// Ferns.
    Ferns,
    /// Fallen twigs and cones.
    Litter,
    /// A fallen branch, or a top left after thinning.
    Branch,
    /// A mat of brash.
    Brash,
    /// A bed of stones on bare ground.
    Scree,
    /// A wide tile of closed vegetation.
    Closed(PlantCommunity),
    /// A narrow tile of it, beside a border or on a trail.
    ClosedBorder(PlantCommunity),
}

/// The abundance of each kind of low plants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UndergrowthParams {
    /// The share of cells with plants in full light, 0..1.
    pub cover: f64,
    /// The share of cells with fallen twigs and cones, 0..1.
    pub litter: f64,
    /// The weight of grass among plants.
    pub grass: f64,
    /// The weight of herbs.
    pub herbs: f64,
    /// The weight of ferns at their preferred places.
    pub ferns: f64,
}

/// The undergrowth of a world.
///
/// Each cell of a jittered grid may hold one patch; whose grid that is, is up to the caller.
#[derive(Clone, Debug)]
pub struct Undergrowth<F> {
    /// The abundance of each kind of low plants.
    pub params: UndergrowthParams,
    /// Where plants cluster; see [`CLUMP_FIELD`].
    pub clumps: F,
    /// Where ferns grow; see [`FERN_FIELD`].
    pub ferns: F,
}

/// The conditions for single patches at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchSite {
    /// The sky view factor 0.3 m above the ground, 0..1.
    pub sky_view: f32,
    /// From −1, dry, over 0, as most of the ground, to 1, wet.
    pub wetness: f64,
    /// Depth of the soil, metres, 0 and more; 0.5 where it has no effect.
    pub soil_m: f64,
    /// The share of what falls from trees that there is, 0..=1; 0 in the open.
    pub litter: f64,
}

impl PatchSite {
    /// Ground as most of it is, with this sky view factor.
    #[must_use]
    pub const fn neutral(sky_view: f32) -> Self {
        Self {
            sky_view,
            wetness: 0.0,
            soil_m: 0.5,
            litter: 1.0,
        }
    }

    /// Thin soil bears few plants.
    fn rooting(&self) -> f64 {
        (0.25 + 2.5 * self.soil_m).clamp(0.0, 1.0)
    }
}

impl<F: ScalarField> Undergrowth<F> {
    /// The probability that a cell holds a patch at a world position, metres. Plants are fewer
    /// below a sky view factor of 0.3, and none grows below 0.05.
    pub fn chance(&self, world_m: DVec2, site: &PatchSite) -> f64 {
        let light = ((f64::from(site.sky_view) - 0.05) / 0.25).clamp(0.0, 1.0);
        let clump = contrast(self.clumps.value(world_m));
        let plants = self.params.cover * light * (0.4 + 0.6 * clump) * site.rooting();
        (plants + self.params.litter * site.litter).min(1.0)
    }

    /// The kind of the patch at a world position, metres, with that [`chance`](Self::chance); `key`
    /// is the patch's own. Ferns and herbs are more frequent where it is wet, grass where it is
    /// dry.
    pub fn kind(&self, world_m: DVec2, chance: f64, site: &PatchSite, key: Key) -> PatchKind {
        let mut rng = key.domain(KIND).rng();
        let fern = contrast(self.ferns.value(world_m));
        let params = &self.params;
        let by_wetness = |gain: f64| 1.0 + gain * site.wetness.clamp(-1.0, 1.0);
        let weights = [
            params.grass * by_wetness(-0.45),
            params.herbs * by_wetness(0.5),
            params.ferns * fern * by_wetness(0.8),
        ];
        if rng.chance(params.litter * site.litter / chance.max(1e-9)) {
            return PatchKind::Litter;
        }
        match rng.weighted(&weights) {
            Some(0) => PatchKind::Grass,
            Some(1) => PatchKind::Herbs,
            Some(_) => PatchKind::Ferns,
            // Only ferns are asked for, and this is no place for them.
            None => PatchKind::Litter,
        }
    }
}

/// Increases the contrast of a field of octaves, most of whose values are near the middle, so that
/// its patches have edges.
fn contrast(value: f64) -> f64 {
    ((value - 0.5) * 3.5 + 0.5).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn undergrowth(field: fn(DVec2) -> f64) -> Undergrowth<fn(DVec2) -> f64> {
        let params = UndergrowthParams {
            cover: 0.8,
            litter: 0.1,
            grass: 1.0,
            herbs: 1.0,
            ferns: 1.0,
        };
        Undergrowth {
            params,
            clumps: field,
            ferns: field,
        }
    }

    #[test]
    fn nothing_grows_in_deep_shade() {
        let dense = undergrowth(|_| 1.0);
        let chance = |sky_view| dense.chance(DVec2::ZERO, &PatchSite::neutral(sky_view));
        assert!((chance(1.0) - 0.9).abs() < 1e-12);
        // Twigs lie there, too.
        assert!((chance(0.0) - 0.1).abs() < 1e-12);
        assert!((chance(0.05) - 0.1).abs() < 1e-6 && (chance(0.3) - 0.9).abs() < 1e-6);
        assert!((chance(0.175) - 0.5).abs() < 1e-6);
        let site = PatchSite::neutral(1.0);
        assert!((undergrowth(|_| 0.0).chance(DVec2::ZERO, &site) - 0.42).abs() < 1e-12);
    }

    #[test]
    fn patches_follow_water_and_soil() {
        let all = undergrowth(|_| 0.7);
        let count = |wetness| {
            let site = PatchSite {
                wetness,
                ..PatchSite::neutral(1.0)
            };
            let mut counts = [0; 3];
            for i in 0..4000 {
                let kind = all.kind(DVec2::ZERO, 0.9, &site, Key::world(1).item(i));
                let kinds = [PatchKind::Grass, PatchKind::Herbs, PatchKind::Ferns];
                if let Some(kind) = kinds.iter().position(|k| *k == kind) {
                    counts[kind] += 1;
                }
            }
            counts
        };
        let (wet, dry) = (count(1.0), count(-1.0));
        assert!(wet[2] > 3 * dry[2] && wet[1] > dry[1] && 2 * wet[0] < dry[0]);
        let on = |soil_m| {
            let site = PatchSite {
                soil_m,
                ..PatchSite::neutral(1.0)
            };
            all.chance(DVec2::ZERO, &site)
        };
        assert!(on(0.0) < 0.5 * on(0.5));
        assert_eq!(on(0.5), on(1.5));
        let open = PatchSite {
            litter: 0.0,
            ..PatchSite::neutral(1.0)
        };
        assert!((all.chance(DVec2::ZERO, &open) - (on(0.5) - 0.1)).abs() < 1e-12);
    }

    #[test]
    fn ferns_keep_to_their_groups() {
        let (dense, none) = (undergrowth(|_| 1.0), undergrowth(|_| 0.0));
        let site = PatchSite::neutral(1.0);
        let mut ferns = [0; 2];
        for i in 0..3000 {
            let key = Key::world(1).item(i);
            for (count, stand) in ferns.iter_mut().zip([&dense, &none]) {
                *count += u32::from(stand.kind(DVec2::ZERO, 0.9, &site, key) == PatchKind::Ferns);
            }
        }
        assert!(
            (800..1000).contains(&ferns[0]) && ferns[1] == 0,
            "{ferns:?}"
        );
    }
}
