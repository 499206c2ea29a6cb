//! The phenology of low plants and climbers: what of them is green, dead or gone.

mod calendar;

use glam::Vec3;
use nemoral_scene::{LaserBand, Optics};
use nemoral_seed::{Draw, Key};

use self::calendar::ALL;
use super::optics::LeafOptics;
use crate::cards::card_raster::{CardDrawing, Mark};
use crate::cards::understory::{HEATHER_BELL, HEATHER_SHOOT};
use crate::textures::canvas::Stroke;
use crate::textures::tile::luminance;
use crate::tree::Season;

pub(super) use self::calendar::{
    BILBERRY, BRACKEN, BRAMBLE, GORSE, GRASS, HEATHER, LIANA, MALE_FERN, REED, ROSETTE, TALL_HERB,
    TREFOIL,
};

/// What there is of a plant on a day: of its leaves the share that is there, and of these the share
/// that is dead; of its flowers the share that is open, and what the others are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlantPhenophase {
    dead: f32,
    there: f32,
    flowers: f32,
    /// Whether flowers that are not open have withered; otherwise they are still to come.
    is_faded: bool,
}

/// The phenology of a kind of plant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlantPhenology {
    /// Days of the year at 50 degrees north, the share of dead leaves and the share of leaves that
    /// are there; lines lead from day to day. Observers' central values, and our choice.
    days: &'static [(f64, f32, f32)],
    dead: LeafOptics,
    strokes: Strokes,
    /// Days, and the share of flowers that are open; without any, flowers come and go with leaves.
    flowers: &'static [(f64, f32)],
}

/// What the strokes of a drawing are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Strokes {
    /// Wood, which stays as it is.
    Twigs,
    /// Stems of herbs, which die and stay.
    Stems,
    /// Blades, which live and die as leaves do.
    Blades,
}

/// How many days later it is spring for each degree north, and how many days earlier autumn.
const DAYS_PER_DEGREE: [f64; 2] = [2.0, 1.5];

/// From the first of these days to the second, withered flowers are gone from last year's shoots,
/// and those of the year are still to come.
const BEFORE_FLOWERS: [f64; 2] = [90.0, 260.0];
/// Withered bells of heather, which stay on their shoots until spring.
const RUST: Vec3 = Vec3::new(0.16, 0.095, 0.055);

/// The height of fronds over that of standing ones: dead bracken breaks down over the winter.
pub(crate) fn frond_height(season: Option<&Season>) -> f32 {
    const HEIGHTS: [(f64, f32); 7] = [
        (0.0, 0.5),
        (120.0, 0.3),
        (140.0, 0.5),
        (165.0, 1.0),
        (290.0, 1.0),
        (330.0, 0.65),
        (366.0, 0.5),
    ];
    season.map_or(1.0, |season| {
        on(day_at_50(season), &HEIGHTS.map(|(d, h)| (d, [h]))).map_or(1.0, |[h]| h)
    })
}

/// Whether a colour is that of something alive and green.
fn is_green(colour: Vec3) -> bool {
    colour.y > 1.05 * colour.x && colour.y > 1.3 * colour.z
}

/// The day of the year that is at 50 degrees north what this day is at its latitude.
fn day_at_50(season: &Season) -> f64 {
    let day = season.northern_day();
    // Near the equator there are no such seasons.
    let north = (season.latitude_deg.abs() - 50.0).max(-20.0);
    let [spring, autumn] = DAYS_PER_DEGREE;
    // In midsummer and midwinter there is nothing to shift.
    let shifted = match day {
        d if d < 182.0 => d - spring * north * (d / 60.0).min((182.0 - d) / 40.0).clamp(0.0, 1.0),
        d => d + autumn * north * ((d - 182.0) / 40.0).min((366.0 - d) / 30.0).clamp(0.0, 1.0),
    };
    shifted.clamp(0.0, 366.0)
}

/// The values of a day, on the lines between days.
fn on<const N: usize>(day: f64, of: &[(f64, [f32; N])]) -> Option<[f32; N]> {
    let next = of.iter().position(|(d, _)| *d >= day)?.max(1);
    let ((a, from), (b, to)) = (of[next - 1], of[next]);
    let share = ((day - a) / (b - a)) as f32;
    Some(std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share))
}

