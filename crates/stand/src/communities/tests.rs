//! Where communities grow, and how much of the ground they close over.

use super::*;

const OPEN: CommunitySite = CommunitySite {
    sky_view: 0.6,
    moisture: 0.5,
    slope: 0.1,
    heat_load: 0.0,
    soil_m: 0.5,
    meadow: 0.0,
    fringe: 0.0,
    bank_m: f64::INFINITY,
    history: SiteHistory::NEUTRAL,
};

/// Waves in both directions whose lengths and phases belong to the field.
fn waves(i: u64, _: FieldParams) -> Result<impl ScalarField, ()> {
    let i = i as f64;
    Ok(move |p: DVec2| {
        0.5 + 0.25
            * (libm::sin(p.x * (0.31 + 0.07 * i) + i)
                + libm::sin(p.y * (0.41 - 0.03 * i) - 2.0 * i))
    })
}

fn count(params: &CommunityParams, site: &CommunitySite) -> [f64; PlantCommunity::ALL.len()] {
    let all = Communities::new(params, waves).expect("fields");
    let mut counts = [0.0; PlantCommunity::ALL.len()];
    for i in 0..40_000 {
        let p = DVec2::new(f64::from(i % 200), f64::from(i / 200)) * 1.7;
        if let Some(cover) = all.at(p, site) {
            assert!((0.45..=1.0).contains(&cover.vigour));
            assert!(cover.density > 0.0 && cover.density <= 1.0);
            assert!(!cover.community.is_grass() || cover.density == 1.0);
            counts[cover.community.index()] += 1.0 / 40_000.0;
        }
    }
    counts
}

const NONE: CommunityParams = CommunityParams {
    sward: 0.0,
    grasses: [1.0; 5],
    thickets: [0.0; 6],
};

#[test]
fn each_alone_has_its_share_where_it_suits() {
    for i in 0..6 {
        let mut thickets = [0.0; 6];
        thickets[i] = 0.3;
        let params = CommunityParams { thickets, ..NONE };
        let site = CommunitySite {
            moisture: if i == 4 { 0.9 } else { 0.3 },
            bank_m: 0.5,
            ..OPEN
        };
        let found = count(&params, &site);
        assert!((found[5 + i] - 0.3).abs() < 0.03, "{found:?}");
        let dark = CommunitySite {
            sky_view: 0.05,
            ..site
        };
        assert_eq!(count(&params, &dark), [0.0; 11]);
    }
}

#[test]
fn a_full_sward_leaves_no_gap_and_has_its_kinds() {
    let params = CommunityParams {
        sward: 1.0,
        grasses: [2.0, 1.0, 0.0, 1.0, 0.0],
        ..NONE
    };
    let found = count(&params, &OPEN);
    assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{found:?}");
    for (found, want) in found.into_iter().zip([0.5, 0.25, 0.0, 0.25, 0.0]) {
        assert!((found - want).abs() < 0.04, "{found} {want}");
    }
    let dry = count(
        &params,
        &CommunitySite {
            moisture: 0.1,
            ..OPEN
        },
    );
    assert!(dry[3] > found[3] + 0.1, "{dry:?}");
}

#[test]
fn shade_thins_and_steep_ground_stays_bare() {
    let params = CommunityParams { sward: 0.8, ..NONE };
    let at = |site: CommunitySite| count(&params, &site)[..5].iter().sum::<f64>();
    let half = at(CommunitySite {
        sky_view: 0.26,
        ..OPEN
    });
    assert!((half - 0.4).abs() < 0.04, "{half}");
    assert_eq!(at(CommunitySite { slope: 1.2, ..OPEN }), 0.0);
}

#[test]
fn plants_follow_soil_and_sun() {
    let params = CommunityParams {
        thickets: [0.0, 0.2, 0.2, 0.2, 0.2, 0.0],
        ..NONE
    };
    let at = |soil_m, heat_load| {
        let site = CommunitySite {
            moisture: 0.55,
            soil_m,
            heat_load,
            ..OPEN
        };
        count(&params, &site)
    };
    let [bracken, heath, bilberry, nettles] = [6, 7, 8, 9];
    let (thin, deep) = (at(0.1, 0.0), at(1.4, 0.0));
    assert!(thin[bracken] < 0.5 * deep[bracken] && thin[nettles] < 0.1 * deep[nettles]);
    assert!(thin[heath] > 1.5 * deep[heath], "{thin:?} {deep:?}");
    let (sunny, shady) = (at(0.5, 0.3), at(0.5, -0.3));
    assert!(sunny[bilberry] < 0.5 * shady[bilberry] && sunny[heath] > 1.5 * shady[heath]);
}

