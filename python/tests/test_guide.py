"""The Python blocks of the guide and of the READMEs run, from the first to the last."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import PAGES, python_blocks, run_blocks

OTHERS = ("torch", "pandas")
"""Packages that only the full tests have."""


@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_of_a_page(
    page: str, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = [b for b in python_blocks(page) if not any(name in b for name in OTHERS)]
    assert blocks
    run_blocks(blocks, cache, tmp_path, monkeypatch)
