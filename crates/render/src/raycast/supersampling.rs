//! Jittered samples of pixels' colours besides the first one at each pixel's centre.

use glam::{DVec2, Vec3};
use nemoral_seed::{Draw, Key, Rng};
use rayon::prelude::*;

use super::context::{PictureContext, ShadowRays, sums_per_pixel};
use super::frame_buffer::FrameBuffer;
use super::primary_rays::{BATCH, ROWS, pixel_truth};

/// Samples that are added to those that a pixel has already.
#[derive(Clone, Copy)]
pub(super) struct AdditionalSamples {
    /// Samples that a pixel has already.
    before: u32,
    pub(super) samples: u32,
    /// The number of equal parts of the exposure, one for each sample.
    parts: u32,
    /// The part of the exposure that has a sample already, if any: the middle one, or the first one
    /// after the middle.
    done: Option<u32>,
}

impl AdditionalSamples {
    /// Samples after the first, which was taken in the middle of the exposure.
    pub(super) fn after_the_first(samples: u32) -> Self {
        let parts = samples + 1;
        Self {
            before: 1,
            samples,
            parts,
            done: Some(parts / 2),
        }
    }

    /// `samples` that cover the whole exposure, for pixels that have `before` samples already.
    pub(super) fn beside(before: u32, samples: u32) -> Self {
        Self {
            before,
            samples,
            parts: samples,
            done: None,
        }
    }

    /// When the samples of a pixel are taken, as shares of the exposure, -0.5..0.5: one in each
    /// part that is not done, in an order that does not depend on their positions in the pixel.
    fn times(&self, rng: &mut impl Rng, out: &mut Vec<f64>) {
        // The middle of an even number of parts is where two of them meet. The sample there stands
        // for the one as often as for the other; else pictures would be of an earlier time.
        let done = match self.done {
            Some(part) if self.parts.is_multiple_of(2) => Some(part - (rng.next_u32() & 1)),
            done => done,
        };
        out.clear();
        out.extend((0..self.parts).filter(|&p| Some(p) != done).map(f64::from));
        for last in (1..out.len()).rev() {
            out.swap(last, rng.below(last as u32 + 1) as usize);
        }
        for part in out {
            *part = (*part + rng.unit_f64()) / f64::from(self.parts) - 0.5;
        }
    }
}

/// Columns of a tile of [`ROWS`] rows, pixels.
const TILE: u32 = 64;

/// The greatest number of samples of a pixel that take the sun's share from the samples around
/// them. More samples find a shadow's shape by themselves.
const SHARING_SHADOWS: u32 = 4;

/// Roberts' sequence of low discrepancy in two dimensions ("The unreasonable effectiveness of
/// quasirandom sequences", 2018): any first few of its points are far apart.
const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);

/// How the places of a pixel's samples differ from those of other pixels.
#[derive(Clone, Copy, Debug)]
struct Scatter {
    /// Displacement along both axes, -0.5..0.5, in units of the distance of a pixel's samples.
    shift: DVec2,
    /// 1, or -1 where the places are mirrored about the pixel's centre along an axis. The mean of
    /// both is the centre, so that a picture of few samples is not displaced.
    side: DVec2,
}

impl Scatter {
    /// That of the pixel whose random numbers these are.
    fn of(rng: &mut impl Rng) -> Self {
        let shift = DVec2::new(rng.unit_f64(), rng.unit_f64()) - 0.5;
        let bits = rng.next_u32();
        let side = [bits & 1, bits >> 1 & 1].map(|bit| 1.0 - 2.0 * f64::from(bit));
        Self {
            shift,
            side: DVec2::from_array(side),
        }
    }

    /// The place of the sample `k` of a pixel of `samples`, from the pixel's corner. The first one
    /// of pixels without a shift is at the centre.
    fn place(&self, k: u32, samples: u32) -> DVec2 {
        let from_centre = f64::from(k) * STEP + self.shift / f64::from(samples).sqrt();
        let at = DVec2::splat(0.5) + self.side * from_centre;
        at - at.floor()
    }
}

