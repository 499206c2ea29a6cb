//! Measures the influence of chunk borders and phases on the pattern, over many chunks.
//!
//! `cargo run --release -p nemoral-placement --example uniformity -- [chunks per side] [trees per
//! chunk]`

#![allow(clippy::print_stdout, reason = "this program prints a table")]

use std::collections::HashMap;
use std::time::Instant;

use nemoral_placement::{DiskKind, LayerParams, Placement, PlacementParams, Site};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let side: i32 = args.next().map_or(Ok(20), |a| a.parse())?;
    let trees: f64 = args.next().map_or(Ok(210.0), |a| a.parse())?;
    let params = params(trees);
    let size_m = params.chunk_size_m;
    let started = Instant::now();
    let placement = Placement::new(params.clone(), Key::world(1))?;
    println!(
        "calibration {:.1} ms",
        started.elapsed().as_secs_f64() * 1e3
    );

    let mut rocks = Rocks {
        placement: &placement,
        known: HashMap::new(),
    };
    let mut chunks = Vec::new();
    let mut fastest_ms = f64::INFINITY;
    for y in 0..side {
        for x in 0..side {
            let coord = ChunkCoord::new(x, y);
            let around = rocks.around(coord);
            let started = Instant::now();
            chunks.push((coord, placement.woody(coord, &|_, _| true, &around)));
            fastest_ms = fastest_ms.min(started.elapsed().as_secs_f64() * 1e3);
        }
    }
    println!("{} chunks, the fastest in {fastest_ms:.2} ms", chunks.len());

    for (number, layer) in params.layers.iter().enumerate() {
        let of_layer = |s: &&Site| usize::from(s.layer) == number;
        let counts: Vec<f64> = chunks
            .iter()
            .map(|(_, sites)| sites.iter().filter(of_layer).count() as f64)
            .collect();
        let n = counts.len() as f64;
        let mean = counts.iter().sum::<f64>() / n;
        let variance = counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / (n - 1.0);
        println!(
            "{}: target {}, mean {mean:.2} ({:+.2} %), variance/mean {:.2}, Clark-Evans {:.3}",
            layer.name,
            layer.per_chunk,
            100.0 * (mean / layer.per_chunk - 1.0),
            variance / mean,
            clark_evans(&chunks, number, side, size_m),
        );
        let mut strips = [0_u32; 8];
        let mut phases = [0_u32; 4];
        for (coord, sites) in &chunks {
            for site in sites.iter().filter(of_layer) {
                phases[usize::from(Placement::phase(*coord))] += 1;
                let p = site.position_m - coord.origin_m(size_m);
                let inside = p.min_element().min(size_m - p.max_element());
                if let Some(strip) = strips.get_mut((inside / 0.5) as usize) {
                    *strip += 1;
                }
            }
        }
        print!("  strips ");
        for (i, &count) in strips.iter().enumerate() {
            let edge = |k: usize| size_m - k as f64;
            let area = edge(i).powi(2) - edge(i + 1).powi(2);
            let expected = mean * n * area / (size_m * size_m);
            let count = f64::from(count);
            print!(
                " {:.4}({:+.1}σ)",
                count / expected,
                (count - expected) / expected.sqrt()
            );
        }
        print!("\n  phases ");
        for count in phases {
            let expected = mean * n / 4.0;
            print!(" {:.4}", f64::from(count) / expected);
        }
        println!();
        for (v, variety) in layer.varieties.iter().enumerate() {
            let of_variety = |s: &&Site| of_layer(s) && usize::from(s.variety) == v;
            let sites = || chunks.iter().flat_map(|(_, s)| s).filter(of_variety);
            let count = sites().count() as f64;
            let share: f64 = variety.weight / layer.varieties.iter().map(|v| v.weight).sum::<f64>();
            println!(
                "  variety {v}: share {:.4} of {share:.4}, mean radius {:.4} of {:.4}",
                count / (mean * n),
                sites().map(|s| s.radius_m).sum::<f64>() / count,
                (variety.radius_m.0 + variety.radius_m.1) / 2.0,
            );
        }
    }
    Ok(())
}

/// A cache of rocks, which makes each chunk's after those of its neighbours of lower phases.
struct Rocks<'a> {
    placement: &'a Placement,
    known: HashMap<ChunkCoord, Vec<Site>>,
}

impl Rocks<'_> {
    fn of(&mut self, coord: ChunkCoord) -> Vec<Site> {
        if let Some(rocks) = self.known.get(&coord) {
            return rocks.clone();
        }
        let neighbours: Vec<Vec<Site>> = Placement::lower_phase_neighbours(coord)
            .into_iter()
            .map(|c| self.of(c))
            .collect();
        let neighbours: Vec<&[Site]> = neighbours.iter().map(Vec::as_slice).collect();
        let rocks = self.placement.rocks(coord, &|_, _| true, &neighbours);
        self.known.insert(coord, rocks.clone());
        rocks
    }

    fn around(&mut self, coord: ChunkCoord) -> Vec<Site> {
        let offsets = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
        offsets
            .flat_map(|(dx, dy)| self.of(coord.offset(dx, dy)))
            .collect()
    }
}

fn params(trees: f64) -> PlacementParams {
    let variety = |weight, low, high| DiskKind {
        weight,
        radius_m: (low, high),
    };
    let layer = LayerParams::new;
    PlacementParams {
        layers: vec![
            layer(
                "trees",
                trees,
                vec![
                    variety(3.0, 0.1, 0.2),
                    variety(2.0, 0.2, 0.4),
                    variety(1.0, 0.4, 0.6),
                ],
            ),
            layer("stumps", 15.0, vec![variety(1.0, 0.1, 0.3)]),
            layer(
                "shrubs",
                300.0,
                vec![variety(1.0, 0.2, 0.4), variety(1.0, 0.3, 0.6)],
            ),
        ],
        ..PlacementParams::default()
    }
}

/// Clark and Evans's R (1954): the mean distance to the nearest neighbour over that of random
/// points. Chunks at the rim are left out, so that every neighbour is known.
fn clark_evans(chunks: &[(ChunkCoord, Vec<Site>)], layer: usize, side: i32, size_m: f64) -> f64 {
    let at = |x: i32, y: i32| &chunks[(y * side + x) as usize].1;
    let (mut sum, mut count) = (0.0, 0_u32);
    let (mut points, mut area) = (0_usize, 0.0);
    for y in 1..side - 1 {
        for x in 1..side - 1 {
            area += size_m * size_m;
            for p in at(x, y).iter().filter(|s| usize::from(s.layer) == layer) {
                points += 1;
                let mut nearest = f64::INFINITY;
                for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                    for q in at(x + dx, y + dy) {
                        if usize::from(q.layer) == layer && q.key != p.key {
                            nearest = nearest.min(p.position_m.distance(q.position_m));
                        }
                    }
                }
                if nearest.is_finite() {
                    sum += nearest;
                    count += 1;
                }
            }
        }
    }
    let density = points as f64 / area;
    sum / f64::from(count) * 2.0 * density.sqrt()
}
