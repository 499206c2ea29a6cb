"""Memory stays flat, and forks, threads and processes do not disturb each other."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SMALL

import nemoral


def resident_mb() -> float:
    """This process's resident memory."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads Linux's /proc")
def test_memory_is_flat_over_frames(forest: nemoral.Forest) -> None:
    def some(count: int) -> None:
        for i in range(count):
            frame = forest.frame(i % 2)
            assert len(frame.points.xyz) and frame.image.any() and frame.normal.any()

    some(20)
    before = resident_mb()
    some(60)
    assert resident_mb() - before < 30


def tasks() -> int:
    """How many threads this process has."""
    return len(os.listdir("/proc/self/task"))


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="reads Linux's /proc")
def test_worlds_grow_by_the_threads_of_now(cache: Path) -> None:
    before = nemoral.threads()
    try:
        nemoral.set_threads(8)
        forest = nemoral.Forest("demo", 7, cache=cache, **{**SMALL, "sequences": 2})
        forest.frame(0)
        nemoral.set_threads(1)
        # Threads that are no longer needed end.
        time.sleep(0.5)
        base, peak, is_done = tasks(), 0, threading.Event()

        def watch() -> None:
            nonlocal peak
            while not is_done.is_set():
                peak = max(peak, tasks())
                time.sleep(0.001)

        watcher = threading.Thread(target=watch)
        watcher.start()
        forest.frame(0, sequence=1)
        is_done.set()
        watcher.join()
        # The watcher and the one that computes, and not eight that grow.
        assert base < peak < base + 5
    finally:
        nemoral.set_threads(before)


def test_reading_a_config_drops_no_grown_world(cache: Path) -> None:
    forest = nemoral.Forest("demo", 7, cache=cache, **{**SMALL, "sequences": 4})
    for world in (1, 2):
        forest.pose(0, sequence=world)
    assert forest._native.grown == [1, 2]
    assert "seed 7" in repr(forest) and forest.drawn(3) == {}
    seeds = {forest.config(world)["seed"] for world in range(4)}
    assert len(seeds) == 4 and forest.seed in seeds
    assert forest._native.grown == [1, 2]
    # A world that is grown has the same config.
    before = forest.config(3)
    forest.pose(0, sequence=3)
    assert forest._native.grown == [2, 3] and forest.config(3) == before


def test_frames_of_several_threads_are_equal(forest: nemoral.Forest) -> None:
    expected = [forest.frame(k).points.array.tobytes() for k in (0, 1)]
    found: dict[int, bytes] = {}

    def take(i: int) -> None:
        found[i] = forest.frame(i % 2).points.array.tobytes()

    threads = [threading.Thread(target=take, args=(i,)) for i in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=120)
    assert [found[i] for i in range(6)] == expected * 3


def _child(forest: nemoral.Forest, out: "multiprocessing.Queue[bytes]") -> None:
    out.put(forest.frame(1).image.tobytes())


@pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])
def test_processes_of_every_kind(method: str, forest: nemoral.Forest) -> None:
    expected = forest.frame(1).image.tobytes()
    context = multiprocessing.get_context(method)
    queue: "multiprocessing.Queue[bytes]" = context.Queue()
    process = context.Process(target=_child, args=(forest, queue))
    process.start()
    assert queue.get(timeout=120) == expected
    process.join(timeout=60)
    assert process.exitcode == 0


def test_threads_do_not_change_results(forest: nemoral.Forest) -> None:
    expected = forest.frame(0).image
    before = nemoral.threads()
    try:
        for count in (1, 3):
            nemoral.set_threads(count)
            assert nemoral.threads() == count
            assert np.array_equal(forest.frame(0).image, expected)
    finally:
        nemoral.set_threads(before)
