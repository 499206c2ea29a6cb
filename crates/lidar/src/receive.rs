//! From what the rays of pulses met to points.
//!
//! A thread does each step for all of its pulses before the next: what one pulse waits for (a division, a
//! random word) is waited for beside the next ones'.

use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{LidarPoint, ObjectId, PointFlags, Ray, RigidTransform, Semantic, SurfaceHit};
use nemoral_seed::{Domain, Draw};

use crate::EchoObservation;
use crate::echo::{Contact, Echo, group};
use crate::scan::{Piece, Scan};

const DROPOUT: Domain = Domain::new("lidar.dropout");
const FALSE_ALARM: Domain = Domain::new("lidar.false_alarm");
const LATER_ECHO: Domain = Domain::new("lidar.later_echo");

/// A surface that is this far off the plane of the strongest one is another one, metres.
const MIXED_M: f64 = 0.02;

/// Pulses and what their rays met.
pub(crate) struct Answer<'a> {
    pub(crate) piece: &'a Piece,
    pub(crate) rays: &'a [Ray],
    pub(crate) hits: &'a [Option<SurfaceHit>],
}

/// What becomes a point.
pub(crate) struct Report {
    measured_m: f64,
    /// Which of the piece's pulses.
    shot: u32,
    /// Which of the piece's rays brought most of it; [`NO_RAY`] of a false alarm.
    ray: u32,
    true_range_m: f32,
    intensity: f32,
    incidence_cos: f32,
    reflectivity: u8,
    return_number: u8,
    returns: u8,
    flags: PointFlags,
}

const NO_RAY: u32 = u32::MAX;

/// Echoes of pulses.
#[derive(Default)]
struct Echoes {
    contacts: Vec<Contact>,
    echoes: Vec<Echo>,
    /// The pulses that are not lost, and where the echoes of each end.
    ends: Vec<(u32, usize)>,
}

