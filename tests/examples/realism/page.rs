//! The page as Markdown.

use std::fmt::Write;

use nemoral_assets::Species;
use nemoral_tests::realism::{HeightScatter, LOW_PLANTS, Relations, ranges};

use crate::checks::{CANOPIES, COLOURS, Check, Column, PICTURES, PROFILES, SCANS, STEMS, percent};
use crate::measure::{STEP_M, Stand};
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
    plot: &nemoral_tests::realism::Plot,
) {
    let _ = writeln!(text, "<img src=\"realism/{name}\" width=\"{width}\">");
    files.push((name, plot.to_svg()));
}

fn head(stands: &[Stand]) -> String {
    let metres =
        f64::from(crate::measure::SIDE) * stands.first().map_or(50.0, |s| s.config.chunks.size_m);
    format!(
        "# Realism, measured\n\nMade by `cargo run --release -p nemoral-tests --example realism`: \
         what foresters, people who scan woods and people who measure pictures would check, for \
         each stand preset, with no photograph needed. Ranges in which no source is named are \
         assumptions: what we hold to be usual, without a publication that we have read for it. \
         What is out of its range is marked ✗ with the range, and listed first. The estimators are \
         in `tests/src/realism`; only what was asked for (the relations, the diameters' \
         distribution) comes of the generator's own code, and `crates/assets/tests/measured.rs` \
         and `trees.rs` hold that to the meshes and to the published formulas written out anew. \
         `dbh.rs`, `pictures.rs`, `realism.rs` and `relations.rs` in `tests/tests` break causes on \
         purpose and see each measure leave its range there, the same range \
         (`tests/src/realism/ranges.rs`).\n\nEach stand: all trees on {metres:.0} m x {metres:.0} \
         m, five pictures of 640 x 360 and scans of 20,000 pulses along 96 m of trail.\n",
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
             Height, crown width and leaf area over diameter, measured on {trees} grown trees of \
             each species, evenly over the diameters that the relations hold for: mean of measured \
             / published, of the thinner and of the thicker half, ± 3 % wanted. The sources are in \
             `crates/assets/species/*.toml`.\n\n\
             | species | height | | crown width | | leaf area | |\n|---|---|---|---|---|---|---|"
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
            self.add("\n");
        }
    }

    fn heights(&mut self, grown: &[Grown]) {
        let trees = grown.first().map_or(0, |g| g.relations.sizes.len());
        let _ = writeln!(
            self.text,
            "\nHow heights scatter about their curve: the standard deviation of the residuals of \
             {trees} more grown trees of each species, with the diameters of an even-aged stand \
             (Weibull, shape 3) whose mean is where the species' mature trees begin. Pukkala et \
             al. 2009 found 2.36 m for Scots pine, 2.10 m for Norway spruce and 2.00 m for birch, \
             one number for trees of all heights, as stands of all Finland differ too: 2.0–2.4 m \
             are wanted of these, .08–.10 of the height of the others. Ours is a share of the \
             height, less what the limits of slenderness cut off, so it is comparable at such \
             heights only; thin trees scatter by less.\n\n\
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
            "\n## Stems\n\n- Living trees per hectare: as asked, ± 5 %. Basal area: 15–45 m²/ha in \
             closed forest.\n- Diameters: the greatest distance between their distribution and the \
             truncated Weibull asked for (with the tenth either way by which trees are scaled), at \
             most the share of one individual; the Weibull shape fitted to them, where 95 % of the \
             fits to as few individuals lie that were drawn anew 400 times. Eight individuals a \
             species do not tell a shape well: that is this range, and not a fault of the fit.\n\
             - Height over diameter within the species' limits.\n\
             - Clark and Evans's R: 0.9–1.4 in natural and managed stands, over 1.5 only in \
             plantations. The pair correlation g: none at a stem's width, 1 farther off.\n\
             - Neighbours within 3.5 m keep each other small in real stands: the mean product of \
             their diameters over the squared mean is under 1. Ours do by how they are placed: \
             thick ones keep others farther off, and in rows each is a share smaller for its \
             neighbours' vigour.\n\
             - Trees are copies of a few individuals, turned, scaled and tinted: no two of the \
             same individual within 30 m are turned within 2° of each other and of one size within \
             0.5 % (by chance, 280 to 1,030 of a million such pairs were). Dead trees are counted \
             with living ones; saplings, which are copies of saplings, for themselves.\n",
        );
        self.table(stands, STEMS);
        self.add(
            "\nDiameters from scans, as foresters take them: nine scans of 400,000 pulses without \
             range errors from a tripod, stations 32 m apart; of each living stem (of .07 m or \
             more) within 15 m the points within 6 cm of breast height, 30 at least, and the \
             circle nearest to them. Of what that finds less what the inventory says: the mean is \
             within 3 mm of none, the root mean square under 20 mm.\n",
        );
        self.table(stands, SCANS);
    }

    fn canopies(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Canopies\n\nLines up from 1.3 m along 57.5°, where leaves of any inclination \
             project alike: P = exp(-0.93 Ω LAI). LAI is the inventory's. Ω is measured from the \
             leaves as they were grown, and casts no ray at their pictures:\n\
             - Ω of shoots: silhouette of the leaves' pictures over the leaf area in the \
             inventory; the species' silhouette factor ± 5 %, of needles 4 STAR, of broad leaves \
             what those of a spray do not hide of each other (that all of them are drawn, hidden \
             ones too, is tested to 5 % in `crates/assets`);\n\
             - 2 G: mean projection of the silhouettes along the line by their inclinations, over \
             a half;\n- Ω of crowns and stand: each card in 8 x 8 parts, as large as a leaf; a \
             line meets a leaf in a part that it crosses with the probability of the part's share \
             of leaf area q, so it is free with the product of all 1 - q (Nilson's positive \
             binomial within the shoot, 1971), P is the mean over 8,000 lines, and Ω = -ln P / \
             mean of the sum of q.\n\n\
             Beside it the share of the same lines, as rays through the one-bit masks, that meet \
             no leaf: within 15 % of the law. And those that meet nothing, wood included: closed \
             beech and spruce 5–15 %, pine 25–45 %, montado over 50 %. No instrument in the field \
             counts leaves: Ω there comes of photographs or of gaps along a line, and with LAI 6, \
             5 to 15 % of sky leave of the Ω of all levels no more than .34 to .54. So the range \
             of field studies (closed stands of broad leaves .7–.95, in rows to 1, of needles \
             .5–.75: an assumption, no publication was read for it) is held against Ω as \
             photographs have it: of each the shares of sky P in sectors of 15° of the ring at \
             57.5° (10° wide, wood included), ln(mean P) / mean(ln P) (Lang and Xiang 1986), the \
             mean of 200 photographs; of needles times that of shoots, as is usual (Chen and \
             Cihlar 1995).\n",
        );
        self.table(stands, CANOPIES);
        self.add(
            "\nWhat each scale adds: Ω of crowns and stand if silhouettes were at random \
            inside of voxels of this size, metres; -ln(mean exp(-L)) / mean L, L the projected \
            silhouettes along a line.\n\n| stand |",
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
             within 5° of the species' files.\n\n| stand | species | mean | asked | SD | asked |\n\
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
            "\n## Vertical profiles\n\nPlant area density by height from the first returns of \
             100,000 pulses from above (Bouvier et al. 2015, K = 0.5), heights over the dominant \
             height (the 100 thickest of a hectare). Pine is densest at .6–.8, spruce broad, birch \
             at about the middle. Plots below.\n",
        );
        self.table(stands, PROFILES);
        self.low_cover(stands);
    }

    fn low_cover(&mut self, stands: &[Stand]) {
        self.add(
            "\nLow plants: the share of the ground, trails included, on which a line straight down \
             from 2 m above it meets a plant of the undergrowth first, percent; of what these \
             ought to be we know no measurement.\n\n| stand | any |",
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

    fn pictures(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Pictures\n\nMeans of five pictures. The slope of the amplitude spectrum over \
             frequency on logarithmic axes: photographs of nature have -1.2 on average, -0.8 to \
             -1.5 (Tolhurst et al. 1992); isotropy, the amplitude of waves along the horizontal \
             over that of waves along the vertical, more than 1 where upright things are many. Its \
             range is an assumption, and nothing that was read bears it out: in photographs, also \
             of forests alone, vertical and horizontal contours prevail (Coppola et al. 1998), \
             natural scenes have most at the horizontal, next at the vertical and least between \
             (Hansen and Essock 2004), and how they are aligned depends strongly on what they are \
             of, with a difference between the two on average (Keil and Cristóbal 2000). We leave \
             it as it is: a range is not moved to what was found. Further: how much the ground \
             repeats: the greatest correlation of its brightness with that one tile's width away, \
             in sixteen directions, of the kind of ground that does most; the spread of the \
             logarithm of luminance (of the light itself, before the sensor clips): photographs of \
             town and country are said to have .8 on average (Huang and Mumford 1999, which we \
             have not read), and followed light in beech and spruce as much as ours, within a \
             twentieth, once its noise is averaged away (docs/explanation/light.md; 1.0 to 1.6 \
             under canopies would be an assumption, and most of ours are a little less); the \
             kurtosis of steps from pixel to pixel.\n",
        );
        self.table(stands, PICTURES);
        self.add(
            "\nOf foliage: the green chromatic coordinate G / (R + G + B), the median hue, the \
             share that glares (saturation over .7, value over .6). What is known of them is of \
             crowns seen from above, by PhenoCams on towers (Richardson et al. 2018: summer leaves \
             .40–.46, needles .36–.40, eucalyptus and cork oak .36–.42: the ranges are \
             assumptions, the definition is theirs): so a camera looks down on them, 45 m over the \
             robot, 60° below the horizon. Beside it what the robot sees: leaves in the light of \
             shade are greyer, and those with the sun behind them glare, as their transmittance \
             has no blue; followed light shows as many of both (docs/explanation/light.md).\n",
        );
        self.table(stands, COLOURS);
    }

    fn classes(&mut self, stands: &[Stand]) {
        self.add(
            "\n## Classes\n\nShares of pixels / of points, percent: what a learner will find \
             unbalanced. None but rocks should be under 0.1 % of the pixels.\n\n| stand |",
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

/// The middle of a ring of the pair correlation, metres.
pub(crate) fn ring_m(i: usize) -> f64 {
    (i as f64 + 0.5) * STEP_M
}
