"""The example environment passes Gymnasium's own check, and can be driven."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from conftest import SMALL

pytest.importorskip("gymnasium", reason="gymnasium is not installed")
from gymnasium.utils.env_checker import check_env  # noqa: E402

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))
from trail_env import TrailEnv, follow  # noqa: E402


def test_the_environment(cache: Path) -> None:
    small = {k: v for k, v in SMALL.items() if not k.startswith(("camera.", "frames", "lidar."))}
    env = TrailEnv("demo", cache=cache, frames=120, **small)
    check_env(env, skip_render_check=True)
    seen, _ = env.reset(seed=3)
    total = 0.0
    for _ in range(40):
        seen, reward, ended, cut, _ = env.step(follow(seen))
        total += reward
        if ended or cut:
            break
    assert total > 5.0
