"""LiDARs by their data sheets."""

from __future__ import annotations

from typing import Any, Mapping, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _arguments as arguments
from . import _native
from ._frame import Array
from ._rays import RayScene

_SEED = 2**63 - 1

SCAN_DTYPE: np.dtype[Any] = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("range", "<f4"),
        ("range_true", "<f4"),
        ("intensity", "<f4"),
        ("semantic", "<u4"),
        ("instance", "<u4"),
        ("pulse", "<u4"),
        ("t", "<f8"),
        ("incidence_cos", "<f4"),
        ("nx", "<f4"),
        ("ny", "<f4"),
        ("nz", "<f4"),
        ("ring", "u1"),
        ("return_no", "u1"),
        ("n_returns", "u1"),
        ("flags", "u1"),
        ("reflectivity", "u1"),
    ]
)
"""The fields of a :class:`Scanner`'s points."""

NOISE = ("data_sheet", "off", "paper", "laconte", "incidence", "linear", "snr")
"""The models of range errors."""


def _noise_keys(noise: str | Mapping[str, Any]) -> dict[str, Any]:
    """The keys of `[lidar.noise]` that are given."""
    if isinstance(noise, str):
        given: dict[str, Any] = {"model": noise}
    elif isinstance(noise, Mapping):
        given = {arguments.text("a key of noise", key): noise[key] for key in noise}
    else:
        allowed = f"one of {', '.join(NOISE)}, or a dict of such a model and its numbers"
        raise arguments.refuse("noise", noise, allowed)
    model = given.get("model", "data_sheet")
    if model not in NOISE:
        meant = arguments.nearest(model, NOISE) if isinstance(model, str) else None
        raise arguments.refuse("noise", model, f"one of {', '.join(NOISE)}", meant)
    if model == "data_sheet":
        given.pop("model", None)
    return given


def _weather(weather: Mapping[str, Any]) -> dict[str, Any]:
    if not isinstance(weather, Mapping):
        raise arguments.refuse("weather", weather, "a dict of keys of [weather]")
    return {arguments.text("a key of weather", key): weather[key] for key in weather}


class Scan(np.ndarray[Any, np.dtype[Any]]):
    """The points of a :class:`Scanner`: an (N,) structured array, in the order of firing.

    All fields are there by name, as in ``scan["return_no"]``. The most used ones are attributes,
    too, named as those of :class:`nemoral.Points`, but ``scan["flags"]``: ``scan.flags`` is
    NumPy's, of the array. Positions are in the LiDAR's frame (x forward, y left, z up) at the
    scan's time, or at the pulse's if the scanner does not deskew, metres.
    """

    def __getitem__(self, key: Any) -> Any:
        found = super().__getitem__(key)
        # A column is a plain array.
        if isinstance(found, Scan) and found.dtype != SCAN_DTYPE:
            return found.view(np.ndarray)
        return found

    def _column(self, name: str) -> Array:
        # A copy in any case: NumPy takes a view of at most one point for contiguous.
        found: Array = self[name].copy()
        return found

    def _vector(self, names: tuple[str, str, str]) -> Array:
        return np.stack([self[name] for name in names], axis=-1)

    @property
    def array(self) -> Array:
        """(N,) structured: the points as a plain array."""
        return self.view(np.ndarray)

    @property
    def xyz(self) -> Array:
        """(N, 3) float32: positions, metres."""
        return self._vector(("x", "y", "z"))

    @property
    def normal(self) -> Array:
        """(N, 3) float32: unit normals of the surfaces, towards the sensor; 0 for false alarms."""
        return self._vector(("nx", "ny", "nz"))

    @property
    def intensity(self) -> Array:
        """(N,) float32: received power, 0 to 1, of a perfect plate at the same place."""
        return self._column("intensity")

    @property
    def semantic(self) -> Array:
        """(N,) uint32: the meshes' numbers of that name."""
        return self._column("semantic")

    @property
    def instance(self) -> Array:
        """(N,) uint32: the instances' numbers."""
        return self._column("instance")

    @property
    def range_m(self) -> Array:
        """(N,) float32: measured ranges, metres."""
        return self._column("range")

    @property
    def true_range_m(self) -> Array:
        """(N,) float32: ranges without error, metres; 0 for false alarms."""
        return self._column("range_true")

    @property
    def time_s(self) -> Array:
        """(N,) float64: times of firing, seconds after the time of the scan."""
        return self._column("t")

    @property
    def ring(self) -> Array:
        """(N,) uint8: laser lines."""
        return self._column("ring")


