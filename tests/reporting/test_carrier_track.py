"""The track of a carrier: order, line with times, look directions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyogrio.raw
import pytest
import shapely

from cityflow.core.camera import Camera, OrientedImage
from cityflow.handover.sequence_files import OtherFrame
from cityflow.io.crs import resolve
from cityflow.io.tables.outlines_gpkg import write_geopackage
from cityflow.reporting.carrier_track import (
    LINE,
    POINTS,
    STEPS,
    CarrierTrack,
    carrier_track,
    track_figures,
    track_layers,
    track_lines,
)
from cityflow.synthetic.flight import Head, head_rotation

CAMERA = Camera(64, 48, 60.0, 60.0, 32.0, 24.0)


def _track(times: tuple[float, ...] = (0.0, 1.0, 2.0, 3.0), between: tuple[OtherFrame, ...] = ()) -> CarrierTrack:
    """East by three metres a frame, looking ahead, 30° from the nadir; names are not in the order of times."""
    rotation = head_rotation(Head(direction="forward", tilt_deg=30.0), np.radians(90.0))
    images = [OrientedImage(f"i{9 - k}", CAMERA, rotation, np.array([3.0 * k, 5.0, 50.0])) for k in range(4)]
    frames = {i.name: {"time_s": t, "number": round(10 * t)} for i, t in zip(images, times, strict=True)}
    other = OrientedImage("no frame", CAMERA, rotation, np.zeros(3))
    return carrier_track([other, *reversed(images)], frames, between)


def test_frames_stand_in_the_order_of_their_times() -> None:
    track = _track()
    assert [i.name for i in track.images] == ["i9", "i8", "i7", "i6"]
    assert track.length_m == pytest.approx(9.0)
    assert track_figures(track) == {"length_m": 9.0, "seconds": 3.0, "gap_s": None}
    assert track_figures(_track((0.0, 1.0, 6.0, 7.0)))["gap_s"] == [1.0, 6.0]


def test_frames_that_hover_between_two_images_stand_where_pictures_have_moved_to() -> None:
    track = _track((0.0, 1.0, 6.0, 7.0), tuple(OtherFrame(t, 10, 0.5) for t in (2.0, 3.0, 4.0, 5.0)))
    assert np.interp([1.5, 3.5, 5.5], track.knots_s, track.knots[:, 0]).tolist() == pytest.approx([3.75, 4.5, 5.25])
    assert track.length_m == pytest.approx(9.0)
    assert track_figures(track)["gap_s"] is None


def test_a_geopackage_has_the_line_with_times_and_frames_with_looks(tmp_path: Path) -> None:
    path = tmp_path / "track.gpkg"
    data = write_geopackage(track_layers(_track(), "flight.mp4"), resolve("EPSG:28992"))
    path.write_bytes(data)
    assert data == write_geopackage(track_layers(_track(), "flight.mp4"), resolve("EPSG:28992"))
    meta, _, shapes, columns = pyogrio.raw.read(path, layer=LINE)
    (line,) = shapely.from_wkb(shapes)
    assert shapely.get_coordinates(line, include_z=True).tolist() == [[0, 5, 50], [3, 5, 50], [6, 5, 50], [9, 5, 50]]
    row = dict(zip(meta["fields"], (c[0] for c in columns), strict=True))
    assert (row["start_s"], row["end_s"], row["length_m"], row["images"]) == (0.0, 3.0, 9.0, 4)
    meta, _, shapes, columns = pyogrio.raw.read(path, layer=STEPS)
    rows = dict(zip(meta["fields"], columns, strict=True))
    assert (rows["start_s"].tolist(), rows["end_s"].tolist()) == ([0.0, 1.0, 2.0], [1.0, 2.0, 3.0])
    assert rows["speed_ms"] == pytest.approx([3.0] * 3)
    meta, _, shapes, columns = pyogrio.raw.read(path, layer=POINTS)
    rows = dict(zip(meta["fields"], columns, strict=True))
    assert rows["time_s"].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert rows["azimuth_deg"] == pytest.approx([90.0] * 4)
    assert rows["below_horizon_deg"] == pytest.approx([60.0] * 4)
    assert shapely.get_coordinates(shapely.from_wkb(shapes), include_z=True)[2].tolist() == [6, 5, 50]


def test_it_is_told_in_words() -> None:
    report = {"sequence": {"name": "flight.mp4", "track": track_figures(_track((0.0, 1.0, 6.0, 7.0)))}}
    lines = list(track_lines(report))
    assert lines[0] == "Track of flight.mp4: 9.0 m in 7.0 s, 1.3 m/s (track.gpkg)"
    assert lines[1].startswith("Between 1.00 and 6.00 s no frame says")
    assert list(track_lines({})) == []