/// Divides pixels (ascending) into groups of at most `most` that lie close together, so that their
/// rays are alike.
fn neighbourhoods(pixels: &[u32], width: u32, most: usize) -> Vec<Vec<u32>> {
    let band = ROWS as u32 * width;
    let bands: Vec<&[u32]> = pixels.chunk_by(|a, b| a / band == b / band).collect();
    let groups: Vec<Vec<Vec<u32>>> = bands
        .into_par_iter()
        .map(|pixels| {
            let mut by_tile = pixels.to_vec();
            by_tile.sort_by_key(|pixel| pixel % width / TILE);
            by_tile.chunks(most).map(<[u32]>::to_vec).collect()
        })
        .collect();
    groups.into_iter().flatten().collect()
}

impl PictureContext<'_> {
    /// Adds samples to those that some pixels (ascending) already have.
    pub(super) fn add_samples(
        &self,
        frame: &mut FrameBuffer,
        pixels: &[u32],
        additional: AdditionalSamples,
        key: Key,
    ) {
        let AdditionalSamples {
            before, samples, ..
        } = additional;
        let most = (BATCH / samples as usize).max(1);
        let groups = neighbourhoods(pixels, self.view.intrinsics.width, most);
        let known = &*frame;
        let sums: Vec<Vec<Vec3>> = groups
            .par_iter()
            .map(|pixels| self.sums_of_samples(known, pixels, additional, key))
            .collect();
        for (pixel, sum) in groups.iter().flatten().zip(sums.iter().flatten()) {
            let c = &mut frame.linear[*pixel as usize];
            *c = (*c * before as f32 + *sum) / (before + samples) as f32;
        }
    }

    /// The sum of each pixel's additional samples.
    fn sums_of_samples(
        &self,
        frame: &FrameBuffer,
        pixels: &[u32],
        additional: AdditionalSamples,
        key: Key,
    ) -> Vec<Vec3> {
        let AdditionalSamples {
            before, samples, ..
        } = additional;
        let (view, width) = (self.view, self.view.intrinsics.width);
        let (blurs, exposure_s) = (view.blurs(), view.shutter.exposure_s);
        let count = pixels.len() * samples as usize;
        let (mut places, mut rays) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut points = Vec::with_capacity(count);
        let mut times = vec![0.0; samples as usize];
        for &pixel in pixels {
            let mut rng = key.item(pixel.into()).rng();
            let scatter = Scatter::of(&mut rng);
            let corner = DVec2::new(f64::from(pixel % width), f64::from(pixel / width));
            if blurs {
                additional.times(&mut rng, &mut times);
            }
            for (k, &time) in (before..).zip(&times) {
                let at = corner + scatter.place(k, before + samples);
                places.push(at);
                rays.push(view.ray_at(at, time * exposure_s, self.params.max_range_m));
                points.push(self.sun_disc.at_random(rng.next_u32()));
            }
        }
        let mut hits = vec![None; rays.len()];
        self.scene.caster.closest_hits(&rays, &mut hits);
        if self.params.bounces > 0 {
            let keys = pixels.iter().map(|&pixel| key.item(pixel.into()));
            let mut sums = self.path_traced(&rays, &hits, &points, keys, samples as usize);
            for (k, (place, hit)) in places.iter().zip(&hits).enumerate() {
                let (distance_m, sun) = match hit {
                    Some(hit) => (hit.surface.distance_m, Vec3::ZERO),
                    None => (
                        self.params.max_range_m,
                        self.sun_in_sample(*place, &rays[k]),
                    ),
                };
                sums[k / samples as usize] += self.lamp_glow.before(*place, distance_m) + sun;
            }
            return sums;
        }
        // The samples of a blurred pixel are not of one instant.
        let shares_shadows = !blurs && before + samples <= SHARING_SHADOWS;
        // The light of those sources whose share is not known, with its sample.
        let (mut shadows, mut unknown) = (ShadowRays::default(), Vec::new());
        let mut colours = Vec::with_capacity(rays.len());
        for k in 0..rays.len() {
            let c = self.radiance(places[k], &rays[k], hits[k].as_ref(), points[k]);
            let mut colour = c.rest;
            let lamps = c.lamplight.into_iter();
            let lamps = lamps.map(|l| (frame.lamps.get(l.lamp), l.radiance.sum(), l.shadow));
            let sun = c.shadow.map(|shadow| (Some(&frame.sun), c.sun, shadow));
            for (source, radiance, shadow) in sun.into_iter().chain(lamps) {
                let known = hits[k].as_ref().zip(source).and_then(|(hit, source)| {
                    let seen = || pixel_truth(self.scene, view, places[k], &rays[k], Some(hit));
                    shares_shadows.then(|| frame.share_of(source, places[k], &seen()))?
                });
                match known {
                    Some(share) => colour += radiance * share,
                    None => {
                        shadows.add(unknown.len(), Some(shadow));
                        unknown.push((k, radiance));
                    }
                }
            }
            colours.push(colour);
        }
        for i in shadows.lit(self.scene.caster) {
            let (k, radiance) = unknown[i];
            colours[k] += radiance;
        }
        sums_per_pixel(&colours, samples as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_few_samples_are_far_apart_and_begin_at_the_centre() {
        let still = Scatter {
            shift: DVec2::ZERO,
            side: DVec2::ONE,
        };
        assert_eq!(still.place(0, 4), DVec2::splat(0.5));
        for samples in [2, 3, 4, 8, 16] {
            // Distances in an endless plane of equal pixels.
            let apart = |a: u32, b: u32| {
                let d = still.place(a, samples) - still.place(b, samples);
                (d - d.round()).length()
            };
            let pairs = (0..samples).flat_map(|a| (0..a).map(move |b| (a, b)));
            let least = pairs.map(|(a, b)| apart(a, b)).fold(f64::MAX, f64::min);
            let of_squares = f64::from(samples).sqrt().recip();
            assert!(least > 0.45 * of_squares, "{samples}: {least}");
        }
    }

    /// Silhouettes would be displaced by as much as the mean place of the samples is.
    #[test]
    fn the_mean_place_of_each_sample_is_the_centre() {
        const PIXELS: u64 = 40_000;
        for samples in [1, 2, 3, 4, 9] {
            for k in 0..samples {
                let place = |pixel: u64| {
                    let scatter = Scatter::of(&mut Key::world(3).item(pixel).rng());
                    scatter.place(k, samples)
                };
                let mean = (0..PIXELS).map(place).sum::<DVec2>() / PIXELS as f64;
                let off_px = (mean - 0.5).abs().max_element();
                assert!(off_px < 0.01, "{k} of {samples}: {mean}");
            }
        }
    }

    /// What passes would be blurred beside where truth has it.
    #[test]
    fn the_mean_time_of_the_samples_is_the_middle_of_the_exposure() {
        const PIXELS: u64 = 40_000;
        for samples in [2, 3, 4, 9] {
            let further = AdditionalSamples::after_the_first(samples - 1);
            let mut times = Vec::new();
            let mut sum = 0.0;
            for pixel in 0..PIXELS {
                further.times(&mut Key::world(5).item(pixel).rng(), &mut times);
                assert_eq!(times.len(), samples as usize - 1);
                // The first one is at the middle.
                sum += times.iter().sum::<f64>() / f64::from(samples);
            }
            let mean = sum / PIXELS as f64;
            assert!(mean.abs() < 0.005, "{samples}: {mean}");
        }
    }

    proptest! {
        #[test]
        fn places_lie_in_their_pixel(
            k in 0_u32..512,
            u in -0.5..0.5,
            v in -0.5..0.5,
            left: bool,
            up: bool,
        ) {
            let side = [left, up].map(|mirrored| if mirrored { -1.0 } else { 1.0 });
            let scatter = Scatter {
                shift: DVec2::new(u, v),
                side: DVec2::from_array(side),
            };
            let at = scatter.place(k, 256);
            prop_assert!(at.cmpge(DVec2::ZERO).all() && at.cmplt(DVec2::ONE).all(), "{at}");
        }

        #[test]
        fn groups_are_the_pixels(
            chosen in prop::collection::vec(any::<bool>(), 1..6000),
            width in 1_u32..200,
            most in 1_usize..700,
        ) {
            let chosen = (0..).zip(&chosen).filter(|(_, chosen)| **chosen);
            let pixels: Vec<u32> = chosen.map(|(i, _)| i).collect();
            let groups = neighbourhoods(&pixels, width, most);
            prop_assert!(groups.iter().all(|group| (1..=most).contains(&group.len())));
            let mut all: Vec<u32> = groups.concat();
            all.sort_unstable();
            prop_assert_eq!(all, pixels);
        }
    }
}
