"""The guide's blocks with other packages run, too."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import python_blocks, run_blocks

pytest.importorskip("torch", reason="torch is not installed")
pytest.importorskip("pandas", reason="pandas is not installed")
pytest.importorskip("rerun", reason="rerun is not installed")


def test_all_blocks_of_the_guide(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = python_blocks("docs/guide/python.md")
    streams = [b for b in blocks if "frames.stream()" in b]
    assert len(streams) == 1 and any("pandas" in b for b in blocks)
    # Two worlds of two frames instead of 200 of 32.
    small = streams[0].replace("worlds=200, frames_per_world=32", "worlds=2, frames_per_world=2")
    assert small != streams[0]
    blocks[blocks.index(streams[0])] = small
    found = run_blocks(blocks, cache, tmp_path, monkeypatch)
    assert found["item"]["image"].shape == (64, 96, 3)
    # Which writes what is still in its queue.
    found["rerun"].disconnect()
    assert (tmp_path / "forest.rrd").stat().st_size > 10_000
