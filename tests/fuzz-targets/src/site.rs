//! The files of a user's own site, and models.

use nemoral_import::{
    HeightMap, HeightPngSidecar, ImportError, MAX_LINES, MAX_POSTS, MAX_STEMS, MAX_TRIANGLES,
    MAX_VERTICES, Model, ModelFiles, ModelKind, read_stem_map, read_trail_lines,
};
use nemoral_scene::MaterialLibrary;

/// The greatest length of an error message. That of a model lists materials and semantics.
const MESSAGE_BYTES: usize = 1 << 12;

/// What was read, if the message of an error is short.
fn accepted<T>(read: Result<T, ImportError>) -> Option<T> {
    read.inspect_err(|e| {
        let length = e.to_string().len();
        assert!(length <= MESSAGE_BYTES, "a message of {length} bytes");
    })
    .ok()
}

/// Reads a stem map.
pub fn stem_map(input: &[u8]) {
    if let Some(stems) = accepted(read_stem_map(input)) {
        assert!((1..=MAX_STEMS).contains(&stems.len()));
        for stem in stems {
            assert!(stem.x_m.is_finite() && stem.y_m.is_finite(), "{stem:?}");
            assert!(
                stem.dbh_m.is_none_or(|d| (0.004..6.0).contains(&d)),
                "{stem:?}"
            );
        }
    }
}

/// Reads trail lines.
pub fn trail_lines(input: &[u8]) {
    if let Some(trails) = accepted(read_trail_lines(input)) {
        let lines = trails.lines;
        assert!((1..=MAX_LINES).contains(&lines.len()));
        let vertices: usize = lines.iter().map(|line| line.vertices_m.len()).sum();
        assert!(vertices <= MAX_VERTICES && lines.iter().all(|l| l.vertices_m.len() > 1));
    }
}

/// Reads a GeoTIFF.
pub fn geotiff(input: &[u8]) {
    check(accepted(HeightMap::from_tiff(input)));
}

/// Reads a sidecar, a line feed, and a PNG.
pub fn height_png(input: &[u8]) {
    let end = input
        .iter()
        .position(|&b| b == b'\n')
        .unwrap_or(input.len());
    let (json, png) = input.split_at(end);
    if let Some(sidecar) = accepted(HeightPngSidecar::read(json)) {
        check(accepted(HeightMap::from_png(
            png.get(1..).unwrap_or_default(),
            &sidecar,
        )));
    }
}

/// Reads a model as glTF, or an archive of one.
pub fn gltf(input: &[u8]) {
    model("model.glb", input);
}

/// Reads a model as OBJ, or an archive of one.
pub fn obj(input: &[u8]) {
    model("model.obj", input);
}

fn model(name: &str, input: &[u8]) {
    let files = ModelFiles::gather(name, input.to_vec(), &mut |_, _| Ok(None));
    let Some(files) = accepted(files) else {
        return;
    };
    for kind in [ModelKind::Tree, ModelKind::Rock] {
        let Some(model) = accepted(Model::read(&files, kind)) else {
            continue;
        };
        assert!((1..=MAX_TRIANGLES).contains(&model.mesh.triangles.len()));
        assert!(model.extent.height_m.is_finite() && model.extent.radius_m.is_finite());
        if let Some(tree) = &model.tree {
            assert!((0.005..=5.0).contains(&tree.dbh_m), "{tree:?}");
            assert!(tree.stem_volume_m3.is_finite() && tree.leaf_area_m2.is_finite());
        }
        let shape = model.prototype("model", &mut MaterialLibrary::new());
        assert!(shape.is_ok(), "{shape:?}");
    }
    if let Ok(archive) = files.to_tar() {
        let again = ModelFiles::gather("x", archive, &mut |_, _| Ok(None));
        assert_eq!(again, Ok(files));
    }
}

fn check(map: Option<HeightMap>) {
    if let Some(map) = map {
        assert!(map.heights_m.len() == map.columns * map.rows && map.heights_m.len() <= MAX_POSTS);
        let is_sound = |h: &f32| h.is_nan() || (-1e3..=1e4).contains(h);
        assert!(map.heights_m.iter().all(is_sound));
    }
}
