//! Names that every format and file system takes.

use std::collections::BTreeSet;

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

/// The name, or the first of it with a number that is not among the known ones; it is then known.
pub(crate) fn unique(known: &mut BTreeSet<String>, name: String) -> String {
    let mut candidate = name.clone();
    let mut number = 2;
    while !known.insert(candidate.clone()) {
        candidate = format!("{name}_{number}");
        number += 1;
    }
    candidate
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
        let mut known = BTreeSet::new();
        let names = ["a", "a", "a_2", "a"].map(|n| unique(&mut known, n.to_owned()));
        assert_eq!(names, ["a", "a_2", "a_2_2", "a_3"]);
    }
}
