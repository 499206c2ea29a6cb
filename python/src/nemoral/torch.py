"""Forests and data sets as PyTorch's data sets. Needs torch, which is not imported before."""

from __future__ import annotations

import operator
import os
import threading
import weakref
from typing import Any, Callable, Iterator, Mapping, Sequence, SupportsIndex

import numpy as np

try:
    import torch
except ModuleNotFoundError as error:
    if error.name != "torch":
        raise
    raise ModuleNotFoundError(
        "nemoral.torch needs PyTorch, which is not installed: pip install torch", name="torch"
    ) from None
from torch.utils.data import Dataset as TorchDataset
from torch.utils.data import IterableDataset, get_worker_info

from . import _arguments as arguments
from . import _threads
from ._batches import batched, collate, tensors
from ._dataset import Dataset
from ._errors import Error
from ._forest import KEYWORDS, Forest
from ._frame import Frame

Transform = Callable[[Frame], Any]


def _variable(name: str, default: int, low: int, high: int) -> int:
    """A whole number of the environment within limits."""
    text = os.environ.get(name, str(default))
    try:
        found = int(text)
    except ValueError:
        found = low - 1
    if low <= found <= high:
        return found
    allowed = f"a whole number from {low} to {high} (an environment variable)"
    raise arguments.refuse(name, text, allowed)


def _is_distributed() -> bool:
    return bool(torch.distributed.is_available() and torch.distributed.is_initialized())


def _place_of_process() -> tuple[int, int]:
    """This process's rank, and how many ranks there are."""
    if _is_distributed():
        return torch.distributed.get_rank(), torch.distributed.get_world_size()
    found = {name: os.environ.get(name) for name in ("RANK", "WORLD_SIZE")}
    if (found["RANK"] is None) != (found["WORLD_SIZE"] is None):
        raise arguments.refuse("RANK, WORLD_SIZE", found, "both in the environment, or neither")
    world_size = _variable("WORLD_SIZE", 1, 1, 2**31)
    return _variable("RANK", 0, 0, world_size - 1), world_size


def _place_of_worker() -> tuple[int, int]:
    """The number of this worker of a loader, and how many there are; 0 of 0 outside of one."""
    info = get_worker_info()
    return (0, 0) if info is None else (info.id, info.num_workers)


