//! The interface of passes, which write something else than colours for every surface.

use nemoral_scene::MaterialLibrary;

/// A replacement shader: every surface of the scene, drawn with four numbers in place of its
/// colour.
///
/// A pass is drawn with one sample at each pixel's centre, over the same surfaces as the truth;
/// nothing is blended or filtered. Its WGSL defines
///
/// ```wgsl
/// fn paint(s: Surface) -> vec4u
/// ```
///
/// where nothing is hit, four zeros are written. A `Surface` has
///
/// | field | |
/// |---|---|
/// | `material: u32` | index in the library |
/// | `semantic: u32` | [`Semantic`](nemoral_scene::Semantic) as a number |
/// | `instance: u32` | number of the instance among the scene's, from 0 |
/// | `variation: f32` | the instance's, 0..1 |
/// | `depth_m: f32` | planar depth |
/// | `distance_m: f32` | from the camera |
/// | `ray: vec3f` | unit, from the camera, scene axes |
/// | `point: vec3f` | relative to the camera, scene axes, metres |
/// | `normal: vec3f` | unit, flat, towards the camera, scene axes |
/// | `shading_normal: vec3f` | unit, interpolated, on the same side |
/// | `uv: vec2f`, `uv_per_m: f32` | texture coordinate |
///
/// and `table: array<u32>` holds what [`table`](Self::table) gives.
pub trait Pass: std::fmt::Debug + Send + Sync {
    /// A name for error messages.
    fn name(&self) -> &str;

    /// WGSL that defines `paint`, and everything that it needs.
    fn wgsl(&self) -> &str;

    /// Numbers for the shader, such as one for each material.
    fn table(&self, materials: &MaterialLibrary) -> Vec<u32>;
}

/// Class, instance, planar depth and normal.
#[derive(Debug)]
pub(crate) struct TruthPass;

impl Pass for TruthPass {
    fn name(&self) -> &'static str {
        "truth"
    }

    fn wgsl(&self) -> &'static str {
        include_str!("shaders/truth.wgsl")
    }

    fn table(&self, _: &MaterialLibrary) -> Vec<u32> {
        Vec::new()
    }
}
