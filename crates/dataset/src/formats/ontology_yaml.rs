//! `ontology.yaml`: the class table as semantic-kitti-api reads it.

use std::collections::BTreeMap;
use std::fmt::Write;

use nemoral_scene::Semantic;

use crate::{DatasetHeader, Split};

/// A class table, to be written in SemanticKITTI's form, which semantic-kitti-api reads.
#[derive(Clone, Debug)]
pub struct ClassTable<'a> {
    /// Its name.
    pub name: &'a str,
    /// The classes.
    pub classes: Vec<TableRow<'a>>,
    /// The sequences of a split; those of none are in `train`.
    pub sequences: Vec<(u32, Option<Split>)>,
}

/// A class of a [`ClassTable`].
#[derive(Clone, Copy, Debug)]
pub struct TableRow<'a> {
    /// The number in `.label` files.
    pub id: u16,
    /// The name.
    pub name: &'a str,
    /// The colour, sRGB.
    pub colour: [u8; 3],
    /// How many LiDAR points have it, for `content`.
    pub points: u64,
    /// Whether it is neither learnt nor evaluated.
    pub ignored: bool,
}

/// The table of a data set. `point_classes` has the numbers of its LiDAR points by class.
pub(crate) fn encode(header: &DatasetHeader, point_classes: &BTreeMap<u8, u64>) -> String {
    let ontology = &header.ontology;
    let sky = ontology.class(Semantic::Sky);
    let classes = ontology.classes().iter().map(|c| TableRow {
        id: c.id.into(),
        name: &c.name,
        colour: c.colour,
        points: point_classes.get(&c.id).copied().unwrap_or(0),
        ignored: c == sky,
    });
    let table = ClassTable {
        name: ontology.name(),
        classes: classes.collect(),
        sequences: (header.sequences.iter())
            .map(|s| (s.number, s.split))
            .collect(),
    };
    table.to_yaml()
}

impl ClassTable<'_> {
    /// The file `ontology.yaml`.
    ///
    /// Training ids are 0 for all ignored classes, as SemanticKITTI's evaluation expects, and 1, 2,
    /// … in the table's order for the others; from 0 if none is ignored.
    #[must_use]
    pub fn to_yaml(&self) -> String {
        let (ignored, learnt): (Vec<&TableRow<'_>>, Vec<_>) =
            self.classes.iter().partition(|c| c.ignored);
        // The classes of each training id.
        let training: Vec<Vec<u16>> = (!ignored.is_empty())
            .then(|| ignored.iter().map(|c| c.id).collect())
            .into_iter()
            .chain(learnt.iter().map(|c| vec![c.id]))
            .collect();
        let total = self.classes.iter().map(|c| c.points).sum::<u64>().max(1) as f64;

        let mut out = format!(
            "# The class table of this data set, in SemanticKITTI's form.\nname: {}\n",
            quoted(self.name)
        );
        let mut section = |name: &str, lines: Vec<String>| {
            write!(out, "{name}:\n{}", lines.concat()).expect("a string takes it");
        };
        let classes = || self.classes.iter();
        section(
            "labels",
            classes()
                .map(|c| format!("  {}: {}\n", c.id, quoted(c.name)))
                .collect(),
        );
        // The order is blue, green, red.
        section(
            "color_map",
            classes()
                .map(|c| {
                    let [red, green, blue] = c.colour;
                    format!("  {}: [{blue}, {green}, {red}]\n", c.id)
                })
                .collect(),
        );
        section(
            "content",
            classes()
                .map(|c| format!("  {}: {}\n", c.id, c.points as f64 / total))
                .collect(),
        );
        let each = || training.iter().enumerate();
        section(
            "learning_map",
            each()
                .flat_map(|(i, ids)| ids.iter().map(move |id| format!("  {id}: {i}\n")))
                .collect(),
        );
        section(
            "learning_map_inv",
            each()
                .map(|(i, ids)| format!("  {i}: {}\n", ids[0]))
                .collect(),
        );
        let is_ignored = |i| i == 0 && !ignored.is_empty();
        section(
            "learning_ignore",
            each()
                .map(|(i, _)| format!("  {i}: {}\n", if is_ignored(i) { "True" } else { "False" }))
                .collect(),
        );
        let list = |name: &str, splits: &[Option<Split>]| {
            let of_split = self.sequences.iter().filter(|s| splits.contains(&s.1));
            let numbers: Vec<String> = of_split.map(|s| s.0.to_string()).collect();
            format!("  {name}: [{}]\n", numbers.join(", "))
        };
        section(
            "split",
            vec![
                list("train", &[None, Some(Split::Train)]),
                list("valid", &[Some(Split::Val)]),
                list("test", &[Some(Split::Test)]),
            ],
        );
        out
    }
}

