//! Maps, crowns and profiles against closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use nemoral_mensuration::{
    AreaProfile, CanopyCell, CanopyMaps, CanopyScene, CellRays, MapFrame, MapGrid, PlotCanopy,
    ShapeAreas, crowns_geojson, profile_csv, stems_geojson, visible_crowns,
};
use nemoral_scene::glam::{DVec2, DVec3, Mat3, Quat, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Card, ChunkCoord, Hit, Instance, InstancePlace, Material, MaterialId,
    MaterialLibrary, Mesh, ObjectId, Prototype, Ray, RayCaster, Semantic, TextureWindow, Triangle,
};
use proptest::prelude::*;

fn id(item: u16) -> ObjectId {
    ObjectId::new(ChunkCoord::new(0, 0), item).expect("in range")
}

/// Cones over an even ground that rises to the east, in a scene around (100, 200, 10) of the world.
struct Cones {
    slope: f32,
    cones: Vec<(ObjectId, Vec2, f32, f32)>,
}

const ORIGIN_M: DVec3 = DVec3::new(100.0, 200.0, 10.0);

impl RayCaster for Cones {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        assert_eq!(ray.direction, Vec3::NEG_Z);
        let at = ray.origin.truncate();
        let tip = |&(object, middle, radius_m, height_m): &(ObjectId, Vec2, f32, f32)| {
            let inside = 1.0 - at.distance(middle) / radius_m;
            (inside > 0.0).then_some((object, LEAF, inside * height_m))
        };
        let mut highest = (ObjectId::NONE, SOIL, 0.0);
        for (object, material, height_m) in self.cones.iter().filter_map(tip) {
            if height_m > highest.2 {
                highest = (object, material, height_m);
            }
        }
        let (object, material, height_m) = highest;
        let distance_m = ray.origin.z - height_m - self.slope * at.x;
        Some(Hit::new(distance_m, Vec3::Z, material).with_object(object))
    }
}

impl Cones {
    fn maps(&self, grid: MapGrid, per_side: usize) -> CanopyMaps {
        let slope = f64::from(self.slope);
        let ground_m = move |place: DVec2| 10.0 + slope * (place.x - ORIGIN_M.x);
        let materials = library();
        let scene = CanopyScene {
            caster: self,
            materials: &materials,
            origin_m: ORIGIN_M,
            above_m: 60.0,
            ground_m: &ground_m,
        };
        CanopyMaps::cast(
            &scene,
            grid,
            CellRays::per_side(per_side).expect("in range"),
        )
    }
}

#[test]
fn a_cone_is_as_high_as_its_formula_and_covers_its_circle() {
    let low = ORIGIN_M.truncate();
    let grid = MapGrid::of(low, low + 12.0, 0.25).expect("whole");
    for slope in [0.0, 0.5] {
        let cone = (id(7), Vec2::new(5.0, 6.0), 4.0, 20.0);
        let maps = Cones {
            slope,
            cones: vec![cone],
        }
        .maps(grid, 5);
        // Above 2 m is what is nearer to the middle than 0.9 of the radius.
        let wanted = PI * (0.9 * 4.0_f64).powi(2) / 144.0;
        assert!(
            (maps.cover() - wanted).abs() < 1e-3,
            "{}: {wanted}",
            maps.cover()
        );
        for (number, cell) in maps.cells.iter().enumerate() {
            let place = grid.middle_m(number) - low;
            let away_m = place.distance(DVec2::new(5.0, 6.0));
            // The nearest ray of a cell is at most half a diagonal nearer than its middle.
            let at = |m: f64| 20.0 * (1.0 - m / 4.0).max(0.0);
            let range = at(away_m) - 1e-4..=at((away_m - 0.18).max(0.0)) + 1e-4;
            assert!(range.contains(&cell.height_m), "{place}: {cell:?}");
            let ground_m = 10.0 + f64::from(slope) * place.x;
            assert!((cell.ground_m - ground_m).abs() < 1e-9);
            // A slope is no canopy.
            assert!(
                away_m < 4.2 || (cell.height_m, cell.cover, cell.top) == (0.0, 0.0, ObjectId::NONE)
            );
            assert!(cell.surface_m >= cell.ground_m && cell.surface_m <= ground_m + 20.1);
            assert_eq!(cell.top.is_none(), cell.height_m < 2.0, "{cell:?}");
        }
        let crowns = visible_crowns(&maps);
        assert_eq!(crowns.len(), 1);
        // Cells at the rim count whole.
        let circle = PI * 3.6 * 3.6;
        assert!(
            (circle..circle * 1.1).contains(&crowns[0].area_m2),
            "{}",
            crowns[0].area_m2
        );
    }
}

