"""Rays at a user's own meshes."""

from __future__ import annotations

from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _arguments as arguments
from . import _native
from ._errors import ConfigError
from ._frame import Array

_ORIGIN_M = 1e8
"""The greatest coordinate of a scene's origin, metres."""

_FARTHEST_M = 16_384.0
"""How far from a scene's origin what is given may be, metres: single precision, in which rays are
cast, has steps of a millimetre up to there."""


class RayScene:
    """Meshes and their instances, for casting rays: as Open3D's ``RaycastingScene``, and with alpha
    masks and instances.

    Rays are cast in single precision, which at a northing of 5,000 km has steps of half a metre.
    Georeferenced meshes therefore need an ``origin`` among them: all vertices, transforms, rays and
    poses are given in their own coordinates, and it is subtracted from them in double precision.
    Without one, coordinates that are farther than 16,384 m from 0 are refused, unless they are
    float32 already.

    Args:
        origin: (3,), a place among what is cast at, metres, at most 1e8 along each axis.

    >>> scene = RayScene()
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]])
    0
    >>> scene.cast([[0.5, 0.25, 2, 0, 0, -1]])["t_hit"].tolist()
    [2.0]
    """

    INVALID_ID = 2**32 - 1
    """The ids of a ray that hits nothing."""

    def __init__(self, origin: npt.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        self._origin_m = arguments.array("origin", origin, np.float64, (3,)).copy()
        if not (np.abs(self._origin_m) <= _ORIGIN_M).all():
            allowed = f"finite numbers, at most {_ORIGIN_M:.0f} m"
            raise arguments.refuse("origin", self._origin_m.tolist(), allowed)
        # Meshes whose vertices are kept less the origin.
        self._moved: set[int] = set()
        self._native = _native.RayScene()

    def __reduce__(self) -> tuple[Any, ...]:
        about = (self._origin_m.tolist(), sorted(self._moved))
        return (_scene, (self._native.meshes(), self._native.instances(), *about))

    def __repr__(self) -> str:
        meshes, instances = self._native.counts()
        return f"RayScene({meshes} meshes, {instances} instances)"

    @property
    def origin(self) -> Array:
        """(3,) float64: the place that is subtracted from all coordinates, metres."""
        return self._origin_m.copy()

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
            alpha: (R, C), where the mesh is opaque: bool, floats from 0 to 1 that are opaque above
                0.5, or uint8 that are opaque above 127. Row 0 is at v = 0, and the nearest texel
                decides.
            semantic: a number that hits carry, 0 to 2**32 - 1.
            instance: the same, of the one place.
            reflectance: 0 to 1, for scanners.
            place: whether the mesh is placed once, where its vertices are; if False,
                :meth:`add_instances` places it, and vertices are in the mesh's own frame, from
                which no origin is subtracted.

        Raises:
            ConfigError: if an argument is wrong, or vertices are too far from the origin.
        """
        is_placed = arguments.flag("place", place)
        if is_placed:
            points = _near("vertices", vertices, 3, self._origin_m)
        else:
            points = _near("vertices", vertices, 3, np.zeros(3), "move them there")
        corners = arguments.array("triangles", triangles, np.uint32, (None, 3))
        texture = None if uv is None else arguments.array("uv", uv, np.float32, (None, 2))
        mask = None
        if alpha is not None:
            if texture is None:
                raise ConfigError("uv = None: must be given with alpha", "uv", "None")
            mask = _mask(alpha)
        label = arguments.whole("semantic", semantic, 0, self.INVALID_ID)
        number = arguments.whole("instance", instance, 0, self.INVALID_ID)
        reflects = arguments.real("reflectance", reflectance, 0.0, 1.0)
        mesh = self._native.add_mesh(points, corners, texture, mask, label, reflects)
        if is_placed:
            if self._origin_m.any():
                self._moved.add(mesh)
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
        is_coarse = _is_coarse(matrices)
        matrices = arguments.array("transforms", matrices, np.float64, (None, 4, 4))
        numbers = np.arange(len(matrices)) if instances is None else instances
        numbers = arguments.array("instances", numbers, np.uint32, (len(matrices),))
        number = arguments.whole("mesh", mesh, 0, self.INVALID_ID)
        if self._origin_m.any():
            matrices = matrices.copy()
            turns, places = matrices[:, :3, :3], matrices[:, :3, 3]
            # The vertices as they were given are those that are kept, and the origin.
            kept_from_m = self._origin_m if number in self._moved else np.zeros(3)
            with np.errstate(invalid="ignore", over="ignore"):
                places += turns @ kept_from_m - self._origin_m
        if not is_coarse:
            _check_near("transforms", matrices[:, :3, 3], self._origin_m)
        self._native.add_instances(number, matrices, numbers.tolist())

    def cast(
        self, rays: npt.ArrayLike, *, tnear: float = 0.0, tfar: float = np.inf
    ) -> dict[str, Array]:
        """The nearest hit of each ray.

        Args:
            rays: (..., 6), origin and direction; distances are in lengths of the direction,
                which are 1e-30 to 3.4e38. Origins that are not float32 are at most 16,384 m from
                the scene's along each axis.
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

    def _rays(
        self, rays: npt.ArrayLike, tnear: float, tfar: float
    ) -> tuple[Array, tuple[int, ...], float, float]:
        found = np.asarray(rays)
        if found.ndim == 0 or found.shape[-1] != 6:
            raise arguments.refuse("rays", found.shape, "numbers of the shape ...x6")
        shape = found.shape[:-1]
        flat = _near("rays", found.reshape(-1, 6), 6, self._origin_m)
        near = arguments.real("tnear", tnear, 0.0, np.inf)
        far = arguments.real("tfar", tfar, 0.0, np.inf)
        return flat, shape, near, far

    def _pose(self, pose: npt.ArrayLike | None) -> list[float]:
        """The 16 numbers of a pose in the scene, less the origin; at the origin if None."""
        if pose is None:
            found = np.eye(4)
        else:
            found = arguments.array("pose", pose, np.float64, (4, 4)).copy()
            found[:3, 3] -= self._origin_m
            if not _is_coarse(np.asarray(pose)):
                _check_near("pose", found[np.newaxis, :3, 3], self._origin_m)
        numbers: list[float] = found.ravel().tolist()
        return numbers


def _is_coarse(given: Array) -> bool:
    """Whether numbers are in single precision or less already."""
    return bool(given.dtype.kind == "f" and given.dtype.itemsize < 8)


_HINT = "give RayScene(origin=...) a place near"
"""What to do about places that are too far away."""


def _near(
    key: str, value: npt.ArrayLike, columns: int, origin_m: Array, hint: str = _HINT
) -> Array:
    """Rows that begin with a place, less an origin, in single precision."""
    if getattr(value, "dtype", None) == np.float32 and not origin_m.any():
        return arguments.array(key, value, np.float32, (None, columns))
    exact = arguments.array(key, value, np.float64, (None, columns))
    if origin_m.any():
        exact = exact.copy()
        exact[:, :3] -= origin_m
    if not _is_coarse(np.asarray(value)):
        _check_near(key, exact[:, :3], origin_m, hint)
    with np.errstate(over="ignore"):
        return exact.astype(np.float32)


def _check_near(key: str, places_m: Array, origin_m: Array, hint: str = _HINT) -> None:
    """Refuse places, given less the origin, that single precision would round by more than a
    millimetre."""
    if not places_m.size or (places_m.max() <= _FARTHEST_M and places_m.min() >= -_FARTHEST_M):
        return
    far = (np.abs(places_m) > _FARTHEST_M).any(axis=1)
    # Not a number is no place, and is refused by what computes.
    if not far.any():
        return
    first = int(far.argmax())
    allowed = (
        f"within {_FARTHEST_M:g} m of the origin {origin_m.tolist()} along each axis, as rays are"
        f" cast in single precision; {hint}"
    )
    name = key if key == "pose" else f"{key}[{first}]"
    raise arguments.refuse(name, (places_m[first] + origin_m).tolist(), allowed)


def _mask(alpha: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Where an image is opaque."""
    allowed = "an image of bool, of floats from 0 to 1, or of uint8"
    try:
        found = np.asarray(alpha)
    except (TypeError, ValueError):
        raise arguments.refuse("alpha", alpha, allowed) from None
    if found.ndim != 2:
        raise arguments.refuse("alpha", found.shape, f"{allowed}: rows and columns")
    if found.dtype == np.bool_:
        return found
    if found.dtype == np.uint8:
        return found > 127
    if found.dtype.kind != "f":
        # Nothing says what is opaque in wider numbers, or in a list of 0 and 1.
        raise arguments.refuse("alpha", found.dtype, allowed)
    # Not a number is not within.
    if not ((found >= 0) & (found <= 1)).all():
        raise arguments.refuse("alpha", f"{found.min()} to {found.max()}", allowed)
    return found > 0.5


def _scene(
    meshes: list[dict[str, Any]],
    placed: dict[str, Array],
    origin_m: list[float],
    moved: list[int],
) -> RayScene:
    """A scene of the arguments of its meshes, and of the columns of its instances; from both the
    origin is subtracted already."""
    scene = RayScene()
    for mesh in meshes:
        scene.add_mesh(mesh.pop("vertices"), mesh.pop("triangles"), place=False, **mesh)
    of_mesh, matrices, numbers = placed["mesh"], placed["transforms"], placed["instances"]
    changes = (np.flatnonzero(np.diff(of_mesh)) + 1).tolist()
    for first, end in zip([0, *changes], [*changes, len(of_mesh)]):
        if first < end:
            part = slice(first, end)
            scene.add_instances(of_mesh[first], matrices[part], instances=numbers[part])
    scene._origin_m, scene._moved = np.array(origin_m), set(moved)
    return scene
