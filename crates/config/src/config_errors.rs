//! Errors in a request, with their places.

use std::fmt;

use super::Error;
use super::quotations::cut;

/// The number of a request's errors that are shown; the rest are only counted.
const TOLD: usize = 10;
/// The number of characters of a long line that are shown, and of those before the error.
const LINE: usize = 100;
const BEFORE: usize = 30;

/// An error in a request.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfigError {
    /// The dotted key.
    pub path: String,
    /// What is wrong: the value and what is allowed.
    pub message: String,
    /// Where it is: file, line, column and the line's text.
    pub location: Option<ErrorLocation>,
}

impl ConfigError {
    /// The name that was probably meant instead of an unknown one, if there is one like it.
    #[must_use]
    pub fn nearest(&self) -> Option<&str> {
        let (_, rest) = self.message.split_once("did you mean `")?;
        rest.split_once('`').map(|(name, _)| name)
    }
}

/// Where an error is in a request.
#[derive(Clone, Debug, PartialEq)]
pub enum ErrorLocation {
    /// In a file.
    File {
        /// The file's name.
        name: String,
        /// Its number, from 1.
        line: usize,
        /// Its number, from 1.
        column: usize,
        /// The line.
        text: String,
        /// The number of characters that the error is about.
        length: usize,
    },
    /// In an argument, such as `--set a.b=c`.
    Argument(String),
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.location {
            None => f.write_str(&self.message),
            Some(ErrorLocation::Argument(argument)) => {
                write!(f, "{}: {}", cut(argument), self.message)
            }
            Some(ErrorLocation::File {
                name,
                line,
                column,
                text,
                length,
            }) => {
                writeln!(f, "{name}:{line}:{column}: {}", self.message)?;
                let margin = line.to_string().len();
                let (text, indent, most) = part_of_line(text, column - 1);
                let carets = "^".repeat((*length).clamp(1, most.max(1)));
                writeln!(f, "{:margin$} |\n{line} | {text}", "")?;
                write!(f, "{:margin$} | {:indent$}{carets}", "", "",)
            }
        }
    }
}

/// The part of a line that is shown, the position in it of the character at `start` of the whole
/// line, and the number of characters from there on.
fn part_of_line(line: &str, start: usize) -> (String, usize, usize) {
    let line = line.strip_suffix('\r').unwrap_or(line);
    let length = line.chars().count();
    let characters = line.chars().map(visible);
    if length <= LINE {
        return (characters.collect(), start, length.saturating_sub(start));
    }
    let from = start.saturating_sub(BEFORE).min(length - LINE);
    let (before, after) = (from > 0, from + LINE < length);
    let mut part: String = if before { "…" } else { "" }.to_owned();
    part.extend(characters.skip(from).take(LINE));
    if after {
        part.push('…');
    }
    let indent = start - from + usize::from(before);
    let shown = LINE - (start - from).min(LINE);
    (part, indent, shown)
}

/// A character as a quoted line shows it. Control characters could do anything to a terminal, and
/// their escapes would move what follows away from the carets below it.
fn visible(c: char) -> char {
    if c.is_control() && c != '\t' {
        char::REPLACEMENT_CHARACTER
    } else {
        c
    }
}

/// The errors in a request: all of them, or the first of many and the number of the others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ConfigErrors {
    /// At most ten.
    pub errors: Vec<ConfigError>,
    /// How many more there are.
    pub more: usize,
}

impl ConfigErrors {
    /// Adds an error, which is made only if it is to be shown.
    pub(super) fn add(&mut self, make: impl FnOnce() -> ConfigError) {
        if self.errors.len() < TOLD {
            self.errors.push(make());
        } else {
            self.more += 1;
        }
    }

    pub(super) fn into_result(self) -> Result<(), Error> {
        if self.errors.is_empty() {
            Ok(())
        } else {
            Err(self.into())
        }
    }
}

impl FromIterator<ConfigError> for ConfigErrors {
    fn from_iter<T: IntoIterator<Item = ConfigError>>(errors: T) -> Self {
        let mut all = Self::default();
        for error in errors {
            all.add(|| error);
        }
        all
    }
}

impl fmt::Display for ConfigErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, error) in self.errors.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{error}")?;
        }
        match self.more {
            0 => Ok(()),
            1 => write!(f, "\n… and one more error"),
            more => write!(f, "\n… and {more} more errors"),
        }
    }
}

impl std::error::Error for ConfigErrors {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_lines_are_short_and_plain() {
        let long = "\u{1b}[2J\u{9b}".repeat(200);
        for start in [0, 500, 999, 1000] {
            let (part, indent, _) = part_of_line(&long, start);
            let shown = part.chars().count();
            assert!(shown <= LINE + 2 && indent <= shown, "{start}: {part}");
            assert!(!part.contains(char::is_control), "{start}: {part}");
        }
        let (part, indent, rest) = part_of_line("a = \u{7}\tb\r", 4);
        assert_eq!((&*part, indent, rest), ("a = \u{fffd}\tb", 4, 3));
    }
}
