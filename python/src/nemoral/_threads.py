"""How many threads compute."""

from __future__ import annotations

from typing import SupportsIndex

from . import _arguments as arguments
from . import _native


def set_threads(threads: SupportsIndex) -> None:
    """Compute with this number of threads from now on, 1 to 1024, in this process. Results do not
    depend on it."""
    _native.set_threads(arguments.whole("threads", threads, 1, 1024))


def threads() -> int:
    """How many threads this process computes with: as many as there are cores by default."""
    return _native.threads()
