//! What commands write on standard output and standard error.
//!
//! Names and messages may come from a stranger's files, and a terminal obeys control characters: it
//! clears its screen, or worse. People therefore read escapes in their place.

use std::borrow::Cow;
use std::io::{self, IsTerminal, Write};

/// Writes an error to standard error.
pub(crate) fn print_error(message: &str) {
    tell(&format!("error: {message}"));
}

/// Writes a note to standard error.
pub(crate) fn note(message: &str) {
    tell(&format!("note: {message}"));
}

/// Writes a line to standard error.
pub(crate) fn tell(line: &str) {
    let _ = writeln!(io::stderr(), "{}", harmless(line));
}

/// Writes a line for people to standard output.
pub(crate) fn say(text: &str) -> io::Result<()> {
    write_out(&harmless(text))
}

/// Writes what other programs read to standard output: byte for byte, except on a terminal, where
/// only people read it.
pub(crate) fn print_data(data: &str) -> io::Result<()> {
    if io::stdout().is_terminal() {
        say(data)
    } else {
        write_out(data)
    }
}

/// A closed pipe is no error, as the reader wants no more.
fn write_out(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout();
    match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}

/// Text whose control characters are escapes, except for ends of lines and tabs.
pub(crate) fn harmless(text: &str) -> Cow<'_, str> {
    if !text.contains(is_command) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(2 * text.len());
    for c in text.chars() {
        if is_command(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

/// Whether a terminal may take a character for a command.
fn is_command(c: char) -> bool {
    c.is_control() && c != '\n' && c != '\t'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_commands_a_terminal() {
        let shown = harmless("\u{1b}]0;x\u{7}\u{1b}[2J\r\u{8}\u{7f}\u{9b}31m ä");
        assert_eq!(shown, r"\u{1b}]0;x\u{7}\u{1b}[2J\r\u{8}\u{7f}\u{9b}31m ä");
    }

    #[test]
    fn other_text_stays_as_it_is_and_where_it_is() {
        for text in ["", "a\tb\nc", "3 ° · Fraxinus excelsior …", r"C:\u{1b}\r"] {
            let shown = harmless(text);
            assert!(matches!(shown, Cow::Borrowed(same) if same == text));
        }
    }
}
