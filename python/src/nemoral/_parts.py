"""Parts that are useful alone: rays, scanners, terrain, Poisson disks, trees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _arguments as arguments
from . import _native
from ._errors import ConfigError
from ._frame import Array

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


class RayScene:
    """Meshes and their instances, for casting rays: as Open3D's ``RaycastingScene``, and with alpha
    masks and instances.

    >>> scene = RayScene()
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]])
    0
    >>> scene.cast([[0.5, 0.25, 2, 0, 0, -1]])["t_hit"].tolist()
    [2.0]
    """

    INVALID_ID = 2**32 - 1
    """The ids of a ray that hits nothing."""

    def __init__(self) -> None:
        self._native = _native.RayScene()

    def __repr__(self) -> str:
        meshes, instances = self._native.counts()
        return f"RayScene({meshes} meshes, {instances} instances)"

    @property
    def memory_bytes(self) -> int:
        """The memory that the scene takes, bytes."""
        return self._native.memory_bytes()

    def add_mesh(
        self,
        vertices: npt.ArrayLike,
        triangles: npt.ArrayLike,
        *,
        uv: npt.ArrayLike | None = None,
        alpha: npt.ArrayLike | None = None,
        semantic: SupportsIndex = 0,
        instance: SupportsIndex = 0,
        reflectance: float = 0.5,
        place: bool = True,
    ) -> int:
        """Add a mesh and return its number.

        Args:
            vertices: (V, 3), metres.
            triangles: (T, 3), numbers of vertices, counter-clockwise seen from outside. Both sides
                are hit.
            uv: (V, 2), texture coordinates, 0 to 1; needed with ``alpha``.
            alpha: (R, C) bool, or numbers that are opaque above half of 1 (floats) or 255 (bytes):
                where the mesh is opaque. Row 0 is at v = 0, and the nearest texel decides.
            semantic: a number that hits carry, 0 to 2**32 - 1.
            instance: the same, of the one place at the origin.
            reflectance: 0 to 1, for scanners.
            place: whether the mesh is placed once at the origin; if False,
                :meth:`add_instances` places it.
        """
        points = arguments.array("vertices", vertices, np.float32, (None, 3))
        corners = arguments.array("triangles", triangles, np.uint32, (None, 3))
        texture = None if uv is None else arguments.array("uv", uv, np.float32, (None, 2))
        mask = None
        if alpha is not None:
            if texture is None:
                raise ConfigError("uv = None: must be given with alpha", "uv", "None")
            mask = np.asarray(alpha)
            if mask.ndim != 2 or mask.dtype.kind not in "bfu":
                raise arguments.refuse("alpha", mask.shape, "an image of bool, float or uint8")
            if mask.dtype.kind != "b":
                mask = mask > (0.5 if mask.dtype.kind == "f" else 127)
        label = arguments.whole("semantic", semantic, 0, self.INVALID_ID)
        number = arguments.whole("instance", instance, 0, self.INVALID_ID)
        reflects = arguments.real("reflectance", reflectance, 0.0, 1.0)
        is_placed = arguments.flag("place", place)
        mesh = self._native.add_mesh(points, corners, texture, mask, label, reflects)
        if is_placed:
            self._native.add_instances(mesh, np.eye(4)[np.newaxis], [number])
        return mesh

    def add_instances(
        self,
        mesh: SupportsIndex,
        transforms: npt.ArrayLike,
        *,
        instances: npt.ArrayLike | None = None,
    ) -> None:
        """Place a mesh many times; its triangles are stored once.

        Args:
            mesh: the number that :meth:`add_mesh` gave.
            transforms: (N, 4, 4), scene from mesh: any invertible map.
            instances: (N,), numbers that hits carry; 0, 1, ... if None.
        """
        matrices = np.asarray(transforms)
        if matrices.ndim == 2:
            matrices = matrices[np.newaxis]
        matrices = arguments.array("transforms", matrices, np.float64, (None, 4, 4))
        numbers = np.arange(len(matrices)) if instances is None else instances
        numbers = arguments.array("instances", numbers, np.uint32, (len(matrices),))
        number = arguments.whole("mesh", mesh, 0, self.INVALID_ID)
        self._native.add_instances(number, matrices, numbers.tolist())

    def cast(
        self, rays: npt.ArrayLike, *, tnear: float = 0.0, tfar: float = np.inf
    ) -> dict[str, Array]:
        """The nearest hit of each ray.

        Args:
            rays: (..., 6), origin and direction; distances are in lengths of the direction,
                which are 1e-30 to 3.4e38.
            tnear, tfar: hits count from the one to the other.

        Returns:
            ``t_hit`` (...) float32, infinite where nothing is hit; ``geometry_ids``,
            ``primitive_ids`` and ``instance_ids`` (...) uint32, INVALID_ID where nothing is hit;
            ``primitive_uvs`` (..., 2) float32, the weights of the second and third corner;
            ``primitive_normals`` (..., 3) float32, unit, by the order of corners; ``semantic``
            (...) uint32.
        """
        flat, shape, near, far = self._rays(rays, tnear, tfar)
        found = self._native.cast(flat, near, far)
        return {name: v.reshape(shape + v.shape[1:]) for name, v in found.items()}

    def occluded(
        self, rays: npt.ArrayLike, *, tnear: float = 0.0, tfar: float = np.inf
    ) -> Array:
        """(...) bool: whether each of (..., 6) rays hits anything from tnear to tfar."""
        flat, shape, near, far = self._rays(rays, tnear, tfar)
        return self._native.occluded(flat, near, far).reshape(shape)

    cast_rays = cast
    test_occlusions = occluded

    @staticmethod
    def _rays(
        rays: npt.ArrayLike, tnear: float, tfar: float
    ) -> tuple[Array, tuple[int, ...], float, float]:
        found = np.asarray(rays)
        if found.ndim == 0 or found.shape[-1] != 6:
            raise arguments.refuse("rays", found.shape, "numbers of the shape ...x6")
        shape = found.shape[:-1]
        flat = arguments.array("rays", found.reshape(-1, 6), np.float32, (None, 6))
        near = arguments.real("tnear", tnear, 0.0, np.inf)
        far = arguments.real("tfar", tfar, 0.0, np.inf)
        return flat, shape, near, far


class Scanner:
    """A LiDAR by its data sheet, for scans of a :class:`RayScene`.

    Args:
        device: such as ``"avia"``; :meth:`devices` lists all.
        noise: ``"data_sheet"``, or ``"off"`` for exact ranges.
        pulses: pulses of a scan; those of 0.1 s if None.
        rings: rings of sub-rays of a pulse's beam, 0 to 8: 2 are 19 sub-rays, 0 a single ray.
        max_range_m: the greatest range, metres; the device's if None.
    """

    def __init__(
        self,
        device: str,
        *,
        noise: str = "data_sheet",
        pulses: SupportsIndex | None = None,
        rings: SupportsIndex | None = None,
        max_range_m: float | None = None,
    ) -> None:
        self._native = _native.Scanner(
            arguments.text("device", device),
            arguments.text("noise", noise),
            None if pulses is None else arguments.whole("pulses", pulses, 1, 2**31 - 1),
            None if rings is None else arguments.whole("rings", rings, 0, 255),
            None if max_range_m is None else arguments.real("max_range_m", max_range_m, 0.0, 1e6),
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
    ) -> Array:
        """(N,) structured: the returns of one scan, in the order of firing, in the LiDAR's frame
        (x forward, y left, z up), metres, seconds.

        Args:
            scene: what is scanned.
            pose: (4, 4), scene from LiDAR; the scene's own frame if None.
            time_s: the time of the scan, which decides where the pattern is.
            seed, index: by which noise is drawn: equal numbers give equal scans.
        """
        if not isinstance(scene, RayScene):
            raise arguments.refuse("scene", scene, "a RayScene")
        place = np.eye(4) if pose is None else arguments.array("pose", pose, np.float64, (4, 4))
        packed = self._native.scan(
            scene._native,
            place.ravel().tolist(),
            arguments.real("time_s", time_s, 0.0, 1e9),
            arguments.whole("seed", seed, 0, _SEED),
            arguments.whole("index", index, 0, _SEED),
        )
        return packed.view(SCAN_DTYPE)


class Terrain:
    """An endless terrain: octaves of gradient noise, with exact slopes.

    Args:
        octaves: layers, 1 to 16.
        scale_m: wavelength of the first layer, 1 to 100,000 m.
        lacunarity: frequency of each layer over the one before, above 1, at most 16.
        persistence: amplitude of each layer over the one before, 0 to 1.
        max_height_m: heights are from 0 to this, 0 to 10,000 m.
        seed: 0 to 2**63 - 1.
    """

    def __init__(
        self,
        *,
        octaves: SupportsIndex = 5,
        scale_m: float = 120.0,
        lacunarity: float = 2.0,
        persistence: float = 0.35,
        max_height_m: float = 12.0,
        seed: SupportsIndex = 7,
    ) -> None:
        self._native = _native.Terrain(
            arguments.whole("octaves", octaves, 0, 2**31),
            arguments.real("scale_m", scale_m),
            arguments.real("lacunarity", lacunarity),
            arguments.real("persistence", persistence),
            arguments.real("max_height_m", max_height_m),
            arguments.whole("seed", seed, 0, _SEED),
        )

    def sample(self, x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Array, Array]:
        """Height (S) and gradient (S, 2), float64, at places of any shape S, metres."""
        try:
            xs, ys = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        except (TypeError, ValueError):
            raise arguments.refuse("x, y", (x, y), "numbers of equal shapes") from None
        rows = self._native.sample(np.stack([xs.ravel(), ys.ravel()], axis=1))
        return rows[:, 0].reshape(xs.shape), rows[:, 1:].reshape((*xs.shape, 2))

    def height_m(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """Heights (S), float64, at places of any shape S, metres."""
        return self.sample(x, y)[0]


def poisson_disks(
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    radius_m: float | tuple[float, float] = 1.0,
    *,
    rounds: SupportsIndex = 3,
    seed: SupportsIndex = 7,
) -> tuple[Array, Array]:
    """Disks that do not overlap, of an endless plane, whose centres are in a rectangle.

    The plane is one for a seed: neighbouring rectangles fit.

    Args:
        low, high: (2,), corners of the rectangle, metres.
        radius_m: the radius, or the least and the greatest one, metres.
        rounds: how often the active list is processed, 1 to 8: more are denser.
        seed: 0 to 2**63 - 1.

    Returns:
        Centres (N, 2) and radii (N,), float64.
    """
    first = arguments.array("low", low, np.float64, (2,)).tolist()
    last = arguments.array("high", high, np.float64, (2,)).tolist()
    given: npt.ArrayLike = [radius_m] if np.ndim(radius_m) == 0 else radius_m
    limits = arguments.array("radius_m", given, np.float64, (None,))
    if len(limits) not in (1, 2) or not 1e-3 <= limits[0] <= limits[-1] <= 2e4:
        raise arguments.refuse("radius_m", radius_m, "0.001 to 20000 m, or two such numbers")
    rows = _native.poisson_disks(
        first,
        last,
        (float(limits[0]), float(limits[-1])),
        arguments.whole("rounds", rounds, 1, 8),
        arguments.whole("seed", seed, 0, _SEED),
    )
    return np.ascontiguousarray(rows[:, :2]), np.ascontiguousarray(rows[:, 2])


@dataclass(frozen=True)
class Tree:
    """A tree; its foot is at the origin, z up, metres."""

    vertices: Array
    """(V, 3) float32: of the wood."""
    normals: Array
    """(V, 3) float32."""
    triangles: Array
    """(T, 3) uint32."""
    parts: Array
    """(T,) uint8: an index into :attr:`PARTS`."""
    leaf_corners: Array
    """(L, 4, 3) float32: the corners of cards, each of which stands for a leafy twig."""
    size: dict[str, float]
    """``dbh_m``, ``height_m``, ``crown_base_m``, ``crown_radius_m``, ``leaf_area_m2``,
    ``lean_rad``, ``stem_volume_m3``, ``foot_radius_m``, measured on what was grown."""

    structure: dict[str, Array]
    """The wood as a graph of N nodes, a true quantitative structure model. Between a node and its
    parent, the wood is a truncated cone: ``position_m`` (N, 3) and ``radius_m`` float64; ``parent``
    int64, the node that is next on the way to the foot, -1 at the foot; ``axis`` uint32, the same
    from the base of a stem, branch or twig to its tip; ``order`` uint8, 0 for the stem, 1 for its
    branches; ``is_dead`` bool."""

    PARTS = ("stem", "flare", "limb", "branch", "dead")

    def mesh(self) -> tuple[Array, Array]:
        """Vertices (N, 3) float32 and triangles (M, 3) uint32 of wood and leaf cards together, as
        trimesh and Open3D take them."""
        cards = len(self.leaf_corners)
        first = len(self.vertices) + 4 * np.arange(cards, dtype=np.uint32)[:, None, None]
        quads = first + np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
        vertices = np.concatenate([self.vertices, self.leaf_corners.reshape(-1, 3)])
        triangles = np.concatenate([self.triangles, quads.reshape(-1, 3).astype(np.uint32)])
        return vertices, triangles


def grow_tree(
    species: str,
    *,
    dbh_m: float = 0.3,
    seed: SupportsIndex = 7,
    wood_triangles_max: SupportsIndex = 12_000,
    cards_max: SupportsIndex = 6_000,
) -> Tree:
    """Grow a tree of a diameter at breast height; the rest is drawn from published allometry.

    Args:
        species: such as ``"beech"``; an unknown one is refused with the names of all.
        dbh_m: 0.02 to 1.5 m.
        seed: 0 to 2**63 - 1.
        wood_triangles_max: 3,000 to 200,000.
        cards_max: 50 to 100,000.
    """
    found = _native.grow_tree(
        arguments.text("species", species),
        arguments.real("dbh_m", dbh_m),
        arguments.whole("seed", seed, 0, _SEED),
        arguments.whole("wood_triangles_max", wood_triangles_max, 0, 2**31),
        arguments.whole("cards_max", cards_max, 0, 2**31),
    )
    return Tree(**{**found, "leaf_corners": found["leaf_corners"].reshape(-1, 4, 3)})
