"""Reads `nemoral convert --to mcap` by mcap-ros2-support, and compares it with the data set.

    python read_mcap.py DATASET CONVERTED

Needs numpy, pillow, plyfile, mcap-ros2-support.
"""

import json
import sys
from pathlib import Path

import numpy as np
from common import cameras, lidars, matrix, metres, mount
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from PIL import Image
from plyfile import PlyData

# What is added to the times of a sequence.
START_NS = 10**9
TYPES = {4: "<u2", 6: "<u4", 7: "<f4"}


def transform(value):
    t, q = value.translation, value.rotation
    return mount({"translation_m": [t.x, t.y, t.z], "rotation_xyzw": [q.x, q.y, q.z, q.w]})


def cloud(message):
    names = [f.name for f in message.fields]
    formats = [TYPES[f.datatype] for f in message.fields]
    offsets = [f.offset for f in message.fields]
    layout = dict(names=names, formats=formats, offsets=offsets, itemsize=message.point_step)
    points = np.frombuffer(bytes(message.data), np.dtype(layout))
    assert len(points) == message.width * message.height
    return points


def check_times(found, scan, stamp_ns, frame_ns, deskewed):
    """Compares the stamp and the times of points with when these were fired."""
    if deskewed:
        assert stamp_ns == frame_ns and not {"t", "time"} & set(found.dtype.names)
        return
    assert (found["time"] >= 0).all()
    assert abs(found["time"] - found["t"] * 1e-9).max() < 1e-8
    fired_ns = frame_ns + np.rint(scan["t"] * 1e9).astype(np.int64)
    assert (stamp_ns + found["t"].astype(np.int64) == fired_ns).all()


def turned(first, last):
    """The axis of the rotation from one pose to another in the world, times the angle's sine."""
    m = last[:3, :3] @ first[:3, :3].T
    return np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]) / 2


def check_twist(twist, times, frames, time):
    """Compares velocities, in the world, with the frames around; the data set has the whole drive.
    """
    at = times.index(time)
    a, b = (frames[times[i]] for i in (max(at - 1, 0), min(at + 1, len(times) - 1)))
    first, last = matrix(a["world_from_body"]), matrix(b["world_from_body"])
    seconds = b["time_s"] - a["time_s"]
    velocity, rate = twist
    assert np.allclose(velocity, (last - first)[:3, 3] / seconds, atol=1e-9)
    size = np.linalg.norm(rate) * seconds
    assert np.allclose(rate * seconds * np.sinc(size / np.pi), turned(first, last), atol=1e-9)


def check_state(twist, lever, states, time_s):
    """Compares velocities, in the world, with the true states of the unit, which is at `lever`."""
    velocity, rate = twist
    times = states[:, 0] * 1e-9
    # A drive may end a little after the last state.
    if time_s > times[-1]:
        return
    truth = [np.interp(time_s, times, states[:, i]) for i in (8, 9, 10)]
    assert np.allclose(velocity + np.cross(rate, lever), truth, atol=1e-6)
    k = np.searchsorted(times, time_s, "right") - 1
    near = slice(max(k - 1, 0), k + 3)
    poses = [mount({"translation_m": [0, 0, 0], "rotation_xyzw": s[[5, 6, 7, 4]]})
             for s in states[near]]
    rates = [turned(*pair) for pair in zip(poses, poses[1:])] / np.diff(times[near])[:, None]
    assert (rate > rates.min(axis=0) - 1e-3).all() and (rate < rates.max(axis=0) + 1e-3).all()


