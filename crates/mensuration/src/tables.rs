//! Measures as text: tables of comma-separated values, crowns as GeoJSON.

use nemoral_scene::TreeRecord;
use nemoral_scene::glam::DVec2;
use serde_json::{Value, json};

use crate::{AreaProfile, StandMeasures, VisibleCrown};

/// The columns of [`StandMeasures`].
const STAND_COLUMNS: [&str; 11] = [
    "trees_per_ha",
    "basal_area_m2_ha",
    "quadratic_mean_dbh_m",
    "lorey_height_m",
    "dominant_dbh_m",
    "dominant_height_m",
    "stand_density_index",
    "stem_volume_m3_ha",
    "leaf_area_index",
    "dead_trees_per_ha",
    "dead_stem_volume_m3_ha",
];

/// Measures in rows, each after the values of further columns that say what it is of. Measures that
/// a stand does not have are empty.
#[must_use]
pub fn stand_csv(keys: &[&str], rows: &[(Vec<String>, StandMeasures)]) -> String {
    let head = keys.iter().copied().chain(STAND_COLUMNS);
    let mut table = Table::new(head.map(str::to_owned));
    for (key, m) in rows {
        let number = |value: f64| format!("{value:.4}");
        let maybe = |value: Option<f64>| value.map(number).unwrap_or_default();
        let measures = [
            number(m.trees_per_ha),
            number(m.basal_area_m2_ha),
            maybe(m.quadratic_mean_dbh_m),
            maybe(m.lorey_height_m),
            maybe(m.dominant_dbh_m),
            maybe(m.dominant_height_m),
            maybe(m.stand_density_index),
            number(m.stem_volume_m3_ha),
            number(m.leaf_area_index),
            number(m.dead_trees_per_ha),
            number(m.dead_stem_volume_m3_ha),
        ];
        table.row(key.iter().cloned().chain(measures));
    }
    table.finish()
}

/// The layers of a profile from the ground up.
#[must_use]
pub fn profile_csv(profile: &AreaProfile) -> String {
    let head = [
        "from_m",
        "to_m",
        "leaf_area_density_m2_m3",
        "wood_area_density_m2_m3",
    ];
    let mut table = Table::new(head.map(str::to_owned));
    for layer in 0..profile.layers() {
        let [from_m, to_m] = [layer, layer + 1].map(|n| n as f64 * profile.layer_m);
        let [leaf, wood] = profile.densities_m2_m3(layer);
        let [from_m, to_m] = [from_m, to_m].map(|m| format!("{}", (m * 1e6).round() / 1e6));
        table.row([from_m, to_m, format!("{leaf:.6}"), format!("{wood:.6}")]);
    }
    table.finish()
}

/// Crowns of trees as polygons, with what is known of each tree. Crowns of what is no tree are left
/// out. `origin_m` is added to all places; `epsg` is the coordinate reference system that they are
/// in, if there is one, in the member `crs` that GDAL and QGIS read.
#[must_use]
pub fn crowns_geojson(
    crowns: &[VisibleCrown],
    trees: &[TreeRecord],
    origin_m: DVec2,
    epsg: Option<u16>,
) -> String {
    let mut by_id: Vec<&TreeRecord> = trees.iter().collect();
    by_id.sort_by_key(|tree| tree.object);
    let feature = |crown: &VisibleCrown| -> Option<Value> {
        let at = by_id.binary_search_by_key(&crown.object, |tree| tree.object);
        let tree = by_id[at.ok()?];
        let place = |corner: &DVec2| json!([corner.x + origin_m.x, corner.y + origin_m.y]);
        let ring = |ring: &Vec<DVec2>| -> Value {
            let closed = ring.iter().chain(ring.first());
            closed.map(place).collect()
        };
        let polygon = |rings: &Vec<Vec<DVec2>>| -> Value { rings.iter().map(ring).collect() };
        let polygons = crown.polygons.iter().map(|p| polygon(&p.rings));
        Some(json!({
            "type": "Feature",
            "properties": {
                "id": tree.object.to_u64(),
                "image_id": tree.object.to_image_id(),
                "species": tree.species,
                "dbh_m": tree.dbh_m,
                "height_m": tree.height_m,
                "alive": tree.alive,
                "field_id": tree.field_id,
                "visible_area_m2": crown.area_m2,
            },
            "geometry": { "type": "MultiPolygon", "coordinates": polygons.collect::<Value>() },
        }))
    };
    let features: Vec<Value> = crowns.iter().filter_map(feature).collect();
    let mut collection = json!({ "type": "FeatureCollection", "features": features });
    if let Some(epsg) = epsg {
        let name = format!("urn:ogc:def:crs:EPSG::{epsg}");
        collection["crs"] = json!({ "type": "name", "properties": { "name": name } });
    }
    format!("{collection}\n")
}

/// Comma-separated values.
struct Table(csv::Writer<Vec<u8>>);

impl Table {
    fn new(head: impl IntoIterator<Item = String>) -> Self {
        let mut table = Self(csv::Writer::from_writer(Vec::new()));
        table.row(head);
        table
    }

    fn row(&mut self, fields: impl IntoIterator<Item = String>) {
        let written = self.0.write_record(fields);
        written.expect("rows are as wide as their table, and memory takes them");
    }

    fn finish(self) -> String {
        let bytes = self.0.into_inner().expect("memory takes all rows");
        String::from_utf8(bytes).expect("fields are text")
    }
}
