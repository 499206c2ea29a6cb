"""What cameras that differ bring, beside plain augmentation: tested on cameras never seen.

    python cameras.py FOLDER [--program nemoral] [--worlds 64] [--steps 300] [--runs 3]

Makes four data sets in FOLDER. Two to learn from have the same worlds, one frame of each: by one
camera, and by a camera drawn for each. Two to be tested by have other worlds: by that one camera,
and by cameras drawn from wider ranges. Plain augmentation varies the brightness and contrast of
each channel; pictures are mirrored in any case.
"""

import argparse
import shutil
from pathlib import Path

import numpy as np

import pictures
from common import frames, mean, ontology
from variety import make

# Of each sequence's camera: the middle of a range, and half its width.
DRAWN = {
    "white_balance.error_k": (0.0, 1200.0),
    "white_balance.tint": (0.0, 20.0),
    "exposure_error_ev": (0.0, 1.0),
    "tone.contrast": (1.05, 0.25),
    "tone.saturation": (1.0, 0.35),
    "aberration.red_px": (0.0, 0.5),
    "aberration.blue_px": (0.0, 0.5),
    "processing.denoising": (0.25, 0.25),
    "processing.sharpening": (0.7, 0.7),
}
CURVES = '["standard", "linear", "filmic"]'
# How much wider ranges are in the test.
WIDER = 1.6


def drawn_cameras(wider=1.0):
    """Settings that draw a camera for each sequence."""
    settings = [f"vary.camera.tone.curve={CURVES}", "vary.camera.processing.jpeg_quality=[30, 95]"]
    for key, (middle, half) in DRAWN.items():
        # Strengths are not negative.
        least = 0.0 if key.startswith("processing.") else middle - wider * half
        most = middle + wider * half
        settings.append(f"vary.camera.{key}=[{least}, {most}]")
    return [part for setting in settings for part in ("--set", setting)]


def pictured(program, out, seed, worlds, settings):
    """A data set of one frame of each world, with next to no scans, which are of no use here."""
    numbers = ["--seed", str(seed), "--sequences", str(worlds), "--frames", "1"]
    return make(program, out, *numbers, "--set", "lidar.pulses=100", *settings)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--program", default=shutil.which("nemoral") or "nemoral")
    parser.add_argument("--worlds", type=int, default=64)
    parser.add_argument("--test-worlds", type=int, default=32)
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--runs", type=int, default=3)
    args = parser.parse_args()
    cameras = {"one camera": [], "a camera drawn for each world": drawn_cameras()}
    others = {"that camera": [], "cameras never seen": drawn_cameras(WIDER)}
    tests = []
    for name, settings in others.items():
        out = args.folder / f"test {name}".replace(" ", "-")
        pictured(args.program, out, 2, args.test_worlds, settings)
        names, ids = ontology(out)
        tests.append(pictures.of_dataset(frames(out)))
    print("| learnt from | plain augmentation | " + " | ".join(others) + " |")
    print("|---|---|" + "---|" * len(others))
    for name, settings in cameras.items():
        out = args.folder / f"train {name}".replace(" ", "-")
        pictured(args.program, out, 1, args.worlds, settings)
        x, y = pictures.of_dataset(frames(out))
        for colours in (False, True):
            means = []
            for seed in range(args.runs):
                quiet = {"steps": args.steps, "seed": seed, "say": lambda _: None}
                network = pictures.learn([(x, y, 1.0)], max(ids) + 1, colours=colours, **quiet)
                means.append([mean(pictures.score(network, *test, ids)) for test in tests])
            found = zip(100 * np.mean(means, 0), 100 * np.std(means, 0))
            cells = " | ".join(f"{m:.1f} ± {d:.1f}" for m, d in found)
            print(f"| {name} | {'yes' if colours else 'no'} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
