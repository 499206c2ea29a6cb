use nemoral_seed::Key;

use super::*;
use crate::AssetParams;

#[test]
fn a_library_comes_back_to_the_bit() {
    let params = AssetParams {
        individuals_per_species: 1,
        saplings_per_species: 1,
        seedlings_per_species: 1,
        snags_per_species: 1,
        deadwood: true,
        climbers: Some(crate::ClimberParams {
            lianas: true,
            resin: true,
            moss: crate::StemMoss {
                amount: 1.0,
                height_m: 1.0,
            },
        }),
        ..AssetParams::default()
    };
    let library = Library::grow(&params, Key::world(3)).expect("valid");
    let bytes = library.to_bytes();
    let back = Library::from_bytes(&bytes).expect("its own bytes");
    let mut written = Vec::new();
    back.write(&mut written).expect("memory");
    assert!(bytes == written);
    let texts = |library: &Library| {
        let trees = [&library.trees, &library.saplings, &library.snags].into_iter();
        let trees = trees.flatten().map(|t| {
            let name = t.prototype.name();
            format!(
                "{:?}",
                (
                    name,
                    &t.species,
                    t.size,
                    t.class,
                    t.alive,
                    (&t.stem, t.stem_volume_m3, &t.wood),
                    t.radius_m
                )
            )
        });
        let plants = library.plants.iter().enumerate();
        let plants = plants.flat_map(|(kind, plants)| plants.iter().map(move |p| (kind, p)));
        let plants = plants.map(|(kind, p)| {
            format!(
                "{:?}",
                (kind, p.prototype.name(), &p.name, p.radius_m, p.height_m)
            )
        });
        let mut texts: Vec<String> = trees.chain(plants).collect();
        let dead = [&library.deadwood.logs, &library.deadwood.thrown];
        texts.extend(dead.into_iter().flatten().map(|l| {
            let sizes = (l.length_m, l.diameter_m, l.half_height_m, l.volume_m3);
            format!("{:?}", (l.prototype.name(), &l.species, l.stage, sizes))
        }));
        texts.push(format!("{:?}", (&library.ground, &library.materials)));
        texts
    };
    assert_eq!(texts(&library), texts(&back));
    let shapes = |library: &Library| library.trees[1].prototype.clone();
    let (grown, back) = (shapes(&library), shapes(&back));
    assert!(grown.mesh() == back.mesh() && grown.cards() == back.cards());
    assert!(
        grown.ambient_occlusion().is_some()
            && grown.ambient_occlusion() == back.ambient_occlusion()
    );
    for damaged in [&bytes[..bytes.len() / 2], &[], &bytes[1..]] {
        assert!(Library::from_bytes(damaged).is_err());
    }
}
