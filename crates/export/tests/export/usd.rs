use std::fs;

use nemoral_export::{Error, Instancing, UsdParams, write_usd};
use nemoral_scene::glam::{DMat4, DVec2, DVec3};

use crate::common::{Labelled, expect_equal, id, long_named_card, scene, truth};

const NODES: UsdParams = UsdParams {
    instancing: Instancing::Nodes,
};

/// A prim: the line that opens it and what is in it.
#[derive(Debug, Default)]
struct Prim {
    head: String,
    lines: Vec<String>,
    children: Vec<Prim>,
}

impl Prim {
    /// Reads prims as they are laid out in our files: a brace is alone on its line.
    fn read(text: &str) -> Self {
        let mut open = vec![Self::default()];
        let mut head = String::new();
        for line in text.lines().map(str::trim) {
            match line {
                "{" => {
                    let head = std::mem::take(&mut head);
                    open.push(Self {
                        head,
                        ..Self::default()
                    });
                }
                "}" => {
                    let prim = open.pop().expect("an open prim");
                    open.last_mut().expect("a parent").children.push(prim);
                }
                _ => {
                    let is_head = ["def ", "class "].iter().any(|w| line.starts_with(w));
                    if is_head || (!head.is_empty() && !head.ends_with('}')) {
                        head += line;
                        head += "\n";
                    } else {
                        open.last_mut().expect("open").lines.push(line.to_owned());
                    }
                }
            }
        }
        assert_eq!(open.len(), 1, "all braces are closed");
        open.remove(0)
    }

    fn child(&self, name: &str) -> &Self {
        let named = format!("\"{name}\"");
        let mut children = self.children.iter();
        children.find(|c| c.head.contains(&named)).expect(name)
    }

    /// The value of an attribute, from its line.
    fn value(&self, name: &str) -> Option<&str> {
        let with = format!(" {name} = ");
        let line = self.lines.iter().find(|line| line.contains(&with))?;
        Some(line.split(&with).nth(1)?.trim_end_matches(" ("))
    }

    fn numbers(&self, name: &str) -> Vec<f64> {
        let value = self.value(name).unwrap_or_else(|| panic!("{name}"));
        let words = value.split(|c| ", ()[]".contains(c));
        let words = words.filter(|word| !word.is_empty());
        words.map(|n| n.parse().expect("a number")).collect()
    }

    fn text(&self, name: &str) -> &str {
        self.value(name).expect(name).trim_matches(['[', ']', '"'])
    }
}

fn stage(params: UsdParams) -> (tempfile::TempDir, Prim) {
    let folder = tempfile::tempdir().expect("a folder");
    write_usd(&scene(), folder.path(), params).expect("written");
    let text = fs::read_to_string(folder.path().join("forest.usda")).expect("a stage");
    assert!(text.starts_with("#usda 1.0\n"));
    (folder, Prim::read(&text))
}

fn place(shape: &Prim, here: DMat4, object: u64, found: &mut Vec<Labelled>) {
    for mesh in &shape.children {
        let points = mesh.numbers("points");
        let point = |i: f64| DVec3::from_slice(&points[3 * i as usize..]);
        assert!(mesh.numbers("faceVertexCounts").iter().all(|&n| n == 3.0));
        for t in mesh.numbers("faceVertexIndices").chunks_exact(3) {
            let at = |k: usize| here.transform_point3(point(t[k]));
            found.push(Labelled {
                corners: [at(0), at(1), at(2)],
                object,
                semantic: mesh.text("semantics:labels:semantic").to_owned(),
            });
        }
    }
}

fn triangles(stage: &Prim) -> Vec<Labelled> {
    let forest = stage.child("Forest");
    let shapes = forest.child("Shapes");
    let inherited = |prim: &Prim| {
        let name = prim.head.split("</Forest/Shapes/").nth(1);
        shapes.child(name.and_then(|n| n.split('>').next()).expect("a shape"))
    };
    let mut found = Vec::new();
    for prim in &forest.children {
        if prim.head.contains("def PointInstancer") {
            let shape = inherited(prim.child("Shape"));
            let (places, turns) = (prim.numbers("positions"), prim.numbers("orientationsf"));
            let (scales, ids) = (prim.numbers("scales"), prim.value("ids"));
            let ids: Vec<u64> = ids.map_or(Vec::new(), |ids| {
                let words = ids.trim_matches(['[', ']']).split(", ");
                words.map(|id| id.parse().expect("an id")).collect()
            });
            for i in 0..places.len() / 3 {
                let [w, x, y, z] = turns[4 * i..4 * i + 4] else {
                    panic!("four")
                };
                let here = DMat4::from_scale_rotation_translation(
                    DVec3::from_slice(&scales[3 * i..]),
                    nemoral_scene::glam::DQuat::from_xyzw(x, y, z, w),
                    DVec3::from_slice(&places[3 * i..]),
                );
                place(shape, here, ids.get(i).copied().unwrap_or(0), &mut found);
            }
        } else if prim.head.contains("inherits") {
            // Row vectors: the rows are the columns of ours.
            let rows = prim.numbers("xformOp:transform");
            let here = DMat4::from_cols_slice(&rows);
            let object = prim.value("nemoral:object");
            let object = object.map_or(0, |id| id.parse().expect("an id"));
            place(inherited(prim), here, object, &mut found);
        }
    }
    found
}