#[test]
fn cells_do_not_depend_on_blocks() {
    let low = ORIGIN_M.truncate();
    let grid = MapGrid::of(low, low + 40.0, 0.5).expect("whole");
    let cone = (id(7), Vec2::new(15.0, 26.0), 9.0, 20.0);
    let cones = Cones {
        slope: 0.1,
        cones: vec![cone],
    };
    // Blocks of 16 cells, and a map of one cell at its place.
    let maps = cones.maps(grid, 32);
    for number in [0, 17, 3_211, 4_190, 6_399] {
        let corner = grid.corner_m(number);
        let alone = MapGrid::of(corner, corner + 0.5, 0.5).expect("whole");
        assert_eq!(cones.maps(alone, 32).cells[0], maps.cells[number]);
    }
}

#[test]
fn grids_are_whole_cells() {
    let grid = MapGrid::of(DVec2::new(-1.0, 2.0), DVec2::new(2.0, 3.0), 0.1).expect("whole");
    assert_eq!((grid.columns, grid.rows), (30, 10));
    assert!((grid.area_m2() - 3.0).abs() < 1e-12);
    assert_eq!(grid.cell_at(DVec2::new(-1.0, 2.0)), Some(0));
    assert_eq!(grid.cell_at(grid.middle_m(97)), Some(97));
    assert_eq!(grid.from_north(|n| n)[..2], [270, 271]);
    assert_eq!(grid.cell_at(DVec2::new(2.0, 2.5)), None);
    assert_eq!(grid.cell_at(DVec2::new(0.0, 1.999)), None);
    assert!(CellRays::per_side(0).is_err() && CellRays::per_side(33).is_err());
    for (high, cell_m) in [
        (DVec2::new(1.0, 1.0), 0.3),
        (DVec2::new(-1.0, 1.0), 0.5),
        (DVec2::new(f64::NAN, 1.0), 0.5),
        (DVec2::new(f64::INFINITY, 1.0), 0.5),
        (DVec2::splat(1e6), 0.5),
        (DVec2::new(7000.0, 1.0), 0.1),
        (DVec2::splat(1e-3), 1e-3),
        (DVec2::ONE, 0.0),
        (DVec2::ONE, f64::NAN),
    ] {
        assert!(
            MapGrid::of(DVec2::ZERO, high, cell_m).is_err(),
            "{high} {cell_m}"
        );
    }
}

#[test]
fn plots_have_the_cells_whose_middles_are_in_them() {
    let cell = |height_m: f64, cover: f64| CanopyCell {
        ground_m: 0.0,
        surface_m: height_m,
        height_m,
        cover,
        top: ObjectId::NONE,
    };
    let grid = MapGrid::of(DVec2::ZERO, DVec2::new(4.0, 2.0), 1.0).expect("whole");
    let heights = [8.0, 1.0, 0.0, 0.0, 2.0, 4.0, 0.0, 0.0];
    let cells = heights.map(|h| cell(h, if h >= 2.0 { 0.5 } else { 0.0 }));
    let maps = CanopyMaps {
        grid,
        cells: cells.to_vec(),
    };
    let plots = MapGrid::of(DVec2::ZERO, DVec2::new(6.0, 2.0), 2.0).expect("whole");
    let found = PlotCanopy::of_plots(&maps, &plots);
    let wanted = PlotCanopy {
        cover: 0.375,
        cells: 0.75,
        mean_m: 3.75,
        percentiles_m: [2.0, 8.0],
        highest_m: 8.0,
    };
    assert_eq!(found[0], Some(wanted));
    assert_eq!(
        found[1].map(|plot| (plot.cover, plot.highest_m)),
        Some((0.0, 0.0))
    );
    assert_eq!(found[2], None);
}

/// A map of cells whose heights and covers differ from cell to cell.
fn rough_map(grid: MapGrid) -> CanopyMaps {
    let cell = |number: usize| {
        let height_m = (number * 37 % 101) as f64 * 0.3;
        CanopyCell {
            ground_m: 0.0,
            surface_m: height_m,
            height_m,
            cover: (number * 53 % 89) as f64 / 89.0,
            top: ObjectId::NONE,
        }
    };
    CanopyMaps {
        grid,
        cells: (0..grid.cells()).map(cell).collect(),
    }
}

