//! The text of a world.

use std::fmt::Write;

use nemoral_scene::glam::{Quat, Vec3};

use super::{Cylinder, Visual, pose};
use crate::decomposition::RotationScale;

/// A world that is being written.
pub(super) struct Xml {
    text: String,
    collisions: usize,
    visuals: usize,
}

pub(super) fn number(value: f32) -> String {
    // Minus zero is zero.
    format!("{}", value + 0.0)
}

pub(super) fn numbers(values: &[f32]) -> String {
    let all: Vec<String> = values.iter().map(|&value| number(value)).collect();
    all.join(" ")
}

/// Text that is no markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

impl Xml {
    pub(super) fn new(world: &str) -> Self {
        let world = escaped(world);
        let text = format!(
            "<?xml version=\"1.0\"?>\n\
             <sdf version=\"1.9\">\n\
             <world name=\"{world}\">\n\
             <gravity>0 0 -9.81</gravity>\n\
             <light type=\"directional\" name=\"sun\">\n\
             <cast_shadows>true</cast_shadows>\n\
             <direction>-0.5 0.3 -0.8</direction>\n\
             <diffuse>1 1 0.95 1</diffuse>\n\
             <specular>0.2 0.2 0.2 1</specular>\n\
             </light>\n"
        );
        Self {
            text,
            collisions: 0,
            visuals: 0,
        }
    }

    fn line(&mut self, text: &str) {
        self.text += text;
        self.text.push('\n');
    }

    pub(super) fn open_model(&mut self, name: &str, at_m: Vec3) {
        (self.collisions, self.visuals) = (0, 0);
        let at = numbers(&at_m.to_array());
        let _ = writeln!(
            self.text,
            "<model name=\"{}\">\n<static>true</static>\n<pose>{at} 0 0 0</pose>\n\
             <link name=\"link\">",
            escaped(name)
        );
    }

    pub(super) fn close_model(&mut self) {
        self.line("</link>\n</model>");
    }

    fn collision(&mut self, at: &str, geometry: &str) {
        let _ = writeln!(
            self.text,
            "<collision name=\"collision_{}\">{at}<geometry>{geometry}</geometry></collision>",
            self.collisions
        );
        self.collisions += 1;
    }

    /// A file whose triangles are where they are in the model.
    pub(super) fn mesh_collision(&mut self, file: &str) {
        self.collision("", &mesh(file, Vec3::ONE));
    }

    pub(super) fn cylinder_collision(&mut self, cylinder: Cylinder, rotation: Quat) {
        let geometry = format!(
            "<cylinder><radius>{}</radius><length>{}</length></cylinder>",
            number(cylinder.radius_m),
            number(cylinder.length_m)
        );
        self.collision(&pose(cylinder.centre_m, rotation), &geometry);
    }

    pub(super) fn visual(
        &mut self,
        (label, class, file): &Visual,
        turn: RotationScale,
        offset_m: Vec3,
    ) {
        let _ = writeln!(
            self.text,
            "<visual name=\"{}_{}\">{}<geometry>{}</geometry>\
             <plugin filename=\"gz-sim-label-system\" name=\"gz::sim::systems::Label\">\
             <label>{label}</label></plugin></visual>",
            escaped(class),
            self.visuals,
            pose(offset_m, turn.rotation),
            mesh(file, turn.scale)
        );
        self.visuals += 1;
    }

    pub(super) fn finish(mut self) -> String {
        self.line("</world>\n</sdf>");
        self.text
    }
}

fn mesh(file: &str, scale: Vec3) -> String {
    let scale = numbers(&scale.to_array());
    format!(
        "<mesh><uri>{}</uri><scale>{scale}</scale></mesh>",
        escaped(file)
    )
}
