"""A small network that learns the classes of pictures, scored on sequences that it never saw.

    python pictures.py DATASET [--real FOLDER] [--steps 300]

The data set is split by its config (`splits.train`, `splits.test`). FOLDER has real pictures in
`images/NAME.png` (or .jpg) and masks of the same class ids in `masks/NAME.png`, 255 for what is not
labelled; the network is scored on them, too.
"""

import argparse
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from torch import nn

from common import confusion, fit, frames, iou, ontology, seeded, table

NOT_LABELLED = 255


def block(inputs, outputs):
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, padding=1, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
        nn.Conv2d(outputs, outputs, 3, padding=1, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class UNet(nn.Module):
    """Ronneberger et al. 2015 with three levels, about 0.5 million parameters."""

    def __init__(self, classes, width=16):
        super().__init__()
        w = [width, 2 * width, 4 * width, 8 * width]
        self.down = nn.ModuleList(block(a, b) for a, b in zip([3, *w[:3]], w))
        self.up = nn.ModuleList(block(a + b, b) for a, b in zip(w[:0:-1], w[-2::-1]))
        self.head = nn.Conv2d(width, classes, 1)

    def forward(self, x):
        seen = []
        for i, down in enumerate(self.down):
            x = down(nn.functional.max_pool2d(x, 2) if i else x)
            seen.append(x)
        for up, at in zip(self.up, seen[-2::-1]):
            x = nn.functional.interpolate(x, size=at.shape[2:], mode="bilinear", align_corners=False)
            x = up(torch.cat([x, at], 1))
        return self.head(x)


def tensors(pictures, classes):
    """Pictures as floats about 0 (N x 3 x H x W) and classes (N x H x W), -1 where not known."""
    x = torch.from_numpy(np.stack(pictures)).permute(0, 3, 1, 2).float() / 127.5 - 1
    y = np.stack(classes).astype(np.int64)
    y[y == NOT_LABELLED] = -1
    return x, torch.from_numpy(y)


def of_dataset(some):
    return tensors([f.picture() for f in some], [f.classes() for f in some])


def of_folder(root, size):
    """Real pictures and masks, scaled to the size of the synthetic ones."""
    pictures, masks = [], []
    for mask in sorted(Path(root, "masks").glob("*.png")):
        [file] = [f for f in Path(root, "images").glob(f"{mask.stem}.*")]
        pictures.append(np.asarray(Image.open(file).convert("RGB").resize(size, Image.BILINEAR)))
        masks.append(np.asarray(Image.open(mask).resize(size, Image.NEAREST)))
    if not masks:
        raise SystemExit(f"error: {root}: no masks/*.png")
    return tensors(pictures, masks)


def augmented(x, y, chance, colours=True):
    """Mirrors half of the pictures, and varies the brightness and contrast of their channels."""
    mirrored = torch.from_numpy(chance.random(len(x)) < 0.5)
    x = torch.where(mirrored[:, None, None, None], x.flip(3), x)
    y = torch.where(mirrored[:, None, None], y.flip(2), y)
    if not colours:
        return x, y
    gain = torch.from_numpy(chance.uniform(0.7, 1.3, (len(x), 3, 1, 1)).astype(np.float32))
    shift = torch.from_numpy(chance.uniform(-0.2, 0.2, (len(x), 1, 1, 1)).astype(np.float32))
    return x * gain + shift, y


def learn(sets, classes, steps, seed, batch=8, weights=None, colours=True, say=print):
    """Trains on sets of pictures, of which each gives its share of a batch's pictures; `colours`
    are augmented, too."""
    chance = seeded(seed)
    network = UNet(classes)
    sets = [(x, y, share) for x, y, share in sets if share > 0]
    shares = np.array([share for _, _, share in sets])

    def batches(_):
        counts = chance.multinomial(batch, shares / shares.sum())
        picked = [
            (x[i], y[i])
            for (x, y, _), n in zip(sets, counts)
            for i in [torch.from_numpy(chance.integers(len(x), size=n))]
        ]
        x, y = (torch.cat(t) for t in zip(*picked))
        x, y = augmented(x, y, chance, colours)
        return (x,), y

    return fit(network, batches, steps, weights=weights, say=say)


@torch.no_grad()
def score(network, x, y, ids):
    count = max(ids) + 1
    matrix = np.zeros((count, count), np.int64)
    for i in range(0, len(x), 8):
        guess = network(x[i : i + 8]).argmax(1).numpy()
        truth = y[i : i + 8].numpy()
        known = truth >= 0
        matrix += confusion(truth[known], guess[known], count)
    return iou(matrix, ids)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset")
    parser.add_argument("--real", help="a folder of real pictures and masks")
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--save", help="a file for the network's weights")
    args = parser.parse_args()
    names, ids = ontology(args.dataset)
    train, test = frames(args.dataset, "train"), frames(args.dataset, "test")
    print(f"{len(train)} pictures to learn from, {len(test)} to be tested by")
    x, y = of_dataset(train)
    network = learn([(x, y, 1.0)], max(ids) + 1, args.steps, args.seed)
    print("sequences never seen:\n" + table(names, score(network, *of_dataset(test), ids)))
    if args.real:
        real = of_folder(args.real, (x.shape[3], x.shape[2]))
        print("real pictures:\n" + table(names, score(network, *real, ids)))
    if args.save:
        torch.save(network.state_dict(), args.save)


if __name__ == "__main__":
    main()
