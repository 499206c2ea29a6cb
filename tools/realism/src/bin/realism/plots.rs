//! The plots of the page.

use nemoral_assets::{Species, TreeSize};
use nemoral_realism::{Plot, Relations, Series, asked_diameters};

use crate::measure::{Stand, ring_m};

fn plot(title: &str, x: &str, y: &str, series: Vec<Series>) -> Plot {
    Plot {
        title: title.to_owned(),
        x: x.to_owned(),
        y: y.to_owned(),
        series,
        band: None,
    }
}

fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Series {
    Series {
        name: name.into(),
        points,
        line: true,
    }
}

fn dots(name: impl Into<String>, points: Vec<(f64, f64)>) -> Series {
    Series {
        name: name.into(),
        points,
        line: false,
    }
}

/// Plots of a species: grown trees and the published curves.
pub(crate) fn of_species(species: &Species, relations: &Relations) -> [(&'static str, Plot); 3] {
    let [low, high] = species.allometry.dbh_range_m;
    let of = |title: &str, y: &str, grown: fn(&TreeSize) -> f64, curve: &dyn Fn(f64) -> f64| {
        let trees = relations.sizes.iter();
        let trees = trees.map(|t| (100.0 * t.dbh_m, grown(t))).collect();
        let curve = (0..=60).map(|i| {
            let d = low + (high - low) * f64::from(i) / 60.0;
            (100.0 * d, curve(d))
        });
        let series = vec![dots("grown", trees), line("published", curve.collect())];
        plot(title, "DBH, cm", y, series)
    };
    [
        (
            "height",
            of("Height", "m", |t| t.height_m, &|d| species.mean_height_m(d)),
        ),
        (
            "crown",
            of("Crown width", "m", |t| 2.0 * t.crown_radius_m, &|d| {
                species.mean_crown_width_m(d)
            }),
        ),
        (
            "leaves",
            of("Leaf area", "m²", |t| t.leaf_area_m2, &|d| {
                species.mean_leaf_area_m2(d)
            }),
        ),
    ]
}

/// Plots of a stand: diameters, pairs, gaps and profile.
pub(crate) fn of_stand(stand: &Stand) -> [(&'static str, Plot); 4] {
    [
        ("diameter", diameters(stand)),
        ("pairs", pairs(stand)),
        ("profile", profile(stand)),
        ("clumping", clumping(stand)),
    ]
}

fn diameters(stand: &Stand) -> Plot {
    const BIN_M: f64 = 0.03;
    let histogram = |of: &[f64]| -> Vec<(f64, f64)> {
        let bin = |i: u32| {
            let (low, high) = (f64::from(i) * BIN_M, f64::from(i + 1) * BIN_M);
            let inside = of.iter().filter(|d| (low..high).contains(*d)).count();
            let density = inside as f64 / of.len() as f64 / BIN_M;
            (100.0 * (low + 0.5 * BIN_M), density)
        };
        (0..30).map(bin).collect()
    };
    let found: Vec<f64> = stand.trees.iter().map(|t| t.dbh_m).collect();
    let (shape, scale) = stand.weibull;
    let density = |d: f64| {
        let x = d / scale;
        shape / scale * x.powf(shape - 1.0) * (-x.powf(shape)).exp()
    };
    let fitted = (1..90).map(|d| (f64::from(d), density(f64::from(d) / 100.0)));
    let series = vec![
        dots("trees", histogram(&found)),
        line("asked", histogram(&asked_diameters(&stand.config.assets))),
        line(format!("Weibull, shape {shape:.2}"), fitted.collect()),
    ];
    plot("Diameters", "DBH, cm", "share per m", series)
}

fn pairs(stand: &Stand) -> Plot {
    let points = stand.pairs.iter().enumerate();
    let points = points.map(|(i, g)| (ring_m(i), *g)).collect();
    let mut plot = plot(
        "Pair correlation of stems",
        "distance, m",
        "g",
        vec![line("g(r)", points)],
    );
    plot.band = Some((0.9, 1.1));
    plot
}

fn profile(stand: &Stand) -> Plot {
    let top = (1.4 * stand.dominant_m) as usize;
    let points = stand.profile.iter().enumerate().take(top);
    let points = points.map(|(z, d)| (*d, z as f64 + 0.5)).collect();
    let title = "Plant area density by height, from above";
    plot(
        title,
        "m²/m³",
        "height above ground, m",
        vec![line("", points)],
    )
}

fn clumping(stand: &Stand) -> Plot {
    let points = stand.by_scale.iter().map(|(m, omega)| (m.log2(), *omega));
    let title = "Ω of crowns and stand by voxel";
    plot(
        title,
        "log2 of voxel, m",
        "Ω",
        vec![line("", points.collect())],
    )
}
