//! The page as Markdown.

use std::fmt::Write;

use nemoral_assets::Species;
use nemoral_realism::{HeightScatter, LOW_PLANTS, Relations, ranges};

use crate::checks::{
    CANOPIES, COLOURS, Check, Column, FLOOR, PICTURES, PROFILES, SCANS, STEMS, VISIBILITY, percent,
};
use crate::measure::Stand;
use crate::plots;
use crate::wrap::wrapped;

/// Measures of grown trees of a species.
pub(crate) struct Grown {
    pub(crate) species: Species,
    /// Relations of trees of all diameters.
    pub(crate) relations: Relations,
    /// Scatter of heights of trees of a stand.
    pub(crate) heights: HeightScatter,
}

struct Page {
    text: String,
    /// Measures out of their ranges: the stand or species, the measure, the cell.
    misses: Vec<[String; 3]>,
}

/// The page as Markdown, and the plots by their file names.
pub(crate) fn write(stands: &[Stand], grown: &[Grown]) -> (String, Vec<(String, String)>) {
    let mut page = Page {
        text: String::new(),
        misses: Vec::new(),
    };
    page.relations(grown);
    page.heights(grown);
    page.stems(stands);
    page.canopies(stands);
    page.leaves(stands);
    page.profiles(stands);
    page.floor(stands);
    page.pictures(stands);
    page.classes(stands);
    let mut text = head(stands);
    page.write_misses(&mut text);
    text.push_str(&page.text);
    let mut files = Vec::new();
    text.push_str("\n## Plots\n");
    for Grown {
        species, relations, ..
    } in grown
    {
        let _ = writeln!(
            text,
            "\n### {} ({})\n",
            species.name, species.scientific_name
        );
        for (kind, plot) in plots::of_species(species, relations) {
            file(
                &mut text,
                &mut files,
                format!("{}-{kind}.svg", species.name),
                "32%",
                &plot,
            );
        }
    }
    for stand in stands {
        let _ = writeln!(text, "\n### `{}`\n", stand.name);
        for (kind, plot) in plots::of_stand(stand) {
            file(
                &mut text,
                &mut files,
                format!("{}-{kind}.svg", stand.name),
                "49%",
                &plot,
            );
        }
    }
    (wrapped(&text), files)
}

fn file(
    text: &mut String,
    files: &mut Vec<(String, String)>,
    name: String,
    width: &str,
    plot: &nemoral_realism::Plot,
) {
    let _ = writeln!(text, "<img src=\"realism/{name}\" width=\"{width}\">");
    files.push((name, plot.to_svg()));
}

fn head(stands: &[Stand]) -> String {
    let metres =
        f64::from(crate::measure::SIDE) * stands.first().map_or(50.0, |s| s.config.chunks.size_m);
    format!(
        "# Realism, measured\n\nMade by `cargo run --release -p nemoral-realism`: \
         measures of forestry, laser scanning and image statistics for each stand preset, which \
         need no photographs. Ranges without a source are assumptions of usual values, for which \
         we have read no publication. Measures out of their ranges are marked ✗ with the range, \
         and listed first. The estimators are in `tools/realism/src`; only the targets (the \
         relations, the distribution of diameters) come from the generator's own code, and \
         `crates/assets/tests/assets/measured.rs` and `trees.rs` compare these with the meshes and \
         with an independent implementation of the published formulas. The tests in \
         `tests/tests/realism` and `tests/tests/physics/dbh.rs` break causes on purpose and show \
         that each measure leaves the same range (`tools/realism/src/ranges.rs`).\n\n\
         For each stand these are all trees on {metres:.0} m x {metres:.0} m, five pictures of 640 \
         x 360 and scans of 20,000 pulses along 96 m of trail.\n",
    )
}

impl Page {
    fn add(&mut self, text: &str) {
        self.text.push_str(text);
    }

    /// Writes a table whose rows are stands.
    fn table(&mut self, stands: &[Stand], columns: &[Column]) {
        self.add("\n| stand |");
        for (head, _) in columns {
            let _ = write!(self.text, " {head} |");
        }
        let _ = writeln!(self.text, "\n|---|{}", "---|".repeat(columns.len()));
        for stand in stands {
            let _ = write!(self.text, "| {} |", stand.name);
            for (head, of) in columns {
                let check = of(stand);
                self.check(stand.name, head, &check);
                let _ = write!(self.text, " {} |", check.cell());
            }
            self.add("\n");
        }
    }

