//! Draws the three patterns as in Fig. 6 of the paper (a wall 10 m ahead with a tree before it),
//! and coverage over time against the curves that Livox publishes.
//!
//! `cargo run --release --example patterns -- FOLDER` writes `patterns.png` and `coverage.svg`
//! there.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

#[path = "../tests/lidar/common.rs"]
mod common;

use std::collections::BTreeSet;
use std::path::Path;

use common::{Cell, coverage, disc, lit};
use image::{Rgb, RgbImage};
use nemoral_lidar::{
    ExactRange, LivoxHorizonLike, Mid40, RepeatingLines, RepeatingLinesParams, ScanPattern,
    ScanRequest, Scanner, ScannerParams,
};
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{
    Hit, Material, MaterialId, MaterialLibrary, Ray, RayCaster, RigidTransform, Semantic,
};
use nemoral_seed::Key;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    patterns()?.save(folder.join("patterns.png"))?;
    std::fs::write(folder.join("coverage.svg"), coverages()?)?;
    Ok(())
}

/// A wall across x = 10 m with a tree at 5 m: a round crown on a round stem.
struct WallAndTree {
    wall: MaterialId,
    tree: MaterialId,
}

impl RayCaster for WallAndTree {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let d = ray.direction;
        // Crown: a sphere of 0.6 m at (5, 0, 0.5); the sensor is at the origin.
        let crown = Vec3::new(5.0, 0.0, 0.5);
        let along = crown.dot(d);
        let crown_m = (along > 0.0 && (crown - d * along).length() < 0.6).then_some(along - 0.3);
        // Stem: a cylinder of 8 cm below it.
        let flat = Vec2::new(d.x, d.y);
        let stem_m = Some(5.0 * d.x / flat.length_squared())
            .filter(|&t| t > 0.0 && t * d.z < 0.0)
            .filter(|&t| (flat * t - Vec2::new(5.0, 0.0)).length() < 0.08);
        let wall_m = (d.x > 0.0).then(|| 10.0 / d.x);
        let tree_m = crown_m.or(stem_m);
        let material = if tree_m.is_some() {
            self.tree
        } else {
            self.wall
        };
        Some(Hit::new(tree_m.or(wall_m)?, Vec3::NEG_X, material))
    }
}

/// Three panels of 200 ms: lines, rectangle, circle; the tree's points green, the wall's by time.
fn patterns() -> Result<RgbImage, Box<dyn std::error::Error>> {
    let mut materials = MaterialLibrary::new();
    let mut add = |name, semantic| materials.add(Material::plain(name, semantic, Vec3::splat(0.4)));
    let scene = WallAndTree {
        wall: add("wall", Semantic::Rock),
        tree: add("tree", Semantic::Leaf),
    };
    let lines = RepeatingLines::new(RepeatingLinesParams {
        lines: 32,
        columns: 720,
        horizontal_fov_rad: 82_f64.to_radians(),
        ..RepeatingLinesParams::default()
    })?;
    let panels: [Box<dyn ScanPattern>; 3] =
        [Box::new(lines), Box::new(LivoxHorizonLike), Box::new(Mid40)];
    let (width, height, pixels_per_m) = (1000_u32, 400_u32, 54.0);
    let mut picture = RgbImage::from_pixel(width, 3 * (height + 10), Rgb([255; 3]));
    for (row, pattern) in (0_u32..).zip(panels) {
        let params = ScannerParams {
            pulses_per_scan: (0.2 * pattern.rate_hz()) as u32,
            ..ScannerParams::default()
        };
        let scanner = Scanner::new(params, pattern)?;
        let standing = |_: f64| RigidTransform::IDENTITY;
        let points = scanner.scan(&ScanRequest {
            first_pulse: 0,
            caster: &scene,
            materials: &materials,
            scene_from_lidar_at: &standing,
            range_model: &ExactRange,
            key: Key::world(1),
        });
        let top = row * (height + 10);
        let dark = Rgb([12, 14, 20]);
        for (x, y) in (0..width).flat_map(|x| (0..height).map(move |y| (x, y))) {
            picture.put_pixel(x, top + y, dark);
        }
        for p in &points {
            // The view from the sensor, with everything projected onto the wall.
            let on_wall = p.position_m * (10.0 / p.position_m.x);
            let x = f64::from(width) / 2.0 - f64::from(on_wall.y) * pixels_per_m;
            let y = f64::from(height) / 2.0 - f64::from(on_wall.z) * pixels_per_m;
            if x < 0.0 || y < 0.0 || x >= width.into() || y >= height.into() {
                continue;
            }
            let share = 0.5 + p.time_ns as f64 * 1e-9 / scanner.duration_s();
            let colour = match p.semantic {
                Semantic::Leaf => Rgb([70, 220, 90]),
                _ => Rgb([
                    (120.0 + 135.0 * share) as u8,
                    (190.0 - 60.0 * share) as u8,
                    (255.0 - 200.0 * share) as u8,
                ]),
            };
            picture.put_pixel(x as u32, top + y as u32, colour);
        }
    }
    Ok(picture)
}

