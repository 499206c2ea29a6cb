//! Leaves through the year: when they unfold, turn and fall, and what they look like meanwhile.
//!
//! Leaf area follows the double logistic curve that phenology is fitted with (Elmore et al. 2012,
//! "Landscape controls on the timing of spring, autumn, and growing season length in mid-Atlantic
//! forests"), whose first half makes leaves larger and whose second half makes them fewer. All days
//! are days of the year of the northern hemisphere; south of the equator they are half a year
//! later.

mod seasonal_leaves;

use nemoral_scene::ParamError;
use serde::Deserialize;

pub use self::seasonal_leaves::LeafSpectra;
pub(crate) use self::seasonal_leaves::SeasonalLeaves;

use super::ranges::Ranges;

/// A day at a latitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Season {
    /// The day of the year, 1..=366.
    pub day_of_year: f64,
    /// Latitude, north positive, −70..=70 degrees.
    pub latitude_deg: f64,
}

/// The year of a deciduous species. Each event has its day of the year at latitudes of 40, 50 and
/// 60 degrees, 1..=366, on low ground; what is between and beyond them follows the lines through
/// them.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phenology {
    /// Leaves have a tenth of their area.
    pub bud_burst: [f64; 3],
    /// Leaves have nine tenths of their area; 8 to 60 days after bud burst.
    pub full_leaf: [f64; 3],
    /// Half of the leaves have turned; at least 60 days after full leaf.
    pub peak_colour: [f64; 3],
    /// Half of the leaves have fallen; up to 60 days after the peak of colour.
    pub half_fallen: [f64; 3],
    /// Duration of the fall, the scale of a logistic curve: from 12 to 88 % in four times as many
    /// days, 1..=20.
    pub fall_days: f64,
    /// The share of dead leaves that stay on until bud burst: of saplings and seedlings, and of
    /// grown trees, 0..=0.9.
    pub marcescent: [f64; 2],
    /// Leaves at the peak of colour.
    pub turned: LeafSpectra,
    /// Leaves before they fall, and those that stay on.
    pub withered: LeafSpectra,
}

/// Where a tree is in its year.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhenologyState {
    /// The area of each leaf over that of a grown one, 0..=1.
    pub grown: f64,
    /// The share of leaves that have not fallen, 0..=1.
    pub kept: f64,
    /// How young leaves are: 1 as they unfold, 0 a month after full leaf.
    pub young: f64,
    /// Days since half of the leaves had turned, −60..=60.
    pub turned_days: f64,
}

/// How long leaves look young after full leaf, days.
const YOUNG_DAYS: f64 = 30.0;
/// Fresh litter fades by a factor of e in so many days.
const LITTER_FADES_DAYS: f64 = 120.0;
/// So long after they have turned, leaves change no more.
const LATE_DAYS: f64 = 60.0;
/// The days between the tenth and nine tenths of a logistic curve of scale 1.
const TENTH_TO_NINE_TENTHS: f64 = 4.394;

impl Season {
    /// Refuses a day or a latitude that there is not.
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        ParamError::check_within("season.day_of_year", self.day_of_year, 1.0, 366.0)?;
        ParamError::check_within("season.latitude_deg", self.latitude_deg, -70.0, 70.0)
    }

    /// The day of the year that has the same season in the north, 0..365.25.
    pub(crate) fn northern_day(&self) -> f64 {
        let half_year = if self.latitude_deg < 0.0 {
            182.625
        } else {
            0.0
        };
        (self.day_of_year + half_year).rem_euclid(365.25)
    }

    /// The day at this latitude of an event that has days at 40, 50 and 60 degrees.
    pub(crate) fn day_of(&self, [at_40, at_50, at_60]: [f64; 3]) -> f64 {
        let latitude = self.latitude_deg.abs();
        if latitude < 50.0 {
            at_50 + (at_50 - at_40) * (latitude - 50.0) / 10.0
        } else {
            at_50 + (at_60 - at_50) * (latitude - 50.0) / 10.0
        }
    }
}

impl PhenologyState {
    /// High summer.
    pub const SUMMER: Self = Self {
        grown: 1.0,
        kept: 1.0,
        young: 0.0,
        turned_days: -LATE_DAYS,
    };

