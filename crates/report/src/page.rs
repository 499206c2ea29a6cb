//! The page as text.

use nemoral_dataset::Dataset;
use serde::Serialize;

use crate::maps::{View, view};
use crate::scans::{Scan, scan};
use crate::summary::summary;
use crate::{Error, MAX_WHOLE_FRAMES, spread};

const TEMPLATE: &str = include_str!("../page/page.html");
const STYLE: &str = include_str!("../page/style.css");
const SCRIPT: &str = include_str!("../page/page.js");
const THREE: &str = include_str!("../page/three.js");

/// A frame with all its maps.
#[derive(Debug, Serialize)]
struct Whole {
    views: Vec<View>,
    scans: Vec<Scan>,
}

/// Reads the data set and writes its page.
pub(crate) fn page(dataset: &Dataset) -> Result<String, Error> {
    let whole = spread(dataset.frames().len(), MAX_WHOLE_FRAMES);
    let mut data = block("summary", &summary(dataset, &whole)?);
    let ontology = &dataset.manifest().header.ontology;
    for (i, &at) in whole.iter().enumerate() {
        let frame = dataset.read_frame(at)?;
        let (cameras, lidars) = (frame.cameras.len(), frame.lidars.len());
        let views = frame.cameras.iter().map(|c| view(c, cameras, ontology));
        let scans = frame.lidars.iter().map(|l| scan(l, lidars));
        let whole = Whole {
            views: views.collect(),
            scans: scans.collect(),
        };
        data += &block(&format!("frame-{i}"), &whole);
    }
    let mut page = String::new();
    for part in TEMPLATE.split_inclusive("-->") {
        // A placeholder is a comment on a line of its own.
        let (before, name) = part.rsplit_once("<!--").unwrap_or((part, ""));
        page += before;
        match name.trim_end_matches("-->").trim() {
            "style" => page += &format!("<style>\n{STYLE}</style>"),
            "data" => page += &data,
            "script" => page += &format!("<script>\n{THREE}</script>\n<script>\n{SCRIPT}</script>"),
            _ => {}
        }
    }
    Ok(page)
}

/// Data for the page's script. No text in it can end the block, as `<` is escaped.
fn block(id: &str, value: &impl Serialize) -> String {
    let json = serde_json::to_string(value).expect("all keys are strings");
    let json = json.replace('<', "\\u003c");
    format!("<script type=\"application/json\" id=\"{id}\">{json}</script>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_ends_its_block() {
        let block = block("a", &"</script><script>alert(1)</script><!--");
        assert_eq!(block.matches('<').count(), 2, "{block}");
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
