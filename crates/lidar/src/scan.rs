//! One scan.

use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    LidarPoint, MaterialLibrary, ObjectId, PointFlags, Ray, RayCaster, RigidTransform, Semantic,
    SurfaceHit,
};
use nemoral_seed::{Draw, Key, Stage};
use rayon::prelude::*;

use crate::beam::{BeamAxes, SubRay, turned};
use crate::echo::{Contact, Echo, group};
use crate::{EchoObservation, Pulse, RangeModel, ScanPattern, ScannerParams};

/// Rays cast together, at the most: enough that a caster finds many alike, and a usual scan in one.
const MOST_RAYS: u32 = 50 << 10;

/// Pulses that one thread works on.
const PIECE: usize = 1024;

const JITTER: Stage = Stage::new("lidar.jitter");
const DROPOUT: Stage = Stage::new("lidar.dropout");
const FALSE_ALARM: Stage = Stage::new("lidar.false_alarm");
const LATER_ECHO: Stage = Stage::new("lidar.later_echo");

/// A surface that is this far off the plane of the strongest one is another one, metres.
const MIXED_M: f64 = 0.02;

/// What the pulses of one scan have in common.
pub(crate) struct Scan<'a> {
    pub(crate) params: &'a ScannerParams,
    pub(crate) pattern: &'a dyn ScanPattern,
    pub(crate) sub_rays: &'a [SubRay],
    pub(crate) first_pulse: u64,
    /// When the first pulse fires, in the pattern's time.
    pub(crate) start_s: f64,
    /// The frame's time, in the pattern's.
    pub(crate) middle_s: f64,
    /// At the frame's time.
    pub(crate) lidar_from_scene: RigidTransform,
    pub(crate) caster: &'a dyn RayCaster,
    pub(crate) materials: &'a MaterialLibrary,
    pub(crate) scene_from_lidar_at: &'a (dyn Fn(f64) -> RigidTransform + Sync),
    pub(crate) noise: &'a dyn RangeModel,
    pub(crate) key: Key,
}

/// A pulse on its way.
struct Shot {
    /// Its number in the scan.
    number: u32,
    pulse: Pulse,
    /// Which of its piece's poses the LiDAR has when it fires.
    pose: u32,
    /// Where it really goes, in the LiDAR frame.
    direction: DVec3,
}

/// Pulses that one thread works on.
struct Piece {
    shots: Vec<Shot>,
    /// Scene from LiDAR, of each moment of firing.
    poses: Vec<RigidTransform>,
}

/// Buffers that the pulses of a batch share.
#[derive(Default)]
struct Scratch {
    contacts: Vec<Contact>,
    echoes: Vec<Echo>,
}

/// A pulse and what its rays met.
struct Echoing<'a> {
    shot: &'a Shot,
    /// Scene from LiDAR.
    pose: &'a RigidTransform,
    rays: &'a [Ray],
    hits: &'a [Option<SurfaceHit>],
}