    /// Leaf area over that of high summer.
    #[must_use]
    pub fn leaf_area(&self) -> f64 {
        self.grown * self.kept
    }
}

impl Phenology {
    /// Where a tree is in its year that is so many days later than most of its species; the young
    /// stand under others, unfold a week before them and keep more dead leaves.
    #[must_use]
    pub fn phase(&self, season: &Season, late_days: f64, is_young: bool) -> PhenologyState {
        let [bud_burst, full_leaf] =
            [self.bud_burst, self.full_leaf].map(|days| season.day_of(days));
        let half_grown = 0.5 * (bud_burst + full_leaf);
        // Lines through days may meet beyond them.
        let growing_days = ((full_leaf - bud_burst) / TENTH_TO_NINE_TENTHS).max(1.0);
        let mut day = season.northern_day() - late_days;
        let spring_day = day + if is_young { 7.0 } else { 0.0 };
        // Before anything unfolds, what is left of last year's leaves is there.
        let is_spring = spring_day >= half_grown - 5.0 * growing_days;
        let grown = logistic((spring_day - half_grown) / growing_days);
        let young = ((full_leaf + YOUNG_DAYS - spring_day) / YOUNG_DAYS).clamp(0.0, 1.0);
        if !is_spring {
            day += 365.25;
        }
        let marcescent = self.marcescent[usize::from(!is_young)];
        let hanging = logistic((season.day_of(self.half_fallen) - day) / self.fall_days);
        PhenologyState {
            grown: if is_spring { settled(grown) } else { 1.0 },
            kept: marcescent + (1.0 - marcescent) * settled(hanging),
            young: if is_spring { young } else { 0.0 },
            turned_days: (day - season.day_of(self.peak_colour)).clamp(-LATE_DAYS, LATE_DAYS),
        }
    }

    /// How much of the litter has just fallen, over what it is in high summer: nearly 1 when the
    /// last leaves have come down, then less from month to month.
    pub(crate) fn fresh_litter(&self, season: &Season) -> f64 {
        let fresh = |days: f64| {
            logistic(days / self.fall_days) * libm::exp(-days.max(0.0) / LITTER_FADES_DAYS)
        };
        let fallen = season.day_of(self.half_fallen);
        let days = (season.northern_day() - fallen + 60.0).rem_euclid(365.25) - 60.0;
        let in_summer = fresh(365.25 + 172.0 - fallen);
        ((fresh(days) - in_summer) / (1.0 - in_summer)).max(0.0)
    }

    pub(super) fn check(&self, species: &str) -> Result<(), ParamError> {
        let name = format!("{species}.phenology");
        let r = Ranges(&name);
        for k in 0..3 {
            let field = |name: &str| format!("{name}[{k}]");
            let (burst, full) = (self.bud_burst[k], self.full_leaf[k]);
            let (peak, fallen) = (self.peak_colour[k], self.half_fallen[k]);
            r.one(&field("bud_burst"), burst, 1.0, 230.0)?;
            r.one(&field("full_leaf"), full, burst + 8.0, burst + 60.0)?;
            r.one(&field("peak_colour"), peak, full + 60.0, 366.0)?;
            r.one(
                &field("half_fallen"),
                fallen,
                peak,
                (peak + 60.0).min(366.0),
            )?;
        }
        r.one("fall_days", self.fall_days, 1.0, 20.0)?;
        r.each("marcescent", &self.marcescent, 0.0, 0.9)?;
        self.turned.check(&r, "turned")?;
        self.withered.check(&r, "withered")
    }
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-x))
}

