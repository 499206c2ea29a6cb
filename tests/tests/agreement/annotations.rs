//! Further truth, compared with a walk of each ray through the whole scene, surface by surface,
//! which removes nothing from the scene as the faster computation does.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, LazyLock};

use nemoral_pipeline::recording::scene::FrameScene;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_pipeline::world::cameras::CameraRig;
use nemoral_render::{CameraImages, OpenSky, SceneView, View};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{Annotations, Hit, ObjectId, Ontology, PixelBox, Ray, Semantic};
use nemoral_tests::World;

static WORLD: LazyLock<World> = LazyLock::new(|| {
    World::new(
        "demo",
        &[
            "camera.width_px=120",
            "camera.height_px=72",
            "camera.edge_samples=1",
            "camera.flow=true",
            "camera.trunks=true",
            "camera.boxes=true",
            "camera.boxes_range_m=40",
            "cameras.plain.flow=false",
            "cameras.plain.trunks=false",
            "cameras.plain.boxes=false",
            "lidar.pulses=10",
        ],
    )
});

static SEEN: LazyLock<Seen> = LazyLock::new(|| {
    let (forest, runner) = (&WORLD.forest, WORLD.runner(2));
    let rigs = runner.get(forest.cameras, ()).expect("cameras");
    let scene = runner.get(forest.scene, 1).expect("a scene");
    let pose = runner.get(forest.pose, 1).expect("a pose");
    let body = pose.track.relative_to(scene.origin_m).middle();
    Seen {
        view: View::new(rigs[0].intrinsics, body * rigs[0].body_from_camera),
        assets: runner.get(forest.assets, ()).expect("assets"),
        images: runner.get(forest.images, 1).expect("images"),
        annotations: runner.get(forest.annotations, 1).expect("further truth"),
        rigs,
        scene,
    }
});

struct Seen {
    rigs: Arc<Vec<CameraRig>>,
    scene: Arc<FrameScene>,
    assets: Arc<WorldAssets>,
    images: Arc<Vec<CameraImages>>,
    annotations: Arc<Vec<Annotations>>,
    view: View,
}

impl Seen {
    fn semantic(&self, hit: &Hit) -> Semantic {
        self.assets
            .library
            .materials
            .get(hit.surface.material)
            .semantic
    }

    /// Visits every surface on a ray, the nearest first, until `stop` is true.
    fn walk(&self, mut ray: Ray, mut stop: impl FnMut(&Hit) -> bool) {
        while let Some(hit) = self.scene.caster.closest_hit(&ray) {
            if stop(&hit) {
                return;
            }
            ray.t_min_m = hit.surface.distance_m.next_up();
        }
    }

    fn pixels(&self) -> impl Iterator<Item = (usize, usize)> {
        let (width, height) = (self.view.intrinsics.width, self.view.intrinsics.height);
        (0..height as usize).flat_map(move |y| (0..width as usize).map(move |x| (x, y)))
    }
}

fn centre((x, y): (usize, usize)) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
}

fn is_ground(semantic: Semantic) -> bool {
    use Semantic::{CutSlope, GroundMoss, Litter, Soil, TrailRut, TrailStrip, TrailSurface};
    [
        Soil,
        Litter,
        GroundMoss,
        CutSlope,
        TrailSurface,
        TrailRut,
        TrailStrip,
    ]
    .contains(&semantic)
}

fn range_m() -> f32 {
    WORLD.config.chunks.visible_radius_m as f32
}

#[test]
fn who_asks_for_nothing_gets_nothing() {
    assert_eq!(SEEN.rigs[1].name, "plain");
    assert_eq!(SEEN.annotations[1], Annotations::default());
}

/// How a camera's flow agrees with rays at what is around in the next frame: numbers of pixels.
#[derive(Debug, Default)]
struct FlowAgreement {
    /// Those that the next picture shows, by flow.
    shown: usize,
    /// Those that it does not, though they lie inside.
    hidden: usize,
    /// Those that lie outside of it.
    outside: usize,
    /// Those that get behind the camera.
    behind: usize,
    /// Those inside that are farther away then than pictures show anything.
    too_far: usize,
    /// Those inside of which what is around in this frame tells otherwise.
    changed: usize,
    /// Those inside where flow is not what rays find.
    wrong: usize,
}

