//! A forest as triangles and instances, which every caster but ours takes.

use std::collections::HashMap;
use std::sync::Arc;

use nemoral_raycast::{Blas, Group};
use nemoral_scene::glam::{DMat3, DVec3, Mat3, Vec2, Vec3};
use nemoral_scene::{AlphaMask, MaterialLibrary};

/// A triangle with its mask.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub(crate) corners: [Vec3; 3],
    pub(crate) uvs: [Vec2; 3],
    /// Index into [`Placed::masks`].
    pub(crate) mask: Option<u32>,
}

impl Triangle {
    pub(crate) fn uv(&self, u: f32, v: f32) -> Vec2 {
        let [a, b, c] = self.uvs;
        a + (b - a) * u + (c - a) * v
    }

    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        let [a, b, c] = self.corners;
        (a.min(b).min(c), a.max(b).max(c))
    }
}

/// An instance of a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instance {
    pub(crate) shape: usize,
    pub(crate) linear: Mat3,
    pub(crate) position: DVec3,
}

impl Instance {
    pub(crate) fn inverse(&self) -> DMat3 {
        self.linear.as_dmat3().inverse()
    }

    /// The bounds in the scene of a box of the shape.
    pub(crate) fn bounds(&self, (min, max): (Vec3, Vec3)) -> (DVec3, DVec3) {
        let linear = self.linear.as_dmat3();
        let size = DMat3::from_cols(
            linear.x_axis.abs(),
            linear.y_axis.abs(),
            linear.z_axis.abs(),
        );
        let centre = linear * ((min + max).as_dvec3() / 2.0) + self.position;
        let half = size * ((max - min).as_dvec3() / 2.0);
        (centre - half, centre + half)
    }
}

/// Shapes, instances and masks. A card is two triangles.
#[derive(Debug, Default)]
pub(crate) struct Placed {
    pub(crate) shapes: Vec<Vec<Triangle>>,
    pub(crate) instances: Vec<Instance>,
    pub(crate) masks: Vec<Arc<AlphaMask>>,
}

impl Placed {
    pub(crate) fn new(groups: &[(Vec3, Arc<Group>)], materials: &MaterialLibrary) -> Self {
        let mut placed = Self::default();
        let mut numbers = Vec::new();
        for material in materials.materials() {
            numbers.push(material.mask.as_ref().map(|mask| {
                placed.masks.push(Arc::clone(mask));
                (placed.masks.len() - 1) as u32
            }));
        }
        let mut known: HashMap<*const Blas, usize> = HashMap::new();
        for (offset, group) in groups {
            for (instance, blas) in group.instances() {
                let shape = *known.entry(Arc::as_ptr(blas)).or_insert_with(|| {
                    placed.shapes.push(triangles(blas, &numbers));
                    placed.shapes.len() - 1
                });
                placed.instances.push(Instance {
                    shape,
                    linear: instance.linear,
                    position: offset.as_dvec3() + instance.position_m.as_dvec3(),
                });
            }
        }
        placed
    }

    /// The same with each tall shape cut in two, as a trunk under its crown, at the height that
    /// reduces the side area of the bounds most.
    pub(crate) fn cut(&self) -> Self {
        let mut shapes = Vec::new();
        let mut parts = Vec::new();
        for shape in &self.shapes {
            let first = shapes.len();
            shapes.extend(halves(shape));
            parts.push(first..shapes.len());
        }
        let split = |i: &Instance| {
            let i = *i;
            parts[i.shape]
                .clone()
                .map(move |shape| Instance { shape, ..i })
        };
        Self {
            instances: self.instances.iter().flat_map(split).collect(),
            shapes,
            masks: self.masks.clone(),
        }
    }

    /// All triangles of all instances.
    pub(crate) fn triangle_count(&self) -> usize {
        let of = |i: &Instance| self.shapes[i.shape].len();
        self.instances.iter().map(of).sum()
    }
}

pub(crate) fn bounds_of(triangles: &[Triangle]) -> (Vec3, Vec3) {
    let join = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    triangles.iter().map(Triangle::bounds).fold(none, join)
}

fn triangles(blas: &Blas, masks: &[Option<u32>]) -> Vec<Triangle> {
    let mesh = blas.prototype().mesh();
    let mut all = Vec::new();
    for t in &mesh.triangles {
        all.push(Triangle {
            corners: t.corners.map(|i| mesh.positions[i as usize]),
            uvs: t.corners.map(|i| mesh.uvs[i as usize]),
            mask: masks[usize::from(t.material.0)],
        });
    }
    for card in blas.prototype().cards() {
        let at = |uv: Vec2| card.corner + card.edge_u * uv.x + card.edge_v * uv.y;
        let [o, x, y, one] = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
        for uvs in [[o, x, y], [one, y, x]] {
            all.push(Triangle {
                corners: uvs.map(at),
                uvs,
                mask: masks[usize::from(card.material.0)],
            });
        }
    }
    all
}

fn halves(shape: &[Triangle]) -> Vec<Vec<Triangle>> {
    let mut order = shape.to_vec();
    let middle = |t: &Triangle| t.bounds().0.z + t.bounds().1.z;
    order.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
    let side = |b: &mut (Vec3, Vec3), t: &Triangle| {
        let (min, max) = t.bounds();
        *b = (b.0.min(min), b.1.max(max));
        let d = b.1 - b.0;
        Some((d.x + d.y) * d.z)
    };
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let below: Vec<f32> = order.iter().scan(none, side).collect();
    let above: Vec<f32> = order.iter().rev().scan(none, side).collect();
    let n = order.len();
    let best = (1..n)
        .map(|k| (below[k - 1] + above[n - 1 - k], k))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((area, k)) if area < 0.8 * below[n - 1] => {
            let top = order.split_off(k);
            vec![order, top]
        }
        _ => vec![order],
    }
}
