"""Orientations that cannot be true: what is odd, of which image, and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.orientation.look_directions import look_directions
from cityflow.orientation.rotation_doubts import likely_reading
from cityflow.orientation.sights import HORIZON_DEG, looks_level
from cityflow.orientation.views import View, footprints

Doubt = tuple[str, str, str]
"""Name of the image, or `SURVEY`; what is odd; what to do."""
SURVEY = "survey"

FAR_TIMES = 25.0
"""A centre this many times farther from the middle of the survey than half of the others is no part of it; set by hand."""
NEIGHBOURS = 6
"""Nearest centres of the same look direction whose footprints one should meet; set by hand."""
FEET = 0.3048
"""Metres a foot (international)."""


def implausible(
    images: Sequence[OrientedImage], ground: float | None = None, highest: float | None = None, *, angles_known: bool = False
) -> list[Doubt]:  # fmt: skip
    """What is odd in a survey's orientations; first what concerns all of it, then image by image in the order of names.

    Parameters
    ----------
    images : in any order
    ground : height of the ground, world metres, if it is known; without it nothing is said of heights and footprints
    highest : of all objects, world metres, if it is known; what looks level from below it are photographs from the street
    angles_known : pictures agree with the rotations, however odd the flight looks
    """
    ordered = sorted(images, key=lambda image: image.name)
    if not ordered:
        return []
    flown = [i for i in ordered if highest is None or not looks_level(i, highest)]
    doubts = [
        (SURVEY, *doubt)
        for doubt in (likely_reading(flown) if flown and not angles_known else None, _one_place(ordered))
        if doubt
    ]
    turned_all = any("horizon" in reason for _, reason, _ in doubts)
    doubts += _no_rotation(ordered) + _far_away(ordered) + ([] if turned_all else _looks_up(flown))
    if ground is not None:
        low = _below(ordered, ground)
        doubts += low
        if not turned_all and not low:
            doubts += _never_meeting(flown, ground)
    return doubts


def datum_doubt(points: FloatArray, reference: FloatArray, radius: float = 30.0) -> Doubt | None:
    """Whether two sets of heights of the same ground belong to different datums or units.

    Parameters
    ----------
    points : (N, 3) what the images say of the ground, e.g. low sparse points, world metres
    reference : (M, 3) what the catalog says: ground points, feet of outlines, world metres
    radius : of each other heights are compared, metres

    Returns
    -------
    None where heights agree, or where too few points are near each other to say.
    """
    if len(points) == 0 or len(reference) == 0:
        return None
    distance, nearest = cKDTree(reference[:, :2]).query(points[:, :2], distance_upper_bound=radius)
    near = np.isfinite(distance)
    if near.sum() < 10:
        return SURVEY, "the images' points are nowhere near the given heights", "check the CRS and the origin of both"
    z, known = points[near, 2], reference[nearest[near], 2]
    shift = float(np.median(z - known))
    spread = 1.4826 * float(np.median(np.abs(z - known - shift)))
    if abs(shift) <= max(8.0, 4 * spread):
        return None
    reason = f"the images' points lie {abs(shift):.1f} m {'above' if shift > 0 else 'below'} the given heights (NMAD {spread:.1f} m)"
    for factor in (FEET, 1 / FEET):
        if abs(float(np.median(z * factor - known))) < 0.05 * abs(shift) and abs(float(np.median(known))) > 3:
            return SURVEY, reason, "one of them may be in feet: convert it to metres"
    remedy = "heights above the ellipsoid and above the geoid differ like that: name the vertical datum of both"
    return SURVEY, reason, remedy if abs(shift) < 120 else "check the vertical datum, the unit and the origin of both"


def _one_place(images: Sequence[OrientedImage]) -> tuple[str, str] | None:
    centres = np.array([image.centre for image in images])
    if len(images) < 2 or np.ptp(centres, axis=0).max() > 1e-3:
        return None
    return "all images were taken from one place, so no depth can be measured", "check the positions of the images"


def _no_rotation(images: Sequence[OrientedImage]) -> list[Doubt]:
    rotations = np.array([image.rotation for image in images])
    off = np.abs(rotations @ np.swapaxes(rotations, 1, 2) - np.eye(3)).max(axis=(1, 2))
    mirrored = np.linalg.det(rotations) < 0
    doubts = []
    for image, error, mirror in zip(images, off, mirrored, strict=True):
        if mirror:
            doubts.append(
                (image.name, "its rotation is a reflection", "one axis of the camera frame has the wrong sign")
            )
        elif not error <= 1e-4:
            doubts.append((image.name, f"its matrix is {error:.1g} off a rotation", "give the matrix with more digits"))
    return doubts


def _looks_up(images: Sequence[OrientedImage]) -> list[Doubt]:
    remedy = "leave it out, or check its rotation"
    tilts = ((image.name, np.degrees(image.tilt)) for image in images)
    return [
        (name, f"it looks {t:.0f}° away from nadir: at or above the horizon", remedy)
        for name, t in tilts
        if t > HORIZON_DEG
    ]


def _far_away(images: Sequence[OrientedImage]) -> list[Doubt]:
    """Images whose centres are far outside the survey: another CRS, swapped axes, a missing digit."""
    centres = np.array([image.centre for image in images])
    if len(images) < 4:
        return []
    distance = np.linalg.norm(centres - np.median(centres, axis=0), axis=1)
    limit = FAR_TIMES * max(float(np.median(distance)), 1.0)
    remedy = "check its position: the CRS, the order of x and y, the digits"
    return [
        (image.name, f"it was taken {d:,.0f} m from the middle of the survey, half of the images within {np.median(distance):,.0f} m", remedy)
        for image, d in zip(images, distance, strict=True)
        if d > limit
    ]  # fmt: skip


def _below(images: Sequence[OrientedImage], ground: float) -> list[Doubt]:
    low = [image for image in images if image.centre[2] <= ground]
    remedy = "check the vertical datum and unit of the positions, and the height of the ground"
    if len(low) > len(images) / 2:
        depth = float(np.median([ground - image.centre[2] for image in low]))
        return [
            (
                SURVEY,
                f"{len(low)} of {len(images)} images were taken below the ground, by {depth:,.0f} m in the median",
                remedy,
            )
        ]
    return [(i.name, f"it was taken {ground - i.centre[2]:,.1f} m below the ground", remedy) for i in low]


def _never_meeting(images: Sequence[OrientedImage], ground: float) -> list[Doubt]:
    """A survey in which most footprints meet none of their nearest neighbours': angles, positions or the ground are wrong."""
    if len(images) < 3:
        return []
    ground_of = dict(
        zip((i.name for i in images), footprints([View(image, (ground, ground)) for image in images]), strict=True)
    )
    centre_of = {image.name: image.centre[:2] for image in images}
    meets: list[bool] = []
    for frame in look_directions(images):
        if len(frame.images) > 2:
            area = np.array([ground_of[name] for name in frame.images])
            centres = np.array([centre_of[name] for name in frame.images])
            _, nearest = cKDTree(centres).query(centres, min(NEIGHBOURS + 1, len(centres)))
            meets += [bool(shapely.intersects(area[k], area[near[near != k]]).any()) for k, near in enumerate(nearest)]
    if np.mean(meets or [True]) >= 0.5:
        return []
    reason = f"the footprints of {1 - np.mean(meets):.0%} of the images meet none of the nearest that look alike"
    return [(SURVEY, reason, "check the rotations, the focal length in pixels, and the height of the ground")]
