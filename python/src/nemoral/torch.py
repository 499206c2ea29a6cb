"""Forests and data sets as PyTorch's data sets. Needs torch, which is not imported before."""

from __future__ import annotations

import os
import threading
from typing import Any, Callable, Iterator, SupportsIndex

import torch
from torch.utils.data import Dataset as TorchDataset
from torch.utils.data import IterableDataset, get_worker_info

from . import _arguments as arguments
from . import _native
from ._dataset import Dataset
from ._forest import Forest
from ._frame import Frame

Transform = Callable[[Frame], Any]


def tensors(frame: Frame) -> dict[str, Any]:
    """A frame's arrays as tensors, by name: what :meth:`nemoral.Frame.to_dict` has. Unsigned
    instance ids become int64, which every operation of torch takes."""
    found: dict[str, Any] = {}
    for name, value in frame.to_dict().items():
        if name == "instance":
            value = value.astype("int64")
        found[name] = torch.from_numpy(value) if hasattr(value, "dtype") else value
    return found


def _shard(rank: int | None, world_size: int | None) -> tuple[int, int]:
    """The number of this worker among all workers of all ranks."""
    if rank is None or world_size is None:
        distributed = torch.distributed
        if distributed.is_available() and distributed.is_initialized():
            rank, world_size = distributed.get_rank(), distributed.get_world_size()
        else:
            rank = int(os.environ.get("RANK", 0))
            world_size = int(os.environ.get("WORLD_SIZE", 1))
    info = get_worker_info()
    if info is None:
        return rank, world_size
    return rank * info.num_workers + info.id, world_size * info.num_workers


