//! Whether different splits have worlds in common.

use std::collections::{BTreeMap, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

use nemoral_scene::{TreeRecord, excerpt};

use crate::{DatasetHeader, SequenceSpec, Split};

/// The files of a site, which would give several worlds the same trees, ground or trails.
const SITE_FILES: [&str; 3] = ["site.stems.path", "site.terrain.path", "site.trails.path"];

/// The trees of a data set with several splits, to find those that two of them have.
#[derive(Debug, Default)]
pub(super) struct SplitTrees {
    /// The first sequence that has each, by a hash of it: millions are kept.
    first_with: HashMap<u64, (u32, Split)>,
}

/// What is wrong with the seeds and the sites of sequences.
pub(super) fn common_sources(header: &DatasetHeader) -> Vec<String> {
    let mut first_with: BTreeMap<(&str, String), (u32, Split)> = BTreeMap::new();
    let mut found = Vec::new();
    for sequence in &header.sequences {
        let Some(split) = sequence.split else {
            continue;
        };
        for (name, value) in sources(sequence) {
            let number = sequence.number;
            let entry = first_with.entry((name, value.clone()));
            let &mut (first, of_first) = entry.or_insert((number, split));
            if of_first != split {
                // A whole digest is shown.
                let value = excerpt(&value, 80);
                found.push(format!(
                    "{name} = {value} of sequence {number} ({split}) is that of sequence {first} \
                     ({of_first}), too: it must differ between splits"
                ));
            }
        }
    }
    found
}

/// What a sequence's world is made from: the seeds of the world and of its plants, which have none
/// if they grow from the world's, and the digests of a site's files.
fn sources(sequence: &SequenceSpec) -> Vec<(&'static str, String)> {
    let mut found = vec![("seed", sequence.seed.to_string())];
    let config = sequence.config.value();
    let plants = config.pointer("/assets/seed");
    let plants = plants.and_then(serde_json::Value::as_u64);
    found.extend((plants.filter(|&seed| seed != 0)).map(|seed| ("assets.seed", seed.to_string())));
    for key in SITE_FILES {
        let path = config.pointer(&format!("/{}", key.replace('.', "/")));
        let path = path.and_then(serde_json::Value::as_str);
        let input = path.and_then(|p| sequence.inputs.iter().find(|i| i.path.as_str() == p));
        found.extend(input.map(|input| (key, input.blake3.clone())));
    }
    found
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
            let entry = self.first_with.entry(hash(tree)).or_insert((number, split));
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

/// A hash of where a tree stands on the map, how thick and how high it is. How high the ground is
/// there differs between worlds.
fn hash(tree: &TreeRecord) -> u64 {
    let measures = [
        tree.position_m.x,
        tree.position_m.y,
        tree.dbh_m,
        tree.height_m,
    ];
    let mut hasher = DefaultHasher::new();
    measures.map(f64::to_bits).hash(&mut hasher);
    hasher.finish()
}