proptest! {
    /// Whatever the circle, inside of the map or beyond it.
    #[test]
    fn circles_have_the_cells_whose_middles_are_near_enough(
        x in -12.0..12.0_f64,
        y in -9.0..9.0_f64,
        radius_m in 0.1..9.0_f64,
    ) {
        let low_m = DVec2::new(-8.0, -5.0);
        let grid = MapGrid::of(low_m, DVec2::new(7.0, 6.0), 0.5).expect("whole");
        let maps = rough_map(grid);
        let centre_m = DVec2::new(x, y);
        let is_near = |at_m: DVec2| at_m.distance(centre_m) <= radius_m;
        let found = PlotCanopy::of_part(&maps, [centre_m - radius_m, centre_m + radius_m], is_near);
        let inside: Vec<CanopyCell> = (0..grid.cells())
            .filter(|&number| is_near(grid.middle_m(number)))
            .map(|number| maps.cells[number])
            .collect();
        prop_assert_eq!(found.is_some(), !inside.is_empty());
        if let Some(found) = found {
            let mean = |of: &dyn Fn(&CanopyCell) -> f64| {
                inside.iter().map(of).sum::<f64>() / inside.len() as f64
            };
            prop_assert!((found.cover - mean(&|c| c.cover)).abs() < 1e-12);
            prop_assert!((found.mean_m - mean(&|c| c.height_m)).abs() < 1e-12);
            let high = mean(&|c| f64::from(u8::from(c.height_m >= 2.0)));
            prop_assert!((found.cells - high).abs() < 1e-12);
            let highest_m = inside.iter().map(|c| c.height_m).fold(0.0, f64::max);
            prop_assert_eq!(found.highest_m, highest_m);
        }
    }
}

#[test]
fn a_part_of_the_shape_of_a_square_is_the_square() {
    let grid = MapGrid::of(DVec2::ZERO, DVec2::new(6.0, 4.0), 0.5).expect("whole");
    let maps = rough_map(grid);
    let plots = MapGrid::of(DVec2::ZERO, DVec2::new(6.0, 4.0), 2.0).expect("whole");
    for (number, square) in PlotCanopy::of_plots(&maps, &plots).into_iter().enumerate() {
        let low_m = plots.corner_m(number);
        let high_m = low_m + plots.cell_m;
        let part = PlotCanopy::of_part(&maps, [low_m, high_m], |at_m| {
            at_m.cmpge(low_m).all() && at_m.cmplt(high_m).all()
        });
        assert!(square.is_some());
        assert_eq!(part, square);
    }
}

/// The area of a polygon by the shoelace formula.
fn ring_m2(ring: &[DVec2]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    0.5 * ring
        .iter()
        .zip(next)
        .map(|(a, b)| a.perp_dot(*b))
        .sum::<f64>()
}

