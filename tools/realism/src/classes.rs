//! Shares of classes in pictures and scans.

use std::collections::BTreeMap;

use nemoral_scene::{Ontology, Semantic};

/// Numbers of pixels and points by class.
#[derive(Clone, Debug, Default)]
pub struct ClassCounts {
    pixels: BTreeMap<usize, u32>,
    points: BTreeMap<usize, u32>,
}

impl ClassCounts {
    /// Counts a picture and a scan.
    pub fn add(
        &mut self,
        ontology: &Ontology,
        pixels: &[Semantic],
        points: impl Iterator<Item = Semantic>,
    ) {
        let id = |s: Semantic| usize::from(ontology.class(s).id);
        for s in pixels {
            *self.pixels.entry(id(*s)).or_default() += 1;
        }
        for s in points {
            *self.points.entry(id(s)).or_default() += 1;
        }
    }

    /// Each class's name, its share of the pixels, and of the points.
    #[must_use]
    pub fn shares(&self, ontology: &Ontology) -> Vec<(String, f64, f64)> {
        let share = |of: &BTreeMap<usize, u32>, id| {
            let all: u32 = of.values().sum();
            f64::from(of.get(&id).copied().unwrap_or(0)) / f64::from(all.max(1))
        };
        let mut names: BTreeMap<usize, String> = BTreeMap::new();
        for s in Semantic::ALL {
            let class = ontology.class(*s);
            names.insert(usize::from(class.id), class.name.to_string());
        }
        names
            .into_iter()
            .map(|(id, name)| (name, share(&self.pixels, id), share(&self.points, id)))
            .collect()
    }
}
