//! A small forest that is looked at, walked through and changed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use nemoral_pipeline::config::{Config, ConfigLayers};
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::{
    Backend, ForestPlan, picture_of_classes, picture_of_instances, picture_of_scan,
};
use nemoral_realism::grown;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Ontology};
use nemoral_view::{
    ForestParams, Handler, ImageKind, LiveForest, Method, Request, Routes, Value, Values,
    ViewImage, ViewRequest, Viewpoint,
};

fn forest(settings: &[&str]) -> LiveForest {
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        settings: settings.iter().map(|s| (*s).to_owned()).collect(),
        ..ConfigLayers::default()
    };
    let sequence = layers.sequences().and_then(|s| s.get(0)).expect("a config");
    LiveForest::new(ForestParams {
        sequence,
        backend: Backend::Cpu,
        threads: 2,
        cache: grown(),
    })
    .expect("a possible forest")
}

fn until<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(
            began.elapsed() < Duration::from_secs(300),
            "{what} takes too long"
        );
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A request from the start of the path.
fn request(forest: &LiveForest) -> ViewRequest {
    let (x, y, heading_deg) = until("the start", || forest.status().start);
    ViewRequest {
        viewpoint: Viewpoint {
            position_m: DVec2::new(x, y),
            heading_deg,
            pitch_deg: 2.5,
            eye_m: 1.6,
        },
        kind: ImageKind::Colour,
        size_px: (160, 90),
        still: true,
        viewer: 1,
    }
}

fn whole(forest: &LiveForest, request: &ViewRequest) -> ViewImage {
    until("a whole picture", || {
        let picture = forest.picture(request).expect("it can be taken");
        picture.filter(|picture| picture.is_final)
    })
}

