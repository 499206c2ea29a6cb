//! The agreement of LiDAR and camera, measured from the files on disk.

use std::fmt;

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{Image, Ontology, PointFlags, RigidTransform, Semantic, Twist};

use crate::reader::CameraFrame;
use crate::{CameraSpec, DepthFormat, PlyPoint};

/// A pixel up to this width is compared with all points that fall on it, radians; it is that of
/// 1280 pixels over 104°. Of a wider pixel only a central part of this width is compared, because a
/// blade of grass may lie between its centre and its border.
const PIXEL_RAD: f64 = 2e-3;
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
/// The median of a residual is judged if it comes from at least this many points, and must not
/// exceed [`MOST_RESIDUAL_M`].
const ENOUGH_RESIDUALS: usize = 100;
const MOST_RESIDUAL_M: f64 = 0.02;
/// Residuals are counted up to this, metres …
const GREATEST_RESIDUAL_M: f64 = 0.5;
/// … in steps of a twentieth of a millimetre. Zero, the limit of what is allowed, and the limits
/// of what rounds to the same tenth of a millimetre lie between two steps, so that a median is
/// judged and printed as if all residuals were kept.
const STEPS_PER_M: f64 = 20_000.0;
/// The number of the step that begins at 0.
const STEP_OF_ZERO: usize = (GREATEST_RESIDUAL_M * STEPS_PER_M) as usize;

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

/// A depth residual.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual {
    /// How many residuals within half a metre each step has, from the lowest on; empty without
    /// any.
    counts: Vec<u64>,
}

impl Residual {
    /// The number of points in it.
    #[must_use]
    pub fn points(&self) -> usize {
        self.counts.iter().sum::<u64>() as usize
    }

    /// The median within a fortieth of a millimetre, metres; `None` without points.
    #[must_use]
    pub fn median_m(&self) -> Option<f64> {
        let middle = self.counts.iter().sum::<u64>() / 2;
        let mut below = 0;
        let step = self.counts.iter().position(|count| {
            below += count;
            below > middle
        })?;
        // The middle of the step.
        Some((step as f64 - STEP_OF_ZERO as f64 + 0.5) / STEPS_PER_M)
    }

    fn failure(&self, what: &str) -> Option<String> {
        let median = self.median_m()?;
        (self.points() >= ENOUGH_RESIDUALS && median.abs() > MOST_RESIDUAL_M).then(|| {
            format!(
                "{what}: points lie {:.1} cm behind their pixels (median), at most {:.0} cm are \
                 allowed",
                100.0 * median,
                100.0 * MOST_RESIDUAL_M
            )
        })
    }
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

/// One camera's images, prepared for look-ups.
pub(crate) struct View<'a> {
    pub(crate) camera: &'a CameraSpec,
    /// How the camera moved.
    pub(crate) motion: Twist,
    pub(crate) image: &'a CameraFrame,
    pub(crate) format: DepthFormat,
    pub(crate) groups: &'a ClassGroups,
}

/// Which classes are judged together.
pub(crate) struct ClassGroups([u16; 256]);

impl ClassGroups {
    /// Those of an ontology: all semantics of which the paper has in one class.
    pub(crate) fn of(ontology: &Ontology) -> Self {
        let paper = Ontology::paper();
        let common = |id: usize| {
            let semantics = Semantic::ALL.iter();
            let semantics = semantics.filter(|s| usize::from(ontology.class(**s).id) == id);
            let mut papers = semantics.map(|s| u16::from(paper.class(*s).id));
            let first = papers.next()?;
            papers.all(|other| other == first).then_some(first)
        };
        // Any other class is a group of its own.
        Self(std::array::from_fn(|id| {
            common(id).unwrap_or(256 + id as u16)
        }))
    }

    fn same(&self, a: u8, b: u8) -> bool {
        self.0[usize::from(a)] == self.0[usize::from(b)]
    }
}

/// The pixel on which a point falls.
struct Pixel {
    index: usize,
    /// The four whose centres are around the point's place; at a border twice the same.
    around: [usize; 4],
    /// The point's depth less the pixel's, both at the time when the camera reads the row.
    difference_m: f64,
    /// Depth range of those of the 3 × 3 pixels that hold a surface; of a wide pixel, scaled to the
    /// part of it that is compared.
    spread_m: f64,
    /// Whether all nine pixels hold a surface.
    filled: bool,
}