def _given(count: int, lengths: list[int], batch_size: int) -> list[int]:
    """How many of the first `count` items of a loader each worker gave, if the workers have so many
    items: they take turns by the batch, and who has no more drops out."""
    given = [0] * len(lengths)
    while count > 0:
        active = [j for j, length in enumerate(lengths) if given[j] < length]
        if not active:
            break
        # All rounds at once in which nobody drops out.
        rounds = min((lengths[j] - given[j]) // batch_size for j in active)
        rounds = min(rounds, count // (batch_size * len(active)))
        for j in active:
            several = max(rounds, 1) * batch_size
            taken = min(several, lengths[j] - given[j], count)
            given[j] += taken
            count -= taken
    return given


def _share_cores() -> None:
    """Shares the cores among the workers of the loaders of all trainers of this machine, once in
    each worker."""
    global _sharing_process
    info = get_worker_info()
    if info is None or _sharing_process == os.getpid():
        return
    _threads.share(info.num_workers, _variable("LOCAL_WORLD_SIZE", 1, 1, 2**31 - 1))
    _sharing_process = os.getpid()


_sharing_process = 0


class Frames(TorchDataset[Any]):
    """Frames of a forest, made while they are trained on: map-style.

    Item i is frame ``i % frames_per_world`` of world ``i // frames_per_world``: the i-th frame of
    the data set that the same config writes with ``sequences = worlds`` and
    ``frames = frames_per_world``, whose `[vary]` draws each world. Growing a world takes seconds,
    so use :meth:`stream`, which keeps worlds together, or a sampler that does.

    Items that a loader's workers give must be picklable, as frames are: else the loader waits for
    ever, and the error is seen on the worker's standard error alone.

    It can be given to workers by fork, forkserver and spawn. Each process has threads of its own:
    with W workers, the W-th part of the cores each; with T trainers on this machine (torchrun's
    LOCAL_WORLD_SIZE), the T-th part of that. A worker that calls :func:`nemoral.set_threads`
    (``worker_init_fn``) keeps its number.

    Args:
        config, seed, backend, cache, overrides: as :class:`nemoral.Forest` takes them.
        worlds: how many worlds; the config's ``sequences`` if None.
        frames_per_world: how many frames each has, whatever the config's ``frames`` is.
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
        if "frames" in made:
            allowed = "given as frames_per_world, as each world has so many"
            raise arguments.refuse("frames", made["frames"], allowed, "frames_per_world")
        if "sequences" in made and worlds is not None:
            raise arguments.refuse("sequences", made["sequences"], "left out, as worlds is given")
        others = {name: value for name, value in made.items() if name not in KEYWORDS}
        known = (*KEYWORDS, "worlds", "frames_per_world", "transform")
        arguments.check_names(others, known)
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
        _share_cores()
        return self.transform(self.forest[i])

    def stream(
        self,
        *,
        start: SupportsIndex = 0,
        batch_size: SupportsIndex | None = None,
        shuffle: bool = False,
        drop_uneven: bool = False,
        rank: SupportsIndex | None = None,
        world_size: SupportsIndex | None = None,
    ) -> FrameStream:
        """The same items as an iterable data set, world by world.

        Args:
            start: how many items its first pass leaves out (that which is begun first, be it for a
                single item), to go on where training was stopped:
                those that a loader of this rank with the same number of workers gave before, in
                the same epoch.
            batch_size: that of the loader, for `start` if it has several workers, which take turns
                by the batch. Not for a loader with ``drop_last``.
            shuffle: whether worlds come in another order in each epoch, drawn by the forest's seed
                and :meth:`FrameStream.set_epoch`. Frames of a world stay in order.
            drop_uneven: whether worlds that are left over, if their number is no multiple of
                `world_size`, are left out, so that every rank has as many items, and as many
                batches: DistributedDataParallel waits for ever otherwise. With `shuffle`, others
                are left out in each epoch.
            rank, world_size: of this process; those of ``torch.distributed``, or of the
                environment's RANK and WORLD_SIZE, if None. Hugging Face's Accelerate and Trainer
                share out the items of a loader themselves: ``rank=0, world_size=1`` for them, as
                each rank would get a part of its part otherwise.

        Raises:
            ConfigError: if an argument is wrong, or there are more ranks than worlds.
        """
        return FrameStream(
            self,
            start=start,
            batch_size=batch_size,
            shuffle=shuffle,
            drop_uneven=drop_uneven,
            rank=rank,
            world_size=world_size,
        )


_WORKERS_MAX = 1024
"""The most workers of a loader."""

# What a stream's memory has that it shares with the workers of a loader: the epoch; by how many
# workers its first pass is iterated, and the last one, plus 1 (0 for no pass yet); and of each
# worker whether it has begun the first pass.
_EPOCH, _FIRST_BY, _LAST_BY, _BEGUN = range(4)


class FrameStream(IterableDataset[Any]):
    """Items of :class:`Frames`, world by world: what :meth:`Frames.stream` makes.

    Rank r of R takes worlds r, r + R, ... of the epoch's order, and of these its loader's worker w
    of n takes each n-th. Over all ranks and workers each item comes once. While a world's frames
    are taken, the first frame of the next one is made in the background, for which it grows.

    Its length is the number of items of this rank's next pass, over all workers.

    A launcher may give one stream to several trainers (``mp.spawn``, fork): each has a first pass
    and an epoch of its own.
    """

    def __init__(
        self,
        frames: Frames,
        *,
        start: SupportsIndex = 0,
        batch_size: SupportsIndex | None = None,
        shuffle: bool = False,
        drop_uneven: bool = False,
        rank: SupportsIndex | None = None,
        world_size: SupportsIndex | None = None,
    ) -> None:
        self.frames: Frames = frames
        self.start: int = arguments.whole("start", start, 0, 2**62)
        if batch_size is None:
            batch_size = 1
        self.batch_size: int = arguments.whole("batch_size", batch_size, 1, 2**31)
        self.shuffle: bool = arguments.flag("shuffle", shuffle)
        self.drop_uneven: bool = arguments.flag("drop_uneven", drop_uneven)
        self._ranks: tuple[int, int] | None = None
        if rank is not None and world_size is not None:
            size = arguments.whole("world_size", world_size, 1, 2**31)
            self._ranks = arguments.whole("rank", rank, 0, size - 1), size
        elif rank is not None or world_size is not None:
            raise arguments.refuse("rank, world_size", (rank, world_size), "both given, or neither")
        # It orders worlds in each epoch.
        self._seed: int = frames.forest.seed if self.shuffle else 0
        # By how many workers `start` was counted; None: by as many as there will be.
        self._counted_by: int | None = None
        # How many of its own items this worker leaves out in its next pass.
        self._own_start: int | None = None
        # How many of its own items this worker, or this process without workers, has given.
        self._done = 0
        # Where it is iterated.
        self._process: int | None = None
        # Workers that live on, and those that are made for another pass, see what is written here.
        self._shared = torch.zeros(_BEGUN + _WORKERS_MAX, dtype=torch.int64).share_memory_()
        # The process whose memory this is, and that of its workers.
        self._owner = os.getpid()
        _streams.add(self)
        # What is wrong is said here, and not in a worker.
        len(self)

    def _own(self) -> None:
        """Takes memory of its own in a process that has got this stream from another one and is no
        loader's worker: other trainers may have got it, too."""
        if self._owner == os.getpid() or get_worker_info() is not None:
            return
        self._shared = self._shared.clone().share_memory_()
        self._shared[_FIRST_BY:] = 0
        self._owner = os.getpid()

    def __getstate__(self) -> dict[str, Any]:
        self._own()
        # A worker that is not forked knows nothing of torch.distributed. Where nothing is known
        # yet, a trainer may be started, which will ask itself.
        ranks = self._ranks
        if ranks is None and (_is_distributed() or "RANK" in os.environ):
            ranks = _place_of_process()
        return {**vars(self), "_ranks": ranks}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        # A loader's worker has got the same memory; other copies have their own.
        self._shared.share_memory_()
        _streams.add(self)

    @property
    def rank(self) -> int:
        """The rank whose items these are."""
        return self._place()[0]

    @property
    def world_size(self) -> int:
        """How many ranks there are."""
        return self._place()[1]

    @property
    def epoch(self) -> int:
        """What :meth:`set_epoch` was given last; 0 before."""
        return int(self._shared[_EPOCH])

    def _place(self) -> tuple[int, int]:
        return self._ranks or _place_of_process()

    def _worlds(self) -> list[int]:
        """The worlds of this rank in this epoch."""
        rank, world_size = self._place()
        count = self.frames.worlds
        if count < world_size:
            raise arguments.refuse("worlds", count, f"at least {world_size}, one for each rank")
        order: Sequence[int] = range(count)
        if self.shuffle:
            draw = np.random.default_rng([self._seed, self.epoch])
            order = draw.permutation(count).tolist()
        if self.drop_uneven:
            order = order[: count - count % world_size]
        return list(order[rank::world_size])

    def _start(self, count: int) -> int:
        """How many of this rank's items the next pass leaves out."""
        worker, workers = _place_of_worker()
        first_by = int(self._shared[_FIRST_BY])
        is_first = first_by == 0
        if workers:
            # Other workers of the same pass may have begun before.
            is_first |= first_by == workers + 1 and not self._shared[_BEGUN + worker]
        return arguments.whole("start", self.start, 0, count) if is_first else 0

    def __len__(self) -> int:
        self._own()
        count = len(self._worlds()) * self.frames.frames_per_world
        return count - self._start(count)

    def __iter__(self) -> Iterator[Any]:
        self._own()
        _share_cores()
        worker, workers = _place_of_worker()
        per_world = self.frames.frames_per_world
        worlds = self._worlds()
        start = self._start(len(worlds) * per_world)
        own_start, self._own_start = self._own_start, None
        if not self._shared[_FIRST_BY]:
            self._shared[_FIRST_BY] = workers + 1
        self._shared[_LAST_BY] = workers + 1
        self._shared[_BEGUN + worker] = 1
        self._process = os.getpid()
        mine = slice(worker, None, max(1, workers))
        if own_start is not None:
            skipped = [own_start - at * per_world for at in range(len(worlds[mine]))]
        else:
            by = max(1, workers if self._counted_by is None else self._counted_by)
            lengths = [per_world * len(worlds[j::by]) for j in range(by)]
            given = _given(start, lengths, self.batch_size)
            skipped = [given[at % by] - at // by * per_world for at in range(len(worlds))][mine]
        skipped = [min(max(count, 0), per_world) for count in skipped]
        self._done = sum(skipped)
        left = [(world, k) for world, k in zip(worlds[mine], skipped) if k < per_world]
        return self._items(left)

    def _items(self, left: list[tuple[int, int]]) -> Iterator[Any]:
        """The items of worlds, each from a frame on."""
        coming: _Coming | None = None
        for at, (world, first) in enumerate(left):
            for k in range(first, self.frames.frames_per_world):
                frame = None
                if k == first and coming is not None:
                    frame = coming.take()
                if frame is None:
                    frame = self.frames.forest.frame(k, sequence=world)
                if k == first and at + 1 < len(left):
                    coming = _Coming(self.frames.forest, *left[at + 1])
                item = self.frames.transform(frame)
                # It may be large, and is not needed while the item is used.
                del frame
                self._done += 1
                yield item
                del item
        # The next pass begins at the beginning.
        self._done = 0

    def set_epoch(self, epoch: SupportsIndex) -> None:
        """Which epoch the next pass is, for the order of worlds. Workers that live on
        (``persistent_workers``) see it, too."""
        self._own()
        self._shared[_EPOCH] = arguments.whole("epoch", epoch, 0, 2**62)

    def state_dict(self) -> dict[str, int]:
        """What :meth:`load_state_dict` needs to go on from here: the epoch, and how many items were
        given where the stream is iterated.

        That is here without workers. In a loader's worker it is what this worker has given, which
        torchdata's ``StatefulDataLoader`` asks for. The process of another loader with workers does
        not know how far they are: count the items that it gets, and make a stream by ``start``.

        Raises:
            nemoral.Error: in the process of a loader with workers.
        """
        self._own()
        worker, workers = _place_of_worker()
        if self._own_start is not None:
            done = self._own_start
        elif self._shared[_LAST_BY] > 1 and not workers:
            raise Error(
                "state_dict: this stream is iterated by the workers of a loader; count the items "
                "that the loader gives, and go on by stream(start=...)"
            )
        else:
            done = self._done if self._process == os.getpid() else self.start
        return {"epoch": self.epoch, "start": done, "worker": worker, "workers": workers}

    def load_state_dict(self, state: Mapping[str, int]) -> None:
        """Go on in the next pass where :meth:`state_dict` was called. The passes after it are
        whole.

        Raises:
            ConfigError: if it is no such state, or that of another worker.
        """
        self._own()
        try:
            asked = ("epoch", "start", "worker", "workers")
            epoch, start, *place = (operator.index(state[name]) for name in asked)
            valid = 0 <= epoch <= 2**62 and 0 <= start <= 2**62
        except (KeyError, TypeError, IndexError):
            valid, epoch, start, place = False, 0, 0, []
        if not valid:
            raise arguments.refuse("state", state, "what state_dict() of a stream gave")
        worker, workers = _place_of_worker()
        if place != [worker, workers]:
            here = f"of worker {worker} of {workers}" if workers else "of a stream without workers"
            raise arguments.refuse("state", state, here)
        self._shared[_EPOCH] = epoch
        if workers:
            self._own_start = start
        else:
            self.start, self._counted_by, self._process = start, 1, None
            self._shared[_FIRST_BY:] = 0


_streams: weakref.WeakSet[FrameStream] = weakref.WeakSet()
"""The streams of this process."""


def _own_all() -> None:
    for stream in list(_streams):
        stream._own()


if hasattr(os, "register_at_fork"):
    # Workers that a trainer forks need its memory, not its launcher's, and it need not have asked
    # its stream for anything before.
    os.register_at_fork(before=_own_all)


class _Coming:
    """A frame of the next world, which is made in the background."""

    def __init__(self, forest: Forest, world: int, k: int) -> None:
        self._frame: Frame | None = None
        self._thread = threading.Thread(target=self._make, args=(forest, world, k), daemon=True)
        self._thread.start()

    def _make(self, forest: Forest, world: int, k: int) -> None:
        try:
            self._frame = forest.frame(k, sequence=world)
        except Exception:  # noqa: BLE001
            # It occurs again where the frame is needed, and is raised there.
            pass

    def take(self) -> Frame | None:
        """The frame when it is done; None if it could not be made."""
        self._thread.join()
        return self._frame


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
        _share_cores()
        return self.transform(self.dataset[self._items[arguments.item(i, len(self))]])


__all__ = ["FrameDataset", "FrameStream", "Frames", "batched", "collate", "tensors"]
