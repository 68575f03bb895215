"""Rotations that cannot be meant as they were read: which other reading makes a plain flight of them.

A flight looks down, and its images stand along or across the way to the next image. Both are measured for the rotations as they are and for the
readings that are confused most often; a remedy is named only where one of them is clearly better.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.geometry.rotations import PHOTO_FLIP, from_omega_phi_kappa, from_phi_omega_kappa, omega_phi_kappa

STEEPEST = np.cos(np.radians(80.0))
"""An optical axis less than 10° below the horizon looks at no ground worth naming; set by hand."""
OBLIQUE_DEG = 20.0
"""Images tilted less say nothing of the horizon; set by hand."""
ENOUGH_IMAGES = 8
"""Of fewer images nothing is said; set by hand."""
DISORDER, ORDER = 0.85, 0.95
"""Squareness and levelness of a flight that is doubted (8° askew in the mean), and of a reading that explains it (5°); set by hand."""

GRAD, PHI_FIRST = "angles in grad (gon)", "phi-omega-kappa"


@dataclass(frozen=True, slots=True)
class Reading:
    """How rotations would look if they were read in another way.

    Attributes
    ----------
    remedy : what to do if this is how they are meant
    rotations : (N, 3, 3) camera_from_world
    what : the reading in a few words
    """

    remedy: str
    rotations: FloatArray
    what: str


def other_readings(images: Sequence[OrientedImage]) -> Iterator[Reading]:
    """The readings that are confused most often, the likeliest first."""
    as_read = np.array([image.rotation for image in images])
    transposed = np.swapaxes(as_read, 1, 2)
    way = _ways(images)
    yield Reading(
        "the angles look like grad (gon) given as degrees: set the angle unit to grad",
        np.array([_from_grad(r, w) for r, w in zip(as_read, way, strict=True)]),
        GRAD,
    )
    yield Reading(
        "the rotations look like world_from_camera given as camera_from_world: transpose them",
        transposed,
        "world_from_camera in the place of camera_from_world",
    )
    yield Reading(
        "the camera frame looks like x right, y up, z backward: name that convention, or turn the rows y and z over",
        PHOTO_FLIP @ as_read,
        "a camera frame of x right, y up, z backward",
    )
    yield Reading(
        "the rotations look like world_from_camera of a frame with y up and z backward: transpose them, then turn y and z over",
        PHOTO_FLIP @ transposed,
        "world_from_camera of a frame of x right, y up, z backward",
    )
    yield Reading(
        "the order of the angles looks like phi-omega-kappa given as omega-phi-kappa: set the rotation order",
        _with_angles(as_read, lambda o, p, k: from_phi_omega_kappa(p, o, k)),
        PHI_FIRST,
    )
    yield Reading(
        "the signs of omega and phi look turned: the angles rotate the world and not the camera",
        _with_angles(as_read, lambda o, p, k: from_omega_phi_kappa(-o, -p, -k)),
        "angles that rotate the world and not the camera (signs turned)",
    )
    yield Reading(
        "the order of the angles looks like phi-omega-kappa with phi counted the other way: turn the sign of phi, and set the rotation order",
        _with_angles(as_read, lambda o, p, k: from_phi_omega_kappa(-p, o, k)),
        "phi-omega-kappa with phi counted the other way",
    )


def looking_down(rotations: FloatArray) -> float:
    """Share of (N, 3, 3) rotations whose optical axis points below the horizon by 10° or more."""
    return float(np.mean(-rotations[:, 2, 2] >= STEEPEST))


def squareness(rotations: FloatArray, ways: FloatArray) -> float:
    """How well the images stand along or across the flight: 1 if all do, 0 if by chance.

    Parameters
    ----------
    rotations : (N, 3, 3) camera_from_world
    ways : (N,) direction to the next image in the plane, radians
    """
    heading = np.arctan2(rotations[:, 0, 1], rotations[:, 0, 0])
    return float(np.mean(np.cos(4 * (heading - ways))))


def levelness(rotations: FloatArray) -> float:
    """How level the horizon stands in oblique images, upright or on its side: 1 if it does, 0 if by chance; 1 where none is oblique."""
    oblique = rotations[-rotations[:, 2, 2] < np.cos(np.radians(OBLIQUE_DEG))]
    if len(oblique) < ENOUGH_IMAGES:
        return 1.0
    return float(np.mean(np.cos(4 * np.arctan2(oblique[:, 0, 2], oblique[:, 1, 2]))))


def likely_reading(images: Sequence[OrientedImage]) -> tuple[str, str] | None:
    """What is wrong with the rotations of the whole survey and what to do; None if they are a plain flight or nothing better is known."""
    if len(images) < 2:
        return None
    as_read, ways = np.array([image.rotation for image in images]), _ways(images)
    down = looking_down(as_read)
    if down < 0.5:
        reason = f"{1 - down:.0%} of the images look at or above the horizon"
        better = [r for r in other_readings(images) if looking_down(r.rotations) > max(0.9, down)]
        best = max(better, key=lambda r: round(_order(r.rotations, ways), 1), default=None)
        return reason, best.remedy if best else "check the order, signs and unit of the angles"
    if len(images) < ENOUGH_IMAGES or _order(as_read, ways) > DISORDER:
        return None
    for reading in other_readings(images):
        if looking_down(reading.rotations) >= down and _order(reading.rotations, ways) > ORDER:
            return _askew(as_read, ways), reading.remedy
    return None


def _order(rotations: FloatArray, ways: FloatArray) -> float:
    return min(squareness(rotations, ways), levelness(rotations))


def _askew(rotations: FloatArray, ways: FloatArray) -> str:
    square, level = squareness(rotations, ways), levelness(rotations)
    turn = np.degrees(np.arccos(np.clip(min(square, level), -1, 1)) / 4)
    what = (
        "the images are rotated against the flight direction"
        if square <= level
        else "the horizon is not level in the images"
    )
    return f"{what}, by about {turn:.0f}°"


def _ways(images: Sequence[OrientedImage]) -> FloatArray:
    """(N,) direction to the nearest other exposure in the plane, radians; cameras of one platform stand together and do not count."""
    centres = np.array([image.centre[:2] for image in images])
    several = min(len(images), 12)
    distance, number = cKDTree(centres).query(centres, several)
    spread = float(np.median(distance[:, -1])) if len(images) > 1 else 0.0
    apart = distance > 0.02 * max(spread, 1e-9)
    first = np.where(apart.any(axis=1), np.argmax(apart, axis=1), several - 1)
    step = centres[number[np.arange(len(images)), first]] - centres
    return np.asarray(np.arctan2(step[:, 1], step[:, 0]))


def _with_angles(rotations: FloatArray, build: Callable[[float, float, float], FloatArray]) -> FloatArray:
    return np.array([build(*omega_phi_kappa(r)) for r in rotations])


def _from_grad(rotation: FloatArray, way: float) -> FloatArray:
    """The rotation if its angles were grad.

    A full turn is 360° but 400 grad, so each angle has several readings: the one is taken that looks down, stands along the way and has a level horizon.
    """
    choices = []
    full = 2 * np.pi
    omega, phi, kappa = omega_phi_kappa(rotation)
    for o, p in ((omega, phi), (omega + np.pi, np.pi - phi)):
        k = kappa if o == omega else kappa + np.pi
        for turns in product((-1, 0, 1), repeat=3):
            angles = [a + full * n for a, n in zip((o, p, k), turns, strict=True)]
            if all(-full / 1.8 - 1e-9 <= a <= full / 0.9 + 1e-9 for a in angles):
                choices.append(from_omega_phi_kappa(*(0.9 * a for a in angles)))
    stack = np.array(choices)
    heading = np.arctan2(stack[:, 0, 1], stack[:, 0, 0])
    oblique = -stack[:, 2, 2] < np.cos(np.radians(OBLIQUE_DEG))
    level = np.where(oblique, np.cos(4 * np.arctan2(stack[:, 0, 2], stack[:, 1, 2])), 1.0)
    merit = np.where(-stack[:, 2, 2] >= STEEPEST, level + np.cos(4 * (heading - way)), -9.0)
    return np.asarray(stack[int(np.argmax(merit))])
