//! The documents: their links lead somewhere, their lines are short, and the handbook is complete.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

use nemoral_scene::{Ontology, Semantic};

/// The widest line, in characters.
const COLUMNS: usize = 100;

/// The endings of files whose lines are that short.
const NARROW: [&str; 6] = ["rs", "md", "toml", "yml", "cff", "wgsl"];

fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().expect("the workspace's root").to_owned()
}

/// Every file below a folder of the repository whose name ends in one of these.
fn collect(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        let name = path.file_name().expect("a name").to_string_lossy();
        if path.is_dir() {
            // Build outputs and files outside of the repository are left out.
            let is_ours = !["target", ".git", "corpus", "artifacts"].contains(&&*name)
                && !name.starts_with("nemoral-out");
            if is_ours {
                collect(&path, endings, found);
            }
        } else if let Some(ending) = path.extension().and_then(|e| e.to_str())
            && endings.contains(&ending)
        {
            found.push(path);
        }
    }
}

/// Path below the root, with forward slashes, and text of every file with one of these endings.
fn texts(endings: &[&str]) -> BTreeMap<String, String> {
    let root = root();
    let mut found = Vec::new();
    collect(&root, endings, &mut found);
    let page = |path: PathBuf| {
        let below = path.strip_prefix(&root).expect("below the root");
        let name = below.to_string_lossy().replace('\\', "/");
        (name, fs::read_to_string(&path).expect("UTF-8"))
    };
    found.into_iter().map(page).collect()
}

/// Every Markdown file.
fn pages() -> BTreeMap<String, String> {
    texts(&["md"])
}

/// The lines of a page outside of fenced code, with their numbers from 1.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut is_code = false;
    let mut lines = Vec::new();
    for (i, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code {
            lines.push((i + 1, line));
        }
    }
    lines
}

/// A line without its `code`.
fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect()
}

/// The targets of a line's links and pictures.
fn targets(line: &str) -> Vec<String> {
    let line = without_code(line);
    let inline = line.split("](").skip(1);
    let inline = inline.filter_map(|rest| rest.split([')', ' ']).next());
    let html = line.split("src=\"").skip(1);
    let html = html.filter_map(|rest| rest.split('"').next());
    inline.chain(html).map(str::to_owned).collect()
}

/// A heading's text without its links and marks.
fn plain(heading: &str) -> String {
    let mut text = String::new();
    let mut rest = heading;
    while let Some(at) = rest.find("](") {
        text.push_str(&rest[..at]);
        rest = rest[at..].split_once(')').map_or("", |(_, after)| after);
    }
    text.push_str(rest);
    text
}

/// The anchors of a page, as GitHub and mdBook make them of its headings.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    let mut repeated: BTreeMap<String, u32> = BTreeMap::new();
    for (_, line) in prose(text) {
        let level = line.bytes().take_while(|b| *b == b'#').count();
        if !(1..=6).contains(&level) || !line[level..].starts_with(' ') {
            continue;
        }
        let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
        let heading = plain(line[level..].trim()).to_lowercase();
        let anchor: String = heading.chars().filter(kept).collect();
        let anchor = anchor.replace(' ', "-");
        let count = repeated.entry(anchor.clone()).or_default();
        anchors.insert(match *count {
            0 => anchor,
            n => format!("{anchor}-{n}"),
        });
        *count += 1;
    }
    anchors
}

/// A path below the root without `.` and `..`; `None` if it leaves the repository.
fn normal(path: &Path) -> Option<PathBuf> {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir if normal.pop() => {}
            Component::ParentDir => return None,
            Component::Normal(name) => normal.push(name),
            _ => {}
        }
    }
    Some(normal)
}

/// The fault of a link of a page, if it has one.
fn fault(pages: &BTreeMap<String, String>, page: &str, target: &str) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let folder = Path::new(page).parent().unwrap_or(Path::new(""));
    let Some(below) = normal(&folder.join(file)) else {
        return Some("leaves the repository".to_owned());
    };
    let name = match file {
        "" => page.to_owned(),
        _ => below.to_string_lossy().replace('\\', "/"),
    };
    if !root().join(&name).exists() {
        return Some("leads nowhere".to_owned());
    }
    if anchor.is_empty() {
        return None;
    }
    match pages.get(&name) {
        Some(text) if anchors(text).contains(anchor) => None,
        Some(_) => Some("has no such heading".to_owned()),
        None => Some("is no page".to_owned()),
    }
}

