//! Texts of strangers in messages.

/// A text from somebody's file as a message shows it: its first `most` characters, in one line,
/// with escapes for control characters, which a terminal may take for commands.
#[must_use]
pub fn excerpt(text: &str, most: usize) -> String {
    let mut short = String::new();
    for c in text.chars().take(most) {
        match c {
            // They do no harm, and JSON is full of them.
            '"' | '\'' | '\\' => short.push(c),
            _ => short.extend(c.escape_debug()),
        }
    }
    if text.chars().nth(most).is_some() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excerpts_are_short_and_in_one_line() {
        assert_eq!(excerpt("größe \"x\" '\\'", 40), "größe \"x\" '\\'");
        assert_eq!(
            excerpt("a\nb\u{1b}[2J\u{202e}", 40),
            "a\\nb\\u{1b}[2J\\u{202e}"
        );
        assert_eq!(excerpt(&"x".repeat(40), 40), "x".repeat(40));
        assert_eq!(excerpt(&"x".repeat(1 << 20), 40), "x".repeat(40) + "…");
        assert_eq!(excerpt("[1,2]", 3), "[1,…");
    }
}
