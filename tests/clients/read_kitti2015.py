"""Reads `nemoral convert --to kitti2015` as its development kit does, by numpy and OpenCV.

    python read_kitti2015.py DATASET CONVERTED

Needs numpy, opencv-python-headless, pillow. Disparities are compared with depth, flow with the
data set's; then the pictures are the judges: the right picture warped by `disp_noc_0`, and the next
one by `flow_noc`, must look like the left one, and much less so if the maps are moved aside.
"""

import csv
import json
import sys
from pathlib import Path

import cv2
import numpy as np
from common import cameras, frames, mount
from PIL import Image


def disparity(path):
    """As the kit reads it: pixels, 0 for none."""
    map_ = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert map_.dtype == np.uint16 and map_.ndim == 2, path
    return map_ / 256.0


def flow(path):
    """As the kit, RAFT and mmflow read it: u, v in pixels, and whether they are valid."""
    bgr = cv2.imread(str(path), cv2.IMREAD_ANYDEPTH | cv2.IMREAD_COLOR)
    assert bgr.dtype == np.uint16, path
    return (bgr[..., :0:-1].astype(float) - 2**15) / 64, bgr[..., 0]


def depth(folder, frame):
    path = folder / "depth" / f"{frame:06}.npy"
    if path.exists():
        return np.load(path).astype(float)
    z = np.asarray(Image.open(path.with_suffix(".png"))) / 256.0
    return np.where(z < 65535 / 256, z, 0)


def shown(z, x, y, far):
    """The rule of disp_noc: nothing is nearer than a place at its pixel, or by the slope there."""
    height, width = z.shape
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    column, row = (np.where(inside, v, 0).astype(int) for v in (x, y))
    inverse = np.divide(1, z, out=np.zeros_like(z), where=z > 0)
    own = inverse[row, column]
    right, down = np.where(inside, x, 0) - column - 0.5, np.where(inside, y, 0) - row - 0.5
    beside = inverse[row, np.clip(column + np.where(right < 0, -1, 1), 0, width - 1)]
    above = inverse[np.clip(row + np.where(down < 0, -1, 1), 0, height - 1), column]
    sloped = own + abs(right) * (beside - own) + abs(down) * (above - own)
    least = far - 0.04 - 0.005 * far
    limit = np.divide(1, least, out=np.full_like(least, np.inf), where=least > 0)
    return inside & (np.minimum(own, sloped) <= limit), inside


def grey(path):
    return np.asarray(Image.open(path).convert("L")).astype(np.float32)


def error(left, other, columns, rows, mask):
    """The mean difference of grey values where the mask is set, after warping."""
    warped = cv2.remap(
        other, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_LINEAR
    )
    return np.abs(warped - left)[mask].mean()


class Judge:
    """How well warped pictures agree with the left one, over all pairs."""

    def __init__(self):
        self.warped, self.aside, self.unwarped, self.hidden, self.pixels = [], [], [], [], 0

    def add(self, left, other, columns, rows, seen, hidden):
        here_columns, here_rows = np.meshgrid(*map(np.arange, left.shape[::-1]))
        self.warped.append(error(left, other, columns, rows, seen))
        self.aside.append(error(left, other, columns + 4, rows, seen))
        self.unwarped.append(error(left, other, here_columns, here_rows, seen))
        if hidden.sum() > 100:
            self.hidden.append(error(left, other, columns, rows, hidden))
        self.pixels += int(seen.sum())

    def verdict(self):
        warped, aside = np.mean(self.warped), np.mean(self.aside)
        assert warped < 0.7 * aside, (warped, aside)
        assert warped < 0.8 * np.mean(self.unwarped), (warped, np.mean(self.unwarped))
        # What the other picture does not show looks unlike what it shows there.
        assert not self.hidden or warped < 0.8 * np.mean(self.hidden)
        hidden = f", {np.mean(self.hidden):.1f} where hidden" if self.hidden else ""
        moved = f"{aside:.1f} moved by 4{hidden}"
        return f"{self.pixels} pixels differ by {warped:.1f} of 255 ({moved})"