    fn check(&mut self, of: &str, measure: &str, check: &Check) {
        if !check.is_met() {
            self.misses
                .push([of.to_owned(), measure.to_owned(), check.cell()]);
        }
    }

    fn write_misses(&self, out: &mut String) {
        out.push_str("\n## Out of range\n\n");
        if self.misses.is_empty() {
            out.push_str("Nothing.\n");
            return;
        }
        out.push_str(
            "| of | measure | found, ✗, range | what may be behind it |\n|---|---|---|---|\n",
        );
        for [of, measure, cell] in &self.misses {
            let why = why(measure);
            let _ = writeln!(out, "| {of} | {measure} | {cell} | {why} |");
        }
    }

    fn relations(&mut self, grown: &[Grown]) {
        let trees = grown.first().map_or(0, |g| g.relations.sizes.len());
        let _ = writeln!(
            self.text,
            "\n## Published relations, found again\n\n\
             Height, crown width and leaf area by diameter were measured on {trees} grown trees of \
             each species, evenly over the diameters for which the relations hold. The table has \
             the mean of measured / relation of the species for the thinner and for the thicker \
             half, which should be 1 ± 3 %. The sources are in `crates/assets/species/*.toml`. The \
             last columns have heights over the formula that the species' curve was fitted to or \
             stands for (Pukkala et al. 2009 for Scots pine and birch, SEEM for Douglas fir, \
             Bartelink 1997 for beech), which should be 1 ± 10 %.\n\n\
             | species | height | | crown width | | leaf area | | height over its source | |\n\
             |---|---|---|---|---|---|---|---|---|"
        );
        for Grown {
            species, relations, ..
        } in grown
        {
            let _ = write!(self.text, "| {} |", species.name);
            for i in 0..3 {
                for half in relations.ratios {
                    let check = Check {
                        value: half[i],
                        range: Some(ranges::RELATIONS),
                        places: 3,
                    };
                    let measure = ["height", "crown width", "leaf area"][i];
                    self.check(&species.name, measure, &check);
                    let _ = write!(self.text, " {} |", check.cell());
                }
            }
            for value in relations.over_source(species).unwrap_or([f64::NAN; 2]) {
                let check = Check {
                    value,
                    range: Some(ranges::HEIGHT_SOURCES),
                    places: 3,
                };
                self.check(&species.name, "height over its source", &check);
                let _ = write!(self.text, " {} |", check.cell());
            }
            self.add("\n");
        }
    }

    fn heights(&mut self, grown: &[Grown]) {
        let trees = grown.first().map_or(0, |g| g.relations.sizes.len());
        let _ = writeln!(
            self.text,
            "\nThe scatter of heights about their curve is the standard deviation of the residuals \
             of {trees} more grown trees of each species, with the diameters of an even-aged stand \
             (Weibull, shape 3) whose mean is the least diameter of the species' mature trees. \
             Pukkala et al. 2009 found 2.36 m for Scots pine, 2.10 m for Norway spruce and 2.00 m \
             for birch, with one number for trees of all heights in all of Finland. The ranges are \
             2.0–2.4 m for these, and .08–.10 of the height for the others. Our scatter is a share \
             of the height, clipped by the limits of slenderness, so it is comparable only at such \
             heights; thin trees scatter by less.\n\n\
             | species | mean height, m | height SD, m | height SD, share | cut to the limits |\n\
             |---|---|---|---|---|"
        );
        for Grown {
            species, heights, ..
        } in grown
        {
            let name = &species.name;
            let check = |value, range, places| Check {
                value,
                range,
                places,
            };
            let metres = check(heights.sd_m, ranges::height_sd_m(name), 2);
            let share = check(heights.sd_share, ranges::height_sd_share(name), 3);
            self.check(name, "height SD, m", &metres);
            self.check(name, "height SD, share", &share);
            let _ = writeln!(
                self.text,
                "| {name} | {:.1} | {} | {} | {:.3} |",
                heights.mean_m,
                metres.cell(),
                share.cell(),
                heights.clipped
            );
        }
    }

