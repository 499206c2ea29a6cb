"""Reads `nemoral convert --to nuscenes` by nuscenes-devkit, and compares it with the data set.

    python read_nuscenes.py DATASET CONVERTED

Needs numpy, nuscenes-devkit, pillow, scipy. Each box is projected by the development kit's own
code, and its hull must hold the visible pixels of its object.
"""

import json
import sys
from pathlib import Path

import numpy as np
from common import cameras, frames, lidars, mount
from nuscenes.nuscenes import NuScenes
from nuscenes.utils.data_classes import LidarPointCloud
from nuscenes.utils.geometry_utils import BoxVisibility, points_in_box, view_points
from nuscenes.utils.splits import get_scenes_of_split
from PIL import Image
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

VERSION = "v1.0-trainval"


def instance_map(path):
    rgb = np.asarray(Image.open(path)).astype(np.uint32)
    return rgb[..., 0] + 256 * rgb[..., 1] + 65536 * rgb[..., 2]


def folder_of(dataset, sequence, index, name):
    """Where the truth of a camera is."""
    folder = dataset / "sequences" / f"{sequence:02}"
    return folder if index == 0 else folder / name


def inside(hull_px, pixels):
    """How far pixels are outside of the convex hull of points, the most of all; 0 inside."""
    hull = ConvexHull(hull_px)
    return (hull.equations[:, :2] @ pixels.T + hull.equations[:, 2:]).max(0)


def rows_of(path):
    header, *rows = [line.split(",") for line in path.read_text().splitlines()]
    return [dict(zip(header, row)) for row in rows]


def check_boxes(nusc, sample, dataset, manifest, frame, totals):
    """Boxes are the union of the cameras' rows, and hold the pixels of their objects."""
    sequence = frame["sequence"]
    objects = {i["token"]: i for i in nusc.instance}
    boxes = {}
    for token in sample["anns"]:
        record = nusc.get("sample_annotation", token)
        instance = objects[record["instance_token"]]
        boxes[instance["object"]] = record | {"image_id": instance["image_id"]}
    rows = {}
    for i, camera in enumerate(cameras(manifest, sequence)):
        folder = folder_of(dataset, sequence, i, camera["name"])
        table = folder / "boxes" / f"{frame['index']:06}.csv"
        if not table.exists():
            continue
        pose = frame["pose"] @ mount(camera["body_from_camera"])
        for row in rows_of(table):
            rows.setdefault(int(row["object"]), []).append((row, pose))
    assert boxes.keys() == rows.keys()
    for object_, seen in rows.items():
        record = boxes[object_]
        most = max(int(r["visible_px"]) / int(r["whole_px"]) for r, _ in seen)
        level = 1 + sum(most > share for share in (0.4, 0.6, 0.8))
        assert int(record["visibility_token"]) == level
        w, x, y, z = record["rotation"]
        turn = Rotation.from_quat([x, y, z, w])
        for row, pose in seen:
            middle = [float(row[k]) for k in ("x_m", "y_m", "z_m")] + [1]
            apart = np.abs((pose @ middle)[:3] - record["translation"]).max()
            assert apart < 1e-3, apart
            size = [float(row[k]) for k in ("width_m", "length_m", "height_m")]
            assert np.allclose(size, record["size"], atol=1e-9)
            own = Rotation.from_quat([float(row[k]) for k in ("qx", "qy", "qz", "qw")])
            turned = (turn.inv() * Rotation.from_matrix(pose[:3, :3]) * own).magnitude()
            assert turned < 1e-5, turned
            totals["apart"] = max(totals["apart"], apart)
        totals["boxes"] += 1
    for i, camera in enumerate(cameras(manifest, sequence)):
        channel = channel_of(camera, i, "CAM", "CAM_FRONT")
        data = sample["data"][channel]
        folder = folder_of(dataset, sequence, i, camera["name"])
        name = f"{frame['index']:06}"
        path, found, k = nusc.get_sample_data(data, BoxVisibility.NONE)
        # image_3 is the folder of the camera that is called `right`.
        picture = folder / "image_2" / f"{name}.png"
        if camera["name"] == "right" and i > 0:
            picture = folder.parent / "image_3" / f"{name}.png"
        assert Path(path).read_bytes() == picture.read_bytes()
        totals["pictures"] += 1
        ids = instance_map(folder / "instance" / f"{name}.png")
        annotation = {b["token"]: b for b in boxes.values()}
        for box in found:
            corners = box.corners()
            rows_px, columns_px = np.nonzero(ids == annotation[box.token]["image_id"])
            if len(rows_px) == 0 or corners[2].min() < 0.1:
                continue
            hull = view_points(corners, k, normalize=True)[:2].T
            outside = inside(hull, np.column_stack([columns_px, rows_px]))
            totals["pixels"] += len(outside)
            # A pixel's centre is what is seen; rows of a data set have metres to four digits.
            totals["outside"] += int((outside > 0.5).sum())
            totals["hulls"] += 1
            # A hull that is moved by a fifth of the picture would not hold them.
            moved = inside(hull + [ids.shape[1] / 5, 0], np.column_stack([columns_px, rows_px]))
            totals["moved"] += int((moved > 0.5).sum())


