//! The species on the page, of which a stranger's data set may have as many as trees.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use nemoral_scene::excerpt;

use crate::MAX_SPECIES;

/// The number of characters of a long name that are on the page.
const NAME: usize = 60;

/// Species, numbered from 0 in the order in which they are found.
#[derive(Debug, Default)]
pub(crate) struct Species {
    numbers: BTreeMap<String, usize>,
    /// How many trees there are of each, by number.
    trees: Vec<usize>,
}

/// The species as the page names them.
#[derive(Debug)]
pub(crate) struct Named {
    /// Those with the most trees, in the order in which they were found, and, at the end, what the
    /// others are called together.
    pub(crate) names: Vec<String>,
    /// The place in `names` of each species, by its number.
    pub(crate) places: Vec<usize>,
}

impl Species {
    /// Counts a tree and returns the number of its species.
    pub(crate) fn count(&mut self, name: String) -> usize {
        let next = self.trees.len();
        let number = *self.numbers.entry(name).or_insert(next);
        if number == next {
            self.trees.push(0);
        }
        self.trees[number] += 1;
        number
    }

    /// Chooses the species that have a name of their own on the page.
    pub(crate) fn named(self) -> Named {
        let all = self.trees.len();
        let mut listed: Vec<usize> = (0..all).collect();
        // The sort is stable: of equals those that were found first are listed.
        listed.sort_by_key(|&number| Reverse(self.trees[number]));
        listed.truncate(MAX_SPECIES);
        listed.sort_unstable();
        let mut places = vec![MAX_SPECIES; all];
        for (place, &number) in listed.iter().enumerate() {
            places[number] = place;
        }
        let mut names = vec![String::new(); listed.len()];
        for (name, number) in &self.numbers {
            if let Some(place) = names.get_mut(places[*number]) {
                *place = excerpt(name, NAME);
            }
        }
        if all > MAX_SPECIES {
            names.push(format!("{} other species", all - MAX_SPECIES));
        }
        Named { names, places }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(names: impl IntoIterator<Item = String>) -> (Vec<usize>, Named) {
        let mut species = Species::default();
        let numbers = names.into_iter().map(|name| species.count(name)).collect();
        (numbers, species.named())
    }

    #[test]
    fn few_species_keep_the_order_in_which_they_are_found() {
        let trees = ["spruce", "beech", "spruce", "ash", "beech"];
        let (numbers, named) = counted(trees.map(str::to_owned));
        assert_eq!(numbers, [0, 1, 0, 2, 1]);
        assert_eq!(named.names, ["spruce", "beech", "ash"]);
        assert_eq!(named.places, [0, 1, 2]);
        let (none, named) = counted([]);
        assert!(none.is_empty() && named.names.is_empty());
    }

    #[test]
    fn of_many_species_those_with_most_trees_are_named() {
        // The last one is found after too many others, and has more trees than they.
        let single = (0..MAX_SPECIES + 9).map(|i| format!("s{i}"));
        let (_, named) = counted(single.chain(["oak", "oak"].map(str::to_owned)));
        assert_eq!(named.names.len(), MAX_SPECIES + 1);
        assert_eq!(named.names[..2], ["s0", "s1"]);
        assert_eq!(named.names[MAX_SPECIES - 1], "oak");
        assert_eq!(named.names[MAX_SPECIES], "10 other species");
        assert_eq!(named.places[0], 0);
        assert_eq!(named.places[MAX_SPECIES - 2], MAX_SPECIES - 2);
        assert_eq!(named.places[MAX_SPECIES - 1..][..10], [MAX_SPECIES; 10]);
        assert_eq!(named.places[MAX_SPECIES + 9], MAX_SPECIES - 1);
    }

    /// Comparing each tree with all species before it would take minutes.
    #[test]
    fn a_species_for_each_tree_is_counted_at_once() {
        let (numbers, named) = counted((0..300_000).map(|i| format!("{i}{}", "é".repeat(70))));
        assert_eq!(numbers.last(), Some(&299_999));
        assert_eq!(named.places.len(), 300_000);
        assert_eq!(named.names.len(), MAX_SPECIES + 1);
        let is_short = |name: &String| name.chars().count() <= NAME + 1;
        assert!(named.names.iter().all(is_short));
    }
}
