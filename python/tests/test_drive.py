"""Observation at any pose, and what is around."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import SMALL

import nemoral


def test_a_frames_own_pose_time_and_index_give_that_frame(forest: nemoral.Forest) -> None:
    frame = forest.frame(1)
    seen = forest.observe(frame.world_from_body, time_s=frame.time_s, index=1)
    assert np.array_equal(seen.image, frame.image)
    assert seen.points.array.tobytes() == frame.points.array.tobytes()
    assert np.allclose(forest.pose(1), frame.world_from_body)
    assert forest.time_s(1) == frame.time_s


def test_observing_anywhere(forest: nemoral.Forest) -> None:
    x, y = forest.pose(0)[:2, 3]
    pose = forest.stand(x + 1.0, y, 0.5)
    one = forest.observe((x + 1.0, y, 0.5), time_s=0.3)
    two = forest.observe(pose, time_s=0.3)
    assert np.array_equal(one.image, two.image) and one.index is None
    assert one.points.array.tobytes() == two.points.array.tobytes()
    later = forest.observe(pose, time_s=0.4)
    assert np.array_equal(later.depth_m, one.depth_m)
    assert later.points.array.tobytes() != one.points.array.tobytes()
    moving = forest.observe(pose, time_s=0.3, index=5, velocity=(2.0, 0, 0), turn_rate=(0, 0, 1.0))
    still = forest.observe(pose, time_s=0.3, index=5)
    assert moving.points.array.tobytes() != still.points.array.tobytes()


def test_the_ground_is_what_stands_on_it(forest: nemoral.Forest) -> None:
    body = forest.pose(0)
    x, y, z = body[:3, 3]
    ground = forest.ground(x, y)
    assert ground["height_m"].shape == () and abs(ground["height_m"] - z) < 0.3
    grid = forest.ground(*np.meshgrid(x + np.arange(5.0), y + np.arange(4.0)))
    assert grid["height_m"].shape == (4, 5) and grid["normal"].shape == (4, 5, 3)
    assert np.allclose(np.linalg.norm(grid["normal"], axis=-1), 1, atol=1e-6)
    names = {forest.classes[int(c)] for c in np.unique(grid["semantic"])}
    assert names <= {"Terrain", "Traversable"}
    assert np.array_equal(grid["trail_edge_m"] < 0, grid["semantic"] == 2)


def test_inventories_are_those_of_the_data_set(forest: nemoral.Forest, written: Path) -> None:
    table = nemoral.Dataset(written).trees()
    low, high = table["position_m"].min(axis=0) - 1, table["position_m"].max(axis=0) + 1
    trees = forest.trees(low[0], low[1], high[0], high[1])
    rows = {int(o): i for i, o in enumerate(trees["object"])}
    assert set(map(int, table["object"])) <= set(rows)
    for i, number in enumerate(table["object"]):
        at = rows[int(number)]
        assert trees["species"][at] == table["species"][i]
        assert trees["dbh_m"][at] == pytest.approx(table["dbh_m"][i], abs=1e-3)
    objects = forest.objects(low[0], low[1], high[0], high[1])
    # What lies on a trail is no column of a file.
    assert set(objects) - {"on_trail"} == set(nemoral.Dataset(written).objects())
    assert set(objects["kind"]) <= {"tree", "stump", "shrub", "rock"}
    discs = forest.obstacles(low[0], low[1], high[0], high[1])
    in_the_way = ~objects["on_trail"]
    feet = np.column_stack([objects["position_m"][:, :2], objects["radius_m"]])[in_the_way]
    found = {tuple(row) for row in np.round(discs, 6)}
    assert {tuple(row) for row in np.round(feet, 6)} <= found
    outside = np.maximum(low[:2] - discs[:, :2], discs[:, :2] - high[:2]).clip(0)
    assert (np.hypot(*outside.T) <= discs[:, 2]).all()
    with pytest.raises(ValueError, match="rectangle"):
        forest.obstacles(-1e6, -1e6, 1e6, 1e6)


def test_a_survey_has_the_trees_and_the_ground(forest: nemoral.Forest) -> None:
    x, y = np.round(forest.frame(0).world_from_body[:2, 3])
    box = (x - 20, y - 30, x + 20, y + 30)
    maps = forest.survey(*box, cell_m=1, rays_a_side=3)
    assert maps["height_m"].shape == maps["object"].shape == (60, 40)
    assert maps["object"].dtype == np.uint64
    np.testing.assert_array_equal(maps["x_m"], np.arange(x - 19.5, x + 20))
    np.testing.assert_array_equal(maps["y_m"], np.arange(y + 29.5, y - 30, -1))
    xs, ys = np.meshgrid(maps["x_m"], maps["y_m"])
    np.testing.assert_array_equal(maps["ground_m"], forest.ground(xs, ys)["height_m"])
    trees = forest.trees(*box)
    assert 0.9 * trees["height_m"].max() < maps["height_m"].max()
    assert np.isin(trees["object"], maps["object"]).mean() > 0.5
    assert maps["cover"].mean() == pytest.approx(maps["canopy_cover"])
    layers = maps["leaf_area_density_m2_m3"]
    assert layers.sum() == pytest.approx(maps["leaf_area_index"])
    assert len(maps["wood_area_density_m2_m3"]) == len(layers)
    for wrong in ({"cell_m": 0.0}, {"rays_a_side": 33}, {"layer_m": "thick"}, {"cell_m": 7}):
        with pytest.raises(ValueError):
            forest.survey(*box, **wrong)


def test_a_log_is_a_row_of_obstacles(cache: Path) -> None:
    floor = {"deadwood.volume_m3_ha": 60.0}
    forest = nemoral.Forest("demo", cache=cache, **SMALL, **floor)
    objects = forest.objects(-40, -40, 40, 40)
    middles = objects["position_m"][np.array(objects["kind"]) == "log", :2]
    assert len(middles) > 2
    discs = forest.obstacles(-60, -60, 60, 60)
    for middle in middles:
        # Discs lie 0.4 m apart or less, and as far on one side of the middle as on the other. They
        # are all as wide as the log is, and as they have to be to leave nothing between them.
        offsets, radii = discs[:, :2] - middle, discs[:, 2]
        distances = np.hypot(*offsets.T)
        near = (distances > 1e-3) & (distances <= 0.4 + 1e-6) & (radii > 0.2)
        offsets, radii = offsets[near], radii[near]
        opposite = np.hypot(*(offsets[:, None] + offsets[None]).transpose(2, 0, 1)) < 1e-3
        alike = np.isclose(radii[:, None], radii[None])
        assert (opposite & alike).any(), (middle, offsets, radii)


def test_rays_meet_the_ground(forest: nemoral.Forest) -> None:
    x, y, z = forest.pose(0)[:3, 3]
    hits = forest.cast([[x, y, z + 50.0, 0, 0, 1.0], [x, y, z - 5.0, 0, 0, 2.0]])
    assert hits["distance_m"][0] == np.inf and hits["semantic"][0] == 0
    height = float(forest.ground(x, y)["height_m"])
    assert hits["distance_m"][1] == pytest.approx(height - (z - 5.0), abs=0.1)
    assert hits["normal"].shape == (2, 3) and hits["instance"].dtype == np.uint32


def test_lidar_alone(cache: Path) -> None:
    forest = nemoral.Forest("demo", cache=cache, **SMALL, **{"camera.enabled": False})
    frame = forest.observe(forest.pose(0))
    assert not frame.cameras and len(frame.points) > 100
    with pytest.raises(nemoral.ConfigError, match="camera.enabled"):
        _ = frame.image


def test_an_inertial_unit_feels_gravity_and_is_in_data_sets(cache: Path, tmp_path: Path) -> None:
    keys = {**SMALL, "imu.enabled": True, "imu.rate_hz": 50, "robot.spacing_s": 0.2}
    forest = nemoral.Forest("demo", 7, cache=cache, **keys)
    live = forest.imu()
    # Two frames that are 0.2 s apart, and until the last scan has ended.
    assert np.allclose(live["time_s"], np.arange(12) / 50)
    assert live["rotation_xyzw"].shape == (12, 4) and live["angular_rate_rad_s"].shape == (12, 3)
    felt = live["specific_force_m_s2"] - live["accelerometer_bias_m_s2"]
    assert np.linalg.norm(felt, axis=1).mean() == pytest.approx(9.81, abs=0.5)
    mount = np.eye(4)
    mount[2, 3] = 0.5
    unit = forest.pose(1) @ mount
    assert np.allclose(live["position_m"][10], unit[:3, 3], atol=1e-9)

    out = tmp_path / "out"
    nemoral.generate("demo", 7, out=out, cache=cache, **keys)
    read = nemoral.Dataset(out).imu()
    assert set(read) == set(live)
    for name, column in read.items():
        assert column.dtype == np.float64
        assert np.allclose(column, live[name], atol=1e-8), name
    assert [file for file, _ in nemoral.check(out).problems if file != "agreement"] == []


def test_there_is_nothing_to_measure_without_a_unit_or_a_drive(written: Path, cache: Path) -> None:
    with pytest.raises(ValueError, match="imu.enabled = true"):
        nemoral.Dataset(written).imu()
    with pytest.raises(ValueError, match="stands still"):
        nemoral.Forest("demo", 7, cache=cache, **{"robot.stations.rows": 2}).imu()
    with pytest.raises(nemoral.ConfigError, match=r"must be false with \[robot.stations\]"):
        nemoral.Forest("demo", 7, **{"robot.stations.rows": 2, "imu.enabled": True})
