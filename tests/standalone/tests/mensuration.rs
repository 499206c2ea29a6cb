//! Use of `nemoral-mensuration` alone: a stand of another simulator, measured per hectare and from
//! above, by rays that a function casts.

use std::error::Error;

use nemoral_mensuration::{
    CanopyMaps, CanopyScene, CellRays, MapFrame, MapGrid, Plot, StandMeasures, StandRow,
    crowns_geojson, stand_csv, visible_crowns,
};
use nemoral_scene::glam::{DVec2, DVec3, Vec2, Vec3};
use nemoral_scene::{
    ChunkCoord, Hit, Material, MaterialId, MaterialLibrary, ObjectId, Ray, RayCaster, Semantic,
    TreeRecord,
};

/// Trees with crowns like parasols, on level ground at 0.
struct Parasols {
    trees: Vec<TreeRecord>,
    leaf: MaterialId,
    soil: MaterialId,
}

impl RayCaster for Parasols {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let over = |tree: &&TreeRecord| {
            let foot: Vec2 = tree.position_m.truncate().as_vec2();
            f64::from(foot.distance(ray.origin.truncate())) < tree.crown_radius_m
        };
        let standing = self.trees.iter().filter(over);
        let highest = standing.max_by(|a, b| a.height_m.total_cmp(&b.height_m));
        let ground = (0.0, self.soil, ObjectId::NONE);
        let (height_m, material, object) =
            highest.map_or(ground, |tree| (tree.height_m, self.leaf, tree.object));
        let hit = Hit::new(ray.origin.z - height_m as f32, -ray.direction, material);
        Some(hit.with_object(object))
    }
}

fn tree(item: u16, x_m: f64, dbh_m: f64, height_m: f64) -> TreeRecord {
    TreeRecord {
        object: ObjectId::new(ChunkCoord::new(0, 0), item).expect("in range"),
        species: "umbrella_pine".to_owned(),
        position_m: DVec3::new(x_m, 10.0, 0.0),
        dbh_m,
        height_m,
        crown_base_m: height_m,
        crown_radius_m: 4.0,
        leaf_area_m2: 50.0,
        stem_volume_m3: 0.5,
        wood_volume_m3: None,
        merchantable_volume_m3: None,
        lean_rad: 0.0,
        age_class: "mature".to_owned(),
        alive: true,
        field_id: String::new(),
    }
}

#[test]
fn a_stand_is_measured() -> Result<(), Box<dyn Error>> {
    let mut materials = MaterialLibrary::new();
    let mut add = |name, semantic| materials.add(Material::plain(name, semantic, Vec3::splat(0.2)));
    let stand = Parasols {
        trees: vec![tree(1, 6.0, 0.4, 14.0), tree(2, 11.0, 0.3, 12.0)],
        leaf: add("leaf", Semantic::Leaf),
        soil: add("soil", Semantic::Soil),
    };
    let plot = Plot {
        area_m2: 400.0,
        min_dbh_m: 0.07,
        min_deadwood_diameter_m: 0.1,
    };
    let measures = StandMeasures::of(&stand.trees, &plot)?;
    assert_eq!(measures.trees_per_ha, 50.0);
    let row = StandRow {
        key: vec!["1".to_owned()],
        measures,
        more: vec![],
    };
    assert_eq!(stand_csv((&["plot"], &[]), &[row]).lines().count(), 2);
    let scene = CanopyScene {
        caster: &stand,
        materials: &materials,
        origin_m: DVec3::ZERO,
        above_m: 20.0,
        ground_m: &|_| 0.0,
    };
    let grid = MapGrid::of(DVec2::ZERO, DVec2::splat(20.0), 0.5)?;
    let maps = CanopyMaps::cast(&scene, grid, CellRays::per_side(3)?);
    let crowns = visible_crowns(&maps);
    // The higher crown hides a part of the lower one.
    assert!(crowns[0].area_m2 > 50.0 && crowns[1].area_m2 < 45.0);
    assert!(crowns_geojson(&crowns, &stand.trees, &MapFrame::default()).contains("umbrella_pine"));
    Ok(())
}
