"""What `explain` says of scores and parameters: parts that add up, and only what a person has changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
import shapely

from cityflow.core.building import Status
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.pipeline.pipeline import STAGES
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.model import ModelParameters
from cityflow.reporting.score_parts import score_parts
from cityflow.surface.tile_surface import SurfaceParameters
from cityflow.windows.window_parameters import WindowParameters
from cityflow.workflow import explain


def score(method: str, faces: int, price: float, fines: int = 0, **more: Any) -> dict[str, Any]:
    figures = {"covered": 0.9, "within_20cm": 0.8, "nmad": 0.1, **more}
    penalty = (1 - figures["within_20cm"]) + (1 - figures["covered"]) + figures["nmad"] + price * faces + 0.1 * fines
    return {
        "method": method,
        "valid": True,
        "fault": "",
        "faces": faces,
        "penalty": penalty,
        "face_price": price,
        **figures,
    }


@pytest.mark.parametrize(("faces", "price", "fines"), [(7, 0.002, 1), (3, 0.0123, 0), (1, 0.159, 2)])
def test_parts_add_up(faces: int, price: float, fines: int) -> None:
    said = score("volumetric", faces, price, fines)
    part = score_parts(said)
    assert part is not None
    assert (part.faces, part.simpler) == pytest.approx((faces * price, 0.1 * fines))
    assert part.unexplained + part.uncovered + part.distance + part.faces + part.simpler == pytest.approx(
        said["penalty"]
    )


def test_candidates_without_a_solid_and_older_records_have_no_parts() -> None:
    none = {**score("volumetric", 0, 0.1), "penalty": None, "valid": False, "fault": "no surface"}
    assert score_parts(none) is None
    older = score("volumetric", 3, 0.1)
    del older["face_price"]
    assert score_parts(older) is None


def test_a_choice_says_what_its_faces_cost() -> None:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0, 10, 800), rng.uniform(0, 8, 800)
    z = 8 - 0.7 * np.abs(y - 4) + rng.normal(0, 0.03, 800)
    evidence = Evidence("u", shapely.box(0, 0, 10, 8), PointCloud.of(np.column_stack([x, y, z]), BUILDING), 0.0)
    choice = choose(evidence, ReconstructParameters(methods=("orientation_histogram", "extruded")))
    assert len({s.face_price for s in choice.scores}) == 1
    parts = [score_parts(asdict(s)) for s in choice.scores]
    assert all(p is not None and p.faces > 0 for p in parts)
    assert [round(p.simpler / ReconstructParameters().score.degraded, 6) % 1 for p in parts if p] == [0.0] * len(
        parts
    ), "fines are whole ones"


def record(stage: str, parameters: dict[str, Any], scores: Sequence[dict[str, Any]] = ()) -> Record:
    result = {"scores": list(scores), "kept": 0, "roof_points": 1000, "nmad": 0.1}
    return Record(stage, "u1", 1, "d" * 64, 3, Status.DONE, "", {}, result, parameters, {})


def explained(newest: Record, every: bool = False) -> str:
    store = Store.open("memory://explain")
    made = [f"  {line}" for line in explain.lines_of_making([newest], {}, "run", every)]
    return "\n".join([*explain._found(newest, {}, store), *made, ""])


def test_it_says_what_the_stage_makes_of_what() -> None:
    lines = explained(record("units", {})).splitlines()
    assert lines[lines.index("  units, version 3") + 1] == f"    {STAGES['units'].text}"
    assert "  made_up, version 3" in explained(record("made_up", {})).splitlines()


def test_only_parameters_that_differ_are_printed() -> None:
    tree = ModelParameters(methods=("extruded",)).model_dump(mode="json")
    tree["extruded"]["percentile"] = 55.0
    text = explained(record("reconstruct", tree))
    assert "2 differ from the defaults; --parameters shows all" in text
    assert 'methods = ["extruded"] (default ["orientation_histogram", "extruded"])' in text
    assert "extruded.percentile = 55.0 (default 70.0)" in text
    assert "min_explained" not in text
    assert "min_explained" in explained(record("reconstruct", tree), every=True)
    assert "as by the defaults" in explained(record("surface", SurfaceParameters().model_dump(mode="json")))


def test_parameters_younger_than_the_record_are_no_difference() -> None:
    tree = ModelParameters().model_dump(mode="json")
    del tree["score"]["face"], tree["max_unseen"]
    assert "as by the defaults" in explained(record("reconstruct", tree))


def test_records_of_every_stage_are_told_in_the_same_short_form() -> None:
    windows = WindowParameters().model_dump(mode="json")
    older = {**windows, "levels_of_before": 48, "least_m": 0.5}
    text = explained(record("windows", older))
    assert "2 differ from the defaults; --parameters shows all" in text
    assert "      levels_of_before = 48 (no such parameter today)\n" in text
    assert f"      least_m = 0.5 (default {windows['least_m']})\n" in text
    assert "as by the defaults" in explained(record("windows", windows))
    assert "as by the defaults" in explained(record("ingest", {"index_cell_m": 50.0}))
    assert "parameters: none" in explained(record("units", {}))
    assert not [line for line in explained(record("windows", windows), every=True).splitlines() if len(line) > 160]


def test_stages_without_defaults_print_all_a_line_each() -> None:
    text = explained(record("made_up", {"raw": {"bits": 12}, "names": ["a"]}))
    assert '    parameters:\n      names = ["a"]\n      raw.bits = 12\n' in text


def test_candidates_are_a_line_each_with_the_face_price() -> None:
    scores = [score("volumetric", 3, 0.0123), score("extruded", 1, 0.0123, 1)]
    text = explained(record("reconstruct", ModelParameters().model_dump(mode="json"), scores))
    assert "a roof face costs 0.0123" in text
    assert (
        "volumetric (kept): 0.4369 = 0.2000 (20.0 % of the points off the roof) + 0.1000 (10.0 % under no roof)" in text
    )
    assert "+ 0.0369 (3 roof faces)\n" in text
    shape = {**score("primitives", 4, 0.0123), "numbers": 2}
    assert "+ 0.0082 (4 roof faces told by 2 numbers)" in explained(
        record("reconstruct", ModelParameters().model_dump(mode="json"), [shape])
    )
    assert "+ 0.0123 (1 roof face) + 0.1000 (simpler than requested)" in text
