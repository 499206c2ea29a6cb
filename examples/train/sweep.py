"""What a share of synthetic pictures does to a network for real ones: the open question of the
paper's section VII.

    python sweep.py DATASET --real FOLDER [--shares 0 0.25 0.5 0.75 0.9 1] [--runs 3]

FOLDER is as `pictures.py --real` has it. Half of its pictures are learnt from, the other half tests;
neighbours in a recording are alike, so the halves are the first and the last, not every second.
Share 0 is real pictures alone, 1 synthetic ones alone. Every network takes as many steps.
"""

import argparse

import numpy as np

from common import frames, mean, ontology
from pictures import learn, of_dataset, of_folder, score


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset")
    parser.add_argument("--real", required=True)
    parser.add_argument("--shares", type=float, nargs="+", default=[0, 0.25, 0.5, 0.75, 0.9, 1])
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--runs", type=int, default=3)
    args = parser.parse_args()
    names, ids = ontology(args.dataset)
    x, y = of_dataset(frames(args.dataset, "train"))
    real, masks = of_folder(args.real, (x.shape[3], x.shape[2]))
    half = len(real) // 2
    if half == 0:
        raise SystemExit(f"error: {args.real}: at least two pictures are needed")
    print(f"{len(x)} synthetic and {half} real pictures to learn from, {len(real) - half} to be tested by")
    print("| share of synthetic pictures | mean IoU | " + " | ".join(names[i] for i in ids) + " |")
    print("|---|---|" + "---|" * len(ids))
    for share in args.shares:
        runs = []
        for seed in range(args.runs):
            sets = [(x, y, share), (real[:half], masks[:half], 1 - share)]
            network = learn(sets, max(ids) + 1, args.steps, seed, say=lambda _: None)
            runs.append(score(network, real[half:], masks[half:], ids))
        means = 100 * np.array([mean(r) for r in runs])
        each = [f"{100 * np.nanmean([r[i] for r in runs]):.1f}" for i in ids]
        print(f"| {share:.0%} | {means.mean():.1f} ± {means.std():.1f} | " + " | ".join(each) + " |", flush=True)


if __name__ == "__main__":
    main()
