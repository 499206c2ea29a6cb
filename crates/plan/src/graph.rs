//! Plans as graphs.

use std::fmt::Write;

use crate::{AnyCoordinate, Plan, PlanTypes, Store};

/// How [`Plan::draw`] writes a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GraphFormat {
    /// Mermaid, which GitHub renders.
    Mermaid,
    /// Graphviz DOT.
    Dot,
}

impl<P: PlanTypes> Plan<P> {
    /// The plan as a graph.
    #[must_use]
    pub fn draw(&self, format: GraphFormat) -> String {
        let mut out = String::from(match format {
            GraphFormat::Mermaid => "flowchart TD\n",
            GraphFormat::Dot => "digraph nemoral {\n",
        });
        for (i, entry) in self.entries.iter().enumerate() {
            let id = entry.node.id();
            let _ = match format {
                GraphFormat::Mermaid => writeln!(out, "  n{i}[\"{id}\"]"),
                GraphFormat::Dot => writeln!(out, "  n{i} [label=\"{id}\"];"),
            };
        }
        for (i, entry) in self.entries.iter().enumerate() {
            for input in entry.node.inputs() {
                let _ = match format {
                    GraphFormat::Mermaid => writeln!(out, "  n{input} --> n{i}"),
                    GraphFormat::Dot => writeln!(out, "  n{input} -> n{i};"),
                };
            }
        }
        if format == GraphFormat::Dot {
            out.push_str("}\n");
        }
        out
    }

    /// One line for each node: its id, its key without a coordinate, how many of its values `store`
    /// has, and for a global node whether the store's cache has it.
    #[must_use]
    pub fn explain(&self, store: &Store<P>) -> String {
        let mut out = String::new();
        for (i, entry) in self.entries.iter().enumerate() {
            let key = self.key_of(i, P::At::GLOBAL);
            let is_on_disk = store.cache().is_some_and(|cache| cache.has(key));
            let on_disk = if is_on_disk { ", on disk" } else { "" };
            let kept = store.count(entry.node.id());
            let key = entry.base.to_string();
            let _ = writeln!(
                out,
                "{:<24} {}  cached: {kept}{on_disk}",
                entry.node.id(),
                &key[..16]
            );
        }
        out
    }
}
