"""A small network that learns the classes of points, scored on sequences that it never saw.

    python points.py DATASET [--steps 300]
"""

import argparse

import numpy as np
import torch
from torch import nn

from common import confusion, fit, frames, iou, ontology, seeded, table

# Sides of the cells whose points are compared with each other, metres: a stem, a bush, a crown.
CELLS_M = (0.25, 1.0, 4.0)


def cells(points, side_m):
    """The number of the cell that each point is in."""
    at = np.floor(points[:, :3] / side_m).astype(np.int64)
    at -= at.min(0)
    span = at.max(0) + 1
    flat = (at[:, 0] * span[1] + at[:, 1]) * span[2] + at[:, 2]
    return np.unique(flat, return_inverse=True)[1]


def described(points, chance=None):
    """Features of points, and their cells of each size.

    A point is described by its place in its cells, its height, range and intensity: never by its
    place in the world, which would be learnt by heart.
    """
    if chance is not None:
        angle = chance.uniform(0, 2 * np.pi)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]], np.float32)
        points = points.copy()
        points[:, :2] = points[:, :2] @ turn.T
        if chance.random() < 0.5:
            points[:, 1] *= -1
    features = [
        points[:, 2:3] / 5,
        points[:, 3:4],
        np.linalg.norm(points[:, :3], axis=1, keepdims=True) / 50,
    ]
    of_sizes = []
    for side_m in CELLS_M:
        cell = cells(points, side_m)
        count = np.bincount(cell).astype(np.float32)
        middle = np.stack([np.bincount(cell, points[:, k]) / count for k in range(3)], 1)
        offset = points[:, :3] - middle[cell]
        spread = np.stack([np.bincount(cell, offset[:, k] ** 2) / count for k in range(3)], 1)
        flat = np.sqrt(spread[:, 0] + spread[:, 1])
        features += [
            offset / side_m,
            np.stack([flat, np.sqrt(spread[:, 2])], 1)[cell] / side_m,
            np.log1p(count)[cell, None] / 5,
        ]
        of_sizes.append(torch.from_numpy(cell))
    return torch.from_numpy(np.concatenate(features, 1).astype(np.float32)), of_sizes


class CellNet(nn.Module):
    """Shared layers for each point, with the maximum over its cells between them, as in PointNet
    (Qi et al. 2017) at several scales."""

    def __init__(self, classes, width=48):
        super().__init__()
        features = 3 + 6 * len(CELLS_M)
        self.first = self.layers(features, width)
        self.scales = nn.ModuleList(self.layers(2 * width, width) for _ in CELLS_M)
        self.head = nn.Sequential(self.layers(width * (1 + len(CELLS_M)), 2 * width), nn.Linear(2 * width, classes))

    @staticmethod
    def layers(inputs, outputs):
        return nn.Sequential(nn.Linear(inputs, outputs), nn.LayerNorm(outputs), nn.ReLU(), nn.Linear(outputs, outputs), nn.ReLU())

    def forward(self, features, of_sizes):
        x = self.first(features)
        parts = [x]
        for cell, layers in zip(of_sizes, self.scales):
            index = cell[:, None].expand(-1, x.shape[1])
            most = x.new_zeros(int(cell.max()) + 1, x.shape[1])
            most = most.scatter_reduce(0, index, x, "amax", include_self=True)
            x = layers(torch.cat([x, most[cell]], 1))
            parts.append(x)
        return self.head(torch.cat(parts, 1))


def learn(some, classes, steps, seed, most=12_000, say=print):
    chance = seeded(seed)
    scans = [f.points() for f in some]

    def batches(_):
        points, truth = scans[chance.integers(len(scans))]
        keep = chance.permutation(len(points))[:most]
        truth = torch.from_numpy(truth[keep])
        # False alarms and what is not labelled.
        truth = torch.where(truth == 0, -1, truth)
        return described(points[keep], chance), truth

    return fit(CellNet(classes), batches, steps, say=say)


@torch.no_grad()
def score(network, some, ids):
    count = max(ids) + 1
    matrix = np.zeros((count, count), np.int64)
    for frame in some:
        points, truth = frame.points()
        guess = network(*described(points)).argmax(1).numpy()
        matrix += confusion(truth[truth > 0], guess[truth > 0], count)
    return iou(matrix, ids)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset")
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    names, ids = ontology(args.dataset)
    train, test = frames(args.dataset, "train"), frames(args.dataset, "test")
    print(f"{len(train)} scans to learn from, {len(test)} to be tested by")
    network = learn(train, max(ids) + 1, args.steps, args.seed)
    print("sequences never seen:\n" + table(names, score(network, test, ids)))


if __name__ == "__main__":
    main()
