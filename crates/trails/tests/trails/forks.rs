//! Branches of trails.

use std::collections::BTreeSet;

use crate::common::{around, dense, flat, points, trails};
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_trails::{DressingKind, TrailParams, WayKind};

#[test]
fn value_stability_of_branches_and_steps() {
    let params = TrailParams {
        spawn_probability: 0.1,
        fork_probability: 0.2,
        ..TrailParams::of(WayKind::footpath())
    };
    let trails = trails(params, 7, flat(DVec2::new(0.3, -0.15)));
    let mut branches = around(ChunkCoord::new(0, 0), 4)
        .flat_map(|c| trails.in_chunk(c))
        .filter(|p| p.id().is_branch());
    let branch = branches.next().expect("there are branches");
    let chunk = branch.chunks().last().expect("it goes through chunks");
    let dressing = trails.dressing(chunk);
    let got = [
        format!("{:?}", branch.id()),
        format!("{:?} {:?}", branch.length_m(), branch.position_m(60.0)),
        format!(
            "{:?}",
            dressing.iter().rfind(|d| d.kind == DressingKind::Step)
        ),
    ];
    assert_eq!(got, BRANCH_VALUES);
}
const BRANCH_VALUES: [&str; 3] = [
    "TrailId { birth: ChunkCoord { x: -7, y: 0 }, number: 2147483656 }",
    "256.7373824345565 DVec2(-135.42595126944278, -35.880018200685186)",
    "Some(TrailDressing { position_m: DVec2(-216.33622077615559, -100.39023113958902), yaw_rad: \
     0.39344523184298813, scale: 0.533481754970602, kind: Step })",
];

#[test]
fn branches_leave_their_trail_at_an_acute_angle() {
    let trails = dense(5);
    let mut branches = BTreeSet::new();
    for chunk in around(ChunkCoord::new(0, 0), 9) {
        let paths = trails.in_chunk(chunk);
        for branch in paths.iter().filter(|p| p.id().is_branch()) {
            let start = branch.position_m(0.0);
            if branch.chunks().next() != Some(chunk) || !branches.insert(branch.id()) {
                continue;
            }
            let trail = paths
                .iter()
                .find(|p| p.id().birth == branch.id().birth && !p.id().is_branch())
                .expect("a branch begins at its trail");
            assert_eq!(trail.way_number(), branch.way_number());
            // Where it begins, it is the trail, and goes its way.
            let (s, gap) = points(trail, 0.05)
                .map(|(s, p)| (s, p.distance(start)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .expect("points");
            assert!(gap < 0.06, "{gap}");
            assert!(trail.tangent(s).dot(branch.tangent(0.0)) > 0.99);
            // Then it leaves it.
            let apart = |ahead: f64| {
                let place = branch.position_m(ahead);
                let on = points(trail, 0.5).filter(|(at, _)| (s..s + 60.0).contains(at));
                let away = on.map(|(_, p)| p.distance(place));
                away.fold(f64::INFINITY, f64::min)
            };
            let [soon, later] = [5.0, 32.0].map(apart);
            assert!(soon < 3.0 && later > 4.0, "{soon} {later}");
        }
    }
    assert!(branches.len() > 20, "{}", branches.len());
}
