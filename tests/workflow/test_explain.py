"""What `explain` says of scores and parameters: parts that add up, and only what a person has changed."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from rich.console import Console

from cityflow.core.building import Status
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.flow.task import Record
from cityflow.reconstruction.choose import ReconstructParameters, ScoreParameters, choose
from cityflow.reconstruction.model import ModelParameters
from cityflow.surface.tile_surface import SurfaceParameters
from cityflow.workflow import explain
from cityflow.workflow.score_parts import score_parts

WEIGHTS = ScoreParameters()


def score(method: str, faces: int, price: float, fines: int = 0, **more: Any) -> dict[str, Any]:
    figures = {"covered": 0.9, "within_20cm": 0.8, "nmad": 0.1, **more}
    penalty = (1 - figures["within_20cm"]) + (1 - figures["covered"]) + figures["nmad"] + price * faces + 0.1 * fines
    return {"method": method, "valid": True, "fault": "", "faces": faces, "penalty": penalty, **figures}


@pytest.mark.parametrize("price", [0.002, 0.0123, 0.159])
def test_parts_add_up_and_the_price_is_found(price: float) -> None:
    scores = [
        score("monolithic/2", 7, price, 1),
        score("volumetric", 3, price),
        score("extruded", 1, price, 1, nmad=2.0),
    ]
    found, parts = score_parts(scores, WEIGHTS, 100_000)
    assert found == pytest.approx(price)
    assert [p.faces for p in parts if p] == pytest.approx([7 * price, 3 * price, price])
    assert [p.simpler for p in parts if p] == pytest.approx([0.1, 0, 0.1])
    for part, said in zip(parts, scores, strict=True):
        assert part is not None
        whole = part.unexplained + part.uncovered + part.distance + (part.faces or 0) + (part.simpler or 0)
        assert whole == pytest.approx(said["penalty"])


def test_what_the_record_cannot_tell_apart_stays_together() -> None:
    found, parts = score_parts([score("foreign:method", 4, 0.05)], WEIGHTS, 100_000)
    assert found is None
    assert parts[0] is not None
    assert (parts[0].faces, parts[0].simpler) == (None, None)
    assert parts[0].rest == pytest.approx(0.2)
    few, _ = score_parts([score("foreign:method", 4, 0.05)], WEIGHTS, 200)
    assert few == pytest.approx(0.05), "so few points make no face cheaper than that"


def test_candidates_without_a_solid_have_no_parts() -> None:
    none = {**score("volumetric", 0, 0.1), "penalty": None, "valid": False, "fault": "no surface"}
    found, parts = score_parts([none, score("extruded", 1, 0.02, 1)], WEIGHTS, 500)
    assert parts[0] is None
    assert found == pytest.approx(0.02)


@pytest.mark.parametrize("noise", [0.03, 0.3])
def test_the_price_is_the_one_that_the_choice_has_used(noise: float, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0, 10, 800), rng.uniform(0, 8, 800)
    z = 8 - 0.7 * np.abs(y - 4) + rng.normal(0, noise, 800)
    evidence = Evidence("u", shapely.box(0, 0, 10, 8), PointCloud.of(np.column_stack([x, y, z]), BUILDING), 0.0)
    used: list[float] = []
    least = choose.__globals__["least_face_penalty"]

    def noted(observations: float) -> float:
        used.append(least(observations))
        return used[-1]

    monkeypatch.setitem(choose.__globals__, "least_face_penalty", noted)
    choice = choose(evidence, ReconstructParameters(methods=("orientation_histogram", "extruded")))
    found, _ = score_parts([asdict(s) for s in choice.scores], WEIGHTS, len(evidence.points))
    assert found == pytest.approx(max(used[-1], WEIGHTS.face))


def record(stage: str, parameters: dict[str, Any], scores: Sequence[dict[str, Any]] = ()) -> Record:
    result = {"scores": list(scores), "kept": 0, "roof_points": 1000, "nmad": 0.1}
    return Record(stage, "u1", 1, "d" * 64, 3, Status.DONE, "", {}, result, parameters, {})


def said(newest: Record, every: bool = False) -> str:
    out = io.StringIO()
    console = Console(file=out, width=500)
    explain._print_task([newest], {}, str(Path("run")), console, every)
    return out.getvalue()


def test_only_parameters_that_differ_are_printed() -> None:
    tree = ModelParameters(methods=("extruded",)).model_dump(mode="json")
    tree["extruded"]["percentile"] = 55.0
    text = said(record("reconstruct", tree))
    assert "2 differ from the defaults; --parameters shows all" in text
    assert 'methods = ["extruded"] (default ["orientation_histogram", "extruded"])' in text
    assert "extruded.percentile = 55.0 (default 70.0)" in text
    assert "min_explained" not in text
    assert "min_explained" in said(record("reconstruct", tree), every=True)
    assert "as by the defaults" in said(record("surface", SurfaceParameters().model_dump(mode="json")))


def test_parameters_younger_than_the_record_are_no_difference_and_stages_without_defaults_print_all() -> None:
    tree = ModelParameters().model_dump(mode="json")
    del tree["score"]["face"], tree["max_unseen"]
    assert "as by the defaults" in said(record("reconstruct", tree))
    assert '"index_cell_m": 50.0' in said(record("ingest", {"index_cell_m": 50.0}))


def test_candidates_are_a_line_each_with_the_face_price() -> None:
    scores = [score("volumetric", 3, 0.0123), score("extruded", 1, 0.0123, 1)]
    text = said(record("reconstruct", ModelParameters().model_dump(mode="json"), scores))
    assert "a roof face costs 0.0123" in text
    assert (
        "volumetric (kept): 0.4369 = 0.2000 (20.0 % of the points off the roof) + 0.1000 (10.0 % under no roof)" in text
    )
    assert "+ 0.0369 (3 roof faces)\n" in text
    assert "+ 0.0123 (1 roof face) + 0.1000 (simpler than asked for)" in text
