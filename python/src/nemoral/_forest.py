"""Forests, recorded in memory."""

from __future__ import annotations

import json
import os
from typing import Any, Iterator, Sequence, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _arguments as arguments
from . import _native
from ._frame import Array, Frame


KEYWORDS = ("config", "seed", "backend", "cache")
"""The arguments of a forest, which are no keys of the config."""


def presets() -> dict[str, str]:
    """What each preset is for, by name."""
    return dict(_native.presets())


class Forest:
    """A virtual forest with a robot and its sensors, which record frames in memory.

    A frame is what ``nemoral generate`` writes for the same config: pictures, classes, instances
    and points are equal to the byte; depth and normals are finer than files have them.

    Args:
        config: a preset's name (:func:`presets`), the path of a TOML file, or a dict of the
            config's keys, nested or dotted. The preset ``default`` if None.
        seed: the world's seed, 0 to 2**63 - 1.
        backend: what takes the pictures: ``"cpu"``, ``"gpu"``, or ``"auto"`` (a hardware GPU if
            there is one). The CPU gives the same bytes on every machine.
        cache: where grown plants are kept between runs: True for the user's cache folder, a folder,
            or False for none.
        overrides: keys of the config over it, such as ``**{"camera.width_px": 640}``.

    Raises:
        ConfigError: if something is wrong with the config; see its attributes.

    >>> forest = Forest("demo", seed=7, **{"camera.width_px": 320, "camera.height_px": 200})
    >>> forest.frame(1).image.shape
    (200, 320, 3)
    """

    def __init__(
        self,
        config: arguments.Config = None,
        seed: SupportsIndex | None = None,
        *,
        backend: str = "cpu",
        cache: bool | str | os.PathLike[str] | None = True,
        **overrides: Any,
    ) -> None:
        self._request = (
            *arguments.layers(config, seed, overrides, KEYWORDS),
            arguments.text("backend", backend),
            arguments.keep(cache),
        )
        self._native = self._make()
        self._process = os.getpid()

    def _make(self) -> _native.Forest:
        return _native.Forest(*self._request, arguments.PROGRAM)

    @property
    def _live(self) -> _native.Forest:
        here = os.getpid()
        if here != self._process:
            # What a thread of the parent was working on when this process was forked cannot be
            # used here, nor can a GPU.
            if _native.process_changed() or self._native.backend != "cpu":
                self._native = self._make()
            self._process = here
        return self._native

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self._request,))

    def __repr__(self) -> str:
        return f"Forest({len(self)} frames in {self.sequences} sequences, seed {self.seed})"

    def __len__(self) -> int:
        """How many frames all sequences have."""
        return self.sequences * self.frames

    def __getitem__(self, i: SupportsIndex) -> Frame:
        """The i-th frame of all sequences, one after the other; -1 is the last one."""
        number = arguments.item(i, len(self))
        sequence, frame = divmod(number, self.frames)
        return self.frame(frame, sequence=sequence)

    def __iter__(self) -> Iterator[Frame]:
        return (self[i] for i in range(len(self)))

    @property
    def seed(self) -> int:
        """The seed of sequence 0, from which the others' are drawn."""
        return int(self.config(0)["seed"])

    @property
    def sequences(self) -> int:
        """How many sequences there are, each in a world of its own."""
        return self._live.sequences

    @property
    def frames(self) -> int:
        """How many frames each sequence has."""
        return self._live.frames

    @property
    def backend(self) -> str:
        """What takes the pictures."""
        return self._live.backend

    @property
    def classes(self) -> dict[int, str]:
        """Names of classes by their ids."""
        return {number: name for number, name, _ in self._live.classes()}

    def config(self, sequence: SupportsIndex = 0) -> dict[str, Any]:
        """The config of a sequence, every key, as nested dicts."""
        number = self._sequence(sequence)
        found: dict[str, Any] = json.loads(self._live.config(number))["config"]
        return found

    def drawn(self, sequence: SupportsIndex = 0) -> dict[str, Any]:
        """What `[vary]` drew for a sequence, by key; and its split, if the data set has splits."""
        about = json.loads(self._live.config(self._sequence(sequence)))
        found: dict[str, Any] = about["drawn"]
        if about["split"] is not None:
            found["split"] = about["split"]
        return found

    def to_toml(self) -> str:
        """The config as a TOML file, from which the command makes the same frames."""
        return self._live.to_toml()

    def prepare(self, *, sequence: SupportsIndex = 0) -> None:
        """Grow the plants of a sequence, which its first frame would do."""
        self._live.prepare(self._sequence(sequence))

    def frame(self, k: SupportsIndex, *, sequence: SupportsIndex = 0) -> Frame:
        """Record frame k of a sequence, in any order.

        Raises:
            IndexError: if the sequence does not have this frame. A forest has the config's
                ``frames``; ``Forest(..., frames=100)`` has more.
        """
        number, frame = self._sequence(sequence), self._frame(k)
        return Frame(self._live.frame(number, frame))

    def pose(self, k: SupportsIndex, *, sequence: SupportsIndex = 0) -> Array:
        """(4, 4) float64: the body's pose in the world at frame k."""
        return self._live.pose(self._sequence(sequence), self._frame(k))[1]

    def time_s(self, k: SupportsIndex, *, sequence: SupportsIndex = 0) -> float:
        """The time of frame k, seconds after the start of its sequence."""
        return self._live.pose(self._sequence(sequence), self._frame(k))[0]

    def stand(
        self, x: float, y: float, heading: float, *, sequence: SupportsIndex = 0
    ) -> Array:
        """(4, 4) float64: the pose of the body on the ground at x, y (metres), facing a heading
        (radians, counter-clockwise from east); its wheels give height, pitch and roll."""
        number = self._sequence(sequence)
        at = (arguments.real(name, v) for name, v in (("x", x), ("y", y), ("heading", heading)))
        return self._live.stand(number, *at)

    def observe(
        self,
        pose: npt.ArrayLike,
        *,
        time_s: float = 0.0,
        index: SupportsIndex | None = None,
        velocity: npt.ArrayLike = (0.0, 0.0, 0.0),
        turn_rate: npt.ArrayLike = (0.0, 0.0, 0.0),
        sequence: SupportsIndex = 0,
    ) -> Frame:
        """Record with the same sensors at any pose of the body.

        With pose, time and index of a frame of the sequence, the result is that frame.

        Args:
            pose: (4, 4), world from body; or x, y (metres) and heading (radians,
                counter-clockwise from east) of a body on the ground.
            time_s: seconds after the start of the sequence; it decides where scan patterns are.
            index: the number by which the sensors' noise is drawn, 0 to 2**63 - 1; if None, pose
                and time decide. Equal arguments give equal frames.
            velocity: (3,), m/s along the body's axes while the sensors record.
            turn_rate: (3,), rad/s about the body's axes.
            sequence: in which world.
        """
        number = self._sequence(sequence)
        matrix = self._pose(pose, number)
        moves = [
            arguments.array(name, value, np.float64, (3,)).tolist()
            for name, value in (("velocity", velocity), ("turn_rate", turn_rate))
        ]
        key = None if index is None else arguments.whole("index", index, 0, 2**63 - 1)
        time = arguments.real("time_s", time_s, 0.0, 1e9)
        return Frame(self._live.observe(number, matrix, time, key, *moves))

    def _pose(self, pose: npt.ArrayLike, sequence: int) -> list[float]:
        allowed = "a 4x4 matrix, or x, y and heading"
        try:
            found = np.asarray(pose, np.float64)
        except (TypeError, ValueError):
            raise arguments.refuse("pose", pose, allowed) from None
        if found.shape == (3,):
            if not np.isfinite(found).all():
                raise arguments.refuse("pose", pose, "finite numbers")
            found = self._live.stand(sequence, *found.tolist())
        if found.shape != (4, 4):
            raise arguments.refuse("pose", pose, allowed)
        numbers: list[float] = found.ravel().tolist()
        return numbers

    def ground(
        self, x: npt.ArrayLike, y: npt.ArrayLike, *, sequence: SupportsIndex = 0
    ) -> dict[str, Array]:
        """The ground at places, of any shape S.

        Returns:
            ``height_m`` (S) float64; ``normal`` (S, 3) float32, upward; ``semantic`` (S) uint8,
            the class; ``trail_edge_m`` (S) float64, the distance to the nearest edge of a trail,
            negative on one, infinite far from any.
        """
        number = self._sequence(sequence)
        try:
            xs, ys = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        except (TypeError, ValueError):
            raise arguments.refuse("x, y", (x, y), "numbers of equal shapes") from None
        places = np.stack([xs.ravel(), ys.ravel()], axis=1)
        found = self._live.ground(number, places)
        return {name: v.reshape(xs.shape + v.shape[1:]) for name, v in found.items()}

    def trees(
        self,
        xmin: float,
        ymin: float,
        xmax: float,
        ymax: float,
        *,
        sequence: SupportsIndex = 0,
    ) -> dict[str, Any]:
        """The trees whose feet are in a rectangle of the world, as columns of N: what a forester
        would measure.

        Returns:
            ``object`` uint64 and ``instance`` uint32 ids, ``species``, ``position_m`` (N, 3),
            ``dbh_m``, ``height_m``, ``crown_base_m``, ``crown_radius_m``, ``leaf_area_m2``,
            ``stem_volume_m3``, ``wood_volume_m3`` and ``merchantable_volume_m3`` (NaN where they
            are not known, as of models), ``lean_rad``, ``age_class``, ``alive``, ``field_id``.
        """
        low, high = self._rectangle(xmin, ymin, xmax, ymax)
        return self._live.inventory(self._sequence(sequence), low, high, True)

    def objects(
        self,
        xmin: float,
        ymin: float,
        xmax: float,
        ymax: float,
        *,
        sequence: SupportsIndex = 0,
    ) -> dict[str, Any]:
        """All objects with an id whose feet are in a rectangle, as columns of N.

        Returns:
            ``object`` uint64 and ``instance`` uint32 ids, ``kind`` (tree, stump, shrub, rock, log,
            root_plate), ``species``, ``position_m`` (N, 3), ``radius_m`` at the ground (of a log,
            half of its length), ``height_m``, ``on_trail`` bool: stones that are no obstacle.
        """
        low, high = self._rectangle(xmin, ymin, xmax, ymax)
        return self._live.inventory(self._sequence(sequence), low, high, False)

    def survey(
        self,
        xmin: float,
        ymin: float,
        xmax: float,
        ymax: float,
        *,
        cell_m: float = 0.5,
        rays_a_side: SupportsIndex = 5,
        layer_m: float = 1.0,
        sequence: SupportsIndex = 0,
    ) -> dict[str, Any]:
        """Maps of ground and canopy over a rectangle of the world, which must be whole cells, and
        its leaf area by height, as ``nemoral inventory`` writes them.

        Args:
            cell_m: Side of a cell, metres.
            rays_a_side: Vertical rays a side of a cell, 1 to 32.
            layer_m: Thickness of the profile's layers, metres.

        Returns:
            Maps of R rows from north to south and C columns from west to east: ``ground_m``,
            ``surface_m`` (the highest point of a cell), ``height_m`` (of the canopy above the
            ground), ``cover`` (share of rays that meet something 2 m high or higher) float64, and
            ``object`` uint64 (whose crown is the top, 0 if none is); places of the cells' middles
            ``x_m`` (C,) and ``y_m`` (R,); ``leaf_area_density_m2_m3`` and
            ``wood_area_density_m2_m3`` of layers from the ground up; ``leaf_area_index`` (of all
            plants, in the forest's season) and ``canopy_cover`` floats.
        """
        low, high = self._rectangle(xmin, ymin, xmax, ymax)
        params = (
            arguments.real("cell_m", cell_m, 0.01, 1000),
            arguments.whole("rays_a_side", rays_a_side, 1, 32),
            arguments.real("layer_m", layer_m, 0.1, 100),
        )
        return self._live.survey(self._sequence(sequence), low, high, params)

    def imu(self, *, sequence: SupportsIndex = 0) -> dict[str, Array]:
        """What an inertial measurement unit on the robot measures along the drive of a sequence,
        from frame 0's time until the last scan has ended, and how it truly moves. ``[imu]``
        describes it.

        Returns:
            Columns of N float64: ``time_s``; ``angular_rate_rad_s`` and ``specific_force_m_s2``
            (N, 3), with their errors, in the unit's frame (x forward, y left, z up; at rest it
            feels 9.81 m/s² upwards); the truth in the world: ``position_m``, ``velocity_m_s``
            (N, 3) and ``rotation_xyzw`` (N, 4), quaternions of which each has the sign that is
            nearer to the one before; ``gyroscope_bias_rad_s`` and ``accelerometer_bias_m_s2``
            (N, 3).

        Raises:
            ValueError: if the robot stands at stations or flies along lines, or frames are
                chosen by `balance.targets`; or if there are more than five million samples.
        """
        return self._live.imu(self._sequence(sequence))

    def obstacles(
        self,
        xmin: float,
        ymin: float,
        xmax: float,
        ymax: float,
        *,
        sequence: SupportsIndex = 0,
    ) -> Array:
        """(N, 3) float64: x, y and radius, metres, of the discs that reach into a rectangle of the
        world and that a robot must not run into. A stem, a shrub, a rock or a pond is one; a log or
        a stream is a row of them. Culverts, and what lies on a trail, have none."""
        low, high = self._rectangle(xmin, ymin, xmax, ymax)
        return self._live.obstacles(self._sequence(sequence), low, high)

    def cast(
        self,
        rays: npt.ArrayLike,
        *,
        around: Sequence[float] | None = None,
        sequence: SupportsIndex = 0,
    ) -> dict[str, Array]:
        """What rays in the world hit, leaves and grass included.

        Args:
            rays: (N, 6), origins and directions; world frame, metres.
            around: x and y of the place up to whose visible radius the scene reaches; the mean of
                the origins if None, which is refused if one of them is farther away than that.
            sequence: in which world.

        Returns:
            ``distance_m`` (N,) float32, infinite where nothing is hit; ``normal`` (N, 3) float32;
            ``semantic`` (N,) uint8 and ``instance`` (N,) uint32.
        """
        number = self._sequence(sequence)
        found = arguments.array("rays", rays, np.float64, (None, 6))
        centre = None
        if around is not None:
            centre = arguments.array("around", around, np.float64, (2,)).tolist()
        return self._live.cast(number, found, centre)

    def _rectangle(
        self, xmin: float, ymin: float, xmax: float, ymax: float
    ) -> tuple[list[float], list[float]]:
        low = [arguments.real("xmin", xmin), arguments.real("ymin", ymin)]
        high = [arguments.real("xmax", xmax), arguments.real("ymax", ymax)]
        if low[0] > high[0] or low[1] > high[1]:
            found = (xmin, ymin, xmax, ymax)
            raise arguments.refuse("rectangle", found, "xmin <= xmax and ymin <= ymax")
        return low, high

    def _sequence(self, sequence: SupportsIndex) -> int:
        return arguments.exists("sequence", "sequence", sequence, self.sequences, "sequences")

    def _frame(self, k: SupportsIndex) -> int:
        return arguments.exists("k", "frame", k, self.frames, "frames")


def _restored(request: tuple[Any, ...]) -> Forest:
    forest = Forest.__new__(Forest)
    forest._request = request
    forest._native = forest._make()
    forest._process = os.getpid()
    return forest