/// A share that a logistic curve has nearly reached is reached.
fn settled(share: f64) -> f64 {
    match share {
        s if s < 0.005 => 0.0,
        s if s > 0.995 => 1.0,
        s => s,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Species;

    pub(super) fn deciduous() -> Vec<(Species, Phenology)> {
        let all = Species::all().into_iter();
        all.filter_map(|s| s.phenology.map(|p| (s, p))).collect()
    }

    pub(super) fn at(day_of_year: f64) -> Season {
        Season {
            day_of_year,
            latitude_deg: 50.0,
        }
    }

    #[test]
    fn leaf_area_is_a_tenth_at_bud_burst_and_nine_tenths_at_full_leaf() {
        for (species, p) in deciduous() {
            let area = |day| p.phase(&at(day), 0.0, false).leaf_area();
            let (burst, full) = (p.bud_burst[1], p.full_leaf[1]);
            for (day, share) in [(burst, 0.1), (0.5 * (burst + full), 0.5), (full, 0.9)] {
                assert!((area(day) - share).abs() < 0.01, "{} {day}", species.name);
            }
            let [_, left] = p.marcescent;
            let half = area(p.half_fallen[1]);
            assert!((half - 0.5 * (1.0 + left)).abs() < 0.01, "{half}");
            assert_eq!(area(1.0), left, "{}: the new year", species.name);
            assert_eq!(p.phase(&at(200.0), 0.0, false), PhenologyState::SUMMER);
        }
        assert_eq!(deciduous().len(), 3);
    }

    #[test]
    fn years_that_there_are_not_are_refused() {
        let (species, good) = deciduous().remove(0);
        type Break = fn(&mut Phenology);
        let broken: [(&str, Break); 8] = [
            ("bud_burst[0]", |p| p.bud_burst[0] = 0.0),
            ("bud_burst[2]", |p| p.bud_burst[2] = f64::NAN),
            ("full_leaf[1]", |p| p.full_leaf[1] = p.bud_burst[1]),
            ("peak_colour[0]", |p| p.peak_colour[0] = p.full_leaf[0]),
            ("half_fallen[2]", |p| p.half_fallen[2] = 367.0),
            ("fall_days", |p| p.fall_days = 0.0),
            ("marcescent", |p| p.marcescent[1] = 1.0),
            ("turned.transmittance", |p| {
                p.turned.transmittance = [0.71; 3]
            }),
        ];
        for (field, change) in broken {
            let mut wrong = species.clone();
            change(wrong.phenology.insert(good));
            let refused = wrong.check().expect_err(field).to_string();
            assert!(refused.contains(field), "{refused}");
        }
    }

    #[test]
    fn the_south_has_the_other_half_of_the_year() {
        let (_, beech) = deciduous().remove(0);
        let south = Season {
            day_of_year: 20.0,
            latitude_deg: -50.0,
        };
        assert_eq!(beech.phase(&south, 0.0, false), PhenologyState::SUMMER);
        let winter = Season {
            day_of_year: 200.0,
            ..south
        };
        assert!(beech.phase(&winter, 0.0, false).leaf_area() < 0.05);
    }

    proptest! {
        /// Whatever a species' file says that is accepted, on any day and at any latitude.
        #[test]
        fn phases_are_shares(
            events in proptest::array::uniform3((1.0..230.0, 8.0..60.0, 60.0..200.0, 0.0..60.0)),
            fall_days in 1.0..20.0,
            marcescent in proptest::array::uniform2(0.0..0.9),
            day_of_year in 1.0..366.0,
            latitude_deg in -70.0..70.0,
            late in -20.0..20.0,
            is_young: bool,
        ) {
            let (_, beech) = deciduous().remove(0);
            let phenology = Phenology {
                bud_burst: events.map(|(burst, ..)| burst),
                full_leaf: events.map(|(burst, full, ..)| burst + full),
                peak_colour: events.map(|(burst, full, peak, _)| burst + full + peak),
                half_fallen: events.map(|(burst, full, peak, fall)| burst + full + peak + fall),
                fall_days,
                marcescent,
                ..beech
            };
            prop_assume!(phenology.check("any").is_ok());
            let season = Season { day_of_year, latitude_deg };
            let phase = phenology.phase(&season, late, is_young);
            let fresh = phenology.fresh_litter(&season);
            for share in [phase.grown, phase.kept, phase.young, fresh] {
                prop_assert!((0.0..=1.0).contains(&share), "{phase:?} {fresh}");
            }
            prop_assert!(phase.turned_days.abs() <= LATE_DAYS);
        }
    }
}
