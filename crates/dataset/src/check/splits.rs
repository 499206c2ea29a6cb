//! Whether different splits have worlds in common.

use std::collections::{BTreeMap, HashMap};

use nemoral_scene::TreeRecord;

use crate::{DatasetHeader, SequenceSpec, Split};

/// A tree's place, diameter and height, bit by bit.
type Measures = [u64; 5];

/// The trees of a data set with several splits, to find those that two of them have.
#[derive(Debug, Default)]
pub(super) struct SplitTrees {
    /// The first sequence that has each.
    first_with: HashMap<Measures, (u32, Split)>,
}

/// What is wrong with the seeds of sequences.
pub(super) fn common_seeds(header: &DatasetHeader) -> Vec<String> {
    let mut first_with: BTreeMap<(&str, u64), (u32, Split)> = BTreeMap::new();
    let mut found = Vec::new();
    for sequence in &header.sequences {
        let Some(split) = sequence.split else {
            continue;
        };
        for (name, seed) in seeds(sequence) {
            let number = sequence.number;
            let &mut (first, of_first) = first_with.entry((name, seed)).or_insert((number, split));
            if of_first != split {
                found.push(format!(
                    "{name} = {seed} of sequence {number} ({split}) is that of sequence {first} \
                     ({of_first}), too: it must differ between splits"
                ));
            }
        }
    }
    found
}

/// The seeds of a sequence's world and plants; plants that have none grow from the world's.
fn seeds(sequence: &SequenceSpec) -> impl Iterator<Item = (&'static str, u64)> {
    let plants = sequence.config.pointer("/assets/seed");
    let plants = plants
        .and_then(serde_json::Value::as_u64)
        .filter(|&seed| seed != 0);
    let plants = plants.map(|seed| ("assets.seed", seed));
    std::iter::once(("seed", sequence.seed)).chain(plants)
}

impl SplitTrees {
    /// Adds the trees of a sequence. The result is what is wrong if another split has some of them.
    pub(super) fn add(
        &mut self,
        header: &DatasetHeader,
        number: u32,
        trees: &[TreeRecord],
    ) -> Option<String> {
        let split = header.sequence(number)?.split?;
        // Without another split there is nothing to compare with.
        header
            .sequences
            .iter()
            .find(|s| s.split.is_some_and(|of| of != split))?;
        let mut common = 0;
        let mut example = None;
        for tree in trees {
            let entry = self
                .first_with
                .entry(measures(tree))
                .or_insert((number, split));
            if entry.1 != split {
                common += 1;
                example.get_or_insert((tree.object.to_u64(), *entry));
            }
        }
        let (tree, (first, of_first)) = example?;
        Some(format!(
            "{common} of {} trees are in other splits, too: tree {tree} stands in sequence {first} \
             ({of_first}) at the same place, as thick and as high; this sequence is of {split}",
            trees.len()
        ))
    }
}

fn measures(tree: &TreeRecord) -> Measures {
    let [x, y, z] = tree.position_m.to_array();
    [x, y, z, tree.dbh_m, tree.height_m].map(f64::to_bits)
}
