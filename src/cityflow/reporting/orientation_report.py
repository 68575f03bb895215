"""The report of an orientation: orientation.html beside orientation.json, and the figures that its catalog keeps."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import FISHEYE, OrientedImage
from cityflow.io.catalog.stac import Catalog
from cityflow.reporting.carrier_track import carrier_track
from cityflow.reporting.orientation_doubts import image_rows, is_of_photographs, orientation_figures, point_rows
from cityflow.viewer.orientation_map import OrientationMap, orientation_map
from cityflow.viewer.orientation_page import OrientationPage, SequenceFigures, orientation_page
from cityflow.viewer.orientation_rows import CameraRow, ImageRow, PointRow, Station, TiePoints

FIGURES, PAGE = "orientation.json", "orientation.html"
TERMS, FISHEYE_TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), ("k1", "k2", "k3", "k4")
"""OpenCV's order."""
WORDS = {"blurred": "blurred", "still": "without a step", "double": "that show a picture again"}
"""Kinds of frames that are passed over."""


@dataclass(frozen=True, slots=True)
class Oriented:
    """What the report is made from.

    Attributes
    ----------
    report : what orientation.json says;  catalog : the new one
    ties : tie points;  given : name of an image → as it was given; none for photographs
    places : name of a known point → (3,) world metres
    """

    report: Mapping[str, Any]
    catalog: Catalog
    ties: TiePoints
    given: Mapping[str, OrientedImage] = field(default_factory=dict)
    places: Mapping[str, FloatArray] = field(default_factory=dict)


def tie_points(table: FloatArray) -> TiePoints:
    """Of the (P, 5) or (P, 4) table of a refined block."""
    errors = table[:, 4] if table.shape[1] > 4 else np.full(len(table), np.nan)
    return TiePoints(table[:, :3], table[:, 3], errors)


def write_orientation_report(folder: Path, oriented: Oriented) -> None:
    """Both files, into the folder of the catalog; the same orientation gives the same bytes."""
    (folder / FIGURES).write_text(json.dumps(oriented.report, indent=1, sort_keys=True) + "\n")
    (folder / PAGE).write_bytes(orientation_page(page_of(oriented)))


def page_of(oriented: Oriented) -> OrientationPage:
    """All that the page shows."""
    report, catalog = oriented.report, oriented.catalog
    figures, points = orientation_figures(report), point_rows(report)
    now = {a.name: a.oriented for a in catalog.images}
    rows = tuple(_with_move(r, oriented.given.get(r.name), now.get(r.name)) for r in image_rows(report))
    reference = catalog.reference
    crs = "local metric frame" if reference.is_local else f"{reference.code} ({reference.name})"
    next_step = f"cityflow run WORKFLOW --catalog {shlex.quote(Path(catalog.href).name)}"
    shown = set(now) if is_of_photographs(report) else set(report["images"])
    stations = [Station(n, i.centre, i.axis, n in figures.weak) for n, i in sorted(now.items()) if n in shown]
    track = None
    if (sequence := report.get("sequence")) is not None:
        track = carrier_track([now[s.name] for s in stations], sequence["chosen"]).places
    drawn = _map(stations, oriented, points, track)
    return OrientationPage(
        catalog.title,
        crs,
        figures,
        oriented.ties,
        tuple(_cameras(report)),
        rows,
        points,
        drawn,
        next_step,
        _sequence(report),
    )


def _sequence(report: Mapping[str, Any]) -> SequenceFigures | None:
    found = report.get("sequence")
    if found is None:
        return None
    track, kinds = found["track"], found["kinds"]
    passed = {WORDS[k]: kinds[k] for k in WORDS if kinds.get(k)}
    pieces = (f"It has {found['pieces']} pieces that do not continue one another.",) if found["pieces"] > 1 else ()
    gaps = track["gap_s"]
    gap = (
        (
            f"Between {gaps[0]:.2f} and {gaps[1]:.2f} s no frame says where the carrier was: the track is straight there.",
        )
        if gaps
        else ()
    )
    notes = tuple(f"{n[:1].upper()}{n[1:]}." for n in found["notes"])
    return SequenceFigures(
        found["name"], found["frames"], len(found["chosen"]), passed, track["length_m"], track["seconds"], (*notes, *pieces, *gap)
    )  # fmt: skip


def _map(
    stations: Sequence[Station], oriented: Oriented, points: Sequence[PointRow], track: FloatArray | None
) -> OrientationMap | None:
    if not stations:
        return None
    known = [
        (p, oriented.places[p.name])
        for p in points
        if p.name in oriented.places and np.isfinite(oriented.places[p.name][:2]).all()
    ]
    places = np.array([xyz for _, xyz in known]).reshape(-1, 3)
    return orientation_map(stations, oriented.ties.xyz, [(p.name, p.role) for p, _ in known], places, track)


def _with_move(row: ImageRow, given: OrientedImage | None, now: OrientedImage | None) -> ImageRow:
    if given is None or now is None:
        return row
    cosine = (np.trace(now.rotation @ given.rotation.T) - 1) / 2
    turn = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return replace(row, move_m=float(np.linalg.norm(now.centre - given.centre)), turn_deg=turn)


def _cameras(report: Mapping[str, Any]) -> Iterator[CameraRow]:
    for number, camera in enumerate(report["cameras"], 1):
        images = f"{camera['images']} image{'' if camera['images'] == 1 else 's'}"
        if "adjusted" in camera:
            yield from _refined_camera(f"{camera['head'] or f'Camera {number}'} ({images})", camera)
        else:
            yield from _mapped_camera(f"Camera {number} ({images})", camera)


def _refined_camera(name: str, camera: Mapping[str, Any]) -> Iterator[CameraRow]:
    given, now = camera["given"], camera["adjusted"]
    focal_sigma = camera["focal_sigma_percent"]
    sigma = None if focal_sigma is None else focal_sigma / 100 * now["fx"]
    held = given == now
    yield CameraRow(name, "focal length (px)", given["fx"], now["fx"], None if held else sigma)
    for axis, sigma_px in zip(("cx", "cy"), camera["principal_sigma_px"], strict=True):
        yield CameraRow("", f"principal point {axis[1]} (px)", given[axis], now[axis], None if held else sigma_px)
    count = max(len(given["distortion"]), len(now["distortion"]))
    terms = FISHEYE_TERMS if now["kind"] == FISHEYE else TERMS
    for term, was, value in zip(terms[:count], _filled(given, count), _filled(now, count), strict=True):
        yield CameraRow("", term, was, value, None)


def _filled(interior: Mapping[str, Any], count: int) -> list[float]:
    return [*interior["distortion"], *[0.0] * (count - len(interior["distortion"]))]


def _mapped_camera(name: str, camera: Mapping[str, Any]) -> Iterator[CameraRow]:
    yield CameraRow(name, "focal length (px)", camera["stated_focal_px"], camera["focal_px"], camera["focal_sigma_px"])
    for axis, value in zip("xy", camera["principal_px"], strict=True):
        yield CameraRow("", f"principal point {axis} (px)", None, value, None)
    for term, value in zip(TERMS, camera["distortion"], strict=False):
        yield CameraRow("", term, None, value, None)
