//! What must hold for every library: its parameters, threads and values.

use crate::default_library::{KEY, LIBRARY, all_plants, params};
use nemoral_assets::{AssetParams, Library, Species, StandParams, StandSpecies};
use nemoral_scene::Prototype;
use nemoral_scene::glam::Vec3;
use proptest::prelude::*;

/// 64-bit FNV-1a.
struct Hash(u64);

impl Hash {
    fn add(&mut self, bytes: &[u8]) {
        for b in bytes {
            self.0 = (self.0 ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01B3);
        }
    }

    fn vector(&mut self, v: Vec3) {
        for x in v.to_array() {
            self.add(&x.to_le_bytes());
        }
    }

    fn shape(&mut self, p: &Prototype) {
        p.mesh().positions.iter().for_each(|v| self.vector(*v));
        p.mesh().normals.iter().for_each(|v| self.vector(*v));
        for t in &p.mesh().triangles {
            t.corners.iter().for_each(|c| self.add(&c.to_le_bytes()));
            self.add(&t.material.0.to_le_bytes());
        }
        for c in p.cards() {
            [c.corner, c.edge_u, c.edge_v]
                .iter()
                .for_each(|v| self.vector(*v));
            self.add(&c.material.0.to_le_bytes());
        }
    }
}

fn fingerprint(l: &Library) -> (u64, u64, u64) {
    let new = || Hash(0xCBF2_9CE4_8422_2325);
    let (mut shapes, mut masks, mut colours) = (new(), new(), new());
    for t in &l.trees {
        shapes.shape(&t.prototype);
    }
    for p in l.plants.iter().flatten() {
        shapes.shape(&p.prototype);
    }
    for m in l.materials.materials() {
        colours.add(m.name.as_bytes());
        m.albedo.srgb().iter().for_each(|t| colours.add(t));
        if let Some(mask) = &m.mask {
            // Row by row, however the mask stores them.
            for row in 0..mask.height() {
                for first in (0..mask.width()).step_by(32) {
                    let texels = (first..mask.width()).take(32).enumerate();
                    let word = texels.fold(0_u32, |word, (bit, column)| {
                        word | u32::from(mask.texel(column, row)) << bit
                    });
                    masks.add(&word.to_le_bytes());
                }
            }
        }
    }
    (shapes.0, masks.0, colours.0)
}

#[test]
fn threads_do_not_matter() {
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    let serial = one
        .install(|| Library::grow(&params(), KEY))
        .expect("valid");
    assert_eq!(fingerprint(&serial), fingerprint(&LIBRARY));
}

/// The values of undergrowth and masks; trees have a test of their own.
#[test]
fn value_stability() {
    let mut shapes = Hash(0xCBF2_9CE4_8422_2325);
    for p in all_plants() {
        shapes.shape(&p.prototype);
    }
    let got = (shapes.0, fingerprint(&LIBRARY).1);
    assert_eq!(format!("{got:x?}"), VALUES);
}
const VALUES: &str = "(95edbca9963e1acb, a8cfd2dfea2cd4c9)";

proptest! {
    #[test]
    fn parameters_in_range_are_accepted_and_others_named(
        n in 0_u32..80,
        radius in 0.0_f64..0.3,
        mean in 0.0_f64..1.2,
        per_ha in -1_000.0_f64..25_000.0,
        shape in 0.5_f64..7.0,
        low in 0.0_f64..0.6,
        high in 0.0_f64..2.0,
    ) {
        let p = AssetParams {
            individuals_per_species: n,
            trunk_radius_m: radius,
            stand: StandParams {
                shape,
                dbh_min_m: low,
                dbh_max_m: high,
            },
            species: vec![
                StandSpecies {
                    species: Species::beech(),
                    dbh_mean_m: 0.3,
                    trees_per_ha: 300.0,
                },
                StandSpecies {
                    species: Species::cork_oak(),
                    dbh_mean_m: mean,
                    trees_per_ha: per_ha,
                },
            ],
            ..AssetParams::default()
        };
        let good = [
            ((0.08..=1.0).contains(&mean), "species[1].dbh_mean_m"),
            ((0.0..=20_000.0).contains(&per_ha), "species[1].trees_per_ha"),
            ((1..=64).contains(&n), "individuals_per_species"),
            ((0.01..=0.2).contains(&radius), "trunk_radius_m"),
            ((1.0..=6.0).contains(&shape), "stand.shape"),
            ((0.07..=0.5).contains(&low), "stand.dbh_min_m"),
            ((low..=1.5).contains(&high), "stand.dbh_max_m"),
        ];
        match p.check() {
            Ok(()) => prop_assert!(good.iter().all(|g| g.0)),
            Err(e) => prop_assert_eq!(
                Some(e.field.as_str()),
                good.iter().find(|g| !g.0).map(|g| g.1)
            ),
        }
    }
}

#[test]
fn a_wrong_parameter_is_refused() {
    let mut p = params();
    p.stand.dbh_min_m = f64::NAN;
    let e = Library::grow(&p, KEY).expect_err("NaN");
    assert!(e.to_string().contains("stand.dbh_min_m = NaN"), "{e}");
    let mut p = params();
    p.species.push(p.species[0].clone());
    let e = p.check().expect_err("twice the same");
    assert!(
        e.to_string().contains("species[3].name = maritime_pine"),
        "{e}"
    );
    p.species.clear();
    assert!(p.check().is_err());
}
