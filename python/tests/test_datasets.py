"""Data sets: functions are the commands, and reading gives what was written."""

from __future__ import annotations

from pathlib import Path

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
    assert dataset.config()["camera"]["width_px"] == 96
    assert dataset.sequences[0].seed == 7 and dataset.header["backend"] == "cpu"
    assert len(dataset.trees()["dbh_m"]) > 0 and dataset.frame(1).index == 1
    with pytest.raises(IndexError):
        dataset.frame(2)
    with pytest.raises(IndexError):
        dataset[2]


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
    assert nemoral.convert(out, tmp_path / "kitti", "kitti")[0] == 2
    assert nemoral.report(out, tmp_path / "report.html") > 1000


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
