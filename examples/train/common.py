"""Data sets, scores and training loops that the examples share."""

import json
import re
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from PIL import Image

# The share of correct labels says little where most pixels are leaves, so scores are intersections
# over unions, class by class.


def ontology(root):
    """Names of the classes by id, and the ids that are scored: all but the background."""
    text = Path(root, "ontology.yaml").read_text()
    labels = text[text.index("labels:") :]
    labels = labels[: re.search(r"\n\S", labels[8:]).start() + 8]
    names = {int(i): name.strip(" \"'") for i, name in re.findall(r"(\d+): (.+)", labels)}
    return names, [i for i in sorted(names) if i != 0]


@dataclass(frozen=True)
class Frame:
    """A frame of a data set on disk."""

    folder: Path
    sequence: int
    name: str

    def picture(self):
        return np.asarray(Image.open(self.folder / "image_2" / f"{self.name}.png").convert("RGB"))

    def classes(self):
        # A palette picture: its numbers are the class ids.
        return np.asarray(Image.open(self.folder / "semantic" / f"{self.name}.png"))

    def points(self):
        """Points (x, y, z, intensity) and their classes."""
        file = self.folder / "velodyne" / f"{self.name}.bin"
        points = np.fromfile(file, np.float32).reshape(-1, 4)
        labels = np.fromfile(self.folder / "labels" / f"{self.name}.label", np.uint32)
        return points, (labels & 0xFFFF).astype(np.int64)


def frames(root, split=None):
    """All frames of a data set, or those of a split, which no tree shares with the others."""
    manifest = json.loads(Path(root, "dataset.json").read_text())
    found = []
    for sequence in manifest["sequences"]:
        if split is not None and sequence.get("split") != split:
            continue
        folder = Path(root, "sequences", f"{sequence['number']:02}")
        names = sorted(p.stem for p in folder.glob("*/*.bin")) or sorted(
            p.stem for p in folder.glob("image_2/*.png")
        )
        found += [Frame(folder, sequence["number"], name) for name in names]
    if not found:
        raise SystemExit(f"error: {root}: no frames of the split {split}; see [splits] of the config")
    return found


def confusion(truth, guess, count):
    """How often class i (row) is taken for class j (column)."""
    return np.bincount(truth.ravel() * count + guess.ravel(), minlength=count * count).reshape(
        count, count
    )


def iou(matrix, ids):
    """The intersection over union of each class; NaN for one that is neither there nor guessed."""
    right = np.diag(matrix).astype(float)
    union = matrix.sum(0) + matrix.sum(1) - right
    return {i: right[i] / union[i] if union[i] else float("nan") for i in ids}


def mean(scores):
    return float(np.nanmean(list(scores.values())))


def table(names, scores):
    rows = [f"  {names[i]:14} {100 * s:5.1f} %" for i, s in scores.items()]
    return "\n".join([*rows, f"  {'mean':14} {100 * mean(scores):5.1f} %"])


def class_weights(truth, count):
    """Weights by which classes that are rare in `truth` count more: one over the root of their
    share, with a mean of 1 over all that is known. A class that is not there has the weight 0."""
    known = truth[truth >= 0]
    shares = torch.bincount(known.ravel(), minlength=count).float() / known.numel()
    weights = torch.where(shares > 0, shares.clamp(min=1e-9).rsqrt(), 0.0)
    return weights / (weights * shares).sum()


def fit(network, batches, steps, rate=2e-3, weights=None, say=print):
    """Trains by Adam with a cosine schedule on `batches(step)`, which gives inputs and classes of
    which -1 are not known, with a weight for each class if there are any."""
    optimizer = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps)
    network.train()
    began, total = time.monotonic(), 0.0
    every = max(1, steps // 5)
    for step in range(steps):
        inputs, truth = batches(step)
        guess = network(*inputs)
        loss = torch.nn.functional.cross_entropy(guess, truth, weights, ignore_index=-1)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        total += loss.item()
        if (step + 1) % every == 0:
            seconds = time.monotonic() - began
            say(f"  step {step + 1} of {steps}: loss {total / every:.3f}, {seconds:.0f} s")
            total = 0.0
    network.eval()
    return network


def seeded(seed):
    torch.manual_seed(seed)
    return np.random.default_rng(seed)
