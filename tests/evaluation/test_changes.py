from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from cityflow.core.building import Building, Lod, RoofPlane, Status
from cityflow.evaluation.change_pairs import EpochUnit, pair_up
from cityflow.evaluation.changes import ChangeParameters, Kind, changes_of
from cityflow.reconstruction.extruded import extrude

P = ChangeParameters()
X, Y = 85000.0, 447000.0


def unit(name: str, shape: Polygon, top: float | None = 8.0, sigma: float = 0.02, lod: str = "2.2") -> EpochUnit:
    """A house with a flat roof."""
    place = shapely.transform(shape, lambda xy: xy + np.array([X, Y]))
    if top is None:
        return EpochUnit(name, place, None, 0.1)
    solid = extrude(place, 0.0, top)
    plane = RoofPlane(0.0, 0.0, top, (X, Y), 100, 0.02, sigma)
    return EpochUnit(
        name, place, Building(name, place, 0.0, {Lod.LOD22: solid}, (plane,), {"lod": lod}, Status.DONE), 0.1
    )


def test_names_count_where_footprints_meet_and_overlap_elsewhere() -> None:
    before = [unit("a", box(0, 0, 10, 10)), unit("b", box(20, 0, 30, 10)), unit("c", box(40, 0, 50, 10))]
    after = [unit("a", box(1, 0, 11, 10)), unit("x", box(20, 1, 30, 11)), unit("c", box(90, 0, 99, 9))]
    names = [tuple(None if u is None else u.id for u in pair) for pair in pair_up(before, after)]
    assert names == [("a", "a"), (None, "c"), ("c", None), ("b", "x")]


def test_a_raised_roof_an_annex_and_nothing() -> None:
    shapes = {"raised": box(0, 0, 10, 10), "annex": box(20, 0, 30, 10), "same": box(40, 0, 50, 10)}
    before = [unit(n, s) for n, s in shapes.items()]
    after = [
        unit("raised", shapes["raised"], 9.0),
        unit("annex", box(20, 0, 32, 10)),
        unit("same", box(40.1, 0, 50.1, 10), 8.05),
    ]
    found = changes_of(pair_up(before, after), P)
    annex, raised = found.found
    assert (annex.id, raised.id, found.compared) == ("annex", "raised", 1)
    assert annex.figures.outline_changed_m2 == pytest.approx(20)
    assert annex.figures.volume_m3 == pytest.approx(160)
    assert annex.figures.roof_changed_m2 == 0
    assert raised.figures.roof_changed_m2 == pytest.approx(100)
    assert raised.figures.ridge_m == pytest.approx(1.0)
    assert raised.figures.significance == pytest.approx(1 / np.hypot(0.02, 0.02))


def test_what_is_no_larger_than_the_accuracy_of_the_models_is_no_change() -> None:
    shape = box(0, 0, 10, 10)
    for top, sigma, kinds in ((8.6, 0.02, [Kind.ALTERED]), (8.6, 0.2, []), (8.4, 0.02, [])):
        found = changes_of(pair_up([unit("a", shape, sigma=sigma)], [unit("a", shape, top, sigma)]), P)
        assert [c.kind for c in found.found] == kinds


def test_an_offset_between_two_surveys_changes_no_building() -> None:
    """Thirty houses all 70 cm higher, with a scatter of some centimetres, one of them 2 m more."""
    rng = np.random.default_rng(3)
    places = [box(20 * k, 0, 20 * k + 10, 10) for k in range(30)]
    before = [unit(f"h{k:02}", s) for k, s in enumerate(places)]
    after = [unit(f"h{k:02}", s, 8.7 + rng.normal(0, 0.05) + 2 * (k == 4)) for k, s in enumerate(places)]
    found = changes_of(pair_up(before, after), P)
    assert [c.id for c in found.found] == ["h04"]
    assert found.offset_m == pytest.approx(0.7, abs=0.03)
    assert 0.02 < found.scatter_m < 0.1
    assert found.found[0].figures.roof_mean_m == pytest.approx(2.0, abs=0.15)


def test_a_block_in_place_of_a_roof_tells_no_more_than_the_roof_spreads() -> None:
    shape = box(0, 0, 10, 10)
    gable = unit("a", shape)
    assert gable.building is not None
    solid = gable.building.solids[Lod.LOD22]
    roof = np.where(solid.vertices[:, 2] > 4, 8.0 + 0.6 * (solid.vertices[:, 0] - X), 0.0)
    tilted = replace(solid, vertices=np.column_stack([solid.vertices[:, :2], roof]))
    before = replace(gable, building=replace(gable.building, solids={Lod.LOD22: tilted}))
    assert changes_of([(before, unit("a", shape, 12.0, lod="1.2"))], P).found == ()
    assert len(changes_of([(before, unit("a", shape, 12.0))], P).found) == 1
    assert len(changes_of([(before, unit("a", shape, 22.0, lod="1.2"))], P).found) == 1


def test_without_a_model_only_outlines_are_compared() -> None:
    shape = box(0, 0, 10, 10)
    found = changes_of(
        [(unit("a", shape), unit("a", shape, None)), (unit("b", shape, None), unit("b", box(0, 0, 10, 14)))], P
    )
    assert [c.id for c in found.found] == ["b"]
    assert found.without_model == ("a", "b")
    assert found.found[0].figures.volume_m3 is None
