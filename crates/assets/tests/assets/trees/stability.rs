//! The same request grows the same tree, to the bit.

use nemoral_assets::{GrownTree, GrowthParams, Species, grow};

use super::tree;
use crate::common::{key, materials};

fn fingerprint(tree: &GrownTree) -> u64 {
    let vectors = tree
        .mesh
        .positions
        .iter()
        .chain(&tree.mesh.normals)
        .copied();
    let cards = tree
        .cards
        .iter()
        .flat_map(|c| [c.corner, c.edge_u, c.edge_v]);
    let words = vectors
        .chain(cards)
        .flat_map(|v| v.to_array())
        .chain(tree.mesh.uvs.iter().flat_map(|v| v.to_array()))
        .map(f32::to_bits);
    let indices = tree
        .mesh
        .triangles
        .iter()
        .flat_map(|t| t.corners.into_iter().chain([u32::from(t.material.0)]));
    words.chain(indices).fold(0xCBF2_9CE4_8422_2325, |h, w| {
        (h ^ u64::from(w)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

#[test]
fn value_stability() {
    let got: Vec<String> = Species::all()
        .iter()
        .map(|s| format!("{:016x}", fingerprint(&tree(s, 0.25, 9).1)))
        .collect();
    assert_eq!(got, FINGERPRINTS);
    let size = Species::english_oak().draw_size(0.3, key(9));
    assert_eq!(
        format!(
            "{:.9} {:.9} {:.9}",
            size.height_m, size.crown_radius_m, size.leaf_area_m2
        ),
        SIZE
    );
    assert_eq!(
        format!(
            "{:.12}",
            Species::eucalyptus().draw_dbh(0.2, 2.5, [0.1, 0.4], key(9))
        ),
        DBH
    );
    let of_eight = |i| Species::beech().dbh_of_individual(0.34, 2.4, [0.1, 0.65], [i, 8], key(9));
    assert_eq!(
        format!("{:.12} {:.12}", of_eight(0), of_eight(6)),
        INDIVIDUALS
    );
}

const INDIVIDUALS: &str = "0.138010800348 0.475840711052";
const FINGERPRINTS: [&str; 9] = [
    "188bee3c8333039a",
    "9f1f6a886617615c",
    "0d8018a15199e9be",
    "c9ba36c7dd88cce6",
    "0a76b9d635058f7b",
    "79ccf7587bc4f82c",
    "43fa6b898b23166d",
    "04e62ca3895572b5",
    "632ab9fc8e8b30b3",
];
const SIZE: &str = "18.755967525 4.727007432 233.612933315";
const DBH: &str = "0.128658733404";

#[test]
fn individuals_differ_and_repeat() {
    let species = Species::maritime_pine();
    let size = species.draw_size(0.25, key(0));
    let grow = |k| {
        grow(
            &species,
            &size,
            &materials(),
            &GrowthParams::default(),
            key(k),
        )
        .expect("grows")
    };
    assert_eq!(fingerprint(&grow(1)), fingerprint(&grow(1)));
    assert_ne!(fingerprint(&grow(1)), fingerprint(&grow(2)));
}
