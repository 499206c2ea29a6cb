//! What a forester would measure on a model.

use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{Bounds, Mesh, Semantic, Triangle};

use super::ModelKind;
use super::bake::Baked;
use super::sidecar::ModelSidecar;
use crate::ImportError;

/// The height at which diameters are measured, metres.
const BREAST_M: f64 = 1.3;
/// The number of sections by which the volume of stems is measured.
const SLICES: u32 = 64;

/// How large a model is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Height above its foot, metres.
    pub height_m: f64,
    /// Half its mean width, metres.
    pub radius_m: f64,
}

/// What a forester would measure on a tree.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeMeasures {
    /// Diameter at breast height, metres: that of a circle of the same area as all stems' sections
    /// there, unless the sidecar tells it.
    pub dbh_m: f64,
    /// Height of the crown's base, metres: 98 % of the foliage is above it. Of a tree without
    /// foliage, its height.
    pub crown_base_m: f64,
    /// Crown radius, metres: the quadratic mean of the farthest foliage's in eight directions.
    pub crown_radius_m: f64,
    /// One-sided area of the foliage, m²: what the masks leave of it.
    pub leaf_area_m2: f64,
    /// Height and diameter of the stem, metres, at rising heights, measured as `dbh_m` is, and
    /// brought to it where the sidecar tells it.
    pub stem_cuts_m: Vec<[f64; 2]>,
    /// Volume of the stem above the ground, m³, by the areas of its sections.
    pub stem_volume_m3: f64,
    /// Lean of the stem from the vertical, radians.
    pub lean_rad: f64,
    /// Radius that it occupies at the ground, metres.
    pub foot_radius_m: f64,
    /// Whether it has foliage.
    pub is_alive: bool,
}

impl Extent {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let bounds = bounds(mesh);
        let size = bounds.max - bounds.min;
        Self {
            height_m: f64::from(bounds.max.z.max(0.0)),
            radius_m: f64::from(size.x + size.y) / 4.0,
        }
    }
}

fn bounds(mesh: &Mesh) -> Bounds {
    Bounds::of_points(mesh.positions.iter().copied())
}

fn is_stem(semantic: Semantic) -> bool {
    use Semantic as S;
    matches!(semantic, S::Stem | S::Limb | S::RootFlare | S::Snag)
}

fn is_foliage(semantic: Semantic) -> bool {
    matches!(semantic, Semantic::Leaf | Semantic::Needle)
}

/// The triangles of some semantics, as points.
fn triangles(
    baked: &Baked,
    keep: fn(Semantic) -> bool,
) -> impl Iterator<Item = (&Triangle, [Vec3; 3])> {
    let of = |t: &Triangle| baked.materials[usize::from(t.material.0)].semantic;
    let kept = baked.mesh.triangles.iter().filter(move |t| keep(of(t)));
    kept.map(|t| (t, t.corners.map(|c| baked.mesh.positions[c as usize])))
}

/// Moves a model so that its foot is at the origin, unless its origin is at its foot already.
pub(super) fn put_on_origin(baked: &mut Baked, kind: ModelKind, notes: &mut Vec<String>) {
    let Bounds { min, max } = bounds(&baked.mesh);
    let size = max - min;
    let deepest = match kind {
        ModelKind::Tree => 0.2,
        _ => 0.5,
    };
    let is_on_ground = min.z <= 0.02 * size.z && -min.z <= deepest * size.z;
    let mut shift = Vec3::ZERO;
    if !is_on_ground {
        shift.z = -min.z;
        notes.push(format!(
            "its lowest point, at {:.2} m, is taken for the ground",
            min.z
        ));
    }
    let middle = (min + max).truncate() / 2.0;
    let (centre, tolerance) = match kind {
        ModelKind::Tree => {
            let ground = f64::from(-shift.z) + 0.02 * f64::from(size.z);
            match stem_section(baked, ground) {
                Some(foot) => (foot.centre, (foot.area_m2.max(0.0) as f32).sqrt().max(0.1)),
                None => (middle, 0.25 * size.truncate().max_element()),
            }
        }
        _ => (middle, 0.25 * size.truncate().max_element()),
    };
    if centre.length() > tolerance {
        shift -= centre.extend(0.0);
        notes.push(format!(
            "its foot, at ({:.2}, {:.2}) m, is moved to the origin",
            centre.x, centre.y
        ));
    }
    if shift != Vec3::ZERO {
        for position in &mut baked.mesh.positions {
            *position += shift;
        }
    }
}

