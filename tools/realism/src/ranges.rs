//! The ranges of measures, for the page and for the tests.
#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

/// The least and the greatest value, inclusive.
pub type Range = (f64, f64);

/// Asserts that a measure is in its range, and out of it for each broken cause.
///
/// # Panics
/// If not.
pub fn leaves(measure: &str, (low, high): Range, sound: f64, broken: &[(&str, f64)]) {
    println!("{measure}: {sound:.3} in {low}..{high}; {broken:.3?}");
    assert!((low..=high).contains(&sound), "{measure}: {sound}");
    for (cause, value) in broken {
        assert!(!(low..=high).contains(value), "{measure}: {cause}: {value}");
    }
}

/// Number of grown living trees over that asked for.
pub const TREES: Range = (0.95, 1.05);

/// Basal area of a stand, m²/ha.
#[must_use]
pub fn basal_area(stand: &str) -> Range {
    if stand == "montado" {
        (3.0, 15.0)
    } else {
        (15.0, 45.0)
    }
}

/// The greatest distance between the distributions of diameters found and asked for, of one
/// individual for each of so many parts of the distribution, with chance.
#[must_use]
pub fn diameter_distance(individuals: u32) -> Range {
    (0.0, 1.0 / f64::from(individuals))
}

/// The share of trees within their species' limits of slenderness.
pub const SLENDER: Range = (0.995, 1.0);

/// Clark and Evans's R of trees in rows, or of others.
#[must_use]
pub fn clark_evans(in_rows: bool) -> Range {
    if in_rows { (1.5, 2.15) } else { (0.9, 1.4) }
}

/// The pair correlation at the distance of a stem's width.
pub const PAIRS_NEAR: Range = (0.0, 0.05);
/// The pair correlation from 5 to 15 m.
pub const PAIRS_FAR: Range = (0.9, 1.1);
/// The mark correlation of sizes of neighbours within 3.5 m.
pub const MARKS: Range = (0.85, 0.995);

/// Number of pairs of trees within 30 m that look alike, per million pairs of the same individual.
pub const ALIKE: Range = (0.0, 0.0);

/// A mean of grown trees over the published relation's.
pub const RELATIONS: Range = (0.97, 1.03);
/// A mean height of grown trees over that of the formula which the species' curve stands for.
pub const HEIGHT_SOURCES: Range = (0.9, 1.1);

/// A diameter at breast height from a scan, root mean square error, metres.
pub const DBH_RMSE_M: Range = (0.0, 0.02);
/// Its mean error, metres: 0 within the precision of some tens of stems.
pub const DBH_BIAS_M: Range = (-0.003, 0.003);

/// Standard deviation of heights about the height curve, metres, of Scots pine, Norway spruce and
/// birch: Pukkala et al. 2009 have 2.36, 2.10 and 2.00 for all of Finland.
const HEIGHT_SD_M: Range = (2.0, 2.4);
/// The same of other species, over the curve's height: an assumption.
const HEIGHT_SD_SHARE: Range = (0.08, 0.10);

/// The range of [`HeightScatter::sd_m`](super::HeightScatter::sd_m) of species that have one in
/// metres.
#[must_use]
pub fn height_sd_m(species: &str) -> Option<Range> {
    let northern = ["scots_pine", "norway_spruce", "silver_birch"];
    northern.contains(&species).then_some(HEIGHT_SD_M)
}

/// The range of [`HeightScatter::sd_share`](super::HeightScatter::sd_share) of the other species.
#[must_use]
pub fn height_sd_share(species: &str) -> Option<Range> {
    height_sd_m(species).is_none().then_some(HEIGHT_SD_SHARE)
}

/// One-sided leaf area index of a stand.
#[must_use]
pub fn leaf_area_index(stand: &str) -> Range {
    match stand {
        "beech" => (5.0, 7.0),
        "spruce" => (4.0, 8.0),
        "oak-mixed" => (3.0, 5.5),
        "eucalyptus-plantation" => (2.5, 5.0),
        "maritime-pine" => (1.5, 3.5),
        "boreal-birch-pine" => (1.5, 4.0),
        "montado" => (0.5, 2.0),
        _ => (1.5, 5.0),
    }
}

/// The silhouette of shoots over their leaf area, over that of the species' file.
pub const SHOOTS: Range = (0.95, 1.05);
/// The share of lines without a leaf over exp(-0.93 Ω LAI).
pub const OVER_THE_LAW: Range = (0.85, 1.15);

/// Whether its photographed Ω needs the factor of shoots, as no photograph shows how needles of a
/// shoot hide each other.
#[must_use]
pub fn is_of_needles(stand: &str) -> bool {
    ["spruce", "maritime-pine"].contains(&stand)
}

/// Ω by photographs: an assumption, .7 to .95 for broad leaves and .5 to .75 for needles.
#[must_use]
pub fn photographed(stand: &str) -> Option<Range> {
    match stand {
        _ if is_of_needles(stand) => Some((0.5, 0.75)),
        "beech" | "oak-mixed" => Some((0.7, 0.95)),
        // Rows are at least as regular as random places.
        "eucalyptus-plantation" => Some((0.8, 1.0)),
        _ => None,
    }
}

