"""Rays at a user's own meshes."""

from __future__ import annotations

from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _arguments as arguments
from . import _native
from ._errors import ConfigError
from ._frame import Array


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

    def __reduce__(self) -> tuple[Any, ...]:
        return (_scene, (self._native.meshes(), self._native.instances()))

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
            alpha: (R, C), where the mesh is opaque: bool, floats from 0 to 1 that are opaque above
                0.5, or uint8 that are opaque above 127. Row 0 is at v = 0, and the nearest texel
                decides.
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
            mask = _mask(alpha)
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


def _scene(meshes: list[dict[str, Any]], placed: dict[str, Array]) -> RayScene:
    """A scene of the arguments of its meshes, and of the columns of its instances."""
    scene = RayScene()
    for mesh in meshes:
        scene.add_mesh(mesh.pop("vertices"), mesh.pop("triangles"), place=False, **mesh)
    of_mesh, matrices, numbers = placed["mesh"], placed["transforms"], placed["instances"]
    changes = (np.flatnonzero(np.diff(of_mesh)) + 1).tolist()
    for first, end in zip([0, *changes], [*changes, len(of_mesh)]):
        if first < end:
            part = slice(first, end)
            scene.add_instances(of_mesh[first], matrices[part], instances=numbers[part])
    return scene
