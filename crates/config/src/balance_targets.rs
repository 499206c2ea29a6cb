//! What the names of `[balance.targets]` mean.

use nemoral_scene::{Ontology, Semantic};

use super::quotations::{cut, did_you_mean};
use super::{Balance, Config, RobotPath};

/// The most targets of a sequence.
const MOST: usize = 16;

/// Something that frames should show.
#[derive(Clone, Debug, PartialEq)]
pub struct BalanceTarget {
    /// Its name.
    pub name: String,
    /// The share of a view that is asked for, above 0.
    pub goal: f64,
    /// What surfaces count.
    pub counts: CountedSurfaces,
}

/// What surfaces count for a target.
#[derive(Clone, Debug, PartialEq)]
pub enum CountedSurfaces {
    /// Those of these semantics.
    Of(Vec<Semantic>),
    /// Those that grow on trunks.
    OnTrunks(Semantic),
    /// Those of these semantics that a robot would drive against.
    NearObstacles(Vec<Semantic>),
}

/// Names beside those of classes and semantics.
const THINGS: [&str; 4] = ["logs", "near_obstacles", "rocks", "wrapped_trunks"];

fn thing(name: &str) -> Option<CountedSurfaces> {
    use Semantic as S;
    Some(match name {
        "logs" => CountedSurfaces::Of(vec![S::Log, S::RootPlate]),
        "rocks" => CountedSurfaces::Of(vec![S::Rock, S::Stone]),
        "wrapped_trunks" => CountedSurfaces::OnTrunks(S::Climber),
        "near_obstacles" => CountedSurfaces::NearObstacles(vec![
            S::Stem,
            S::Limb,
            S::RootFlare,
            S::Stump,
            S::Log,
            S::Snag,
            S::StemGrowth,
            S::RootPlate,
            S::Rock,
            S::Stone,
        ]),
        _ => return None,
    })
}

/// Whether something of it can be near, unlike the sky and false echoes.
fn is_solid(semantic: Semantic) -> bool {
    !matches!(semantic, Semantic::Sky | Semantic::AirborneEcho)
}

/// What a name means in an ontology.
fn counts(name: &str, ontology: &Ontology) -> Option<CountedSurfaces> {
    if let Some(thing) = thing(name) {
        return Some(thing);
    }
    let of_class = |s: &&Semantic| ontology.class(**s).name.to_lowercase() == name && is_solid(**s);
    let of_class: Vec<Semantic> = Semantic::ALL.iter().filter(of_class).copied().collect();
    if !of_class.is_empty() && name != "background" {
        return Some(CountedSurfaces::Of(of_class));
    }
    let named = Semantic::ALL
        .iter()
        .find(|s| s.name() == name && is_solid(**s));
    named.map(|s| CountedSurfaces::Of(vec![*s]))
}

/// All names that an ontology allows: things, classes, semantics.
fn names(ontology: &Ontology) -> Vec<String> {
    let classes = ontology.classes().iter().map(|c| c.name.to_lowercase());
    let semantics = Semantic::ALL.iter().map(|s| s.name().to_owned());
    let mut all: Vec<String> = THINGS.iter().map(|t| (*t).to_owned()).collect();
    for name in classes.chain(semantics) {
        if !all.contains(&name) && counts(&name, ontology).is_some() {
            all.push(name);
        }
    }
    all
}

impl Balance {
    /// The targets, in order of their names.
    #[must_use]
    pub fn targets(&self, ontology: &Ontology) -> Vec<BalanceTarget> {
        let wanted = self.targets.iter().filter(|(_, goal)| **goal > 0.0);
        let target = |(name, goal): (&String, &f64)| {
            Some(BalanceTarget {
                name: name.clone(),
                goal: *goal,
                counts: counts(name, ontology)?,
            })
        };
        wanted.filter_map(target).collect()
    }
}

impl Config {
    /// What is impossible about the balance: keys and messages.
    pub(super) fn balance_problems(&self) -> Vec<(String, String)> {
        let mut out = Vec::new();
        let mut refuse = |key: &str, message: String| out.push((key.to_owned(), message));
        let ontology = self.output.ontology.table();
        for name in self.balance.targets.keys() {
            if counts(name, &ontology).is_some() {
                continue;
            }
            let key = format!("balance.targets.{name}");
            let known = names(&ontology);
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            let near = did_you_mean(name, &known);
            let near = near.map(|name| format!("did you mean `{name}`? "));
            let message = format!(
                "{}: there is no such thing, class of \"{}\" or semantic; {}there are {}",
                cut(&key),
                ontology.name(),
                near.unwrap_or_default(),
                known.join(", ")
            );
            refuse(&key, message);
        }
        if !self.balance.is_on() {
            return out;
        }
        let count = self.balance.targets.values().filter(|g| **g > 0.0).count();
        if count > MOST {
            let message = format!("balance.targets: {count} of them; must be at most {MOST}");
            refuse("balance.targets", message);
        }
        let fixed = match &self.robot.path {
            RobotPath::Stations(_) => Some(("robot.stations", "stations in a grid")),
            RobotPath::Lanes(_) => Some(("robot.lanes", "lanes")),
            RobotPath::Flight(_) => Some(("robot.flight", "flight lines")),
            RobotPath::File(_) => Some(("robot.file", "the poses of a file")),
            _ => None,
        };
        if let Some((key, what)) = fixed {
            let message = format!(
                "[balance.targets] chooses where each frame is taken, and [{key}] asks for {what}: \
                 must be a path to choose beside, such as [robot.trail], [robot.wander] or \
                 [robot.straight]"
            );
            refuse("balance.targets", message);
        }
        for (path, camera) in self.all_cameras() {
            if camera.flow {
                let message = format!(
                    "{path}.flow = true: must be false with [balance.targets], whose frames are \
                     single views without motion from one to the next"
                );
                refuse(&format!("{path}.flow"), message);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_things_classes_and_semantics() {
        let paper = Ontology::paper();
        let names = names(&paper);
        for name in [
            "rocks",
            "logs",
            "shrubs",
            "trunks",
            "climber",
            "root_plate",
            "traversable",
        ] {
            assert!(names.iter().any(|n| n == name), "{name}");
        }
        for name in ["sky", "background", "airborne_echo", "fuel", "Rocks", ""] {
            assert_eq!(counts(name, &paper), None, "{name}");
        }
        assert!(counts("fuel", &Ontology::fuel()).is_some());
        // A class and a thing of one name are the same.
        let rocks = Semantic::ALL
            .iter()
            .filter(|s| paper.class(**s).name == "Rocks");
        assert_eq!(
            counts("rocks", &paper),
            Some(CountedSurfaces::Of(rocks.copied().collect()))
        );
        // A class that has the name of a thing would be another one.
        for ontology in [Ontology::paper(), Ontology::fuel()] {
            for class in ontology.classes().iter().filter(|c| c.name != "Rocks") {
                assert!(!THINGS.contains(&&*class.name.to_lowercase()));
            }
        }
    }
}
