"""The progress of the commands."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Callable, Iterator, Protocol, Union

from . import _arguments as arguments


@dataclass(frozen=True)
class Progress:
    """What is known after a frame is done, or a note."""

    done: int
    """How many frames are done: on disk, checked, counted, or converted."""
    total: int
    """How many there will be."""
    sequence: int
    """The sequence of the last frame."""
    frame: int
    """The last frame."""
    note: str | None = None
    """Something that the user should know; the other fields are as before."""


Listen = Union[Callable[[Progress], object], bool, None]
"""A function that is called after each frame; True prints a bar, by tqdm if it is installed."""


class Listener(Protocol):
    """What the compiled part tells of its progress."""

    def note(self, message: str) -> None: ...
    def frame(self, done: int, total: int, sequence: int, frame: int) -> None: ...
    def close(self) -> None: ...


class _Callback:
    """Hands progress to a function."""

    def __init__(self, function: Callable[[Progress], object]) -> None:
        self._function = function
        self._last = Progress(0, 0, 0, 0)

    def note(self, message: str) -> None:
        last = self._last
        self._function(Progress(last.done, last.total, last.sequence, last.frame, message))

    def frame(self, done: int, total: int, sequence: int, frame: int) -> None:
        self._last = Progress(done, total, sequence, frame)
        self._function(self._last)

    def close(self) -> None:
        pass


class _Bar:
    """A bar by tqdm."""

    def __init__(self) -> None:
        self._bar: Any = None

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()

    def note(self, message: str) -> None:
        from tqdm import tqdm  # type: ignore[import-untyped,unused-ignore]

        tqdm.write(message)

    def frame(self, done: int, total: int, sequence: int, frame: int) -> None:
        if self._bar is None:
            from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]

            self._bar = tqdm(total=total, unit="frame")
        self._bar.update(done - self._bar.n)


@contextmanager
def listening(progress: Listen) -> Iterator[Listener | None]:
    """Who is told about the progress of a call, if anybody is."""
    listener = _listener(progress)
    try:
        yield listener
    finally:
        if listener is not None:
            listener.close()


def _listener(progress: Listen) -> Listener | None:
    if progress is None or progress is False:
        return None
    if progress is True:
        try:
            import tqdm  # type: ignore[import-untyped,unused-ignore] # noqa: F401
        except ImportError:
            return _Callback(_print)
        return _Bar()
    if callable(progress):
        return _Callback(progress)
    raise arguments.refuse("progress", progress, "a function of a Progress, True, False or None")


def _print(progress: Progress) -> None:
    print(progress.note or f"frame {progress.done} of {progress.total}", flush=True)
