//! Trees at the edges of meadows: which of them grew up there, and where their light came from.

use nemoral_placement::OpenLand;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

use super::meadows::Meadows;

const GREW_THERE: Domain = Domain::new("pipeline.edge_trees");

/// How deep in the wood the first trees stand that no light from the side reaches, metres, and from
/// where on all are such trees: about a crown's width later.
const LIT_M: [f64; 2] = [4.0, 9.0];
/// The distance of the places that tell where the open is, metres: about half a crown's width.
const ASIDE_M: f64 = 4.0;

/// The direction of the light, radians from the world's x-axis, of a tree that grew up at the edge
/// of a meadow; `None` for trees that grew within the wood.
pub(crate) fn light_from(world_m: DVec2, key: Key, meadows: &Meadows) -> Option<f64> {
    let [lit_m, dark_m] = LIT_M;
    let within_m = -meadows.depth_m(world_m);
    let lit = ((dark_m - within_m) / (dark_m - lit_m)).clamp(0.0, 1.0);
    let mut rng = key.domain(GREW_THERE).rng();
    if !rng.chance(lit * meadows.edge_trees()) {
        return None;
    }
    // In a stem map there is no meadow, however far.
    let depth_m = |p: DVec2| meadows.depth_m(p).max(-2.0 * dark_m);
    let slope = |aside: DVec2| depth_m(world_m + aside) - depth_m(world_m - aside);
    let open = DVec2::new(slope(ASIDE_M * DVec2::X), slope(ASIDE_M * DVec2::Y));
    Some(libm::atan2(open.y, open.x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;
    use proptest::prelude::*;

    fn meadows(edge_trees: f64) -> Meadows {
        let mut of = config::Meadows::default();
        (of.share, of.edge_trees) = (0.5, edge_trees);
        (Meadows::new(&of, None, Key::world(4)).expect("valid")).expect("there are some")
    }

    proptest! {
        #[test]
        fn trees_near_the_open_face_it(x in -2e3..2e3, y in -2e3..2e3, item in 0_u64..1000) {
            let land = meadows(1.0);
            let (p, key) = (DVec2::new(x, y), Key::world(1).item(item));
            let depth_m = land.depth_m(p);
            let found = light_from(p, key, &land);
            prop_assert!(depth_m < -LIT_M[0] || found.is_some());
            prop_assert!(depth_m > -LIT_M[1] || found.is_none());
            if let Some(light) = found.filter(|_| depth_m.abs() < 3.0) {
                let (sin, cos) = libm::sincos(light);
                let ahead = land.depth_m(p + ASIDE_M * DVec2::new(cos, sin));
                prop_assert!(ahead > depth_m - 1.0, "{ahead} from {depth_m}");
            }
            prop_assert!(light_from(p, key, &meadows(0.0)).is_none());
        }
    }
}