def check_scan(nusc, sample, dataset, manifest, frame, totals):
    """Points are the data set's, and counts of boxes those of their objects' labels."""
    sequence = frame["sequence"]
    if not lidars(manifest, sequence):
        return
    source = dataset / "sequences" / f"{sequence:02}"
    name = f"{frame['index']:06}"
    token = sample["data"]["LIDAR_TOP"]
    cloud = LidarPointCloud.from_file(nusc.get_sample_data_path(token)).points
    own = np.fromfile(source / "velodyne" / f"{name}.bin", "<f4").reshape(-1, 4)
    assert (cloud[:3].T == own[:, :3]).all()
    assert np.allclose(cloud[3], np.clip(100 * own[:, 3], 0, 255), atol=1e-4)
    words = np.fromfile(source / "labels" / f"{name}.label", "<u4")
    classes = np.fromfile(
        Path(nusc.dataroot) / "lidarseg" / VERSION / f"{token}_lidarseg.bin", np.uint8
    )
    names = {c["index"]: c["name"] for c in nusc.category}
    ours = {c["id"]: c["name"] for c in manifest["ontology"]["classes"]}
    for class_ in np.unique(words & 0xFFFF):
        assert {names[i] for i in np.unique(classes[words & 0xFFFF == class_])} == {ours[class_]}
    pose = nusc.get("ego_pose", nusc.get("sample_data", token)["ego_pose_token"])
    assert np.allclose(pose["translation"], frame["pose"][:3, 3], atol=1e-9)
    # The ids of .label files, by the rule of docs/reference/files.md.
    chunk = frame["sensor_chunks"][0]
    labels = np.bincount(words >> 16, minlength=65536)
    boxes = {b.token: b for b in nusc.get_sample_data(token)[1]}
    for annotation in sample["anns"]:
        record = nusc.get("sample_annotation", annotation)
        object_ = nusc.get("instance", record["instance_token"])["object"]
        x, y = (object_ >> 38) - (1 << 21), (object_ >> 16 & 0x3FFFFF) - (1 << 21)
        item = object_ & 0xFFFF
        if abs(x - chunk[0]) > 2 or abs(y - chunk[1]) > 2 or item > 1310:
            continue
        label = (5 * (x % 5) + y % 5) * 1310 + item
        assert record["num_lidar_pts"] == labels[label], object_
        totals["counts"] += record["num_lidar_pts"]
        # The kit's test of points in the LiDAR's frame; ranges have errors, and moss grows on logs.
        mine = cloud[:3, words >> 16 == label]
        totals["held"] += int(points_in_box(boxes[annotation], mine, wlh_factor=1.05).sum())
    totals["points"] += len(own)


def channel_of(sensor, index, prefix, first):
    return first if index == 0 else f"{prefix}_{sensor['name'].upper().replace('-', '_')}"


