//! The page as text.

use std::collections::BTreeMap;

use nemoral_dataset::Dataset;
use serde::Serialize;

use crate::budget::{Budget, halving_order};
use crate::maps::{View, view};
use crate::scans::{Scan, scan};
use crate::summary::{Summary, candidates};
use crate::{Error, MAX_WHOLE_FRAMES};

const TEMPLATE: &str = include_str!("../page/page.html");
const STYLE: &str = include_str!("../page/style.css");
const SCRIPT: &str = include_str!("../page/page.js");
const THREE: &str = include_str!("../page/three.js");

/// One part in so many of a page's bytes is for thumbnails, at most.
const THUMBNAIL_SHARE: usize = 4;

/// A frame with all its maps.
#[derive(Debug, Serialize)]
struct Whole {
    views: Vec<View>,
    scans: Vec<Scan>,
}

/// Reads the data set and writes its page of at most `max_bytes`, if what has no bound of its own
/// leaves room; the number of frames that have all their maps, too.
pub(crate) fn page(dataset: &Dataset, max_bytes: usize) -> Result<(String, usize), Error> {
    let mut summary = Summary::new(dataset, max_bytes / THUMBNAIL_SHARE)?;
    let fixed = assembled("").len() + block("summary", &json(&summary)).len();
    let mut budget = Budget::new(max_bytes.saturating_sub(fixed));
    let candidates = candidates(dataset.frames().len());
    let mut wholes = BTreeMap::new();
    for i in halving_order(candidates.len()) {
        let whole = json(&whole(dataset, candidates[i])?);
        // The id's length is that of the last possible one, at most.
        if !budget.take(block(&id(MAX_WHOLE_FRAMES), &whole).len()) {
            // A smaller one may fit still, but then frames would not be spread.
            break;
        }
        wholes.insert(candidates[i], whole);
    }
    summary.set_whole(wholes.keys().copied());
    let mut data = block("summary", &json(&summary));
    for (i, whole) in wholes.values().enumerate() {
        data += &block(&id(i), whole);
    }
    Ok((assembled(&data), wholes.len()))
}

fn id(whole: usize) -> String {
    format!("frame-{whole}")
}

fn whole(dataset: &Dataset, at: usize) -> Result<Whole, Error> {
    let ontology = &dataset.manifest().header.ontology;
    let frame = dataset.read_frame(at)?;
    let (cameras, lidars) = (frame.cameras.len(), frame.lidars.len());
    let views = frame.cameras.iter().map(|c| view(c, cameras, ontology));
    let scans = frame.lidars.iter().map(|l| scan(l, lidars));
    Ok(Whole {
        views: views.collect(),
        scans: scans.collect(),
    })
}

/// The page with this data.
fn assembled(data: &str) -> String {
    let mut page = String::new();
    for part in TEMPLATE.split_inclusive("-->") {
        // A placeholder is a comment on a line of its own.
        let (before, name) = part.rsplit_once("<!--").unwrap_or((part, ""));
        page += before;
        match name.trim_end_matches("-->").trim() {
            "style" => page += &format!("<style>\n{STYLE}</style>"),
            "data" => page += data,
            "script" => page += &format!("<script>\n{THREE}</script>\n<script>\n{SCRIPT}</script>"),
            _ => {}
        }
    }
    page
}

/// Data as JSON in which no text can end a block, as `<` is escaped.
fn json(value: &impl Serialize) -> String {
    let json = serde_json::to_string(value).expect("all keys are strings");
    json.replace('<', "\\u003c")
}

/// A block of data for the page's script.
fn block(id: &str, json: &str) -> String {
    format!("<script type=\"application/json\" id=\"{id}\">{json}</script>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_ends_its_block() {
        let block = block("a", &json(&"</script><script>alert(1)</script><!--"));
        assert_eq!(block.matches('<').count(), 2, "{block}");
    }

    /// One that is not finite is `null` in JSON, which has no methods: the function for all numbers
    /// knows it.
    #[test]
    fn numbers_become_text_in_one_place() {
        assert_eq!(SCRIPT.matches(".toFixed(").count(), 1);
        assert!(SCRIPT.contains("Number.isFinite(v) ? v.toFixed(digits)"));
    }

    #[test]
    fn what_is_built_in_ends_no_block() {
        for script in [SCRIPT, THREE] {
            assert!(!script.contains("</script"));
        }
        assert!(!STYLE.contains("</style"));
        for place in ["<!-- style -->", "<!-- data -->", "<!-- script -->"] {
            assert_eq!(TEMPLATE.matches(place).count(), 1);
        }
    }
}
