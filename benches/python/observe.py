"""How long a robot waits for its LiDAR: `Forest.observe` along a drive at `medium`.

    pip install ./python && python benches/python/observe.py [METRES]

The body follows the trail at 2 m/s and asks for a scan of 50,000 pulses ten times a second, so new
chunks come into sight all the time. No index is a frame's of the sequence, which would be kept.
Growing the plants, once, is not counted.
"""

import sys

import numpy as np

import nemoral

from common import host, peak_mb, quantiles, timed


def main():
    metres = float(sys.argv[1]) if len(sys.argv) > 1 else 500.0
    print(host())
    count = int(metres / 2.0 / 0.1)
    forest = nemoral.Forest(
        "medium",
        7,
        frames=count,
        **{"camera.enabled": False, "robot.spacing_s": 0.1, "robot.speed_m_s": 2.0},
    )
    forest.prepare()
    times = []
    for k in range(count):
        pose, time_s = forest.pose(k), forest.time_s(k)
        frame, ms = timed(lambda p=pose, t=time_s, i=count + k: forest.observe(p, time_s=t, index=i))
        assert len(frame.points)
        times.append(ms)
    along = np.linalg.norm(np.diff([forest.pose(k)[:3, 3] for k in range(count)], axis=0), axis=1)
    print(f"{count} scans over {along.sum():.0f} m: {quantiles(times)}; peak {peak_mb():.0f} MB")
    print(f"  the first, which sees all of its chunks for the first time: {times[0]:.0f} ms")


if __name__ == "__main__":
    main()
