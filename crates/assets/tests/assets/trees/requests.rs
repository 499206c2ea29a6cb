//! What cannot be grown is refused.

use nemoral_assets::{GrowthParams, Species, TreeMaterials, TreeSize, grow};

use crate::common::{key, materials};

#[test]
fn wrong_requests_are_refused_by_name() {
    let species = Species::eucalyptus();
    let good = species.draw_size(0.2, key(0));
    let params = GrowthParams::default();
    let field =
        |species: &Species, size: &TreeSize, materials: &TreeMaterials, params: &GrowthParams| {
            grow(species, size, materials, params, key(0))
                .map(|_| ())
                .map_err(|e| e.field)
        };
    let refused = |name: &str| Err(name.to_owned());
    assert_eq!(field(&species, &good, &materials(), &params), Ok(()));
    let size = TreeSize {
        dbh_m: f64::NAN,
        ..good
    };
    assert_eq!(
        field(&species, &size, &materials(), &params),
        refused("size.dbh_m")
    );
    let size = TreeSize {
        crown_base_m: good.height_m,
        ..good
    };
    assert_eq!(
        field(&species, &size, &materials(), &params),
        refused("size.crown_base_m")
    );
    let none = TreeMaterials {
        foliage: Vec::new(),
        ..materials()
    };
    assert_eq!(field(&species, &good, &none, &params), refused("foliage"));
    let mut bad = materials();
    bad.foliage[1].opaque_fraction = 0.0;
    assert_eq!(
        field(&species, &good, &bad, &params),
        refused("foliage[1].opaque_fraction")
    );
    let few = GrowthParams {
        wood_triangles_max: 10,
        ..params
    };
    assert_eq!(
        field(&species, &good, &materials(), &few),
        refused("wood_triangles_max")
    );
    let bald = Species {
        levels: Vec::new(),
        ..species.clone()
    };
    assert_eq!(
        field(&bald, &good, &materials(), &params),
        refused("eucalyptus.levels")
    );
}
