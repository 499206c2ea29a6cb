"""Any argument is taken or refused by an exception; none is a panic or an abort."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("hypothesis", reason="hypothesis is not installed")
from hypothesis import HealthCheck, given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

import nemoral  # noqa: E402

PLAIN = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8),
    st.binary(max_size=4),
)
ANY = st.recursive(
    PLAIN,
    lambda inner: st.lists(inner, max_size=4)
    | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
# Paths that are taken must not lead elsewhere.
NEAR = ANY.filter(lambda value: not isinstance(value, str) or "/" not in value)
TEXTS = st.one_of(NEAR, st.sampled_from(["kitti", "coco", "fresh", "resume", "overwrite", "paper"]))
NUMBERS = st.lists(st.floats(width=32), min_size=6, max_size=6)
REFUSED = (ValueError, TypeError, IndexError, OSError, nemoral.Error)
KEYS = st.sampled_from(
    ["seed", "frames", "terrain.octaves", "terrain", "camera.width_px", "lidar", "lidar.device",
     "cameras.left.mount_x_m", "vary.preset", "splits.train", "sun.elevation_deg", "x", ""]
)
RELAXED = settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))


def tried(function: Any, *arguments: Any, **keywords: Any) -> None:
    try:
        function(*arguments, **keywords)
    except REFUSED as error:
        assert "defect" not in str(error)


@RELAXED
@given(key=KEYS, value=ANY)
def test_configs(key: str, value: Any) -> None:
    tried(nemoral.Forest, "demo", **{key: value} if key.isidentifier() else {})
    tried(nemoral.Forest, {"preset": "demo", key: value})


@RELAXED
@given(config=ANY, seed=ANY)
def test_requests(config: Any, seed: Any) -> None:
    tried(nemoral.Forest, config, seed)


@RELAXED
@given(rays=st.lists(NUMBERS, max_size=4), near=st.floats(), far=st.floats())
def test_rays(rays: list[list[float]], near: float, far: float) -> None:
    scene = nemoral.RayScene()
    scene.add_mesh(np.eye(3), [[0, 1, 2]])
    tried(scene.cast, np.array(rays, np.float32).reshape(-1, 6), tnear=near, tfar=far)
    tried(scene.occluded, rays)


@RELAXED
@given(vertices=ANY, triangles=ANY, uv=ANY, alpha=ANY, semantic=ANY)
def test_meshes(vertices: Any, triangles: Any, uv: Any, alpha: Any, semantic: Any) -> None:
    scene = nemoral.RayScene()
    tried(scene.add_mesh, vertices, triangles, uv=uv, alpha=alpha, semantic=semantic)
    tried(scene.add_instances, 0, vertices)


@RELAXED
@given(
    corners=st.lists(
        st.lists(st.floats(width=32), min_size=3, max_size=3), min_size=3, max_size=6
    ),
    matrix=st.lists(st.floats(), min_size=16, max_size=16),
)
def test_shapes_of_any_numbers(corners: list[list[float]], matrix: list[float]) -> None:
    scene = nemoral.RayScene()
    tried(scene.add_mesh, np.array(corners, np.float32), [[0, 1, 2]])
    tried(scene.add_instances, 0, np.reshape(matrix, (4, 4)))
    tried(scene.cast, [[0, 0, 5, 0, 0, -1]])
    tried(nemoral.Scanner("avia", pulses=10).scan, scene, np.reshape(matrix, (4, 4)))


@RELAXED
@given(a=ANY, b=ANY, c=ANY)
def test_parts(a: Any, b: Any, c: Any) -> None:
    tried(nemoral.Terrain, octaves=a, scale_m=b, seed=c)
    tried(nemoral.Terrain().sample, a, b)
    tried(nemoral.poisson_disks, a, b, c)
    tried(nemoral.grow_tree, a, dbh_m=b, seed=c)
    tried(nemoral.Scanner, a, noise=b, pulses=c)
    tried(nemoral.Dataset, a)
    tried(nemoral.check, a)


@RELAXED
@given(pose=ANY, time_s=ANY, index=ANY)
def test_observations(pose: Any, time_s: Any, index: Any) -> None:
    tried(FOREST.observe, pose, time_s=time_s, index=index)
    tried(FOREST.frame, index, sequence=pose)
    tried(FOREST.ground, pose, time_s)
    tried(FOREST.cast, pose)


@RELAXED
@given(a=ANY, b=ANY, c=ANY, d=ANY)
def test_places(a: Any, b: Any, c: Any, d: Any) -> None:
    tried(FOREST.stand, a, b, c, sequence=d)
    for inventory in (FOREST.trees, FOREST.objects, FOREST.obstacles):
        tried(inventory, a, b, c, d)
        tried(inventory, 0, 0, 1, 1, sequence=a)
    tried(FOREST.pose, a, sequence=b)
    tried(FOREST.time_s, a)
    tried(FOREST.config, a)
    tried(FOREST.drawn, a)
    tried(FOREST.__getitem__, a)
    tried(FOREST.cast, [[0, 0, 50, 0, 0, -1]], around=a, sequence=b)
    tried(FOREST.observe, (0, 0, 0), velocity=a, turn_rate=b)


@RELAXED
@given(low=NUMBERS, far=st.floats())
def test_rectangles_of_any_numbers(low: list[float], far: float) -> None:
    for inventory in (FOREST.trees, FOREST.objects, FOREST.obstacles):
        tried(inventory, *low[:4])
        tried(inventory, 0, 0, far, 1)
    tried(FOREST.stand, *low[:3])
    tried(FOREST.observe, low[:3], time_s=far)


@RELAXED
@given(threads=ANY)
def test_threads(threads: Any) -> None:
    before = nemoral.threads()
    # More are allowed, but not started here.
    if not (isinstance(threads, int) and threads > 4):
        tried(nemoral.set_threads, threads)
    nemoral.set_threads(before)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small data set, in a folder in which anything may be written."""
    folder = tmp_path_factory.mktemp("fuzz")
    nemoral.generate(TINY, out=folder / "data")
    return folder / "data"


