//! Objects as rows of a data set's tables.

use nemoral_assets::{PlantKind, WoodVolume};
use nemoral_scene::{DeadwoodRecord, ObjectKind, ObjectRecord, TreeRecord};
use nemoral_stand::SceneObject;

use super::WorldAssets;

impl WorldAssets {
    /// An object's row of `instances.csv`.
    #[must_use]
    pub fn object_record(&self, object: &SceneObject) -> ObjectRecord {
        let (species, height_m) = match object.kind {
            ObjectKind::Tree => {
                let tree = &self.standing[object.asset].tree;
                (&tree.species, tree.size.height_m)
            }
            ObjectKind::Log => {
                let log = self.log(object);
                (&log.species, log.half_height_m[0] * 2.0)
            }
            _ => {
                let (kind, number) = self.plant_of(object);
                let plant = &self.library.plants[kind][number];
                // A root plate is of its stem's species.
                let species = match kind {
                    PlantKind::RootPlate => &self.library.deadwood.thrown[number].species,
                    _ => &plant.name,
                };
                (species, plant.height_m)
            }
        };
        ObjectRecord {
            object: object.object,
            kind: object.kind,
            species: species.clone(),
            position_m: object.position_m,
            radius_m: object.radius_m,
            height_m: object
                .measured
                .map_or(height_m * object.scale, |m| m.height_m),
        }
    }

    /// An object's row of `deadwood.csv`, if it is a log or a root plate.
    #[must_use]
    pub fn deadwood_record(&self, object: &SceneObject) -> Option<DeadwoodRecord> {
        let of = &self.library.deadwood;
        let linear = object.linear.as_dmat3();
        let (along, across) = (linear.x_axis.length(), linear.z_axis.length());
        let azimuth = libm::atan2(linear.x_axis.x, linear.x_axis.y).to_degrees();
        let (log, is_thrown) = match object.kind {
            ObjectKind::Log => (self.log(object), object.asset >= of.logs.len()),
            ObjectKind::RootPlate => (&of.thrown[object.asset], true),
            _ => return None,
        };
        let is_log = object.kind == ObjectKind::Log;
        let (length_m, diameter_m) = if is_log {
            (log.length_m * along, log.diameter_m.map(|d| d * across))
        } else {
            let plate = &self.library.plants[PlantKind::RootPlate][object.asset];
            let bounds = plate.prototype.bounds();
            let thick = f64::from(bounds.max.x - bounds.min.x);
            (thick * along, [2.0 * plate.radius_m * across; 2])
        };
        Some(DeadwoodRecord {
            object: object.object,
            kind: object.kind,
            species: log.species.clone(),
            position_m: object.position_m,
            azimuth_deg: azimuth.rem_euclid(360.0),
            length_m,
            diameter_m,
            decay: log.stage,
            volume_m3: if is_log {
                log.volume_m3 * along * across * across
            } else {
                0.0
            },
            is_thrown,
        })
    }

    /// An object's row of `trees.csv`, if it is a tree.
    #[must_use]
    pub fn tree_record(&self, object: &SceneObject) -> Option<TreeRecord> {
        if object.kind != ObjectKind::Tree {
            return None;
        }
        let tree = &self.standing[object.asset].tree;
        let s = object.scale;
        let mut stretch = [s, s];
        let mut measured_m = None;
        let mut field_id = String::new();
        if let Some(measured) = object.measured {
            stretch = [measured.across, measured.along];
            measured_m = Some([measured.dbh_m, measured.height_m]);
            field_id.clone_from(&self.field_ids[measured.number as usize]);
        }
        let [across, along] = stretch;
        let size = tree.size_of_copy(stretch);
        let [dbh_m, height_m] = measured_m.unwrap_or([size.dbh_m, size.height_m]);
        let growth = across * across * along;
        let merchantable_m3 = |wood: &WoodVolume| {
            growth * wood.volume_above_diameter_m3(WoodVolume::MERCHANTABLE_M / across)
        };
        Some(TreeRecord {
            object: object.object,
            species: tree.species.clone(),
            position_m: object.position_m,
            dbh_m,
            height_m,
            crown_base_m: size.crown_base_m,
            crown_radius_m: size.crown_radius_m,
            leaf_area_m2: size.leaf_area_m2,
            stem_volume_m3: growth * tree.stem_volume_m3,
            wood_volume_m3: tree.wood.as_ref().map(|wood| growth * wood.total_m3()),
            merchantable_volume_m3: tree.wood.as_ref().map(merchantable_m3),
            lean_rad: size.lean_rad,
            age_class: tree.class.name().to_owned(),
            alive: tree.alive,
            field_id,
        })
    }
}
