//! The agreement of LiDAR and camera, measured from the files on disk.

mod residual;
mod view;

use std::fmt;

use nemoral_scene::{Ontology, RigidTransform, Semantic};

pub use self::residual::Residual;
pub(crate) use self::view::{ClassGroups, View};

use self::view::{on_a_surface, true_position};
use crate::PlyPoint;

/// A point is comparable within this plus half the depth spread of its 3 × 3 pixels, metres …
const NEAR_M: f64 = 0.02;
/// … but not beyond this.
const FAR_M: f64 = 0.15;
/// Least agreement with the pixel over all classes.
const LEAST_OVERALL: f64 = 0.97;
/// Least agreement with one of the four pixels around over all classes.
const LEAST_NEAR: f64 = 0.985;
/// If there are fewer comparable points than [`ENOUGH`], the required share is lower by this number
/// of its standard deviations.
const CHANCE: f64 = 3.0;
/// Least agreement of a class with at least [`ENOUGH`] comparable points with one of the four
/// pixels around. It is lower than that of all, because a class may be seen only in gaps narrower
/// than a pixel, as ground is under short grass.
const LEAST_OF_CLASS: f64 = 0.92;
const ENOUGH: u64 = 1000;

/// Agreement of LiDAR points with the pixels they project to, over all frames and all pairs of
/// LiDAR and camera. Points of the sky's class are left out: they are false alarms. So are mixed
/// and mirrored returns, which lie on no surface.
///
/// A point's true position (along its measured direction, at its true range) is projected. It is
/// *comparable* if its depth differs from the pixel's by at most 2 cm plus half the depth spread of
/// the 3 × 3 pixels around, and by at most 15 cm. Otherwise camera and LiDAR, which are not at the
/// same place, see different objects.
///
/// A pixel tells what is at its centre, so a point is compared with a place up to half a pixel
/// away. Where pixels are wider than 2 mrad (1280 pixels over 104°) that distance exceeds the width
/// of thin objects. There, only points that fall on the central 2 mrad of a pixel are compared,
/// with that part of the depth spread.
///
/// Of things as small as a few pixels, such as a cobble some metres away, a large part of the
/// points lies so near a border that the pixel's centre is beyond it. So it is counted, too,
/// whether one of the four pixels whose centres are around the point has its class. What none of
/// them has, no border explains.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {
    /// By class of the point, in the ontology's order.
    pub classes: Vec<ClassAgreement>,
    /// Depth of points minus depth of pixels in the same frame, on smooth surfaces that face the
    /// sensor. It shows errors of mounts and ranges.
    pub same_frame: Residual,
    /// The same for the points of each frame in the next frame's image. It shows errors of poses.
    pub next_frame: Residual,
    /// Whether points and pixels can be expected to agree
    /// ([`LidarSpec::well_placed`](crate::LidarSpec::well_placed)).
    pub judged: bool,
}

/// Agreement of one class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClassAgreement {
    /// The class id.
    pub id: u8,
    /// Its name.
    pub name: String,
    /// Points of this class that project into an image, near enough to a pixel's centre.
    pub points: u64,
    /// Those that are comparable.
    pub comparable: u64,
    /// Those of the comparable whose pixel has the same class.
    pub same_class: u64,
    /// Those of the comparable of which one of the four pixels around has the same class.
    pub near_same_class: u64,
    /// Those of the comparable whose pixel has the same class and the same instance.
    pub same_instance: u64,
    /// What is judged of them.
    pub judged: JudgedAgreement,
}

/// Agreement up to differences that no pixel can show. Of a class that is finer than the paper's,
/// such as a twig among leaves, pixels of the other classes which the paper's class contains count
/// as well, because it may be thinner than a pixel wherever it is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JudgedAgreement {
    /// Comparable points whose pixel agrees.
    pub same: u64,
    /// Comparable points of which one of the four pixels around agrees.
    pub near: u64,
}

impl Agreement {
    /// Comparable points of all classes.
    #[must_use]
    pub fn comparable(&self) -> u64 {
        self.classes.iter().map(|c| c.comparable).sum()
    }

    /// Comparable points as a share of those that project into an image; 0 without points.
    #[must_use]
    pub fn comparable_share(&self) -> f64 {
        share(
            self.comparable(),
            self.classes.iter().map(|c| c.points).sum(),
        )
        .unwrap_or(0.0)
    }

    /// Share of the comparable points whose pixel has the same class; `None` without points.
    #[must_use]
    pub fn overall(&self) -> Option<f64> {
        share(
            self.classes.iter().map(|c| c.same_class).sum(),
            self.comparable(),
        )
    }

    /// Share of the comparable points whose class one of the four pixels around has; `None`
    /// without points.
    #[must_use]
    pub fn overall_near(&self) -> Option<f64> {
        share(
            self.classes.iter().map(|c| c.near_same_class).sum(),
            self.comparable(),
        )
    }

