"""Frames: what sensors recorded at one time, with the truth."""

from __future__ import annotations

import html
import os
import struct
import zlib
from functools import cached_property
from typing import Any, Iterable, Iterator, Literal, Mapping

import numpy as np
import numpy.typing as npt

from . import _arguments as arguments
from . import _native
from ._errors import ConfigError

Array = npt.NDArray[Any]

_TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}

POINT_DTYPE: np.dtype[Any] = np.dtype([(name, _TYPES[kind]) for name, kind in _native.POINT_FIELDS])
"""The fields of a point, packed as in a `.ply` file's vertices."""

_PLAIN_DTYPE = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("class", "u1"),
        ("label_instance", "<i4"),
    ]
)


class Points:
    """The points of a scan, N in the order of firing.

    As a structured array it is :attr:`array` (or ``numpy.asarray(points)``, ``points["ring"]``);
    columns are attributes. Positions are in the LiDAR's frame at the frame's time (or at the
    pulse's, if the LiDAR does not deskew), metres.
    """

    def __init__(self, array: Array) -> None:
        self.array: Array = array
        """(N,) structured: every field that is known. Of a data set without PLY files, x, y, z,
        intensity, class and label_instance."""

    def __len__(self) -> int:
        return len(self.array)

    def __getitem__(self, key: Any) -> Array:
        found: Array = self.array[key]
        return found

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> Array:
        if dtype is not None and np.dtype(dtype) != self.array.dtype:
            return self.array.astype(dtype)
        return self.array.copy() if copy else self.array

    def __repr__(self) -> str:
        return f"Points({len(self)}: {', '.join(self.array.dtype.names or ())})"

    def _column(self, name: str) -> Array:
        if name not in (self.array.dtype.names or ()):
            raise AttributeError(f"these points have no {name}: the data set has no PLY files")
        # A copy in any case: NumPy takes a view of at most one point for contiguous.
        found: Array = self.array[name].copy()
        return found

    def _vector(self, first: Literal["x", "nx"]) -> Array:
        self._column(first)
        fields = self.array.dtype.fields
        assert fields is not None
        offset = fields[first][1]
        flat = np.ascontiguousarray(self.array).view(np.uint8)
        rows = flat.reshape(len(self), self.array.dtype.itemsize)
        packed: Array = rows[:, offset : offset + 12].copy()
        return packed.view("<f4").reshape(len(self), 3)

    @cached_property
    def xyz(self) -> Array:
        """(N, 3) float32: positions, metres."""
        return self._vector("x")

    @cached_property
    def normal(self) -> Array:
        """(N, 3) float32: unit normals of the surfaces, towards the sensor; 0 for false alarms."""
        return self._vector("nx")

    @cached_property
    def intensity(self) -> Array:
        """(N,) float32: received power, 0 to 1, of a perfect plate at the same place."""
        return self._column("intensity")

    @cached_property
    def semantic(self) -> Array:
        """(N,) uint8: class ids (:attr:`Frame.classes`)."""
        return self._column("class")

    @cached_property
    def fine_semantic(self) -> Array:
        """(N,) uint8: what the surface is, finer than classes: a place in
        ``nemoral.SEMANTICS``."""
        return self._column("semantic")

    @cached_property
    def instance(self) -> Array:
        """(N,) int32: 16-bit instance ids as in `.label` files; 0 for none."""
        return self._column("label_instance")

    @cached_property
    def object(self) -> Array:
        """(N,) uint64: true ids of objects, as in inventories; 0 for none."""
        chunk_x = self._column("chunk_x").astype(np.int64)
        chunk_y, item = self.array["chunk_y"].astype(np.int64), self.array["item"].astype(np.int64)
        ids = ((chunk_x + (1 << 21)) << 38) | ((chunk_y + (1 << 21)) << 16) | item
        return np.where(item == 0, 0, ids).astype(np.uint64)

    @cached_property
    def range_m(self) -> Array:
        """(N,) float32: measured ranges, metres."""
        return self._column("range")

    @cached_property
    def true_range_m(self) -> Array:
        """(N,) float32: ranges without error, metres; 0 for false alarms."""
        return self._column("range_true")

    @cached_property
    def time_s(self) -> Array:
        """(N,) float64: times of firing, seconds after the frame's time."""
        return self._column("t")

    @cached_property
    def ring(self) -> Array:
        """(N,) uint8: laser lines."""
        return self._column("ring")

    @cached_property
    def flags(self) -> Array:
        """(N,) uint8: the sum of 1 for mixed returns, 2 for false alarms, 4 for returns by way of
        water, 8 for what grows on a stem (ivy, honeysuckle, moss), 16 for what grows on branches
        (clematis)."""
        return self._column("flags")


