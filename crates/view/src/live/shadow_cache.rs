//! Shadows that drafts have found already.
//!
//! Sun and trees stand still while one walks, so nearly all that a draft shows was in the sun, or
//! in shadow, in the draft before. What was found is kept for small cubes of the world, each about
//! as wide as a pixel there (spatial hashing as of Binder, Fricke and Keller 2019, "Massively
//! Parallel Path Space Filtering"). A shadow is then as fine as the pixels of the draft in which it
//! was found, and it does not flicker.
//!
//! Which of a cube's shadow rays was cast depends on the way there. So drafts are the only pictures
//! that are not made again to the bit; whole pictures never see these shadows.

use std::sync::atomic::{AtomicU64, Ordering};

use nemoral_scene::glam::Vec3;
use nemoral_scene::{Hit, Ray, RayCaster, SurfaceHit};

/// How many cubes are remembered, as a power of two: some pictures' worth, in 8 MiB.
const CUBES_LOG2: u32 = 20;
/// The side of the smallest cube, metres. Others are wider by powers of two.
const SMALLEST_M: f32 = 1.0 / 512.0;
/// Bits of each coordinate of a cube.
const AXIS_BITS: u32 = 19;
/// The bit of a cube that is remembered, so that no entry of it is 0.
const KNOWN: u64 = 1 << 63;
/// The bit of a cube in shadow.
const IN_SHADOW: u64 = 1 << 62;

/// The shadows of a scene under a sun.
pub(super) struct ShadowCache {
    /// The cubes with their answers, each at the place of its hash, where the latest one stays.
    cubes: Box<[AtomicU64]>,
}

impl std::fmt::Debug for ShadowCache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ShadowCache").finish_non_exhaustive()
    }
}

impl ShadowCache {
    /// No shadow is known.
    pub(super) fn new() -> Self {
        Self {
            cubes: (0..1 << CUBES_LOG2).map(|_| AtomicU64::new(0)).collect(),
        }
    }

    fn entry(&self, cube: u64) -> &AtomicU64 {
        // Cubes of two by two by two share a line of the processor's cache, which Fibonacci hashing
        // chooses (Knuth, TAOCP 3, 6.4).
        let odd = 1 | 1 << AXIS_BITS | 1 << (2 * AXIS_BITS);
        let line = (cube & !odd).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (64 - CUBES_LOG2 + 3);
        let in_line = cube & 1 | cube >> (AXIS_BITS - 1) & 2 | cube >> (2 * AXIS_BITS - 2) & 4;
        &self.cubes[(line << 3 | in_line) as usize]
    }

    /// Whether a cube is in shadow, if that is known.
    fn recall(&self, cube: u64) -> Option<bool> {
        let found = self.entry(cube).load(Ordering::Relaxed);
        (found & !IN_SHADOW == cube | KNOWN).then_some(found & IN_SHADOW != 0)
    }

    fn keep(&self, cube: u64, in_shadow: bool) {
        let shadow = if in_shadow { IN_SHADOW } else { 0 };
        (self.entry(cube)).store(cube | KNOWN | shadow, Ordering::Relaxed);
    }
}

/// Casts rays, but shadow rays to the sun only from where its shadows are not known.
#[derive(Clone, Copy)]
pub(super) struct ShadowCachingCaster<'a> {
    pub(super) caster: &'a dyn RayCaster,
    pub(super) shadows: &'a ShadowCache,
    /// The camera in the scene, metres.
    pub(super) eye_m: Vec3,
    /// The angle of a pixel, radians.
    pub(super) pixel_rad: f32,
}

impl ShadowCachingCaster<'_> {
    /// The cube of a place, two to four pixels wide as seen by the camera.
    fn cube(&self, place_m: Vec3) -> u64 {
        let pixels = place_m.distance(self.eye_m) * self.pixel_rad / SMALLEST_M;
        // The exponent of a float is the logarithm, rounded down.
        let level = ((pixels.max(1.0).to_bits() >> 23) - 125).min(16);
        let cube_m = SMALLEST_M * (1_u32 << level) as f32;
        let at = (place_m / cube_m).floor();
        let axis = |x: f32| u64::from(x as i32 as u32) & ((1 << AXIS_BITS) - 1);
        u64::from(level) << (3 * AXIS_BITS)
            | axis(at.x) << (2 * AXIS_BITS)
            | axis(at.y) << AXIS_BITS
            | axis(at.z)
    }
}