    fn stems(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Stems\n\n- Living trees per hectare should be as asked, ± 5 %, and basal area \
             15–45 m²/ha in closed forest.\n- Of diameters, the greatest distance between their \
             distribution and the truncated Weibull asked for (with scales of trees by up to a \
             tenth) should be at most the share of one individual. The range of the fitted Weibull \
             shape contains 95 % of the fits to 400 draws of as few individuals. It is wide \
             because eight individuals per species determine a shape poorly, and not by a fault of \
             the fit.\n\
             - Height over diameter should be within the species' limits.\n\
             - Clark and Evans's R should be 0.9–1.4 in natural and managed stands, and over 1.5 \
             only in plantations. The pair correlation g should be 0 at a stem's width and 1 at \
             larger distances.\n\
             - Neighbours within 3.5 m compete in real stands: the mean product of their diameters \
             over the squared mean is under 1. Ours have this by their placement: thick trees have \
             larger distances, and in rows each tree is smaller by a share of its neighbours' \
             vigour.\n\
             - Trees are copies of a few individuals, rotated, scaled and tinted. No two copies of \
             an individual within 30 m may have rotations within 2° and sizes within 0.5 % of each \
             other (with random ones, 280 to 1,030 per million such pairs had). Dead trees are \
             counted with living ones; saplings, which are copies of saplings, are counted \
             separately.\n",
        );
        self.table(stands, STEMS);
        self.add(
            "\nDiameters are also measured from scans as in forestry: nine scans of 400,000 pulses \
             without range errors from a tripod, at stations 32 m apart. For each living stem (of \
             .07 m or more) within 15 m, a circle is fitted to the points within 6 cm of breast \
             height, of which there must be 30. The mean error against the inventory should be \
             within 3 mm, and the root mean square error under 20 mm.\n",
        );
        self.table(stands, SCANS);
    }

    fn canopies(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Canopies\n\nLines go up from 1.3 m along 57.5°, where the projection of leaves \
             hardly depends on their inclination: P = exp(-0.93 Ω LAI). LAI is that of the \
             inventory. Ω is measured from the grown leaves without casting rays at their \
             pictures:\n\
             - Ω of shoots is the silhouette of the leaves' pictures over the leaf area in the \
             inventory, which should be the species' silhouette factor ± 5 %: 4 STAR for needles, \
             and the visible share of the leaves of a spray for broad leaves (`crates/assets` \
             tests to 5 % that all of them are drawn, hidden ones too);\n\
             - 2 G is the mean projection of the silhouettes along the line by their inclinations, \
             over ½;\n- Ω of crowns and stand divides each card into 8 x 8 parts of the size of a \
             leaf. A line meets a leaf in a part that it crosses with the probability of the \
             part's share of leaf area q, so it is free with the product of all 1 - q (Nilson's \
             positive binomial within the shoot, 1971). P is the mean over 8,000 lines, and Ω = \
             -ln P / mean of the sum of q.\n\n\
             The share of the same lines, as rays through the one-bit masks, that meet no leaf \
             should be within 15 % of the law. The share that meets neither leaves nor wood should \
             be 5–15 % in closed beech and spruce, 25–45 % in pine, and over 50 % in montado. No \
             instrument in the field counts leaves: Ω there is estimated from photographs or from \
             gaps along a line, and with an LAI of 6, 5 to 15 % of sky allow an Ω of all levels of \
             at most .34 to .54. So the range of field studies (.7–.95 for closed stands of broad \
             leaves, up to 1 in rows, .5–.75 for needles: an assumption, for which no publication \
             was read) is compared with Ω by photographs: ln(mean P) / mean(ln P) (Lang and Xiang \
             1986), with the shares of sky P in sectors of 15° of the ring at 57.5° (10° wide, \
             with wood), as the mean of 200 photographs; for needles it is multiplied by that of \
             shoots, as is usual (Chen and Cihlar 1995).\n",
        );
        self.table(stands, CANOPIES);
        self.add(
            "\nThe contribution of each scale is shown by the Ω of crowns and stand if silhouettes \
             were at random places inside of voxels of this size, metres: -ln(mean exp(-L)) / mean \
             L, with the projected silhouettes L along a line.\n\n| stand |",
        );
        for (voxel_m, _) in stands.first().map_or(&[][..], |s| &s.by_scale) {
            let _ = write!(self.text, " {voxel_m} |");
        }
        let scales = stands.first().map_or(0, |s| s.by_scale.len());
        let _ = writeln!(self.text, "\n|---|{}", "---|".repeat(scales));
        for s in stands {
            let cells: String = s
                .by_scale
                .iter()
                .map(|c| format!(" {:.2} |", c.1))
                .collect();
            let _ = writeln!(self.text, "| {} |{cells}", s.name);
        }
    }

    fn leaves(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Leaf angles\n\nMean and standard deviation of the inclination, weighted by area, \
             should be within 5° of the species' files.\n\n\
             | stand | species | mean | asked | SD | asked |\n\
             |---|---|---|---|---|---|\n",
        );
        for s in stands {
            for (name, (mean, sd)) in &s.inclination {
                let Some(species) = Species::built_in(name) else {
                    continue;
                };
                let form = &species.foliage;
                let near = |value: f64, asked: f64| Check {
                    value,
                    range: Some((
                        asked - ranges::INCLINATION_DEG,
                        asked + ranges::INCLINATION_DEG,
                    )),
                    places: 1,
                };
                let (m, d) = (form.inclination_mean_deg, form.inclination_sd_deg);
                let (mean, sd) = (near(*mean, m), near(*sd, d));
                self.check(s.name, "leaf angle, mean", &mean);
                self.check(s.name, "leaf angle, SD", &sd);
                let (mean, sd) = (mean.cell(), sd.cell());
                let _ = writeln!(
                    self.text,
                    "| {} | {name} | {mean} | {m} | {sd} | {d} |",
                    s.name
                );
            }
        }
    }

    fn profiles(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Vertical profiles\n\nPlant area density by height is estimated from the first \
             returns of 100,000 pulses from above (Bouvier et al. 2015, K = 0.5). Heights are \
             relative to the dominant height (that of the 100 thickest trees per hectare). Pine \
             should be densest at .6–.8, spruce broad, and birch densest at about the middle. \
             Plots are below.\n",
        );
        self.table(stands, PROFILES);
        self.low_cover(stands);
    }

    fn low_cover(&mut self, stands: &[Stand]) {
        self.add(
            "\nThe cover of low plants is the share of the ground, trails included, where a line \
             straight down from 2 m meets a plant of the undergrowth first, in percent. We know of \
             no measurements to compare it with.\n\n| stand | any |",
        );
        for kind in LOW_PLANTS {
            let _ = write!(self.text, " {kind} |");
        }
        let _ = writeln!(self.text, "\n|---|---|{}", "---|".repeat(LOW_PLANTS.len()));
        for s in stands {
            let _ = write!(
                self.text,
                "| {} | {:.1} |",
                s.name,
                100.0 * s.low_cover.any()
            );
            for share in s.low_cover.shares() {
                let _ = write!(self.text, " {:.1} |", 100.0 * share);
            }
            self.add("\n");
        }
    }

    fn floor(&mut self, stands: &[Stand]) {
        self.add(
            "\n## The floor\n\nThe cover of a layer is the share of the ground, trails included, \
             where a line straight down from its top meets a plant of it: moss on the ground; \
             herbs, grass, ferns and seedlings below 0.5 m; shrubs below 0.5 m; whatever grows \
             from 0.5 to 1.5 m and from 1.5 to 3 m. All ranges are assumptions. Lying deadwood \
             should be what was asked for, ± 15 %. In 85 to 92 % of the plots of the Flemish \
             inventory there is less than 20 m³/ha of it, and at most 68.5 (Research Institute for \
             Nature and Forest, FutMon L2b).\n",
        );
        self.table(stands, FLOOR);
        self.add(
            "\nStems are looked for from places 1.3 m above the ground within 40 m; one is seen if \
             the line to its middle at that height meets it first. The share that is seen falls \
             off as exp(-k r), as it was found in mature stands (Lang et al. 2021, Remote Sensing \
             13:4455). Between stems alone that stand at random, k is their number on a square \
             metre times their mean diameter: what is more comes of branches, young trees and \
             undergrowth, what is less of stems that keep clear of each other. The ratio of the \
             two has a range, an assumption, in the hall of beeches alone; elsewhere it should not \
             be \
             under .8.\n",
        );
        self.table(stands, VISIBILITY);
    }

    fn pictures(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Pictures\n\nMeasures are means of five pictures. The slope is that of the \
             amplitude spectrum over frequency on logarithmic axes; photographs of nature have \
             -1.2 on average, with -0.8 to -1.5 (Tolhurst et al. 1992). Isotropy is the amplitude \
             of waves along the horizontal over that of waves along the vertical, which is more \
             than 1 with many upright objects. Its range is an assumption, and no publication that \
             we read supports it: in photographs, also of forests alone, vertical and horizontal \
             contours prevail (Coppola et al. 1998), natural scenes have most at the horizontal, \
             next at the vertical and least between (Hansen and Essock 2004), and their alignment \
             depends strongly on their content, with a difference between the two on average (Keil \
             and Cristóbal 2000). We leave it unchanged: a range is never adjusted to fit a \
             result. The repetition of ground is the greatest correlation of its brightness with \
             that at the distance of a tile's width, in sixteen directions, for the kind of ground \
             that repeats most. The spread is that of the logarithm of luminance (of the light \
             itself, before the sensor clips): photographs of town and country are said to have .8 \
             on average (Huang and Mumford 1999, which we have not read), and path-traced light in \
             beech and spruce has the same as ours, within a twentieth, once its noise is averaged \
             out (../explanation/light.md; 1.0 to 1.6 under canopies would be an assumption, and \
             most of ours are a little less). The kurtosis is that of differences from pixel to \
             pixel.\n",
        );
        self.table(stands, PICTURES);
        self.add(
            "\nThe measures of foliage are the green chromatic coordinate G / (R + G + B), the \
             median hue, and the share of vivid green (saturation over .7, value over .6). \
             Reference values are of crowns seen from above by PhenoCams on towers (Richardson et \
             al. 2018; .40–.46 for summer leaves, .36–.40 for needles, .36–.42 for eucalyptus and \
             cork oak; the ranges are assumptions, the definition is theirs), so a camera looks \
             down on the crowns, 45 m over the robot and 60° below the horizon. The table also has \
             the robot's view, in which shaded leaves are greyer, and leaves against the sun are \
             vivid, as their transmittance has no blue; path-traced light has the same shares of \
             both (../explanation/light.md).\n",
        );
        self.table(stands, COLOURS);
    }

    fn classes(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Classes\n\nShares of pixels / of points in percent show the imbalance of the \
             classes. No class but rocks should have less than 0.1 % of the pixels.\n\n| stand |",
        );
        let Some(first) = stands.first() else { return };
        for (name, ..) in &first.classes {
            let _ = write!(self.text, " {name} |");
        }
        let _ = writeln!(self.text, "\n|---|{}", "---|".repeat(first.classes.len()));
        for s in stands {
            let _ = write!(self.text, "| {} |", s.name);
            for (name, pixels, points) in &s.classes {
                let check = percent(*pixels, 1, ranges::class_share(name));
                self.check(s.name, &format!("pixels of {name}, %"), &check);
                let _ = write!(self.text, " {} / {:.1} |", check.cell(), 100.0 * points);
            }
            self.add("\n");
        }
    }
}

/// The explanation of a measure that is out of its range.
fn why(measure: &str) -> &'static str {
    match measure {
        "Weibull shape" => "eight individuals, of which some stand here more often than others",
        "Ω photographed" => {
            "crowns keep to their own width and leave the ground between them free; gaps and \
             trails count too"
        }
        "off the curve" => {
            "few shrubs beside open trails and thickets behind them: what is seen falls off late, \
             and then faster than one exponential; the range is an assumption"
        }
        "GCC" => "PROSPECT's pine needle alone has .45",
        "kurtosis of steps" => {
            "twigs and small leaves everywhere: few even surfaces; the range is an assumption"
        }
        "isotropy" => {
            "upright stems, or level ground and boughs; real forests are not isotropic either \
             (Coppola et al. 1998), and the range is an assumption"
        }
        _ => "",
    }
}
