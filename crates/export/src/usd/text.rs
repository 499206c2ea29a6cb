//! The text of a stage.

use std::fmt::{Display, Write};

/// A stage that is being written.
#[derive(Debug, Default)]
pub(super) struct Text {
    text: String,
    depth: usize,
}

/// A text in quotes.
pub(super) fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted.push(' '),
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

pub(super) fn tuple(numbers: &[f32]) -> String {
    let all: Vec<String> = numbers.iter().map(f32::to_string).collect();
    format!("({})", all.join(", "))
}

pub(super) fn tuples<const N: usize>(rows: impl Iterator<Item = [f32; N]>) -> String {
    let mut text = String::from("[");
    for (i, row) in rows.enumerate() {
        let comma = if i > 0 { ", " } else { "" };
        let _ = write!(text, "{comma}{}", tuple(&row));
    }
    text + "]"
}

impl Text {
    /// A line, or several, at the depth of what is open.
    pub(super) fn line(&mut self, line: &str) {
        for part in line.split('\n') {
            if !part.is_empty() {
                let _ = write!(self.text, "{:1$}", "", 4 * self.depth);
            }
            self.text += part;
            self.text.push('\n');
        }
    }

    pub(super) fn open(&mut self, head: &str) {
        self.line(head);
        self.line("{");
        self.depth += 1;
    }

    pub(super) fn close(&mut self) {
        self.depth -= 1;
        self.line("}");
    }

    /// The labels of a prim in a taxonomy.
    pub(super) fn labels(&mut self, taxonomy: &str, labels: &[&str]) {
        let labels: Vec<String> = labels.iter().map(|label| quoted(label)).collect();
        let labels = labels.join(", ");
        self.line(&format!("token[] semantics:labels:{taxonomy} = [{labels}]"));
    }

    /// An attribute of vectors.
    pub(super) fn array<const N: usize>(
        &mut self,
        attribute: &str,
        rows: impl Iterator<Item = [f32; N]>,
    ) {
        self.line(&format!("{attribute} = {}", tuples(rows)));
    }

    /// An attribute of numbers.
    pub(super) fn list<T: Display>(
        &mut self,
        attribute: &str,
        values: impl IntoIterator<Item = T>,
    ) {
        let mut list = String::from("[");
        for (i, value) in values.into_iter().enumerate() {
            let comma = if i > 0 { ", " } else { "" };
            let _ = write!(list, "{comma}{value}");
        }
        self.line(&format!("{attribute} = {list}]"));
    }

    /// Says that the attribute before has a value for each vertex.
    pub(super) fn interpolated(&mut self) {
        self.text.truncate(self.text.trim_end().len());
        self.text += " (\n";
        self.line("    interpolation = \"vertex\"");
        self.line(")");
    }

    pub(super) fn finish(self) -> String {
        self.text
    }
}
