"""What Python adds to a frame: the time until all of its arrays are there.

    pip install ./python && python benches/python/binding.py [FRAMES]

Rust has a scan and pictures when `Forest.frame` returns, without arrays; arrays are made when they
are asked for. So the time of the binding is that of asking for every array once.
"""

import subprocess
import sys

import nemoral

from common import host, quantiles, timed

COLUMNS = "array xyz normal intensity semantic fine_semantic instance object range_m true_range_m"
COLUMNS += " time_s ring flags"
IMAGES = "image semantic instance depth_m normal"


def ask(things, names):
    return [getattr(things, name) for name in names.split()]


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    print(host())
    forest = nemoral.Forest(
        "medium", 7, frames=count, **{"camera.enabled": False, "lidar.pulses": 50_000}
    )
    forest.frame(0)
    array, columns, points = [], [], 0
    for k in range(count):
        frame = forest.frame(k)
        scan, ms = timed(lambda frame=frame: frame.points)
        array.append(ms)
        columns.append(ms + timed(ask, scan, COLUMNS)[1])
        points += len(scan)
    print(f"scans of 50,000 pulses, {points // count} points: {quantiles(array)}")
    print(f"  with every column as an array of its own: {quantiles(columns)}")

    forest = nemoral.Forest("medium", 7, frames=count)
    forest.frame(0)
    whole = []
    for k in range(count):
        frame = forest.frame(k)
        camera = next(iter(frame.cameras.values()))
        whole.append(timed(ask, camera, IMAGES)[1] + timed(lambda frame=frame: frame.points)[1])
    size = f"{camera.width_px} x {camera.height_px}"
    print(f"frames: {size}, 5 images, and 50,000 pulses: {quantiles(whole)}")

    with_it, numpy_alone = [], []
    for _ in range(15):
        for program, times in [("import numpy", numpy_alone), ("import nemoral", with_it)]:
            times.append(timed(subprocess.check_call, [sys.executable, "-c", program])[1])
    least = min(with_it) - min(numpy_alone)
    print(f"import: {least:.1f} ms beyond numpy's, least of 15")


if __name__ == "__main__":
    main()
