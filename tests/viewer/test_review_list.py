from __future__ import annotations

import numpy as np
import shapely

import cityflow as cf
from cityflow.core.building import Status
from cityflow.core.points import PointCloud
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.review_list import SUSPECTED, review_list, suspicion_of
from house_row import HouseRow, scanned


def unit(name: str, verdict: str, probability: float, rmse: float = 0.1, **more: object) -> UnitRow:
    return UnitRow(name, "0_0", Status.DONE, rmse=rmse, verdict=verdict, good_probability=probability, **more)  # type: ignore[arg-type]


def test_the_list_begins_with_the_worst_and_says_why() -> None:
    listed = review_list([
        unit("doubtful", "look", 0.6, verdict_reason="8 % of the roof has no points nearby"), unit("fine", "good", 0.99),
        unit("wrong", "poor", 0.02, 4.0), unit("wronger", "poor", 0.02, 5.0, reason="a block"),
    ])  # fmt: skip
    assert [s.unit.id for s in listed] == ["wronger", "wrong", "doubtful"]
    assert [s.reason for s in listed] == ["a block", "no reason given", "8 % of the roof has no points nearby"]


def test_failed_buildings_come_first_and_refused_outlines_are_none() -> None:
    failed = UnitRow("failed", "0_0", Status.FAILED, "no roof points")
    refused = UnitRow("refused", "0_0", Status.REFUSED, "a line")
    listed = review_list([unit("wrong", "poor", 0.02), refused, failed])
    assert [(s.unit.id, s.reason) for s in listed] == [("failed", "no roof points"), ("wrong", "no reason given")]


def test_what_nobody_judged_is_not_called_bad() -> None:
    assert review_list([UnitRow("a", "0_0", Status.DONE)]) == []


def test_an_outline_on_a_tree_is_suspected_and_one_on_a_house_is_not() -> None:
    """Points without classes: a scanned house, and a crown of 6 m radius that the laser goes into, over half of the ground below."""
    house = HouseRow(eaves=(6.0,), facades=(100,), roofs=(100,), width=14.0)
    outline = cf.Outline("house", shapely.Polygon(shapely.get_coordinates(house.outline)[::-1]))
    assert suspicion_of(cf.building_from_points(scanned(house, 12.0), outline).attributes) < 0.3
    rng = np.random.default_rng(4)
    ground = np.column_stack([rng.uniform(-25, 25, (20_000, 2)), rng.normal(0, 0.02, 20_000)])
    xy = rng.uniform(-6, 6, (2_500, 2))
    xy = xy[np.hypot(*xy.T) < 6]
    depth = np.sqrt(36 - (xy**2).sum(axis=1))
    crown = np.column_stack([xy, 8 + 0.8 * depth * rng.uniform(-1, 1, len(xy))])
    under = np.hypot(*ground[:, :2].T) < 6
    seen = ground[~under | (rng.uniform(size=len(ground)) < 0.5)]
    points = PointCloud.of(np.concatenate([seen, crown]))
    tree = cf.building_from_points(points, cf.Outline("tree", shapely.box(-5, -4, 5, 4)))
    assert suspicion_of(tree.attributes) >= SUSPECTED
