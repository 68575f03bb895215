"""A whole run of the workflow in the order of Frommholz 2017, over the pictures of the small flight."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from cityflow.core.parameters import merged
from cluster.small_city import Commands, Done, copy_of, newest, redone
from cluster.small_flight import WORKFLOW, SmallFlight

pytestmark = pytest.mark.cluster

PAPER = Path(__file__).parents[2] / "workflows" / "frommholz_2017.yaml"
OF_THE_FLIGHT = ("name", "tiles", "orient", "flight", "outline")
"""What of a workflow depends on the size of a survey; and its name, as a RUN belongs to one."""
BEFORE = {"ingest", "match", "fuse", "surface", "ortho", "frame"}
"""Stages whose results do not depend on the order of methods."""


def test_a_flight_becomes_a_city_in_the_order_of_the_paper(
    cityflow: Commands, small_flight: SmallFlight, flight_run: Path, tmp_path: Path
) -> None:
    """Surfaces are those of any other workflow; noise goes before façades are looked for, and a row of houses is too much for the monolithic method."""
    asked = yaml.safe_load(PAPER.read_text())
    workflow = tmp_path / "paper.yaml"
    workflow.write_text(yaml.safe_dump(merged(asked, {key: WORKFLOW[key] for key in OF_THE_FLIGHT})))
    run = copy_of(flight_run, tmp_path / "run")
    where = ("--catalog", small_flight.catalog, "--out", run, "--set", "texture.when=never")
    done = list[Done]()
    again = redone(run, lambda: done.append(cityflow("run", workflow, *where)))

    assert done[0].code == 0, done[0].text
    assert not {stage for stage, _ in again} & BEFORE
    assert {stage for stage, _ in again} >= {"walls", "detect", "reconstruct", "export"}
    made = {unit: r for unit, r in newest(run, "reconstruct").items() if ("reconstruct", unit) in again}
    assert len(made) == 1, "the houses touch and are not split"
    (row,) = made.values()
    assert row["status"] == "done"
    assert row["result"]["method"] == "volumetric"
    assert [s["method"] for s in row["result"]["scores"]] == ["monolithic", "volumetric"]
    before, after = (sum(r["result"]["wall_points"] for r in newest(of, "walls").values()) for of in (flight_run, run))
    assert 0.8 * before < after < before
    models = "".join(p.read_text() for p in (run / "products" / "citygml").glob("*.gml"))
    assert models.count("<bldg:Building ") == 1
    assert [*(run / "products" / "obj").glob("*.obj")]