fn flow_agreement(world: &World, camera: usize, frame: u64) -> FlowAgreement {
    let (forest, runner) = (&world.forest, world.runner(2));
    let rigs = runner.get(forest.cameras, ()).expect("cameras");
    let rig = &rigs[camera];
    let renderer = rig.renderer.ray_cast().expect("the CPU's");
    let assets = runner.get(forest.assets, ()).expect("assets");
    let images = runner.get(forest.images, frame).expect("images");
    let truth = &images[camera].truth;
    let annotations = runner.get(forest.annotations, frame);
    let annotations = annotations.expect("further truth");
    let flow = annotations[camera].flow.as_ref().expect("asked for");
    let view = |frame, scene: &FrameScene| {
        let pose = runner.get(forest.pose, frame).expect("a pose");
        let body = pose.track.relative_to(scene.origin_m).middle();
        View::new(rig.intrinsics, body * rig.body_from_camera)
    };
    let scene = |frame| runner.get(forest.scene, frame).expect("a scene");
    let (before, after) = (scene(frame), scene(frame + 1));
    let (here, next) = (view(frame, &after), view(frame + 1, &after));
    let next_among_before = view(frame + 1, &before);
    let size = DVec2::new(truth.depth_m.width() as f64, truth.depth_m.height() as f64);
    let range_m = world.config.chunks.visible_radius_m;
    let mut count = FlowAgreement::default();
    let pixels =
        (0..truth.depth_m.height()).flat_map(|y| (0..truth.depth_m.width()).map(move |x| (x, y)));
    for (x, y) in pixels {
        let depth_m = *truth.depth_m.at(x, y);
        let Some(flow) = flow.at(x, y) else {
            count.behind += usize::from(depth_m > 0.0);
            continue;
        };
        assert!(depth_m > 0.0);
        let at = centre((x, y)) + flow.offset_px.as_dvec2();
        if !(at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all()) {
            assert!(!flow.seen);
            count.outside += 1;
            continue;
        }
        // This is the distance of the place from the next camera along the ray's direction.
        let ray = here.ray(centre((x, y)), range_m as f32);
        let slant = here.intrinsics.direction(centre((x, y))).z as f32;
        let place = ray.at(depth_m / slant).as_dvec3();
        let in_next = next.scene_from_camera.inverse().transform_point(place);
        let shows = |scene: &FrameScene, view: &View| {
            let scene = SceneView {
                caster: &*scene.caster,
                instances: Some(scene),
                materials: &assets.library.materials,
                sky_visibility: &OpenSky,
                lamps: &[],
            };
            let found = renderer.truth_at(&scene, view, at);
            found.object == *truth.object.at(x, y)
                && found.semantic == *truth.semantic.at(x, y)
                && (f64::from(found.depth_m) - in_next.z).abs() < 2e-3 + 1e-3 * in_next.z
        };
        let is_shown = shows(&after, &next);
        count.shown += usize::from(flow.seen);
        count.hidden += usize::from(!flow.seen);
        count.too_far += usize::from(in_next.length() > range_m);
        count.changed += usize::from(is_shown != shows(&before, &next_among_before));
        count.wrong += usize::from(is_shown != flow.seen);
    }
    count
}

#[test]
fn flow_leads_to_the_same_surface_in_the_next_frame() {
    let count = flow_agreement(&WORLD, 0, 1);
    assert!(count.shown > 3000 && count.hidden > 100 && count.outside > 100);
    assert_eq!(count.behind, 0, "the robot moves on by a metre alone");
    // Some differ within the tolerances of both computations, at leaves on edge and at grazing
    // ground.
    assert!(count.wrong * 200 < count.shown + count.hidden);
}

/// From 4 m before the border of a chunk to 2 m behind it, so that the low plants of that chunk
/// come within 3 m, and what is 40 m behind gets out of sight.
#[test]
fn flow_knows_what_comes_and_goes_until_the_next_frame() {
    let world = World::new(
        "demo",
        &[
            "camera.width_px=120",
            "camera.height_px=72",
            "camera.edge_samples=1",
            "camera.flow=true",
            "cameras.rear.mount_yaw_deg=180",
            "chunks.undergrowth_radius_m=3",
            "robot.straight={}",
            "robot.start_x_m=46",
            "robot.start_y_m=25",
            "robot.heading_deg=90",
            "robot.spacing_m=6",
            "lidar.pulses=10",
        ],
    );
    let [ahead, behind] = [0, 1].map(|camera| flow_agreement(&world, camera, 0));
    assert!(ahead.changed > 100 && ahead.hidden > 100 && ahead.shown > 100);
    assert!(behind.too_far > 30 && behind.shown > 100);
    for count in [ahead, behind] {
        assert!(count.wrong * 100 < count.shown + count.hidden);
    }
}