@RELAXED
@given(a=NEAR, b=NEAR, c=NEAR, d=NEAR, e=NEAR)
def test_generate(dataset: Path, a: Any, b: Any, c: Any, d: Any, e: Any) -> None:
    # Never a fresh folder: what is right would grow a world each time.
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(dataset.parent)
        tried(nemoral.generate, TINY, out="data", frames=a, shard=b, mode=c)
        tried(nemoral.generate, TINY, a, out="data", backend=b, cache=c, progress=d)
        tried(nemoral.generate, a, out="data", **{"camera.width_px": b, "lidar": c})
        tried(nemoral.generate, TINY, out=e)


@RELAXED
@given(a=TEXTS, b=TEXTS, c=TEXTS, d=TEXTS, number=st.one_of(ANY, st.floats(), st.integers()))
def test_commands(dataset: Path, a: Any, b: Any, c: Any, d: Any, number: Any) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(dataset.parent)
        out = dataset.parent / "out"
        tried(nemoral.check, dataset, progress=a)
        tried(nemoral.stats, a, progress=b)
        tried(nemoral.stats, dataset, progress=a)
        tried(nemoral.cloud, dataset, a, voxel_m=b, pure=c, sequence=d)
        tried(nemoral.cloud, dataset, out / "cloud.ply", only=a, sequence=b)
        tried(nemoral.cloud, dataset, out / "cloud.ply", voxel_m=number)
        tried(nemoral.convert, dataset, a, b, ontology=c, mode=d)
        tried(nemoral.convert, dataset, out / "converted", a, ontology=b, mode=c, progress=d)
        tried(nemoral.convert, a, b, c)
        tried(nemoral.merge, [a, b], c, partial=d)
        tried(nemoral.merge, a, "out")
        tried(nemoral.merge, [dataset], out / "merged", mode=a, partial=b, progress=c)
        tried(nemoral.report, a, b)
        tried(nemoral.report, dataset, a)
    read = nemoral.Dataset(dataset)
    for method in (read.frame, read.config, read.poses, read.times_s, read.trees, read.objects):
        tried(method, a)
    tried(read.frame, 0, sequence=a)
    tried(read.__getitem__, a)


@RELAXED
@given(noise=ANY, key=st.sampled_from(["model", "sigma_m", "floor_m", "x", ""]), value=ANY)
def test_noise(noise: Any, key: str, value: Any) -> None:
    tried(nemoral.Scanner, "avia", noise=noise)
    tried(nemoral.Scanner, "avia", noise={"model": "paper", key: value})
    tried(nemoral.Scanner, "avia", rings=value, max_range_m=noise)


TINY = {
    "preset": "demo", "frames": 1, "camera.width_px": 32, "camera.height_px": 32,
    "lidar.pulses": 100, "chunks.visible_radius_m": 20.0, "assets.individuals": 1,
}
FOREST = nemoral.Forest(
    "demo", **{"camera.enabled": False, "lidar.pulses": 100, "chunks.visible_radius_m": 20.0}
)