class Scanner:
    """A LiDAR by its data sheet, for scans of a :class:`RayScene`.

    Args:
        device: such as ``"avia"``; :meth:`devices` lists all.
        noise: the model of range errors: ``"data_sheet"``; ``"off"`` for exact ranges; ``"paper"``,
            ``"laconte"``, ``"incidence"``, ``"linear"`` or ``"snr"``; or keys of the config's
            ``[lidar.noise]``, such as ``{"model": "linear", "per_metre": 0.001}``. What is not
            given is the data sheet's, else the config's default. Pointing and intensities have
            the device's errors, too, but with ``"off"``.
        pulses: pulses of a scan; those of 0.1 s if None.
        rings: rings of sub-rays of a pulse's beam, 0 to 8: 2 are 19 sub-rays, 0 a single ray.
        max_range_m: the greatest range, metres; the device's if None.
        weather: keys of the config's ``[weather]``, such as ``{"visibility_m": 80}`` or
            ``{"snowfall_mm_per_h": 1}``: the air weakens echoes, and fog, drops and flakes have
            echoes of their own, which have no object and the flag 2. In a vacuum if None.
        deskew: whether points of a LiDAR that moves are in its frame at the scan's time; if False,
            each is in its frame when the pulse was fired, as sensors send them.
    """

    def __init__(
        self,
        device: str,
        *,
        noise: str | Mapping[str, Any] = "data_sheet",
        pulses: SupportsIndex | None = None,
        rings: SupportsIndex | None = None,
        max_range_m: float | None = None,
        weather: Mapping[str, Any] | None = None,
        deskew: bool = True,
    ) -> None:
        name = arguments.text("device", device)
        keys = _noise_keys(noise)
        air = None if weather is None else _weather(weather)
        least, most = 1, 2**31 - 1
        self._arguments: dict[str, Any] = {
            "noise": dict(noise) if isinstance(noise, Mapping) else noise,
            "pulses": None if pulses is None else arguments.whole("pulses", pulses, least, most),
            "rings": None if rings is None else arguments.whole("rings", rings, 0, 8),
            "max_range_m": max_range_m,
            "weather": air,
            "deskew": arguments.flag("deskew", deskew),
        }
        if max_range_m is not None:
            range_m = arguments.real("max_range_m", max_range_m, 0.0, 1e6)
            self._arguments["max_range_m"] = range_m
        self._native = _native.Scanner(
            name,
            [
                {"lidar.device": name},
                {f"lidar.noise.{key}": keys[key] for key in keys},
                {f"weather.{key}": value for key, value in (air or {}).items()},
            ],
            keys.get("model") != "off",
            self._arguments["pulses"],
            self._arguments["rings"],
            self._arguments["max_range_m"],
            air is not None,
            self._arguments["deskew"],
        )
        self.device: str = device
        """Its name."""
        about = self._native.about()
        self.title: str = about[0]
        """What it is called by its maker."""
        self.source: str = about[1]
        """Where its figures come from."""
        self.duration_s: float = about[2]
        """How long a scan takes."""
        self.pulses: int = about[3]
        """How many pulses a scan has."""

    def __reduce__(self) -> tuple[Any, ...]:
        return (_scanner, (self.device, self._arguments))

    def __repr__(self) -> str:
        return f"Scanner({self.device!r}: {self.title}, {self.pulses} pulses a scan)"

    @staticmethod
    def devices() -> list[str]:
        """The names of all devices."""
        return _native.Scanner.devices()

    def scan(
        self,
        scene: RayScene,
        pose: npt.ArrayLike | None = None,
        *,
        time_s: float = 0.0,
        seed: SupportsIndex = 0,
        index: SupportsIndex = 0,
        velocity: npt.ArrayLike = (0.0, 0.0, 0.0),
        turn_rate: npt.ArrayLike = (0.0, 0.0, 0.0),
    ) -> Scan:
        """The returns of one scan, in the order of firing.

        Args:
            scene: what is scanned.
            pose: (4, 4), scene from LiDAR, at the time of the scan, which is the middle of it; at
                the scene's ``origin``, along its axes, if None.
            time_s: the time of the scan, seconds, which decides where the pattern is.
            seed, index: by which noise is drawn: equal numbers give equal scans.
            velocity: (3,), m/s along the LiDAR's axes while it scans, at most 100 along each.
            turn_rate: (3,), rad/s about the LiDAR's axes, at most 10 about each.
        """
        if not isinstance(scene, RayScene):
            raise arguments.refuse("scene", scene, "a RayScene")
        moves = [
            arguments.array(name, value, np.float64, (3,)).tolist()
            for name, value in (("velocity", velocity), ("turn_rate", turn_rate))
        ]
        packed = self._native.scan(
            scene._native,
            scene._pose(pose),
            arguments.real("time_s", time_s, 0.0, 1e9),
            arguments.whole("seed", seed, 0, _SEED),
            arguments.whole("index", index, 0, _SEED),
            *moves,
        )
        return packed.view(SCAN_DTYPE).view(Scan)


def _scanner(device: str, given: dict[str, Any]) -> Scanner:
    return Scanner(device, **given)