/// A level section of a surface.
pub(super) struct Section {
    /// The area that its outlines enclose.
    pub(super) area_m2: f64,
    /// Whether they are closed, nearly.
    pub(super) is_closed: bool,
    /// The bounds of all outlines.
    pub(super) low: Vec2,
    pub(super) high: Vec2,
    /// The middle of all outlines.
    centre: Vec2,
    /// The median of the outlines' points: the stem's middle, as long as boughs have less outline.
    axis: Vec2,
}

/// The section of the stem at a height; `None` if there is no stem.
fn stem_section(baked: &Baked, height_m: f64) -> Option<Section> {
    section(
        triangles(baked, is_stem).map(|(_, corners)| corners),
        height_m,
    )
}

/// The section of triangles at a height: the area that its outlines enclose, by Green's theorem;
/// `None` if there is nothing.
pub(super) fn section(
    triangles: impl Iterator<Item = [Vec3; 3]>,
    height_m: f64,
) -> Option<Section> {
    let z = height_m as f32;
    let mut edges: Vec<[Vec2; 2]> = Vec::new();
    for corners in triangles {
        let above = corners.map(|p| p.z >= z);
        let mut ends = (0..3).filter(|&i| above[i] != above[(i + 1) % 3]).map(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            a.truncate().lerp(b.truncate(), (z - a.z) / (b.z - a.z))
        });
        let (Some(a), Some(b)) = (ends.next(), ends.next()) else {
            continue;
        };
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .truncate();
        // Seen from above, the stem is to the left.
        let along = normal.perp();
        edges.push(if (b - a).dot(along) >= 0.0 {
            [a, b]
        } else {
            [b, a]
        });
    }
    let length: f64 = edges.iter().map(|[a, b]| f64::from(a.distance(*b))).sum();
    if length <= 0.0 || !length.is_finite() {
        return None;
    }
    let middle = |[a, b]: &[Vec2; 2]| (*a + *b).as_dvec2() / 2.0 * f64::from(a.distance(*b));
    let centre = (edges.iter().map(middle).sum::<nemoral_scene::glam::DVec2>() / length).as_vec2();
    let twice = |[a, b]: &[Vec2; 2]| (*a - centre).as_dvec2().perp_dot((*b - centre).as_dvec2());
    let area_m2 = edges.iter().map(twice).sum::<f64>().abs() / 2.0;
    let median = |of: fn(Vec2) -> f32| {
        let mut parts: Vec<(f32, f64)> = (edges.iter())
            .map(|[a, b]| (of((*a + *b) / 2.0), f64::from(a.distance(*b))))
            .collect();
        parts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut before = 0.0;
        let middle = parts.iter().find(|(_, along)| {
            before += along;
            before >= length / 2.0
        });
        middle.map_or(0.0, |(at, _)| *at)
    };
    let axis = Vec2::new(median(|p| p.x), median(|p| p.y));
    // Around closed outlines, their edges add up to nothing.
    let gap: Vec2 = edges.iter().map(|[a, b]| *b - *a).sum();
    let ends = || edges.iter().flatten();
    Some(Section {
        area_m2,
        is_closed: f64::from(gap.length()) < 0.03 * length,
        low: ends().fold(Vec2::INFINITY, |low, p| low.min(*p)),
        high: ends().fold(Vec2::NEG_INFINITY, |high, p| high.max(*p)),
        centre,
        axis,
    })
}

/// Measures a tree that stands on the origin.
pub(super) fn of_tree(
    baked: &Baked,
    sidecar: &ModelSidecar,
    extent: &Extent,
) -> Result<TreeMeasures, ImportError> {
    let height_m = extent.height_m;
    let breast_m = BREAST_M.min(height_m / 2.0);
    let breast = stem_section(baked, breast_m);
    let measured_m = (breast.as_ref())
        .map(diameter_m)
        .filter(|d| (0.005..=5.0).contains(d));
    let Some(dbh_m) = sidecar.dbh_m.or(measured_m) else {
        return Err(ImportError::file(format!(
            "its stem has no section {breast_m:.1} m above its foot that is 5 mm to 5 m wide: say \
             dbh_m in its sidecar, or which of its materials is `stem`, and check its unit (it is \
             {height_m:.2} m high)"
        )));
    };
    let lean_rad = match (
        stem_section(baked, 0.1 * height_m),
        stem_section(baked, 0.4 * height_m),
    ) {
        (Some(low), Some(high)) => {
            let aside = f64::from(low.axis.distance(high.axis));
            libm::atan2(aside, 0.3 * height_m)
        }
        _ => 0.0,
    };
    let near_ground = triangles(baked, is_stem)
        .flat_map(|(_, corners)| corners)
        .filter(|p| p.z.abs() <= 0.1)
        .map(|p| p.truncate().length());
    let foot_m = f64::from(near_ground.fold(0.0, f32::max)).min(1.5 * dbh_m);
    // By sections, as surfaces may be open at their ends.
    let slice_m = height_m / f64::from(SLICES);
    let middle_m = |i: u32| (f64::from(i) + 0.5) * slice_m;
    let area_m2 = |i: u32| stem_section(baked, middle_m(i)).map_or(0.0, |s| s.area_m2);
    let stem_volume_m3 = slice_m * (0..SLICES).map(area_m2).sum::<f64>();
    let foliage = Foliage::of(baked);
    let is_alive = foliage.area_m2 > 0.0;
    let stem_cuts_m = match measured_m {
        Some(measured_m) => stem_cuts_m(baked, [breast_m, height_m], dbh_m / measured_m),
        None => vec![[breast_m, dbh_m]],
    };
    Ok(TreeMeasures {
        dbh_m,
        stem_cuts_m,
        crown_base_m: if is_alive {
            foliage.base_m.clamp(0.0, height_m)
        } else {
            height_m
        },
        crown_radius_m: foliage.radius_m,
        leaf_area_m2: foliage.area_m2,
        stem_volume_m3,
        lean_rad,
        foot_radius_m: sidecar.radius_m.unwrap_or(foot_m.max(dbh_m / 2.0)),
        is_alive,
    })
}

