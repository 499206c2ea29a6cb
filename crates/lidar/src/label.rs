//! What an echo is labelled as: the surface that gave most of its light.

use nemoral_scene::{ObjectId, Semantic};

use crate::echo::{AIR, Echo, SubRayHit};
use crate::echo_detection::BatchHits;
use crate::pulse_batch::ScanContext;

/// What labels tell apart.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Surface {
    /// Whether its light came by way of a liquid's surface.
    is_mirrored: bool,
    semantic: Semantic,
    object: ObjectId,
}

impl Surface {
    /// Whether labels differ in the object alone.
    fn is_alike(&self, other: &Self) -> bool {
        (self.is_mirrored, self.semantic) == (other.is_mirrored, other.semantic)
    }
}

impl ScanContext<'_> {
    /// The hit that labels an echo. Of the semantic that gave most of the light it is on the object
    /// that gave most of that, and the strongest one there. `first` is the number in the batch of
    /// the first ray of the pulse.
    pub(crate) fn labelling<'h>(
        &self,
        cast: &BatchHits<'_>,
        first: usize,
        echo: &Echo,
        hits: &'h [SubRayHit],
    ) -> &'h SubRayHit {
        let strongest = &hits[echo.strongest];
        let group = &hits[echo.first..echo.end];
        if group.len() == 1 || is_of_one(cast, first, group) {
            return strongest;
        }
        let mut surfaces: Vec<(Surface, f64)> = Vec::with_capacity(group.len());
        for hit in group {
            let surface = self.surface(cast, first, hit);
            match surfaces.iter_mut().find(|(of, _)| *of == surface) {
                Some((_, power)) => *power += hit.power(),
                None => surfaces.push((surface, hit.power())),
            }
        }
        let rank = |hit: &SubRayHit| {
            let surface = self.surface(cast, first, hit);
            let (mut of_semantic, mut of_object) = (0.0, 0.0);
            for (other, power) in &surfaces {
                if other.is_alike(&surface) {
                    of_semantic += power;
                }
                if *other == surface {
                    of_object = *power;
                }
            }
            (of_semantic, of_object, hit.power())
        };
        let mut best = (&group[0], rank(&group[0]));
        for hit in &group[1..] {
            let rank = rank(hit);
            if rank > best.1 {
                best = (hit, rank);
            }
        }
        best.0
    }

    fn surface(&self, cast: &BatchHits<'_>, first: usize, hit: &SubRayHit) -> Surface {
        if hit.ray == AIR {
            return Surface {
                is_mirrored: false,
                semantic: Semantic::AirborneEcho,
                object: ObjectId::NONE,
            };
        }
        let met = match hit.mirrored {
            Some(number) => &cast.mirrored[number as usize].met,
            None => cast.hit(first + hit.ray),
        };
        Surface {
            is_mirrored: hit.mirrored.is_some(),
            semantic: self.materials.get(met.material).semantic,
            object: met.object,
        }
    }
}

/// Whether hits are all on one object and of one material, as most are.
fn is_of_one(cast: &BatchHits<'_>, first: usize, group: &[SubRayHit]) -> bool {
    let on_surface = |c: &SubRayHit| c.mirrored.is_none() && c.ray != AIR;
    if !on_surface(&group[0]) {
        return false;
    }
    let one = cast.hit(first + group[0].ray);
    group[1..].iter().all(|c| {
        on_surface(c) && {
            let hit = cast.hit(first + c.ray);
            hit.object == one.object && hit.material == one.material
        }
    })
}
