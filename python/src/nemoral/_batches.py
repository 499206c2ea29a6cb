"""Items of PyTorch's data sets, and batches of them."""

from __future__ import annotations

from typing import Any, Callable, Iterable, Iterator, Mapping, Sequence, SupportsIndex

import torch
from torch.utils.data import default_collate

from . import _arguments as arguments
from ._frame import Frame


def tensors(frame: Frame) -> dict[str, Any]:
    """A frame's arrays as tensors, by name: what :meth:`nemoral.Frame.to_dict` has. Unsigned
    instance ids become int64, which every operation of torch takes."""
    found: dict[str, Any] = {}
    for name, value in frame.to_dict().items():
        if name == "instance":
            value = value.astype("int64")
        found[name] = torch.from_numpy(value) if hasattr(value, "dtype") else value
    return found


_OF_POINTS = ("xyz", "intensity", "point_semantic", "point_instance")
"""What :func:`tensors` has of each point."""


def collate(items: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """A batch of items of :func:`tensors`: the ``collate_fn`` of a loader with a ``batch_size``.

    Scans differ in their numbers of points. So those of all items stand one after the other:
    ``xyz`` (N, 3), ``intensity``, ``point_semantic`` and ``point_instance`` (N,); and
    ``point_batch`` (N,) int64 is the place in the batch of the item that each point is of. All else
    is stacked: (B, ...).

    Raises:
        ConfigError: if these are no such items, or their pictures differ in size.
    """
    if not items or not all(isinstance(item, Mapping) for item in items):
        kinds = sorted({type(item).__name__ for item in items})
        allowed = "dicts as tensors() makes them; other items need a collate_fn of their own"
        raise arguments.refuse("items", kinds, allowed)
    names = list(items[0])
    for i, item in enumerate(items):
        if set(item) != set(names):
            allowed = f"a dict of {', '.join(map(str, names))}, as the first item is"
            raise arguments.refuse(f"items[{i}]", list(item), allowed)
    found: dict[str, Any] = {}
    counts: list[int] | None = None
    for name in names:
        values = [item[name] for item in items]
        if name in _OF_POINTS:
            lengths = [len(value) for value in values]
            if counts is not None and lengths != counts:
                allowed = f"of as many points as the other columns: {counts}"
                raise arguments.refuse(name, lengths, allowed)
            counts = lengths
            found[name] = torch.cat([torch.as_tensor(value) for value in values])
            continue
        shapes = {tuple(value.shape) for value in values if hasattr(value, "shape")}
        if len(shapes) > 1:
            raise arguments.refuse(name, sorted(shapes), "of one shape in all items of a batch")
        found[name] = default_collate(values)
    if counts is not None:
        places = torch.arange(len(counts))
        found["point_batch"] = torch.repeat_interleave(places, torch.tensor(counts))
    return found


def batched(
    loader: Iterable[Any],
    size: SupportsIndex,
    *,
    collate_fn: Callable[[list[Any]], Any] = collate,
    drop_last: bool = False,
) -> Iterator[Any]:
    """Batches of the items of a loader that has no batches (``batch_size=None``), in their order.

    Each batch that a loader of :meth:`Frames.stream` makes itself is one worker's: neighbouring
    frames of one world, which show the same trees. Single items come from the workers in turns, so
    that of W workers a batch of these has frames of W worlds.

    Args:
        loader: what gives the items.
        size: how many items a batch has; the last one may have fewer.
        collate_fn: makes a batch of a list of items.
        drop_last: whether a last batch that has fewer is left out.
    """
    count = arguments.whole("size", size, 1, 2**31 - 1)
    if not callable(collate_fn):
        raise arguments.refuse("collate_fn", collate_fn, "a function of a list of items")
    return _gathered(loader, count, collate_fn, arguments.flag("drop_last", drop_last))


def _gathered(
    loader: Iterable[Any], size: int, collate_fn: Callable[[list[Any]], Any], drop_last: bool
) -> Iterator[Any]:
    items: list[Any] = []
    for item in loader:
        items.append(item)
        if len(items) == size:
            batch, items = collate_fn(items), []
            yield batch
    if items and not drop_last:
        yield collate_fn(items)
