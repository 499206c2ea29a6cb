//! Measures every stand preset and every species, and writes `docs/measurements/realism.md` with
//! its plots.
//!
//! ```text
//! cargo run --release -p nemoral-realism
//! ```
//!
//! With names of stands as arguments, only these are measured; the page is printed and nothing is
//! written.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a report for its user"
)]

mod checks;
mod measure;
mod page;
mod plots;
mod wrap;

use std::path::Path;

use nemoral_assets::Species;
use nemoral_realism::STANDS;
use nemoral_realism::{HeightScatter, Relations, stand_diameters};

/// Grown of each species.
const TREES: u32 = 500;

fn main() -> std::io::Result<()> {
    let named: Vec<String> = std::env::args().skip(1).collect();
    if let Some(unknown) = named.iter().find(|n| !STANDS.contains(&n.as_str())) {
        let allowed = STANDS.join(", ");
        let message = format!("{unknown}: not a stand; allowed are {allowed}");
        return Err(std::io::Error::other(message));
    }
    let wanted = STANDS
        .iter()
        .filter(|s| named.is_empty() || named.iter().any(|n| n == *s));
    let stands: Vec<measure::Stand> = wanted
        .map(|name| {
            eprintln!("{name} …");
            measure::Stand::measure(name)
        })
        .collect();
    let all = Species::all().into_iter().filter(|_| named.is_empty());
    let grown: Vec<page::Grown> = all
        .map(|species| {
            eprintln!("{TREES} of {} …", species.name);
            let relations = Relations::of(&species, TREES);
            let stand = Relations::grown(&species, &stand_diameters(&species, TREES));
            page::Grown {
                heights: HeightScatter::of(&species, &stand.sizes),
                species,
                relations,
            }
        })
        .collect();
    let (text, plots) = page::write(&stands, &grown);
    if !named.is_empty() {
        println!("{text}");
        return Ok(());
    }
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/measurements");
    std::fs::create_dir_all(docs.join("realism"))?;
    for (name, svg) in plots {
        std::fs::write(docs.join("realism").join(name), svg)?;
    }
    std::fs::write(docs.join("realism.md"), text)
}