impl Scan<'_> {
    /// What a receiver reports of pulses, in their order.
    pub(crate) fn receive(&self, answer: &Answer<'_>) -> Vec<Report> {
        let Echoes {
            contacts,
            echoes,
            ends,
        } = self.echoes(answer);
        let measured = self.measured(answer.piece, &echoes, &ends);
        let mut reports = Vec::with_capacity(ends.len());
        let mut seen = Vec::new();
        let mut start = 0;
        for (shot, end) in ends {
            seen.clear();
            for (echo, measured) in echoes[start..end].iter().zip(&measured[start..end]) {
                if let Some(range_m) = *measured {
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
                reports.push(Report {
                    return_number,
                    returns,
                    ..self.report(answer, shot, echo, &contacts)
                });
            }
            if returns == 0 && self.params.errors.false_alarm > 0.0 {
                reports.extend(self.false_alarm(answer.piece, shot));
            }
        }
        reports
    }

    /// What comes back to the receiver.
    fn echoes(&self, answer: &Answer<'_>) -> Echoes {
        let of_shot = self.sub_rays.len();
        let dropout = self.params.errors.dropout;
        let mut all = Echoes::default();
        all.ends.reserve(answer.piece.pulses.len());
        all.contacts.reserve(answer.piece.pulses.len());
        all.echoes.reserve(answer.piece.pulses.len());
        for (shot, hits) in (0_u32..).zip(answer.hits.chunks(of_shot)) {
            let number = answer.piece.start + shot;
            if dropout > 0.0 && self.key_of(number, DROPOUT).rng().chance(dropout) {
                continue;
            }
            let rays = &answer.rays[shot as usize * of_shot..][..of_shot];
            let first = all.contacts.len();
            for (i, hit) in hits.iter().enumerate() {
                let Some(hit) = hit else { continue };
                if hit.distance_m < self.params.min_range_m {
                    continue;
                }
                let incidence_cos =
                    (-towards(hit, &rays[i]).dot(rays[i].direction.into())).clamp(0.0, 1.0);
                all.contacts.push(Contact {
                    ray: i,
                    range_m: hit.distance_m.into(),
                    sent_back: self.sub_rays[i].weight * (self.reflectance(hit) * incidence_cos),
                    incidence_cos,
                });
            }
            group(
                &mut all.contacts,
                first,
                self.params.beam.resolution_m,
                &mut all.echoes,
            );
            all.ends.push((shot, all.echoes.len()));
        }
        all
    }

    /// What the noise makes of the range of each echo.
    fn measured(&self, piece: &Piece, echoes: &[Echo], ends: &[(u32, usize)]) -> Vec<Option<f64>> {
        let mut identities = Vec::with_capacity(echoes.len());
        for &(shot, end) in ends {
            if end > identities.len() {
                identities.resize(end, self.identity(piece.start + shot));
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
                // Of a wide plate that would send back as much.
                reflectance: if cos > 0.0 { echo.sent_back / cos } else { 0.0 },
            }
        };
        let observations: Vec<EchoObservation> = echoes.iter().map(observed).collect();
        let mut measured = vec![None; echoes.len()];
        self.noise.measure_each(&observations, &keys, &mut measured);
        measured
    }

    fn reflectance(&self, hit: &SurfaceHit) -> f64 {
        let material = self.materials.get(hit.material);
        self.params.wavelength.band(material).reflectance.into()
    }

    /// The report of an echo, but for its number among its pulse's.
    fn report(&self, answer: &Answer<'_>, shot: u32, echo: &Echo, contacts: &[Contact]) -> Report {
        let strongest = &contacts[echo.strongest];
        let of_pulse = shot as usize * self.sub_rays.len();
        let (rays, hits) = (&answer.rays[of_pulse..], &answer.hits[of_pulse..]);
        let pure = match &contacts[echo.first..echo.end] {
            [only] => only.ray == 0,
            group => {
                let hit_of = |c: &Contact| hits[c.ray].as_ref().expect("a contact is a hit");
                let at = |c: &Contact| {
                    DVec3::from(rays[c.ray].direction) * f64::from(hit_of(c).distance_m)
                };
                let hit = hit_of(strongest);
                let normal = towards(hit, &rays[strongest.ray]);
                // The point is on the beam's middle: there must be what it says, and nothing else.
                group.iter().any(|c| c.ray == 0)
                    && group.iter().all(|c| {
                        hit_of(c).object == hit.object
                            && hit_of(c).material == hit.material
                            && (at(c) - at(strongest)).dot(normal).abs() <= MIXED_M
                    })
            }
        };
        Report {
            measured_m: echo.measured_m,
            shot,
            ray: (of_pulse + strongest.ray) as u32,
            true_range_m: echo.range_m as f32,
            intensity: echo.sent_back as f32,
            incidence_cos: echo.incidence_cos as f32,
            reflectivity: (150.0 * echo.sent_back).round() as u8,
            return_number: 0,
            returns: 0,
            flags: PointFlags(if pure { 0 } else { PointFlags::MIXED }),
        }
    }

    /// Something out of nothing.
    fn false_alarm(&self, piece: &Piece, shot: u32) -> Option<Report> {
        let mut rng = self.key_of(piece.start + shot, FALSE_ALARM).rng();
        let raised = rng.chance(self.params.errors.false_alarm);
        let (near, far) = (self.params.min_range_m, self.params.max_range_m);
        let range_m = rng.range_f64(near.into(), far.into());
        raised.then(|| Report {
            measured_m: self.params.errors.quantised_m(range_m),
            shot,
            ray: NO_RAY,
            true_range_m: 0.0,
            intensity: 0.0,
            incidence_cos: 0.0,
            reflectivity: 0,
            return_number: 1,
            returns: 1,
            flags: PointFlags(PointFlags::FALSE_ALARM),
        })
    }

    /// The point of a report.
    pub(crate) fn point(&self, answer: &Answer<'_>, report: &Report) -> LidarPoint {
        let shot = report.shot as usize;
        let (pulse, pose) = (&answer.piece.pulses[shot], answer.piece.pose(shot));
        // Along the pulse, not along its ray, whose f32 origin is micrometres beside the LiDAR: a
        // camera at the LiDAR's place, with the same f32 origin, looks along the pulse too.
        let in_lidar = pulse.direction * report.measured_m;
        let position = if self.params.deskew {
            let in_scene = pose.transform_point(in_lidar);
            self.lidar_from_scene.transform_point(in_scene)
        } else {
            in_lidar
        };
        let met = (report.ray != NO_RAY).then(|| {
            let ray = report.ray as usize;
            let hit = answer.hits[ray].as_ref().expect("an echo is of a hit");
            let normal = self.written(pose, towards(hit, &answer.rays[ray]));
            (
                self.materials.get(hit.material).semantic,
                hit.object,
                normal,
            )
        });
        let (semantic, object, normal) = met.unwrap_or((Semantic::Sky, ObjectId::NONE, Vec3::ZERO));
        LidarPoint {
            position_m: position.as_vec3(),
            true_range_m: report.true_range_m,
            range_m: report.measured_m as f32,
            intensity: report.intensity,
            reflectivity: report.reflectivity,
            semantic,
            object,
            ring: pulse.ring,
            return_number: report.return_number,
            returns: report.returns,
            time_offset_ns: ((pulse.time_s - self.start_s) * 1e9).round() as u32,
            pulse: answer.piece.start + report.shot,
            incidence_cos: report.incidence_cos,
            normal,
            flags: report.flags,
        }
    }

    /// A vector of the scene in the frame that points are written in.
    fn written(&self, pose: &RigidTransform, in_scene: DVec3) -> Vec3 {
        let lidar_from_scene = if self.params.deskew {
            self.lidar_from_scene
        } else {
            pose.inverse()
        };
        lidar_from_scene.transform_vector(in_scene).as_vec3()
    }
}

/// The normal of what a ray hit, towards the sensor: the flat primitive's, for it is what stops the
/// light. Its side is the shape's, so it is turned.
fn towards(hit: &SurfaceHit, ray: &Ray) -> DVec3 {
    let normal: DVec3 = hit.geometric_normal.into();
    if normal.dot(ray.direction.into()) > 0.0 {
        -normal
    } else {
        normal
    }
}