/// The curve that Livox publishes: seconds and percent.
const MID40: [(f64, f64); 15] = [
    (0.05, 12.0),
    (0.1, 19.2),
    (0.15, 27.8),
    (0.2, 35.1),
    (0.25, 42.1),
    (0.3, 48.2),
    (0.4, 59.3),
    (0.5, 68.4),
    (0.6, 75.6),
    (0.7, 81.3),
    (0.8, 86.1),
    (0.9, 89.6),
    (1.0, 92.4),
    (1.2, 96.0),
    (1.4, 98.0),
];
const HORIZON: [(f64, f64); 10] = [
    (0.02, 16.7),
    (0.05, 37.2),
    (0.1, 61.2),
    (0.15, 75.5),
    (0.2, 84.3),
    (0.25, 89.9),
    (0.3, 93.4),
    (0.4, 97.1),
    (0.5, 98.9),
    (0.6, 99.7),
];

/// Name, pattern, cell in degrees, cells of the field of view, published points, colour.
type Curve<'a> = (
    &'a str,
    &'a dyn ScanPattern,
    f64,
    BTreeSet<Cell>,
    &'a [(f64, f64)],
    &'a str,
);

/// Coverage over 0 to 1.4 s as a drawing: ours as lines, published as crosses.
fn coverages() -> Result<String, Box<dyn std::error::Error>> {
    let (left, top, width, height) = (70.0, 20.0, 780.0, 440.0);
    let at = |time_s: f64, percent: f64| {
        let (x, y) = (time_s / 1.4 * width, (1.0 - percent / 100.0) * height);
        (left + x, top + y)
    };
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 900 520\" width=\"900\" \
         height=\"520\" font-family=\"sans-serif\" font-size=\"15\">\n\
         <rect width=\"900\" height=\"520\" fill=\"white\"/>\n",
    );
    let line = |svg: &mut String, points: &[(f64, f64)], colour: &str, width: f64| {
        let points: Vec<String> = points
            .iter()
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        svg.push_str(&format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" \
             stroke-width=\"{width}\"/>\n",
            points.join(" ")
        ));
    };
    let text = |svg: &mut String, (x, y): (f64, f64), anchor: &str, text: &str| {
        svg.push_str(&format!(
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{text}</text>\n"
        ));
    };
    for i in 0..=7 {
        let time_s = 0.2 * f64::from(i);
        let foot = at(time_s, 0.0);
        line(&mut svg, &[foot, at(time_s, 100.0)], "#ddd", 1.0);
        text(
            &mut svg,
            (foot.0, foot.1 + 20.0),
            "middle",
            &format!("{time_s:.1}"),
        );
    }
    for i in 0..=5 {
        let percent = 20.0 * f64::from(i);
        let start = at(0.0, percent);
        line(&mut svg, &[start, at(1.4, percent)], "#ddd", 1.0);
        text(
            &mut svg,
            (start.0 - 8.0, start.1 + 5.0),
            "end",
            &format!("{percent:.0} %"),
        );
    }
    text(
        &mut svg,
        (left + 0.5 * width, top + height + 42.0),
        "middle",
        "integration time, seconds",
    );
    let lines = RepeatingLines::new(RepeatingLinesParams {
        lines: 32,
        ..RepeatingLinesParams::default()
    })?;
    let curves: [Curve<'_>; 3] = [
        (
            "Horizon-like",
            &LivoxHorizonLike,
            0.32,
            lit(&LivoxHorizonLike, 0..720_000, 0.32),
            &HORIZON,
            "#1e6edc",
        ),
        (
            "Mid-40",
            &Mid40,
            0.265,
            disc(19.2, 0.265),
            &MID40,
            "#dc3c28",
        ),
        (
            "32 repeating lines",
            &lines,
            0.265,
            disc(14.0, 0.265),
            &[],
            "#777",
        ),
    ];
    let mut legend = at(0.85, 66.0);
    for (name, pattern, cell_deg, field, published, colour) in curves {
        let ours: Vec<(f64, f64)> = (0..=70)
            .map(|step| 0.02 * f64::from(step))
            .map(|t| at(t, coverage(pattern, 0, t, cell_deg, &field)))
            .collect();
        line(&mut svg, &ours, colour, 2.5);
        for &(time_s, percent) in published {
            cross(&line, &mut svg, at(time_s, percent));
        }
        line(
            &mut svg,
            &[legend, (legend.0 + 40.0, legend.1)],
            colour,
            2.5,
        );
        text(&mut svg, (legend.0 + 50.0, legend.1 + 5.0), "start", name);
        legend.1 += 24.0;
    }
    cross(&line, &mut svg, (legend.0 + 20.0, legend.1));
    text(
        &mut svg,
        (legend.0 + 50.0, legend.1 + 5.0),
        "start",
        "published by Livox",
    );
    svg.push_str("</svg>\n");
    Ok(svg)
}

fn cross(line: &impl Fn(&mut String, &[(f64, f64)], &str, f64), svg: &mut String, at: (f64, f64)) {
    let (x, y) = at;
    line(svg, &[(x - 4.0, y - 4.0), (x + 4.0, y + 4.0)], "black", 1.2);
    line(svg, &[(x - 4.0, y + 4.0), (x + 4.0, y - 4.0)], "black", 1.2);
}
