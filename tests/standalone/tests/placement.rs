//! Use of `nemoral-placement` alone: trees for a map with a lake.

use nemoral_placement::{Placement, PlacementError, PlacementParams, Site};
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_seed::Key;

const LAKE_M: DVec2 = DVec2::new(175.0, -25.0);
const LAKE_RADIUS_M: f64 = 12.0;

fn dry(position_m: DVec2, radius_m: f64) -> bool {
    position_m.distance(LAKE_M) > LAKE_RADIUS_M + radius_m
}

#[test]
fn trees_keep_apart_and_dry() -> Result<(), PlacementError> {
    let params = PlacementParams::default();
    let least = params.spacing_factor * params.density_factor;
    let placement = Placement::new(params, Key::world(7))?;
    let chunk = ChunkCoord::new(3, -1);
    let trees = |chunk| -> Vec<Site> {
        let sites = placement.woody(chunk, &dry, &[]);
        sites.into_iter().filter(|site| site.layer == 0).collect()
    };
    // It also holds across the border, whichever chunk is computed first.
    let mut east = trees(chunk.offset(1, 0));
    let here = trees(chunk);
    assert_eq!(east, trees(chunk.offset(1, 0)));
    assert!(here.len() > 30, "{} trees", here.len());
    for tree in &here {
        assert_eq!(ChunkCoord::containing(tree.position_m, 50.0), chunk);
        assert!(dry(tree.position_m, tree.radius_m));
    }
    east.extend(here);
    for (i, a) in east.iter().enumerate() {
        for b in &east[..i] {
            let apart_m = a.position_m.distance(b.position_m);
            assert!(apart_m >= least * (a.radius_m + b.radius_m), "{a:?} {b:?}");
        }
    }
    Ok(())
}