impl PlantPhenology {
    /// What is left in a season; `None` if all of it is green and in flower.
    pub(super) fn phase(&self, season: &Season) -> Option<PlantPhenophase> {
        let day = day_at_50(season);
        let days: Vec<_> = self
            .days
            .iter()
            .map(|&(d, dead, there)| (d, [dead, there]))
            .collect();
        let [dead, there] = on(day, &days)?;
        let flowers: Vec<_> = self.flowers.iter().map(|&(d, open)| (d, [open])).collect();
        let flowers = on(day, &flowers).map_or(1.0, |[open]| open);
        let [from, to] = BEFORE_FLOWERS;
        (dead > 0.0 || there < 1.0 || flowers < 1.0).then_some(PlantPhenophase {
            dead,
            there,
            flowers,
            is_faded: !(from..to).contains(&day),
        })
    }

    /// A drawing of leaves with these optics in its phase. Each leaf has a draw of its own from
    /// the key, so that leaves go one after the other. Flowers are marks that are not green; they
    /// go with what dies, and petals that are not open are not there. Bells of heather are part of
    /// their shoot before and after.
    pub(super) fn drawing(
        &self,
        drawing: &CardDrawing,
        phase: PlantPhenophase,
        own: &LeafOptics,
        key: Key,
    ) -> CardDrawing {
        let withered = |colour: Vec3| {
            let shade = luminance(colour) / luminance(own.albedo);
            self.dead.albedo * shade.clamp(0.3, 1.3)
        };
        let in_phase = |(i, mark): (usize, &Mark)| {
            let mut rng = key.item(i as u64).rng();
            let (is_there, is_dead) = (
                rng.chance(f64::from(phase.there)),
                rng.chance(f64::from(phase.dead)),
            );
            let is_open = rng.chance(f64::from(phase.flowers));
            let mut mark = mark.clone();
            match &mut mark {
                Mark::Leaf(leaf) | Mark::Stalked(_, leaf) => {
                    let is_flower = !is_green(leaf.colour);
                    if is_dead {
                        leaf.colour = withered(leaf.colour);
                    }
                    (is_there && !(is_flower && (is_dead || !is_open))).then_some(mark)
                }
                Mark::Stroke(stroke) => {
                    let dies = is_dead && self.strokes != Strokes::Twigs;
                    if dies && is_green(stroke.colour[1]) {
                        stroke.colour = stroke.colour.map(withered);
                    }
                    (is_there || self.strokes != Strokes::Blades).then_some(mark)
                }
                Mark::Bell(_) if is_open => Some(mark),
                Mark::Bell(bell) => {
                    let closed = if phase.is_faded { RUST } else { HEATHER_SHOOT };
                    let shade = |c| luminance(c) / luminance(HEATHER_BELL);
                    let colour = bell.colour.map(|c| closed * shade(c));
                    Some(Mark::Stroke(Stroke { colour, ..*bell }))
                }
            }
        };
        let marks: Vec<Mark> = (drawing.marks.iter().enumerate())
            .filter_map(in_phase)
            .collect();
        if marks.is_empty() {
            // Something is left of every plant: its last leaf.
            let last = drawing.marks.iter().enumerate().next_back();
            let last = last.map(|(_, mark)| mark.clone());
            return CardDrawing {
                marks: last.into_iter().collect(),
            };
        }
        CardDrawing { marks }
    }

    /// The optics of leaves in their phase.
    pub(super) fn optics(&self, phase: PlantPhenophase, own: &LeafOptics) -> LeafOptics {
        let dead = phase.dead;
        let band = |a: LaserBand, b: LaserBand| LaserBand {
            reflectance: a.reflectance + (b.reflectance - a.reflectance) * dead,
            transmittance: a.transmittance + (b.transmittance - a.transmittance) * dead,
        };
        LeafOptics {
            albedo: own.albedo.lerp(self.dead.albedo, dead),
            transmittance: own.transmittance.lerp(self.dead.transmittance, dead),
            laser: Optics {
                nm905: band(own.laser.nm905, self.dead.laser.nm905),
                nm1550: band(own.laser.nm1550, self.dead.laser.nm1550),
            },
        }
    }
}

