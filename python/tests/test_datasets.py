"""Data sets: functions are the commands, and reading gives what was written."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Callable

import numpy as np
import pytest
from conftest import SMALL, command

import nemoral


def test_reading_gives_what_was_recorded(forest: nemoral.Forest, written: Path) -> None:
    dataset = nemoral.Dataset(written)
    assert len(dataset) == 2 and dataset.frames == [(0, 0), (0, 1)]
    for k, frame in enumerate(dataset):
        live = forest.frame(k)
        assert np.array_equal(frame.image, live.image)
        assert np.array_equal(frame.semantic, live.semantic)
        assert np.array_equal(frame.instance, live.instance)
        assert np.abs(frame.depth_m - live.depth_m).max() <= 1 / 512 + 1e-6
        assert frame.points.array.tobytes() == live.points.array.tobytes()
        assert np.allclose(frame.world_from_body, live.world_from_body)
        assert frame.time_s == live.time_s and frame.classes == live.classes
        assert np.array_equal(frame.camera.intrinsics, live.camera.intrinsics)
    assert dataset.poses().shape == (2, 4, 4) and len(dataset.times_s()) == 2
    assert dataset.estimated_poses() is None
    assert dataset.config()["camera"]["width_px"] == 96
    assert dataset.sequences[0].seed == 7 and dataset.header["backend"] == "cpu"
    assert len(dataset.trees()["dbh_m"]) > 0 and dataset.frame(1).index == 1
    with pytest.raises(IndexError):
        dataset.frame(2)
    with pytest.raises(IndexError):
        dataset[2]


def test_estimated_poses_lie_beside_true_ones(cache: Path, tmp_path: Path) -> None:
    wrong = {"navigation.enabled": True, "navigation.horizontal_m": 0.5}
    out = tmp_path / "out"
    nemoral.generate("demo", 7, out=out, cache=cache, **SMALL, **wrong)
    dataset = nemoral.Dataset(out)
    truth, estimated = dataset.poses(), dataset.estimated_poses()
    assert estimated is not None and estimated.shape == truth.shape
    off = np.linalg.norm((estimated - truth)[:, :3, 3], axis=1)
    assert (off > 0).all() and (off < 4).all()
    clouds = [tmp_path / "true.ply", tmp_path / "estimated.ply"]
    for cloud, estimate in zip(clouds, [False, True]):
        assert nemoral.cloud(out, cloud, estimated_poses=estimate) > 100
    assert clouds[0].read_bytes() != clouds[1].read_bytes()
    own = tmp_path / "own.ply"
    poses = out / "sequences" / "00" / "poses_estimated.txt"
    assert nemoral.cloud(out, own, poses=poses) > 100
    assert own.read_bytes() == clouds[1].read_bytes()


def test_functions_are_the_commands(written: Path, cache: Path, tmp_path: Path) -> None:
    seen: list[nemoral.Progress] = []
    out = tmp_path / "out"
    count = nemoral.generate(
        "demo", 7, out=out, cache=cache, progress=seen.append, **SMALL
    )
    assert count == 2
    assert [p.done for p in seen if p.note is None] == [1, 2] and seen[-1].total == 2
    assert (out / "dataset.json").read_bytes() == (written / "dataset.json").read_bytes()
    with pytest.raises(nemoral.DatasetError, match="holds a data set"):
        nemoral.generate("demo", 7, out=out, cache=cache, **SMALL)

    parts = [tmp_path / "a", tmp_path / "b"]
    for i, part in enumerate(parts):
        nemoral.generate("demo", 7, out=part, shard=(i, 2), cache=cache, **SMALL)
    assert nemoral.merge(parts, tmp_path / "merged") == 2
    merged = (tmp_path / "merged" / "dataset.json").read_bytes()
    assert merged == (written / "dataset.json").read_bytes()

    checked = nemoral.check(out)
    assert checked.problems == [] or all(file == "agreement" for file, _ in checked.problems)
    assert str(checked) == command("check", str(out)).stdout.rstrip("\n") or checked.text
    stats = nemoral.stats(out)
    assert stats["frames"] == 2 and stats.text.strip() == command("stats", str(out)).stdout.strip()
    assert nemoral.cloud(out, tmp_path / "cloud.ply") > 100
    head = (tmp_path / "cloud.ply").read_bytes().partition(b"end_header")[0]
    assert b"property double time\n" in head and b"property uchar ring\n" in head
    assert nemoral.convert(out, tmp_path / "kitti", "kitti")[0] == 2
    boxes = []
    for min_px in (0, 40):
        nemoral.convert(out, tmp_path / f"yolo{min_px}", "yolo", min_px=min_px)
        labels = (tmp_path / f"yolo{min_px}").glob("labels/*/*.txt")
        boxes.append(sum(len(path.read_text().splitlines()) for path in labels))
    assert boxes[0] > boxes[1]
    with pytest.raises(nemoral.Error, match="min_px = 40"):
        nemoral.convert(out, tmp_path / "tum", "tum", min_px=40)
    assert nemoral.report(out, tmp_path / "report.html") > 1000


FRAMES = [(0, 0), (0, 1)]


def test_each_function_tells_its_progress(written: Path, cache: Path, tmp_path: Path) -> None:
    parts = [tmp_path / "a", tmp_path / "b"]
    for i, part in enumerate(parts):
        nemoral.generate("demo", 7, out=part, shard=(i, 2), cache=cache, **SMALL)
    calls: dict[str, Callable[..., object]] = {
        "check": lambda **p: nemoral.check(written, **p),
        "stats": lambda **p: nemoral.stats(written, **p),
        "merge": lambda **p: nemoral.merge(parts, tmp_path / "whole", **p),
        "cloud": lambda **p: nemoral.cloud(written, tmp_path / "cloud.ply", **p),
        "kitti": lambda **p: nemoral.convert(written, tmp_path / "kitti", "kitti", **p),
        "coco": lambda **p: nemoral.convert(written, tmp_path / "coco", "coco", **p),
    }

    def enough(progress: nemoral.Progress) -> None:
        raise RuntimeError(f"enough of {progress.total}")

    for name, call in calls.items():
        with pytest.raises(RuntimeError, match="enough of 2"):
            call(progress=enough)
        keywords = {"mode": "resume"} if name in ("merge", "kitti", "coco") else {}
        seen: list[nemoral.Progress] = []
        call(progress=seen.append, **keywords)
        assert seen[-1].done == 2 and {p.total for p in seen} == {2}, name
        assert [(p.sequence, p.frame) for p in seen] == FRAMES[-len(seen) :], name
        assert [p.done for p in seen] == [1, 2][-len(seen) :], name
    assert (tmp_path / "whole" / "dataset.json").read_bytes() == (
        written / "dataset.json"
    ).read_bytes()


def test_progress_of_true_is_a_bar_by_tqdm_or_lines(
    written: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Bar:
        made: list[Bar] = []

        def __init__(self, total: int, unit: str) -> None:
            self.total, self.n, self.closed = total, 0, False
            Bar.made.append(self)

        def update(self, more: int) -> None:
            self.n += more

        def close(self) -> None:
            self.closed = True

    package, auto = ModuleType("tqdm"), ModuleType("tqdm.auto")
    setattr(package, "tqdm", Bar)
    setattr(auto, "tqdm", Bar)
    monkeypatch.setitem(sys.modules, "tqdm", package)
    monkeypatch.setitem(sys.modules, "tqdm.auto", auto)
    nemoral.stats(written, progress=True)
    assert [(bar.total, bar.n, bar.closed) for bar in Bar.made] == [(2, 2, True)]
    assert capsys.readouterr().out == ""
    monkeypatch.setitem(sys.modules, "tqdm", None)
    nemoral.stats(written, progress=True)
    assert capsys.readouterr().out == "frame 1 of 2\nframe 2 of 2\n"


def test_all_that_can_be_written_is_read_back(cache: Path, tmp_path: Path) -> None:
    asked = {"sky": True, "flow": True, "trunks": True, "boxes": True, "radiance": True}
    sensors = {
        "cameras": {"right": {"mount_y_m": -0.5}},
        "lidars": {"rear": {"mount_yaw_deg": 180.0, "pulses": 500}},
    }
    config = {"preset": "demo", **SMALL, **{f"camera.{key}": True for key in asked}, **sensors}
    nemoral.generate(config, 7, out=tmp_path / "out", cache=cache)
    forest = nemoral.Forest(config, 7, cache=cache)
    for stored in nemoral.Dataset(tmp_path / "out"):
        assert stored.index is not None
        live = forest.frame(stored.index)
        assert list(stored.cameras) == list(live.cameras) == ["camera", "right"]
        assert list(stored.lidars) == list(live.lidars) == ["lidar", "rear"]
        for name, camera in stored.cameras.items():
            other = live.cameras[name]
            for kind in ("image", "semantic", "instance", "sky", "trunks"):
                assert np.array_equal(getattr(camera, kind), getattr(other, kind)), (name, kind)
            assert np.allclose(camera.depth_m, other.depth_m, atol=1 / 512 + 1e-6)
            assert camera.flow is not None and other.flow is not None
            assert np.array_equal(camera.flow_seen, other.flow_seen)
            within = np.isfinite(camera.flow) & (np.abs(other.flow) < 500)
            assert within.any()
            assert np.abs(camera.flow - other.flow)[within].max() <= 1 / 128 + 1e-4
            assert camera.radiance is not None and other.radiance is not None
            assert np.allclose(camera.radiance, other.radiance, rtol=2e-3, atol=1e-4)
            ours, theirs = camera.boxes, other.boxes
            assert ours is not None and theirs is not None and len(ours["kind"]) > 0
            assert ours["kind"] == theirs["kind"]
            for kind in ("object", "instance", "visible", "whole", "visible_px", "whole_px"):
                assert np.array_equal(ours[kind], theirs[kind]), (name, kind)
            assert np.allclose(ours["size_m"], theirs["size_m"], atol=1e-2)
            assert np.allclose(ours["camera_from_box"], theirs["camera_from_box"], atol=1e-2)
            assert np.allclose(camera.body_from_sensor, other.body_from_sensor)
        for name, lidar in stored.lidars.items():
            assert lidar.points.array.tobytes() == live.lidars[name].points.array.tobytes()


def test_a_damaged_file_is_named(written: Path, tmp_path: Path) -> None:
    import shutil

    copy = tmp_path / "copy"
    shutil.copytree(written, copy)
    path = copy / "sequences" / "00" / "image_2" / "000001.png"
    path.write_bytes(path.read_bytes()[:-1])
    dataset = nemoral.Dataset(copy)
    _ = dataset[0].image
    with pytest.raises(nemoral.DatasetError, match="000001.png"):
        _ = dataset[1].image
    assert not nemoral.check(copy)


def test_progress_may_stop_a_run(cache: Path, tmp_path: Path) -> None:
    def stop(progress: nemoral.Progress) -> None:
        if progress.done == 1:
            raise RuntimeError("enough")

    small = {**SMALL, "frames": 40}
    with pytest.raises(RuntimeError, match="enough"):
        nemoral.generate("demo", out=tmp_path / "out", cache=cache, progress=stop, **small)
    config = {"preset": "demo", **small}
    done = nemoral.generate(
        config, out=tmp_path / "out", cache=cache, mode="resume", frames=[0, 1]
    )
    assert 2 <= done < 40


def test_the_command_line() -> None:
    assert "default" in command("config", "presets").stdout
    assert command("--version").stdout.strip().endswith(nemoral.__version__)
    assert command("generate", "--preset=demon").returncode == 2