/// The openness of canopies of the kind along the hinge.
#[must_use]
pub fn openness(stand: &str) -> Option<Range> {
    match stand {
        "beech" | "spruce" => Some((0.05, 0.15)),
        "maritime-pine" => Some((0.25, 0.45)),
        "montado" => Some((0.5, 0.95)),
        _ => None,
    }
}

/// Greatest difference of an inclination of leaves, or of its standard deviation, from that of the
/// species, degrees.
pub const INCLINATION_DEG: f64 = 5.0;

/// The height of the densest layer over the dominant height.
#[must_use]
pub fn densest(stand: &str) -> Range {
    match stand {
        "maritime-pine" => (0.6, 0.8),
        "boreal-birch-pine" => (0.4, 0.7),
        _ => (0.3, 0.9),
    }
}

/// The extent of heights where a forest of shade-tolerant trees is at least half as dense as there,
/// over the dominant height: spruce is broad.
pub const BREADTH: Range = (0.4, 0.9);

/// How fast stems go out of sight with distance, over the law of stems alone that stand at random.
/// It is not much below 1, as stems hide stems. The preset `beech` is a hall of stems, and little
/// but these hides them (an assumption); we know of no limits for stands with undergrowth.
#[must_use]
pub fn sight(stand: &str) -> Range {
    (0.8, if stand == "beech" { 3.5 } else { f64::INFINITY })
}

/// The greatest difference of the share of stems that is seen from an exponential curve of
/// distance: Lang et al. 2021 found such curves in mature stands.
pub const OFF_THE_CURVE: Range = (0.0, 0.1);

/// Lying deadwood found, over what was asked for, m³/ha; `None` where so little is asked for that
/// it is a few logs, and chance.
#[must_use]
pub fn deadwood(asked_m3_ha: f64) -> Option<Range> {
    (asked_m3_ha >= 2.0).then_some((0.85, 1.15))
}

/// Cover of the layers of [`COVER_LAYERS`](super::COVER_LAYERS). All are assumptions of usual
/// values: surveys count what one sees in a plot of some metres, and differ by more than these.
#[must_use]
pub fn layer_cover(stand: &str) -> [Option<Range>; 5] {
    let [moss, herbs, low, middle, high] = match stand {
        "maritime-pine" => [
            (0.0, 0.3),
            (0.05, 0.5),
            (0.03, 0.5),
            (0.05, 0.5),
            (0.0, 0.3),
        ],
        "eucalyptus-plantation" => [
            (0.0, 0.2),
            (0.03, 0.4),
            (0.01, 0.4),
            (0.01, 0.4),
            (0.0, 0.2),
        ],
        "oak-mixed" => [
            (0.02, 0.5),
            (0.1, 0.7),
            (0.02, 0.4),
            (0.03, 0.4),
            (0.0, 0.3),
        ],
        "beech" => [
            (0.0, 0.2),
            (0.02, 0.4),
            (0.0, 0.15),
            (0.0, 0.15),
            (0.0, 0.1),
        ],
        "spruce" => [(0.1, 0.8), (0.01, 0.4), (0.0, 0.3), (0.0, 0.2), (0.0, 0.1)],
        "boreal-birch-pine" => [(0.3, 0.95), (0.05, 0.5), (0.1, 0.6), (0.0, 0.2), (0.0, 0.1)],
        _ => [(0.0, 1.0), (0.3, 0.95), (0.0, 0.2), (0.0, 0.2), (0.0, 0.1)],
    };
    [moss, herbs, low, middle, high].map(Some)
}

/// The slope of the amplitude spectrum: photographs of nature (Tolhurst et al. 1992).
pub const SLOPE: Range = (-1.5, -0.8);
/// Amplitudes of waves along the horizontal over those along the vertical. The range is an
/// assumption: photographs of nature have more of both than of diagonal waves, and not equally
/// (Coppola et al. 1998, PNAS 95:4002; Hansen and Essock 2004, J. Vision 4(12):5; Keil and
/// Cristóbal 2000, JOSA A 17:697).
pub const ISOTROPY: Range = (0.9, 1.1);
/// Correlation of ground with itself at the distance of a tile.
pub const GROUND_REPEATS: Range = (-1.0, 0.15);
/// Standard deviation of the logarithm of luminance.
pub const LOG_LUMINANCE_SD: Range = (0.75, 1.6);
/// Kurtosis of differences from pixel to pixel.
pub const KURTOSIS: Range = (6.0, 100.0);

/// The green chromatic coordinate of crowns from above, of a stand with this share of needle trees:
/// needles and waxy evergreen leaves are greyer than summer leaves.
#[must_use]
pub fn green(stand: &str, needles: f64) -> Range {
    match needles {
        _ if ["eucalyptus-plantation", "montado"].contains(&stand) => (0.36, 0.42),
        share if share > 0.95 => (0.36, 0.40),
        share if share < 0.05 => (0.40, 0.46),
        _ => (0.36, 0.46),
    }
}

/// Median hue of foliage, degrees.
pub const HUE_DEG: Range = (70.0, 110.0);
/// Share of foliage that is vivid green.
pub const GLARING: Range = (0.0, 0.01);

/// The share of a class in the pixels; rocks may be missing.
#[must_use]
pub fn class_share(class: &str) -> Option<Range> {
    (class != "Rocks").then_some((0.001, 1.0))
}