impl View<'_> {
    fn pixel(&self, in_camera: DVec3) -> Option<Pixel> {
        let (k, shutter) = (&self.camera.intrinsics, &self.camera.shutter);
        let place = k.project_moving(in_camera, shutter, &self.motion)?;
        let at: DVec2 = place.floor();
        let (w, h) = (f64::from(k.width), f64::from(k.height));
        if !(at.x >= 0.0 && at.y >= 0.0 && at.x < w && at.y < h) {
            return None;
        }
        let part = (PIXEL_RAD * k.fx.min(k.fy)).min(1.0);
        if (place - at - 0.5).abs().max_element() > 0.5 * part {
            return None;
        }
        let depth: &Image<f32> = &self.image.depth_m;
        let (column, row) = (at.x as usize, at.y as usize);
        let (mut low, mut high, mut count) = (f32::INFINITY, f32::NEG_INFINITY, 0);
        for y in row.saturating_sub(1)..=(row + 1).min(depth.height() - 1) {
            for x in column.saturating_sub(1)..=(column + 1).min(depth.width() - 1) {
                let z = *depth.at(x, y);
                if z > 0.0 {
                    (low, high, count) = (low.min(z), high.max(z), count + 1);
                }
            }
        }
        let near = (place - 0.5).floor();
        let clamped = |at: f64, size: usize| (at.max(0.0) as usize).min(size - 1);
        let around = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(x, y)| {
            clamped(near.y + y, depth.height()) * depth.width() + clamped(near.x + x, depth.width())
        });
        let z = *depth.at(column, row);
        let then = self.motion.after(shutter.row_time_s(at.y + 0.5, k.height));
        let point_z = then.inverse().transform_point(in_camera).z;
        let saturated = self.format == DepthFormat::Png16 && z >= 65535.0 / 256.0;
        (z > 0.0 && !saturated).then(|| Pixel {
            index: row * depth.width() + column,
            around,
            difference_m: point_z - f64::from(z),
            spread_m: part * f64::from(high - low),
            filled: count == 9,
        })
    }
}

fn on_a_surface(p: &PlyPoint) -> bool {
    let on_none = PointFlags::MIXED | PointFlags::FALSE_ALARM | PointFlags::MIRRORED;
    !p.point.flags.has(on_none)
}

/// The true position of a point in the LiDAR's frame: its direction, at its true range. The
/// difference of ranges is added, rather than the direction scaled, because a deskewed point was
/// measured from a place slightly off the frame's origin.
pub(crate) fn true_position(p: &PlyPoint) -> DVec3 {
    let measured = p.point.position_m.as_dvec3();
    let error = f64::from(p.point.range_m) - f64::from(p.point.true_range_m);
    measured - measured.normalize_or_zero() * error
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

impl Residual {
    fn add(&mut self, p: &PlyPoint, pixel: &Pixel) {
        let facing = p.point.incidence_cos >= 0.7 && on_a_surface(p);
        let smooth = pixel.filled && pixel.spread_m <= 0.1;
        if facing && smooth {
            self.count(pixel.difference_m);
        }
    }

    /// Counts a residual that is small enough.
    fn count(&mut self, residual_m: f64) {
        if residual_m.abs() <= GREATEST_RESIDUAL_M {
            let step = (residual_m * STEPS_PER_M).floor() + STEP_OF_ZERO as f64;
            self.counts.resize(2 * STEP_OF_ZERO + 1, 0);
            self.counts[step as usize] += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_judged_and_printed_as_the_exact_one() {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for middle_m in [-0.31, -0.02, -4e-4, -2e-5, 0.0, 3e-5, 1e-3, 0.02, 0.49] {
            for width_m in [1e-5, 1e-3, 0.2] {
                let values: Vec<f64> = (0..501).map(|_| middle_m + width_m * noise()).collect();
                let mut residual = Residual::default();
                values.iter().for_each(|&value| residual.count(value));
                let mut kept: Vec<f64> = values.into_iter().filter(|v| v.abs() <= 0.5).collect();
                kept.sort_by(f64::total_cmp);
                assert_eq!(residual.points(), kept.len());
                let (exact, found) = (kept[kept.len() / 2], residual.median_m());
                let found = found.expect("some are kept");
                assert!((found - exact).abs() <= 2.5e-5 + 1e-12, "{found} {exact}");
                let printed = |m: f64| format!("{:+.2} cm, {:.1} cm", 100.0 * m, 100.0 * m);
                assert_eq!(printed(found), printed(exact));
                assert_eq!(found.abs() > MOST_RESIDUAL_M, exact.abs() > MOST_RESIDUAL_M);
            }
        }
        assert_eq!(Residual::default().median_m(), None);
        let mut ends = Residual::default();
        for residual_m in [-0.5, 0.5, 0.500_001, f64::NAN] {
            ends.count(residual_m);
        }
        assert_eq!(ends.points(), 2);
    }

    #[test]
    fn finer_classes_are_judged_with_those_of_their_kind() {
        let together = |ontology: &Ontology, a: Semantic, b: Semantic| {
            ClassGroups::of(ontology).same(ontology.class(a).id, ontology.class(b).id)
        };
        let (twig, leaf, stem) = (Semantic::Twig, Semantic::Leaf, Semantic::Stem);
        assert!(together(&Ontology::semantics(), twig, leaf));
        assert!(!together(&Ontology::semantics(), twig, stem));
        for ontology in [Ontology::paper(), Ontology::fuel()] {
            let groups = ClassGroups::of(&ontology);
            for a in ontology.classes() {
                for b in ontology.classes() {
                    assert_eq!(groups.same(a.id, b.id), a.id == b.id);
                }
            }
        }
    }
}
