"""How many threads compute."""

from __future__ import annotations

import os
from typing import SupportsIndex

from . import _arguments as arguments
from . import _native

_told_in = 0
"""The process in which a number of threads was given last; 0 if none was. A forked process knows
that of its parent."""


def set_threads(threads: SupportsIndex) -> None:
    """Compute with this number of threads from now on, 1 to 1024, in this process. Results do not
    depend on it."""
    global _told_in
    _native.set_threads(arguments.whole("threads", threads, 1, 1024))
    _told_in = os.getpid()


def threads() -> int:
    """How many threads this process computes with: as many as there are cores by default."""
    return _native.threads()


def share(workers: int, trainers: int) -> None:
    """Compute with this worker's share of the cores, of so many workers of each of so many trainers
    on this machine, unless a number of threads was given in this process. One that was given in the
    trainer, which has forked this worker, is the trainer's share."""
    if _told_in == os.getpid():
        return
    shares = workers if _told_in else workers * trainers
    _native.set_threads(max(1, _native.threads() // shares))