def _state(holder: object, names: Iterable[str]) -> dict[str, Any]:
    """What of an object is pickled: its attributes, and those that are computed when they are asked
    for, so that the compiled part is not needed afterwards. The object itself keeps no more than
    before."""
    found = dict(vars(holder))
    found.pop("_native", None)
    for name in names:
        if name not in found:
            found[name] = getattr(type(holder), name).func(holder)
    return found


class _Sensor:
    """What cameras and LiDARs have in common."""

    _native: _native.Frame | None = None
    """None of a frame from another process, which has all arrays."""

    _pickled: tuple[str, ...] = ()

    def __init__(self, frame: Frame, number: int, about: Mapping[str, Any]) -> None:
        self._native = frame._native
        self._number = number
        self.name: str = about["name"]
        """Its name: that of its table in the config."""
        self.body_from_sensor: Array = about["body_from_sensor"]
        """(4, 4) float64: where it is on the body."""
        self.world_from_sensor: Array = frame.world_from_body @ self.body_from_sensor
        """(4, 4) float64: its pose in the world at the frame's time."""

    def __getstate__(self) -> dict[str, Any]:
        return _state(self, self._pickled)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r})"


class Camera(_Sensor):
    """A camera's picture with the truth at each pixel's centre; H rows and W columns.

    Images become arrays when they are first asked for. The truth that a config must ask for is
    None otherwise.
    """

    _pickled = (
        "image",
        "semantic",
        "instance",
        "depth_m",
        "normal",
        "sky",
        "_flow",
        "trunks",
        "radiance",
        "boxes",
    )

    def __init__(self, frame: Frame, number: int, about: Mapping[str, Any]) -> None:
        super().__init__(frame, number, about)
        self.width_px: int = about["width_px"]
        """W, pixels."""
        self.height_px: int = about["height_px"]
        """H, pixels."""
        self.intrinsics: Array = about["intrinsics"]
        """(3, 3) float64: K. The first pixel's centre is at (0.5, 0.5)."""
        self.distortion_model: str = about["distortion_model"]
        """``none``, ``brown_conrady`` or ``fisheye``."""
        self.distortion: Array = about["distortion"]
        """float64: k1, k2, p1, p2, k3 of Brown and Conrady, k1 to k4 of a fisheye, as OpenCV has
        them; empty for none."""

    def _asked(self, kind: str) -> Array | None:
        assert self._native is not None
        return self._native.image(self._number, kind)

    def _must(self, kind: str) -> Array:
        image = self._asked(kind)
        assert image is not None
        return image

    @cached_property
    def image(self) -> Array:
        """(H, W, 3) uint8: sRGB."""
        return self._must("image")

    @cached_property
    def semantic(self) -> Array:
        """(H, W) uint8: class ids (:attr:`Frame.classes`)."""
        return self._must("semantic")

    @cached_property
    def instance(self) -> Array:
        """(H, W) uint32: 24-bit instance ids; 0 for none."""
        return self._must("instance")

    @cached_property
    def depth_m(self) -> Array:
        """(H, W) float32: planar depth, metres; 0 where nothing was hit. Data sets have it to
        1/256 m, unless they have `.npy` files."""
        return self._must("depth_m")

    @cached_property
    def normal(self) -> Array:
        """(H, W, 3) float32: unit normals in the optical frame; 0 where nothing was hit. Data sets
        have them within 0.4 degrees."""
        return self._must("normal")

    @cached_property
    def sky(self) -> Array | None:
        """(H, W) bool: where nothing was hit; if `camera.sky`."""
        return self._asked("sky")

    @cached_property
    def _flow(self) -> Array | None:
        return self._asked("flow")

    @cached_property
    def flow(self) -> Array | None:
        """(H, W, 2) float32: where each point is in the next frame's picture, pixels to the right
        and down; NaN where there is none; if `camera.flow`. Data sets have it to 1/64 pixel,
        and none of more than 512 pixels."""
        return None if self._flow is None else np.ascontiguousarray(self._flow[..., :2])

    @cached_property
    def flow_seen(self) -> Array | None:
        """(H, W) bool: whether the next picture shows the point; if `camera.flow`."""
        return None if self._flow is None else self._flow[..., 2] > 0

    @cached_property
    def trunks(self) -> Array | None:
        """(H, W) uint32: instance ids of the nearest trunks, also where they are hidden; if
        `camera.trunks`."""
        return self._asked("trunks")

    @cached_property
    def radiance(self) -> Array | None:
        """(H, W, 3) float32: linear sRGB, cd/m2, behind the lens; if `camera.radiance`."""
        return self._asked("radiance")

    @cached_property
    def boxes(self) -> dict[str, Any] | None:
        """Columns of B boxes around objects, if `camera.boxes`: `object` (B,) uint64, `instance`
        (B,) uint32, `kind` list of text, `visible` and `whole` (B, 4) int64 (left, top, right,
        bottom; -1 if no pixel shows it), `visible_px` and `whole_px` (B,) uint32,
        `camera_from_box` (B, 4, 4) float64, `size_m` (B, 3) float64; data sets have metres to four
        digits."""
        assert self._native is not None
        return self._native.boxes(self._number)


