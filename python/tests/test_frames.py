"""Frames by Python are those that the command writes."""

from __future__ import annotations

import gc
import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SMALL, command, read_png, settings

import nemoral


def compare(frame: nemoral.Frame, folder: Path) -> None:
    """Compares a recorded frame with its files, read without this package."""
    name = f"{frame.index:06}"
    assert np.array_equal(frame.image, read_png(folder / "image_2" / f"{name}.png"))
    assert np.array_equal(frame.semantic, read_png(folder / "semantic" / f"{name}.png"))
    red, green, blue = np.moveaxis(
        read_png(folder / "instance" / f"{name}.png").astype(np.uint32), -1, 0
    )
    assert np.array_equal(frame.instance, red + 256 * green + 65536 * blue)
    depth = read_png(folder / "depth" / f"{name}.png")
    found = np.floor(np.minimum(frame.depth_m.astype(np.float64) * 256, 65535) + 0.5)
    hit = frame.depth_m > 0
    assert np.array_equal(hit, depth > 0)
    assert np.array_equal(found[hit].astype(np.uint16), depth[hit])
    normal = read_png(folder / "normals" / f"{name}.png")
    asked = np.where(hit[..., None], np.round(127.5 * (frame.normal.astype(np.float64) + 1)), 0)
    assert np.abs(asked - normal).max() <= 1
    # Points are equal to the byte.
    points = frame.lidar
    assert points.velodyne.tobytes() == (folder / "velodyne" / f"{name}.bin").read_bytes()
    assert points.labels.tobytes() == (folder / "labels" / f"{name}.label").read_bytes()
    ply = (folder / "points" / f"{name}.ply").read_bytes()
    assert frame.points.array.tobytes() == ply.split(b"end_header\n", 1)[1]


def everything(frame: nemoral.Frame) -> dict[str, Any]:
    """All arrays of a frame, and what else it knows, by name."""
    found: dict[str, Any] = {
        name: getattr(frame, name)
        for name in ("index", "sequence", "time_s", "world_from_body", "classes", "colours")
    }
    for sensor in [*frame.cameras.values(), *frame.lidars.values()]:
        for name in dir(type(sensor)) + list(vars(sensor)):
            if not name.startswith("_"):
                found[f"{sensor.name}.{name}"] = getattr(sensor, name)
    for lidar in frame.lidars.values():
        points = found.pop(f"{lidar.name}.points")
        found[f"{lidar.name}.points"] = points.array
        for name in ("xyz", "normal", "object", "ring", "instance"):
            found[f"{lidar.name}.points.{name}"] = getattr(points, name)
    return found


