//! The page and its plots.

use std::fmt::Write;

use nemoral_assets::Species;
use nemoral_tests::realism::{Plot, Series};

use crate::measure::{STEP_M, Stand};

/// What canopies of the kind leave open along 57.5 degrees, and their clumping (`reference/vegetation.md`
/// sections 2.3 and 7).
fn canopy(name: &str) -> ((f64, f64), (f64, f64)) {
    match name {
        "beech" => ((0.03, 0.15), (0.75, 1.0)),
        "spruce" => ((0.03, 0.15), (0.5, 0.9)),
        "oak-mixed" => ((0.03, 0.20), (0.7, 1.0)),
        "montado" => ((0.5, 0.9), (0.4, 0.9)),
        "eucalyptus-plantation" => ((0.1, 0.45), (0.5, 0.95)),
        _ => ((0.2, 0.45), (0.5, 0.9)),
    }
}

fn mark(value: f64, (low, high): (f64, f64)) -> &'static str {
    if (low..=high).contains(&value) {
        "yes"
    } else {
        "**no**"
    }
}

/// The page as Markdown, and the plots by their file names.
pub(crate) fn write(stands: &[Stand]) -> (String, Vec<(String, String)>) {
    let mut out = String::from(
        "# Realism, measured\n\nMade by `cargo run --release -p nemoral-tests --example realism`: the measures of \
         `reference/vegetation.md` section 7 that need no photograph, for each stand preset, against the ranges of real \
         forests. The estimators are in `tests/src/realism`, share no code with what they measure, and their unit tests \
         break each cause on purpose (a grid, clumps, noise, blur, game green) to see the measure leave its range.\n",
    );
    stems(&mut out, stands);
    canopies(&mut out, stands);
    leaves(&mut out, stands);
    pictures(&mut out, stands);
    classes(&mut out, stands);
    let mut plots = Vec::new();
    for stand in stands {
        let _ = writeln!(out, "\n## {}\n", stand.name);
        for (kind, plot) in [
            ("height", heights(stand)),
            ("diameter", diameters(stand)),
            ("pairs", pairs(stand)),
            ("profile", profile(stand)),
        ] {
            let file = format!("{}-{kind}.svg", stand.name);
            let _ = writeln!(out, "<img src=\"realism/{file}\" width=\"49%\">");
            plots.push((file, plot.to_svg()));
        }
    }
    (out, plots)
}

fn stems(out: &mut String, stands: &[Stand]) {
    out.push_str(
        "\n## Stems\n\nTrees per hectare as asked, basal area 15-45 m²/ha in closed forest, the Weibull shape of the living trees' \
         diameters (asked, before truncation, and fitted), Clark and Evans's R: 0.8-1.4 in natural and managed stands, over 1.5 \
         only in plantations.\n\n| stand | trees/ha asked | trees/ha living | basal area, m²/ha | shape asked | shape | R | R in range |\n|---|---|---|---|---|---|---|---|\n",
    );
    for s in stands {
        let per_ha = 10_000.0 / (s.config.chunks.size_m * s.config.chunks.size_m);
        let rows = s.config.placement.rows.spacing_m > 0.0;
        let range = if rows { (1.5, 2.15) } else { (0.8, 1.4) };
        let _ = writeln!(
            out,
            "| {} | {:.0} | {:.0} | {:.1} | {} | {:.2} | {:.2} | {} |",
            s.name,
            s.config.placement.trees * per_ha,
            s.per_chunk * per_ha,
            s.basal_area_m2_ha,
            s.config.assets.dbh_shape,
            s.weibull.0,
            s.clark_evans,
            mark(s.clark_evans, range)
        );
    }
}

fn canopies(out: &mut String, stands: &[Stand]) {
    out.push_str(
        "\n## Canopies\n\nFrom 1.3 m up along 57.5°, where leaves of any inclination project alike: the share of rays that meet the sky, and what \
         exp(-0.93 Ω LAI) says of the leaf area that was grown, with Ω (Lang and Xiang 1986) from the same rays in sectors of \
         15 degrees. Stems and branches are met too, which the law does not know.\n\n| stand | LAI grown | Ω | openness | law | range | in range |\n|---|---|---|---|---|---|---|\n",
    );
    for s in stands {
        let (open, _) = canopy(s.name);
        let law = (-0.93 * s.clumping * s.leaf_area_index).exp();
        let _ = writeln!(
            out,
            "| {} | {:.2} | {:.2} | {:.3} | {law:.3} | {}-{} | {} |",
            s.name,
            s.leaf_area_index,
            s.clumping,
            s.openness,
            open.0,
            open.1,
            mark(s.openness, open)
        );
    }
}

fn leaves(out: &mut String, stands: &[Stand]) {
    out.push_str(
        "\n## Leaf angles\n\nMean and standard deviation of the inclination, weighted by area, against the species' files, ± 5° each.\n\n| stand | species | mean | asked | SD | asked | in range |\n|---|---|---|---|---|---|---|\n",
    );
    for s in stands {
        for (name, (mean, sd)) in &s.inclination {
            let Some(species) = Species::built_in(name) else {
                continue;
            };
            let form = &species.foliage;
            let (m, d) = (form.inclination_mean_deg, form.inclination_sd_deg);
            let fine = (mean - m).abs() <= 5.0 && (sd - d).abs() <= 5.0;
            let _ = writeln!(
                out,
                "| {} | {name} | {mean:.1}° | {m}° | {sd:.1}° | {d}° | {} |",
                s.name,
                if fine { "yes" } else { "**no**" }
            );
        }
    }
}