def check_channels(nusc, scene, manifest, sequence):
    """Each channel's data are a chain over the samples of the scene, and end with it."""
    channels = {
        channel_of(c, i, "CAM", "CAM_FRONT") for i, c in enumerate(cameras(manifest, sequence))
    } | {channel_of(s, i, "LIDAR", "LIDAR_TOP") for i, s in enumerate(lidars(manifest, sequence))}
    samples, token = [], scene["first_sample_token"]
    while token:
        samples.append(nusc.get("sample", token))
        assert samples[-1]["scene_token"] == scene["token"]
        token = samples[-1]["next"]
    assert all(set(s["data"]) == channels for s in samples)
    for channel in channels:
        before, token = "", samples[0]["data"][channel]
        for sample in samples:
            data = nusc.get("sample_data", token)
            assert token == sample["data"][channel] and data["prev"] == before
            assert data["timestamp"] == sample["timestamp"]
            before, token = token, data["next"]
        assert token == "", channel


def check_times(nusc):
    """Scenes follow one another: sorted by time, samples are those of one scene after another."""
    samples = sorted(nusc.sample, key=lambda s: s["timestamp"])
    scenes = [s["scene_token"] for s in samples]
    changes = sum(a != b for a, b in zip(scenes, scenes[1:]))
    assert changes == len(nusc.scene) - 1
    logs = {s["log_token"] for s in nusc.scene}
    assert len(logs) == len(nusc.scene) and {t for m in nusc.map for t in m["log_tokens"]} == logs


def check_lidarseg(out):
    """The file that the development kit needs for points' classes is kept beside the tables."""
    colours = json.loads((out / "lidarseg" / "colormap.json").read_text())
    (out / VERSION / "lidarseg.json").write_bytes((out / "lidarseg" / "lidarseg.json").read_bytes())
    try:
        seg = NuScenes(VERSION, str(out), verbose=False, colormap=colours)
        for sample in seg.sample:
            if "LIDAR_TOP" in sample["data"]:
                seg.get_sample_lidarseg_stats(sample["token"])
    finally:
        (out / VERSION / "lidarseg.json").unlink()


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    nusc = NuScenes(VERSION, str(out), verbose=False)
    totals = dict.fromkeys(
        ["boxes", "hulls", "pixels", "outside", "moved", "pictures", "points", "counts", "held"], 0
    ) | {"apart": 0.0}
    of_splits = [get_scenes_of_split(f"nemoral_{s}", nusc) for s in ("train", "val", "test")]
    assert sorted(sum(of_splits, [])) == sorted(s["name"] for s in nusc.scene)
    for scene in nusc.scene:
        sequence = int(scene["name"].rsplit("-", 1)[1])
        mine = frames(manifest, sequence)
        assert scene["nbr_samples"] == len(mine)
        token = scene["first_sample_token"]
        for frame in mine:
            sample = nusc.get("sample", token)
            check_boxes(nusc, sample, dataset, manifest, frame, totals)
            check_scan(nusc, sample, dataset, manifest, frame, totals)
            token = sample["next"]
        assert token == ""
        check_channels(nusc, scene, manifest, sequence)
    check_times(nusc)
    if any(lidars(manifest, s["number"]) for s in manifest["sequences"]):
        check_lidarseg(out)
    share = totals["outside"] / max(totals["pixels"], 1)
    assert share < 0.002, share
    assert totals["moved"] > 0.1 * totals["pixels"]
    held = totals["held"] / max(totals["counts"], 1)
    assert held > 0.97 or totals["counts"] == 0, held
    print(
        f"nuscenes: {totals['boxes']} boxes within {totals['apart']:.1e} m, {totals['hulls']} "
        f"hulls hold all but {100 * share:.3f} % of {totals['pixels']} pixels, "
        f"{totals['points']} points and {totals['pictures']} pictures equal, "
        f"{totals['counts']} points counted, {100 * held:.1f} % of them in their boxes"
    )


main(*sys.argv[1:])