def equal(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """The names of what differs."""
    assert one.keys() == other.keys()

    def is_same(a: Any, b: Any) -> bool:
        if isinstance(a, dict):
            return a.keys() == b.keys() and all(is_same(a[key], b[key]) for key in a)
        if isinstance(a, np.ndarray):
            return (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
        return bool(a == b)

    return [name for name in one if not is_same(one[name], other[name])]


def test_frames_are_those_of_the_command(forest: nemoral.Forest, written: Path) -> None:
    for k in (1, 0):
        compare(forest.frame(k), written / "sequences" / "00")


@pytest.mark.parametrize("preset", ["spruce", "montado"])
def test_frames_of_other_stands(preset: str, cache: Path, tmp_path: Path) -> None:
    small = {**SMALL, "frames": 1}
    done = command(
        "generate", f"--preset={preset}", *settings(small), f"--cache={cache}",
        "--backend=cpu", "--quiet", f"--out={tmp_path / 'out'}",
    )
    assert done.returncode == 0, done.stderr
    forest = nemoral.Forest(preset, cache=cache, **small)
    compare(forest.frame(0), tmp_path / "out" / "sequences" / "00")


def test_shapes_and_types(forest: nemoral.Forest) -> None:
    frame = forest.frame(0)
    shape = (64, 96)
    assert (frame.image.shape, frame.image.dtype) == ((*shape, 3), np.uint8)
    assert (frame.semantic.shape, frame.semantic.dtype) == (shape, np.uint8)
    assert (frame.instance.shape, frame.instance.dtype) == (shape, np.uint32)
    assert (frame.depth_m.shape, frame.depth_m.dtype) == (shape, np.float32)
    assert (frame.normal.shape, frame.normal.dtype) == ((*shape, 3), np.float32)
    points = frame.points
    assert points.xyz.shape == (len(points), 3) and points.xyz.dtype == np.float32
    assert np.array_equal(points.xyz[:, 1], points["y"])
    assert np.array_equal(points.normal[:, 2], points["nz"])
    ranges = np.linalg.norm(points.xyz, axis=1)
    assert np.allclose(ranges, points.range_m, atol=0.5)
    assert set(np.unique(points.semantic)) <= set(frame.classes)
    assert frame.camera.intrinsics.shape == (3, 3)
    assert frame.camera.sky is None and frame.camera.boxes is None
    assert np.allclose(frame.world_from_body @ frame.camera.body_from_sensor,
                       frame.camera.world_from_sensor)
    assert "points" in frame._repr_html_() and frame._repr_png_() is not None
    with pytest.raises(ValueError, match="path"):
        frame.save("frame.jpg")
    assert np.array_equal(np.asarray(points), points.array)


def test_images_belong_to_who_asks(cache: Path) -> None:
    forest = nemoral.Forest("demo", cache=cache, **{**SMALL, "camera.sky": True})
    frame, again = forest.frame(0), forest.frame(0)
    names = ("image", "semantic", "instance", "depth_m", "normal")
    expected = {name: getattr(again, name).copy() for name in names}
    assert again.camera.sky is not None
    sky = again.camera.sky.copy()
    for name in names:
        found = getattr(frame, name)
        assert found.flags.writeable and found.flags.c_contiguous
        assert not np.shares_memory(found, getattr(again, name))
        # They are not copied again and again.
        assert getattr(frame, name) is found
        found[...] = 0
    assert np.array_equal(frame.camera.sky, sky) and sky.any()
    kept = again.normal
    del frame, again, forest
    gc.collect()
    assert np.array_equal(kept, expected["normal"])


def test_threads_share_the_images_of_a_frame(forest: nemoral.Forest) -> None:
    expected = forest.frame(0).normal
    for _ in range(20):
        frame = forest.frame(0)
        with ThreadPoolExecutor(4) as pool:
            for found in pool.map(lambda _: frame.normal, range(4)):
                assert np.array_equal(found, expected)


def test_points_lie_where_the_camera_sees_them(forest: nemoral.Forest) -> None:
    frame = forest.frame(0)
    world = frame.lidar.world_from_sensor @ np.c_[frame.points.xyz, np.ones(len(frame.points))].T
    x, y, z, _ = np.linalg.inv(frame.camera.world_from_sensor) @ world
    k = frame.camera.intrinsics
    ahead = z > 0.5
    column = np.floor(k[0, 0] * x[ahead] / z[ahead] + k[0, 2]).astype(int)
    row = np.floor(k[1, 1] * y[ahead] / z[ahead] + k[1, 2]).astype(int)
    inside = (column >= 0) & (column < 96) & (row >= 0) & (row < 64)
    seen = frame.depth_m[row[inside], column[inside]]
    near = np.abs(seen - z[ahead][inside]) < 0.3
    assert inside.sum() > 100 and near.mean() > 0.4
    classes = frame.semantic[row[inside], column[inside]]
    assert (classes == frame.points.semantic[ahead][inside])[near].mean() > 0.9


def test_further_truth_and_sensors(cache: Path) -> None:
    config = {
        **SMALL,
        "camera": {"sky": True, "flow": True, "trunks": True, "boxes": True, "radiance": True},
        "cameras": {"right": {"mount_y_m": -0.5}},
        "lidars": {"rear": {"mount_yaw_deg": 180.0, "pulses": 500}},
    }
    forest = nemoral.Forest("demo", cache=cache, **config)
    frame = forest.frame(0)
    assert list(frame.cameras) == ["camera", "right"] and list(frame.lidars) == ["lidar", "rear"]
    camera = frame.cameras["right"]
    assert camera.sky is not None and np.array_equal(camera.sky, camera.depth_m == 0)
    assert camera.flow is not None and camera.flow.shape == (64, 96, 2)
    assert np.isfinite(camera.flow[~camera.sky]).mean() > 0.9
    assert camera.flow_seen is not None and camera.flow_seen.mean() > 0.1
    assert camera.trunks is not None and camera.radiance is not None
    assert camera.radiance.min() >= 0 and camera.radiance.shape == (64, 96, 3)
    boxes = camera.boxes
    assert boxes is not None and len(boxes["kind"]) == len(boxes["whole"]) > 0
    assert boxes["camera_from_box"].shape == (len(boxes["kind"]), 4, 4)
    assert len(frame.lidars["rear"].points) <= 500
    apart = frame.cameras["camera"].body_from_sensor[1, 3] - camera.body_from_sensor[1, 3]
    assert apart == pytest.approx(0.5)


def test_a_forest_is_pickled_as_its_config(forest: nemoral.Forest) -> None:
    data = pickle.dumps(forest)
    assert len(data) < 2000
    again = pickle.loads(data)
    assert np.array_equal(again.frame(1).image, forest.frame(1).image)


def test_a_frame_is_pickled_with_its_arrays(cache: Path, tmp_path: Path) -> None:
    config = {
        **SMALL,
        "camera": {"sky": True, "flow": True, "trunks": True, "boxes": True, "radiance": True},
        "lidars": {"rear": {"mount_yaw_deg": 180.0, "pulses": 500}},
    }
    forest = nemoral.Forest("demo", cache=cache, **config)
    nemoral.generate("demo", out=tmp_path, cache=cache, backend="cpu", **config)
    observed = forest.observe(forest.pose(1), time_s=2.0)
    for frame in (forest.frame(0), observed, nemoral.Dataset(tmp_path)[1]):
        before = set(vars(frame.camera))
        data = pickle.dumps(frame)
        # The frame itself does not keep what was computed for that.
        assert set(vars(frame.camera)) == before
        again = pickle.loads(data)
        assert equal(everything(again), everything(frame)) == []
        assert repr(again) == repr(frame) and again._repr_html_() == frame._repr_html_()
        assert equal(everything(pickle.loads(pickle.dumps(again))), everything(frame)) == []
        # Parts of it, too, and what was changed.
        camera = pickle.loads(pickle.dumps(frame.camera))
        assert np.array_equal(camera.radiance, frame.camera.radiance)
        assert np.array_equal(pickle.loads(pickle.dumps(frame.points)).xyz, frame.points.xyz)
        frame.image[:] = 7
        assert (pickle.loads(pickle.dumps(frame)).image == 7).all()


def test_points_without_ply_are_pickled(cache: Path, tmp_path: Path) -> None:
    nemoral.generate("demo", out=tmp_path, cache=cache, **{**SMALL, "output.ply": False})
    lidar = nemoral.Dataset(tmp_path)[0].lidar
    again = pickle.loads(pickle.dumps(lidar))
    assert again.labels.tobytes() == lidar.labels.tobytes() and len(lidar.labels) > 100
    assert again.velodyne.tobytes() == lidar.velodyne.tobytes()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_columns_of_few_points_are_packed(forest: nemoral.Forest, count: int) -> None:
    points = nemoral.Points(forest.frame(0).points.array[:count])
    for name in ("xyz", "normal", "intensity", "semantic", "fine_semantic", "instance", "object",
                 "range_m", "true_range_m", "time_s", "ring", "flags"):
        column = getattr(points, name)
        # Torch takes no other strides, not even of no points.
        assert len(column) == count and column.flags.c_contiguous, name
        assert all(stride % column.itemsize == 0 for stride in column.strides), name
        assert not np.shares_memory(column, points.array)


def test_to_toml_makes_the_same_forest(forest: nemoral.Forest, cache: Path, tmp_path: Path) -> None:
    path = tmp_path / "forest.toml"
    path.write_text(forest.to_toml())
    again = nemoral.Forest(path, cache=cache)
    assert again.frame(0).points.array.tobytes() == forest.frame(0).points.array.tobytes()
    assert again.seed == 7 and again.config()["camera"]["width_px"] == 96


def test_arrays_outlive_their_forest(cache: Path) -> None:
    forest = nemoral.Forest("demo", cache=cache, **SMALL)
    frame = forest.frame(0)
    image, points, xyz = frame.image, frame.points.array, frame.points.xyz
    before = (image.copy(), points.copy(), xyz.copy())
    del forest, frame
    gc.collect()
    filler = [np.full(1 << 16, i, np.uint8) for i in range(64)]
    assert len(filler) == 64
    assert np.array_equal(image, before[0])
    assert points.tobytes() == before[1].tobytes()
    assert np.array_equal(xyz, before[2])
    image[:] = 0  # It is the caller's own.


def test_a_sequence_of_frames(forest: nemoral.Forest) -> None:
    assert len(forest) == 2
    assert np.array_equal(forest[-1].image, forest.frame(1).image)
    assert [frame.index for frame in forest] == [0, 1]
    with pytest.raises(IndexError):
        forest[2]
    with pytest.raises(IndexError, match="2 frames"):
        forest.frame(2)
