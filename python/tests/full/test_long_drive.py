"""Memory stays flat over a drive of 2,000 frames."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import SMALL
from test_memory import resident_mb

import nemoral


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads Linux's /proc")
def test_memory_is_flat_over_2000_frames(cache: Path) -> None:
    drive = {**SMALL, "frames": 2000, "robot.spacing_s": 0.2, "robot.speed_m_s": 2.0}
    forest = nemoral.Forest("demo", seed=7, cache=cache, **drive)
    found = []
    for k in range(2000):
        frame = forest.frame(k)
        assert len(frame.points.xyz) and frame.image.any() and frame.normal.any()
        if k % 100 == 99:
            found.append(resident_mb())
    # How much there is around the robot differs from place to place.
    early, late = max(found[2:8]), max(found[14:])
    print(f"{early:.0f} MB until frame 800, {late:.0f} MB from frame 1,500 on")
    assert late < 1.15 * early + 20
