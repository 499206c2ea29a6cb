//! Measures as text: tables of comma-separated values, crowns as GeoJSON.

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{DecayStage, TreeRecord};
use serde_json::{Value, json};

use crate::{AreaProfile, DeadwoodMeasures, LyingDeadwood, StandMeasures, VisibleCrown};

/// The columns of [`StandMeasures`].
const STAND_COLUMNS: [&str; 14] = [
    "trees_per_ha",
    "basal_area_m2_ha",
    "quadratic_mean_dbh_m",
    "lorey_height_m",
    "dominant_dbh_m",
    "dominant_height_m",
    "stand_density_index",
    "stem_volume_m3_ha",
    "wood_volume_m3_ha",
    "merchantable_volume_m3_ha",
    "leaf_area_index",
    "dead_trees_per_ha",
    "dead_basal_area_m2_ha",
    "dead_stem_volume_m3_ha",
];

/// A row of measures.
#[derive(Clone, Debug, PartialEq)]
pub struct StandRow {
    /// What it is of: a value for each column before the measures.
    pub key: Vec<String>,
    /// The measures.
    pub measures: StandMeasures,
    /// What was measured besides: a value for each column after them.
    pub more: Vec<String>,
}

/// Measures in rows, each between values of further columns: those that say what it is of, and
/// those that were measured besides. Measures that a stand does not have, or that are not known,
/// are empty.
///
/// # Panics
/// If rows have other than a value for each further column.
#[must_use]
pub fn stand_csv((keys, more): (&[&str], &[&str]), rows: &[StandRow]) -> String {
    let head = keys.iter().chain(&STAND_COLUMNS).chain(more);
    let mut table = Table::new(head.map(|name| (*name).to_owned()));
    for row in rows {
        assert_eq!(
            (row.key.len(), row.more.len()),
            (keys.len(), more.len()),
            "values of all columns"
        );
        let m = &row.measures;
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
            maybe(m.wood_volume_m3_ha),
            maybe(m.merchantable_volume_m3_ha),
            number(m.leaf_area_index),
            number(m.dead_trees_per_ha),
            number(m.dead_basal_area_m2_ha),
            number(m.dead_stem_volume_m3_ha),
        ];
        let fields = row.key.iter().cloned().chain(measures);
        table.row(fields.chain(row.more.iter().cloned()));
    }
    table.finish()
}

/// Dead wood that lies: all of it, then that of each stage of decay, from 1 (fresh) to 5 (rotten).
#[must_use]
pub fn deadwood_stand_csv(deadwood: &LyingDeadwood) -> String {
    let head = ["decay", "pieces_per_ha", "volume_m3_ha"];
    let mut table = Table::new(head.map(str::to_owned));
    let of_stage = |stage: DecayStage| (stage.number().to_string(), deadwood.of_stage(stage));
    let stages = DecayStage::ALL.into_iter().map(of_stage);
    for (decay, of) in std::iter::once(("all".to_owned(), deadwood.all())).chain(stages) {
        let DeadwoodMeasures {
            pieces_per_ha,
            volume_m3_ha,
        } = of;
        let [pieces, volume] = [pieces_per_ha, volume_m3_ha].map(|n| format!("{n:.4}"));
        table.row([decay, pieces, volume]);
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

/// Where features lie: what is added to places of the world, and the EPSG code of the coordinate
/// reference system that they are in then, if there is one. It is written as the member `crs`,
/// which GDAL and QGIS read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapFrame {
    /// Coordinates of the world's origin, metres.
    pub origin_m: DVec3,
    /// The code.
    pub epsg: Option<u16>,
}

/// Crowns as polygons, with their number from 1 on and what is known of their trees. Crowns of what
/// is no tree are left out.
#[must_use]
pub fn crowns_geojson(crowns: &[VisibleCrown], trees: &[TreeRecord], frame: &MapFrame) -> String {
    let mut by_id: Vec<&TreeRecord> = trees.iter().collect();
    by_id.sort_by_key(|tree| tree.object);
    let feature = |(crown, number): (&VisibleCrown, usize)| -> Option<Value> {
        let at = by_id.binary_search_by_key(&crown.object, |tree| tree.object);
        let mut properties = properties(by_id[at.ok()?]);
        properties["crown"] = json!(number);
        properties["visible_area_m2"] = json!(crown.area_m2);
        let place = |corner: &DVec2| frame.place(corner.extend(0.0))[..2].into();
        let ring = |ring: &Vec<DVec2>| -> Value {
            let closed = ring.iter().chain(ring.first());
            closed.map(place).collect::<Vec<Value>>().into()
        };
        let polygon = |rings: &Vec<Vec<DVec2>>| -> Value { rings.iter().map(ring).collect() };
        let polygons = crown.polygons.iter().map(|p| polygon(&p.rings));
        let geometry = ("MultiPolygon", polygons.collect());
        Some(self::feature(&properties, geometry))
    };
    frame.collection(crowns.iter().zip(1..).filter_map(feature))
}

/// The feet of trees as points, with what is known of them.
#[must_use]
pub fn stems_geojson(trees: &[TreeRecord], frame: &MapFrame) -> String {
    let feature = |tree: &TreeRecord| {
        let place = frame.place(tree.position_m);
        feature(&properties(tree), ("Point", place[..].into()))
    };
    frame.collection(trees.iter().map(feature))
}

/// What is known of a tree. Its id is text, as many readers have no whole numbers of 64 bits.
fn properties(tree: &TreeRecord) -> Value {
    json!({
        "id": tree.object.to_u64().to_string(),
        "species": tree.species,
        "dbh_m": tree.dbh_m,
        "height_m": tree.height_m,
        "crown_base_m": tree.crown_base_m,
        "crown_radius_m": tree.crown_radius_m,
        "stem_volume_m3": tree.stem_volume_m3,
        "wood_volume_m3": tree.wood_volume_m3,
        "merchantable_volume_m3": tree.merchantable_volume_m3,
        "alive": tree.alive,
        "field_id": tree.field_id,
    })
}

fn feature(properties: &Value, (kind, coordinates): (&str, Value)) -> Value {
    json!({
        "type": "Feature",
        "properties": properties,
        "geometry": { "type": kind, "coordinates": coordinates },
    })
}

impl MapFrame {
    /// A place of the world on the map, to the millimetre.
    fn place(&self, world_m: DVec3) -> [f64; 3] {
        let place_m = world_m + self.origin_m;
        place_m.to_array().map(|m| (m * 1e3).round() / 1e3)
    }

    /// The text of features, each of which is written as soon as it is made.
    fn collection(&self, features: impl Iterator<Item = Value>) -> String {
        let mut text = r#"{"type":"FeatureCollection","#.to_owned();
        if let Some(epsg) = self.epsg {
            let name = format!("urn:ogc:def:crs:EPSG::{epsg}");
            let crs = json!({ "type": "name", "properties": { "name": name } });
            text += &format!(r#""crs":{crs},"#);
        }
        text += r#""features":["#;
        for (i, feature) in features.enumerate() {
            let before = if i > 0 { ",\n" } else { "\n" };
            text += &format!("{before}{feature}");
        }
        text + "\n]}\n"
    }
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
