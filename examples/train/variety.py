"""What variety brings: as many frames of 1, 4, 16 and 64 worlds, tested on worlds never seen.

    python variety.py FOLDER [--program nemoral] [--frames 64] [--steps 300] [--runs 3]

Makes the data sets in FOLDER, each with the same number of frames, and trains on each.
"""

import argparse
import shutil
import subprocess
from pathlib import Path

import numpy as np

import pictures
import points
from common import frames, mean, ontology

HERE = Path(__file__).parent


def make(program, out, *arguments):
    """A data set; one that is there is finished."""
    command = [program, "generate", HERE / "variety.toml", "--out", out, "--resume", "--quiet"]
    subprocess.run([*command, *arguments], check=True)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--program", default=shutil.which("nemoral") or "nemoral")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--worlds", type=int, nargs="+", default=[1, 4, 16, 64])
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--runs", type=int, default=3)
    args = parser.parse_args()
    for worlds in args.worlds:
        if args.frames % worlds:
            parser.error(f"--worlds {worlds}: must divide the {args.frames} frames")
    # Another seed has other worlds and other plants.
    test = make(args.program, args.folder / "test", "--seed", "2", "--sequences", "24", "--frames", "1")
    names, ids = ontology(test)
    held_out = frames(test)
    seen = pictures.of_dataset(held_out)
    print("| worlds | frames of each | pictures, mean IoU | points, mean IoU |")
    print("|---|---|---|---|")
    for worlds in args.worlds:
        each = args.frames // worlds
        out = args.folder / f"train-{worlds}"
        make(args.program, out, "--seed", "1", "--sequences", str(worlds), "--frames", str(each))
        some = frames(out)
        x, y = pictures.of_dataset(some)
        means = []
        for seed in range(args.runs):
            quiet = {"steps": args.steps, "seed": seed, "say": lambda _: None}
            of_pictures = pictures.learn([(x, y, 1.0)], max(ids) + 1, **quiet)
            of_points = points.learn(some, max(ids) + 1, **quiet)
            means.append(
                (
                    mean(pictures.score(of_pictures, *seen, ids)),
                    mean(points.score(of_points, held_out, ids)),
                )
            )
        (a, b), (da, db) = 100 * np.mean(means, 0), 100 * np.std(means, 0)
        print(f"| {worlds} | {each} | {a:.1f} ± {da:.1f} | {b:.1f} ± {db:.1f} |", flush=True)


if __name__ == "__main__":
    main()
