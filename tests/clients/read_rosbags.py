"""Reads the bags of `nemoral convert --to mcap` by rosbags, and compares them with the data set.

    python read_rosbags.py DATASET CONVERTED

Needs numpy, pillow, rosbags.
"""

import json
import sys
from pathlib import Path

import numpy as np
from common import cameras, frames, lidars, metres, mount
from PIL import Image
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from rosbags.rosbag2 import Reader

# What is added to the times of a sequence.
START_NS = 10**9
# PointField's types.
TYPES = {4: "<u2", 6: "<u4", 7: "<f4"}
# What the metadata of a folder and the file in it say of a topic.
COMPARED = ("topic", "msgtype", "msgcount", "ext")


def transform(translation, rotation):
    t, q = translation, rotation
    return mount({"translation_m": [t.x, t.y, t.z], "rotation_xyzw": [q.x, q.y, q.z, q.w]})


def check_metadata(bag, drive, sensors, readings):
    """Opens the folder by its metadata.yaml, and compares them with the file and the data set."""
    files = list(bag.glob("*.mcap"))
    assert len(files) == 1
    with Reader(bag) as folder, Reader(files[0]) as file:
        for reader in (folder, file):
            counts = {topic: info.msgcount for topic, info in reader.topics.items()}
            # Mounts and classes are told once.
            assert counts.pop("/tf_static") == counts.pop("/label_info") == 1
            topics = {f"/{sensor}/{what}" for sensor, all in sensors.items() for what in all}
            topics |= {"/tf", "/odom"}
            assert counts.pop("/imu", 0) == readings
            assert counts == dict.fromkeys(topics, len(drive)), counts
            assert reader.message_count == 2 + len(topics) * len(drive) + readings
            assert reader.start_time == min(drive)
            # rosbags counts the last nanosecond in.
            assert reader.end_time - 1 == max(drive)
        said, found = ([[getattr(c, field) for field in COMPARED] for c in reader.connections]
                       for reader in (folder, file))
        assert said == found
        for connection in folder.connections:
            (offered,) = connection.ext.offered_qos_profiles
            late = connection.topic in ("/tf_static", "/label_info")
            expected = QosDurability.TRANSIENT_LOCAL if late else QosDurability.VOLATILE
            assert offered.durability == expected and offered.depth == 10
        return folder.message_count


def check_points(message, folder, name, time, deskewed):
    """A scan's points, labels and times; returns the number of points."""
    fields = message.fields
    layout = np.dtype(dict(names=[f.name for f in fields], offsets=[f.offset for f in fields],
                           formats=[TYPES[f.datatype] for f in fields],
                           itemsize=message.point_step))
    found = np.frombuffer(message.data.tobytes(), layout)
    points = np.fromfile(folder / "velodyne" / f"{name}.bin", "<f4").reshape(-1, 4)
    classes = np.fromfile(folder / "labels" / f"{name}.label", "<u4") & 0xFFFF
    assert len(found) == len(points) == message.width * message.height
    for i, field in enumerate(["x", "y", "z", "intensity"]):
        assert (found[field] == points[:, i]).all(), field
    assert (found["label"] == classes).all()
    stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    if deskewed:
        assert stamp == time and not {"t", "time"} & set(found.dtype.names)
    else:
        # A scan is centred on its frame's time, but for the gaps between its pulses.
        assert stamp < time and found["t"].max() < 2.01 * (time - stamp)
        assert abs(found["time"] - found["t"] * 1e-9).max() < 1e-8
    return len(found)


