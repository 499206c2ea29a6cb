"""Parts that are useful alone: terrain, Poisson disks, trees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _arguments as arguments
from . import _native
from ._frame import Array

_SEED = 2**63 - 1


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
        self._arguments: dict[str, Any] = {
            "octaves": arguments.whole("octaves", octaves, 1, 16),
            "scale_m": arguments.real("scale_m", scale_m),
            "lacunarity": arguments.real("lacunarity", lacunarity),
            "persistence": arguments.real("persistence", persistence),
            "max_height_m": arguments.real("max_height_m", max_height_m),
            "seed": arguments.whole("seed", seed, 0, _SEED),
        }
        self._native = _native.Terrain(*self._arguments.values())

    def __reduce__(self) -> tuple[Any, ...]:
        return (_terrain, (self._arguments,))

    def __repr__(self) -> str:
        given = ", ".join(f"{name}={value}" for name, value in self._arguments.items())
        return f"Terrain({given})"

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


def _terrain(given: dict[str, Any]) -> Terrain:
    return Terrain(**given)


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


@dataclass(frozen=True, repr=False, eq=False)
class Tree:
    """A tree; its foot is at the origin, z up, metres. Trees are equal if all their arrays are."""

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
    ``lean_rad``, ``stem_volume_m3``, ``wood_volume_m3``, ``foot_radius_m``, measured on what was
    grown."""

    structure: dict[str, Array]
    """The wood as a graph of N nodes, a true quantitative structure model. Between a node and its
    parent, the wood is a truncated cone: ``position_m`` (N, 3) and ``radius_m`` float64; ``parent``
    int64, the node that is next on the way to the foot, -1 at the foot; ``axis`` uint32, the same
    from the base of a stem, branch or twig to its tip; ``order`` uint8, 0 for the stem, 1 for its
    branches; ``is_dead`` bool."""

    PARTS = ("stem", "flare", "limb", "branch", "dead")

    def __repr__(self) -> str:
        size = self.size
        return (
            f"Tree({size['dbh_m']:.2f} m dbh, {size['height_m']:.1f} m high, "
            f"{len(self.triangles)} triangles, {len(self.leaf_corners)} leaf cards)"
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Tree):
            return NotImplemented
        mine, theirs = self._parts(), other._parts()
        return self.size == other.size and all(map(np.array_equal, mine, theirs))

    def __hash__(self) -> int:
        return hash(tuple(self.size.values()))

    def _parts(self) -> list[Array]:
        arrays = [self.vertices, self.normals, self.triangles, self.parts, self.leaf_corners]
        return [*arrays, *self.structure.values()]

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
