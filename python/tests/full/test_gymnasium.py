"""The example environment passes Gymnasium's own check, can be driven, and can be crashed."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import SMALL

import nemoral

pytest.importorskip("gymnasium", reason="gymnasium is not installed")
import gymnasium  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402

sys.path.insert(0, str(Path(__file__).parents[3] / "examples"))
from trail_env import TrailEnv, follow  # noqa: E402


@pytest.fixture
def small(cache: Path) -> dict[str, Any]:
    """Keywords of a small environment."""
    keys = {k: v for k, v in SMALL.items() if not k.startswith(("camera.", "frames", "lidar."))}
    return {"config": "demo", "cache": cache, "frames": 120, **keys}


def test_gymnasiums_own_check(small: dict[str, Any]) -> None:
    gymnasium.register("Trail-v0", entry_point=TrailEnv, kwargs=small)
    try:
        env = gymnasium.make("Trail-v0", render_mode="rgb_array")
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            check_env(env.unwrapped)
        assert not [w for w in told if "render" in str(w.message)]
        env.reset(seed=1)
        picture = env.render()
        assert isinstance(picture, np.ndarray) and picture.shape == (180, 320, 3)
        assert picture.dtype == np.uint8 and picture.std() > 5
    finally:
        gymnasium.registry.pop("Trail-v0")


def test_a_drive_along_the_trail(small: dict[str, Any]) -> None:
    env = TrailEnv(**small)
    seen, _ = env.reset(seed=3)
    total = 0.0
    for _ in range(40):
        seen, reward, ended, cut, info = env.step(follow(seen))
        total += reward
        if ended or cut:
            break
    assert total > 5.0 and not info["crashed"]


def test_each_step_is_rewarded_by_its_way_along_the_trail(small: dict[str, Any]) -> None:
    env = TrailEnv(**small)
    seen, info = env.reset(seed=3)
    rewards, ways = [], []
    for _ in range(40):
        before = info["place_m"]
        seen, reward, ended, cut, info = env.step(follow(seen))
        if ended or cut:
            break
        rewards.append(reward)
        ways.append(np.linalg.norm(info["place_m"] - before))
    # The places by which the trail is known are farther apart than a step is long.
    shares = np.array(rewards) / np.array(ways)
    assert len(shares) > 20 and (shares > 0.3).mean() > 0.9 and shares.max() < 1.5
    with pytest.raises(ValueError, match="frames = 1: must be at least 2"):
        TrailEnv(**{**small, "frames": 1})


def test_low_things_are_seen_and_the_ground_is_not(
    small: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    env = TrailEnv(**small)
    _, info = env.reset(seed=3)
    x, y = info["place_m"]
    world_from_sensor = env.forest.stand(x, y, info["heading_rad"]).copy()
    world_from_sensor[2, 3] += 1.35
    # A log 4 m to one side, and the bare ground 3 m to the other side and ahead.
    places = np.array([[x + 4.0, y], [x - 3.0, y], [x, y + 3.0]])
    heights = env.forest.ground(*places.T)["height_m"] + [0.3, 0.0, 0.0]
    points = np.column_stack([places, heights, np.ones(3)])
    xyz = (np.linalg.inv(world_from_sensor) @ points.T).T[:, :3].astype(np.float32)
    frame = SimpleNamespace(
        points=SimpleNamespace(xyz=xyz),
        lidar=SimpleNamespace(world_from_sensor=world_from_sensor),
    )
    monkeypatch.setattr(nemoral.Forest, "observe", lambda *_, **__: frame)
    ranges = 30.0 * env._observe()[:-2]
    assert (ranges < 29.0).sum() == 1 and ranges.min() == pytest.approx(4.0, abs=0.3)


def test_a_robot_that_drives_at_a_tree_crashes(small: dict[str, Any]) -> None:
    env = TrailEnv(**small)
    crashes = 0
    for seed in range(4):
        _, info = env.reset(seed=seed)
        x, y = info["place_m"]
        discs = env.forest.obstacles(x - 9, y - 9, x + 9, y + 9)
        target = discs[np.linalg.norm(discs[:, :2] - (x, y), axis=1).argmin()]
        ended = False
        for _ in range(40):
            apart = target[:2] - info["place_m"]
            turn = np.arctan2(apart[1], apart[0]) - info["heading_rad"]
            turn = (turn + np.pi) % (2 * np.pi) - np.pi
            # It stands while it turns.
            speed = 0.0 if abs(turn) < 0.1 else -1.0
            action = np.array([speed, np.clip(turn / 0.4, -1, 1)], np.float32)
            _, reward, ended, _, info = env.step(action)
            if ended:
                break
        assert ended and info["crashed"] and reward < -5.0
        place = info["place_m"]
        nearest = np.linalg.norm(discs[:, :2] - place, axis=1) - discs[:, 2]
        assert nearest.min() < 1.5
        crashes += 1
    assert crashes == 4