/// Whether a place is inside of a ring, by the crossings of a ray to the east.
fn surrounds(ring: &[DVec2], place: DVec2) -> bool {
    let next = ring.iter().cycle().skip(1);
    let crosses = |(a, b): (&DVec2, &DVec2)| {
        (a.y > place.y) != (b.y > place.y)
            && place.x < a.x + (place.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    ring.iter().zip(next).filter(|&edge| crosses(edge)).count() % 2 == 1
}

proptest! {
    /// Polygons have the cells of their object and no others, whatever the map.
    #[test]
    fn polygons_are_the_cells_of_their_crowns(
        columns in 1..9_usize,
        labels in prop::collection::vec(0..4_u16, 1..80),
    ) {
        let rows = labels.len().div_ceil(columns);
        let grid = MapGrid { south_west_m: DVec2::new(3.0, -2.0), cell_m: 0.5, columns, rows };
        let tops: Vec<ObjectId> = (0..columns * rows)
            .map(|i| labels.get(i).filter(|l| **l > 0).map_or(ObjectId::NONE, |&l| id(l)))
            .collect();
        let cell = |&top: &ObjectId| CanopyCell {
            ground_m: 0.0,
            surface_m: 5.0,
            height_m: 5.0,
            cover: 1.0,
            top,
        };
        let maps = CanopyMaps { grid, cells: tops.iter().map(cell).collect() };
        let crowns = visible_crowns(&maps);
        for crown in &crowns {
            let mut total_m2 = 0.0;
            for polygon in &crown.polygons {
                for (i, ring) in polygon.rings.iter().enumerate() {
                    // The border turns left, holes turn right, and no corner comes twice.
                    prop_assert_eq!(ring_m2(ring) > 0.0, i == 0);
                    let bits = ring.iter().map(|c| c.to_array().map(f64::to_bits));
                    let mut corners: Vec<_> = bits.collect();
                    corners.sort_unstable();
                    corners.dedup();
                    prop_assert_eq!(corners.len(), ring.len());
                    total_m2 += ring_m2(ring);
                }
            }
            prop_assert!((total_m2 - crown.area_m2).abs() < 1e-9);
        }
        for row in 0..rows {
            for column in 0..columns {
                let place = grid.middle_m(row * columns + column);
                let owners: Vec<ObjectId> = crowns.iter().flat_map(|crown| {
                    let is_inside = |rings: &[Vec<DVec2>]| {
                        let mut holes = rings[1..].iter();
                        surrounds(&rings[0], place) && !holes.any(|r| surrounds(r, place))
                    };
                    let inside = crown.polygons.iter().filter(|p| is_inside(&p.rings));
                    inside.map(|_| crown.object).collect::<Vec<_>>()
                }).collect();
                let top = tops[row * columns + column];
                let wanted = if top.is_none() { vec![] } else { vec![top] };
                prop_assert_eq!(owners, wanted);
            }
        }
    }
}

#[test]
fn crowns_of_trees_are_features_with_closed_rings() {
    let cones = Cones {
        slope: 0.0,
        cones: vec![
            (id(1), Vec2::new(3.0, 3.0), 2.0, 9.0),
            (id(2), Vec2::new(5.0, 3.0), 2.0, 6.0),
        ],
    };
    let low = ORIGIN_M.truncate();
    let grid = MapGrid::of(low, low + 8.0, 0.5).expect("whole");
    let crowns = visible_crowns(&cones.maps(grid, 2));
    let tree = nemoral_scene::TreeRecord {
        object: id(2),
        species: "beech".to_owned(),
        position_m: DVec3::new(1.5, 0.0, 0.0),
        dbh_m: 0.2,
        height_m: 6.0,
        crown_base_m: 1.0,
        crown_radius_m: 2.0,
        leaf_area_m2: 20.0,
        stem_volume_m3: 0.1,
        wood_volume_m3: Some(0.12),
        merchantable_volume_m3: None,
        lean_rad: 0.0,
        age_class: "young".to_owned(),
        alive: true,
        field_id: "B7".to_owned(),
    };
    let frame = MapFrame {
        origin_m: DVec3::new(5e5, 5e6, 300.0),
        epsg: Some(25_832),
    };
    let text = crowns_geojson(&crowns, std::slice::from_ref(&tree), &frame);
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let features = json["features"].as_array().expect("features");
    // The other is no tree of the list.
    assert_eq!(features.len(), 1);
    assert_eq!(features[0]["properties"]["field_id"], "B7");
    assert_eq!(features[0]["properties"]["wood_volume_m3"], 0.12);
    assert!(features[0]["properties"]["merchantable_volume_m3"].is_null());
    assert_eq!(
        json["crs"]["properties"]["name"],
        "urn:ogc:def:crs:EPSG::25832"
    );
    let ring = features[0]["geometry"]["coordinates"][0][0]
        .as_array()
        .expect("a ring");
    assert_eq!(ring.first(), ring.last());
    let x = ring[0][0].as_f64().expect("a number");
    assert!((5e5 + 100.0..5e5 + 108.0).contains(&x), "{x}");
    // Its number is that among all crowns.
    assert_eq!(features[0]["properties"]["crown"], 2);
    assert_eq!(features[0]["properties"]["id"], id(2).to_u64().to_string());
    let text = stems_geojson(
        &[tree],
        &MapFrame {
            epsg: None,
            ..frame
        },
    );
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let point = &json["features"][0]["geometry"];
    assert_eq!(
        point["coordinates"],
        serde_json::json!([5e5 + 1.5, 5e6, 300.0])
    );
    assert!(json.get("crs").is_none());
}

/// A library with a leaf whose mask is opaque in its left half, and bark.
fn library() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    let half = AlphaMask::from_fn(64, 64, |x, _| x < 32).expect("a mask");
    library.add(Material {
        mask: Some(Arc::new(half)),
        transmittance: Vec3::splat(0.2),
        ..Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.2))
    });
    library.add(Material::plain("bark", Semantic::Stem, Vec3::splat(0.2)));
    library.add(Material::plain("soil", Semantic::Soil, Vec3::splat(0.2)));
    for (below, name) in [(LEAF, "leaf.snow"), (BARK, "bark.snow")] {
        let cover = Material {
            name: name.to_owned(),
            albedo: Arc::clone(&library.get(SOIL).albedo),
            transmittance: Vec3::ZERO,
            ..library.get(below).clone()
        };
        library.add(cover);
    }
    library
}

