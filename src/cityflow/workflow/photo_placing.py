"""From the frame of a mapping to the CRS of a catalog: by control points, else by GNSS positions, else by what the user says of the scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS

from cityflow.adjustment.placing import control_fit, levelled, placed, robust_fit, seen_places
from cityflow.catalog.create import SurveyText
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.control_points import ControlPoint, ControlPoints, Role
from cityflow.core.json_values import rounded
from cityflow.core.photo_metadata import PhotoMetadata
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.geometry.similarity import Similarity
from cityflow.io.control_points.read_points import read_control_points
from cityflow.io.control_points.references import in_crs
from cityflow.io.crs import crs_of, reference_of, resolve
from cityflow.io.tables.feature_ids import listing
from cityflow.workflow.gnss_places import FEWEST, GNSS, GnssPlaces, gnss_places, placed_by_gnss, utm
from cityflow.workflow.onto import Onto

LOCAL_HEIGHT_M = 100.0
"""Median height over the ground in a local frame of unknown scale."""
LEAST_PX = 3.0
"""Control points whose residuals are below this contradict nobody, in pixels on the ground; set by hand."""
REMEDY = (
    "give control points (--control FILE), the height over the ground at which they were taken (--scale METRES), or "
    "--local for a frame of unknown scale; or name a survey of the same place (--onto FILES)"
)


@dataclass(frozen=True, slots=True)
class Placing:
    """What the user gives for place and scale.

    Attributes
    ----------
    control, marks : files of control points, and of their marks where these stand apart
    scale_m : median height of the images over the ground; None: not given
    local : a frame of unknown scale will do
    crs : of the catalog, as on the command line; empty: that of the control points, or UTM for GNSS positions
    onto : survey that the photographs are led onto from there
    text : what the catalog tells of the survey
    arm : metres from the projection centre to the antenna in the frame of the camera: right in the picture, down, ahead; None: not given
    """

    control: Path | None = None
    marks: Path | None = None
    scale_m: float | None = None
    local: bool = False
    crs: str = ""
    arm: tuple[float, float, float] | None = None
    onto: Onto | None = None
    text: SurveyText = field(default_factory=SurveyText)


@dataclass(frozen=True, slots=True)
class Placed:
    """A model in its CRS.

    Attributes
    ----------
    images, xyz : with (P, 3) tie points;  crs : its code
    figures : for the report;  lines : for the user
    wrong : names of control points that are not used → why
    unused : names of images whose GNSS positions contradict the others;  on_line : whether the positions leave the roll open
    """

    images: tuple[OrientedImage, ...]
    xyz: FloatArray
    crs: str
    figures: Mapping[str, Any]
    lines: tuple[str, ...] = field(default=())
    wrong: Mapping[str, str] = field(default_factory=dict)
    unused: frozenset[str] = frozenset()
    on_line: bool = False


def lever_arm_of(text: str) -> tuple[float, float, float] | None:
    """Three metres between commas; None where nothing stands there. Raises CatalogError where it is something else."""
    if not text:
        return None
    try:
        right, down, ahead = (float(v) for v in text.split(","))
    except ValueError:
        remedy = "give metres as right,down,ahead: --lever-arm 0.05,0.32,-0.2"
        raise CatalogError(f"{text!r} are not three numbers", where="--lever-arm", remedy=remedy) from None
    return right, down, ahead


def known_control(placing: Placing) -> tuple[ControlPoints, Reference] | None:
    """Control points in the catalog's CRS, and that.

    Raises
    ------
    CatalogError
        They cannot be read or led there, or nobody says their CRS.
    """
    if placing.control is None:
        return None
    given = read_control_points(placing.control, placing.marks)
    if placing.crs:
        reference = resolve(placing.crs)
    elif given.crs_wkt is not None:
        reference = reference_of(CRS.from_wkt(given.crs_wkt))
    else:
        remedy = "name it with --crs EPSG:n, or --crs local for metres of their own"
        raise CatalogError("the control points state no CRS", where=str(placing.control), remedy=remedy)
    # a similarity of seven parameters needs whole places
    whole = tuple(p for p in given.points if np.isfinite(p.xyz).all())
    return in_crs(replace(given, points=whole), crs_of(reference)), reference


def known_positions(
    placing: Placing, photos: Mapping[str, PhotoMetadata], control: tuple[ControlPoints, Reference] | None
) -> GnssPlaces | None:
    """GNSS positions in the catalog's CRS; None where something else tells place and scale, and they cannot be led there.

    Parameters
    ----------
    photos : by the names of their tasks, those whose GNSS positions can be true
    control : as `known_control` has it

    Raises
    ------
    CatalogError
        Nothing will tell place and scale: this is known before anything is computed.
    """
    if placing.scale_m is not None or placing.local:
        return None
    heights = {n: p for n, p in photos.items() if p.position is not None and p.position.height_m is not None}
    if control is not None:
        try:
            return gnss_places(heights, control[1]) if heights and not control[1].is_local else None
        except CatalogError:
            return None
    if len(heights) < FEWEST:
        what = "no GNSS positions" if not photos else f"only {len(heights)} usable GNSS positions with heights"
        raise CatalogError(f"the photographs have {what}: place and scale are unknown", remedy=REMEDY)
    return gnss_places(heights, resolve(placing.crs or utm(list(heights.values()))))


def place(
    images: Sequence[OrientedImage],
    xyz: FloatArray,
    gnss: GnssPlaces | None,
    placing: Placing,
    control: tuple[ControlPoints, Reference] | None,
) -> Placed:
    """Lead a mapped model to its CRS.

    Parameters
    ----------
    images, xyz : of the model;  gnss : as `known_positions` has them
    control : as `known_control` has it; marks by the images' names

    Raises
    ------
    CatalogError
        Too few control points or positions, or control points lie on a line.
    """
    if control is not None and (gnss is None or _held(images, control[0]) >= FEWEST):
        return _by_control(images, xyz, *control)
    if gnss is None:
        height = placing.scale_m or LOCAL_HEIGHT_M
        known = (
            f"scale by {height:g} m over the ground"
            if placing.scale_m
            else "of unknown scale: 100 m over the ground are assumed"
        )
        line = f"Local frame {known}; level at the ground, in no CRS"
        figures = {"by": "scale" if placing.scale_m else "local", "height_m": height}
        return _moved(images, xyz, levelled(images, xyz, height), "local", figures, (line,))
    return _by_gnss(images, xyz, gnss)


def _held(images: Sequence[OrientedImage], control: ControlPoints) -> int:
    """Control points whose places the images have."""
    holding = [p for p in control.points if p.role is Role.CONTROL]
    return int(np.isfinite(seen_places(images, holding)).all(axis=1).sum())


def _moved(
    images: Sequence[OrientedImage], xyz: FloatArray, by: Similarity, crs: str, figures: Mapping[str, Any], lines: tuple[str, ...]
) -> Placed:  # fmt: skip
    return Placed(placed(images, by), by.moved(xyz), crs, figures, lines)


def _by_control(
    images: Sequence[OrientedImage], xyz: FloatArray, control: ControlPoints, reference: Reference
) -> Placed:
    places = seen_places(images, control.points)
    seen = [k for k, p in enumerate(places) if np.isfinite(p).all()]
    held = [k for k in seen if control.points[k].role is Role.CONTROL]
    unseen = [p.name for k, p in enumerate(control.points) if k not in seen]
    if len(held) < FEWEST:
        problem = f"{len(held)} control points are marked in two oriented images or more, {FEWEST} are needed"
        raise CatalogError(
            problem, where="--control", remedy=f"mark more of them ({listing(unseen) or 'none is left'})"
        )
    points = [control.points[k] for k in held]
    try:
        first = robust_fit(places[held], control.coordinates[held], 0.0)
        pixel = first.similarity.scale * _pixel(images, xyz)
        sigma = max((max(p.sigmas_m) for p in points if p.sigmas_m is not None), default=0.0)
        found = control_fit(places[held], points, max(LEAST_PX * pixel, LEAST_PX * sigma))
    except ValueError as error:
        raise CatalogError(
            f"control points: {error}", where="--control", remedy="give points that span the area"
        ) from error
    by = found.fit.similarity
    left = by.moved(places) - control.coordinates
    used = {points[k].name for k in np.flatnonzero(found.fit.used)}
    rows = [_row(control.points[k], left[k], control.points[k].name in used) for k in seen]
    checks = np.array([left[k] for k in seen if control.points[k].role is Role.CHECK]).reshape(-1, 3)
    figures = {
        "by": "control points", "points": rows, "not_seen": unseen, "exchanged": list(found.exchanged or ()),
        "contradicting": list(found.wrong), "control_rms_m": rounded(found.fit.rms, 4),
        "check_rms_m": [rounded(float(v), 4) for v in np.sqrt(np.mean(checks**2, axis=0))] if len(checks) else None,
        "pixel_m": rounded(pixel, 4),
    }  # fmt: skip
    lines = [
        *control.notes,
        f"Placed by {len(used)} control points: residuals {found.fit.rms:.3f} m per axis ({pixel:.3f} m a pixel)",
    ]
    if len(checks):
        x, y, z = np.sqrt(np.mean(checks**2, axis=0))
        lines.append(
            f"{len(checks)} check points: {np.hypot(x, y):.3f} m in plan, {z:.3f} m in height (root mean square)"
        )
    if found.exchanged:
        lines.append(
            f"Control points {' and '.join(found.exchanged)} are exchanged: each fits the other's coordinates; neither is used → correct them"
        )
    if found.wrong:
        lines.append(
            f"Control points that contradict the others are not used: {listing(found.wrong)} → check their coordinates and marks"
        )
    if unseen:
        lines.append(f"Points that fewer than two oriented images show are not used: {listing(unseen)}")
    wrong = dict.fromkeys(found.wrong, "it contradicts the other control points")
    wrong |= dict.fromkeys(found.exchanged or (), "its coordinates are exchanged with another one's")
    return replace(_moved(images, xyz, by, reference.code, figures, tuple(lines)), wrong=wrong)


def _row(point: ControlPoint, left: FloatArray, used: bool) -> dict[str, Any]:
    return {
        "name": point.name,
        "role": str(point.role),
        "used": used,
        "residual_m": [rounded(float(v), 4) for v in left],
    }


def _pixel(images: Sequence[OrientedImage], xyz: FloatArray) -> float:
    """What a pixel measures on the ground, in the frame of the images, in the median."""
    middle = np.median(xyz, axis=0)
    return float(np.median([np.linalg.norm(i.centre - middle) / np.sqrt(i.camera.fx * i.camera.fy) for i in images]))


def _by_gnss(images: Sequence[OrientedImage], xyz: FloatArray, gnss: GnssPlaces) -> Placed:
    found = placed_by_gnss(images, xyz, gnss, REMEDY)
    fit, code = found.fit, gnss.reference.code
    away = np.linalg.norm(fit.residuals, axis=1)
    far = {images[k].name: rounded(float(a), 2) for k, a, u in zip(found.images, away, fit.used, strict=True) if not u}
    plan, up = (float(np.sqrt(np.mean(fit.residuals[fit.used][:, axes] ** 2))) for axes in ([0, 1], [2]))
    figures = {
        "by": GNSS, "positions": len(away), "used": int(fit.used.sum()), "plan_rms_m": rounded(plan, 3), "height_rms_m": rounded(up, 3),
        "left_out": far, "roll": found.roll,
    }  # fmt: skip
    lines = [
        *gnss.notes,
        f"Placed by {int(fit.used.sum())} {GNSS} in {code}: they differ by {plan:.2f} m per axis in plan and {up:.2f} m in height; "
        f"heights count from: {gnss.heights}",
    ]
    if found.roll:
        lines.append(f"{GNSS} lie on one line, which leaves the roll about it open: {found.roll}")
    if far:
        lines.append(f"{GNSS} that contradict the others are not used: {listing(list(far))}")
    put = _moved(images, xyz, fit.similarity, code, figures, tuple(lines))
    return replace(put, unused=frozenset(far), on_line=bool(found.roll))
