"""Data sets on disk."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, Iterator, SupportsIndex

from . import _arguments as arguments
from . import _native
from ._frame import Array, Frame


@dataclass(frozen=True)
class Sequence:
    """A sequence of a data set."""

    number: int
    """Its number."""
    seed: int
    """The seed of its world."""
    split: str | None
    """``train``, ``val`` or ``test``, if the data set is split."""
    length: int
    """How many frames its drive has, here or in other shards."""
    epsg: int | None = None
    """The EPSG code of its site's coordinates, if it is a site and the code is known."""
    origin_m: tuple[float, float, float] | None = None
    """The world's origin in the site's coordinates: easting, northing, height, which are added to
    world coordinates; None if the world is invented."""


class Dataset:
    """A finished data set, whose files are read when they are asked for.

    Every file that is read is compared with its checksum. A frame or sequence that is not here is
    an `IndexError`.

    >>> dataset = Dataset("nemoral-out")  # doctest: +SKIP
    >>> dataset[0].depth_m.max()  # doctest: +SKIP

    Raises:
        DatasetError: if the folder holds no finished data set.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._path = arguments.path("path", path)
        self._native = _native.Dataset(self._path)
        self._frames: list[tuple[int, int]] = self._native.frames()
        self._numbers = {frame: i for i, frame in enumerate(self._frames)}
        self._there = frozenset(found[0] for found in self._native.sequences())

    def __reduce__(self) -> tuple[Any, ...]:
        return (Dataset, (self._path,))

    def __repr__(self) -> str:
        return f"Dataset({self._path!r}: {len(self)} frames)"

    def __len__(self) -> int:
        """How many frames exist here."""
        return len(self._frames)

    def __getitem__(self, i: SupportsIndex) -> Frame:
        """The i-th of the frames that exist here, by sequence and index; -1 is the last one."""
        return Frame(self._native.frame(arguments.item(i, len(self))))

    def __iter__(self) -> Iterator[Frame]:
        return (self[i] for i in range(len(self)))

    def frame(self, k: SupportsIndex, *, sequence: SupportsIndex = 0) -> Frame:
        """Frame k of a sequence.

        Raises:
            IndexError: if it does not exist here.
        """
        of, index = self._sequence(sequence), arguments.index("k", k)
        number = self._numbers.get((of, index))
        if number is None:
            raise IndexError(f"frame {index} of sequence {of}: is not in this data set")
        return Frame(self._native.frame(number))

    @property
    def path(self) -> str:
        """The folder."""
        return self._path

    @property
    def frames(self) -> list[tuple[int, int]]:
        """Sequence and index of each frame."""
        return list(self._frames)

    @property
    def sequences(self) -> dict[int, Sequence]:
        """The sequences that have frames here, by number."""
        return {found[0]: Sequence(*found) for found in self._native.sequences()}

    @property
    def header(self) -> dict[str, Any]:
        """Program, version, seed and renderer that made it."""
        found: dict[str, Any] = json.loads(self._native.header())
        return found

    @property
    def classes(self) -> dict[int, str]:
        """Names of classes by their ids."""
        return {number: name for number, name, _ in self._native.classes()}

    def config(self, sequence: SupportsIndex = 0) -> dict[str, Any]:
        """The config of a sequence, every key, as nested dicts."""
        number = self._sequence(sequence)
        found: dict[str, Any] = json.loads(self._native.config(number))
        return found

    def poses(self, sequence: SupportsIndex = 0) -> Array:
        """(L, 4, 4) float64: of each frame of a sequence, the pose of the first camera (or LiDAR)
        relative to frame 0: `poses.txt`."""
        number = self._sequence(sequence)
        return self._native.poses(number).reshape(-1, 4, 4)

    def estimated_poses(self, sequence: SupportsIndex = 0) -> Array | None:
        """The same as :meth:`poses` as a navigation system estimates them, relative to the true
        pose of frame 0: `poses_estimated.txt`; None if there is no such file."""
        found = self._native.estimated_poses(self._sequence(sequence))
        return None if found is None else found.reshape(-1, 4, 4)

    def times_s(self, sequence: SupportsIndex = 0) -> list[float]:
        """Seconds after the start, of each frame of a sequence: `times.txt`."""
        return self._native.times(self._sequence(sequence))

    def trees(self, sequence: SupportsIndex = 0) -> dict[str, Any]:
        """The columns of `trees.csv`, as :meth:`Forest.trees` has them."""
        return self._native.trees(self._sequence(sequence))

    def objects(self, sequence: SupportsIndex = 0) -> dict[str, Any]:
        """The columns of `instances.csv`, as :meth:`Forest.objects` has them, but ``on_trail``,
        which files do not have."""
        return self._native.objects(self._sequence(sequence))

    def imu(self, sequence: SupportsIndex = 0) -> dict[str, Array]:
        """What the inertial measurement unit measured along a sequence's drive, as
        :meth:`Forest.imu` has it, rounded as files are.

        Raises:
            ValueError: if the data set has none: `imu.enabled` was false.
        """
        number = self._sequence(sequence)
        found = self._native.imu(number)
        if found is None:
            raise ValueError(
                f"sequence {number}: has no inertial measurements; imu.enabled = true makes them"
            )
        return found

    def _sequence(self, sequence: SupportsIndex) -> int:
        number = arguments.index("sequence", sequence)
        if number not in self._there:
            raise IndexError(f"sequence {number}: is not in this data set")
        return number