fn set(name: &str, value: f64) -> Values {
    Values::from([(name.to_owned(), Value::Number(value))])
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn the_config_of_what_is_seen_makes_the_same_picture() {
    // Edges are smoothed and the sensor is noisy, as in whole data sets.
    let forest = forest(&["camera.edge_samples=4", "camera.noise.enabled=true"]);
    let mut request = request(&forest);
    request.viewpoint.position_m += DVec2::new(7.0, 3.5);
    request.viewpoint.heading_deg = 123.0;
    let colour = whole(&forest, &request);
    request.viewpoint = colour.viewpoint;
    let toml = forest.config(&request, false).expect("a config");
    let config = Config::from_toml(&toml).expect("a config that is allowed");
    assert_eq!((config.frames, config.sequences), (1, 1));
    let plan = ForestPlan::new(&config).expect("a possible plan");
    let store = Store::unlimited();
    let runner = Runner::new(plan.plan(), &store, 2);
    let images = runner.get(plan.images, 0).expect("a picture");
    let seen = |kind| {
        whole(&forest, &ViewRequest { kind, ..request })
            .rendered
            .image
    };
    let ontology = Ontology::paper();
    assert!(seen(ImageKind::Classes) == picture_of_classes(&images[0].truth, &ontology));
    assert!(seen(ImageKind::Instances) == picture_of_instances(&images[0].truth));
    let differ = |a: &[[u8; 3]], b: &[[u8; 3]]| a.iter().zip(b).filter(|(a, b)| a != b).count();
    let off = differ(colour.rendered.image.pixels(), images[0].rgb.pixels());
    assert_eq!(off, 0, "pixels of colour differ");
    let scans = runner.get(plan.scans, 0).expect("a scan");
    let camera = &config.camera;
    let camera_from_lidar = camera.body_from_camera().inverse() * config.lidar.body_from_lidar();
    let intrinsics = camera.intrinsics().expect("a camera");
    let scan = picture_of_scan(&scans[0], &ontology, &intrinsics, &camera_from_lidar);
    assert!(seen(ImageKind::Lidar) == scan);
    // A drive begins there with the robot's own sensors.
    let drive = forest.config(&request, true).expect("a config");
    let drive = Config::from_toml(&drive).expect("a config that is allowed");
    assert_eq!(drive.robot.start_x_m, request.viewpoint.position_m.x);
    assert_eq!((drive.frames, drive.camera.width_px), (2, 160));
}

#[test]
fn light_changes_at_once_and_land_while_the_old_one_is_seen() {
    let forest = forest(&[]);
    let request = request(&forest);
    let first = whole(&forest, &request);
    forest.change(&set("overcast", 1.0)).expect("it is allowed");
    let overcast = whole(&forest, &request);
    assert!(overcast.revision > first.revision);
    assert_ne!(overcast.rendered.image, first.rendered.image);
    let depth = |request: &ViewRequest| {
        let request = ViewRequest {
            kind: ImageKind::Depth,
            ..*request
        };
        whole(&forest, &request).rendered.image
    };
    let before = depth(&request);

    forest.change(&set("trees", 1000.0)).expect("it is allowed");
    let draft = ViewRequest {
        still: false,
        ..request
    };
    let meanwhile = forest
        .picture(&draft)
        .expect("it can be taken")
        .expect("the old forest");
    assert_eq!(
        meanwhile.revision, overcast.revision,
        "nothing waits for what grows"
    );
    assert_ne!(depth(&request), before);
    // What the newer plan has no use for is gone; so the old one comes back by growing again.
    forest.change(&set("trees", 384.0)).expect("it is allowed");
    assert_eq!(depth(&request), before);

    // The hour moves the sun, and the seed the trees.
    forest.change(&set("hour", 8.0)).expect("it is allowed");
    assert_ne!(
        whole(&forest, &request).rendered.image,
        overcast.rendered.image
    );
    let seed = Values::from([("seed".to_owned(), Value::Text("8".to_owned()))]);
    forest.change(&seed).expect("it is allowed");
    assert_ne!(depth(&request), before);
}

#[test]
fn what_is_impossible_is_said_and_changes_nothing() {
    let forest = forest(&[]);
    let request = request(&forest);
    let first = whole(&forest, &request);
    let values = forest.status().values;
    let error = forest
        .change(&set("overcast", 2.0))
        .expect_err("more than all");
    assert_eq!(error.to_string(), "overcast = 2: must be 0 to 1");
    // Thick trees that touch each other are found only with grown trees.
    let stand = Values::from([("stand".to_owned(), Value::Text("montado".to_owned()))]);
    let mut crowded = stand;
    crowded.extend(set("trees", 1200.0));
    forest
        .change(&crowded)
        .expect("each value alone is allowed");
    let error = until("an error", || forest.status().error);
    assert!(error.contains("placement"), "{error}");
    assert_eq!(forest.status().values, values);
    assert!(whole(&forest, &request).rendered.image == first.rendered.image);
    // The next change is not taken for the one that failed.
    forest.change(&set("trees", 200.0)).expect("it is allowed");
    assert!(whole(&forest, &request).revision > first.revision);
    assert_eq!(forest.status().error, None);
}

#[test]
fn who_moves_does_not_wait_for_a_whole_picture() {
    // A whole picture of this camera takes minutes.
    let forest = forest(&["camera.bounces=8", "camera.samples=256"]);
    let mut large = request(&forest);
    large.size_px = (1280, 720);
    let given_up = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let still = scope.spawn(|| {
            let picture = forest.picture(&large).expect("no error");
            given_up.store(true, Ordering::SeqCst);
            picture
        });
        std::thread::sleep(Duration::from_millis(500));
        assert!(!given_up.load(Ordering::SeqCst), "it is long");
        let draft = ViewRequest {
            still: false,
            size_px: (160, 90),
            ..large
        };
        let began = Instant::now();
        assert!(forest.picture(&draft).expect("no error").is_some());
        assert!(
            began.elapsed() < Duration::from_secs(20),
            "{:?}",
            began.elapsed()
        );
        assert!(still.join().expect("no panic").is_none());
    });
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn nobody_stands_in_a_stem() {
    // Logs are many metres long, and nobody is moved beyond their ends.
    let forest = forest(&[
        "placement.trees=200",
        "terrain.max_height_m=3",
        "deadwood.volume_m3_ha=60",
    ]);
    let request = request(&forest);
    let mut moved = 0;
    for i in 0..400 {
        let offset = DVec2::new(f64::from(i % 20), f64::from(i / 20)) - 10.0;
        let mut there = ViewRequest {
            kind: ImageKind::Depth,
            size_px: (16, 16),
            still: false,
            ..request
        };
        there.viewpoint.position_m += offset;
        let picture = forest
            .picture(&there)
            .expect("no error")
            .expect("a picture");
        let by_m = picture
            .viewpoint
            .position_m
            .distance(there.viewpoint.position_m);
        assert!(by_m < 2.0, "{by_m}");
        moved += usize::from(by_m > 0.0);
        there.viewpoint = picture.viewpoint;
        let again = forest
            .picture(&there)
            .expect("no error")
            .expect("a picture");
        assert!(
            again
                .viewpoint
                .position_m
                .distance(there.viewpoint.position_m)
                < 0.5
        );
    }
    assert!(moved > 0, "some of 400 places are in stems");
}