impl Scan<'_> {
    /// All points, in the order of firing.
    pub(crate) fn points(&self) -> Vec<LidarPoint> {
        let pulses = self.params.pulses_per_scan;
        let together = (MOST_RAYS / self.sub_rays.len() as u32).max(1);
        let mut points = Vec::with_capacity(pulses as usize);
        for start in (0..pulses).step_by(together as usize) {
            self.fire(start, together.min(pulses - start), &mut points);
        }
        points
    }

    /// Adds the points of `count` pulses from the `start`-th of the scan on.
    fn fire(&self, start: u32, count: u32, points: &mut Vec<LidarPoint>) {
        let of_shot = self.sub_rays.len();
        let nothing = Ray::new(Vec3::ZERO, Vec3::X);
        let mut rays = vec![nothing; count as usize * of_shot];
        let of_piece = PIECE * of_shot;
        let aim = |(i, rays): (usize, &mut [Ray])| {
            let piece = self.piece(start + (i * PIECE) as u32, (rays.len() / of_shot) as u32);
            self.aim(&piece, rays);
            piece
        };
        let pieces = rays.par_chunks_mut(of_piece).enumerate().map(aim);
        let pieces: Vec<Piece> = pieces.collect();
        let mut hits = vec![None; rays.len()];
        self.caster.closest_surfaces(&rays, &mut hits);
        let answers = rays.par_chunks(of_piece).zip(hits.par_chunks(of_piece));
        let receive = |(piece, (rays, hits)): (&Piece, (&[Ray], &[Option<SurfaceHit>]))| {
            let mut points = Vec::with_capacity(piece.shots.len());
            let mut scratch = Scratch::default();
            let answers = rays.chunks(of_shot).zip(hits.chunks(of_shot));
            for (shot, (rays, hits)) in piece.shots.iter().zip(answers) {
                let pose = &piece.poses[shot.pose as usize];
                self.receive(
                    &Echoing {
                        shot,
                        pose,
                        rays,
                        hits,
                    },
                    &mut scratch,
                    &mut points,
                );
            }
            points
        };
        let received: Vec<Vec<LidarPoint>> = pieces.par_iter().zip(answers).map(receive).collect();
        for piece in received {
            points.extend_from_slice(&piece);
        }
    }

    fn piece(&self, start: u32, count: u32) -> Piece {
        // Lasers that fire together share a pose, and poses may cost more than rays.
        let mut fired_s = f64::NAN;
        let mut poses = Vec::new();
        let pulses = self.pattern.pulses(self.in_pattern(start), count);
        let shot = |(number, pulse): (u32, Pulse)| {
            if pulse.time_s != fired_s {
                fired_s = pulse.time_s;
                poses.push((self.scene_from_lidar_at)(fired_s - self.middle_s));
            }
            Shot {
                number,
                pulse,
                pose: poses.len() as u32 - 1,
                direction: self.jittered(number, pulse.direction),
            }
        };
        let shots = (start..).zip(pulses).map(shot).collect();
        Piece { shots, poses }
    }

    /// The number in the pattern of a pulse of the scan.
    fn in_pattern(&self, number: u32) -> u64 {
        self.first_pulse.wrapping_add(number.into())
    }

    /// A key of a pulse for one purpose.
    fn key_of(&self, number: u32, stage: Stage) -> Key {
        self.pulse_key(number).stage(stage)
    }

    fn pulse_key(&self, number: u32) -> Key {
        self.key
            .item(self.pattern.identity(self.in_pattern(number)))
    }

    fn jittered(&self, number: u32, direction: DVec3) -> DVec3 {
        let sigma = self.params.errors.angular_sigma_rad;
        if sigma == 0.0 {
            return direction;
        }
        let mut rng = self.key_of(number, JITTER).rng();
        turned(direction, sigma * rng.normal(), sigma * rng.normal())
    }

    /// Makes the rays of pulses, in the scene.
    fn aim(&self, piece: &Piece, rays: &mut [Ray]) {
        let of_shots = rays.chunks_mut(self.sub_rays.len());
        for (shot, rays) in piece.shots.iter().zip(of_shots) {
            let scene_from_lidar = &piece.poses[shot.pose as usize];
            let in_scene = |v| scene_from_lidar.transform_vector(v);
            let ray = |direction: DVec3| Ray {
                origin: scene_from_lidar.translation_m.as_vec3(),
                direction: direction.as_vec3(),
                // From 0, not from the blind zone: what is there blocks the pulse.
                t_min_m: 0.0,
                t_max_m: self.params.max_range_m,
            };
            if let [only] = rays {
                *only = ray(in_scene(shot.direction));
                continue;
            }
            let axes = BeamAxes::along(shot.direction).map(in_scene);
            for (ray_of_part, part) in rays.iter_mut().zip(self.sub_rays) {
                *ray_of_part = ray(axes.towards(part));
            }
        }
    }

    /// Adds the points of one pulse.
    fn receive(&self, from: &Echoing<'_>, scratch: &mut Scratch, points: &mut Vec<LidarPoint>) {
        let errors = &self.params.errors;
        let lost = errors.dropout > 0.0
            && (self.key_of(from.shot.number, DROPOUT).rng()).chance(errors.dropout);
        if lost {
            return;
        }
        self.measure(from, scratch);
        let returns = scratch.echoes.len() as u8;
        for (return_number, echo) in (1..).zip(&scratch.echoes) {
            points.push(LidarPoint {
                return_number,
                returns,
                ..self.point(from, echo, &scratch.contacts)
            });
        }
        if returns == 0 && errors.false_alarm > 0.0 {
            points.extend(self.false_alarm(from));
        }
    }

    /// Leaves in `scratch.echoes` what a pulse reports.
    fn measure(&self, from: &Echoing<'_>, scratch: &mut Scratch) {
        let Scratch { contacts, echoes } = scratch;
        let Echoing {
            shot, rays, hits, ..
        } = from;
        contacts.clear();
        for (i, hit) in hits.iter().enumerate() {
            let Some(hit) = hit else { continue };
            if hit.distance_m < self.params.min_range_m {
                continue;
            }
            let incidence_cos =
                (-towards(hit, &rays[i]).dot(rays[i].direction.into())).clamp(0.0, 1.0);
            contacts.push(Contact {
                ray: i,
                range_m: hit.distance_m.into(),
                sent_back: self.sub_rays[i].weight * (self.reflectance(hit) * incidence_cos),
                incidence_cos,
            });
        }
        group(contacts, self.params.beam.resolution_m, echoes);
        let key = self.pulse_key(shot.number);
        let mut place = 0;
        echoes.retain_mut(|echo| {
            let key = match place {
                0 => key,
                later => key.stage(LATER_ECHO).item(later),
            };
            place += 1;
            let cos = echo.incidence_cos;
            let observation = EchoObservation {
                range_m: echo.range_m,
                incidence_cos: cos,
                // Of a wide plate that would send back as much.
                reflectance: if cos > 0.0 { echo.sent_back / cos } else { 0.0 },
            };
            match self.noise.measure(&observation, key) {
                Some(range_m) => {
                    echo.measured_m = self.params.errors.quantised_m(range_m);
                    true
                }
                None => false,
            }
        });
        self.params.returns.select(echoes);
    }

    fn reflectance(&self, hit: &SurfaceHit) -> f64 {
        let material = self.materials.get(hit.material);
        self.params.wavelength.band(material).reflectance.into()
    }

    /// The point of an echo, but for its number among its pulse's.
    fn point(&self, from: &Echoing<'_>, echo: &Echo, contacts: &[Contact]) -> LidarPoint {
        let Echoing { rays, hits, .. } = from;
        let part = contacts[echo.strongest].ray;
        let hit = hits[part].as_ref().expect("a contact is a hit");
        let normal = towards(hit, &rays[part]);
        // The point is on the beam's middle: there must be what it says, and nothing else.
        let hit_of = |c: &Contact| hits[c.ray].as_ref().expect("a contact is a hit");
        let at = |c: &Contact| DVec3::from(rays[c.ray].direction) * f64::from(hit_of(c).distance_m);
        let strongest = &contacts[echo.strongest];
        let group = &contacts[echo.first..echo.end];
        let pure = group.iter().any(|c| c.ray == 0)
            && group.iter().all(|c| {
                hit_of(c).object == hit.object
                    && hit_of(c).material == hit.material
                    && (at(c) - at(strongest)).dot(normal).abs() <= MIXED_M
            });
        LidarPoint {
            true_range_m: echo.range_m as f32,
            range_m: echo.measured_m as f32,
            intensity: echo.sent_back as f32,
            reflectivity: (150.0 * echo.sent_back).round() as u8,
            semantic: self.materials.get(hit.material).semantic,
            object: hit.object,
            incidence_cos: echo.incidence_cos as f32,
            normal: self.written(from, normal),
            flags: PointFlags(if pure { 0 } else { PointFlags::MIXED }),
            ..self.blank(from, echo.measured_m)
        }
    }

    /// A point out of nothing.
    fn false_alarm(&self, from: &Echoing<'_>) -> Option<LidarPoint> {
        let mut rng = self.key_of(from.shot.number, FALSE_ALARM).rng();
        let raised = rng.chance(self.params.errors.false_alarm);
        let (near, far) = (self.params.min_range_m, self.params.max_range_m);
        let range_m = rng.range_f64(near.into(), far.into());
        raised.then(|| LidarPoint {
            return_number: 1,
            returns: 1,
            flags: PointFlags(PointFlags::FALSE_ALARM),
            ..self.blank(from, self.params.errors.quantised_m(range_m))
        })
    }

    /// A point of a pulse where nothing is, at a measured range.
    fn blank(&self, from: &Echoing<'_>, range_m: f64) -> LidarPoint {
        let Echoing { shot, pose, .. } = from;
        // Along the pulse, not along its ray, whose f32 origin is micrometres beside the LiDAR: a
        // camera at the LiDAR's place, with the same f32 origin, looks along the pulse too.
        let in_lidar = shot.pulse.direction * range_m;
        let position = if self.params.deskew {
            let in_scene = pose.transform_point(in_lidar);
            self.lidar_from_scene.transform_point(in_scene)
        } else {
            in_lidar
        };
        LidarPoint {
            position_m: position.as_vec3(),
            true_range_m: 0.0,
            range_m: range_m as f32,
            intensity: 0.0,
            reflectivity: 0,
            semantic: Semantic::Sky,
            object: ObjectId::NONE,
            ring: shot.pulse.ring,
            return_number: 0,
            returns: 0,
            time_offset_ns: ((shot.pulse.time_s - self.start_s) * 1e9).round() as u32,
            pulse: shot.number,
            incidence_cos: 0.0,
            normal: Vec3::ZERO,
            flags: PointFlags::default(),
        }
    }

    /// A vector of the scene in the frame that points are written in.
    fn written(&self, from: &Echoing<'_>, in_scene: DVec3) -> Vec3 {
        let lidar_from_scene = if self.params.deskew {
            self.lidar_from_scene
        } else {
            from.pose.inverse()
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