fn pictures(out: &mut String, stands: &[Stand]) {
    out.push_str(
        "\n## Pictures\n\nThe slope of the amplitude spectrum over frequency on logarithmic axes: natural images have -1.2 on average, -0.8 to -1.5 (Tolhurst et al. \
         1992). The green chromatic coordinate of foliage (summer broadleaf .40-.46, conifers .36-.40, ours also in warm light: .33-.46) and the share of it that \
         glares (saturation over .7 and value over .6: under 1 %).\n\n| stand | slope | in range | GCC | in range | glaring |\n|---|---|---|---|---|---|\n",
    );
    for s in stands {
        let (gcc, glaring) = s.colour.map_or((f64::NAN, 0.0), |c| (c.gcc, c.glaring));
        let _ = writeln!(
            out,
            "| {} | {:.2} | {} | {gcc:.3} | {} | {:.2} % |",
            s.name,
            s.slope,
            mark(s.slope, (-1.5, -0.8)),
            mark(gcc, (0.33, 0.46)),
            100.0 * glaring
        );
    }
}

fn classes(out: &mut String, stands: &[Stand]) {
    out.push_str(
        "\n## Classes\n\nShares of pixels / of points, percent: what a learner will find unbalanced.\n\n| stand |",
    );
    let Some(first) = stands.first() else { return };
    for (name, ..) in &first.classes {
        let _ = write!(out, " {name} |");
    }
    let _ = writeln!(out, "\n|---|{}", "---|".repeat(first.classes.len()));
    for s in stands {
        let _ = write!(out, "| {} |", s.name);
        for (_, pixels, points) in &s.classes {
            let _ = write!(out, " {:.1} / {:.1} |", 100.0 * pixels, 100.0 * points);
        }
        out.push('\n');
    }
}

fn species_of(stand: &Stand) -> Vec<String> {
    let mut names: Vec<String> = stand.trees.iter().map(|t| t.species.clone()).collect();
    names.sort();
    names.dedup();
    names
}

fn heights(stand: &Stand) -> Plot {
    let mut series = Vec::new();
    for name in species_of(stand) {
        let trees = stand.trees.iter().filter(|t| t.species == name);
        let points: Vec<(f64, f64)> = trees
            .take(250)
            .map(|t| (100.0 * t.dbh_m, t.height_m))
            .collect();
        let most = points.iter().map(|p| p.0).fold(0.0, f64::max);
        series.push(Series {
            name: name.clone(),
            points,
            line: false,
        });
        if let Some(species) = Species::built_in(&name) {
            let curve = (8..=most as u32).map(|d| {
                let d = f64::from(d);
                (d, species.mean_height_m(d / 100.0))
            });
            series.push(Series {
                name: format!("{name}, published"),
                points: curve.collect(),
                line: true,
            });
        }
    }
    Plot {
        title: "Height and diameter".to_owned(),
        x: "DBH, cm".to_owned(),
        y: "height, m".to_owned(),
        series,
        band: None,
    }
}

fn diameters(stand: &Stand) -> Plot {
    let n = stand.trees.len() as f64;
    let bin = 0.04;
    let histogram = (0..24).map(|i| {
        let (low, high) = (f64::from(i) * bin, f64::from(i + 1) * bin);
        let inside = stand
            .trees
            .iter()
            .filter(|t| (low..high).contains(&t.dbh_m));
        (100.0 * (low + 0.5 * bin), inside.count() as f64 / n / bin)
    });
    let (shape, scale) = stand.weibull;
    let density = |d: f64| {
        let x = d / scale;
        shape / scale * x.powf(shape - 1.0) * (-x.powf(shape)).exp()
    };
    Plot {
        title: "Diameters".to_owned(),
        x: "DBH, cm".to_owned(),
        y: "share per m".to_owned(),
        series: vec![
            Series {
                name: "trees".to_owned(),
                points: histogram.collect(),
                line: false,
            },
            Series {
                name: format!("Weibull, shape {shape:.2}"),
                points: (1..96)
                    .map(|d| (f64::from(d), density(f64::from(d) / 100.0)))
                    .collect(),
                line: true,
            },
        ],
        band: None,
    }
}

fn pairs(stand: &Stand) -> Plot {
    let points = stand.pairs.iter().enumerate();
    Plot {
        title: "Pair correlation of stems".to_owned(),
        x: "distance, m".to_owned(),
        y: "g".to_owned(),
        series: vec![Series {
            name: "g(r)".to_owned(),
            points: points
                .map(|(i, g)| ((i as f64 + 0.5) * STEP_M, *g))
                .collect(),
            line: true,
        }],
        band: Some((0.9, 1.1)),
    }
}

fn profile(stand: &Stand) -> Plot {
    let points = stand.profile.iter().enumerate();
    Plot {
        title: "Plant area density by height".to_owned(),
        x: "height above ground, m".to_owned(),
        y: "m²/m³".to_owned(),
        series: vec![Series {
            name: "from gaps towards the zenith".to_owned(),
            points: points.map(|(z, d)| (z as f64 + 0.5, *d)).collect(),
            line: true,
        }],
        band: None,
    }
}