#[test]
fn reeds_are_by_water_alone() {
    let params = CommunityParams {
        thickets: [0.0, 0.0, 0.0, 0.0, 0.0, 0.5],
        ..NONE
    };
    let at = |bank_m| count(&params, &CommunitySite { bank_m, ..OPEN })[10];
    assert!((at(0.3) - 0.5).abs() < 0.04);
    assert!(at(2.0) < 0.7 * at(0.3) && at(3.0) == 0.0 && at(f64::INFINITY) == 0.0);
}

#[test]
fn browsing_leaves_what_is_not_eaten_and_years_bring_bushes() {
    let params = CommunityParams {
        sward: 0.3,
        grasses: [1.0, 1.0, 0.0, 0.0, 0.0],
        thickets: [0.2, 0.2, 0.0, 0.0, 0.0, 0.0],
    };
    let at = |browsed, old| {
        let history = SiteHistory::of_ranks([browsed, old], [1.0, 1.0]);
        count(&params, &CommunitySite { history, ..OPEN })
    };
    let [rank, grazed, bramble, bracken] = [0, 1, 5, 6];
    let (few, many) = (at(0.0, 0.5), at(1.0, 0.5));
    assert!(many[bramble] < 0.3 * few[bramble] && many[bracken] > 1.2 * few[bracken]);
    assert!(many[grazed] > 1.5 * few[grazed] && many[rank] < few[rank]);
    let [young, middle, old] = [0.0, 0.5, 1.0].map(|old| at(0.5, old));
    assert!(young[bramble] < 0.5 * middle[bramble] && old[bramble] < 0.5 * middle[bramble]);
    assert!(young[rank] > 1.5 * old[rank]);
}

#[test]
fn a_meadow_is_grass_alone() {
    let params = CommunityParams {
        sward: 0.3,
        thickets: [0.3; 6],
        ..NONE
    };
    let found = count(
        &params,
        &CommunitySite {
            meadow: 1.0,
            ..OPEN
        },
    );
    assert!(
        (found[..5].iter().sum::<f64>() - 1.0).abs() < 1e-9,
        "{found:?}"
    );
    let bramble = CommunityParams {
        thickets: [0.3, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..NONE
    };
    let at_edge = count(
        &bramble,
        &CommunitySite {
            fringe: 1.0,
            ..OPEN
        },
    );
    assert!((at_edge[5] - 0.3 - 1.6 * 0.21).abs() < 0.03, "{at_edge:?}");
    let half = count(
        &params,
        &CommunitySite {
            meadow: 0.5,
            ..OPEN
        },
    );
    let wood = count(&params, &OPEN);
    let grass = |of: &[f64; 11]| of[..5].iter().sum::<f64>();
    assert!(grass(&wood) < grass(&half) && grass(&half) < 1.0);
}

#[test]
fn grass_of_one_kind_has_no_holes_where_that_kind_is_not_suited() {
    for (i, moisture) in [(2, 0.0), (3, 1.0)] {
        let mut grasses = [0.0; 5];
        grasses[i] = 1.0;
        let params = CommunityParams {
            sward: 1.0,
            grasses,
            ..NONE
        };
        let found = count(&params, &CommunitySite { moisture, ..OPEN });
        assert!((found[i] - 1.0).abs() < 1e-9, "{found:?}");
    }
}

#[test]
fn what_is_wanted_is_what_may_grow() {
    assert_eq!(NONE.wanted(), []);
    let params = CommunityParams {
        sward: 0.2,
        grasses: [0.0, 1.0, 0.0, 0.0, 0.0],
        thickets: [0.0, 0.1, 0.0, 0.0, 0.0, 0.0],
    };
    let wanted = [PlantCommunity::GrazedGrass, PlantCommunity::Bracken];
    assert_eq!(params.wanted(), wanted);
    // Trodden trails are under short grass in any sward.
    let tall = CommunityParams {
        grasses: [1.0, 0.0, 0.0, 0.0, 0.0],
        ..params
    };
    assert!(tall.wanted().contains(&PlantCommunity::GrazedGrass));
}
