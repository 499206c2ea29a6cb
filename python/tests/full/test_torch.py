"""Frames as PyTorch's data sets: each comes once, whatever the workers, and as it is written."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SMALL

import nemoral

torch = pytest.importorskip("torch", reason="torch is not installed")
from torch.utils.data import DataLoader  # noqa: E402

from nemoral.torch import FrameDataset, Frames  # noqa: E402


@pytest.fixture(scope="module")
def frames(cache: Path) -> Frames:
    small = {**SMALL, "camera.enabled": False, "lidar.pulses": 300}
    del small["frames"]
    return Frames(
        "demo", 7, worlds=5, frames_per_world=3, cache=cache, transform=marked, **small
    )


def marked(frame: nemoral.Frame) -> tuple[int, int, bytes]:
    """Where a frame is from, and its bytes."""
    assert frame.index is not None
    return frame.sequence, frame.index, frame.points.array.tobytes()


def first(items: list[Any]) -> Any:
    return items[0]


def test_each_frame_comes_once(frames: Frames) -> None:
    expected = {(i // 3, i % 3): frames[i][2] for i in range(len(frames))}
    assert len(expected) == 15
    for workers, method in [(0, None), (1, "fork"), (4, "fork"), (2, "forkserver"), (2, "spawn")]:
        for ranks in (1, 2):
            found = []
            for rank in range(ranks):
                stream = frames.stream(rank=rank, world_size=ranks)
                loader = DataLoader(
                    stream, batch_size=None, num_workers=workers, multiprocessing_context=method,
                    timeout=120 if workers else 0,
                )
                found += list(loader)
            assert len(found) == 15, (workers, method, ranks)
            assert {(w, k): data for w, k, data in found} == expected


def test_items_are_those_of_the_data_set(frames: Frames, cache: Path, tmp_path: Path) -> None:
    small = {**SMALL, "camera.enabled": False, "lidar.pulses": 300}
    del small["frames"]
    nemoral.generate(
        "demo", 7, out=tmp_path / "out", cache=cache, frames=3, sequences=5, **small
    )
    written = FrameDataset(tmp_path / "out", transform=marked)
    assert len(written) == 15
    assert [written[i] for i in range(15)] == [frames[i] for i in range(15)]


def test_a_stream_is_resumed(frames: Frames) -> None:
    stream = frames.stream()
    whole = [item[:2] for item in stream]
    assert whole == [(w, k) for w in range(5) for k in range(3)]
    stream, found = frames.stream(), []
    for item in stream:
        found.append(item[:2])
        if len(found) == 7:
            state = stream.state_dict()
            break
    again = pickle.loads(pickle.dumps(frames)).stream()
    again.load_state_dict(state)
    assert found + [item[:2] for item in again] == whole


def test_tensors(cache: Path, written: Path) -> None:
    item = Frames("demo", 7, frames_per_world=2, cache=cache,
                  **{k: v for k, v in SMALL.items() if k != "frames"})[1]
    stored = FrameDataset(written)[1]
    assert torch.equal(item["image"], stored["image"])
    assert torch.equal(item["xyz"], stored["xyz"]) and item["instance"].dtype == torch.int64
    with pytest.raises(nemoral.ConfigError, match="split"):
        FrameDataset(written, split="all")
    with pytest.raises(nemoral.ConfigError, match="worlds"):
        Frames("demo", worlds=0)


def test_an_epoch_trains(frames: Frames, cache: Path) -> None:
    def points(frame: nemoral.Frame) -> tuple[Any, Any]:
        chosen = np.arange(64) % len(frame.points)
        return (
            torch.from_numpy(frame.points.xyz[chosen]),
            torch.from_numpy(frame.points.semantic[chosen].astype(np.int64)),
        )

    small = {**SMALL, "camera.enabled": False}
    del small["frames"]
    data = Frames("demo", worlds=2, frames_per_world=4, cache=cache, transform=points, **small)
    model = torch.nn.Sequential(torch.nn.Linear(3, 16), torch.nn.ReLU(), torch.nn.Linear(16, 8))
    optimiser = torch.optim.Adam(model.parameters())
    for xyz, label in DataLoader(data.stream(), batch_size=4):
        loss = torch.nn.functional.cross_entropy(model(xyz).flatten(0, 1), label.flatten())
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    assert torch.isfinite(loss)
