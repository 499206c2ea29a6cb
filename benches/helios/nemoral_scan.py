"""The plot of `benches/plot_scan.rs` scanned by the Python package, whose `tls` has the same window
and 6,007,800 pulses a turn.

    cargo bench -p nemoral-benches --bench plot_scan -- 6007800 plot.obj
    pip install ./python && python benches/helios/nemoral_scan.py plot.obj
"""

import sys
import time

import numpy as np

import nemoral


def read(path):
    """The mesh of an OBJ file of triangles with positions alone."""
    vertices, triangles = [], []
    with open(path, encoding="ascii") as file:
        for line in file:
            kind, *words = line.split() or [""]
            if kind == "v":
                vertices.append([float(w) for w in words[:3]])
            elif kind == "f":
                triangles.append([int(w.split("/")[0]) - 1 for w in words])
    return np.array(vertices, np.float32), np.array(triangles, np.uint32)


def main():
    vertices, triangles = read(sys.argv[1])
    start = time.time()
    scene = nemoral.RayScene()
    scene.add_mesh(vertices, triangles, reflectance=0.3)
    pose = np.eye(4)
    pose[2, 3] = 1.7
    print(f"start: {time.time() - start:.2f} s, {len(triangles)} triangles")
    for name, rings in [("1 ray", 0), ("19 sub-rays", 2)]:
        scanner = nemoral.Scanner("tls", noise="off", rings=rings)
        for _ in range(3):
            wall, processor = time.time(), time.process_time()
            points = scanner.scan(scene, pose)
            wall, processor = time.time() - wall, time.process_time() - processor
            print(
                f"{name}: {scanner.pulses / wall / 1e3:.0f} k pulses/s by the wall, "
                f"{scanner.pulses / processor / 1e3:.0f} k per second of processor, "
                f"{len(points)} points"
            )


if __name__ == "__main__":
    main()
