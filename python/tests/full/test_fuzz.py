"""Any argument is taken or refused by an exception; none is a panic or an abort."""

from __future__ import annotations

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
    tried(nemoral.merge, a, b)
    tried(nemoral.check, a)


@RELAXED
@given(pose=ANY, time_s=ANY, index=ANY)
def test_observations(pose: Any, time_s: Any, index: Any) -> None:
    tried(FOREST.observe, pose, time_s=time_s, index=index)
    tried(FOREST.frame, index, sequence=pose)
    tried(FOREST.ground, pose, time_s)
    tried(FOREST.cast, pose)


FOREST = nemoral.Forest(
    "demo", **{"camera.enabled": False, "lidar.pulses": 100, "chunks.visible_radius_m": 20.0}
)
