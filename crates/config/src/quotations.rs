//! Quotations of what a user wrote in messages, which are shortened if they are long.

use nemoral_scene::excerpt;
use toml::Value;

/// The number of characters of a key or a value that are shown.
const SHOWN: usize = 60;

/// Shortens long text.
pub(super) fn cut(text: &str) -> String {
    excerpt(text, SHOWN)
}

/// A value as TOML; numbers with hundreds of digits are written with an exponent.
pub(super) fn shown(value: &Value) -> String {
    match value {
        Value::Float(x) if x.is_finite() && *x != 0.0 && !(1e-7..1e16).contains(&x.abs()) => {
            format!("{x:e}")
        }
        // Otherwise all of a long array or table would be written before it is shortened.
        Value::Array(items) if items.len() > SHOWN => {
            format!("[{}, …]", shown(&items[0]))
        }
        Value::Table(table) if table.len() > SHOWN => "{…}".to_owned(),
        Value::String(text) => format!("\"{}\"", cut(text)),
        other => cut(&other.to_string()),
    }
}

/// The name that was probably meant: at most a third of the letters differ.
pub(super) fn did_you_mean<'a>(said: &str, names: &[&'a str]) -> Option<&'a str> {
    let distance = |name: &str| edit_distance(name, said);
    let near = |name: &&str| distance(name) <= name.len().max(said.len()) / 3;
    // A text that is much longer than all names is near to none.
    let longest = names.iter().map(|name| name.len()).max()?;
    if said.len() > 2 * longest {
        return None;
    }
    names
        .iter()
        .copied()
        .filter(near)
        .min_by_key(|name| distance(name))
}

/// The Levenshtein distance.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_is_meant() {
        let names = ["octaves", "size_m", "table", "noise"];
        for (said, meant) in [
            ("octave", Some("octaves")),
            ("size", Some("size_m")),
            ("niose", None),
            ("noize", Some("noise")),
            ("enabled", None),
            ("", None),
        ] {
            assert_eq!(did_you_mean(said, &names), meant, "{said}");
        }
        assert_eq!(did_you_mean("x", &[]), None);
        assert_eq!(did_you_mean(&"octaves".repeat(100_000), &names), None);
    }

    #[test]
    fn what_goes_on_for_ever_is_cut() {
        assert_eq!(shown(&Value::Float(1e300)), "1e300");
        assert_eq!(shown(&Value::Float(-2.5)), "-2.5");
        assert_eq!(shown(&Value::Float(0.0)), "0.0");
        assert_eq!(shown(&Value::Float(f64::NAN)), "nan");
        assert_eq!(shown(&Value::Float(1e-300)), "1e-300");
        assert_eq!(shown(&Value::from("many")), "\"many\"");
        let long = [
            Value::from("ä".repeat(1000)),
            Value::from(vec![1; 1000]),
            Value::from(vec!["x".repeat(1000)]),
        ];
        for value in long {
            let text = shown(&value);
            assert!(text.contains('…') && text.chars().count() < 70, "{text}");
        }
    }
}
