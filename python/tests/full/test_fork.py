"""Forks while threads of the parent are at work."""

from __future__ import annotations

import multiprocessing
import os
import threading
from pathlib import Path

import pytest
from conftest import SMALL

import nemoral


def _child(forest: nemoral.Forest, out: "multiprocessing.Queue[bytes]") -> None:
    out.put(forest.frame(1).image.tobytes())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_fork_while_threads_are_at_work(cache: Path) -> None:
    forest = nemoral.Forest("demo", cache=cache, **SMALL)
    expected = forest.frame(1).image.tobytes()
    busy = threading.Thread(target=lambda: [forest.frame(k % 2) for k in range(400)])
    busy.start()
    context = multiprocessing.get_context("fork")
    for _ in range(8):
        queue: "multiprocessing.Queue[bytes]" = context.Queue()
        process = context.Process(target=_child, args=(forest, queue))
        process.start()
        assert queue.get(timeout=120) == expected
        process.join(timeout=60)
    busy.join()
