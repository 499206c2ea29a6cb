//! What the colour pass reads of the light: a record, and tables over directions and grids.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::cascade::Cascade;
use super::lighting::{LightingInputs, LightingPass};
use crate::Lighting;
use crate::sky::haze::Haze;

// These must equal the constants of `lighting.wgsl`.
pub(super) const CASCADES: usize = 4;
const SKY_SIDE: usize = 128;
const AMBIENT_SIDE: usize = 16;
const OPENNESS_STEPS: usize = 32;
const GRID_SIDE: usize = 64;
const GRID_UP: usize = 32;

/// Nodes along a side of the near and the wide grid of ground occlusion, and their distances,
/// metres.
const GROUND_SIDE: usize = 512;
const GROUND_STEPS_M: [f32; 2] = [1.0 / 6.0, 0.8];

/// `Light` in `lighting.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct LightRecord {
    sun: [f32; 4],
    irradiance: [f32; 4],
    air: [f32; 4],
    cascades: [[[f32; 4]; 4]; CASCADES],
    ends: [f32; 4],
    texels: [f32; 4],
    near_grid: [f32; 4],
    far_grid: [f32; 4],
    up_and_fog: [f32; 4],
    ground_grids: [f32; 4],
}

impl LightingPass {
    pub(super) fn light(
        &self,
        haze: &Haze,
        inputs: &LightingInputs<'_>,
        ground_corners: [Vec2; 2],
    ) -> (LightRecord, Vec<f32>) {
        let lighting = inputs.lighting;
        let camera = inputs.view.scene_from_camera.translation_m.as_vec3();
        let visibility = inputs.scene.sky_visibility;
        let range_m = haze.range_m;
        // Node steps across and up, and how many layers lie below the camera.
        let far = 2.0 * range_m / (GRID_SIDE - 1) as f32;
        let grids = [(1.5, 1.5, 10.0), (far, 4.0, 14.0)];
        let corner = |(step, up, below): (f32, f32, f32)| {
            let half = 0.5 * step * (GRID_SIDE - 1) as f32;
            Vec3::new(-half, -half, -up * below)
        };
        let nodes = GRID_SIDE * GRID_SIDE * GRID_UP;
        let sky_view_factor = (0..2 * nodes)
            .into_par_iter()
            .map(|i| {
                let grid = grids[i / nodes];
                let (x, y, z) = (
                    i % GRID_SIDE,
                    i / GRID_SIDE % GRID_SIDE,
                    i % nodes / (GRID_SIDE * GRID_SIDE),
                );
                let at = Vec3::new(x as f32 * grid.0, y as f32 * grid.0, z as f32 * grid.1);
                visibility.sky_view_factor(camera + corner(grid) + at)
            })
            .collect();
        let of = |f: fn(&Cascade) -> f64| std::array::from_fn(|k| f(&inputs.cascades[k]) as f32);
        let focal_px = 0.5 * (inputs.view.intrinsics.fx + inputs.view.intrinsics.fy);
        let [near, far] = grids.map(|g| corner(g).extend(g.0).to_array());
        let record = LightRecord {
            sun: lighting
                .sun_direction()
                .extend((1.0 / focal_px) as f32)
                .to_array(),
            irradiance: lighting
                .sun_irradiance()
                .extend(self.backdrop.scale)
                .to_array(),
            air: [
                haze.air.extinction,
                haze.air.height_m,
                range_m,
                visibility.sky_view_factor(camera),
            ],
            cascades: std::array::from_fn(|k| inputs.cascades[k].clip().to_cols_array_2d()),
            ends: of(|c| c.end_m),
            texels: of(Cascade::texel_m),
            near_grid: near,
            far_grid: far,
            up_and_fog: [
                grids[0].1,
                grids[1].1,
                haze.fog.extinction,
                haze.fog.height_m,
            ],
            ground_grids: {
                let [near, wide] = ground_corners.map(|corner| corner - camera.truncate());
                [near.x, near.y, wide.x, wide.y]
            },
        };
        (record, sky_view_factor)
    }
}

/// The corners of the grids of ground occlusion around the camera, in the scene. They are halves of
/// steps from whole ones, as the middles of the cells of maps are, so that the near grid has the
/// maps' own values wherever the camera is.
pub(super) fn ground_corners(inputs: &LightingInputs<'_>) -> [Vec2; 2] {
    let camera = inputs.view.scene_from_camera.translation_m.as_vec3();
    GROUND_STEPS_M.map(|step_m| {
        let middle = (camera.truncate() / step_m).floor();
        (middle - (GROUND_SIDE / 2) as f32 + 0.5) * step_m
    })
}

/// The ground occlusion around the camera: rows from the south of the near grid, then of the wide
/// one.
pub(super) fn ground_occlusion(inputs: &LightingInputs<'_>, corners: [Vec2; 2]) -> Vec<f32> {
    let visibility = inputs.scene.sky_visibility;
    let height_m = inputs.view.scene_from_camera.translation_m.z as f32;
    let nodes = GROUND_SIDE * GROUND_SIDE;
    (0..2 * nodes)
        .into_par_iter()
        .map(|i| {
            let (grid, node) = (i / nodes, i % nodes);
            let node = Vec2::new((node % GROUND_SIDE) as f32, (node / GROUND_SIDE) as f32);
            let at = corners[grid] + node * GROUND_STEPS_M[grid];
            visibility.ground_occlusion(at.extend(height_m))
        })
        .collect()
}

/// The light in tables over octahedral maps: background radiance, then irradiance by sky view
/// factor.
pub(super) fn tables(lighting: &Lighting, haze: &Haze) -> Vec<[f32; 4]> {
    let direction = |i: usize, side: usize| -> Vec3 {
        let at = Vec2::new((i % side) as f32, (i / side) as f32) / (side - 1) as f32;
        unfold(at * 2.0 - Vec2::ONE)
    };
    let sky = (0..SKY_SIDE * SKY_SIDE).map(|i| lighting.background(haze, direction(i, SKY_SIDE)));
    let ambient = (0..=OPENNESS_STEPS).flat_map(|step| {
        let ambient = lighting.ambient(step as f32 / OPENNESS_STEPS as f32);
        (0..AMBIENT_SIDE * AMBIENT_SIDE)
            .map(move |i| ambient.irradiance(direction(i, AMBIENT_SIDE)))
    });
    sky.chain(ambient)
        .map(|c| c.extend(0.0).to_array())
        .collect()
}

/// The unit vector of a point of the octahedral square, −1..=1.
fn unfold(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let p = if z >= 0.0 {
        p
    } else {
        Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    };
    // Its length is at least 1 / sqrt 3.
    let n = p.extend(z);
    n / n.length()
}
