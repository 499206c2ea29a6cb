"""Reads `nemoral convert --to euroc` by numpy and PyYAML, and compares it with the data set.

    python read_euroc.py DATASET CONVERTED

Needs numpy, pyyaml; evo reads the true states, too, where it is installed.
"""

import json
import sys
from pathlib import Path

import numpy as np
import yaml
from common import cameras, frames, mount, project, scan, spec

START_NS = 10**9


def load(path):
    return yaml.safe_load(path.read_text())


def table(path):
    """The times of a table as text, and its numbers."""
    head, *lines = path.read_text().splitlines()
    assert head.startswith("#timestamp"), head
    rows = [line.split(",") for line in lines]
    assert {len(row) for row in rows} == {len(head.split(","))}
    return [row[0] for row in rows], rows


def t_bs(sensor):
    assert (sensor["T_BS"]["rows"], sensor["T_BS"]["cols"]) == (4, 4)
    data = sensor["T_BS"]["data"]
    assert all(isinstance(v, float) for v in data)
    return np.array(data).reshape(4, 4)


def states(path):
    """Poses of the body by their times."""
    stamps, rows = table(path)
    values = np.array([row[1:] for row in rows], float)
    assert values.shape[1] == 16
    place, (w, x, y, z) = values[:, :3], values[:, 3:7].T
    quaternions = np.column_stack([x, y, z, w])
    poses = [
        mount({"rotation_xyzw": q, "translation_m": p})
        for q, p in zip(quaternions, place, strict=True)
    ]
    return dict(zip(stamps, poses, strict=True))


def lens(sensor):
    """A lens in the words of dataset.json."""
    names = {"radial-tangential": "brown_conrady", "equidistant": "fisheye"}
    model, coefficients = names[sensor["distortion_model"]], sensor["distortion_coefficients"]
    assert len(coefficients) == 4 and all(isinstance(v, float) for v in coefficients)
    keys = ("k1", "k2", "p1", "p2") if model == "brown_conrady" else ("k1", "k2", "k3", "k4")
    return {"model": model, "k3": 0.0} | dict(zip(keys, coefficients))


def read_evo(path, truth):
    try:
        from evo.tools import file_interface
    except ImportError:
        return "evo is not installed"
    found = file_interface.read_euroc_csv_trajectory(str(path))
    found.check()
    worst = max(abs(a - b).max() for a, b in zip(found.poses_se3, truth.values(), strict=True))
    assert worst < 1e-9, worst
    return f"{found.num_poses} states equal in evo"


