"""The commands of the program as functions."""

from __future__ import annotations

import json
import operator
import os
from dataclasses import dataclass
from typing import Any, Iterable, Sequence, SupportsIndex, Union

from . import _arguments as arguments
from . import _native
from ._forest import KEYWORDS
from ._progress import Listen, listening

Path = Union[str, "os.PathLike[str]"]


def generate(
    config: arguments.Config = None,
    seed: SupportsIndex | None = None,
    *,
    out: Path = "nemoral-out",
    frames: SupportsIndex | range | Iterable[SupportsIndex] | None = None,
    shard: tuple[SupportsIndex, SupportsIndex] | None = None,
    mode: str = "fresh",
    backend: str = "cpu",
    cache: bool | Path | None = True,
    progress: Listen = None,
    **overrides: Any,
) -> int:
    """Write a data set, as the command ``nemoral generate`` does, and return its number of frames.

    Ctrl-C finishes the frame in hand and leaves a folder that ``mode="resume"`` continues.

    Args:
        config, seed, backend, cache, overrides: as :class:`nemoral.Forest` takes them.
        out: the output folder.
        frames: a number (each sequence is so long), or the frames of each sequence to make.
        shard: (index, count): the index-th of count equal parts of the frames; :func:`merge` joins
            them.
        mode: ``"fresh"`` refuses a folder that is not empty, ``"resume"`` continues a data set,
            ``"overwrite"`` replaces it.
        progress: is called with a :class:`nemoral.Progress` on this thread after each frame; an
            exception that it raises stops the run. True prints a bar, by tqdm if it is installed.
    """
    chosen: list[tuple[int, int]] | None = None
    if frames is not None:
        try:
            # Arrays have this, too, and refuse.
            one = operator.index(frames)  # type: ignore[arg-type]
        except TypeError:
            chosen = _ranges(frames)
        else:
            overrides = {**overrides, "frames": arguments.whole("frames", one, 1, 10_000_000)}
    part = None
    if shard is not None:
        try:
            index, count = shard
        except (TypeError, ValueError):
            raise arguments.refuse("shard", shard, "(index, count)") from None
        of = arguments.whole("shard count", count, 1, 2**62)
        part = (arguments.whole("shard index", index, 0, of - 1), of)
    keywords = (*KEYWORDS, "out", "shard", "mode", "progress")
    layers = arguments.layers(config, seed, overrides, keywords)
    with listening(progress) as listener:
        return _native.generate(
            *layers,
            arguments.path("out", out),
            chosen,
            part,
            arguments.text("mode", mode),
            arguments.text("backend", backend),
            arguments.keep(cache),
            arguments.PROGRAM,
            listener,
        )


def _ranges(frames: Any) -> list[tuple[int, int]]:
    """Half-open ranges of frames."""
    if isinstance(frames, range) and frames.step == 1:
        if frames.start < 0 or not frames:
            raise arguments.refuse("frames", frames, "frames from 0 on, at least one")
        return [(frames.start, frames.stop)]
    try:
        numbers = list(frames)
    except TypeError:
        raise arguments.refuse("frames", frames, "a number, a range or numbers") from None
    if not numbers:
        raise arguments.refuse("frames", frames, "at least one frame")
    whole = [arguments.whole("frames", number, 0, 10_000_000) for number in numbers]
    return [(number, number + 1) for number in whole]


@dataclass(frozen=True)
class Check:
    """What :func:`check` found. It is true if the data set is right."""

    passed: bool
    """Whether nothing is wrong."""
    problems: list[tuple[str, str]]
    """Each problem: the file, and what is wrong with it."""
    text: str
    """The report in words."""

    def __bool__(self) -> bool:
        return self.passed

    def __str__(self) -> str:
        return self.text


def check(path: Path, *, progress: Listen = None) -> Check:
    """Check a data set from its files alone: structure, sizes, checksums, ids, poses, and the
    agreement of its sensors. ``progress`` is as in :func:`generate`."""
    with listening(progress) as listener:
        passed, text, problems = _native.check(arguments.path("path", path), listener)
    return Check(passed, problems, text)


@dataclass(frozen=True)
class Stats:
    """What a data set holds."""

    values: dict[str, Any]
    """``sequences``, ``frames``, ``bytes``, ``trees``, ``measured_trees`` (of 7 cm and more);
    ``classes`` with pixels and points of each; quantiles of ``dbh_m`` and ``tree_height_m`` of
    these trees, ``depth_m``, ``range_m``, ``overlap``; ``balance`` with the goal of each target and
    its share before and after."""
    text: str
    """The same as a table."""

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def __str__(self) -> str:
        return self.text