impl RayCaster for ShadowCachingCaster<'_> {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.caster.closest_hit(ray)
    }

    fn closest_surface(&self, ray: &Ray) -> Option<SurfaceHit> {
        self.caster.closest_surface(ray)
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        self.caster.is_occluded(ray)
    }

    fn are_occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        let (mut unknown, mut places) = (Vec::new(), Vec::new());
        for (i, (ray, occluded)) in rays.iter().zip(&mut *occluded).enumerate() {
            // A ray that ends leads to a lamp, which moves with the camera.
            let cube = (ray.t_max_m == f32::INFINITY).then(|| self.cube(ray.origin));
            match cube.and_then(|cube| self.shadows.recall(cube)) {
                Some(in_shadow) => *occluded = in_shadow,
                None => {
                    unknown.push(*ray);
                    places.push((i, cube));
                }
            }
        }
        let mut found = vec![false; unknown.len()];
        self.caster.are_occluded(&unknown, &mut found);
        for ((i, cube), in_shadow) in places.into_iter().zip(found) {
            occluded[i] = in_shadow;
            if let Some(cube) = cube {
                self.shadows.keep(cube, in_shadow);
            }
        }
    }

    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.caster.closest_hits(rays, hits);
    }

    fn closest_surfaces(&self, rays: &[Ray], surfaces: &mut [Option<SurfaceHit>]) {
        self.caster.closest_surfaces(rays, surfaces);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::atomic::AtomicUsize;

    use proptest::prelude::*;

    use super::*;

    /// Shadow east of the plane x = 0; counts its rays.
    #[derive(Default)]
    struct Counting(AtomicUsize);

    impl RayCaster for Counting {
        fn closest_hit(&self, _: &Ray) -> Option<Hit> {
            unreachable!("only shadows are asked for")
        }

        fn is_occluded(&self, ray: &Ray) -> bool {
            self.0.fetch_add(1, Ordering::Relaxed);
            ray.origin.x > 0.0
        }
    }

    fn caching<'a>(caster: &'a Counting, shadows: &'a ShadowCache) -> ShadowCachingCaster<'a> {
        ShadowCachingCaster {
            caster,
            shadows,
            eye_m: Vec3::new(1.0, 2.0, 3.0),
            pixel_rad: 0.003,
        }
    }

    #[test]
    fn what_was_found_is_not_cast_again() {
        let (caster, shadows) = (Counting::default(), ShadowCache::new());
        let draft = caching(&caster, &shadows);
        let origins = (0..50).map(|i| Vec3::new(i as f32 - 25.5, 7.0, 0.5));
        let rays: Vec<Ray> = origins.map(|o| Ray::new(o, Vec3::Z)).collect();
        let mut first = [false; 50];
        draft.are_occluded(&rays, &mut first);
        let expected: Vec<bool> = rays.iter().map(|r| r.origin.x > 0.0).collect();
        assert_eq!(
            (first.to_vec(), caster.0.load(Ordering::Relaxed)),
            (expected, 50)
        );
        let mut second = [false; 50];
        draft.are_occluded(&rays, &mut second);
        assert_eq!((second, caster.0.load(Ordering::Relaxed)), (first, 50));
        // A camera that comes nearer wants finer shadows.
        let near = ShadowCachingCaster {
            eye_m: rays[10].origin + 0.5 * Vec3::Z,
            ..draft
        };
        near.are_occluded(&rays[10..11], &mut second[10..11]);
        assert_eq!(caster.0.load(Ordering::Relaxed), 51);
    }

    #[test]
    fn shadows_of_lamps_are_always_cast() {
        let (caster, shadows) = (Counting::default(), ShadowCache::new());
        let draft = caching(&caster, &shadows);
        let to_sun = Ray::new(Vec3::new(2.0, 7.0, 0.5), Vec3::Z);
        let to_lamp = Ray {
            t_max_m: 3.0,
            ..to_sun
        };
        draft.are_occluded(&[to_lamp, to_lamp], &mut [false; 2]);
        draft.are_occluded(&[to_sun, to_lamp], &mut [false; 2]);
        draft.are_occluded(&[to_lamp, to_sun], &mut [false; 2]);
        assert_eq!(caster.0.load(Ordering::Relaxed), 5);
    }

    proptest! {
        #[test]
        fn cubes_are_two_to_four_pixels_wide(
            eye in prop::array::uniform3(-200.0_f32..200.0),
            place in prop::array::uniform3(-200.0_f32..200.0),
            away in prop::array::uniform3(-1.0_f32..1.0),
            pixel_rad in 5e-4_f32..0.01,
        ) {
            let (caster, shadows) = (Counting::default(), ShadowCache::new());
            let eye_m = Vec3::from_array(eye);
            let draft = ShadowCachingCaster { eye_m, pixel_rad, ..caching(&caster, &shadows) };
            let (place, away) = (Vec3::from_array(place), Vec3::from_array(away));
            let pixel_m = place.distance(eye_m) * pixel_rad;
            prop_assume!(pixel_m > 2.0 * SMALLEST_M && away.length() > 0.1);
            // The diagonal of four pixels is 6.93 wide; places differ in distance, too.
            let other = place + away / away.length() * 7.2 * pixel_m;
            prop_assert_ne!(draft.cube(place), draft.cube(other));
            let level = draft.cube(place) >> (3 * AXIS_BITS);
            let pixels = SMALLEST_M * (1 << level) as f32 / pixel_m;
            prop_assert!((1.999..4.001).contains(&pixels), "{pixels}");
        }

        /// Whatever else is stored, a cube has its own latest answer or none.
        #[test]
        fn no_cube_has_the_answer_of_another(
            stored in prop::collection::vec((any::<[i16; 3]>(), 0_u32..17, any::<bool>()), 1..500),
        ) {
            let shadows = ShadowCache::new();
            let mut latest = BTreeMap::new();
            let cube = |at: [i16; 3], level: u32| {
                let axis = |x: i16| u64::from(x as i32 as u32) & ((1 << AXIS_BITS) - 1);
                u64::from(level) << (3 * AXIS_BITS)
                    | axis(at[0]) << (2 * AXIS_BITS)
                    | axis(at[1]) << AXIS_BITS
                    | axis(at[2])
            };
            for (at, level, in_shadow) in &stored {
                shadows.keep(cube(*at, *level), *in_shadow);
                latest.insert(cube(*at, *level), *in_shadow);
                prop_assert_eq!(shadows.recall(cube(*at, *level)), Some(*in_shadow));
            }
            for (cube, in_shadow) in latest {
                let recalled = shadows.recall(cube);
                prop_assert!(recalled.is_none_or(|found| found == in_shadow));
            }
        }
    }
}