const LEAF: MaterialId = MaterialId(0);
const BARK: MaterialId = MaterialId(1);
const SOIL: MaterialId = MaterialId(2);
const SNOW_ON_LEAF: MaterialId = MaterialId(3);
const SNOW_ON_BARK: MaterialId = MaterialId(4);

fn leaf_card(z: f32) -> Card {
    Card {
        corner: Vec3::new(0.0, 0.0, z),
        edge_u: Vec3::X,
        edge_v: Vec3::Y,
        material: LEAF,
    }
}

fn profile_of(shape: Prototype, place: InstancePlace) -> AreaProfile {
    let grid = MapGrid::of(DVec2::splat(-10.0), DVec2::splat(10.0), 1.0).expect("whole");
    let is_snow = |material: MaterialId| [SNOW_ON_LEAF, SNOW_ON_BARK].contains(&material);
    let areas = ShapeAreas::of(&shape, &library(), &is_snow);
    let mut profile = AreaProfile::new(0.5, &grid).expect("valid");
    let instance = Instance::new(Arc::new(shape), place);
    profile.add((&areas, &instance), DVec3::ZERO, (&grid, &|_| 2.0), 1.0);
    profile
}

#[test]
fn leaves_count_with_their_opaque_area_once_turned_and_stretched() {
    let shape = || {
        Prototype::new("twig", Mesh::default(), vec![leaf_card(0.0)], &library()).expect("sound")
    };
    let turn = Mat3::from_quat(Quat::from_euler(
        nemoral_scene::glam::EulerRot::XYZ,
        0.4,
        1.0,
        0.3,
    ));
    for (linear, factor) in [
        (Mat3::IDENTITY, 1.0),
        (turn, 1.0),
        (Mat3::from_diagonal(Vec3::new(2.0, 3.0, 9.0)), 6.0),
        (turn * Mat3::from_diagonal(Vec3::splat(2.0)), 4.0),
        // Sheared along the slope, a level card gets longer.
        (
            Mat3::from_cols(Vec3::new(1.0, 0.0, 1.0), Vec3::Y, Vec3::Z),
            2.0_f64.sqrt(),
        ),
    ] {
        let place = InstancePlace {
            linear,
            ..InstancePlace::at(Vec3::new(0.0, 0.0, 6.0))
        };
        let profile = profile_of(shape(), place);
        let sum: f64 = profile.leaf_m2.iter().sum();
        assert!((sum - 0.5 * factor).abs() < 1e-5, "{linear}: {sum}");
        assert!(profile.wood_m2.is_empty());
        assert!((profile.leaf_area_index() - sum / 400.0).abs() < 1e-12);
    }
    // 4 m above the ground is the ninth layer of half a metre.
    let profile = profile_of(shape(), InstancePlace::at(Vec3::new(0.0, 0.0, 6.0)));
    assert_eq!((profile.layers(), profile.leaf_m2[8]), (9, 0.5));
    assert_eq!(profile.densities_m2_m3(8), [0.5 / 400.0 / 0.5, 0.0]);
    let text = profile_csv(&profile);
    assert_eq!(text.lines().last(), Some("4,4.5,0.002500,0.000000"));
    // What is outside of the map does not count.
    assert_eq!(
        profile_of(shape(), InstancePlace::at(Vec3::new(10.0, 0.0, 6.0))).layers(),
        0
    );
}