def main(dataset, out):
    dataset, out = Path(dataset), Path(out)
    manifest = json.loads((dataset / "dataset.json").read_text())
    training = out / "training"
    with open(out / "pairs.csv", newline="") as file:
        pairs = list(csv.DictReader(file))
    lists = {s: (out / f"{s}.txt").read_text().split() for s in ("train", "val", "test")}
    assert [p["pair"] for p in pairs] == sorted(sum(lists.values(), []))
    stereo, motion = Judge(), Judge()
    worst = 0.0
    agree = judged = shown_next = 0
    for number, pair in enumerate(pairs):
        assert int(pair["pair"]) == number and pair["pair"] in lists[pair["split"]]
        sequence, here, there = (int(pair[k]) for k in ("sequence", "frame", "next_frame"))
        assert there == here + 1
        source = dataset / "sequences" / f"{sequence:02}"
        name = f"{number:06}"
        pictures = {}
        for folder in ("image_2", "image_3"):
            for time, frame in ((10, here), (11, there)):
                copy = training / folder / f"{name}_{time}.png"
                if copy.exists():
                    assert copy.read_bytes() == (source / folder / f"{frame:06}.png").read_bytes()
                    pictures[folder, time] = grey(copy)
        left = pictures["image_2", 10]
        columns, rows = np.meshgrid(*map(np.arange, left.shape[::-1]))
        specs = {c["name"]: c for c in cameras(manifest, sequence)}
        first = cameras(manifest, sequence)[0]
        k = first["intrinsics"]
        if (training / "disp_occ_0").exists():
            maps = {
                m: disparity(training / m / f"{name}_10.png")
                for m in ("disp_occ_0", "disp_noc_0", "disp_occ_1", "disp_noc_1")
            }
            calib = dict(
                line.split(": ")
                for line in (training / "calib_cam_to_cam" / f"{name}.txt").read_text().splitlines()
            )
            shift = [float(calib[f"P_rect_0{i}"].split()[3]) for i in (2, 3)]
            fx_b = shift[0] - shift[1]
            apart = np.linalg.inv(mount(first["body_from_camera"])) @ mount(
                specs["right"]["body_from_camera"]
            )
            assert abs(fx_b - k["fx"] * apart[0, 3]) < 1e-6
            z = depth(source, here)
            expected = np.where(z > 0, fx_b / np.maximum(z, 1e-9), 0)
            expected[(expected > 65535 / 256) | (expected < 0.5 / 256)] = 0
            worst = max(worst, np.abs(maps["disp_occ_0"] - expected).max())
            for time in (0, 1):
                occ, noc = maps[f"disp_occ_{time}"], maps[f"disp_noc_{time}"]
                assert ((noc == 0) | (noc == occ)).all()
            # The next frame's, by the poses of dataset.json.
            poses = {f["index"]: f["pose"] for f in frames(manifest, sequence)}
            m = mount(first["body_from_camera"])
            move = np.linalg.inv(poses[there] @ m) @ poses[here] @ m
            x, y = (columns + 0.5 - k["cx"]) / k["fx"], (rows + 0.5 - k["cy"]) / k["fy"]
            rays = np.stack([x, y, np.ones_like(x)])
            placed = np.einsum("ij,jhw->ihw", move[:3, :3], rays * z) + move[:3, 3, None, None]
            next_ = np.where((z > 0) & (placed[2] > 0), fx_b / placed[2], 0)
            next_[(next_ > 65535 / 256) | (next_ < 0.5 / 256)] = 0
            worst = max(worst, np.abs(maps["disp_occ_1"] - next_).max())
            seen = maps["disp_noc_0"] > 0
            right = depth(source / "right", here)
            rule, _ = shown(right, columns + 0.5 - expected, rows + 0.5, z)
            differ = (seen != (rule & (maps["disp_occ_0"] > 0))).mean()
            # A place may lie on the border of two pixels.
            assert differ < 1e-3, differ
            ahead = placed[2] > 0
            with np.errstate(all="ignore"):
                x = np.where(ahead, k["fx"] * placed[0] / placed[2] + k["cx"], -1)
                y = np.where(ahead, k["fy"] * placed[1] / placed[2] + k["cy"], -1)
            shown_left, inside = shown(depth(source, there), x, y, placed[2])
            shown_right, _ = shown(depth(source / "right", there), x - next_, y, placed[2])
            by_rule = shown_left
            if first["extra"]["flow"]:
                # Flow's rays know it; the rule beside them, as far as the next picture reaches.
                _, state = flow(source / "flow" / f"{here:06}.png")
                by_rule = np.where(state > 0, state == 1, shown_left)
                among = inside & (state > 0) & ahead
                agree += int((shown_left == (state == 1))[among].sum())
                judged += int(among.sum())
            rule = by_rule & shown_right & (maps["disp_occ_1"] > 0)
            differ = ((maps["disp_noc_1"] > 0) != rule).mean()
            assert differ < 1e-3, differ
            shown_next += int((maps["disp_noc_1"] > 0).sum())
            hidden = (maps["disp_occ_0"] > 0) & ~seen & (columns >= maps["disp_occ_0"])
            stereo.add(
                left, pictures["image_3", 10], columns - maps["disp_occ_0"], rows, seen, hidden
            )
        if (training / "flow_occ").exists():
            (occ, some), (noc, seen) = (
                flow(training / f / f"{name}_10.png") for f in ("flow_occ", "flow_noc")
            )
            assert set(np.unique(some)) <= {0, 1} and (seen <= some).all()
            assert (occ[seen > 0] == noc[seen > 0]).all()
            own, state = flow(source / "flow" / f"{here:06}.png")
            assert (own[state > 0] == occ[state > 0]).all()
            assert ((state > 0) == (some > 0)).all() and ((state == 1) == (seen > 0)).all()
            there_px = np.stack([columns + occ[..., 0], rows + occ[..., 1]])
            inside = (there_px >= 0).all(0) & (there_px[0] < columns.shape[1] - 1)
            inside &= there_px[1] < columns.shape[0] - 1
            hidden = (some > 0) & (seen == 0) & inside
            motion.add(left, pictures["image_2", 11], *there_px, seen > 0, hidden)
    # Half a step, and what the calibration's digits leave.
    assert worst < 0.5 / 256 + 1e-6, worst
    said = [f"{len(pairs)} pairs"]
    if stereo.warped:
        # Neither all nor nothing is hidden at the next frame.
        assert 0.1 * stereo.pixels < shown_next < stereo.pixels
        said.append(f"disparity within half a step; by it {stereo.verdict()}")
    if judged:
        assert agree > 0.75 * judged
        said.append(f"its rule agrees with flow's rays in {100 * agree / judged:.0f} %")
    if motion.warped:
        said.append(f"flow equal; by it {motion.verdict()}")
    print("kitti2015: " + "; ".join(said))


main(*sys.argv[1:])
