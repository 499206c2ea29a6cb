//! A log of a user: laid along x, and measured.

use nemoral_scene::Bounds;
use nemoral_scene::glam::{DMat3, DVec3, Mat3, Vec2, Vec3};

use super::bake::Baked;
use super::measure::{Section, section};
use crate::ImportError;

/// The number of sections by which the volume is measured.
const SLICES: u32 = 64;
/// Where the ends are measured: so far from them, as a share of the length, because they are often
/// broken.
const END: f64 = 0.06;
/// A log is at least so many times as long as it is wide.
const LEAST_SLENDERNESS: f64 = 1.5;

/// What a forester would measure on a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogMeasures {
    /// Its length, metres.
    pub length_m: f64,
    /// Diameters near its thick and its thin end, metres: those of circles as large as its
    /// sections.
    pub diameter_m: [f64; 2],
    /// Half of its height there, metres.
    pub half_height_m: [f64; 2],
    /// Its volume, m³, by the areas of its sections.
    pub volume_m3: f64,
}

/// Lays a log along x with its thick end at negative x, the middle of its axis at the origin, and
/// its upper side up as far as its axis lets it.
pub(super) fn lay(baked: &mut Baked, notes: &mut Vec<String>) -> Result<LogMeasures, ImportError> {
    let axis = longest_axis(baked);
    if axis.z.abs() > 0.7 {
        notes.push("it stands in its file, and is laid down".to_owned());
    }
    // By turns about the vertical and about y, which do not roll it.
    let level = axis.truncate().length();
    let heading = axis.truncate().normalize_or(nemoral_scene::glam::DVec2::X);
    let yaw = DMat3::from_cols(
        DVec3::new(heading.x, -heading.y, 0.0),
        DVec3::new(heading.y, heading.x, 0.0),
        DVec3::Z,
    );
    let pitch = DMat3::from_cols(
        DVec3::new(level, 0.0, -axis.z),
        DVec3::Y,
        DVec3::new(axis.z, 0.0, level),
    );
    turn(baked, (pitch * yaw).as_mat3());
    let (low, high) = reach(baked);
    let length_m = high - low;
    let at = |share: f64| low + share * length_m;
    let (Some(first), Some(last)) = (across(baked, at(END)), across(baked, at(1.0 - END))) else {
        return Err(ImportError::file("has no sections across its longest axis"));
    };
    if area_m2(&last) > area_m2(&first) {
        turn(baked, Mat3::from_diagonal(Vec3::new(-1.0, -1.0, 1.0)));
    }
    let (low, high) = reach(baked);
    let at = |share: f64| low + share * (high - low);
    let ends = [END, 1.0 - END].map(|share| across(baked, at(share)));
    let [Some(thick), Some(thin)] = ends else {
        return Err(ImportError::file("has no sections across its longest axis"));
    };
    let middle = (thick.middle() + thin.middle()) / 2.0;
    let shift = Vec3::new(-at(0.5) as f32, -middle.x, -middle.y);
    for position in &mut baked.mesh.positions {
        *position += shift;
    }
    let diameter = |s: &Section| (4.0 * area_m2(s) / std::f64::consts::PI).sqrt();
    let half_height = |s: &Section| f64::from(s.high.y - s.low.y) / 2.0;
    let size = Bounds::of_points(baked.mesh.positions.iter().copied());
    let width_m = f64::from((size.max - size.min).truncate().y);
    if length_m < LEAST_SLENDERNESS * width_m {
        return Err(ImportError::file(format!(
            "is {length_m:.2} m long and {width_m:.2} m wide: a log is at least \
             {LEAST_SLENDERNESS} times as long as wide"
        )));
    }
    let slice_m = length_m / f64::from(SLICES);
    let slices = (0..SLICES).map(|i| (f64::from(i) + 0.5) * slice_m - length_m / 2.0);
    let areas = slices.map(|x| across(baked, x).map_or(0.0, |s| area_m2(&s)));
    Ok(LogMeasures {
        length_m,
        diameter_m: [diameter(&thick), diameter(&thin)],
        half_height_m: [half_height(&thick), half_height(&thin)],
        volume_m3: slice_m * areas.sum::<f64>(),
    })
}

fn turn(baked: &mut Baked, rotation: Mat3) {
    let mesh = &mut baked.mesh;
    for v in mesh.positions.iter_mut().chain(&mut mesh.normals) {
        *v = rotation * *v;
    }
}

/// The least and the greatest x, metres.
fn reach(baked: &Baked) -> (f64, f64) {
    let bounds = Bounds::of_points(baked.mesh.positions.iter().copied());
    (f64::from(bounds.min.x), f64::from(bounds.max.x))
}

/// The section across the x-axis, in the plane of y and z.
fn across(baked: &Baked, x_m: f64) -> Option<Section> {
    let mesh = &baked.mesh;
    let corners = mesh.triangles.iter().map(|t| {
        t.corners.map(|c| {
            let p = mesh.positions[c as usize];
            Vec3::new(p.y, p.z, p.x)
        })
    });
    section(corners, x_m)
}

impl Section {
    fn middle(&self) -> Vec2 {
        (self.low + self.high) / 2.0
    }
}

/// The area of a section: where its outline is open, as undersides of scanned logs are, that of the
/// ellipse in its bounds.
fn area_m2(section: &Section) -> f64 {
    if section.is_closed {
        return section.area_m2;
    }
    let size = (section.high - section.low).as_dvec2();
    std::f64::consts::FRAC_PI_4 * size.x * size.y
}

/// The axis along which the surface spreads most, of length 1: the first principal axis of its
/// area, by repeated squaring of its covariance.
fn longest_axis(baked: &Baked) -> DVec3 {
    let mesh = &baked.mesh;
    let parts = || {
        mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.corners.map(|c| mesh.positions[c as usize].as_dvec3());
            ((b - a).cross(c - a).length() / 2.0, (a + b + c) / 3.0)
        })
    };
    let area: f64 = parts().map(|(area, _)| area).sum();
    let mean = parts().map(|(area, p)| area * p).sum::<DVec3>() / area.max(1e-300);
    let mut spread = DMat3::ZERO;
    for (area, p) in parts() {
        let off = p - mean;
        spread += DMat3::from_cols(off * off.x, off * off.y, off * off.z) * area;
    }
    for _ in 0..24 {
        let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
        if trace <= 0.0 || !trace.is_finite() {
            return DVec3::X;
        }
        spread *= 1.0 / trace;
        spread = spread * spread;
    }
    let columns = [spread.x_axis, spread.y_axis, spread.z_axis];
    let longest = columns
        .into_iter()
        .max_by(|a, b| a.length().total_cmp(&b.length()));
    let axis = longest.map_or(DVec3::X, |axis| axis.normalize_or(DVec3::X));
    // One of two directions: the one that points up, or else east.
    let sign = if axis.z.abs() > 1e-6 { axis.z } else { axis.x };
    if sign < 0.0 { -axis } else { axis }
}
