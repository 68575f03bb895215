"""``cityflow orient VIDEO``: frames become the photographs of a catalog, and the carrier's track is written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyogrio.raw
import pytest
import shapely
from rich.console import Console

from adjustment.film import RATE, filmed
from adjustment.scenes import rendered_hills
from cityflow.errors import CatalogError
from cityflow.evaluation.poses import pose_figures
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.images.video import write_video
from cityflow.reporting.carrier_track import LINE, POINTS, TRACK
from cityflow.reporting.orientation_report import FIGURES, PAGE
from cityflow.runs.orientation_asked import OrientationAsked
from cityflow.synthetic.video_flight import SHARP, VideoParameters
from cityflow.workflow.orientation_run import run_orientation
from cityflow.workflow.orientation_standing import explain_image, print_orientation

SIZE = (360, 270)
FILM = VideoParameters(
    width_px=SIZE[0], height_px=SIZE[1], frames_a_second=RATE, seconds=3.6, altitude_m=45.0, tilt_deg=15.0, speed_ms=11.0, turn_deg=120.0,
    distortion=(), attitude_deg=3.0, hover_s=0.3, repeated_s=0.3, blurred_share=0.08, blur_px=6.0,
)  # fmt: skip


@pytest.mark.cluster
def test_a_video_becomes_a_catalog_with_a_track(scheduler: str, tmp_path: Path) -> None:
    frames = filmed(FILM)
    video, out, work = tmp_path / "flight.mp4", tmp_path / "out", tmp_path / "work"
    write_video(video, (np.repeat(rendered_hills(f.image), 3, axis=2) for f in frames), SIZE, RATE)
    with (tmp_path / "told.txt").open("w") as told:
        console = Console(file=told, width=300)
        run_orientation(OrientationAsked(str(video), str(out), True, scale_m=45.0), work, scheduler, 0, console)
        print_orientation(str(work), console)
        explain_image(str(work), "block", console)
    text, report = (tmp_path / "told.txt").read_text(), json.loads((out / FIGURES).read_text())
    catalog, sequence = read_catalog(str(out)), report["sequence"]
    number = {name: f["number"] for name, f in sequence["chosen"].items()}
    assert len(number) >= 6
    assert {a.name for a in catalog.images} == set(number)
    assert len({frames[n].shows for n in number.values()}) == len(number)
    assert [a.video_s for a in catalog.images] == pytest.approx([frames[number[a.name]].time_s for a in catalog.images])
    assert all(Path(a.href).parent.name == "out-frames" for a in catalog.images)
    found = [replace(a.oriented, name=frames[number[a.name]].image.name) for a in catalog.images]
    figures = pose_figures(found, [f.image for f in frames if f.image.name in {i.name for i in found}], True)
    # 45 m over the ground, a pixel of 14 cm
    assert figures.centre_rmse_m < 0.3
    assert figures.focal_percent < 4
    _, _, shapes, _ = pyogrio.raw.read(out / TRACK, layer=LINE)
    (line,) = shapely.from_wkb(shapes)
    assert len(line.coords) == len(number)
    assert pyogrio.raw.read(out / TRACK, layer=POINTS)[0]["fields"].tolist()[:3] == ["image", "frame", "time_s"]
    page = (out / PAGE).read_text()
    assert 'polyline class="way"' in page
    assert f"{len(number)} of the {len(frames)} frames of flight.mp4 were taken as photographs" in page
    assert "photographs. Passed over: " in page
    assert f"{len(number)} of {len(frames)} frames are taken" in text
    assert "Track of flight.mp4" in text
    assert "frames, version 1" in text
    assert SHARP in {frames[n].kind for n in number.values()}


def test_what_is_no_video_or_has_no_scale_is_refused_before_anything_is_computed(tmp_path: Path) -> None:
    console, film = Console(quiet=True), tmp_path / "film.mp4"
    film.write_bytes(b"no film at all")
    with pytest.raises(CatalogError, match="no video that can be decoded") as refused:
        run_orientation(
            OrientationAsked(str(film), str(tmp_path / "out"), True, local=True), tmp_path / "work", "", 1, console
        )
    assert refused.value.where == str(film)
    with pytest.raises(CatalogError, match="place and scale are unknown"):
        run_orientation(OrientationAsked(str(film), str(tmp_path / "out"), True), tmp_path / "work", "", 1, console)
    assert not (tmp_path / "work").exists()
    assert not (tmp_path / "out-frames").exists()
