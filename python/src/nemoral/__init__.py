"""Virtual forests, recorded with labelled cameras and LiDAR.

>>> import nemoral
>>> forest = nemoral.Forest("demo", seed=7)
>>> frame = forest.frame(0)
>>> frame.image.shape, frame.points.xyz.shape[1]
((96, 160, 3), 3)

The world has x east, y north, z up; bodies x forward, y left, z up; cameras x right, y down, z
forward. Lengths are metres, times seconds, angles radians, unless a name says otherwise. Matrices
are named ``target_from_source``: ``world_from_body @ body_from_camera`` is ``world_from_camera``.
"""

from ._commands import Check, Stats, check, cloud, convert, generate, merge, report, stats
from ._dataset import Dataset
from ._errors import ConfigError, DatasetError, Error
from ._forest import Forest, presets
from ._frame import Camera, Frame, Lidar, Points
from ._native import __version__
from ._parts import Terrain, Tree, grow_tree, poisson_disks
from ._progress import Progress
from ._rays import RayScene
from ._scanner import Scan, Scanner
from ._semantics import SEMANTICS
from ._threads import set_threads, threads

__all__ = [
    "Camera",
    "Check",
    "ConfigError",
    "Dataset",
    "DatasetError",
    "Error",
    "Forest",
    "Frame",
    "Lidar",
    "Points",
    "Progress",
    "RayScene",
    "SEMANTICS",
    "Scan",
    "Scanner",
    "Stats",
    "Terrain",
    "Tree",
    "__version__",
    "check",
    "cloud",
    "convert",
    "generate",
    "grow_tree",
    "merge",
    "poisson_disks",
    "presets",
    "report",
    "set_threads",
    "stats",
    "threads",
]
