//! Stems: their sweep and foot, and those of snags.

use nemoral_assets::{GrownTree, GrowthParams, Species, StemForm, TreeSize, grow, grow_snag};
use nemoral_scene::Semantic;
use nemoral_scene::glam::DVec2;

use crate::common::{SNAG, cut_dbh_m, cut_diameter_m, girth_m, key, library, materials, stem_cut};

/// A spruce whose stem is straight and upright, except for what `change` does to it.
fn straight(change: impl Fn(&mut StemForm)) -> (TreeSize, GrownTree) {
    let mut species = Species::norway_spruce();
    species.stem.sweep_deg = 0.0;
    species.stem.sinuosity = 0.0;
    change(&mut species.stem);
    let size = TreeSize {
        lean_rad: 0.0,
        ..species.draw_size(0.35, key(3))
    };
    let params = GrowthParams::default();
    let tree = grow(&species, &size, &materials(), &params, key(3)).expect("grows");
    (size, tree)
}

#[test]
fn stems_are_bowed_by_their_basal_sweep() {
    // The horizontal distance of the stem from its foot at a fifth of its height, where the bow is
    // widest.
    let bow_m = |sweep_deg: f64| {
        let (size, tree) = straight(|stem| stem.sweep_deg = sweep_deg);
        let cut = stem_cut(&tree.mesh, 0.2 * size.height_m);
        (cut.iter().sum::<DVec2>() / cut.len() as f64).length()
    };
    let none = bow_m(0.0);
    assert!(none < 0.002, "{none} m of a straight stem");
    let [slight, middle, strong] = [3.0, 6.0, 12.0].map(bow_m);
    assert!(
        slight > 0.01 && middle > slight && strong > middle,
        "{slight} {middle} {strong}"
    );
    // One tree with more and more sweep: the bow grows as the tangent of the angle, apart from what
    // the fit of the crown changes.
    let tangent = |deg: f64| deg.to_radians().tan();
    for (bow, deg) in [(slight, 3.0), (middle, 6.0)] {
        let ratio = strong / bow * tangent(deg) / tangent(12.0);
        assert!((ratio - 1.0).abs() < 0.25, "{deg}: {ratio}");
    }
}

#[test]
fn the_foot_is_as_wide_as_its_flare() {
    // The girth at the ground over the girth at breast height.
    let swelling = |flare: f64| {
        let (size, tree) = straight(|stem| stem.flare = [flare; 2]);
        let [ground, breast] = [0.0, 1.3].map(|z| girth_m(&stem_cut(&tree.mesh, z)));
        let dbh = breast / std::f64::consts::PI / size.dbh_m;
        assert!((dbh - 1.0).abs() < 0.02, "breast height is not changed");
        ground / breast
    };
    let none = swelling(0.0);
    assert!(
        (1.0..1.45).contains(&none),
        "the taper's butt alone: {none}"
    );
    for flare in [0.1, 0.2, 0.4, 0.8] {
        let more = swelling(flare) / none - 1.0;
        // The lobes fall to nothing between each other, which adds half of their height to the mean
        // radius, and their outline is longer than a circle.
        assert!((0.4..1.0).contains(&(more / flare)), "{flare}: {more}");
    }
}

#[test]
fn snags_are_dead_wood_of_the_demanded_diameter() {
    let library = library();
    for species in Species::all() {
        for i in 0..4 {
            let size = species.draw_size(0.3, key(i));
            let params = GrowthParams::default();
            let snag = grow_snag(&species, &size, &materials(), &params, key(i)).expect("it grows");
            let name = format!("{} {i}", species.name);
            assert!(!snag.alive && snag.cards.is_empty(), "{name}");
            assert_eq!(snag.size.leaf_area_m2, 0.0);
            let dbh = cut_dbh_m(&snag.mesh);
            assert!((dbh / size.dbh_m - 1.0).abs() < 0.02, "{name}: {dbh}");
            assert!((snag.size.dbh_m / dbh - 1.0).abs() < 0.002, "{name}");
            // Its taper is that of the tree before its top broke.
            let upper = species.stem_diameter_m(&size, 2.6) / species.stem_diameter_m(&size, 1.3);
            let cut = cut_diameter_m(&snag.mesh, 2.6);
            assert!((upper * dbh / cut - 1.0).abs() < 0.05, "{name}: {cut}");
            let top = snag.mesh.positions.iter().fold(0.0_f32, |m, p| m.max(p.z));
            assert!(
                (f64::from(top) / snag.size.height_m - 1.0).abs() < 0.001,
                "{name}"
            );
            assert!(
                top > 1.9 && f64::from(top) < 1.3 * size.height_m,
                "{name}: {top}"
            );
            // There is no living wood, and nothing hangs in the air.
            for t in &snag.mesh.triangles {
                let semantic = library.get(t.material).semantic;
                assert!(
                    [Semantic::Snag, Semantic::Twig].contains(&semantic),
                    "{name}"
                );
            }
            let stem_top = snag.mesh.triangles.iter().filter(|t| t.material == SNAG);
            assert!(stem_top.count() > 100, "{name}");
        }
    }
}
