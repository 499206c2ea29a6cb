//! Where points fall on the images of a camera, and which classes count as the same there.

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{Image, Ontology, PointFlags, Semantic, Twist};

use crate::reader::CameraFrame;
use crate::{CameraSpec, DepthFormat, PlyPoint};

/// A pixel up to this width is compared with all points that fall on it, radians; it is that of
/// 1280 pixels over 104°. Of a wider pixel only a central part of this width is compared, because a
/// blade of grass may lie between its centre and its border.
const PIXEL_RAD: f64 = 2e-3;

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

    pub(super) fn same(&self, a: u8, b: u8) -> bool {
        self.0[usize::from(a)] == self.0[usize::from(b)]
    }
}

/// The pixel on which a point falls.
pub(super) struct Pixel {
    pub(super) index: usize,
    /// The four whose centres are around the point's place; at a border twice the same.
    pub(super) around: [usize; 4],
    /// The point's depth less the pixel's, both at the time when the camera reads the row.
    pub(super) difference_m: f64,
    /// Depth range of those of the 3 × 3 pixels that hold a surface; of a wide pixel, scaled to the
    /// part of it that is compared.
    pub(super) spread_m: f64,
    /// Whether all nine pixels hold a surface.
    pub(super) filled: bool,
}

impl View<'_> {
    pub(super) fn pixel(&self, in_camera: DVec3) -> Option<Pixel> {
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
        let saturated = self.format.farthest_m().is_some_and(|most| z >= most);
        (z > 0.0 && !saturated).then(|| Pixel {
            index: row * depth.width() + column,
            around,
            difference_m: point_z - f64::from(z),
            spread_m: part * f64::from(high - low),
            filled: count == 9,
        })
    }
}

pub(super) fn on_a_surface(p: &PlyPoint) -> bool {
    let on_none = PointFlags::MIXED | PointFlags::FALSE_ALARM | PointFlags::MIRRORED;
    !p.point.flags.has(on_none)
}

/// The true position of a point in the LiDAR's frame: its direction, at its true range. The
/// difference of ranges is added, rather than the direction scaled, because a deskewed point was
/// measured from a place slightly off the frame's origin.
pub(super) fn true_position(p: &PlyPoint) -> DVec3 {
    let measured = p.point.position_m.as_dvec3();
    let error = f64::from(p.point.range_m) - f64::from(p.point.true_range_m);
    measured - measured.normalize_or_zero() * error
}

#[cfg(test)]
mod tests {
    use super::*;

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
