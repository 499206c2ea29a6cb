//! Numbers, borders, phases and regularity, tested over many chunks.

#[allow(dead_code, reason = "each test binary uses its part")]
use crate::common::{World, allowed_fraction, beside_trails, everywhere, forest, square, trees};
use nemoral_placement::{Placement, PlacementParams, Site};
use nemoral_scene::ChunkCoord;

const SIZE_M: f64 = 50.0;

fn grow(params: PlacementParams, side: i32, seed: u64) -> Vec<(ChunkCoord, Vec<Site>)> {
    let mut world = World::new(params, seed, &everywhere);
    square(ChunkCoord::new(-7, 5), side)
        .into_iter()
        .map(|c| (c, world.woody(c)))
        .collect()
}

#[test]
fn the_papers_three_densities_are_met_beside_trails() {
    for (per_chunk, seed) in [(31.0, 1), (96.0, 2), (210.0, 3)] {
        let mut params = forest(per_chunk);
        params.layers.truncate(1);
        params.allowed_fraction = allowed_fraction();
        let mut world = World::new(params, seed, &beside_trails);
        let counts: Vec<f64> = square(ChunkCoord::new(11, -40), 10)
            .into_iter()
            .map(|c| world.woody(c).len() as f64)
            .collect();
        let mean = counts.iter().sum::<f64>() / 100.0;
        assert!((mean / per_chunk - 1.0).abs() < 0.05, "{per_chunk}: {mean}");
        // Counts vary from chunk to chunk, less than those of scattered points.
        let variance = counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / 99.0;
        assert!(
            (0.3..1.3).contains(&(variance / mean)),
            "{per_chunk}: {variance}"
        );
    }
}

#[test]
fn all_layers_and_varieties_meet_their_numbers() {
    let params = forest(210.0);
    let side = 7;
    let chunks = {
        let mut world = World::new(params.clone(), 5, &everywhere);
        square(ChunkCoord::new(0, 0), side)
            .into_iter()
            .flat_map(|c| world.woody(c))
            .collect::<Vec<_>>()
    };
    for (number, layer) in params.layers.iter().enumerate() {
        let total: f64 = layer.varieties.iter().map(|v| v.weight).sum();
        for (i, variety) in layer.varieties.iter().enumerate() {
            let of = |s: &&Site| usize::from(s.layer) == number && usize::from(s.variety) == i;
            let count = chunks.iter().filter(of).count() as f64;
            let expected = f64::from(side * side) * layer.per_chunk * variety.weight / total;
            // Random points would be within 3σ; 3 % are for the calibration.
            let tolerance = 3.0 * expected.sqrt() + 0.03 * expected;
            assert!(
                (count - expected).abs() < tolerance,
                "{number} {i}: {count} of {expected}"
            );
        }
    }
}

/// The largest deviation from the mean density, in σ of scattered points, of the strips of half a
/// metre from the border to 4 m inside, and of the four phases.
fn unevenness(chunks: &[(ChunkCoord, Vec<Site>)]) -> f64 {
    let mut strips = [0.0; 8];
    let mut phases = [0.0; 4];
    let mut total = 0.0;
    for (coord, sites) in chunks {
        for site in sites {
            total += 1.0;
            phases[usize::from(Placement::phase(*coord))] += 1.0;
            let p = site.position_m - coord.origin_m(SIZE_M);
            let inside_m = p.min_element().min(SIZE_M - p.max_element());
            if let Some(strip) = strips.get_mut((inside_m / 0.5) as usize) {
                *strip += 1.0;
            }
        }
    }
    let shares = (0..8).map(|i| {
        let inner = SIZE_M - f64::from(i);
        (inner.powi(2) - (inner - 1.0).powi(2)) / SIZE_M.powi(2)
    });
    let deviation = |count: f64, share: f64| {
        let expected = total * share;
        (count - expected).abs() / expected.sqrt()
    };
    let strips = shares.zip(strips).map(|(share, n)| deviation(n, share));
    let phases = phases.map(|n| deviation(n, 0.25));
    strips.chain(phases).fold(0.0, f64::max)
}

#[test]
fn neither_border_nor_phase_shows() {
    for (per_chunk, seed) in [(31.0, 4), (96.0, 5), (210.0, 6)] {
        let chunks = grow(trees(per_chunk), 20, seed);
        let worst = unevenness(&chunks);
        assert!(worst < 3.0, "{per_chunk}: {worst} σ");
    }
}

#[test]
fn a_seam_would_be_noticed() {
    // The seam of filling in 2 × 2 phase groups near saturation adds every eighth site to the first
    // strip.
    let mut chunks = grow(trees(210.0), 20, 6);
    let mut extra = 0;
    for (coord, sites) in &mut chunks {
        let border = |s: &&Site| {
            let p = s.position_m - coord.origin_m(SIZE_M);
            p.min_element().min(SIZE_M - p.max_element()) < 0.5
        };
        let more: Vec<Site> = sites.iter().filter(border).step_by(8).copied().collect();
        extra += more.len();
        sites.extend(more);
    }
    assert!(extra > 300);
    assert!(unevenness(&chunks) > 4.0);
}

#[test]
fn the_pattern_is_neither_rain_nor_plantation() {
    for per_chunk in [31.0, 210.0] {
        let side = 10;
        let chunks = grow(trees(per_chunk), side, 8);
        let all: Vec<Site> = chunks.iter().flat_map(|(_, s)| s).copied().collect();
        let inner: Vec<ChunkCoord> = square(ChunkCoord::new(-6, 6), side - 2);
        let (mut sum_m, mut count) = (0.0, 0.0);
        for (_, sites) in chunks.iter().filter(|(c, _)| inner.contains(c)).step_by(4) {
            for p in sites {
                let distance = |q: &Site| q.position_m.distance(p.position_m);
                let others = all.iter().filter(|q| q.key != p.key);
                sum_m += others.map(distance).fold(f64::INFINITY, f64::min);
                count += 1.0;
            }
        }
        let density = all.len() as f64 / (f64::from(side * side) * SIZE_M * SIZE_M);
        // Clark and Evans 1954: 1 for scattered points, 1.7 for a saturated pattern.
        let r = sum_m / count * 2.0 * density.sqrt();
        assert!((1.1..1.3).contains(&r), "{per_chunk}: {r}");
    }
}
