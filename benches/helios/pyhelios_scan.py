"""The plot of `benches/plot_scan.rs` scanned by PyHelios (PyPI: pyhelios3d), for comparison.

PyHelios records no misses, as nemoral does, and scans the same window in as many rows and columns.

    cargo bench -p nemoral-benches --bench plot_scan -- 2000000 plot.obj
    pip install pyhelios3d && python benches/helios/pyhelios_scan.py plot.obj 2000000
"""

import math
import resource
import sys
import time

from pyhelios import Context, LiDARCloud
from pyhelios.types import vec3

obj, pulses = sys.argv[1], int(sys.argv[2])
start = time.time()
with Context() as context:
    context.loadOBJ(obj, silent=True)
    print(f"start: {time.time() - start:.2f} s, {context.getPrimitiveCount()} primitives")
    rows = int(math.sqrt(pulses / 3.6))
    columns = pulses // rows
    for name, rays in [("1 ray", None), ("19 sub-rays", 19)]:
        for _ in range(3):
            with LiDARCloud() as lidar:
                lidar.disableMessages()
                lidar.addScan(
                    origin=vec3(0, 0, 1.7),
                    Ntheta=rows,
                    theta_range=(math.radians(30), math.radians(130)),
                    Nphi=columns,
                    phi_range=(0, 2 * math.pi),
                    exit_diameter=0.007 if rays else 0.0,
                    beam_divergence=0.0003 if rays else 0.0,
                )
                wall, processor = time.time(), time.process_time()
                if rays:
                    lidar.syntheticScan(
                        context,
                        rays_per_pulse=rays,
                        pulse_distance_threshold=0.1,
                        record_misses=False,
                    )
                else:
                    lidar.syntheticScan(context, record_misses=False)
                wall, processor = time.time() - wall, time.process_time() - processor
                print(
                    f"{name}: {rows * columns / wall / 1e3:.0f} k pulses/s by the wall, "
                    f"{rows * columns / processor / 1e3:.0f} k per second of processor, "
                    f"{lidar.getHitCount()} hits"
                )
print(f"peak memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