/// The diameter of the circle that has the area of a section, metres.
fn diameter_m(section: &Section) -> f64 {
    (4.0 * section.area_m2.max(0.0) / std::f64::consts::PI).sqrt()
}

/// Heights and diameters of a tree's stem, times a factor: at breast height, and from a
/// two-hundredth of the tree's height up, each a tenth higher than the one below.
fn stem_cuts_m(baked: &Baked, [breast_m, height_m]: [f64; 2], factor: f64) -> Vec<[f64; 2]> {
    let rising = std::iter::successors(Some(height_m / 200.0), |z| Some(1.1 * z));
    let mut heights_m: Vec<f64> = rising.take_while(|&z| z < height_m).collect();
    heights_m.push(breast_m);
    heights_m.sort_by(f64::total_cmp);
    heights_m.dedup();
    let cut = |z: f64| {
        let diameter_m = stem_section(baked, z).map_or(0.0, |s| diameter_m(&s));
        (diameter_m > 0.0).then_some([z, factor * diameter_m])
    };
    heights_m.into_iter().filter_map(cut).collect()
}

struct Foliage {
    area_m2: f64,
    base_m: f64,
    radius_m: f64,
}

impl Foliage {
    fn of(baked: &Baked) -> Self {
        let mut parts: Vec<(f32, f64)> = Vec::new();
        let mut farthest = [0.0_f32; 8];
        for (triangle, corners) in triangles(baked, is_foliage) {
            let [a, b, c] = corners;
            let area = f64::from((b - a).cross(c - a).length()) / 2.0;
            parts.push((
                (a.z + b.z + c.z) / 3.0,
                area * opaque_share(baked, triangle),
            ));
            for p in corners {
                let octant = usize::from(p.x < 0.0)
                    | usize::from(p.y < 0.0) << 1
                    | usize::from(p.x.abs() < p.y.abs()) << 2;
                farthest[octant] = farthest[octant].max(p.truncate().length());
            }
        }
        let area_m2: f64 = parts.iter().map(|(_, area)| area).sum();
        parts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut below = 0.0;
        let base = parts.iter().find(|(_, area)| {
            below += area;
            below >= 0.02 * area_m2
        });
        Self {
            area_m2,
            base_m: base.map_or(0.0, |(z, _)| f64::from(*z)),
            radius_m: (farthest.iter().map(|&m| f64::from(m * m)).sum::<f64>() / 8.0).sqrt(),
        }
    }
}

/// The share of a triangle that its mask leaves, by a lattice of points.
fn opaque_share(baked: &Baked, triangle: &Triangle) -> f64 {
    const SIDE: u32 = 12;
    let material = &baked.materials[usize::from(triangle.material.0)];
    let Some(mask) = &material.mask else {
        return 1.0;
    };
    let [a, b, c] = triangle.corners.map(|v| baked.mesh.uv(v));
    let mut opaque = 0;
    // The middles of small triangles, of which all are equally large: those that stand on their
    // base, and those on their tip.
    let mut look = |i: u32, j: u32, third: f32| {
        let place = |n: u32| (n as f32 + third) / SIDE as f32;
        let uv = a + (b - a) * place(i) + (c - a) * place(j);
        opaque += u32::from(mask.is_opaque(uv.x, uv.y));
    };
    for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE - i).map(move |j| (i, j))) {
        look(i, j, 1.0 / 3.0);
        if i + j + 1 < SIDE {
            look(i, j, 2.0 / 3.0);
        }
    }
    f64::from(opaque) / f64::from(SIDE * SIDE)
}