/// Whether all low plants are as they are in high summer, but for their flowers: gorse and heather
/// are in flower then as they are without a season, so that all days of high summer share what is
/// grown.
pub(super) fn is_high_summer(season: &Season) -> bool {
    ALL.iter().all(|plant| plant.phase(season).is_none()) && frond_height(Some(season)) == 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::materials::optics;

    fn at(day_of_year: f64, latitude_deg: f64) -> Season {
        Season {
            day_of_year,
            latitude_deg,
        }
    }

    #[test]
    fn high_summer_is_green_everywhere_and_years_close() {
        for (i, plant) in ALL.iter().enumerate() {
            for (day, latitude) in [(182.0, 40.0), (200.0, 60.0), (15.0, -45.0)] {
                assert_eq!(plant.phase(&at(day, latitude)), None, "{i} {day}");
            }
            let ends = [plant.days[0], plant.days[plant.days.len() - 1]];
            assert_eq!([ends[0].0, ends[1].0], [0.0, 366.0], "{i}");
            assert!(plant.days.windows(2).all(|d| d[0].0 < d[1].0), "{i}");
            let [a, b] = ends.map(|(_, dead, there)| (dead, there));
            assert!(a == b || a.1 == 0.0, "{i}: the new year");
        }
        assert_eq!(frond_height(None), 1.0);
        assert_eq!(frond_height(Some(&at(200.0, 50.0))), 1.0);
        assert!(frond_height(Some(&at(20.0, 50.0))) < 0.6);
    }

    #[test]
    fn what_dies_is_brown_and_its_flowers_are_gone() {
        let mut rng = nemoral_seed::Key::world(3).rng();
        let drawing = crate::cards::understory::leafy_stem(&mut rng, true);
        let dead = PlantPhenophase {
            dead: 1.0,
            there: 1.0,
            flowers: 1.0,
            is_faded: false,
        };
        let key = nemoral_seed::Key::world(4);
        let withered = TALL_HERB.drawing(&drawing, dead, &optics::HERB, key);
        assert!(withered.marks.len() < drawing.marks.len());
        for mark in &withered.marks {
            let c = match mark {
                Mark::Leaf(leaf) | Mark::Stalked(_, leaf) => leaf.colour,
                Mark::Stroke(stroke) | Mark::Bell(stroke) => stroke.colour[1],
            };
            assert!(c.x > c.y && c.y > c.z && c.x < 0.3, "{c}");
        }
        // Something of every plant is left.
        let gone = PlantPhenophase { there: 0.0, ..dead };
        assert!(
            !REED
                .drawing(&drawing, gone, &optics::HERB, key)
                .marks
                .is_empty()
        );
    }

    #[test]
    fn gorse_flowers_in_spring_and_heather_in_august() {
        for plant in [GORSE, HEATHER] {
            let ends = [plant.flowers[0], plant.flowers[plant.flowers.len() - 1]];
            assert_eq!(ends, [(0.0, 0.0), (366.0, 0.0)]);
            assert!(plant.flowers.windows(2).all(|d| d[0].0 < d[1].0));
        }
        let key = nemoral_seed::Key::world(4);
        let on_day = |plant: &PlantPhenology, drawing: &CardDrawing, day| {
            plant.phase(&at(day, 50.0)).map_or_else(
                || drawing.clone(),
                |phase| plant.drawing(drawing, phase, &optics::EVERGREEN, key),
            )
        };
        let gorse = crate::cards::understory::gorse(&mut key.rng(), true);
        let petals = |day| {
            let now = on_day(&GORSE, &gorse, day);
            let petals = now.marks.iter().filter(|m| matches!(m, Mark::Leaf(_)));
            (petals.count(), now.marks.len())
        };
        let (all, marks) = petals(90.0);
        assert!(all > 5, "{all}");
        assert_eq!(petals(20.0), (0, marks - all));
        assert!(petals(170.0).0 <= all / 2);
        let heather = crate::cards::understory::heather(&mut key.rng(), true);
        // Bells, rust, and all marks.
        let found = |day| {
            let now = on_day(&HEATHER, &heather, day);
            let is_rust = |c: Vec3| c.x > c.y && c.y > c.z;
            let rust = (now.marks.iter())
                .filter(|m| matches!(m, Mark::Stroke(stroke) if is_rust(stroke.colour[1])));
            let bells = now.marks.iter().filter(|m| matches!(m, Mark::Bell(_)));
            [bells.count(), rust.count(), now.marks.len()]
        };
        let [bells, wood, marks] = found(240.0);
        assert!(bells > 100, "{bells}");
        assert_eq!(found(20.0), [0, wood + bells, marks]);
        assert_eq!(found(150.0), [0, wood, marks]);
        let [some, rusty, _] = found(270.0);
        assert!(
            some > bells / 4 && rusty - wood > bells / 4,
            "{some} {rusty}"
        );
    }

    #[test]
    fn spring_comes_later_and_autumn_earlier_in_the_north() {
        let there = |day, latitude| TALL_HERB.phase(&at(day, latitude)).map_or(1.0, |p| p.there);
        assert!(there(120.0, 42.0) > there(120.0, 58.0));
        assert!(there(310.0, 42.0) > there(310.0, 58.0));
    }
}
