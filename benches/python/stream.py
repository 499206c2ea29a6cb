"""How long training waits for frames that are made while it trains.

    pip install ./python torch && python benches/python/stream.py [FRAMES]

A network trains on the points of `medium` (LiDAR alone, 50,000 pulses, worlds of 32 frames), which
one worker makes: shared layers of 64, 128 and 256 for each point and a maximum over the scan, as in
PointNet's segmentation (Qi et al. 2017), on 16,384 points a step. Then pictures of 160 x 90 with
2,000 pulses are only counted, against the number of workers. Frames that were made ahead before the
clock starts are taken before it does, too.
"""

import sys
import time

import torch
from torch import nn
from torch.utils.data import DataLoader

import nemoral
from nemoral.torch import Frames

from common import host

POINTS = 16_384
AHEAD = 8
"""Frames that the trained network's worker makes ahead."""


class PointNet(nn.Module):
    """PointNet for segmentation, without its transforms of the input."""

    def __init__(self, classes):
        super().__init__()
        self.local = self.layers(4, 64, 64)
        self.whole = self.layers(64, 64, 128, 256)
        self.head = nn.Sequential(self.layers(64 + 256, 256, 128), nn.Linear(128, classes))

    @staticmethod
    def layers(*widths):
        pairs = zip(widths, widths[1:])
        return nn.Sequential(*(m for a, b in pairs for m in (nn.Linear(a, b), nn.ReLU())))

    def forward(self, points):
        local = self.local(points)
        most = self.whole(local).amax(0, keepdim=True).expand(len(points), -1)
        return self.head(torch.cat([local, most], 1))


def points_and_classes(frame):
    points = frame.points
    xyzi = torch.from_numpy(frame.lidars["lidar"].velodyne.copy())
    return xyzi, torch.from_numpy(points.semantic.astype("int64"))


def train(steps):
    frames = Frames(
        "medium",
        7,
        worlds=(steps + AHEAD) // 32 + 1,
        transform=points_and_classes,
        **{"camera.enabled": False, "lidar.pulses": 50_000},
    )
    classes = max(nemoral.Forest("medium").classes) + 1
    network = PointNet(classes)
    optimizer = torch.optim.Adam(network.parameters(), 1e-3)
    loss_of = nn.CrossEntropyLoss()
    torch.set_num_threads(1)
    stream = frames.stream()
    loader = iter(DataLoader(stream, batch_size=None, num_workers=1, prefetch_factor=AHEAD))
    for _ in range(1 + AHEAD):
        next(loader)  # the first world grows
    chance = torch.Generator().manual_seed(0)
    waited, start, losses = 0.0, time.perf_counter(), []
    for _ in range(steps):
        asked = time.perf_counter()
        points, truth = next(loader)
        waited += time.perf_counter() - asked
        keep = torch.randperm(len(points), generator=chance)[:POINTS]
        loss = loss_of(network(points[keep] / 50), truth[keep])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(float(loss.detach()))
    wall = time.perf_counter() - start
    tenth = max(1, steps // 10)
    first, last = sum(losses[:tenth]) / tenth, sum(losses[-tenth:]) / tenth
    print(
        f"PointNet on a stream, one worker: {steps / wall:.1f} steps a second, waiting "
        f"{100 * waited / wall:.1f} % of {wall:.0f} s; loss {first:.2f} to {last:.2f}"
    )


def shape(frame):
    return frame.image.shape


def count(number, workers):
    frames = Frames(
        "medium",
        7,
        worlds=max(1, workers) * 2,
        frames_per_world=number,
        transform=shape,
        **{"camera.width_px": 160, "camera.height_px": 90, "lidar.pulses": 2_000},
    )
    ahead = 2 if workers else None
    stream = frames.stream()
    loader = DataLoader(stream, batch_size=None, num_workers=workers, prefetch_factor=ahead)
    loader = iter(loader)
    for _ in range(max(1, workers) * (1 + (ahead or 0))):
        next(loader)
    start = time.perf_counter()
    for _ in range(number):
        next(loader)
    wall = time.perf_counter() - start
    print(f"160 x 90 and 2,000 pulses, {workers} workers: {number / wall:.1f} frames a second")


def main():
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 320
    print(host())
    train(steps)
    for workers in (0, 1, 2, 4):
        count(100, workers)


if __name__ == "__main__":
    main()
