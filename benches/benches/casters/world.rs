//! The worlds that rays are cast at.

use std::error::Error;
use std::sync::Arc;

use nemoral_benches::{Grown, config};
use nemoral_raycast::{Group, RayScene};
use nemoral_scene::MaterialLibrary;
use nemoral_scene::glam::{DMat3, Mat3, Vec3};

use crate::rays::Eye;
use crate::reference;

/// A forest, and the poses of sensors in it.
pub(crate) struct World {
    pub(crate) name: &'static str,
    pub(crate) groups: Vec<(Vec3, Arc<Group>)>,
    pub(crate) materials: MaterialLibrary,
    /// The same forest with its leaves as an OBJ has them: pairs of triangles that show windows of
    /// one atlas.
    pub(crate) imported: Option<Vec<(Vec3, Arc<Group>)>>,
    pub(crate) eyes: Vec<Eye>,
}

/// The names of the worlds.
pub(crate) const NAMES: [&str; 2] = ["reference", "medium"];

impl World {
    pub(crate) fn named(name: &str) -> Result<Self, Box<dyn Error>> {
        if name == "medium" {
            Self::medium()
        } else {
            Self::reference()
        }
    }

    /// The forest of `reference`: 2,500 trees and 4,000 shrubs on 250 m x 250 m.
    fn reference() -> Result<Self, Box<dyn Error>> {
        let (groups, materials) = reference::grow(false)?;
        let (imported, _) = reference::grow(true)?;
        let eye = |k: usize| (reference::eye(k), Mat3::from_rotation_z(k as f32));
        Ok(Self {
            name: "reference",
            groups,
            materials,
            imported: Some(imported),
            eyes: (0..8).map(eye).collect(),
        })
    }

    /// The preset `medium` with undergrowth, seen from the robot's LiDAR in its first frames.
    fn medium() -> Result<Self, Box<dyn Error>> {
        let grown = Grown::new(&config("medium", 50_000)?)?;
        let runner = grown.runner();
        let scene = runner.get(grown.forest.scene, 0)?;
        let rigs = runner.get(grown.forest.lidars, ())?;
        let mut eyes = Vec::new();
        for frame in 0..8 {
            let pose = runner.get(grown.forest.pose, frame)?;
            let track = pose.track.relative_to(scene.origin_m);
            let lidar = track.at(0.0) * rigs[0].body_from_lidar;
            let axes = DMat3::from_quat(lidar.rotation).as_mat3();
            eyes.push((lidar.translation_m.as_vec3(), axes));
        }
        Ok(Self {
            name: "medium",
            groups: scene.groups.clone(),
            materials: runner
                .get(grown.forest.assets, ())?
                .library
                .materials
                .clone(),
            imported: None,
            eyes,
        })
    }

    pub(crate) fn forest(&self) -> RayScene {
        RayScene::new(self.groups.clone())
    }
}
