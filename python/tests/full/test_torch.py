"""Frames as PyTorch's data sets: each comes once, whatever the workers, and as it is written."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import SMALL
from test_frames import compare, equal, everything

import nemoral

torch = pytest.importorskip("torch", reason="torch is not installed")
from torch.utils.data import DataLoader  # noqa: E402

import nemoral.torch  # noqa: E402
from nemoral.torch import (  # noqa: E402
    FrameDataset,
    Frames,
    FrameStream,
    batched,
    collate,
    tensors,
)


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


VARIED: dict[str, Any] = {
    **{key: value for key, value in SMALL.items() if key != "frames"},
    "camera": {"sky": True, "flow": True, "trunks": True, "boxes": True, "radiance": True},
    "cameras": {"right": {"mount_y_m": -0.5}},
    "lidars": {"rear": {"mount_yaw_deg": 180.0, "pulses": 500}},
    "vary": {
        "camera": {"fov": {"horizontal_deg": [50.0, 90.0]}},
        "sun": {"angles": {"elevation_deg": [20.0, 60.0]}},
        "lidar": {"device": ["avia", "mid70"]},
    },
}
"""Worlds that differ, with all truth that cameras have."""


def test_items_are_those_of_the_data_set(cache: Path, tmp_path: Path) -> None:
    made = Frames(VARIED, 7, worlds=3, frames_per_world=2, cache=cache, transform=same)
    nemoral.generate(VARIED, 7, out=tmp_path, cache=cache, frames=2, sequences=3, backend="cpu")
    drawn = [made.forest.drawn(world) for world in range(3)]
    assert len({found["camera.fov.horizontal_deg"] for found in drawn}) == 3
    written = FrameDataset(tmp_path, transform=same)
    assert len(written) == len(made) == 6
    for i, item in enumerate(made.stream()):
        stored, again = written[i], made[i]
        assert (item.sequence, item.index) == divmod(i, 2) == (stored.sequence, stored.index)
        # What the files hold, read without this package.
        compare(item, tmp_path / "sequences" / f"{item.sequence:02}")
        assert equal(everything(item), everything(again)) == []
        # Files have depth, normals, flow and boxes coarser, and poses as quaternions.
        coarser = {
            f"{camera}.{name}"
            for camera in item.cameras
            for name in ("depth_m", "normal", "flow", "boxes")
        }
        mine, theirs = everything(item), everything(stored)
        different = set(equal(mine, theirs)) - coarser
        assert different <= {key for key in mine if "world_from" in key}
        for key in different:
            np.testing.assert_allclose(mine[key], theirs[key], rtol=0, atol=1e-9)
        for camera, truth in item.cameras.items():
            other = stored.cameras[camera]
            assert np.abs(truth.depth_m - other.depth_m).max() <= 1 / 512 + 1e-6
            cosine = (truth.normal * other.normal).sum(-1)[truth.depth_m > 0]
            assert cosine.min() >= np.cos(np.deg2rad(0.4)) - 1e-6
            assert truth.flow is not None and other.flow is not None
            known, found = (np.isfinite(one.flow).all(-1) for one in (truth, other))
            # Files have no room for more than 512 pixels.
            assert (np.abs(truth.flow[known & ~found]).max(-1) > 511.9).all()
            assert not (found & ~known).any() and found.mean() > 0.3
            np.testing.assert_allclose(
                truth.flow[found], other.flow[found], atol=1 / 128 + 1e-4, rtol=0
            )
            boxes, others = truth.boxes, other.boxes
            assert boxes is not None and others is not None and len(boxes["kind"]) > 0
            for name in ("camera_from_box", "size_m"):
                found = boxes.pop(name), others.pop(name)
                np.testing.assert_allclose(*found, rtol=0, atol=6e-5)
            assert equal(boxes, others) == []


def delivered(stream: FrameStream, workers: int, batch_size: int | None = None) -> list[int]:
    """The numbers of the items in the order in which a loader gives them."""
    loader = DataLoader(
        stream, batch_size=batch_size, num_workers=workers, collate_fn=plain,
        timeout=120 if workers else 0,
    )
    return numbers(loader)


def numbers(loader: Any) -> list[int]:
    items = [item for one in loader for item in (one if isinstance(one, list) else [one])]
    return [3 * item[0] + item[1] for item in items]


def plain(items: Any) -> Any:
    return items


def test_a_stream_without_workers_is_resumed(frames: Frames) -> None:
    stream, found = frames.stream(), []
    assert stream.state_dict()["start"] == 0
    for item in stream:
        found.append(3 * item[0] + item[1])
        if len(found) == 7:
            state = stream.state_dict()
            break
    again = pickle.loads(pickle.dumps(frames)).stream()
    again.load_state_dict(state)
    assert again.state_dict() == state and len(again) == 8
    assert found + delivered(again, 0) == list(range(15))
    # The next pass is whole, and a state of it is of it.
    assert len(again) == 15 and again.state_dict()["start"] == 0
    assert delivered(again, 0) == list(range(15))
    # The same state in a loader with workers.
    again.load_state_dict(state)
    assert sorted(delivered(again, 2)) == list(range(7, 15))
    assert sorted(delivered(again, 2)) == list(range(15))


@pytest.mark.parametrize("workers, batch_size", [(1, None), (2, None), (3, 2)])
def test_a_stream_is_resumed_from_an_index(
    frames: Frames, workers: int, batch_size: int | None
) -> None:
    whole = delivered(frames.stream(), workers, batch_size)
    assert sorted(whole) == list(range(15))
    for given in (1, 6, 8, 14, 15):
        stream = frames.stream(start=given, batch_size=batch_size)
        assert len(stream) == 15 - given
        rest = delivered(stream, workers, batch_size)
        assert sorted(whole[:given] + rest) == list(range(15)), given
        assert sorted(delivered(stream, workers, batch_size)) == list(range(15))
    with pytest.raises(nemoral.Error, match="workers of a loader"):
        stream.state_dict()


def test_the_second_pass_is_whole_whoever_iterates_it(frames: Frames) -> None:
    for first, second in [(1, 2), (2, 1), (2, 3), (0, 2)]:
        stream = frames.stream(start=4)
        assert len(delivered(stream, first)) == 11
        assert len(stream) == 15
        assert sorted(delivered(stream, second)) == list(range(15)), (first, second)


def test_a_process_does_not_say_what_its_workers_know(frames: Frames) -> None:
    stream = frames.stream()
    next(iter(stream))
    assert stream.state_dict()["start"] == 1
    delivered(stream, 2)
    with pytest.raises(nemoral.Error, match="workers of a loader"):
        stream.state_dict()
    assert delivered(stream, 0) == list(range(15)) and stream.state_dict()["start"] == 0


def test_workers_share_the_threads_of_their_process(frames: Frames) -> None:
    before = nemoral.threads()
    try:
        nemoral.set_threads(5)
        shown = Frames("demo", worlds=2, frames_per_world=1, transform=threads_here)
        loader = DataLoader(shown, batch_size=None, num_workers=2, timeout=120,
                            multiprocessing_context="fork")
        assert list(loader) == [2, 2]
    finally:
        nemoral.set_threads(before)


def of_workers(written: Path, **loading: Any) -> list[int]:
    """The numbers of threads of two workers."""
    data = FrameDataset(written, transform=threads_here)
    return list(
        DataLoader(data, batch_size=None, num_workers=2, timeout=120,
                   multiprocessing_context="fork", **loading)
    )


def test_trainers_of_a_machine_share_its_cores(
    written: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = nemoral.threads()
    monkeypatch.setenv("LOCAL_WORLD_SIZE", "3")
    try:
        nemoral.set_threads(12)
        # Which is this trainer's share.
        assert of_workers(written) == [6, 6]
        # As if these were the cores.
        monkeypatch.setattr(nemoral._threads, "_told_in", 0)
        assert of_workers(written) == [2, 2]
        # A worker knows best.
        assert of_workers(written, worker_init_fn=five_threads) == [5, 5]
        monkeypatch.setenv("LOCAL_WORLD_SIZE", "none")
        with pytest.raises(nemoral.ConfigError, match="LOCAL_WORLD_SIZE"):
            of_workers(written)
    finally:
        nemoral.set_threads(before)


def five_threads(_: int) -> None:
    nemoral.set_threads(5)


def threads_here(_: nemoral.Frame) -> int:
    return nemoral.threads()


def test_workers_that_live_on(frames: Frames) -> None:
    stream = frames.stream(start=4, shuffle=True)
    loader = DataLoader(
        stream, batch_size=None, num_workers=2, persistent_workers=True, timeout=120,
        multiprocessing_context="spawn", collate_fn=plain,
    )
    orders = []
    for epoch in range(3):
        stream.set_epoch(epoch)
        assert len(loader) == (15 if epoch else 11)
        orders.append(numbers(loader))
    assert len(orders[0]) == 11 and sorted(orders[1]) == sorted(orders[2]) == list(range(15))
    assert orders[1] != orders[2]


def handed(rank: int, stream: FrameStream, workers: int, out: Any) -> None:
    """A trainer that has got its stream from a launcher: how many items two passes have."""
    os.environ.update(RANK=str(rank), WORLD_SIZE="2")
    loader = DataLoader(
        stream, batch_size=None, num_workers=workers, collate_fn=plain,
        timeout=120 if workers else 0, multiprocessing_context="fork" if workers else None,
    )
    out.put((rank, [len(numbers(loader)) for _ in range(2)]))


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.parametrize("workers", [0, 2])
def test_each_trainer_of_a_launcher_has_a_first_pass(
    frames: Frames, method: str, workers: int
) -> None:
    context = multiprocessing.get_context(method)
    stream, out = frames.stream(start=4), context.Queue()
    found = {}
    for rank in range(2):
        trainer = context.Process(target=handed, args=(rank, stream, workers, out))
        trainer.start()
        found.update([out.get(timeout=300)])
        trainer.join(60)
    assert found == {0: [5, 9], 1: [2, 6]}
    # And the launcher its own.
    assert len(stream) == 11


def test_lengths_ask_the_forest_for_no_world(
    frames: Frames, monkeypatch: pytest.MonkeyPatch
) -> None:
    stream = frames.stream(shuffle=True)
    monkeypatch.setattr(nemoral.Forest, "config", None)
    assert len(stream) == 15


def test_each_worker_is_resumed_by_its_own_state(
    frames: Frames, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As torchdata's StatefulDataLoader does it, in each worker.
    for worker in range(2):
        info = SimpleNamespace(id=worker, num_workers=2)
        monkeypatch.setattr(nemoral.torch, "get_worker_info", lambda info=info: info)
        stream = frames.stream()
        whole = numbers(stream)
        items = iter(stream)
        first = numbers([next(items) for _ in range(4)])
        state = stream.state_dict()
        again = frames.stream()
        again.load_state_dict(state)
        assert again.state_dict() == state
        assert first + numbers(again) == whole == numbers(again)
        other = {**state, "worker": 1 - worker}
        with pytest.raises(nemoral.ConfigError, match="of worker"):
            again.load_state_dict(other)


def test_worlds_come_in_another_order_in_each_epoch(frames: Frames) -> None:
    stream, again = frames.stream(shuffle=True), frames.stream(shuffle=True)
    orders = []
    for epoch in range(3):
        for one in (stream, again):
            one.set_epoch(epoch)
        orders.append(delivered(stream, 0))
        assert orders[-1] == delivered(again, 0)
        assert sorted(orders[-1]) == list(range(15))
        assert all(i + 1 == j for i, j in zip(orders[-1], orders[-1][1:]) if i % 3 < 2)
    assert len(set(map(tuple, orders))) == 3
    state = stream.state_dict()
    fresh = frames.stream(shuffle=True)
    fresh.load_state_dict(state)
    assert fresh.epoch == 2 and delivered(fresh, 0) == orders[2]


def test_lengths_are_what_loaders_give(frames: Frames) -> None:
    for workers in (0, 2):
        loader = DataLoader(frames.stream(rank=0, world_size=2), batch_size=None,
                            num_workers=workers, timeout=120 if workers else 0)
        assert len(loader) == 9 == len(list(loader))
    parts = [frames.stream(rank=rank, world_size=2, drop_uneven=True) for rank in range(2)]
    assert [len(part) for part in parts] == [6, 6]
    assert sorted(sum((delivered(part, 0) for part in parts), [])) == list(range(12))


def ranked(rank: int, folder: str, cache: str, out: Any) -> None:
    """A trainer whose rank torch.distributed alone knows."""
    torch.distributed.init_process_group(
        "gloo", init_method=f"file://{folder}/meet", rank=rank, world_size=2
    )
    small = {**SMALL, "camera.enabled": False, "lidar.pulses": 300}
    del small["frames"]
    data = Frames(
        "demo", 7, worlds=4, frames_per_world=1, cache=cache, transform=marked, **small
    )
    found = []
    for method in ("fork", "forkserver", "spawn"):
        loader = DataLoader(data.stream(), batch_size=None, num_workers=1, timeout=120,
                            multiprocessing_context=method)
        found.append([item[0] for item in loader])
    out.put((rank, found))
    torch.distributed.destroy_process_group()


def test_ranks_of_torch_distributed(cache: Path, tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    out = context.Queue()
    trainers = [
        context.Process(target=ranked, args=(rank, str(tmp_path), str(cache), out))
        for rank in range(2)
    ]
    for trainer in trainers:
        trainer.start()
    found = dict(out.get(timeout=300) for _ in trainers)
    for trainer in trainers:
        trainer.join(60)
    assert found == {0: [[0, 2]] * 3, 1: [[1, 3]] * 3}


def test_ranks_of_the_environment(frames: Frames, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("RANK", "WORLD_SIZE"):
        with monkeypatch.context() as changed:
            changed.setenv(name, "1")
            with pytest.raises(nemoral.ConfigError, match="RANK, WORLD_SIZE.*or neither"):
                frames.stream()
    monkeypatch.setenv("RANK", "1")
    monkeypatch.setenv("WORLD_SIZE", "2")
    stream = frames.stream()
    assert (stream.rank, stream.world_size, len(stream)) == (1, 2, 6)
    # What is given goes before.
    assert len(frames.stream(rank=0, world_size=1)) == 15
    for name, text in [("RANK", "x"), ("RANK", "-1"), ("WORLD_SIZE", "0"), ("WORLD_SIZE", "")]:
        with monkeypatch.context() as changed:
            changed.setenv(name, text)
            with pytest.raises(nemoral.ConfigError, match=name) as caught:
                frames.stream()
            assert caught.value.key == name


def test_wrong_arguments(frames: Frames) -> None:
    for given, key in [
        ({"start": -1}, "start"),
        ({"start": 16}, "start"),
        ({"start": 1.5}, "start"),
        ({"batch_size": 0}, "batch_size"),
        ({"shuffle": 1}, "shuffle"),
        ({"drop_uneven": None}, "drop_uneven"),
        ({"rank": 0}, "rank, world_size"),
        ({"rank": 2, "world_size": 2}, "rank"),
        # Nothing is left for the last rank, for which the others would wait.
        ({"rank": 5, "world_size": 6}, "worlds"),
        ({"rank": 0, "world_size": 6, "drop_uneven": True}, "worlds"),
    ]:
        with pytest.raises(nemoral.ConfigError) as caught:
            frames.stream(**given)
        assert caught.value.key == key, given
    stream = frames.stream()
    right = stream.state_dict()
    for state in ({}, None, [], 3, {"start": 3}, {**right, "start": -1}, {**right, "epoch": "x"}):
        with pytest.raises(nemoral.ConfigError, match="state_dict"):
            stream.load_state_dict(state)  # type: ignore[arg-type]
    with pytest.raises(nemoral.ConfigError, match="epoch"):
        stream.set_epoch(-1)
    with pytest.raises(nemoral.ConfigError, match="frames_per_world") as caught:
        Frames("demo", frames=3)
    assert caught.value.key == "frames"
    with pytest.raises(nemoral.ConfigError, match="sequences"):
        Frames("demo", worlds=2, sequences=3)
    with pytest.raises(nemoral.ConfigError, match="did you mean `frames_per_world`"):
        Frames("demo", frame_per_world=3)


def test_the_next_world_grows_in_the_background(
    frames: Frames, monkeypatch: pytest.MonkeyPatch
) -> None:
    forest = frames.forest
    record = forest.frame
    begun = [threading.Event() for _ in range(5)]
    made = []

    def watched(k: int, *, sequence: int) -> nemoral.Frame:
        here = threading.current_thread() is threading.main_thread()
        made.append((sequence, k, here))
        if k == 0:
            begun[sequence].set()
        if k == 1 and sequence < 4:
            # While this frame is made, the next world's first one is.
            assert begun[sequence + 1].wait(60)
        return record(k, sequence=sequence)

    monkeypatch.setattr(forest, "frame", watched)
    assert delivered(frames.stream(), 0) == list(range(15))
    # Each frame is made once, and who takes them makes no world's first frame but the first's.
    assert sorted(made) == [(w, k, k > 0 or w == 0) for w in range(5) for k in range(3)]


def test_an_error_in_the_background_is_raised_when_its_world_comes(
    frames: Frames, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = frames.forest.frame

    def broken(k: int, *, sequence: int) -> nemoral.Frame:
        if sequence == 1:
            raise nemoral.Error("no world")
        return record(k, sequence=sequence)

    monkeypatch.setattr(frames.forest, "frame", broken)
    items = iter(frames.stream())
    assert numbers([next(items) for _ in range(3)]) == [0, 1, 2]
    with pytest.raises(nemoral.Error, match="no world"):
        next(items)


def same(frame: nemoral.Frame) -> nemoral.Frame:
    return frame


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_frames_come_from_workers(written: Path, method: str) -> None:
    data = FrameDataset(written, transform=same)
    loader = DataLoader(
        data, batch_size=None, num_workers=1, timeout=120, multiprocessing_context=method
    )
    found = list(loader)
    assert [frame.index for frame in found] == [0, 1]
    for i, frame in enumerate(found):
        assert equal(everything(frame), everything(data[i])) == []


@pytest.mark.parametrize("count", [0, 1])
def test_tensors_of_nearly_empty_scans(written: Path, count: int) -> None:
    frame = nemoral.Dataset(written)[0]
    vars(frame.lidar)["points"] = nemoral.Points(frame.points.array[:count])
    item = tensors(frame)
    assert item["xyz"].shape == (count, 3)
    for name in ("intensity", "point_semantic", "point_instance"):
        assert item[name].shape == (count,)


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


def test_items_are_collated(written: Path) -> None:
    data = FrameDataset(written)
    [batch] = DataLoader(data, batch_size=2, collate_fn=collate, num_workers=1, timeout=120)
    assert batch["image"].shape == (2, 64, 96, 3) and batch["index"].tolist() == [0, 1]
    assert batch["time_s"].dtype == batch["world_from_body"].dtype == torch.float64
    columns = ("xyz", "intensity", "point_semantic", "point_instance")
    # Scans of different lengths, of which one is empty.
    items = [data[0], data[1]]
    for count in (0, 5):
        items.append({**items[1], **{name: items[1][name][:count] for name in columns}})
    assert len({len(item["xyz"]) for item in items}) >= 3
    for found, expected in ((batch, items[:2]), (collate(items), items)):
        assert found["xyz"].shape == (sum(len(item["xyz"]) for item in expected), 3)
        assert found["point_batch"].dtype == torch.int64
        for i, item in enumerate(expected):
            of_item = found["point_batch"] == i
            for name, value in item.items():
                one = found[name][of_item] if name in columns else found[name][i]
                assert torch.equal(one, torch.as_tensor(value, dtype=one.dtype)), name
    small = {**items[0], "image": items[0]["image"][:8]}
    wrong: list[tuple[list[Any], str]] = [
        ([], "items"),
        ([(1, 2)], "items"),
        ([items[0], {"image": items[0]["image"]}], "items[1]"),
        ([items[0], small], "image"),
        ([items[0], {**items[1], "intensity": items[1]["intensity"][:3]}], "intensity"),
    ]
    for given, key in wrong:
        with pytest.raises(nemoral.ConfigError) as caught:
            collate(given)
        assert caught.value.key == key


def test_batches_of_single_items_are_of_several_worlds(frames: Frames) -> None:
    loader = DataLoader(frames.stream(), batch_size=None, num_workers=3, timeout=120,
                        multiprocessing_context="fork")
    batches = list(batched(loader, 3, collate_fn=plain))
    assert [len(batch) for batch in batches] == [3] * 5
    assert {item[0] for item in batches[0]} == {0, 1, 2}
    assert sorted(numbers(batches)) == list(range(15))
    assert list(batched(range(5), 2, collate_fn=plain)) == [[0, 1], [2, 3], [4]]
    assert list(batched(range(5), 2, collate_fn=plain, drop_last=True)) == [[0, 1], [2, 3]]
    assert list(batched([], 2)) == []
    for given, key in [
        ({"size": 0}, "size"),
        ({"size": 2, "collate_fn": 3}, "collate_fn"),
        ({"size": 2, "drop_last": 1}, "drop_last"),
    ]:
        # At once, and not with the first batch.
        with pytest.raises(nemoral.ConfigError) as caught:
            batched(loader, **given)
        assert caught.value.key == key


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
