"""The parts alone: rays, scanners, terrain, disks, trees."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import nemoral

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
HALVES = [[0, 1, 2], [0, 2, 3]]


def down(x: np.ndarray, y: np.ndarray, z: float = 5.0) -> np.ndarray:
    """Rays down."""
    rays = np.zeros((*np.shape(x), 6), np.float32)
    rays[..., 0], rays[..., 1], rays[..., 2], rays[..., 5] = x, y, z, -1
    return rays


def test_rays_against_a_brute_force() -> None:
    rng = np.random.default_rng(3)
    vertices = rng.uniform(-1, 1, (300, 3)).astype(np.float32)
    triangles = rng.integers(0, 300, (400, 3))
    triangles = triangles[[len(set(t)) == 3 for t in triangles.tolist()]]
    scene = nemoral.RayScene()
    scene.add_mesh(vertices, triangles, semantic=9)
    rays = np.concatenate([rng.uniform(-3, 3, (500, 3)), rng.normal(size=(500, 3)) * 2], axis=1)
    rays[:, 3:] -= rays[:, :3]
    hits = scene.cast(rays)
    a, b, c = (vertices[triangles[:, i]].astype(np.float64) for i in range(3))
    for ray, t, which in zip(rays, hits["t_hit"], hits["primitive_ids"]):
        origin, direction = ray[:3].astype(np.float32), ray[3:].astype(np.float32)
        e1, e2, s = b - a, c - a, origin - a
        p = np.cross(direction, e2)
        det = (e1 * p).sum(1)
        with np.errstate(all="ignore"):
            u = (s * p).sum(1) / det
            q = np.cross(s, e1)
            v = (q * direction).sum(1) / det
            far = (q * e2).sum(1) / det
        ok = (u >= 1e-6) & (v >= 1e-6) & (u + v <= 1 - 1e-6) & (far >= 0)
        best = np.where(ok, far, np.inf)
        if np.isinf(t):
            assert which == nemoral.RayScene.INVALID_ID and np.isinf(best.min())
        elif which == best.argmin():
            assert t == pytest.approx(best.min(), rel=1e-4)
        else:
            assert t == pytest.approx(best.min(), rel=1e-4) or t < best.min()
    assert np.array_equal(scene.occluded(rays), np.isfinite(hits["t_hit"]))
    assert set(np.unique(hits["semantic"])) == {0, 9}
    normals = hits["primitive_normals"][np.isfinite(hits["t_hit"])]
    assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)


def test_instances_alpha_and_shapes() -> None:
    scene = nemoral.RayScene()
    alpha = np.zeros((8, 8), bool)
    alpha[:, 4:] = True  # Opaque where u is above a half, which is x above 0.
    mesh = scene.add_mesh(SQUARE, HALVES, uv=(SQUARE[:, :2] + 1) / 2, alpha=alpha, place=False)
    places = np.repeat(np.eye(4)[None], 3, axis=0)
    places[:, 0, 3] = [0, 10, 20]
    places[2, :3, :3] *= 2
    scene.add_instances(mesh, places, instances=[5, 6, 7])
    x, y = np.meshgrid([0.5, -0.5, 10.5, 21.5, 18.5], [0.1, 0.2])
    hits = scene.cast(down(x, y))
    assert hits["t_hit"].shape == (2, 5) and hits["primitive_uvs"].shape == (2, 5, 2)
    assert hits["instance_ids"][0].tolist() == [5, scene.INVALID_ID, 6, 7, scene.INVALID_ID]
    assert hits["t_hit"][0, 0] == 5 and np.allclose(hits["primitive_normals"][0, 0], [0, 0, 1])
    assert scene.memory_bytes > 0 and repr(scene) == "RayScene(1 meshes, 3 instances)"
    limited = scene.cast(down(np.array([0.5]), np.array([0.1])), tfar=4.9)
    assert np.isinf(limited["t_hit"][0])
    empty = nemoral.RayScene().cast(np.ones((2, 6)))
    assert np.isinf(empty["t_hit"]).all()
    assert scene.cast(np.zeros((0, 6), np.float32))["t_hit"].shape == (0,)


def test_a_scanner_at_a_mesh() -> None:
    scene = nemoral.RayScene()
    wall = np.array([[10, -50, -50], [10, 50, -50], [10, 50, 50], [10, -50, 50]], np.float32)
    scene.add_mesh(wall, HALVES, semantic=4, instance=77, reflectance=0.4)
    exact = nemoral.Scanner("avia", noise="off", pulses=2000, rings=0).scan(scene)
    assert len(exact) == 2000 and np.allclose(exact["x"], 10, atol=1e-3)
    assert set(exact["semantic"]) == {4} and set(exact["instance"]) == {77}
    scanner = nemoral.Scanner("vlp16")
    one, two = scanner.scan(scene, seed=1), scanner.scan(scene, seed=1)
    assert one.tobytes() == two.tobytes()
    other = scanner.scan(scene, seed=2)
    assert other.tobytes() != one.tobytes()
    assert 0.001 < np.std(one["range"] - one["range_true"]) < 0.1
    assert set(nemoral.Scanner.devices()) >= {"avia", "vlp16"}
    pose = np.eye(4)
    pose[0, 3] = 5
    assert np.allclose(nemoral.Scanner("avia", noise="off", rings=0).scan(scene, pose)["x"], 5,
                       atol=1e-3)


def test_a_scanner_moves() -> None:
    scene = nemoral.RayScene()
    scene.add_mesh(np.array([[10, -50, -50], [10, 50, -50], [10, 50, 50], [10, -50, 50]]), HALVES)

    def scan(deskew: bool, **motion: Any) -> nemoral.Scan:
        scanner = nemoral.Scanner("avia", noise="off", pulses=2000, rings=0, deskew=deskew)
        return pickle.loads(pickle.dumps(scanner)).scan(scene, **motion)

    drive = {"velocity": (20.0, 0, 0)}
    raw, deskewed = scan(False, **drive), scan(True, **drive)
    assert len(raw) == len(deskewed) == 2000
    # It drives towards the wall; points are where it was when it fired, or where it is in the
    # middle of the scan.
    assert np.allclose(raw["x"], 10 - 20 * raw.time_s, atol=1e-3) and np.ptp(raw["x"]) > 0.1
    assert np.allclose(deskewed["x"], 10, atol=1e-3)
    turn = {"turn_rate": (0, 0, 5.0)}
    raw, angle = scan(False, **turn), 5 * scan(False, **turn).time_s
    assert np.allclose(raw["x"] * np.cos(angle) - raw["y"] * np.sin(angle), 10, atol=2e-3)
    assert np.abs(raw["x"] - 10).max() > 0.02
    assert np.allclose(scan(True, **turn)["x"], 10, atol=1e-3)
    still = {"velocity": (0, 0, 0), "turn_rate": (0, 0, 0)}
    for deskew in (False, True):
        assert scan(deskew, **still).tobytes() == scan(deskew).tobytes()


UTM = np.array([500_000.25, 5_400_000.5, 300.0])


def test_georeferenced_meshes_need_an_origin() -> None:
    sheet = SQUARE * np.float32([2, 0.5, 1])
    quarter = np.array([[0, -1, 0, 20], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    local = np.eye(4)
    local[0, 3] = 10

    def scene(of_world: nemoral.RayScene, world_m: np.ndarray) -> nemoral.RayScene:
        placed = of_world.add_mesh(world_m + sheet, HALVES, semantic=1)
        leaf = of_world.add_mesh(sheet, HALVES, semantic=2, place=False)
        there, turned = local.copy(), quarter.copy()
        there[:3, 3] += world_m
        # About the sheet's middle.
        turned[:3, 3] += world_m - turned[:3, :3] @ world_m
        of_world.add_instances(leaf, there, instances=[7])
        of_world.add_instances(placed, turned, instances=[8])
        return of_world

    here = scene(nemoral.RayScene(), np.zeros(3))
    far = scene(nemoral.RayScene(UTM + (3, -2, 40)), UTM)
    rng = np.random.default_rng(3)
    rays = down(rng.uniform(-3, 24, 1000), rng.uniform(-3, 3, 1000)).astype(np.float64)
    moved = rays + np.concatenate([UTM, np.zeros(3)])
    again = pickle.loads(pickle.dumps(far))
    assert np.array_equal(again.origin, UTM + (3, -2, 40))
    expected = here.cast(rays)
    assert set(expected["instance_ids"]) == {0, 7, 8, here.INVALID_ID}
    for one in (far, again, scene(nemoral.RayScene(UTM - 1), UTM)):
        found = one.cast(moved)
        assert np.allclose(found["t_hit"], expected["t_hit"], atol=1e-4)
        assert np.array_equal(found["instance_ids"], expected["instance_ids"])
        assert np.array_equal(found["semantic"], expected["semantic"])
        assert np.array_equal(one.occluded(moved), np.isfinite(expected["t_hit"]))
    # Of what was pickled further instances are where they should be.
    farther = np.eye(4)
    farther[1, 3] = 50
    again.add_instances(0, farther)
    ray = down(np.array(1.0), np.array(50.0)) + [*UTM, 0, 0, 0]
    assert again.cast(ray)["t_hit"] == pytest.approx(5)


def test_a_scan_of_georeferenced_meshes() -> None:
    scanner = nemoral.Scanner("avia", noise="off", pulses=500, rings=0)
    pose = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 5], [0, 0, 0, 1.0]])
    here, far = nemoral.RayScene(), nemoral.RayScene(UTM + 2)
    here.add_mesh(60 * SQUARE, HALVES)
    far.add_mesh(UTM + 60 * SQUARE, HALVES)
    moved = pose.copy()
    moved[:3, 3] += UTM
    one, two = scanner.scan(here, pose), scanner.scan(far, moved)
    assert len(one) == len(two) == 500 and np.allclose(one.xyz, two.xyz, atol=1e-3)
    # Without a pose it stands at the origin, 2 m above the sheet.
    down_there = scanner.scan(far)
    assert len(down_there) > 3 and np.allclose(down_there["z"], -2, atol=1e-3)


def test_what_is_far_from_the_origin_is_refused() -> None:
    place = np.eye(4)
    place[:3, 3] = UTM
    scene = nemoral.RayScene()
    leaf = scene.add_mesh(SQUARE, HALVES, place=False)
    calls: dict[str, Any] = {
        "vertices[0]": lambda: scene.add_mesh(UTM + SQUARE, HALVES),
        "vertices[3]": lambda: scene.add_mesh([*SQUARE[:3], UTM], HALVES, place=False),
        "transforms[1]": lambda: scene.add_instances(leaf, [np.eye(4), place]),
        "rays[0]": lambda: scene.cast([*UTM, 0, 0, -1]),
        "pose": lambda: nemoral.Scanner("avia", pulses=5).scan(scene, place),
    }
    for key, call in calls.items():
        with pytest.raises(nemoral.ConfigError, match="within 16384 m of the origin") as raised:
            call()
        northing = "5399999.5" if key == "vertices[0]" else "5400000.5"
        assert raised.value.key == key and northing in str(raised.value)
        assert ("RayScene(origin=...)" in str(raised.value)) == (key != "vertices[3]")
    # Nothing of it was added, and what is coarse already is taken as it is.
    assert repr(scene) == "RayScene(1 meshes, 0 instances)"
    scene.add_mesh((UTM + SQUARE).astype(np.float32), HALVES)
    ray = np.array([*UTM, 0, 0, -1], np.float32)
    ray[[0, 2]] += (0.5, 5)
    assert scene.cast(ray)["t_hit"] == 5


def test_terrain_slopes_are_its_gradient() -> None:
    terrain = nemoral.Terrain(seed=5, max_height_m=9)
    x, y = np.meshgrid(np.linspace(-50, 50, 11), np.linspace(0, 80, 9))
    height, gradient = terrain.sample(x, y)
    assert height.shape == x.shape and gradient.shape == (*x.shape, 2)
    assert 0 <= height.min() and height.max() <= 9
    step = 1e-5
    slope = (terrain.height_m(x + step, y) - terrain.height_m(x - step, y)) / (2 * step)
    assert np.allclose(slope, gradient[..., 0], atol=1e-5)


def test_disks_do_not_overlap_and_fit() -> None:
    low, high = [0, 0], [30, 20]
    places, radii = nemoral.poisson_disks(low, high, (0.5, 1.5), seed=3)
    assert len(places) > 60 and radii.min() >= 0.5 and radii.max() <= 1.5
    distance = np.linalg.norm(places[:, None] - places[None], axis=-1)
    np.fill_diagonal(distance, np.inf)
    assert (distance > radii[:, None] + radii[None] - 1e-6).all()
    left, _ = nemoral.poisson_disks(low, [15, 20], (0.5, 1.5), seed=3)
    assert sorted(map(tuple, left)) == sorted(map(tuple, places[places[:, 0] < 15]))


def test_a_tree_has_the_demanded_size() -> None:
    tree = nemoral.grow_tree("beech", dbh_m=0.4, seed=3)
    assert tree.size["dbh_m"] == pytest.approx(0.4, rel=0.03)
    assert tree.vertices[:, 2].max() == pytest.approx(tree.size["height_m"], rel=0.15)
    assert len(tree.parts) == len(tree.triangles) and tree.leaf_corners.shape[1:] == (4, 3)
    wood = tree.structure
    parent, order = wood["parent"], wood["order"]
    assert parent[0] == -1 and (parent[1:] >= 0).all() and (parent < np.arange(len(parent))).all()
    assert set(order) >= {0, 1, 2} and (order[parent[1:]] <= order[1:]).all()
    stem = wood["axis"] == 0
    at_breast = np.interp(1.3, wood["position_m"][stem, 2], wood["radius_m"][stem])
    assert 2 * at_breast == pytest.approx(tree.size["dbh_m"], rel=0.03)
    vertices, triangles = tree.mesh()
    assert triangles.max() < len(vertices)
    scene = nemoral.RayScene()
    scene.add_mesh(vertices, triangles)
    hit = scene.cast([[-20, 0, 1.3, 1, 0, 0]])
    assert hit["t_hit"][0] == pytest.approx(20 - 0.2, abs=0.3)


def test_masks_of_every_kind() -> None:
    opaque = np.zeros((8, 8), bool)
    opaque[:, 4:] = True
    x, y = np.array([0.5, -0.5]), np.array([0.1, 0.1])
    for alpha in (opaque, opaque * 0.6, opaque * np.uint8(128), opaque.tolist()):
        scene = nemoral.RayScene()
        scene.add_mesh(SQUARE, HALVES, uv=(SQUARE[:, :2] + 1) / 2, alpha=alpha)
        assert scene.occluded(down(x, y)).tolist() == [True, False]


def test_a_scan_has_the_columns_of_points() -> None:
    scene = nemoral.RayScene()
    scene.add_mesh(10 * SQUARE, HALVES, semantic=4, instance=300)
    pose = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 5], [0, 0, 0, 1.0]])
    scan = nemoral.Scanner("avia", pulses=500).scan(scene, pose)
    assert isinstance(scan, nemoral.Scan) and scan.shape == (len(scan),) and len(scan) > 100
    assert scan.xyz.shape == (len(scan), 3) and scan.xyz.dtype == np.float32
    assert np.array_equal(scan.xyz[:, 1], scan["y"]) and type(scan["y"]) is np.ndarray
    assert np.array_equal(scan.normal[:, 2], scan["nz"])
    for name, field in [
        ("range_m", "range"), ("true_range_m", "range_true"), ("time_s", "t"), ("ring", "ring"),
        ("intensity", "intensity"), ("semantic", "semantic"), ("instance", "instance"),
    ]:
        assert np.array_equal(getattr(scan, name), scan[field]), name
        assert getattr(scan, name).flags.c_contiguous
    near = scan[scan["range"] < np.median(scan["range"])]
    assert 0 < len(near.xyz) < len(scan) and set(near.instance) == {300}
    assert type(scan.array) is np.ndarray
    assert np.array_equal(pickle.loads(pickle.dumps(scan)).xyz, scan.xyz)
    assert nemoral.Scanner("avia", pulses=5).scan(nemoral.RayScene()).xyz.shape == (0, 3)


def test_models_of_noise() -> None:
    scene = nemoral.RayScene()
    scene.add_mesh(20 * SQUARE, HALVES, reflectance=0.5)
    pose = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 10], [0, 0, 0, 1.0]])

    def errors(noise: Any) -> np.ndarray:
        scan = nemoral.Scanner("avia", noise=noise, pulses=3000, rings=0).scan(scene, pose)
        true = scan["flags"] & 2 == 0
        return (scan.range_m - scan.true_range_m)[true].astype(np.float64)

    assert np.abs(errors("off")).max() < 1e-5
    for noise in ("data_sheet", "paper", "laconte", "incidence", "linear", "snr"):
        assert 1e-3 < errors(noise).std() < 0.1, noise
    # Those of the data sheet are those of `snr`.
    assert np.array_equal(errors("snr"), errors("data_sheet"))
    fine = {"model": "paper", "sigma_m": 0.001}
    assert errors(fine).std() < 0.5 * errors("paper").std()
    wide = errors({"model": "linear", "floor_m": 0.0, "per_metre": 0.01}).std()
    assert wide == pytest.approx(0.1, rel=0.2)
    closed = errors({"model": "laconte", "laconte_device": "lms1xx", "laconte_closed": True})
    assert not np.array_equal(closed, errors("laconte"))

    # Intensities have noise of their own, which leaves ranges as they are.
    def scan(spread: float) -> nemoral.Scan:
        noise = {"intensity_at_threshold": spread}
        return nemoral.Scanner("avia", noise=noise, pulses=3000, rings=0).scan(scene, pose)

    noisy, quiet = scan(0.27), scan(0.0)
    assert np.array_equal(noisy.range_m, quiet.range_m)
    assert 1e-3 < np.std(noisy.intensity / quiet.intensity) < 0.05
    with pytest.raises(nemoral.ConfigError) as raised:
        nemoral.Scanner("avia", noise={"model": "paper", "sigma_m": -1.0})
    assert raised.value.key == "lidar.noise.sigma_m"


def test_scanners_in_fog() -> None:
    scene = nemoral.RayScene()
    scene.add_mesh(60 * SQUARE, HALVES, reflectance=0.5, semantic=4)
    pose = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 12], [0, 0, 0, 1.0]])

    def scan(**weather: Any) -> nemoral.Scan:
        fog = weather or None
        scanner = nemoral.Scanner("avia", noise="off", pulses=3000, rings=0, weather=fog)
        assert len(pickle.loads(pickle.dumps(scanner)).scan(scene, pose)) == len(
            scanner.scan(scene, pose)
        )
        return scanner.scan(scene, pose)

    vacuum, mist, fog = scan(), scan(visibility_m=1000.0), scan(visibility_m=25.0)
    assert set(vacuum["flags"]) == {0} and set(vacuum.semantic) == {4}
    share = mist.intensity / vacuum.intensity
    extinction_per_m = 0.003912 * (550 / 905) ** 0.5
    assert np.allclose(share, np.exp(-2 * extinction_per_m * vacuum.range_m), rtol=0.01)
    air = fog["flags"] & 2 > 0
    assert air.sum() > 1000 and set(fog.semantic[air]) == {0} and fog.range_m[air].max() < 12
    with pytest.raises(nemoral.ConfigError) as raised:
        nemoral.Scanner("avia", weather={"visibility": 50})
    assert raised.value.key == "weather.visibility" and "visibility_m" in str(raised.value)
    with pytest.raises(nemoral.ConfigError, match=r"weather = 50: must be a dict"):
        nemoral.Scanner("avia", weather=50)  # type: ignore[arg-type]


def test_parts_are_pickled() -> None:
    scene = nemoral.RayScene()
    alpha = np.eye(40, 30, dtype=bool)
    uv = (SQUARE[:, :2] + 1) / 2
    leaf = scene.add_mesh(SQUARE, HALVES, uv=uv, alpha=alpha, semantic=3, place=False)
    places = np.repeat(np.eye(4)[None], 5, axis=0)
    places[:, :3, 3] = np.random.default_rng(1).uniform(-4, 4, (5, 3))
    places[3, :3, :3] *= 0.7
    scene.add_instances(leaf, places[:3], instances=[9, 8, 7])
    scene.add_mesh(8 * SQUARE, HALVES, semantic=5, instance=6, reflectance=0.1)
    scene.add_instances(leaf, places[3:])
    rng = np.random.default_rng(2)
    rays = np.concatenate([rng.uniform(-5, 5, (2000, 3)), rng.normal(size=(2000, 3))], axis=1)
    again = pickle.loads(pickle.dumps(scene))
    hits, found = scene.cast(rays), again.cast(rays)
    assert repr(again) == repr(scene) and np.isfinite(hits["t_hit"]).sum() > 100
    for name in hits:
        assert np.array_equal(hits[name], found[name]), name
    assert pickle.loads(pickle.dumps(nemoral.RayScene())).cast(rays)["t_hit"].min() == np.inf
    scanner = nemoral.Scanner("vlp16", noise={"model": "linear"}, pulses=900, max_range_m=50)
    other = pickle.loads(pickle.dumps(scanner))
    assert other.scan(again, seed=4).tobytes() == scanner.scan(scene, seed=4).tobytes()
    terrain = nemoral.Terrain(seed=3, octaves=2)
    assert pickle.loads(pickle.dumps(terrain)).height_m(5, 6) == terrain.height_m(5, 6)
    assert repr(terrain).startswith("Terrain(octaves=2, ")
    tree = nemoral.grow_tree("beech", dbh_m=0.1)
    assert pickle.loads(pickle.dumps(tree)) == tree != nemoral.grow_tree("beech", dbh_m=0.11)
    assert len(repr(tree)) < 100 and tree != 3


def test_names_of_fine_semantics(forest: nemoral.Forest) -> None:
    assert "soil" in nemoral.SEMANTICS and len(set(nemoral.SEMANTICS)) == len(nemoral.SEMANTICS)
    found = {nemoral.SEMANTICS[i] for i in forest.frame(0).points.fine_semantic}
    assert len(found) > 1


def test_points_join_with_pictures_by_the_inventory(forest: nemoral.Forest) -> None:
    frame = forest.frame(0)
    x, y = frame.world_from_body[:2, 3]
    objects = forest.objects(x - 60, y - 60, x + 60, y + 60)
    image_id = dict(zip(objects["object"].tolist(), objects["instance"].tolist()))
    of_points = {image_id[i] for i in frame.points.object.tolist() if i}
    of_pixels = set(frame.instance.ravel().tolist()) - {0}
    assert of_points & of_pixels