class Lidar(_Sensor):
    """A LiDAR's scan."""

    _pickled = ("points",)

    def __init__(self, frame: Frame, number: int, about: Mapping[str, Any]) -> None:
        super().__init__(frame, number, about)
        self.deskewed: bool = about["deskewed"]
        """Whether positions are in the LiDAR's frame at the frame's time."""

    @cached_property
    def points(self) -> Points:
        """The points."""
        assert self._native is not None
        packed = self._native.points(self._number)
        if packed is not None:
            return Points(packed.view(POINT_DTYPE))
        xyzi, labels = self._plain
        plain = np.zeros(len(xyzi), _PLAIN_DTYPE)
        for i, name in enumerate(("x", "y", "z", "intensity")):
            plain[name] = xyzi[:, i]
        plain["class"] = labels & 0xFF
        plain["label_instance"] = labels >> 16
        return Points(plain)

    @property
    def _plain(self) -> tuple[Array, Array]:
        """What `.bin` and `.label` files hold."""
        if self._native is not None:
            return self._native.plain_points(self._number)
        points = self.points.array
        xyzi = np.stack([points[name] for name in ("x", "y", "z", "intensity")], axis=1)
        instance = points["label_instance"].astype(np.uint32)
        return xyzi, points["class"] | instance << 16

    @cached_property
    def velodyne(self) -> Array:
        """(N, 4) float32: x, y, z, intensity: what a `.bin` file holds."""
        return self._plain[0]

    @cached_property
    def labels(self) -> Array:
        """(N,) uint32: class in the lower, instance in the upper 16 bits: a `.label` file."""
        return self._plain[1]