/// USD's window of a camera is its aperture around the offset, at the focal length, y up.
#[test]
fn pixels_look_where_ours_do() {
    let mut scene = scene();
    let k = &mut scene.cameras[0].intrinsics;
    (k.cx, k.cy, k.fy) = (400.0, 150.0, 0.9 * k.fx);
    let k = scene.cameras[0].intrinsics;
    let folder = tempfile::tempdir().expect("a folder");
    write_usd(&scene, folder.path(), UsdParams::default()).expect("written");
    let text = fs::read_to_string(folder.path().join("forest.usda")).expect("a stage");
    let stage = Prim::read(&text);
    let camera = stage.child("Forest").child("camera");
    let number = |name: &str| camera.numbers(name)[0];
    let focal = number("focalLength");
    let [(across, aside), (high, up)] = ["horizontal", "vertical"].map(|side| {
        let (aperture, offset) = (format!("{side}Aperture"), format!("{side}ApertureOffset"));
        (number(&aperture), number(&offset))
    });
    for pixel in [[0.0, 0.0], [400.0, 150.0], [640.0, 360.0], [12.5, 300.0]] {
        let pixel = DVec2::from_array(pixel);
        let share = pixel / DVec2::new(640.0, 360.0) - 0.5;
        let at = DVec2::new(across * share.x + aside, high * -share.y + up) / focal;
        let ours = k.direction(pixel);
        let ours = DVec2::new(ours.x, -ours.y) / ours.z;
        assert!(at.distance(ours) < 1e-6, "{pixel}: {at}, not {ours}");
    }
}

#[test]
fn every_triangle_is_where_rays_meet_it() {
    for params in [UsdParams::default(), NODES] {
        let (_folder, stage) = stage(params);
        expect_equal(&triangles(&stage), &truth(&scene()));
    }
}

#[test]
fn meshes_and_objects_have_labels() {
    let (_folder, stage) = stage(NODES);
    let forest = stage.child("Forest");
    let leaves = forest.child("Shapes").child("pine_0").child("part_1");
    assert!(
        leaves
            .head
            .contains("\"SemanticsLabelsAPI:class\", \"SemanticsLabelsAPI:semantic\"")
    );
    assert_eq!(leaves.text("semantics:labels:class"), "Canopy");
    assert_eq!(leaves.text("semantic:class:params:semanticData"), "Canopy");
    let rock = forest.child(&format!("rock_2_{}", id(3).to_u64()));
    assert_eq!(rock.text("semantics:labels:kind"), "rock");
    assert_eq!(
        rock.text("semantics:labels:object"),
        id(3).to_u64().to_string()
    );
    assert_eq!(
        rock.value("nemoral:image_id"),
        Some(&*id(3).to_image_id().to_string())
    );
}

#[test]
fn textures_are_files_and_their_rows_count_from_below() {
    let (folder, stage) = stage(UsdParams::default());
    let forest = stage.child("Forest");
    let leaf = forest.child("Materials").child("pine_foliage");
    let file = leaf.child("Picture").text("inputs:file").trim_matches('@');
    assert!(folder.path().join(file).is_file(), "{file}");
    assert_eq!(
        leaf.child("Surface").value("inputs:opacityThreshold"),
        Some("0.5")
    );
    let leaves = forest.child("Shapes").child("pine_0").child("part_1");
    let uvs = leaves.numbers("primvars:st");
    assert_eq!(uvs[..8], [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
}

#[test]
fn cards_are_double_sided_and_names_are_cut() {
    let folder = tempfile::tempdir().expect("a folder");
    write_usd(&long_named_card(), folder.path(), NODES).expect("written");
    let text = fs::read_to_string(folder.path().join("forest.usda")).expect("a stage");
    let stage = Prim::read(&text);
    let name = "n".repeat(100);
    let shape = stage.child("Forest").child("Shapes").child(&name);
    assert_eq!(shape.child("part_0").value("doubleSided"), Some("1"));
    assert!(folder.path().join(format!("textures/{name}.png")).is_file());
}

#[test]
fn a_folder_with_something_in_it_is_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("mine"), "x").expect("written");
    let error = write_usd(&scene(), folder.path(), NODES).expect_err("refused");
    assert!(matches!(error, Error::NotEmpty { .. }));
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}