/// A double-quoted scalar: a JSON string, with escapes for what YAML calls not printable besides.
fn quoted(text: &str) -> String {
    let json = serde_json::to_string(text).expect("a string is JSON");
    let is_printable = |c| {
        !matches!(
            c,
            '\u{7f}'..='\u{9f}' | '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}'
        )
    };
    let escaped = |c: char| match is_printable(c) {
        true => c.to_string(),
        false => format!("\\u{:04x}", u32::from(c)),
    };
    json.chars().map(escaped).collect()
}

#[cfg(test)]
mod tests {
    use nemoral_scene::Ontology;

    use super::*;
    use crate::SequenceSpec;

    #[test]
    fn the_fuel_table() {
        let points = BTreeMap::from([(1, 3), (7, 1)]);
        let mut header = DatasetHeader::new("", "", 7, Ontology::fuel());
        header.sequences.push(SequenceSpec::new(2, 8));
        assert_eq!(encode(&header, &points), FUEL);
        header.sequences[0].split = Some(Split::Test);
        header.sequences[1].split = Some(Split::Val);
        let split = "  train: []\n  valid: [2]\n  test: [0]\n";
        assert!(encode(&header, &points).ends_with(split));
    }

    #[test]
    fn ignored_classes_are_one_in_training_and_names_are_escaped() {
        let row = |id, name, ignored| TableRow {
            id,
            name,
            colour: [0; 3],
            points: 0,
            ignored,
        };
        let mut table = ClassTable {
            name: "a\u{7f}\"b\u{85}\n",
            classes: vec![
                row(10, "car", false),
                row(0, "unlabeled", true),
                row(99, "other", true),
            ],
            sequences: Vec::new(),
        };
        let yaml = table.to_yaml();
        assert!(
            yaml.contains("name: \"a\\u007f\\\"b\\u0085\\n\"\n"),
            "{yaml}"
        );
        let learning = "learning_map:\n  0: 0\n  99: 0\n  10: 1\nlearning_map_inv:\n  0: 0\n  \
                        1: 10\nlearning_ignore:\n  0: True\n  1: False\n";
        assert!(yaml.contains(learning), "{yaml}");
        for class in &mut table.classes {
            class.ignored = false;
        }
        let learning = "learning_map_inv:\n  0: 10\n  1: 0\n  2: 99\nlearning_ignore:\n  \
                        0: False\n";
        assert!(table.to_yaml().contains(learning), "{}", table.to_yaml());
    }

    const FUEL: &str = r#"# The class table of this data set, in SemanticKITTI's form.
name: "fuel"
labels:
  0: "Background"
  1: "Terrain"
  2: "Traversable"
  3: "Trunks"
  4: "Canopy"
  5: "Fuel"
  7: "Rocks"
color_map:
  0: [238, 193, 132]
  1: [84, 118, 152]
  2: [120, 208, 236]
  3: [43, 42, 158]
  4: [58, 107, 27]
  5: [38, 201, 138]
  7: [140, 125, 125]
content:
  0: 0
  1: 0.75
  2: 0
  3: 0
  4: 0
  5: 0
  7: 0.25
learning_map:
  0: 0
  1: 1
  2: 2
  3: 3
  4: 4
  5: 5
  7: 6
learning_map_inv:
  0: 0
  1: 1
  2: 2
  3: 3
  4: 4
  5: 5
  6: 7
learning_ignore:
  0: True
  1: False
  2: False
  3: False
  4: False
  5: False
  6: False
split:
  train: [0, 2]
  valid: []
  test: []
"#;
}