/// The hills of `stream-valley`, with a pond in each hollow.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn nobody_stands_in_a_pond() {
    let forest = forest(&[
        "seed=7",
        "terrain.scale_m=240",
        "terrain.max_height_m=34",
        "terrain.persistence=0.24",
        "trails.enabled=false",
        "water.ponds=1",
    ]);
    let request = request(&forest);
    let config = forest.config(&request, false).expect("a config");
    let config = Config::from_toml(&config).expect("a config that is allowed");
    let plan = ForestPlan::new(&config).expect("a possible plan");
    let store = Store::unlimited();
    let runner = Runner::new(plan.plan(), &store, 2);
    let mut ponds = 0;
    for chunk in ChunkCoord::new(0, 1).square(3) {
        let ground = runner.get(plan.ground, chunk).expect("a ground");
        let found = ground.water().and_then(|water| water.ponds().next());
        let Some(middle_m) = found.map(|pond| pond.middle_m()) else {
            continue;
        };
        let mut there = ViewRequest {
            kind: ImageKind::Depth,
            size_px: (16, 16),
            still: false,
            ..request
        };
        there.viewpoint.position_m = middle_m + DVec2::new(0.4, 0.3);
        let picture = forest
            .picture(&there)
            .expect("no error")
            .expect("a picture");
        let stands_m = picture.viewpoint.position_m;
        let there = ChunkCoord::containing(stands_m, config.chunks.size_m);
        let ground = runner.get(plan.ground, there).expect("a ground");
        assert!(ground.bank_m(stands_m) > 0.0, "{stands_m}");
        assert!(stands_m.distance(middle_m) < 20.0, "{stands_m}");
        ponds += 1;
        if ponds == 3 {
            break;
        }
    }
    assert!(ponds > 0, "there are ponds");
}

#[test]
fn the_page_asks_and_is_answered() {
    let forest = Arc::new(forest(&[]));
    let routes = Routes::new(Arc::clone(&forest));
    let ask = |method, path: &str, query: &str, body: &str| {
        let pairs = query.split('&').filter_map(|pair| pair.split_once('='));
        routes.handle(&Request {
            method,
            path: path.to_owned(),
            query: pairs.map(|(k, v)| (k.to_owned(), v.to_owned())).collect(),
            body: body.as_bytes().to_vec(),
        })
    };
    let get = |path: &str, query: &str| ask(Method::Get, path, query, "");
    let page = get("", "");
    assert!(String::from_utf8_lossy(&page.body).contains("<script src=\"view.js\""));
    for (path, media_type) in [("view.js", "text/javascript"), ("style.css", "text/css")] {
        assert!(get(path, "").media_type.starts_with(media_type));
    }
    assert_eq!(get("../Cargo.toml", "").status, 404);
    assert_eq!(ask(Method::Post, "state", "", "").status, 404);

    let viewpoint = request(&forest).viewpoint;
    let (x, y) = (viewpoint.position_m.x, viewpoint.position_m.y);
    let from = format!("x={x}&y={y}&heading=10&pitch=0&eye=1.7&viewer=3");
    let draft = get(
        "picture",
        &format!("{from}&map=colour&width=160&height=90&still=0"),
    );
    assert_eq!((draft.status, draft.media_type), (200, "image/jpeg"));
    assert!(
        draft.headers.contains(&("X-Final", "0".to_owned())),
        "{draft:?}"
    );
    let classes = get(
        "picture",
        &format!("{from}&map=classes&width=160&height=90&still=0"),
    );
    assert_eq!(classes.media_type, "image/png");
    let config = get(
        "config",
        &format!("{from}&map=colour&width=160&height=90&still=1&what=view"),
    );
    assert!(Config::from_toml(&String::from_utf8_lossy(&config.body)).is_ok());

    let refused = |response: nemoral_view::Response, message: &str| {
        let text = String::from_utf8_lossy(&response.body).into_owned();
        assert!(response.status == 422 && text.contains(message), "{text}");
    };
    refused(get("picture", ""), "x = : must be a number");
    let size = "map=colour&width=99999&height=90&still=0";
    refused(
        get("picture", &format!("{from}&{size}")),
        "width = 99999: must be 16 to 2560",
    );
    refused(
        get("config", &format!("{from}&{size}&what=all")),
        "what = all: must be view or drive",
    );
    refused(
        ask(Method::Post, "change", "", "[1, 2]"),
        "an object of numbers and texts",
    );
    refused(
        ask(
            Method::Post,
            "change",
            "",
            "{\"output.ontology\": \"fuel\"}",
        ),
        "must be of stand, seed",
    );
    let changed = ask(Method::Post, "change", "", "{\"fog\": 0.05, \"hour\": 7.5}");
    let state: serde_json::Value = serde_json::from_slice(&changed.body).expect("JSON");
    assert_eq!(
        (&state["revision"], &state["values"]["fog"]),
        (&2.into(), &0.05.into())
    );
}
