"""Wrong input of every argument is a clear exception, never a panic or an abort."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest
from conftest import SMALL

import nemoral


def test_an_unknown_key_names_the_nearest() -> None:
    with pytest.raises(nemoral.ConfigError) as raised:
        nemoral.Forest("demo", **{"camera.widht_px": 640})
    error = raised.value
    assert error.key == "camera.widht_px" and error.nearest == "width_px"
    assert isinstance(error, ValueError)


def test_a_refused_value_says_what_is_allowed() -> None:
    with pytest.raises(nemoral.ConfigError) as raised:
        nemoral.Forest({"preset": "demo", "terrain": {"octaves": 99}})
    error = raised.value
    assert (error.key, error.value) == ("terrain.octaves", "99")
    assert error.allowed is not None and "16" in error.allowed
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and again.allowed == error.allowed


def test_all_errors_are_told() -> None:
    with pytest.raises(nemoral.ConfigError) as raised:
        nemoral.Forest("demo", **{"terrain.octaves": 99, "sun.elevation_deg": "high"})
    assert {e.key for e in raised.value.errors} == {"terrain.octaves", "sun.elevation_deg"}


def test_an_unknown_preset() -> None:
    with pytest.raises(nemoral.ConfigError, match="did you mean `beech`") as raised:
        nemoral.Forest("beach")
    assert raised.value.nearest == "beech"


@pytest.mark.parametrize(
    ("config", "keywords", "nearest"),
    [
        ("dmeo", {}, "demo"),
        ({"preset": "mediun"}, {}, "medium"),
        ("demo", {"preset": "dmeo"}, "demo"),
        ("demo", {"chace": True}, "cache"),
        ("demo", {"camera_width_px": 96}, "camera.width_px"),
        ({"preset": "demo", "camera_width_px": 96}, {}, "camera.width_px"),
        ({"preset": "demo", "terain": {"octaves": 3}}, {}, "terrain"),
    ],
)
def test_misspelled_names(config: Any, keywords: dict[str, Any], nearest: str) -> None:
    with pytest.raises(nemoral.ConfigError, match=f"did you mean `{nearest}`") as raised:
        nemoral.Forest(config, **keywords)
    assert raised.value.nearest == nearest


def test_misspelled_keywords_of_generate(tmp_path: Path) -> None:
    with pytest.raises(nemoral.ConfigError, match="did you mean `progress`"):
        nemoral.generate("demo", out=tmp_path / "out", progess=True)
    with pytest.raises(nemoral.ConfigError, match="one of data_sheet") as raised:
        nemoral.Scanner("avia", noise="laconta")
    assert raised.value.nearest == "laconte"


def test_frames_that_do_not_exist(forest: nemoral.Forest, written: Path) -> None:
    dataset = nemoral.Dataset(written)
    absent: list[Callable[[], object]] = [
        lambda: forest.frame(-1),
        lambda: forest.frame(2),
        lambda: forest.pose(2),
        lambda: forest.frame(0, sequence=1),
        lambda: forest.trees(0, 0, 1, 1, sequence=-1),
        lambda: forest[2],
        lambda: forest[-3],
        lambda: dataset.frame(-1),
        lambda: dataset.frame(0, sequence=1),
        lambda: dataset[2],
        lambda: dataset.config(1),
        lambda: dataset.poses(1),
        lambda: dataset.times_s(2**40),
        lambda: dataset.trees(1),
        lambda: dataset.objects(-1),
    ]
    for call in absent:
        with pytest.raises(IndexError, match=r"frame|sequence"):
            call()
    with pytest.raises(IndexError, match="there are 2 frames; frames=31 in the config makes more"):
        forest.frame(30)


def test_errors_speak_python(forest: nemoral.Forest, written: Path, tmp_path: Path) -> None:
    cases: list[tuple[Callable[[], object], str]] = [
        (lambda: forest.observe(np.eye(4) + 1e8 * np.outer(np.eye(4)[2], np.eye(4)[3])), "m high"),
        (lambda: forest.observe(np.eye(4), velocity=(1e3, 0, 0)), "velocity"),
        (lambda: forest.observe(np.eye(4), turn_rate=(1e3, 0, 0)), "turn_rate"),
        (lambda: nemoral.Scanner("avia", pulses=2**31 - 1), "pulses = "),
        (lambda: nemoral.Scanner("avia", rings=9), "rings = 9: must be a whole number from 0 to 8"),
        (lambda: nemoral.Scanner("avia", max_range_m=0.01), "the blind zone"),
        (lambda: nemoral.Terrain(persistence=2), "0 to 1"),
        (lambda: nemoral.generate("demo", out=written), 'mode="resume"'),
        (lambda: nemoral.generate("demo", out=tmp_path / "a", frames=[99]), "the config's `frames`"),
        # What the user named is not reworded.
        (lambda: nemoral.Dataset(tmp_path / "my=resume..=x"), "my=resume..=x"),
    ]
    for call, words in cases:
        with pytest.raises((ValueError, nemoral.Error)) as raised:
            call()
        message = str(raised.value)
        assert words in message, message
        message = message.replace("my=resume..=x", "")
        assert not any(word in message for word in ("--", "..=", "m_s", "per_scan")), message


def test_numpy_arrays_in_a_config() -> None:
    drawn = {"lidar.pulses": np.array([500, 900]), "terrain.scale_m": np.array([90.0, 200.0])}
    plain = {key: value.tolist() for key, value in drawn.items()}
    one = nemoral.Forest("demo", 3, vary=drawn)
    assert one.config() == nemoral.Forest("demo", 3, vary=plain).config()
    assert nemoral.Forest("demo", frames=np.array(7)).frames == 7
    numbers = {"camera.enabled": np.bool_(False), "terrain.scale_m": np.float32(90)}
    config = nemoral.Forest("demo", **numbers).config()
    assert config["camera"]["enabled"] is False and config["terrain"]["scale_m"] == 90.0


def test_rays_far_from_each_other_are_refused(forest: nemoral.Forest) -> None:
    down = [[0, 0, 500, 0, 0, -1.0], [1000, 0, 500, 0, 0, -1.0]]
    with pytest.raises(nemoral.ConfigError, match="visible_radius_m = 30") as raised:
        forest.cast(down)
    assert raised.value.key == "rays[0]"
    assert np.isfinite(forest.cast(down, around=[0, 0])["distance_m"][0])


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no.toml"):
        nemoral.Forest(tmp_path / "no.toml")
    with pytest.raises(nemoral.DatasetError, match="no such folder"):
        nemoral.Dataset(tmp_path / "nothing")


@pytest.mark.parametrize(
    "config",
    [
        7,
        b"demo",
        {"terrain": 3},
        {3: 4},
        {"a b": 1},
        {"": 1},
        {"terrain..octaves": 1},
        {"terrain": {"octaves": None}},
        {"terrain": {"octaves": object()}},
        {"seed": 2**80},
        {"seed": float("nan")},
        {"terrain": {"scale_m": float("nan")}},
        {"terrain": {"scale_m": np.inf}},
        {"camera": {"sun\n": 1}},
        {"preset": 3},
        {"lidar": {"table": {"path": "/nonexistent"}}},
        {"frames": True},
        {"frames": [1]},
        "demo\0",
        "",
    ],
)
def test_what_is_no_config(config: Any) -> None:
    with pytest.raises((nemoral.ConfigError, TypeError, FileNotFoundError)):
        nemoral.Forest(config)


def test_numpy_numbers_are_numbers() -> None:
    forest = nemoral.Forest("demo", np.int64(3), **{**SMALL, "camera.width_px": np.uint16(96)})
    assert forest.seed == 3 and forest.config()["camera"]["width_px"] == 96


NAN, INF = float("nan"), float("inf")


def masked(alpha: Any) -> int:
    uv = [[0, 0], [1, 0], [0, 1]]
    return nemoral.RayScene().add_mesh(np.eye(3), [[0, 1, 2]], uv=uv, alpha=alpha)


def scan(*pose: Any, **motion: Any) -> nemoral.Scan:
    return nemoral.Scanner("avia", pulses=5).scan(nemoral.RayScene(), *pose, **motion)


WRONG: dict[str, Callable[[nemoral.Forest], object]] = {
    "seed": lambda f: nemoral.Forest("demo", -1),
    "seed of text": lambda f: nemoral.Forest("demo", "7"),  # type: ignore[arg-type]
    "backend": lambda f: nemoral.Forest("demo", backend="tpu"),
    "backend of none": lambda f: nemoral.Forest("demo", backend=None),  # type: ignore[arg-type]
    "cache": lambda f: nemoral.Forest("demo", cache=3.5),  # type: ignore[arg-type]
    "k none": lambda f: f.frame(None),  # type: ignore[arg-type]
    "i a slice": lambda f: f[0:1],  # type: ignore[index]
    "k real": lambda f: f.frame(0.0),  # type: ignore[arg-type]
    "pose": lambda f: f.observe([1, 2]),
    "pose text": lambda f: f.observe("here"),  # type: ignore[arg-type]
    "pose nan": lambda f: f.observe([NAN, 0, 0]),
    "pose far": lambda f: f.observe([1e30, 0, 0]),
    "pose scaled": lambda f: f.observe(2 * np.eye(4)),
    "pose mirrored": lambda f: f.observe(np.diag([1, 1, -1, 1])),
    "pose projective": lambda f: f.observe(np.ones((4, 4))),
    "time_s": lambda f: f.observe(np.eye(4), time_s=NAN),
    "time_s past": lambda f: f.observe(np.eye(4), time_s=-1),
    "index": lambda f: f.observe(np.eye(4), index=-1),
    "velocity": lambda f: f.observe(np.eye(4), velocity=(INF, 0, 0)),
    "turn_rate": lambda f: f.observe(np.eye(4), turn_rate=(0, 0)),
    "stand": lambda f: f.stand(NAN, 0, 0),
    "heading": lambda f: f.stand(0, 0, INF),
    "ground": lambda f: f.ground(NAN, 0),
    "ground far": lambda f: f.ground(1e300, 0),
    "ground shapes": lambda f: f.ground([1, 2], [1, 2, 3]),
    "trees": lambda f: f.trees(1, 0, 0, 0),
    "trees nan": lambda f: f.trees(NAN, 0, 0, 0),
    "trees many": lambda f: f.trees(-1e6, -1e6, 1e6, 1e6),
    "rays": lambda f: f.cast([[1, 2, 3]]),
    "rays zero": lambda f: f.cast([[0, 0, 0, 0, 0, 0]]),
    "rays nan": lambda f: f.cast([[0, 0, NAN, 0, 0, 1]]),
    "around": lambda f: f.cast([[0, 0, 0, 0, 0, 1]], around=[NAN, 0]),
    "frames": lambda f: nemoral.generate("demo", out="x", frames=0),
    "frames none": lambda f: nemoral.generate("demo", out="x", frames=[]),
    "frames back": lambda f: nemoral.generate("demo", out="x", frames=range(3, 1)),
    "frames far": lambda f: nemoral.generate("demo", out="x", frames=[999]),
    "shard": lambda f: nemoral.generate("demo", out="x", shard=(2, 2)),
    "mode": lambda f: nemoral.generate("demo", out="x", mode="append"),
    "out": lambda f: nemoral.generate("demo", out=""),
    "progress": lambda f: nemoral.generate("demo", out="x", progress=3),  # type: ignore[arg-type]
    "parts": lambda f: nemoral.merge("abc", "out"),
    "parts none": lambda f: nemoral.merge([], "out"),
    "voxel_m": lambda f: nemoral.cloud("x", voxel_m=-1),
    "estimated": lambda f: nemoral.cloud("x", estimated_poses="y"),  # type: ignore[arg-type]
    "poses": lambda f: nemoral.cloud("x", estimated_poses=True, poses="y"),
    "format": lambda f: nemoral.convert("x", "y", "kity"),
    "min_px": lambda f: nemoral.convert("x", "y", "yolo", min_px=-1),
    "dataset": lambda f: nemoral.Dataset(3),  # type: ignore[arg-type]
    "vertices": lambda f: nemoral.RayScene().add_mesh([[0, 0]], [[0, 1, 2]]),
    "vertices nan": lambda f: nemoral.RayScene().add_mesh([[NAN, 0, 0]] * 3, [[0, 1, 2]]),
    "triangles": lambda f: nemoral.RayScene().add_mesh(np.eye(3), [[0, 1, 3]]),
    "triangles negative": lambda f: nemoral.RayScene().add_mesh(np.eye(3), [[0, 1, -1]]),
    "triangles real": lambda f: nemoral.RayScene().add_mesh(np.eye(3), [[0, 1, 1.5]]),
    "triangles none": lambda f: nemoral.RayScene().add_mesh(np.eye(3), np.zeros((0, 3), int)),
    "uv": lambda f: nemoral.RayScene().add_mesh(np.eye(3), [[0, 1, 2]], uv=[[0, 0]]),
    "alpha wide": lambda f: masked(np.full((2, 2), 300, np.uint16)),
    "alpha list": lambda f: masked([[0, 1], [1, 0]]),
    "alpha nan": lambda f: masked([[NAN, 1.0]]),
    "alpha bytes as floats": lambda f: masked([[255.0, 0.0]]),
    "alpha": lambda f: nemoral.RayScene().add_mesh(np.eye(3), [[0, 1, 2]], alpha=[[True]]),
    "reflectance": lambda f: nemoral.RayScene().add_mesh(np.eye(3), [[0, 1, 2]], reflectance=2),
    "mesh": lambda f: nemoral.RayScene().add_instances(0, np.eye(4)),
    "rays of a scene": lambda f: nemoral.RayScene().cast([1, 2, 3]),
    "origin": lambda f: nemoral.RayScene([NAN, 0, 0]),
    "origin far": lambda f: nemoral.RayScene([1e9, 0, 0]),
    "origin flat": lambda f: nemoral.RayScene([0, 0]),
    "vertices far": lambda f: nemoral.RayScene().add_mesh(np.eye(3) + 5e6, [[0, 1, 2]]),
    "rays far": lambda f: nemoral.RayScene().cast([0, 5e6, 0, 0, 0, 1]),
    "rays too long": lambda f: nemoral.RayScene().cast([0, 0, 0, 3.4e38, 3.4e38, 0]),
    "rays too short": lambda f: nemoral.RayScene().occluded([0, 0, 0, 0, 1e-31, 0]),
    "rays of nan": lambda f: nemoral.RayScene().cast([NAN] * 6),
    "tnear": lambda f: nemoral.RayScene().cast(np.ones((1, 6)), tnear=2, tfar=1),
    "device": lambda f: nemoral.Scanner("avis"),
    "noise": lambda f: nemoral.Scanner("avia", noise="loud"),
    "pulses": lambda f: nemoral.Scanner("avia", pulses=0),
    "rings": lambda f: nemoral.Scanner("avia", rings=200),
    "max_range_m": lambda f: nemoral.Scanner("avia", max_range_m=NAN),
    "scene": lambda f: nemoral.Scanner("avia").scan(None),  # type: ignore[arg-type]
    "scan pose": lambda f: nemoral.Scanner("avia").scan(nemoral.RayScene(), np.zeros((4, 4))),
    "scan pose far": lambda f: scan(np.eye(4) + 5e6 * np.eye(4, k=3)),
    "scan velocity": lambda f: scan(velocity=(INF, 0, 0)),
    "scan turn_rate": lambda f: scan(turn_rate=(0, 0, 11)),
    "scan turn_rate flat": lambda f: scan(turn_rate=(0, 1)),
    "deskew": lambda f: nemoral.Scanner("avia", deskew=1),  # type: ignore[arg-type]
    "octaves": lambda f: nemoral.Terrain(octaves=0),
    "terrain place": lambda f: nemoral.Terrain().height_m(INF, 0),
    "radius_m": lambda f: nemoral.poisson_disks([0, 0], [1, 1], 0),
    "radius_m back": lambda f: nemoral.poisson_disks([0, 0], [1, 1], (2, 1)),
    "disks": lambda f: nemoral.poisson_disks([0, 0], [1e7, 1e7], 0.01),
    "low": lambda f: nemoral.poisson_disks([NAN, 0], [1, 1]),
    "species": lambda f: nemoral.grow_tree("palm"),
    "dbh_m": lambda f: nemoral.grow_tree("beech", dbh_m=NAN),
    "cards_max": lambda f: nemoral.grow_tree("beech", cards_max=0),
    "noise key": lambda f: nemoral.Scanner("avia", noise={"model": "paper", "sigma": 1}),
    "noise number": lambda f: nemoral.Scanner("avia", noise={"model": "paper", "sigma_m": -1}),
    "threads": lambda f: nemoral.set_threads(0),
    "threads negative": lambda f: nemoral.set_threads(-1),
    "threads real": lambda f: nemoral.set_threads(1.0),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_arguments(name: str, forest: nemoral.Forest, tmp_path: Path,
                         monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises((ValueError, TypeError, nemoral.Error, OSError)) as raised:
        WRONG[name](forest)
    assert "defect" not in str(raised.value) and str(raised.value)
    assert list(tmp_path.iterdir()) == []


def test_the_first_of_several_wrong_rays_is_named() -> None:
    scene = nemoral.RayScene()
    scene.add_mesh(np.eye(3), [[0, 1, 2]])
    # Each thread has several tasks of 2**15 rays.
    rays = np.ones((10 * 2**15, 6), np.float32)
    for first in (9 * 2**15 + 5, 2 * 2**15 - 1, 7):
        rays[first, 3] = np.nan
        rays[first + 1 : first + 3, 5] = np.inf
        for query in (scene.cast, scene.occluded):
            for _ in range(5):
                with pytest.raises(nemoral.ConfigError) as raised:
                    query(rays)
                assert raised.value.key == f"rays[{first}]"


def test_control_c_interrupts_at_once(cache: Path) -> None:
    code = f"""
import nemoral, signal, sys, time
# Who starts the tests in the background may have had interrupts ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
forest = nemoral.Forest("demo", cache={str(cache)!r}, **{{"camera.width_px": 3000,
    "camera.height_px": 3000, "camera.edge_samples": 16}})
print("ready", flush=True)
start = time.monotonic()
try:
    forest.frame(0)
except KeyboardInterrupt:
    print(f"interrupted {{time.monotonic() - start:.1f}}", flush=True)
    import os
    os._exit(0)
"""
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.5)
    asked = time.monotonic()
    os.kill(process.pid, signal.SIGINT)
    line = process.stdout.readline()
    assert line.startswith("interrupted") and time.monotonic() - asked < 2
    process.wait(timeout=60)


def test_only_numpy_is_imported() -> None:
    code = "import nemoral, sys; assert 'torch' not in sys.modules; print(len(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