def check_imu(raw, message, readings, unit):
    """Compares a reading with the line of `imu0/data.csv` that has its time."""
    _, *measured = readings[raw.log_time]
    rate, force = message.angular_velocity, message.linear_acceleration
    assert measured == [rate.x, rate.y, rate.z, force.x, force.y, force.z]
    assert message.header.frame_id == "imu" and message.orientation_covariance[0] == -1
    variance = message.linear_acceleration_covariance[8]
    assert np.isclose(variance, unit["specific_force_noise_m_s2"] ** 2)


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    count = points = pictures = 0
    files = sorted(out.glob("*/*.mcap"))
    assert len(files) == len(manifest["sequences"])
    for file in files:
        sequence = int(file.parent.name)
        source = dataset / "sequences" / file.parent.name
        frames = {START_NS + round(f["time_s"] * 1e9): f for f in manifest["frames"]
                  if f["sequence"] == sequence}
        sensors = {l["name"]: l["body_from_lidar"] for l in lidars(manifest, sequence)}
        sensors |= {c["name"]: c["body_from_camera"] for c in cameras(manifest, sequence)}
        unit = next(s for s in manifest["sequences"] if s["number"] == sequence).get("imu")
        readings = {}
        if unit:
            sensors["imu"] = unit["body_from_imu"]
            table = np.loadtxt(source / "imu0" / "data.csv", delimiter=",")
            states = np.loadtxt(source / "state_groundtruth_estimate0" / "data.csv", delimiter=",")
            readings = {START_NS + int(row[0]): row.tolist() for row in table}
        specs = {c["name"]: c for c in cameras(manifest, sequence)}
        deskewed = {l["name"]: l["deskewed"] for l in lidars(manifest, sequence)}
        firsts = {lidars(manifest, sequence)[0]["name"]} if lidars(manifest, sequence) else set()
        firsts |= {cameras(manifest, sequence)[0]["name"]} if specs else set()
        seen = {}
        with open(file, "rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            summary = reader.get_summary()
            assert len(summary.chunk_indexes) == len(frames)
            for _, channel, raw, message in reader.iter_decoded_messages():
                seen[channel.topic] = seen.get(channel.topic, 0) + 1
                count += 1
                if channel.topic == "/imu":
                    check_imu(raw, message, readings, unit)
                    continue
                frame = frames[raw.log_time]
                name = f"{frame['index']:06}"
                if channel.topic == "/tf_static":
                    for t in message.transforms:
                        assert t.header.frame_id == "base_link"
                        pose = mount(sensors.pop(t.child_frame_id))
                        assert abs(transform(t.transform) - pose).max() < 1e-12
                    assert not sensors
                    continue
                if channel.topic == "/label_info":
                    names = {c.class_id: c.class_name for c in message.class_map}
                    assert names == {c["id"]: c["name"] for c in manifest["ontology"]["classes"]}
                    continue
                stamp = getattr(message, "header", None) or message.transforms[0].header
                time = stamp.stamp.sec * 10**9 + stamp.stamp.nanosec
                is_scan = channel.topic.endswith("/points")
                assert time == raw.log_time or is_scan
                body = matrix(frame["world_from_body"])
                if channel.topic == "/tf":
                    assert message.transforms[0].child_frame_id == "base_link"
                    assert abs(transform(message.transforms[0].transform) - body).max() < 1e-9
                    continue
                if channel.topic == "/odom":
                    p = message.pose.pose.position
                    assert abs(np.array([p.x, p.y, p.z]) - body[:3, 3]).max() < 1e-9
                    linear, angular = message.twist.twist.linear, message.twist.twist.angular
                    twist = [body[:3, :3] @ [v.x, v.y, v.z] for v in (linear, angular)]
                    assert not any(message.twist.covariance)
                    if unit:
                        lever = body[:3, :3] @ mount(unit["body_from_imu"])[:3, 3]
                        check_state(twist, lever, states, frame["time_s"])
                    else:
                        check_twist(twist, sorted(frames), frames, time)
                    continue
                _, sensor, what = channel.topic.split("/")
                assert stamp.frame_id == sensor
                folder = source if sensor in firsts else source / sensor
                if what == "points":
                    scan = PlyData.read(folder / "points" / f"{name}.ply")["vertex"].data
                    found = cloud(message)
                    for a, b in [("x", "x"), ("y", "y"), ("z", "z"), ("intensity", "intensity"),
                                 ("ring", "ring"), ("label", "class")]:
                        assert (found[a] == scan[b]).all(), a
                    check_times(found, scan, time, raw.log_time, deskewed[sensor])
                    assert abs(found["range"] - scan["range"] * 1e3).max() < 0.51
                    assert abs(found["reflectivity"] - scan["intensity"] * 100).max() < 0.51
                    id_ = (scan["chunk_x"] % 16 << 20) | (scan["chunk_y"] % 16 << 16) | scan["item"]
                    assert (found["instance"] == np.where(scan["item"] == 0, 0, id_)).all()
                    points += len(found)
                elif what == "camera_info":
                    k = specs[sensor]["intrinsics"]
                    expected = [k["fx"], 0, k["cx"] - 0.5, 0, k["fy"], k["cy"] - 0.5, 0, 0, 1]
                    assert np.allclose(message.k, expected) and message.width == k["width"]
                    shift = message.p[3] / -k["fx"]
                    assert np.isclose(shift, 0.3 if sensor == "right" else 0), message.p
                    lens = k.get("distortion", {"model": "none"})
                    models = {"fisheye": "equidistant"}
                    assert message.distortion_model == models.get(lens["model"], "plumb_bob")
                else:
                    shape = (message.height, message.width)
                    data = bytes(message.data)
                    if what == "depth":
                        depth = folder / "depth" / name
                        if depth.with_suffix(".npy").exists():
                            truth = np.load(depth.with_suffix(".npy"))
                        else:
                            truth = metres(Image.open(depth.with_suffix(".png")))
                        found = np.frombuffer(data, "<f4").reshape(shape)
                        assert message.encoding == "32FC1"
                        # Where nothing is, depth is infinite (REP 117).
                        assert (found == np.where(truth > 0, truth, np.inf)).all()
                    elif what == "instance":
                        rgb = np.asarray(Image.open(folder / "instance" / f"{name}.png"))
                        truth = rgb.astype(np.int32) @ [1, 256, 65536]
                        assert message.encoding == "32SC1"
                        assert (np.frombuffer(data, "<i4").reshape(shape) == truth).all()
                    elif what == "semantic":
                        truth = np.asarray(Image.open(folder / "semantic" / f"{name}.png"))
                        assert (np.frombuffer(data, np.uint8).reshape(shape) == truth).all()
                    elif sensor in firsts:
                        truth = np.asarray(Image.open(folder / "image_2" / f"{name}.png"))
                        assert message.encoding == "rgb8"
                        assert (np.frombuffer(data, np.uint8).reshape(*shape, 3) == truth).all()
                    pictures += 1
        # The drive of this data set is as long as its frames.
        assert seen.pop("/imu", 0) == len(readings)
        assert seen.pop("/tf_static") == seen.pop("/label_info") == 1
        assert set(seen.values()) == {len(frames)}, seen
    print(f"mcap: {count} messages, {points} points, {pictures} pictures equal")


main(*sys.argv[1:])
