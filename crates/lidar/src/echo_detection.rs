//! The receiver, which turns the hits of pulses into echoes, returns and points.
//!
//! A task does each step for all of its pulses before the next step, so that the processor overlaps
//! slow operations of one pulse (a division, a random word) with those of the next pulses.

mod point;

use nemoral_scene::glam::DVec3;
use nemoral_scene::{EchoObservation, PointFlags, Ray, Semantic, SurfaceHit};
use nemoral_seed::{Domain, Draw};

use crate::air::AirFrom;
use crate::echo::{AIR, AirEcho, Echo, SubRayHit, group_hits};
use crate::pulse_batch::{PulseBatch, ScanContext};
use crate::reflection::Reflection;
use crate::water_reflection::Mirrored;

const DROPOUT: Domain = Domain::new("lidar.dropout");
const FALSE_ALARM: Domain = Domain::new("lidar.false_alarm");
const FOG: Domain = Domain::new("lidar.air");
const INTENSITY: Domain = Domain::new("lidar.intensity");
const LATER_ECHO: Domain = Domain::new("lidar.later_echo");

/// A surface that is farther than this from the plane of the labelled one counts as another
/// surface, metres.
const MIXED_M: f64 = 0.02;

/// A batch of pulses, their rays, and what the rays hit.
pub(crate) struct BatchHits<'a> {
    pub(crate) batch: &'a PulseBatch,
    pub(crate) rays: &'a [Ray],
    pub(crate) hits: &'a [Option<SurfaceHit>],
    /// What rays met by way of liquids' surfaces, in the order of rays.
    pub(crate) mirrored: Vec<Mirrored>,
}

impl BatchHits<'_> {
    /// What a ray hit that gave an echo.
    pub(crate) fn hit(&self, ray: usize) -> &SurfaceHit {
        self.hits[ray].as_ref().expect("an echo is of a hit")
    }
}

/// A return: an echo that is reported, or a false alarm.
pub(crate) struct Return {
    measured_m: f64,
    /// The number of the pulse in its batch.
    shot: u32,
    /// The number in the batch of the ray whose hit labels it; [`NO_RAY`] for a false alarm and for
    /// air.
    ray: u32,
    /// What there is without a ray.
    of_none: Semantic,
    /// The number in the batch of what that met by way of a liquid's surface.
    mirrored: Option<u32>,
    true_range_m: f32,
    intensity: f32,
    incidence_cos: f32,
    reflectivity: u8,
    return_number: u8,
    returns: u8,
    flags: PointFlags,
}

const NO_RAY: u32 = u32::MAX;

/// The echoes of a batch of pulses.
#[derive(Default)]
struct Echoes {
    sub_ray_hits: Vec<SubRayHit>,
    echoes: Vec<Echo>,
    /// The numbers of the pulses that are not lost, and where the echoes of each one end.
    ends: Vec<(u32, usize)>,
}

