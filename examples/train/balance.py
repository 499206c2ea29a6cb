"""What balance brings: as many frames of drives, of views anywhere beside the path, and of views
that were chosen for a rare class, tested on worlds never seen.

    python balance.py FOLDER [--program nemoral] [--target rocks=0.05] [--steps 2000] [--runs 3]

Makes the data sets in FOLDER and trains on each, with weights by which rare classes count more.
Every network is tested on drives, as a robot sees them, and on chosen views, which show enough of
the rare class to measure it.
"""

import argparse
import shutil
import subprocess
from pathlib import Path

import numpy as np
from torch import nn

import pictures
from common import class_weights, frames, mean, ontology

HERE = Path(__file__).parent


def make(program, out, seed, *settings):
    """A data set; one that is there is finished."""
    command = [program, "generate", HERE / "balance.toml", "--out", out, "--resume", "--quiet"]
    arguments = ["--seed", str(seed), *[a for s in settings for a in ("--set", s)]]
    subprocess.run([*command, *arguments], check=True)
    return out


def halved(x, y, halve):
    """Pictures and classes at half the size, or as they are."""
    return (nn.functional.avg_pool2d(x, 2), y[:, ::2, ::2]) if halve else (x, y)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--program", default=shutil.which("nemoral") or "nemoral")
    parser.add_argument("--target", default="rocks=0.05")
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--halve", action="store_true", help="pictures of half the size, for slow machines")
    args = parser.parse_args()
    name, _ = args.target.split("=")
    chosen = f"balance.targets.{args.target}"
    # So small a goal is reached without weights, so that any candidate is as good as another.
    anywhere = f"balance.targets.{name}=1e-9"
    of = {"drives": [], "chosen views": [chosen], "views anywhere": [anywhere]}
    tests = {"drives": [], "chosen views": [chosen]}
    made = {
        kind: make(args.program, args.folder / f"train-{i}", 1, *settings)
        for i, (kind, settings) in enumerate(of.items())
    }
    # Another seed has other worlds and other plants.
    held_out = {
        kind: make(args.program, args.folder / f"test-{i}", 2, *settings)
        for i, (kind, settings) in enumerate(tests.items())
    }
    names, ids = ontology(made["drives"])
    load = lambda out: halved(*pictures.of_dataset(frames(out)), args.halve)
    seen = {kind: load(out) for kind, out in held_out.items()}
    share = lambda y, i: 100 * float((y == i).float().mean())
    print("| learnt from | tested on | mean IoU | " + " | ".join(names[i] for i in ids) + " |")
    print("|---|---|---|" + "---|" * len(ids))
    for kind, out in made.items():
        x, y = load(out)
        print(f"| {kind} | share of pixels | – | " + " | ".join(f"{share(y, i):.1f}" for i in ids) + " |")
        count = max(ids) + 1
        learning = {"weights": class_weights(y, count), "say": lambda _: None}
        runs = []
        for seed in range(args.runs):
            network = pictures.learn([(x, y, 1.0)], count, args.steps, seed, **learning)
            runs.append({test: pictures.score(network, *data, ids) for test, data in seen.items()})
        for test in tests:
            means = 100 * np.array([mean(r[test]) for r in runs])
            each = [100 * np.array([r[test][i] for r in runs]) for i in ids]
            each = [f"{np.nanmean(e):.1f} ± {np.nanstd(e):.1f}" for e in each]
            print(f"| {kind} | {test} | {means.mean():.1f} ± {means.std():.1f} | " + " | ".join(each) + " |", flush=True)


if __name__ == "__main__":
    main()
