//! Grown trees have the relations of their species, and trees that grew by altered relations do
//! not. The results of all species are in docs/measurements/realism.md.

use nemoral_assets::{Allometry, Species};
use nemoral_realism::ranges::{self, leaves};
use nemoral_realism::{HeightScatter, Relations, stand_diameters};

/// Trees grow by altered relations and are compared with the published ones.
#[test]
fn relations_miss_trees_that_grew_by_others() {
    let published = Species::beech();
    let grown_by = |change: &dyn Fn(&mut Allometry)| {
        let mut altered = published.clone();
        change(&mut altered.allometry);
        Relations::from_sizes(&published, Relations::of(&altered, 120).sizes)
    };
    let sound = grown_by(&|_| ());
    // The half of the trees with the larger deviation.
    let worst = |r: &Relations, i: usize| {
        let [thin, thick] = r.ratios.map(|half| half[i]);
        if (thin - 1.0).abs() > (thick - 1.0).abs() {
            thin
        } else {
            thick
        }
    };
    let taller = grown_by(&|a| a.dominant[1] *= 1.06);
    // The trees are as tall when dominant but taller before, of which the mean over all trees would
    // hide a good part.
    let earlier = grown_by(&|a| a.height_curve[0] = 0.03);
    let stout = grown_by(&|a| a.slenderness[1] = 75.0);
    leaves(
        "height",
        ranges::RELATIONS,
        worst(&sound, 0),
        &[
            ("a site 6 % better", worst(&taller, 0)),
            ("tall early", worst(&earlier, 0)),
            ("none slender", worst(&stout, 0)),
        ],
    );
    let wider = grown_by(&|a| a.crown_width[1] *= 1.06);
    let steeper = grown_by(&|a| a.crown_width[2] *= 1.06);
    leaves(
        "crown width",
        ranges::RELATIONS,
        worst(&sound, 1),
        &[
            ("6 % wider", worst(&wider, 1)),
            ("a steeper power", worst(&steeper, 1)),
        ],
    );
    let leafier = grown_by(&|a| a.leaf_area[0] *= 1.06);
    let capped = grown_by(&|a| a.leaf_area_index_max *= 0.5);
    leaves(
        "leaf area",
        ranges::RELATIONS,
        worst(&sound, 2),
        &[
            ("6 % more", worst(&leafier, 2)),
            ("less to a crown", worst(&capped, 2)),
        ],
    );
}

/// Scots pines are compared with Pukkala's formula itself, which their file does not have.
#[test]
fn heights_miss_their_source_by_another_curve() {
    let worst = |change: &dyn Fn(&mut Allometry)| {
        let mut species = Species::scots_pine();
        change(&mut species.allometry);
        let relations = Relations::of(&species, 120);
        let halves = relations.over_source(&species).expect("it has a source");
        let far = |ratio: &f64| (ratio - 1.0).abs();
        if far(&halves[0]) > far(&halves[1]) {
            halves[0]
        } else {
            halves[1]
        }
    };
    leaves(
        "height over its source",
        ranges::HEIGHT_SOURCES,
        worst(&|_| ()),
        &[
            ("tall early", worst(&|a| a.height_curve[0] = 0.1)),
            ("none slender", worst(&|a| a.slenderness[1] = 70.0)),
        ],
    );
}

/// The measures of the unaltered species are in docs/measurements/realism.md.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn heights_that_scatter_otherwise_are_noticed() {
    let heights = |name: &str, height_sd: f64, slenderness: Option<[f64; 2]>| {
        let mut species = Species::built_in(name).expect("built in");
        species.allometry.height_sd = height_sd;
        species.allometry.slenderness = slenderness.unwrap_or(species.allometry.slenderness);
        let trees = Relations::grown(&species, &stand_diameters(&species, 300));
        HeightScatter::of(&species, &trees.sizes)
    };
    let metres = |height_sd, slenderness| heights("scots_pine", height_sd, slenderness).sd_m;
    leaves(
        "height SD of Scots pine, m",
        ranges::height_sd_m("scots_pine").expect("in metres"),
        metres(0.125, None),
        &[
            ("a share of .08", metres(0.08, None)),
            ("of .18", metres(0.18, None)),
            ("all about as slender", metres(0.125, Some([48.0, 66.0]))),
        ],
    );
    let share = |height_sd| heights("beech", height_sd, None).sd_share;
    leaves(
        "height SD of beech, share",
        ranges::height_sd_share("beech").expect("a share"),
        share(0.09),
        &[("half", share(0.045)), ("half as much again", share(0.135))],
    );
}