#[test]
fn windows_and_triangles_have_the_share_of_their_part_of_the_mask() {
    let window =
        |low: f32, high: f32| TextureWindow::rectangle(Vec2::new(low, 0.0), Vec2::new(high, 1.0));
    for (window, share) in [
        (window(0.0, 0.5), 1.0),
        (window(0.5, 1.0), 0.0),
        (window(0.25, 0.75), 0.5),
    ] {
        let shape = Prototype::new("twig", Mesh::default(), vec![leaf_card(1.0)], &library())
            .and_then(|p| p.with_card_windows(vec![window]))
            .expect("sound");
        let profile = profile_of(shape, InstancePlace::at(Vec3::new(0.0, 0.0, 2.0)));
        let sum: f64 = profile.leaf_m2.iter().sum();
        assert!((sum - share).abs() < 5e-3, "{window:?}: {sum}");
    }
    // Half of a square, of which the left half of the square is opaque: three quarters of it.
    let triangle = |material, positions: [Vec3; 3]| Mesh {
        positions: positions.to_vec(),
        uvs: positions.map(|p| p.truncate()).to_vec(),
        triangles: vec![Triangle {
            corners: [0, 1, 2],
            material,
        }],
        ..Mesh::default()
    };
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    for (material, leaf, wood) in [(LEAF, 0.5 * 0.75, 0.0), (BARK, 0.0, 0.25), (SOIL, 0.0, 0.0)] {
        let shape = Prototype::new("part", triangle(material, corners), Vec::new(), &library());
        let profile = profile_of(
            shape.expect("sound"),
            InstancePlace::at(Vec3::new(0.0, 0.0, 2.0)),
        );
        let [found_leaf, found_wood] =
            [&profile.leaf_m2, &profile.wood_m2].map(|a| a.iter().sum::<f64>());
        assert!((found_leaf - leaf).abs() < 0.02, "{found_leaf}");
        assert!((found_wood - wood).abs() < 1e-6, "{found_wood}");
    }
}

/// Snow on a leaf is a second card, with the leaf's mask and semantic; on wood it is the material
/// of the wood's own triangles.
#[test]
fn snow_is_no_leaf_and_hides_no_wood() {
    let cover = Card {
        material: SNOW_ON_LEAF,
        ..leaf_card(0.02)
    };
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].to_vec();
    let wood = |material| Mesh {
        positions: corners.clone(),
        triangles: vec![Triangle {
            corners: [0, 1, 2],
            material,
        }],
        ..Mesh::default()
    };
    for (cards, mesh) in [
        (vec![leaf_card(0.0)], wood(BARK)),
        (vec![leaf_card(0.0), cover], wood(SNOW_ON_BARK)),
    ] {
        let shape = Prototype::new("twig", mesh, cards, &library()).expect("sound");
        let profile = profile_of(shape, InstancePlace::at(Vec3::new(0.0, 0.0, 4.1)));
        let [leaf, wood] = [&profile.leaf_m2, &profile.wood_m2].map(|a| a.iter().sum::<f64>());
        assert!((leaf - 0.5).abs() < 1e-6, "{leaf}");
        assert!((wood - 0.25).abs() < 1e-6, "{wood}");
    }
}

#[test]
fn profiles_of_parts_join() {
    let card =
        |z| Prototype::new("twig", Mesh::default(), vec![leaf_card(z)], &library()).expect("sound");
    let at = InstancePlace::at(Vec3::new(0.0, 0.0, 2.0));
    let (low, high) = (profile_of(card(0.6), at), profile_of(card(1.2), at));
    let mut all = low.clone();
    all.join(&high);
    assert_eq!(all.leaf_m2, vec![0.0, 0.5, 0.5]);
    let mut other = high;
    other.join(&low);
    assert_eq!(all, other);
    // A card that stands is spread over the heights that it spans, and not below the ground.
    let turned = |z| InstancePlace {
        linear: Mat3::from_quat(Quat::from_rotation_x(std::f32::consts::FRAC_PI_2)),
        ..InstancePlace::at(Vec3::new(0.0, 0.0, z))
    };
    let standing = profile_of(card(0.0), turned(2.25));
    for (layer, area_m2) in [0.125, 0.25, 0.125].into_iter().enumerate() {
        assert!(
            (standing.leaf_m2[layer] - area_m2).abs() < 1e-6,
            "{standing:?}"
        );
    }
    let sunk: f64 = profile_of(card(0.0), turned(1.6)).leaf_m2.iter().sum();
    assert!((sunk - 0.5 * 0.6).abs() < 1e-6, "{sunk}");
    assert_eq!(profile_of(card(0.0), turned(0.9)).layers(), 0);
    let grid = MapGrid::of(DVec2::ZERO, DVec2::ONE, 1.0).expect("whole");
    assert!(AreaProfile::new(0.0, &grid).is_err() && AreaProfile::new(f64::NAN, &grid).is_err());
}
