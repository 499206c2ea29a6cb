//! Checks `trees.csv`, `deadwood.csv` and `instances.csv`.

use std::collections::BTreeSet;

use nemoral_scene::{ObjectId, ObjectKind, ObjectRecord, TreeRecord};

use super::Checker;
use crate::layout;

/// The ids of a sequence's objects.
pub(super) struct Inventory {
    pub(super) true_ids: BTreeSet<ObjectId>,
    pub(super) image_ids: BTreeSet<u32>,
}

impl Checker<'_> {
    /// Checks `trees.csv`, `deadwood.csv` and `instances.csv` of a sequence.
    pub(super) fn inventory(&mut self, sequence: u32) -> Inventory {
        let path = |name| layout::sequence_file(sequence, name);
        let (of_trees, of_objects) = (path(layout::TREES), path(layout::INSTANCES));
        let objects = self.dataset.objects(sequence);
        let objects = self.read(&of_objects, objects).unwrap_or_default();
        let trees = self.dataset.trees(sequence);
        let trees = self.read(&of_trees, trees).unwrap_or_default();
        let path = of_trees;
        let is_tree = |o: &&ObjectRecord| o.kind == ObjectKind::Tree;
        let of_objects: BTreeSet<_> = objects.iter().filter(is_tree).map(|o| o.object).collect();
        let of_trees: BTreeSet<_> = trees.iter().map(|t| t.object).collect();
        if let Some(id) = of_objects.symmetric_difference(&of_trees).next() {
            let message = format!(
                "{} trees here, {} in instances.csv; tree {} is in one of them only",
                of_trees.len(),
                of_objects.len(),
                id.to_u64()
            );
            self.problem(&path, message);
        }
        for tree in &trees {
            if let Some(message) = impossible(tree) {
                self.problem(&path, message);
            }
        }
        let header = &self.dataset.manifest().header;
        if let Some(message) = self.split_trees.add(header, sequence, &trees) {
            self.problem(&path, message);
        }
        self.deadwood(sequence, &objects);
        let true_ids: BTreeSet<ObjectId> = objects.iter().map(|o| o.object).collect();
        Inventory {
            image_ids: true_ids.iter().map(|id| id.to_image_id()).collect(),
            true_ids,
        }
    }

    /// Compares `deadwood.csv` with a sequence's objects.
    fn deadwood(&mut self, sequence: u32, objects: &[ObjectRecord]) {
        let path = layout::sequence_file(sequence, layout::DEADWOOD);
        let deadwood = self.dataset.deadwood(sequence);
        let Some(deadwood) = self.read(&path, deadwood) else {
            return;
        };
        let lies = |kind| matches!(kind, ObjectKind::Log | ObjectKind::RootPlate);
        let objects = objects.iter().filter(|o| lies(o.kind));
        let objects: BTreeSet<_> = objects.map(|o| (o.object, o.kind)).collect();
        let rows: BTreeSet<_> = deadwood.iter().map(|d| (d.object, d.kind)).collect();
        if let Some((id, kind)) = objects.symmetric_difference(&rows).next() {
            let message = format!(
                "{} rows, {} logs and root plates in instances.csv; {} {} is in one of them only",
                rows.len(),
                objects.len(),
                kind.name(),
                id.to_u64()
            );
            self.problem(&path, message);
        }
        for row in &deadwood {
            let [large, small] = row.diameter_m;
            let is_log = row.kind == ObjectKind::Log;
            let fine = row.length_m > 0.0
                && small > 0.0
                && large >= small
                && (0.0..360.0).contains(&row.azimuth_deg)
                && (row.volume_m3 > 0.0) == is_log;
            if !fine {
                let message = format!(
                    "{} {}: length_m = {}, diameters {large} and {small}, volume_m3 = {}, \
                     azimuth_deg = {}: lengths must be above 0, the large diameter the larger, \
                     azimuths from 0 to 360, and logs alone have a volume",
                    row.kind.name(),
                    row.object.to_u64(),
                    row.length_m,
                    row.volume_m3,
                    row.azimuth_deg
                );
                self.problem(&path, message);
            }
        }
    }
}

/// What is impossible about a tree: sizes that are not above 0, a crown above its top, leaves on
/// dead wood.
fn impossible(tree: &TreeRecord) -> Option<String> {
    let positive = |name: &str, value: f64| {
        let fine = value > 0.0 && value.is_finite();
        (!fine).then(|| format!("{name} = {value}: must be above 0"))
    };
    let crown = || {
        let (base, top) = (tree.crown_base_m, tree.height_m);
        let fine = (0.0..=top).contains(&base);
        (!fine).then(|| format!("crown_base_m = {base}: must be from 0 to height_m = {top}"))
    };
    let leaves = || {
        let leafless = tree.leaf_area_m2 == 0.0;
        let fine = tree.leaf_area_m2 >= 0.0 && leafless != tree.alive;
        (!fine).then(|| {
            let (area, alive) = (tree.leaf_area_m2, tree.alive);
            format!(
                "leaf_area_m2 = {area}, alive = {alive}: a living tree has leaves, a dead one none"
            )
        })
    };
    // A tree that is lower than breast height has no diameter there.
    let diameter = || {
        let low = tree.height_m <= 1.3 && tree.dbh_m == 0.0;
        if low {
            None
        } else {
            positive("dbh_m", tree.dbh_m)
        }
    };
    let found = diameter()
        .or_else(|| positive("height_m", tree.height_m))
        .or_else(|| positive("stem_volume_m3", tree.stem_volume_m3))
        .or_else(crown)
        .or_else(leaves)?;
    Some(format!("tree {}: {found}", tree.object.to_u64()))
}