def stats(path: Path, *, progress: Listen = None) -> Stats:
    """Count what a data set holds. ``progress`` is as in :func:`generate`."""
    with listening(progress) as listener:
        values, text = _native.stats(arguments.path("path", path), listener)
    return Stats(json.loads(values), text)


def merge(
    parts: Sequence[Path],
    out: Path,
    *,
    partial: bool = False,
    mode: str = "fresh",
    progress: Listen = None,
) -> int:
    """Join shards into one data set at ``out`` and return its number of frames. Shards that lack
    frames are refused, unless ``partial``. ``mode`` and ``progress`` are as in :func:`generate`."""
    if isinstance(parts, (str, os.PathLike)):
        raise arguments.refuse("parts", parts, "several paths")
    try:
        paths = [arguments.path("parts", part) for part in parts]
    except TypeError:
        raise arguments.refuse("parts", parts, "several paths") from None
    whole = arguments.flag("partial", partial)
    how = arguments.text("mode", mode)
    with listening(progress) as listener:
        return _native.merge(paths, arguments.path("out", out), whole, how, listener)


def cloud(
    path: Path,
    out: Path = "cloud.ply",
    *,
    voxel_m: float | None = None,
    pure: bool = False,
    estimated_poses: bool = False,
    poses: Path | None = None,
    sequence: SupportsIndex | None = None,
    only: Iterable[str] = (),
    progress: Listen = None,
) -> int:
    """Join all scans of a sequence into one registered, labelled PLY, and return its number of
    points.

    Args:
        path: the data set.
        out: the file, which must end in `.ply`.
        voxel_m: keep one point in each cube of this side, metres.
        pure: leave out mixed returns and false alarms.
        estimated_poses: register scans by `poses_estimated.txt` instead of the true poses.
        poses: a file in the form of `poses.txt`, with a line for each frame, by which scans are
            registered instead: what your odometry or SLAM made of the data set.
        sequence: which one, if there are several.
        only: names of classes and of fine semantics (:data:`nemoral.SEMANTICS`), of which points
            are kept; all if empty.
        progress: as in :func:`generate`.
    """
    if isinstance(only, str) or not isinstance(only, Iterable):
        raise arguments.refuse("only", only, "several names")
    names = [arguments.text("only", name) for name in only]
    side = None if voxel_m is None else arguments.real("voxel_m", voxel_m, 0.0, 1e9)
    number = None if sequence is None else arguments.whole("sequence", sequence, 0, 2**32 - 1)
    is_pure = arguments.flag("pure", pure)
    is_estimated = arguments.flag("estimated_poses", estimated_poses)
    own = None if poses is None else arguments.path("poses", poses)
    if is_estimated and own is not None:
        raise arguments.refuse("poses", own, "None with estimated_poses=True")
    folder, file = arguments.path("path", path), arguments.path("out", out)
    with listening(progress) as listener:
        return _native.cloud(
            folder, file, side, is_pure, is_estimated, own, number, names, listener
        )


def convert(
    path: Path,
    out: Path,
    format: str,
    *,
    ontology: Path | None = None,
    min_px: int = 0,
    mode: str = "fresh",
    progress: Listen = None,
) -> tuple[int, int, int]:
    """Write a data set in another format, for readers that do not know ours, and return how many
    frames, files and bytes were written.

    Args:
        path: the data set.
        out: the output folder.
        format: such as ``"kitti"``; an unknown one is refused with the names of all.
        ontology: the classes to write: a built-in table's name, or a TOML file.
        min_px: objects with fewer visible pixels in a picture are left out, in ``"coco"`` and
            ``"yolo"``; other formats take 0 alone.
        mode, progress: as in :func:`generate`. Frames that ``mode="resume"`` finds written are not
            told one by one.
    """
    table = None if ontology is None else arguments.path("ontology", ontology)
    with listening(progress) as listener:
        return _native.convert(
            arguments.path("path", path),
            arguments.path("out", out),
            arguments.text("format", format),
            table,
            arguments.whole("min_px", min_px, 0, 2**32 - 1),
            arguments.text("mode", mode),
            listener,
        )


def report(path: Path, out: Path = "report.html") -> int:
    """Write one self-contained HTML page that shows a data set, and return its size in bytes."""
    return _native.report(arguments.path("path", path), arguments.path("out", out))[1]