class Frame:
    """What all sensors recorded at one time.

    The images and points of the first camera and LiDAR are attributes of the frame; those of all
    are in :attr:`cameras` and :attr:`lidars`. A frame does not need its forest or data set to stay.
    It is pickled with all its arrays, as they are then.
    """

    def __init__(self, native: _native.Frame) -> None:
        self._native = native

    def __getstate__(self) -> dict[str, Any]:
        names = ("index", "sequence", "time_s", "world_from_body", "classes", "colours")
        return _state(self, (*names, "cameras", "lidars"))

    @cached_property
    def index(self) -> int | None:
        """The frame's number in its sequence; None if it was observed without one."""
        return self._native.index

    @cached_property
    def sequence(self) -> int:
        """The number of its sequence."""
        return self._native.sequence

    @cached_property
    def time_s(self) -> float:
        """Seconds after the start of the sequence: the middle of exposure and scan."""
        return self._native.time_s

    @cached_property
    def world_from_body(self) -> Array:
        """(4, 4) float64: the body's pose in the world."""
        return self._native.world_from_body

    @cached_property
    def classes(self) -> dict[int, str]:
        """Names of classes by their ids."""
        return {number: name for number, name, _ in self._native.classes}

    @cached_property
    def colours(self) -> dict[int, tuple[int, int, int]]:
        """Colours of classes by their ids, sRGB."""
        return {number: colour for number, _, colour in self._native.classes}

    @cached_property
    def cameras(self) -> dict[str, Camera]:
        """The cameras by name, the first one first."""
        found = (Camera(self, i, about) for i, about in enumerate(self._native.cameras))
        return {camera.name: camera for camera in found}

    @cached_property
    def lidars(self) -> dict[str, Lidar]:
        """The LiDARs by name, the first one first."""
        found = (Lidar(self, i, about) for i, about in enumerate(self._native.lidars))
        return {lidar.name: lidar for lidar in found}

    @property
    def camera(self) -> Camera:
        """The first camera."""
        for camera in self.cameras.values():
            return camera
        raise ConfigError("this frame has no camera: camera.enabled = false", "camera.enabled")

    @property
    def lidar(self) -> Lidar:
        """The first LiDAR."""
        for lidar in self.lidars.values():
            return lidar
        raise ConfigError("this frame has no LiDAR: lidar.enabled = false", "lidar.enabled")

    @property
    def image(self) -> Array:
        """(H, W, 3) uint8: the first camera's picture, sRGB."""
        return self.camera.image

    @property
    def semantic(self) -> Array:
        """(H, W) uint8: the first camera's class ids."""
        return self.camera.semantic

    @property
    def instance(self) -> Array:
        """(H, W) uint32: the first camera's instance ids; 0 for none."""
        return self.camera.instance

    @property
    def depth_m(self) -> Array:
        """(H, W) float32: the first camera's planar depth, metres; 0 for none."""
        return self.camera.depth_m

    @property
    def normal(self) -> Array:
        """(H, W, 3) float32: the first camera's normals in its optical frame; 0 for none."""
        return self.camera.normal

    @property
    def points(self) -> Points:
        """The first LiDAR's points."""
        return self.lidar.points

    def to_dict(self) -> dict[str, Any]:
        """The arrays of the first sensors by name: what training usually takes. Without a camera or
        a LiDAR, its entries are missing."""
        found: dict[str, Any] = {
            "sequence": self.sequence,
            "index": -1 if self.index is None else self.index,
            "time_s": self.time_s,
            "world_from_body": self.world_from_body,
        }
        if self.cameras:
            for name in ("image", "semantic", "instance", "depth_m", "normal"):
                found[name] = getattr(self, name)
        if self.lidars:
            points = self.points
            found["xyz"] = points.xyz
            found["intensity"] = points.intensity
            found["point_semantic"] = points.semantic
            found["point_instance"] = points.instance
        return found

    def show(self) -> Array:
        """(H, 2 W, 3) uint8: the first camera's picture beside its classes, to look at."""
        table = np.zeros((256, 3), np.uint8)
        for number, colour in self.colours.items():
            table[number] = colour
        return np.concatenate([self.image, table[self.semantic]], axis=1)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write what :meth:`show` shows, picture and classes side by side, as a PNG.

        Args:
            path: a name that ends with ``.png``.

        Raises:
            ValueError: if it does not.
        """
        if not os.fsdecode(path).lower().endswith(".png"):
            raise arguments.refuse("path", os.fsdecode(path), "a name that ends with .png")
        data = png(self.show())
        with open(path, "wb") as file:
            file.write(data)

    def _repr_png_(self) -> bytes | None:
        return png(self.show()) if self.cameras else None

    def _repr_html_(self) -> str:
        import base64

        rows = [f"frame {self.index} of sequence {self.sequence}, {self.time_s:.2f} s"]
        rows += [f"{c.name}: {c.width_px} x {c.height_px} pixels" for c in self.cameras.values()]
        rows += [f"{name}: {len(one.points):,} points" for name, one in self.lidars.items()]
        picture = ""
        if self.cameras:
            data = base64.b64encode(png(self.show())).decode()
            picture = f'<img alt="picture and classes" src="data:image/png;base64,{data}"/>'
        return f"<div>{picture}<p>{'<br/>'.join(html.escape(row) for row in rows)}</p></div>"

    def __repr__(self) -> str:
        sensors = ", ".join([*self.cameras, *self.lidars])
        return f"Frame(sequence={self.sequence}, index={self.index}, sensors: {sensors})"

    def __iter__(self) -> Iterator[Any]:
        raise TypeError("a frame is not a sequence: see its cameras and lidars")


def png(image: Array) -> bytes:
    """An (H, W, 3) uint8 image as PNG."""
    height, width, _ = image.shape
    lines = np.zeros((height, 1 + 3 * width), np.uint8)
    lines[:, 1:] = image.reshape(height, 3 * width)

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines.tobytes(), 6))
    return b"\x89PNG\r\n\x1a\n" + body + chunk(b"IEND", b"")
