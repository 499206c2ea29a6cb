//! Tables with a header, as inventories and spreadsheets write them.

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::ImportError;
use crate::error::shown;

/// A table whose columns are found by name.
pub(crate) struct Table<'a> {
    reader: csv::Reader<&'a [u8]>,
    bytes: &'a [u8],
    /// In lower case.
    columns: Vec<String>,
    /// Whether numbers may have a decimal comma.
    has_decimal_commas: bool,
}

/// A row with its line.
pub(crate) struct Row<'a> {
    pub(crate) line: u64,
    record: &'a StringRecord,
    has_decimal_commas: bool,
}

impl<'a> Table<'a> {
    /// Reads the header. Columns are separated by commas, semicolons or tabs, whichever the header
    /// has; lines that start with `#` are skipped.
    pub(crate) fn new(bytes: &'a [u8]) -> Result<Self, ImportError> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let mut lines = bytes.split(|&b| is_end(b));
        let header = lines.find(|line| !line.starts_with(b"#") && !line.trim_ascii().is_empty());
        let header = header.ok_or_else(|| ImportError::file("is empty: it needs a header"))?;
        let separator = [b';', b'\t'].into_iter().find(|s| header.contains(s));
        let mut reader = ReaderBuilder::new()
            .delimiter(separator.unwrap_or(b','))
            .comment(Some(b'#'))
            .trim(Trim::All)
            .from_reader(bytes);
        let columns = reader.headers().map_err(|e| wrong(&e))?;
        let columns = columns.iter().map(str::to_lowercase).collect();
        Ok(Self {
            reader,
            bytes,
            columns,
            has_decimal_commas: separator == Some(b';'),
        })
    }

    /// The names of the columns, in lower case.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The column with one of these names; two of them are an error.
    pub(crate) fn column(&self, names: &[&str]) -> Result<Option<usize>, ImportError> {
        let mut found = (self.columns.iter().enumerate())
            .filter(|(_, column)| names.contains(&column.as_str()));
        match (found.next(), found.next()) {
            (first, None) => Ok(first.map(|(i, _)| i)),
            (Some((_, a)), Some((_, b))) => Err(ImportError::file(format!(
                "has the columns `{a}` and `{b}`, which say the same: keep one"
            ))),
            (None, Some(_)) => unreachable!("a second needs a first"),
        }
    }

    /// The same for a column that must be there.
    pub(crate) fn needed(&self, names: &[&str]) -> Result<usize, ImportError> {
        self.column(names)?.ok_or_else(|| {
            let columns: Vec<String> = self.columns.iter().map(|c| shown(c)).collect();
            ImportError::file(format!(
                "has no column `{}`; its columns are {}",
                names[0],
                shown(&columns.join(", "))
            ))
        })
    }

    /// Calls `each` with every row.
    pub(crate) fn rows(
        &mut self,
        mut each: impl FnMut(&Row<'_>) -> Result<(), ImportError>,
    ) -> Result<(), ImportError> {
        let mut record = StringRecord::new();
        let mut lines = Lines::default();
        while self
            .reader
            .read_record(&mut record)
            .map_err(|e| wrong(&e))?
        {
            each(&Row {
                line: lines.of(self.bytes, record.position().map_or(0, csv::Position::byte)),
                record: &record,
                has_decimal_commas: self.has_decimal_commas,
            })?;
        }
        Ok(())
    }
}

/// Whether a byte ends a line, or is a part of what does.
fn is_end(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// Lines by position: `\n`, `\r\n` and a lone `\r` each end one. A record's own line is that of the
/// end of the one before, where a file has carriage returns, empty lines or comments.
#[derive(Default)]
struct Lines {
    at: usize,
    before: u64,
}

impl Lines {
    /// The line of the first text at or after a position, from 1. Positions do not decrease.
    fn of(&mut self, bytes: &[u8], position: u64) -> u64 {
        let to = usize::try_from(position)
            .unwrap_or(usize::MAX)
            .min(bytes.len());
        self.advance(bytes, to);
        loop {
            let rest = &bytes[self.at..];
            let end = rest.iter().position(|&b| is_end(b));
            match end {
                Some(end) if rest[..end].trim_ascii().is_empty() || rest[0] == b'#' => {
                    self.advance(bytes, self.at + end + 1);
                }
                _ => return self.before + 1,
            }
        }
    }

    fn advance(&mut self, bytes: &[u8], to: usize) {
        let passed = bytes.get(self.at..to).unwrap_or_default();
        let ends = passed.iter().enumerate().filter(|&(i, &b)| match b {
            b'\r' => bytes.get(self.at + i + 1) != Some(&b'\n'),
            b => b == b'\n',
        });
        self.before += ends.count() as u64;
        self.at = self.at.max(to);
    }
}

impl Row<'_> {
    /// The text of a cell; `None` for an empty one, or a word for a missing value.
    pub(crate) fn text(&self, column: usize) -> Option<&str> {
        let cell = self.record.get(column).unwrap_or_default();
        let is_missing = ["", "-", "na", "n/a", "nan", "null"]
            .iter()
            .any(|word| cell.eq_ignore_ascii_case(word));
        (!is_missing).then_some(cell)
    }

    /// The number in a cell, both ends included; `None` for an empty one.
    pub(crate) fn number(
        &self,
        column: usize,
        name: &str,
        [least, most]: [f64; 2],
    ) -> Result<Option<f64>, ImportError> {
        let Some(cell) = self.text(column) else {
            return Ok(None);
        };
        let with_point;
        let text = if self.has_decimal_commas {
            with_point = cell.replace(',', ".");
            &with_point
        } else {
            cell
        };
        let number = text
            .parse::<f64>()
            .ok()
            .filter(|x| (least..=most).contains(x));
        number.map(Some).ok_or_else(|| {
            let cell = shown(cell);
            self.error(format!(
                "{name} = {cell}: must be a number from {least} to {most}"
            ))
        })
    }

    pub(crate) fn error(&self, reason: impl Into<String>) -> ImportError {
        ImportError::line(self.line, reason)
    }
}

fn wrong(error: &csv::Error) -> ImportError {
    let line = error.position().map_or(1, csv::Position::line);
    let reason = match error.kind() {
        csv::ErrorKind::Utf8 { .. } => "is not UTF-8 text".to_owned(),
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("has {len} columns, and the header has {expected_len}"),
        _ => shown(&error.to_string()),
    };
    ImportError::line(line, reason)
}
