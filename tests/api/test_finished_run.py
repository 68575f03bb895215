"""A RUN, read as in a notebook."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely

import cityflow as cf
from browser.painted_run import DOUBLE, FLAT, GABLE, GHOST, TOPS, Made
from cityflow.core.building import Lod
from cityflow.errors import RunError


@pytest.fixture(scope="module")
def run(painted_town: Made) -> cf.Run:
    return cf.open_run(painted_town[0].store.root)


def test_the_table_has_every_exported_unit_with_its_verdict(run: cf.Run) -> None:
    units = run.units()
    assert {FLAT, GABLE} <= set(units["id"])
    assert {"status", "reason", "verdict", "ground_height_m"} <= set(units.columns)
    assert units.crs is not None
    row = units.set_index("id").loc[GABLE]
    assert row["status"] == "done"
    assert row.geometry.area == pytest.approx(140.0, abs=2.0)


def test_a_model_is_that_of_the_run_and_that_of_the_same_points(run: cf.Run, painted_town: Made) -> None:
    made = run.building(GABLE)
    solid = made.solids[Lod.LOD22]
    assert solid.vertices[:, 2].max() == pytest.approx(TOPS[GABLE], abs=0.1)
    points = cf.read_points(painted_town[0].catalog.lidar[0].href)
    again = cf.building_from_points(points, cf.Outline(GABLE, made.footprint))
    ours, theirs = (shapely.MultiPoint(s.vertices) for s in (again.solids[Lod.LOD22], solid))
    assert ours.hausdorff_distance(theirs) < 0.05
    assert again.attributes["verdict"] == made.attributes["verdict"]
    assert len(again.planes) == len(made.planes)


def test_units_without_a_model_and_unknown_ones_are_named(run: cf.Run) -> None:
    with pytest.raises(RunError, match="no unit 'nobody'"):
        run.building("nobody")
    with pytest.raises(RunError, match="no model"):
        run.building(GHOST)
    assert DOUBLE not in set(run.units()["id"])


def test_the_surface_is_a_lazy_dataset(run: cf.Run) -> None:
    surface = run.surface()
    assert surface.rio.crs.is_projected
    assert float(np.nanmax(surface["dsm"])) == pytest.approx(14.0, abs=0.5)
    with pytest.raises(RunError, match="no such surface"):
        run.surface(overview=True)


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="no run here"):
        cf.open_run(tmp_path)