impl ScanContext<'_> {
    /// The returns of a batch of pulses, in their order.
    pub(crate) fn detect(&self, cast: &BatchHits<'_>) -> Vec<Return> {
        let Echoes {
            sub_ray_hits,
            echoes,
            ends,
        } = self.echoes(cast);
        let measured = self.measured(cast.batch, &echoes, &ends);
        let mut reported = Vec::with_capacity(ends.len());
        let mut seen = Vec::new();
        let mut start = 0;
        for (shot, end) in ends {
            seen.clear();
            for (echo, measured) in echoes[start..end].iter().zip(&measured[start..end]) {
                let possible = |m: &f64| (0.0..=f64::from(f32::MAX)).contains(m);
                if let Some(range_m) = measured.filter(possible) {
                    let measured_m = self.params.errors.quantised_m(range_m);
                    seen.push(Echo {
                        measured_m,
                        ..*echo
                    });
                }
            }
            start = end;
            self.params.returns.select(&mut seen);
            let returns = seen.len() as u8;
            for (return_number, echo) in (1..).zip(&seen) {
                reported.push(Return {
                    return_number,
                    returns,
                    ..self.return_of(cast, shot, echo, &sub_ray_hits)
                });
            }
            if returns == 0 && self.params.errors.false_alarm > 0.0 {
                reported.extend(self.false_alarm(cast.batch, shot));
            }
        }
        reported
    }

    /// Groups what comes back to the receiver into echoes.
    fn echoes(&self, cast: &BatchHits<'_>) -> Echoes {
        let of_shot = self.sub_rays.len();
        let dropout = self.params.errors.dropout;
        let mut all = Echoes::default();
        all.ends.reserve(cast.batch.pulses.len());
        all.sub_ray_hits.reserve(cast.batch.pulses.len());
        all.echoes.reserve(cast.batch.pulses.len());
        let mut reflection = Reflection::new(self.materials, self.params);
        for (shot, hits) in (0_u32..).zip(cast.hits.chunks(of_shot)) {
            let number = cast.batch.start + shot;
            if dropout > 0.0 && self.key_of(number, DROPOUT).rng().chance(dropout) {
                continue;
            }
            let rays = &cast.rays[shot as usize * of_shot..][..of_shot];
            let air = self.air.at_height(rays[0].origin.z.into());
            let first = all.sub_ray_hits.len();
            for (i, hit) in hits.iter().enumerate() {
                let Some(hit) = hit else { continue };
                if hit.distance_m < self.params.min_range_m {
                    continue;
                }
                let Some(left) = through(air, hit.distance_m.into(), &rays[0]) else {
                    continue;
                };
                let incidence_cos =
                    (-towards(hit, &rays[i]).dot(rays[i].direction.into())).clamp(0.0, 1.0);
                all.sub_ray_hits.push(SubRayHit {
                    ray: i,
                    mirrored: None,
                    range_m: hit.distance_m.into(),
                    sent_back: self.sub_rays[i].weight
                        * reflection.sent_back(hit, incidence_cos)
                        * left,
                    incidence_cos,
                });
            }
            let first_ray = shot as usize * of_shot;
            self.add_mirrored(cast, first_ray, air, &mut reflection, &mut all.sub_ray_hits);
            if let Some(air) = air {
                let direction = rays[0].direction.into();
                // Whatever blocks all of the beam ends the air, seen or not, and so does what
                // carries the scanner.
                let ends = hits.iter().zip(rays);
                let clear = ends.map(|(hit, ray)| hit.map_or(ray.t_max_m, |h| h.distance_m));
                let before_m = clear.fold(0.0, f32::max);
                let before_m = before_m.into();
                let of_air = |echo: AirEcho| SubRayHit {
                    ray: AIR,
                    mirrored: None,
                    range_m: echo.range_m,
                    sent_back: echo.sent_back,
                    incidence_cos: 1.0,
                };
                let rng = || self.key_of(number, FOG).rng();
                let fog = air.echo(direction, before_m, rng);
                all.sub_ray_hits.extend(fog.map(of_air));
                let key = |domain| self.key_of(number, domain);
                let see = |echo| all.sub_ray_hits.push(of_air(echo));
                air.falling(direction, before_m, key, see);
            }
            group_hits(
                &mut all.sub_ray_hits,
                first,
                self.params.beam.resolution_m,
                &mut all.echoes,
            );
            all.ends.push((shot, all.echoes.len()));
        }
        all
    }

    /// Adds what the rays of a pulse, the first of which has this number, met by way of liquids.
    fn add_mirrored(
        &self,
        cast: &BatchHits<'_>,
        first: usize,
        air: Option<AirFrom<'_>>,
        reflection: &mut Reflection<'_>,
        out: &mut Vec<SubRayHit>,
    ) {
        let end = first + self.sub_rays.len();
        let from = cast.mirrored.partition_point(|m| m.ray < first);
        let of_pulse = cast.mirrored[from..].iter().take_while(|m| m.ray < end);
        for (number, m) in (from as u32..).zip(of_pulse) {
            let Some(left) = through(air, m.range_m, &cast.rays[first]) else {
                continue;
            };
            let towards = towards(&m.met, &m.path);
            let incidence_cos = (-towards.dot(m.path.direction.into())).clamp(0.0, 1.0);
            let reflected = reflection.diffuse(&m.met) * incidence_cos;
            out.push(SubRayHit {
                ray: m.ray - first,
                mirrored: Some(number),
                range_m: m.range_m,
                sent_back: self.sub_rays[m.ray - first].weight * (reflected * m.share) * left,
                incidence_cos,
            });
        }
    }

    /// The measured range of each echo; `None` if it is not seen.
    fn measured(
        &self,
        batch: &PulseBatch,
        echoes: &[Echo],
        ends: &[(u32, usize)],
    ) -> Vec<Option<f64>> {
        let mut identities = Vec::with_capacity(echoes.len());
        for &(shot, end) in ends {
            if end > identities.len() {
                identities.resize(end, self.identity(batch.start + shot));
            }
        }
        let mut keys = self.key.items(&identities);
        let mut start = 0;
        for &(_, end) in ends {
            for (place, key) in (0..).zip(&mut keys[start..end]).skip(1) {
                *key = key.domain(LATER_ECHO).item(place);
            }
            start = end;
        }
        let observed = |echo: &Echo| {
            let cos = echo.incidence_cos;
            EchoObservation {
                range_m: echo.range_m,
                incidence_cos: cos,
                // The reflectance of a plate as wide as the beam that would reflect as much at
                // once.
                reflectance: if cos > 0.0 {
                    echo.sent_back * echo.peak_share / cos
                } else {
                    0.0
                },
            }
        };
        let observations: Vec<EchoObservation> = echoes.iter().map(observed).collect();
        let mut measured = vec![None; echoes.len()];
        self.range_model
            .measure_each(&observations, &keys, &mut measured);
        measured
    }

    /// The intensity of an echo, as the receiver measures it.
    fn intensity(&self, number: u32, echo: &Echo) -> f64 {
        let spread = self.params.errors.intensity_at_threshold;
        if spread == 0.0 || echo.sent_back <= 0.0 {
            return echo.sent_back;
        }
        let mut key = self.key_of(number, INTENSITY);
        if echo.place > 0 {
            key = key.item(echo.place.into());
        }
        let signal_to_noise = echo.peak() / self.air.weakest();
        let error = spread * key.rng().normal() / signal_to_noise.sqrt();
        (echo.sent_back * (1.0 + error)).max(0.0)
    }

    /// The return of an echo, without its number among those of its pulse.
    fn return_of(
        &self,
        cast: &BatchHits<'_>,
        shot: u32,
        echo: &Echo,
        sub_ray_hits: &[SubRayHit],
    ) -> Return {
        let of_pulse = shot as usize * self.sub_rays.len();
        let labelling = self.labelling(cast, of_pulse, echo, sub_ray_hits);
        let intensity = self.intensity(cast.batch.start + shot, echo);
        let measured = Return {
            measured_m: echo.measured_m,
            shot,
            mirrored: None,
            ray: NO_RAY,
            of_none: Semantic::AirborneEcho,
            true_range_m: echo.range_m as f32,
            intensity: intensity as f32,
            incidence_cos: 0.0,
            reflectivity: (150.0 * intensity).round() as u8,
            return_number: 0,
            returns: 0,
            flags: PointFlags(PointFlags::FALSE_ALARM),
        };
        if labelling.ray == AIR {
            return measured;
        }
        let pure = match &sub_ray_hits[echo.first..echo.end] {
            [only] => only.ray == 0,
            // One by way of a mirror is on no surface that another could share; nor is air.
            group if group.iter().any(|c| c.mirrored.is_some() || c.ray == AIR) => false,
            group => {
                let rays = &cast.rays[of_pulse..];
                let hit_of = |c: &SubRayHit| cast.hit(of_pulse + c.ray);
                let at = |c: &SubRayHit| {
                    let ray = &rays[c.ray];
                    // Rays of a beam that is wide at its exit begin beside its middle.
                    DVec3::from(ray.origin - rays[0].origin)
                        + DVec3::from(ray.direction) * f64::from(hit_of(c).distance_m)
                };
                let hit = hit_of(labelling);
                let normal = towards(hit, &rays[labelling.ray]);
                // The point lies on the middle of the beam, so the surface that it is labelled with
                // must be there, and no other.
                group.iter().any(|c| c.ray == 0)
                    && group.iter().all(|c| {
                        hit_of(c).object == hit.object
                            && hit_of(c).material == hit.material
                            && (at(c) - at(labelling)).dot(normal).abs() <= MIXED_M
                    })
            }
        };
        let mixed = if pure { 0 } else { PointFlags::MIXED };
        let mirrored = labelling.mirrored.map_or(0, |_| PointFlags::MIRRORED);
        Return {
            mirrored: labelling.mirrored,
            ray: (of_pulse + labelling.ray) as u32,
            of_none: Semantic::Sky,
            incidence_cos: echo.incidence_cos as f32,
            flags: PointFlags(mixed | mirrored),
            ..measured
        }
    }

    /// The return of a false alarm, if there is one.
    fn false_alarm(&self, batch: &PulseBatch, shot: u32) -> Option<Return> {
        let mut rng = self.key_of(batch.start + shot, FALSE_ALARM).rng();
        let raised = rng.chance(self.params.errors.false_alarm);
        let (near, far) = (self.params.min_range_m, self.params.max_range_m);
        let range_m = rng.range_f64(near.into(), far.into());
        raised.then(|| Return {
            measured_m: self.params.errors.quantised_m(range_m),
            shot,
            ray: NO_RAY,
            of_none: Semantic::Sky,
            mirrored: None,
            true_range_m: 0.0,
            intensity: 0.0,
            incidence_cos: 0.0,
            reflectivity: 0,
            return_number: 1,
            returns: 1,
            flags: PointFlags(PointFlags::FALSE_ALARM),
        })
    }
}

/// The share of light that air lets through from a range; `None` if that is too little.
fn through(air: Option<AirFrom<'_>>, range_m: f64, ray: &Ray) -> Option<f64> {
    match air {
        Some(air) => air.two_way(range_m, ray.direction.into()),
        None => Some(1.0),
    }
}

/// The normal, towards the sensor, of the flat primitive that a ray hit, because that is what stops
/// the light. It points to the outside of the shape, so it may have to be reversed.
fn towards(hit: &SurfaceHit, ray: &Ray) -> DVec3 {
    let normal: DVec3 = hit.geometric_normal.into();
    if normal.dot(ray.direction.into()) > 0.0 {
        -normal
    } else {
        normal
    }
}