def _take_turns() -> None:
    """Shares the processor's cores among the workers of this process's loader, once."""
    global _shared
    info = get_worker_info()
    if info is None or _shared == os.getpid():
        return
    _native.set_threads(max(1, (os.cpu_count() or 1) // info.num_workers))
    _shared = os.getpid()


_shared = 0


class Frames(TorchDataset[Any]):
    """Frames of a forest, made while they are trained on: map-style.

    Item i is frame ``i % frames_per_world`` of world ``i // frames_per_world``: the i-th frame of
    the data set that the same config writes with ``sequences = worlds`` and
    ``frames = frames_per_world``, whose `[vary]` draws each world. Growing a world takes seconds,
    so use :meth:`stream`, which keeps worlds together, or a sampler that does.

    It can be given to workers by fork, forkserver and spawn. Each process has threads of its own:
    with W workers, the W-th part of the cores each.

    Args:
        config, seed, backend, cache, overrides: as :class:`nemoral.Forest` takes them.
        worlds: how many worlds; the config's ``sequences`` if None.
        frames_per_world: how many frames each has.
        transform: makes an item of a :class:`nemoral.Frame`; :func:`tensors` if None.
    """

    def __init__(
        self,
        config: arguments.Config = None,
        seed: SupportsIndex | None = None,
        *,
        worlds: SupportsIndex | None = None,
        frames_per_world: SupportsIndex = 32,
        transform: Transform | None = None,
        **options: Any,
    ) -> None:
        if transform is not None and not callable(transform):
            raise arguments.refuse("transform", transform, "a function of a frame")
        made = dict(options)
        count = arguments.whole("frames_per_world", frames_per_world, 1, 10_000_000)
        made["frames"] = count
        if worlds is not None:
            made["sequences"] = arguments.whole("worlds", worlds, 1, 10_000)
        self.forest: Forest = Forest(config, seed, **made)
        self.frames_per_world: int = count
        self.transform: Transform = transform or tensors

    @property
    def worlds(self) -> int:
        """How many worlds there are."""
        return self.forest.sequences

    def __len__(self) -> int:
        return len(self.forest)

    def __getitem__(self, i: SupportsIndex) -> Any:
        _take_turns()
        return self.transform(self.forest[i])

    def stream(
        self,
        *,
        start: SupportsIndex = 0,
        rank: int | None = None,
        world_size: int | None = None,
    ) -> FrameStream:
        """The same items as an iterable data set, world by world.

        Args:
            start: how many of its items each worker skips: what :meth:`FrameStream.state_dict`
                counted.
            rank, world_size: of this process; those of ``torch.distributed``, or of the
                environment's RANK and WORLD_SIZE, if None.
        """
        return FrameStream(self, start, rank, world_size)


class FrameStream(IterableDataset[Any]):
    """Items of :class:`Frames`, world by world: worker w of n takes worlds w, w + n, ...

    Over all ranks and workers each item comes once. While a world's frames are taken, the next one
    grows in the background.
    """

    def __init__(
        self,
        frames: Frames,
        start: SupportsIndex = 0,
        rank: int | None = None,
        world_size: int | None = None,
    ) -> None:
        if (rank is None) != (world_size is None):
            raise arguments.refuse("rank, world_size", (rank, world_size), "both given, or neither")
        if rank is not None and world_size is not None:
            size = arguments.whole("world_size", world_size, 1, 2**31)
            arguments.whole("rank", rank, 0, size - 1)
        self.frames: Frames = frames
        self.start: int = arguments.whole("start", start, 0, 2**62)
        self.rank = rank
        self.world_size = world_size
        self._done = 0

    def __iter__(self) -> Iterator[Any]:
        _take_turns()
        first, step = _shard(self.rank, self.world_size)
        mine = range(first, self.frames.worlds, step)
        per_world = self.frames.frames_per_world
        forest = self.frames.forest
        self._done = self.start
        skipped, frame = divmod(self.start, per_world)
        for at in range(skipped, len(mine)):
            ahead = None
            if at + 1 < len(mine):
                ahead = threading.Thread(target=_grow, args=(forest, mine[at + 1]), daemon=True)
            while frame < per_world:
                item = self.frames.transform(forest.frame(frame, sequence=mine[at]))
                if ahead is not None and ahead.ident is None:
                    ahead.start()
                frame += 1
                self._done += 1
                yield item
            frame = 0
            if ahead is not None and ahead.ident is not None:
                ahead.join()

    def state_dict(self) -> dict[str, int]:
        """How many of its items this worker has given."""
        return {"start": self._done}

    def load_state_dict(self, state: dict[str, int]) -> None:
        """Go on where :meth:`state_dict` was called."""
        self.start = arguments.whole("start", state["start"], 0, 2**62)


def _grow(forest: Forest, world: int) -> None:
    """Grows the world that comes next. An error occurs again when its first frame is made."""
    try:
        forest.prepare(sequence=world)
    except Exception:  # noqa: BLE001
        pass


class FrameDataset(TorchDataset[Any]):
    """Frames of a data set on disk: map-style.

    Args:
        path: the data set.
        split: only frames of sequences for ``"train"``, ``"val"`` or ``"test"``; all if None.
        transform: makes an item of a :class:`nemoral.Frame`; :func:`tensors` if None.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        split: str | None = None,
        transform: Transform | None = None,
    ) -> None:
        if split not in (None, "train", "val", "test"):
            raise arguments.refuse("split", split, '"train", "val", "test" or None')
        if transform is not None and not callable(transform):
            raise arguments.refuse("transform", transform, "a function of a frame")
        self.dataset: Dataset = Dataset(path)
        splits = {number: found.split for number, found in self.dataset.sequences.items()}
        frames = enumerate(self.dataset.frames)
        self._items = [i for i, (number, _) in frames if split in (None, splits[number])]
        self.transform: Transform = transform or tensors

    def __len__(self) -> int:
        return len(self._items)

    def __getitem__(self, i: SupportsIndex) -> Any:
        _take_turns()
        return self.transform(self.dataset[self._items[i.__index__()]])


__all__ = ["FrameDataset", "FrameStream", "Frames", "tensors"]