    /// What of [what is judged](JudgedAgreement) is worse than allowed: agreement with the pixel
    /// under 97 % overall, or with one of the four around under 98.5 % (of fewer than 1,000
    /// comparable points, by more than chance explains); with one of the four under 92 % for a
    /// class with at least 1,000; a median depth residual over 2 cm.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        if !self.judged {
            return Vec::new();
        }
        let mut failures = Vec::new();
        let percent = |x: f64| format!("{:.2} %", 100.0 * x);
        let mut judge = |name: &str, what: &str, agreement: Option<f64>, least: f64| {
            if let Some(a) = agreement.filter(|a| *a < least) {
                let (a, least) = (percent(a), percent(least));
                failures.push(format!(
                    "{name}: {a} agree with {what}, at least {least} must"
                ));
            }
        };
        let comparable = self.comparable();
        let chance = |least: f64| {
            if comparable < ENOUGH {
                CHANCE * (least * (1.0 - least) / comparable as f64).sqrt()
            } else {
                0.0
            }
        };
        let (pixel, near) = ("their pixel", "one of the four pixels around");
        let all = |of: fn(&JudgedAgreement) -> u64| {
            let agree = self.classes.iter().map(|c| of(&c.judged)).sum();
            share(agree, comparable)
        };
        for (what, found, least) in [
            (pixel, all(|j| j.same), LEAST_OVERALL),
            (near, all(|j| j.near), LEAST_NEAR),
        ] {
            judge("all classes", what, found, least - chance(least));
        }
        for c in self.classes.iter().filter(|c| c.comparable >= ENOUGH) {
            let found = share(c.judged.near, c.comparable);
            judge(&c.name, near, found, LEAST_OF_CLASS);
        }
        failures.extend(self.same_frame.failure("mounts and ranges"));
        failures.extend(self.next_frame.failure("poses"));
        failures
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent =
            |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |x| format!("{:.2} %", 100.0 * x));
        writeln!(
            f,
            "{:<14}{:>10}{:>12}{:>12}{:>12}{:>12}{:>12}",
            "agreement", "points", "comparable", "share", "class", "near", "instance"
        )?;
        for c in self.classes.iter().filter(|c| c.points > 0) {
            writeln!(
                f,
                "{:<14}{:>10}{:>12}{:>12}{:>12}{:>12}{:>12}",
                c.name,
                c.points,
                c.comparable,
                percent(share(c.comparable, c.points)),
                percent(share(c.same_class, c.comparable)),
                percent(share(c.near_same_class, c.comparable)),
                percent(share(c.same_instance, c.comparable)),
            )?;
        }
        writeln!(
            f,
            "{:<14}{:>10}{:>12}{:>12}{:>12}{:>12}",
            "all",
            self.classes.iter().map(|c| c.points).sum::<u64>(),
            self.comparable(),
            percent(Some(self.comparable_share())),
            percent(self.overall()),
            percent(self.overall_near()),
        )?;
        for (name, residual) in [
            ("same frame", &self.same_frame),
            ("next frame", &self.next_frame),
        ] {
            if let Some(median) = residual.median_m() {
                writeln!(
                    f,
                    "depth residual, {name}: median {:+.2} cm over {} points that face the sensor",
                    100.0 * median,
                    residual.points()
                )?;
            }
        }
        if !self.judged {
            writeln!(
                f,
                "not judged: points are raw, or written with errors of pointing"
            )?;
        }
        Ok(())
    }
}

fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

impl Agreement {
    pub(crate) fn new(ontology: &Ontology, judged: bool) -> Self {
        let class = |c: &nemoral_scene::Class| ClassAgreement {
            id: c.id,
            name: c.name.clone(),
            points: 0,
            comparable: 0,
            same_class: 0,
            near_same_class: 0,
            same_instance: 0,
            judged: JudgedAgreement::default(),
        };
        let sky = ontology.class(Semantic::Sky).id;
        let classes = ontology.classes().iter().filter(|c| c.id != sky);
        Self {
            classes: classes.map(class).collect(),
            judged,
            ..Self::default()
        }
    }

    /// Adds a scan and an image of the same frame.
    pub(crate) fn add(
        &mut self,
        view: &View<'_>,
        points: &[PlyPoint],
        camera_from_lidar: &RigidTransform,
    ) {
        // A mixed or mirrored return or a false alarm lies on no surface that a pixel could show.
        for p in points.iter().filter(|p| on_a_surface(p)) {
            let Some(class) = self.classes.iter_mut().find(|c| c.id == p.class) else {
                continue;
            };
            let in_camera = camera_from_lidar.transform_point(true_position(p));
            let Some(pixel) = view.pixel(in_camera) else {
                continue;
            };
            class.points += 1;
            if pixel.difference_m.abs() <= (NEAR_M + pixel.spread_m / 2.0).min(FAR_M) {
                class.comparable += 1;
                let classes = view.image.semantic.pixels();
                let near = |same: &dyn Fn(u8) -> bool| {
                    u64::from(pixel.around.iter().any(|&i| same(classes[i])))
                };
                let in_group = |of: u8| view.groups.same(of, p.class);
                class.near_same_class += near(&|of| of == p.class);
                class.judged.near += near(&in_group);
                class.judged.same += u64::from(in_group(classes[pixel.index]));
                if classes[pixel.index] == p.class {
                    class.same_class += 1;
                    let instance = view.image.instance.pixels()[pixel.index];
                    class.same_instance += u64::from(instance == p.point.object.to_image_id());
                }
            }
            self.same_frame.add(p, &pixel);
        }
    }

    /// Adds a scan and the next frame's image.
    pub(crate) fn add_next(
        &mut self,
        view: &View<'_>,
        points: &[PlyPoint],
        next_camera_from_lidar: &RigidTransform,
    ) {
        for p in points {
            let in_camera = next_camera_from_lidar.transform_point(true_position(p));
            if let Some(pixel) = view.pixel(in_camera) {
                self.next_frame.add(p, &pixel);
            }
        }
    }
}
