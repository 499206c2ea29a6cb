//! Passes from outside, which users of the camera write.

use std::sync::Arc;

use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_render::{GpuError, GpuParams, OpenSky, Pass, SceneView};
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{MaterialLibrary, RayCaster, Semantic};
use nemoral_tests::gpu::{Agreement, gpu};

use super::avenue::{Avenue, SPECIES};
use super::common::{LEAST, RandomForest, camera, cast, view};

/// The map of `species_map`, an example of a user's pass with the public interface of `render`, has
/// the species that rays hit.
#[test]
fn the_examples_species_map_is_what_rays_hit() {
    let Some(gpu) = gpu("the example species_map") else {
        return;
    };
    let avenue = Avenue::new().expect("trees");
    let view = Avenue::view(640, 360).expect("a view");
    let drawn = avenue.draw(gpu, &view).unwrap_or_else(|e| panic!("{e}"));
    let trees = avenue.trees.0.iter().map(|tree| {
        let shape = Blas::build(Arc::clone(&tree.prototype), &avenue.materials);
        (tree.place(), Arc::new(shape))
    });
    let group = Arc::new(Group::build(trees.collect()));
    let forest = RayScene::new(vec![(Vec3::ZERO, group)]);
    let scene = SceneView {
        caster: &forest,
        instances: Some(&forest),
        materials: &avenue.materials,
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    let agreement = Agreement::of(&cast(&scene, &view), &drawn.truth);
    assert!(agreement.is_right(LEAST), "{agreement}");

    // By species that was hit: its pixels, and those with its number in the map. The first entry is
    // for what is no tree.
    let mut species = [(0, 0); SPECIES.len() + 1];
    for (i, texel) in drawn.passes[0].pixels().iter().enumerate() {
        let centre = DVec2::new((i % 640) as f64 + 0.5, (i / 640) as f64 + 0.5);
        let hit = forest.closest_hit(&view.ray(centre, 300.0));
        let number = hit.map_or(0, |hit| {
            let name = &avenue.materials.get(hit.surface.material).name;
            let is_its = |s: &&str| name.starts_with(*s);
            1 + SPECIES.iter().position(is_its).expect("a tree's material")
        });
        let (all, equal) = &mut species[number];
        *all += 1;
        *equal += usize::from(texel[0] as usize == number);
    }
    println!("pixels and those that agree, of no tree and of {SPECIES:?}: {species:?}");
    for (all, equal) in species {
        assert!(
            all >= 1000 && equal as f64 >= 0.999 * all as f64,
            "{species:?}"
        );
    }
}

/// A user's pass that writes the material's entry of a table, its number and its class.
#[derive(Debug)]
struct MaterialMap;

impl Pass for MaterialMap {
    fn name(&self) -> &str {
        "material map"
    }

    fn wgsl(&self) -> &str {
        "fn paint(s: Surface) -> vec4u { return vec4u(table[s.material], s.material, s.semantic, \
         1u); }"
    }

    fn table(&self, materials: &MaterialLibrary) -> Vec<u32> {
        (0..materials.materials().len() as u32)
            .map(|i| 1000 + i)
            .collect()
    }
}

#[test]
fn a_pass_from_outside_sees_what_the_truth_sees() {
    let Some(gpu) = gpu("a user's pass") else {
        return;
    };
    let camera = camera(gpu, GpuParams::default());
    camera
        .add_pass(Box::new(MaterialMap))
        .unwrap_or_else(|e| panic!("{e}"));
    let forest = RandomForest::new(3, |m| m);
    let drawn = camera
        .draw(&forest.scene(), &view(160, 96))
        .unwrap_or_else(|e| panic!("{e}"));
    let truth = drawn.truth.semantic.pixels();
    for (semantic, &[name, material, number, one]) in truth.iter().zip(drawn.passes[0].pixels()) {
        assert_eq!(u32::from(*semantic as u8), number);
        match one {
            0 => assert_eq!(*semantic, Semantic::Sky),
            _ => assert_eq!(name, 1000 + material),
        }
    }

    #[derive(Debug)]
    struct Broken;
    impl Pass for Broken {
        fn name(&self) -> &str {
            "broken"
        }
        fn wgsl(&self) -> &str {
            "fn paint(s: Surface) -> vec4f { return nothing; }"
        }
        fn table(&self, _: &MaterialLibrary) -> Vec<u32> {
            Vec::new()
        }
    }
    let error = camera.add_pass(Box::new(Broken)).expect_err("no shader");
    assert!(
        matches!(&error, GpuError::Shader { pass, .. } if pass == "broken"),
        "{error}"
    );
    assert!(error.to_string().contains("nothing"), "{error}");
}