#[test]
fn trunks_are_the_nearest_before_the_ground() {
    let seen = &*SEEN;
    let trunks = seen.annotations[0].trunks.as_ref().expect("asked for");
    let truth = &seen.images[0].truth;
    let ontology = Ontology::paper();
    let trunk = ontology.class(Semantic::Stem).id;
    let (mut all, mut behind) = (0, 0);
    for (x, y) in seen.pixels() {
        let mut expected = ObjectId::NONE;
        seen.walk(seen.view.ray(centre((x, y)), range_m()), |hit| {
            let semantic = seen.semantic(hit);
            if ontology.class(semantic).id == trunk && !hit.surface.object.is_none() {
                expected = hit.surface.object;
                return true;
            }
            is_ground(semantic) && hit.surface.object.is_none()
        });
        assert_eq!(*trunks.at(x, y), expected, "pixel ({x}, {y})");
        all += usize::from(!expected.is_none());
        behind += usize::from(!expected.is_none() && *truth.object.at(x, y) != expected);
    }
    println!("trunks: {all} pixels, in {behind} of them something else is seen");
    assert!(all > 500 && behind > 50);
}

#[test]
fn boxes_hold_what_their_things_cover() {
    let seen = &*SEEN;
    let boxes = seen.annotations[0].boxes.as_ref().expect("asked for");
    let truth = &seen.images[0].truth;
    let mut whole: BTreeMap<ObjectId, (u32, PixelBox)> = BTreeMap::new();
    let mut visible: BTreeMap<ObjectId, (u32, PixelBox)> = BTreeMap::new();
    let count = |of: &mut BTreeMap<_, _>, object, (x, y): (usize, usize)| {
        let entry: &mut (u32, PixelBox) = of.entry(object).or_insert((0, PixelBox::EMPTY));
        entry.0 += 1;
        entry.1 = entry.1.with(x as u32, y as u32);
    };
    // The farthest point of each object from the middle of its box, in multiples of the box's half
    // size.
    let mut corners: BTreeMap<ObjectId, f64> = BTreeMap::new();
    let of_box: BTreeMap<ObjectId, _> = boxes.iter().map(|b| (b.object, b)).collect();
    let camera_from_scene = seen.view.scene_from_camera.inverse();
    for pixel in seen.pixels() {
        let ray = seen.view.ray(centre(pixel), range_m());
        let mut met = BTreeSet::new();
        seen.walk(ray, |hit| {
            if let Some(b) = of_box.get(&hit.surface.object) {
                let p =
                    camera_from_scene.transform_point(ray.at(hit.surface.distance_m).as_dvec3());
                let inside = b.camera_from_box.inverse() * (p - b.centre_m) / (b.size_m / 2.0);
                let most = corners.entry(hit.surface.object).or_insert(0.0);
                *most = most.max(inside.abs().max_element());
            }
            if !hit.surface.object.is_none() && met.insert(hit.surface.object) {
                count(&mut whole, hit.surface.object, pixel);
            }
            is_ground(seen.semantic(hit)) && hit.surface.object.is_none()
        });
        let object = *truth.object.at(pixel.0, pixel.1);
        if !object.is_none() {
            count(&mut visible, object, pixel);
        }
    }
    assert!(boxes.len() > 20, "{}", boxes.len());
    let (mut half_hidden, mut unseen) = (0, 0);
    for b in boxes {
        let id = b.object;
        assert_eq!(whole.get(&id), Some(&(b.whole_px, b.whole)), "{b:?}");
        let of_visible = b.visible.map(|v| (b.visible_px, v));
        assert_eq!(visible.get(&id).copied(), of_visible, "{b:?}");
        assert!((0.0..=1.0).contains(&b.visible_fraction()));
        // Every surface point lies in the box, and boxes are not too large.
        assert!(corners[&id] < 1.0 + 1e-3, "{} {b:?}", corners[&id]);
        assert!(
            b.whole_px < 40 || corners[&id] > 0.5,
            "{} {b:?}",
            corners[&id]
        );
        half_hidden += usize::from(b.visible_fraction() < 0.5);
        unseen += usize::from(b.visible_px == 0);
    }
    // Every object that is near enough has a box.
    let eye = seen.view.scene_from_camera.translation_m + seen.scene.origin_m;
    let runner = WORLD.runner(2);
    let mut near = 0;
    for &id in whole.keys() {
        let things = runner
            .get(WORLD.forest.objects, id.chunk())
            .expect("things");
        let thing = things.0.iter().find(|t| t.object == id).expect("a thing");
        let is_near = thing.position_m.distance(eye) <= 40.0 - 1e-3;
        near += usize::from(is_near);
        assert!(!is_near || of_box.contains_key(&id), "{id:?} has no box");
    }
    println!(
        "boxes: {} of {near} near things, {half_hidden} more than half hidden, {unseen} wholly",
        boxes.len()
    );
}
