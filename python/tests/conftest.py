"""What tests share: a small forest, and a data set that the command wrote of it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nemoral
from nemoral import _arguments as arguments

SMALL: dict[str, Any] = {
    "frames": 2,
    "camera.width_px": 96,
    "camera.height_px": 64,
    "lidar.pulses": 2000,
    "chunks.visible_radius_m": 30.0,
    "chunks.undergrowth_radius_m": 15.0,
    "chunks.delete_radius_m": 100.0,
    "assets.individuals": 1,
}
"""Keys that make any preset quick."""


ROOT = Path(__file__).parents[2]
PAGES = ["README.md", "python/README.md", "docs/guide/python.md"]
"""Pages with Python, in the repository."""


def python_blocks(page: str) -> list[str]:
    """The blocks of Python of a page, in their order."""
    return re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(), re.M | re.S)


def run_blocks(
    blocks: list[str], cache: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> dict[str, Any]:
    """Run blocks one after the other in a folder, with forests made small; their names."""
    layers = arguments.layers

    def small(*given: Any) -> Any:
        preset, file, settings = layers(*given)
        return preset, file, [*settings, {k: v for k, v in SMALL.items() if k != "frames"}]

    monkeypatch.setattr(arguments, "layers", small)
    monkeypatch.setenv("NEMORAL_CACHE", str(cache))
    monkeypatch.chdir(folder)
    corners = [[-50.0, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]]
    # What a page calls the reader's own.
    names: dict[str, Any] = {
        "vertices": corners,
        "triangles": [[0, 1, 2], [0, 2, 3]],
        "uv": [[0, 0], [1, 0], [1, 1], [0, 1]],
        "mask": np.ones((4, 4), bool),
        "transforms": np.eye(4)[np.newaxis],
        "rays": [[0, 0, 5, 0, 0, -1]],
        "x": np.arange(3.0),
        "y": np.zeros(3),
    }
    for block in blocks:
        exec(compile(block, "a block of Python", "exec"), names)  # noqa: S102
    return names


def command(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the package's command."""
    line = [sys.executable, "-m", "nemoral._cli", *arguments]
    return subprocess.run(line, capture_output=True, text=True, timeout=600)


def settings(config: dict[str, Any]) -> list[str]:
    """A config as arguments of the command."""
    texts = {key: str(v).lower() if isinstance(v, bool) else v for key, v in config.items()}
    return [f"--set={key}={v}" for key, v in texts.items()]


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Grown plants, shared by the tests of a session."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def forest(cache: Path) -> nemoral.Forest:
    """A small forest."""
    return nemoral.Forest("demo", seed=7, cache=cache, **SMALL)


@pytest.fixture(scope="session")
def written(cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The data set of the same forest, by the command."""
    out = tmp_path_factory.mktemp("written") / "forest"
    done = command(
        "generate", "--preset=demo", "--seed=7", *settings(SMALL), f"--cache={cache}",
        "--backend=cpu", "--quiet", f"--out={out}",
    )
    assert done.returncode == 0, done.stderr
    return out


def read_png(path: Path) -> np.ndarray[Any, Any]:
    """A PNG of 8 or 16 bits a channel, by Python alone: (H, W) or (H, W, 3)."""
    import struct
    import zlib

    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed, header = 8, b"", b""
    while at < len(data):
        (length,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            header = body
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    assert depth in (8, 16) and interlaced == 0
    channels = {0: 1, 2: 3, 3: 1}[colour]
    step = channels * depth // 8
    raw = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * step)
    rows = np.zeros((height + 1, width * step + step), np.int32)
    for y in range(height):
        kind, line, above = raw[y, 0], raw[y, 1:].astype(np.int32), rows[y]
        row = rows[y + 1]
        for x in range(step, width * step + step):
            left, up, corner = row[x - step], above[x], above[x - step]
            if kind == 0:
                guess = 0
            elif kind == 1:
                guess = left
            elif kind == 2:
                guess = up
            elif kind == 3:
                guess = (left + up) // 2
            else:
                p = left + up - corner
                a, b, c = abs(p - left), abs(p - up), abs(p - corner)
                guess = left if a <= b and a <= c else up if b <= c else corner
            row[x] = (line[x - step] + guess) & 0xFF
    pixels = rows[1:, step:].astype(np.uint8)
    if depth == 16:
        pixels = pixels.view(">u2").astype(np.uint16)
    return pixels.reshape(height, width) if channels == 1 else pixels.reshape(height, width, 3)
