"""A gymnasium environment: drive a robot along a forest trail by a LiDAR's ranges.

    python examples/trail_env.py          drives along the trail by itself, for a minute

The observation is the nearest return in each of 36 sectors around the robot and the direction of
the trail; the action is speed and rate of turning; the reward is progress along the trail; an
episode ends at an obstacle, far off the trail, or after 200 steps.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

import nemoral

SECTORS = 36
STEP_S = 0.5
FARTHEST_M = 30.0
OFF_TRAIL_M = 6.0
NEAR_M = 3.0  # How far along the trail a step may lead: a trail may come near itself.
ROBOT_M = 0.4
LOW_M = 0.12  # What is no higher above the ground can be driven over.
STEPS = 200


class TrailEnv(gym.Env[np.ndarray, np.ndarray]):
    """Drive along the trail."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1 / STEP_S}

    def __init__(
        self, config: Any = "medium", render_mode: str | None = None, **overrides: Any
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode = {render_mode!r}: must be None or \"rgb_array\"")
        self.render_mode = render_mode
        keys = {
            "camera.enabled": render_mode is not None,
            "camera.width_px": 320,
            "camera.height_px": 180,
            "lidar.device": "os1_32",
            "lidar.pulses": 4096,
            "lidar.beam.rings": 0,
            "frames": 400,
        }
        self._make = lambda seed: nemoral.Forest(config, seed, **{**keys, **overrides})
        self._forest = self._make(7)
        self._seed = 7
        frames = self._forest.frames
        if frames < 2:
            raise ValueError(f"frames = {frames}: must be at least 2, which show the trail")
        self.observation_space = gym.spaces.Box(0.0, 1.0, (SECTORS + 2,), np.float32)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed)
        if options and "world" in options and options["world"] != self._seed:
            self._seed = int(options["world"])
            self._forest = self._make(self._seed)
        last = self._forest.frames - 1
        count = min(last + 1, 100)
        # The middle of the trail, as the sequence's own drive has it.
        picks = np.linspace(0, last, count).astype(int)
        self._path = np.array([self._forest.pose(int(k))[:2, 3] for k in picks])
        self._ways = np.diff(self._path, axis=0)
        lengths = np.linalg.norm(self._ways, axis=1)
        self._along_m = np.concatenate([[0.0], np.cumsum(lengths)])
        start = int(self.np_random.integers(0, max(1, count // 2)))
        ahead = self._path[min(start + 1, count - 1)] - self._path[max(start - 1, 0)]
        self._place = self._path[start].copy()
        self._heading = float(np.arctan2(ahead[1], ahead[0]))
        self._steps = 0
        self._progress_m = float(self._along_m[start])
        self._locate()
        return self._observe(), self._where()

    def step(
        self, action: np.ndarray
    ) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        speed = 1.0 + float(np.clip(action[0], -1, 1))
        self._heading += 0.8 * float(np.clip(action[1], -1, 1)) * STEP_S
        ahead = np.array([np.cos(self._heading), np.sin(self._heading)])
        before, self._place = self._place, self._place + speed * STEP_S * ahead
        self._steps += 1
        done_m = self._progress_m
        self._locate()
        reward = self._progress_m - done_m
        crashed = self._crashes(before)
        lost = self._off_trail_m > OFF_TRAIL_M
        if crashed or lost:
            reward -= 10.0
        info = {"crashed": crashed, "lost": lost, **self._where()}
        return self._observe(), float(reward), crashed or lost, self._steps >= STEPS, info

    def render(self) -> np.ndarray | None:
        if self.render_mode is None:
            return None
        return self._last.image

    @property
    def forest(self) -> nemoral.Forest:
        """The forest that is driven through."""
        return self._forest

    def _where(self) -> dict[str, Any]:
        """The robot's place, metres, and heading, radians, in the world."""
        return {"place_m": self._place.copy(), "heading_rad": self._heading}

    def _crashes(self, before: np.ndarray) -> bool:
        """Whether the robot touches anything on the way from a place to where it is."""
        (left, low), (right, high) = np.sort([before, self._place], axis=0)
        discs = self._forest.obstacles(
            left - ROBOT_M, low - ROBOT_M, right + ROBOT_M, high + ROBOT_M
        )
        way = self._place - before
        along = (discs[:, :2] - before) @ way / max(float(way @ way), 1e-9)
        nearest = before + np.clip(along, 0.0, 1.0)[:, None] * way
        apart = np.linalg.norm(discs[:, :2] - nearest, axis=1) - discs[:, 2]
        return bool((apart < ROBOT_M).any())

    def _locate(self) -> None:
        """Finds the place of the trail that is nearest to the robot, near the one before."""
        begins, ways = self._path[:-1], self._ways
        squares = np.maximum((ways**2).sum(axis=1), 1e-9)
        shares = (((self._place - begins) * ways).sum(axis=1) / squares).clip(0.0, 1.0)
        apart = np.linalg.norm(begins + shares[:, None] * ways - self._place, axis=1)
        first, end = self._along_m[:-1], self._along_m[1:]
        near = (end >= self._progress_m - NEAR_M) & (first <= self._progress_m + NEAR_M)
        at = int(np.where(near, apart, np.inf).argmin())
        self._off_trail_m = float(apart[at])
        self._nearest = at + round(float(shares[at]))
        self._progress_m = float(first[at] + shares[at] * (end[at] - first[at]))

    def _observe(self) -> np.ndarray:
        pose = self._forest.stand(*self._place, self._heading)
        self._last = self._forest.observe(pose, time_s=self._steps * STEP_S, index=self._steps)
        points = self._last.points.xyz
        points = points[np.linalg.norm(points, axis=1) < FARTHEST_M]
        world_from_sensor = self._last.lidar.world_from_sensor
        x, y, z = world_from_sensor[:3, :3] @ points.T + world_from_sensor[:3, 3:]
        # What stands out of the ground, logs and stumps too, but no slope.
        tall = points[z - self._forest.ground(x, y)["height_m"] > LOW_M]
        ranges = np.full(SECTORS, FARTHEST_M, np.float32)
        if len(tall):
            angle = np.arctan2(tall[:, 1], tall[:, 0])
            sector = ((angle + np.pi) / (2 * np.pi) * SECTORS).astype(int) % SECTORS
            np.minimum.at(ranges, sector, np.linalg.norm(tall[:, :2], axis=1))
        target = self._path[min(self._nearest + 3, len(self._path) - 1)] - self._place
        bearing = np.arctan2(target[1], target[0]) - self._heading
        trail = (np.array([np.cos(bearing), np.sin(bearing)]) + 1) / 2
        seen = np.concatenate([np.clip(ranges / FARTHEST_M, 0, 1), trail])
        return np.clip(seen, 0.0, 1.0).astype(np.float32)


def follow(seen: np.ndarray) -> np.ndarray:
    """An action that turns towards the trail."""
    cosine, sine = seen[-2] * 2 - 1, seen[-1] * 2 - 1
    return np.array([0.5, np.clip(2 * np.arctan2(sine, cosine), -1, 1)], np.float32)


if __name__ == "__main__":
    env = TrailEnv()
    seen, _ = env.reset(seed=1)
    total, steps, over = 0.0, 0, False
    while not over:
        seen, reward, ended, cut, info = env.step(follow(seen))
        total, steps, over = total + reward, steps + 1, ended or cut
    print(f"{steps} steps, {total:.1f} m along the trail, {info}")
