//! Names that every format and file system takes.

use std::collections::BTreeMap;

/// The most characters that are taken of a name. Two names and a number fit into the 255 bytes of
/// a file's.
const MOST_CHARACTERS: usize = 100;

/// A name of letters, numbers and underscores that begins with a letter or an underscore, of the
/// first hundred characters: long ones that differ only later may be equal.
pub(crate) fn plain(name: &str) -> String {
    let mut plain: String = name
        .chars()
        .take(MOST_CHARACTERS)
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
        .collect();
    if !plain.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        plain.insert(0, '_');
    }
    plain
}

/// Names that are taken, each with the least number that may be free after it: thousands of copies
/// of a shape have its name.
#[derive(Debug, Default)]
pub(crate) struct Names(BTreeMap<String, u32>);

impl Names {
    /// Takes the name, or the first of it with a number from 2 on that is not taken.
    pub(crate) fn unique(&mut self, name: String) -> String {
        let Some(&first) = self.0.get(&name) else {
            self.0.insert(name.clone(), 2);
            return name;
        };
        let mut number = first;
        let unique = loop {
            let candidate = format!("{name}_{number}");
            number += 1;
            if !self.0.contains_key(&candidate) {
                break candidate;
            }
        };
        self.0.insert(name, number);
        self.0.insert(unique.clone(), 2);
        unique
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain_and_unique() {
        assert_eq!(plain("maritime_pine.3"), "maritime_pine_3");
        assert_eq!(plain("7 é"), "_7__");
        assert_eq!(plain(""), "_");
        assert_eq!(plain(&"é".repeat(260)), "_".repeat(100));
        let mut taken = Names::default();
        let names = ["a", "a", "a_2", "a"].map(|n| taken.unique(n.to_owned()));
        assert_eq!(names, ["a", "a_2", "a_2_2", "a_3"]);
        let names = ["b_2", "b", "b"].map(|n| taken.unique(n.to_owned()));
        assert_eq!(names, ["b_2", "b", "b_3"]);
        // The search goes on where it ended.
        assert_eq!((taken.0["a"], taken.0["a_2"], taken.0["b"]), (4, 3, 4));
    }
}
