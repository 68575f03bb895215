"""``cityflow orient``: a catalog with spoiled poses becomes one with refined poses; the same again changes nothing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from cityflow.cli import app
from cityflow.core.camera import OrientedImage
from cityflow.errors import CatalogError, WorkflowError
from cityflow.io.catalog.stac import read_catalog
from cityflow.reporting.orientation_report import FIGURES, PAGE
from cityflow.runs.orientation_asked import OrientationAsked
from cityflow.workflow.orient import control_in, orient_catalog, orient_parameters
from cityflow.workflow.orientation_run import run_orientation
from ground_flight import ORIGIN, ground_catalog, ground_flight, off_px, turned


def _control(path: Path, images: list[OrientedImage]) -> Path:
    """Four points on the ground with exact marks; the last one is for checking."""
    lines = ["point,x,y,z,role,image,col,row"]
    for name, x, y in (("C1", -8.0, -6.0), ("C2", 8.0, -6.0), ("C3", 0.0, 8.0), ("K1", 1.0, 1.0)):
        for image in images:
            uv = image.project(np.array([[x, y, 0.0]]))[0]
            if image.holds(uv)[0]:
                place = f"{x + ORIGIN[0]},{y + ORIGIN[1]},0,{'check' if name == 'K1' else 'control'}"
                lines.append(f"{name},{place},{image.name},{uv[0, 0]:.4f},{uv[0, 1]:.4f}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.cluster
def test_spoiled_poses_are_refined_and_a_repeated_command_keeps_every_byte(scheduler: str, tmp_path: Path) -> None:
    images = ground_flight()
    given = ground_catalog(tmp_path, images, turned(images, 0.8))
    control = control_in(given, _control(tmp_path / "control.csv", images))
    told, out = (tmp_path / "told.txt").open("w", buffering=1), tmp_path / "refined"
    console = Console(file=told)
    asked = OrientationAsked(given.href, str(out), False, control=str(tmp_path / "control.csv"))
    run_orientation(asked, tmp_path / "work", scheduler, 0, console)
    found = read_catalog(str(out))
    report = json.loads((out / FIGURES).read_text())
    page = (out / PAGE).read_text()
    assert "All 9 images have a pose; nothing is doubtful." in page
    assert f"{report['summary']['tie_points']:,} tie points" in page
    assert found.orientation is not None
    assert found.orientation.check is not None
    assert found.orientation.check.count == 1
    assert report["summary"]["refined"]
    assert report["summary"]["weak"] == []
    points = {p["name"]: p for p in report["summary"]["control"]["points"]}
    assert [points[n]["role"] for n in ("C1", "C2", "C3", "K1")] == ["control"] * 3 + ["check"]
    assert max(abs(v) for v in points["K1"]["off_m"][:2]) < 0.05
    assert "Check points: 1" in (tmp_path / "told.txt").read_text()
    assert report["images"]["i4"]["observations"] > 20
    assert off_px(found, images) < 0.3 * off_px(given, images)
    assert all(len(a.pose_covariance) == 21 for a in found.images)
    assert [(a.checksum, a.gain, a.heights) for a in found.images] == [
        (a.checksum, a.gain, a.heights) for a in given.images
    ]
    before = {p.name: p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}
    records = sorted((tmp_path / "work" / "records").rglob("*.json"))
    orient_catalog(given, out, tmp_path / "work", orient_parameters([]), scheduler, 0, console, control)
    assert sorted((tmp_path / "work" / "records").rglob("*.json")) == records
    assert {p.name: p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()} == before
    _run_again_and_explained(tmp_path / "work", out, Path(given.images[8].href), scheduler)


def _run_again_and_explained(work: Path, out: Path, picture: Path, scheduler: str) -> None:
    """A picture that is damaged fails with its reason when it is looked at again; mended, what failed is made again with the same bytes."""
    before, data = {p.name: p.read_bytes() for p in out.iterdir() if p.is_file()}, picture.read_bytes()
    rerun = ["rerun", str(work), "--scheduler", scheduler]
    told = _said(["explain", str(work), "i4"])
    for known in ("It has a pose, ", "matches agree with 8: ", "Standard deviations: position", "ties, version"):
        assert known in told
    picture.write_bytes(b"no picture")
    assert "Running again: 1 task," in _said([*rerun, "--unit", "i8", "--stage", "features"])
    standing = json.loads(_said(["status", str(work), "--json"]))
    assert {s["stage"]: (s["tasks"], s["done"], s["failed"]) for s in standing["stages"]} == {
        "features": (9, 8, 1), "ties": (8, 8, 0), "adjust": (1, 1, 0)
    }  # fmt: skip
    assert [(p["units"], "i8.png" in p["reason"]) for p in standing["problems"]] == [(["i8"], True)]
    assert standing["orientation"]["left_out"].keys() == {"i8"}
    assert "features failed: " in _said(["explain", str(work), "i8"])
    picture.write_bytes(data)
    assert "Running again: 1 task," in _said([*rerun, "--failed"])
    assert {p.name: p.read_bytes() for p in out.iterdir() if p.is_file()} == before
    assert "no unit of those named has failed" in _said([*rerun, "--unit", "i4", "--failed"])


def _said(command: list[str]) -> str:
    """What a command prints, on one line as long as it likes."""
    result = CliRunner().invoke(app, command, env={"COLUMNS": "400"}, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_wrong_words_are_answered(tmp_path: Path) -> None:
    with pytest.raises(WorkflowError, match="bound"):
        orient_parameters(["bound_pix=3"])
    images = ground_flight()[:2]
    given = ground_catalog(tmp_path, images, images)
    with pytest.raises(CatalogError, match="2 images from the air"):
        orient_catalog(given, tmp_path / "out", tmp_path / "work", orient_parameters([]), "", 1, Console(quiet=True))


def test_title_and_attribution_of_photographs_are_what_the_command_was_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    photos = tmp_path / "photos"
    photos.mkdir()
    (photos / "a.jpg").write_bytes(b"")
    asked: list[OrientationAsked] = []
    monkeypatch.setattr("cityflow.workflow.orientation_run.run_orientation", lambda what, *_: asked.append(what))
    named = ["--title", "Old town", "--attribution", "Somebody, CC BY"]
    told = CliRunner().invoke(app, ["orient", str(photos), "--out", str(tmp_path / "out"), *named])
    assert told.exit_code == 0, told.output
    assert [(a.title, a.attribution) for a in asked] == [("Old town", "Somebody, CC BY")]
    images = ground_flight()
    given = ground_catalog(tmp_path, images, images)
    told = CliRunner().invoke(app, ["orient", given.href, "--out", str(tmp_path / "out"), *named])
    assert told.exit_code != 0
    assert "for photographs without poses" in str(told.exception)
    assert len(asked) == 1