def check_kalibr(root, sensors, has_unit):
    """The chain of cameras says what their sensor.yaml say, turned the other way."""
    chain = load(root / ("camchain-imucam.yaml" if has_unit else "camchain.yaml"))
    assert list(chain) == [f"cam{i}" for i in range(len(sensors))]
    before = None
    for camera, sensor in zip(chain.values(), sensors, strict=True):
        # What Kalibr checks.
        assert camera["camera_model"] == sensor["camera_model"] == "pinhole"
        assert all(isinstance(v, float) for v in camera["intrinsics"])
        assert all(isinstance(v, int) for v in camera["resolution"])
        assert isinstance(camera["rostopic"], str)
        for key in ("intrinsics", "resolution"):
            assert camera[key] == sensor[key], key
        assert camera["distortion_coeffs"] == sensor["distortion_coefficients"]
        names = {"radtan": "radial-tangential", "equidistant": "equidistant"}
        assert names[camera["distortion_model"]] == sensor["distortion_model"]
        inverse = np.linalg.inv(t_bs(sensor))
        if has_unit:
            assert abs(np.array(camera["T_cam_imu"]) - inverse).max() < 1e-12
            assert camera["timeshift_cam_imu"] == 0.0
        if before is not None:
            assert abs(np.array(camera["T_cn_cnm1"]) @ before - inverse).max() < 1e-12
        before = inverse
    if has_unit:
        ours, kalibr = load(root / "mav0/imu0/sensor.yaml"), load(root / "imu.yaml")
        for key, value in kalibr.items():
            if key == "rostopic":
                assert value == "/imu"
            else:
                assert isinstance(value, float)
                assert ours["rate_hz" if key == "update_rate" else key] == value


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    pictures = poses = points = samples = 0
    worst_pose = worst_px = 0.0
    evo = ""
    for root in sorted(p.parent for p in out.glob("*/mav0")):
        number = int(root.name)
        unit = spec(manifest, number).get("imu")
        source = dataset / "sequences" / root.name
        truth = states(root / "mav0/state_groundtruth_estimate0/data.csv")
        for sensor in ["state_groundtruth_estimate0"] + ["imu0"] * bool(unit):
            yaml_file = load(root / "mav0" / sensor / "sensor.yaml")
            assert (t_bs(yaml_file) == np.eye(4)).all(), sensor
        assert load(root / "mav0/body.yaml")["comment"]
        evo = read_evo(root / "mav0/state_groundtruth_estimate0/data.csv", truth)
        if unit:
            # All but times is as the data set has it.
            for name in ("imu0/data.csv", "state_groundtruth_estimate0/data.csv"):
                stamps, rows = table(root / "mav0" / name)
                _, native = table(source / name)
                assert [row[1:] for row in rows] == [row[1:] for row in native]
                assert [int(s) for s in stamps] == [START_NS + int(row[0]) for row in native]
            samples += len(stamps)
            assert list(truth) == stamps
        sensors = []
        mine = frames(manifest, number)
        for i, camera in enumerate(cameras(manifest, number)):
            folder = root / f"mav0/cam{i}"
            sensor = load(folder / "sensor.yaml")
            sensors.append(sensor)
            assert sensor["comment"].endswith(f", camera {camera['name']}")
            fu, fv, cu, cv = sensor["intrinsics"]
            k = {"fx": fu, "fy": fv, "cx": cu + 0.5, "cy": cv + 0.5}
            k["distortion"] = lens(sensor)
            size = sensor["resolution"]
            assert size == [camera["intrinsics"]["width"], camera["intrinsics"]["height"]]
            stamps, rows = table(folder / "data.csv")
            assert sorted(p.name for p in (folder / "data").iterdir()) == [r[1] for r in rows]
            for stamp, (_, name), frame in zip(stamps, rows, mine, strict=True):
                assert name == f"{stamp}.png" and len(stamp) == 19
                # Seconds and nanoseconds, as Kalibr's bag creator and OKVIS cut them.
                seconds, ns = int(stamp[:-9]), int(stamp[-9:])
                assert abs(seconds - 1 + ns * 1e-9 - frame["time_s"]) < 1e-9
                prefix = "" if i == 0 else camera["name"] + "/"
                native = source / prefix / "image_2" / f"{frame['index']:06}.png"
                if i > 0 and camera["name"] == "right":
                    native = source / "image_3" / native.name
                assert (folder / "data" / name).read_bytes() == native.read_bytes()
                asked = frame["pose"] @ mount(camera["body_from_camera"])
                pictures += 1
                # A unit need not have a sample at every frame's time.
                if stamp in truth:
                    found = truth[stamp] @ t_bs(sensor)
                    worst_pose = max(worst_pose, abs(found - asked).max())
                    poses += 1
                if not spec(manifest, number)["lidars"]:
                    continue
                world = scan(dataset, manifest, frame)
                pixels = project(camera["intrinsics"], (np.linalg.inv(asked) @ world.T).T)
                again = project(k, (np.linalg.inv(asked) @ world.T).T)
                inside = ((pixels > 0) & (pixels < size)).all(1)
                if inside.any():
                    worst_px = max(worst_px, abs(again - pixels)[inside].max())
                points += int(inside.sum())
        if sensors:
            check_kalibr(root, sensors, bool(unit))
    assert pictures == sum(len(cameras(manifest, f["sequence"])) for f in manifest["frames"])
    assert poses > 0 and worst_pose < 1e-6 and worst_px < 1e-6, (worst_pose, worst_px)
    print(
        f"euroc: {pictures} pictures, {samples} samples, {poses} poses of cameras to "
        f"{worst_pose:.1e}, {points} points on the same pixel to {worst_px:.1e}, {evo}"
    )


main(*sys.argv[1:])