def check_picture(message, path):
    """A picture's size, and its pixels; those of depth are metres, infinite for nothing."""
    if path.parent.name == "depth":
        npy = path.with_suffix(".npy")
        depth = np.load(npy) if npy.exists() else metres(Image.open(path))
        truth, encoding = np.where(depth > 0, depth, np.inf).astype("<f4"), "32FC1"
    elif path.parent.name == "instance":
        rgb = np.asarray(Image.open(path)).astype("<i4")
        truth, encoding = (rgb @ [1, 256, 65536]).astype("<i4"), "32SC1"
    else:
        truth = np.asarray(Image.open(path))
        encoding = "mono8" if truth.ndim == 2 else "rgb8"
    assert (message.height, message.width) == truth.shape[:2]
    assert message.encoding == encoding and message.step == message.width * truth[0, 0].nbytes
    assert message.data.tobytes() == truth.tobytes()


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    bags = sorted(path.parent for path in out.glob("*/metadata.yaml"))
    assert [int(bag.name) for bag in bags] == [s["number"] for s in manifest["sequences"]]
    count = points = poses = pictures = 0
    for bag in bags:
        sequence, source = int(bag.name), dataset / "sequences" / bag.name
        drive = {START_NS + round(f["time_s"] * 1e9): f for f in frames(manifest, sequence)}
        scanners, lenses = lidars(manifest, sequence), cameras(manifest, sequence)
        firsts = {all[0]["name"] for all in (scanners, lenses) if all}
        mounts = {s["name"]: mount(s["body_from_lidar"]) for s in scanners}
        mounts |= {s["name"]: mount(s["body_from_camera"]) for s in lenses}
        sensors = {s["name"]: ["points"] for s in scanners}
        of_camera = ["image", "semantic", "instance", "depth", "camera_info"]
        sensors |= {s["name"]: of_camera for s in lenses}
        unit = next(s for s in manifest["sequences"] if s["number"] == sequence).get("imu")
        readings = 0
        if unit:
            mounts["imu"] = mount(unit["body_from_imu"])
            readings = len(np.loadtxt(source / "imu0" / "data.csv", delimiter=","))
        count += check_metadata(bag, drive, sensors, readings)
        read = 0
        with AnyReader([bag]) as reader:
            for connection, time, raw in reader.messages():
                message = reader.deserialize(raw, connection.msgtype)
                read += 1
                if connection.topic == "/imu":
                    assert message.header.frame_id == "imu"
                    continue
                frame, name = drive[time], f"{drive[time]['index']:06}"
                if connection.topic == "/tf_static":
                    found = {t.child_frame_id: t.transform for t in message.transforms}
                    assert found.keys() == mounts.keys()
                    for sensor, t in found.items():
                        pose = transform(t.translation, t.rotation)
                        assert abs(pose - mounts[sensor]).max() < 1e-12
                    continue
                if connection.topic == "/label_info":
                    names = {c.class_id: c.class_name for c in message.class_map}
                    assert names == {c["id"]: c["name"] for c in manifest["ontology"]["classes"]}
                    continue
                header = getattr(message, "header", None) or message.transforms[0].header
                stamp = header.stamp.sec * 10**9 + header.stamp.nanosec
                assert stamp == time or connection.topic.endswith("/points")
                if connection.topic in ("/tf", "/odom"):
                    assert header.frame_id == "map"
                    if connection.topic == "/tf":
                        t = message.transforms[0].transform
                        found = transform(t.translation, t.rotation)
                    else:
                        found = transform(message.pose.pose.position, message.pose.pose.orientation)
                    assert abs(found - frame["pose"]).max() < 1e-9
                    poses += 1
                    continue
                _, sensor, what = connection.topic.split("/")
                assert header.frame_id == sensor
                folder = source if sensor in firsts else source / sensor
                if what == "points":
                    deskewed = next(s["deskewed"] for s in scanners if s["name"] == sensor)
                    points += check_points(message, folder, name, time, deskewed)
                elif what == "camera_info":
                    k = next(c["intrinsics"] for c in lenses if c["name"] == sensor)
                    assert (message.width, message.height) == (k["width"], k["height"])
                    assert message.k[0] == k["fx"] and message.k[5] == k["cy"] - 0.5
                else:
                    kind = "image_2" if what == "image" else what
                    if what == "image" and sensor == "right" and sensor not in firsts:
                        folder, kind = source, "image_3"
                    check_picture(message, folder / kind / f"{name}.png")
                    pictures += 1
            assert read == reader.message_count
    print(f"rosbags: {len(bags)} bags, {count} messages, {points} points, {poses} poses, "
          f"{pictures} pictures equal")


main(*sys.argv[1:])