#[test]
fn every_link_leads_somewhere() {
    let pages = pages();
    assert!(pages.len() > 30, "{} pages", pages.len());
    let (mut faults, mut links) = (Vec::new(), 0);
    for (page, text) in &pages {
        for (number, line) in prose(text) {
            for target in targets(line) {
                links += 1;
                if let Some(fault) = fault(&pages, page, &target) {
                    faults.push(format!("{page}:{number}: {target} {fault}"));
                }
            }
        }
    }
    assert!(links > 100, "{links} links");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn faults_of_links_are_found() {
    let pages = pages();
    let fault = |target| fault(&pages, "docs/guide/sensors.md", target);
    assert_eq!(fault("../glossary.md#lidar"), None);
    assert_eq!(fault("https://example.org/nowhere"), None);
    assert!(fault("../glossary.md#no-such-heading").is_some());
    assert!(fault("no-such-page.md").is_some());
    assert!(fault("../../../elsewhere.md").is_some());
    assert_eq!(
        targets("[a](b.md), `[c](d.md)` ![e](f.png)"),
        ["b.md", "f.png"]
    );
    assert_eq!(
        anchors("# Of `code`, and [links](x.md)!\n## Twice\n## Twice\n"),
        ["of-code-and-links", "twice", "twice-1"]
            .map(str::to_owned)
            .into()
    );
}

/// The columns of a line that count: rows of tables have none, addresses and the targets of links
/// are left out, as neither can be broken.
fn columns(line: &str, is_markdown: bool) -> usize {
    let text = line.trim_start().trim_start_matches(['/', '!', '#', ' ']);
    if text.starts_with('|') {
        return 0;
    }
    let line = if is_markdown {
        plain(line)
    } else {
        line.to_owned()
    };
    let words = line.split(' ').filter(|word| !word.contains("://"));
    let columns: usize = words.map(|word| word.chars().count() + 1).sum();
    columns.saturating_sub(1)
}

#[test]
fn lines_are_short() {
    let texts = texts(&NARROW);
    assert!(texts.len() > 600, "{} files", texts.len());
    let mut long = Vec::new();
    for (name, text) in &texts {
        for (i, line) in text.lines().enumerate() {
            let columns = columns(line, name.ends_with(".md"));
            if columns > COLUMNS {
                let number = i + 1;
                long.push(format!("{name}:{number}: {columns} columns, not {COLUMNS}"));
            }
        }
    }
    assert!(long.is_empty(), "break these lines:\n{}", long.join("\n"));
}

#[test]
fn columns_are_counted() {
    let wide = "wide ".repeat(30);
    assert_eq!(columns("été", false), 3);
    assert_eq!(columns(&wide, true), 150);
    assert_eq!(columns(&format!("    //! | {wide} |"), false), 0);
    assert_eq!(columns("see https://example.org/x now", true), 7);
    assert_eq!(columns("[a](b/c.md) d", true), "[a d".len());
}

#[test]
fn the_handbook_lists_every_page_once() {
    let pages = pages();
    let summary = &pages["docs/SUMMARY.md"];
    let mut listed: Vec<String> = prose(summary)
        .into_iter()
        .flat_map(|(_, line)| targets(line))
        .map(|target| format!("docs/{target}"))
        .collect();
    listed.sort();
    let there: Vec<String> = pages
        .into_keys()
        .filter(|p| p.starts_with("docs/") && p != "docs/SUMMARY.md")
        .collect();
    assert_eq!(listed, there);
}

#[test]
fn the_readme_is_short_and_names_both_commands() {
    let readme = &pages()["README.md"];
    let words = readme.split_whitespace().count();
    assert!(words < 900, "{words} words");
    for command in [
        "\ncargo run --release -- generate\n",
        "\ncargo test --workspace\n",
    ] {
        assert!(readme.contains(command), "{command:?}");
    }
}

#[test]
fn contributing_names_tests_that_are_there() {
    let pages = pages();
    let lines = pages["CONTRIBUTING.md"].lines();
    let table = lines.skip_while(|l| !l.starts_with("| you change |"));
    let mut named = 0;
    for row in table.skip(2).take_while(|l| l.starts_with('|')) {
        let column = row.split('|').nth(3).expect("three columns");
        for name in column.split('`').skip(1).step_by(2) {
            if name.starts_with("-p ") {
                continue;
            }
            let test = root().join(format!("tests/tests/{name}.rs"));
            assert!(test.exists(), "{name}");
            named += 1;
        }
    }
    assert!(named > 20, "{named} tests");
}

#[test]
fn the_reference_is_what_the_program_prints() {
    let written = &pages()["docs/reference/config.md"];
    let printed = nemoral_pipeline::config::reference_page();
    assert!(
        written.trim_end() == printed.trim_end(),
        "run `nemoral config reference > docs/reference/config.md`"
    );
}

#[test]
fn configs_of_the_guide_are_requests() {
    let mut blocks = 0;
    for page in [
        "docs/guide/balance.md",
        "docs/guide/many-worlds.md",
        "docs/guide/weather.md",
    ] {
        for block in pages()[page].split("```toml\n").skip(1) {
            let config = block.split("```").next().unwrap_or_default();
            let folder = tempfile::tempdir().expect("a folder");
            let file = folder.path().join("guide.toml");
            fs::write(&file, config).expect("a writable folder");
            let layers = nemoral_pipeline::config::ConfigLayers {
                file: Some(file),
                ..Default::default()
            };
            let sequences = layers.sequences().unwrap_or_else(|e| panic!("{page}: {e}"));
            for number in 0..sequences.len() {
                let of = sequences
                    .get(number)
                    .unwrap_or_else(|e| panic!("{page}: {e}"));
                // Without a day it is high summer.
                let (weather, day) = (&of.config.weather, of.config.season.day(&of.config.sun));
                if weather.snow_depth_m > 0.0 || weather.snowfall_mm_per_h > 0.0 {
                    let is_winter = day.is_some_and(|day| !(90..320).contains(&day));
                    assert!(is_winter, "{page}: snow on green leaves: {config}");
                }
            }
            blocks += 1;
        }
    }
    assert!(blocks > 5, "{blocks} configs");
}

#[test]
fn the_page_of_classes_has_every_semantic() {
    let page = fs::read_to_string(root().join("docs/reference/classes.md")).expect("the page");
    let paper = Ontology::paper();
    for (i, semantic) in Semantic::ALL.iter().enumerate() {
        let name = semantic.name();
        assert!(page.contains(&format!("| {i} | `{name}` | ")), "{name}");
        let class = paper.class(*semantic);
        let row = page
            .lines()
            .find(|l| l.starts_with(&format!("| {} | {} |", class.id, class.name)))
            .expect("a row for each class");
        assert!(row.contains(&format!("`{name}`")), "{name}: {row}");
    }
}
