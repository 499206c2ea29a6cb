//! Wrapping of the page's lines.

/// The widest line outside of tables.
const COLUMNS: usize = 100;

/// Markdown whose paragraphs and list items are in lines of at most 100 columns. Tables, headings
/// and HTML stay as they are.
pub(crate) fn wrapped(markdown: &str) -> String {
    let mut out = String::new();
    for line in markdown.lines() {
        if line.starts_with(['|', '#', '<']) {
            out.push_str(line);
        } else {
            wrap(
                line,
                if line.starts_with("- ") { "  " } else { "" },
                &mut out,
            );
        }
        out.push('\n');
    }
    out
}

/// Breaks a line at blanks, except inside code and before characters that would begin a list.
fn wrap(line: &str, indent: &str, out: &mut String) {
    let mut words: Vec<String> = Vec::new();
    let mut is_code = false;
    for word in line.split(' ') {
        match words.last_mut() {
            Some(last) if is_code || matches!(word, "-" | "+" | "=") => last.extend([" ", word]),
            _ => words.push(word.to_owned()),
        }
        is_code ^= word.matches('`').count() % 2 == 1;
    }
    let mut columns = 0;
    for word in words {
        let width = word.chars().count();
        if columns > 0 && columns + 1 + width > COLUMNS {
            out.push('\n');
            out.push_str(indent);
            columns = indent.len();
        } else if columns > 0 {
            out.push(' ');
            columns += 1;
        }
        out.push_str(&word);
        columns += width;
    }
}
