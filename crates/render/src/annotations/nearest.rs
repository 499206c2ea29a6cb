//! The nearest surface on each pixel's ray in a scene from which parts were removed.

use nemoral_scene::{Image, ObjectId, Ray, RayCaster, Semantic, TruthImages};
use rayon::prelude::*;

use super::pixel_centre;
use crate::View;

/// Distance and object of the nearest surface on the ray of each pixel's centre, in a scene from
/// which parts were removed; infinite and [`ObjectId::NONE`] where there is none.
#[must_use]
pub fn nearest_objects(
    caster: &dyn RayCaster,
    view: &View,
    max_range_m: f32,
) -> Image<(f32, ObjectId)> {
    let (width, height) = (
        view.intrinsics.width as usize,
        view.intrinsics.height as usize,
    );
    let row = |y: usize| {
        let rays: Vec<Ray> = (0..width)
            .map(|x| view.ray(pixel_centre(x, y), max_range_m))
            .collect();
        let mut hits = vec![None; width];
        caster.closest_hits(&rays, &mut hits);
        hits.into_iter().map(|hit| {
            hit.map_or((f32::INFINITY, ObjectId::NONE), |h| {
                (h.surface.distance_m, h.surface.object)
            })
        })
    };
    let pixels = (0..height).into_par_iter().flat_map_iter(row).collect();
    Image::new(width, height, pixels)
}

/// Merges the objects that rays found in a scene of some parts alone (`cast`) with those that the
/// picture shows, because on a part's border a GPU's pixel may show what the ray just misses.
/// `is_part` tells by the semantic whether a surface belongs to these parts.
#[must_use]
pub fn with_visible(
    cast: &Image<ObjectId>,
    truth: &TruthImages,
    is_part: impl Fn(Semantic) -> bool,
) -> Image<ObjectId> {
    let seen = truth.semantic.pixels().iter().zip(truth.object.pixels());
    let pixels = cast.pixels().iter().zip(seen);
    let pixels = pixels.map(|(cast, (semantic, seen))| {
        let shows = !seen.is_none() && is_part(*semantic);
        if shows { *seen } else { *cast }
    });
    Image::new(cast.width(), cast.height(), pixels.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use nemoral_scene::ChunkCoord;

    #[test]
    fn a_trunk_that_is_seen_is_the_nearest() {
        let tree = |item| ObjectId::new(ChunkCoord::new(0, 0), item).expect("in range");
        let (none, near, far) = (ObjectId::NONE, tree(1), tree(2));
        // The ray hits what the pixel shows; it misses; a leaf is in front; the stem has no object.
        let cast = [near, far, far, far];
        let shown = [near, near, near, none];
        use Semantic::{Leaf, Stem};
        let row = |objects: [ObjectId; 4]| Image::new(4, 1, objects.to_vec());
        let truth = TruthImages {
            semantic: Image::new(4, 1, vec![Stem, Stem, Leaf, Stem]),
            object: row(shown),
            depth_m: Image::new(4, 1, vec![1.0; 4]),
            normal: Image::new(4, 1, vec![Vec3::Z; 4]),
        };
        let trunks = with_visible(&row(cast), &truth, |s| s == Stem);
        assert_eq!(trunks, row([near, near, far, far]));
    }
}
