"""What is wrong in the metadata of a flight's photographs, with the names of the files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.photo_metadata import PhotoMetadata
from cityflow.orientation.plausibility import SURVEY, Doubt

NO_PLACE_DEG = 1e-6
"""Receivers without a fix write 0, 0."""
SAME_DEG = 1e-7
"""A centimetre: no flight stands so still."""
DEGREE_M = 111_000.0
"""Metres of a degree of latitude."""
FAR_TIMES, FAR_M = 25.0, 1000.0
"""A place this many times farther from the middle than half of the others, and at least so far, is of another flight; set by hand."""
MOST_FOCAL = 0.05
"""Share by which two focal lengths of a file may differ: equivalents of 35 mm are rounded to whole millimetres; set by hand."""
MOST_NAMED = 5
"""Files that a finding about many names."""


def photo_doubts(photos: Sequence[PhotoMetadata]) -> list[Doubt]:
    """Findings, first of all photographs, then of single ones, each by the order of names.

    Parameters
    ----------
    photos : of one survey, in any order
    """
    ordered = sorted(photos, key=lambda p: p.name)
    placed = [p for p in ordered if p.position is not None]
    zero = [p for p in placed if _is_zero(p)]
    known = [p for p in placed if not _is_zero(p)]
    doubts: list[Doubt] = []
    if len(placed) < len(ordered):
        doubts.append(
            _of_many(
                [p for p in ordered if p.position is None],
                ordered,
                "no GNSS position",
                "their pairs are found by the pictures alone",
            )
        )
    if zero:
        doubts.append(
            _of_many(
                zero, ordered, "the GNSS position is 0, 0: the receiver had none", "they count as without a position"
            )
        )
    return doubts + _constant(known) + _away(known) + _cameras(ordered) + _pictures(ordered)


def usable_position(photo: PhotoMetadata) -> bool:
    """True where a photograph has a GNSS position that is not 0, 0."""
    return photo.position is not None and not _is_zero(photo)


def usable_positions(photos: Sequence[PhotoMetadata]) -> frozenset[str]:
    """Names of the photographs of one survey whose GNSS positions can be true: not 0, 0, not stuck, not far from all others."""
    known = sorted((p for p in photos if usable_position(p)), key=lambda p: p.name)
    stuck = {p.name for group in _stuck(known) for p in group}
    moving = [p for p in known if p.name not in stuck]
    far = _far(moving) if len(moving) >= 3 else np.zeros(len(moving), bool)
    return frozenset(p.name for p, away in zip(moving, far, strict=True) if not away)


def _is_zero(photo: PhotoMetadata) -> bool:
    p = photo.position
    return p is not None and abs(p.latitude) < NO_PLACE_DEG and abs(p.longitude) < NO_PLACE_DEG


def _of_many(some: Sequence[PhotoMetadata], all_of_them: Sequence[PhotoMetadata], problem: str, remedy: str) -> Doubt:
    names = [p.name for p in some]
    if len(names) == 1:
        return names[0], problem, remedy
    listed = ", ".join(names[:MOST_NAMED]) + (f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else "")
    return SURVEY, f"{len(names)} of {len(all_of_them)} photographs: {problem} ({listed})", remedy


def _degrees(photos: Sequence[PhotoMetadata]) -> FloatArray:
    """(N, 2) latitude and longitude."""
    return np.array([(p.position.latitude, p.position.longitude) for p in photos if p.position is not None]).reshape(
        -1, 2
    )


def _constant(photos: Sequence[PhotoMetadata]) -> list[Doubt]:
    """Positions that several photographs share."""
    remedy = "the receiver had stopped: they count as without a position"
    return [_of_many(g, photos, "the GNSS position is the same in all of them", remedy) for g in _stuck(photos)]


def _stuck(photos: Sequence[PhotoMetadata]) -> list[list[PhotoMetadata]]:
    """Photographs that share a position, as a receiver that has stopped writes it."""
    groups: dict[tuple[int, int], list[PhotoMetadata]] = {}
    for photo, place in zip(photos, _degrees(photos), strict=True):
        groups.setdefault((round(place[0] / SAME_DEG), round(place[1] / SAME_DEG)), []).append(photo)
    # heads of one camera system fire together: as many photographs as there are cameras may stand in one place
    heads = len({p.camera_key for p in photos})
    return [g for g in groups.values() if len(g) > max(2, heads) and len({p.taken for p in g}) > 1]


def _away(photos: Sequence[PhotoMetadata]) -> list[Doubt]:
    """Positions far from the others; those that would be near with latitude and longitude exchanged are named as such."""
    if len(photos) < 3:
        return []
    places = _degrees(photos)
    middle, scale, distance, limit = _around(places)
    doubts: list[Doubt] = []
    for photo, place, far in zip(photos, places, distance, strict=True):
        if far <= limit:
            continue
        swapped = float(np.linalg.norm((place[::-1] - middle) * scale)) <= limit
        reason = f"its GNSS position {place[0]:.5f}, {place[1]:.5f} is {far / 1000:,.0f} km from the others"
        doubts.append(
            (
                photo.name,
                f"{reason}; latitude and longitude are exchanged",
                "exchange them, or it counts as without a position",
            )
            if swapped
            else (photo.name, reason, "leave it out, or it counts as without a position")
        )
    return doubts


def _around(places: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """The middle of (N, 2) places in degrees, metres a degree, (N,) distances from it, and what is too far, metres."""
    middle = np.median(places, axis=0)
    scale = np.array([1.0, np.cos(np.radians(middle[0]))]) * DEGREE_M
    distance = np.linalg.norm((places - middle) * scale, axis=1)
    return middle, scale, distance, max(FAR_TIMES * float(np.median(distance)), FAR_M)


def _far(photos: Sequence[PhotoMetadata]) -> BoolArray:
    """(N,) which positions are far from the others."""
    _, _, distance, limit = _around(_degrees(photos))
    return np.asarray(distance > limit)


def _cameras(photos: Sequence[PhotoMetadata]) -> list[Doubt]:
    """A camera, or its zoom, that changes midway; several that take turns are heads of a system."""
    by_time = sorted(photos, key=lambda p: (p.taken, p.name))
    keys = [p.camera_key for p in by_time]
    changes = [i for i in range(1, len(keys)) if keys[i] != keys[i - 1]]
    counts = Counter(keys)
    if not changes or len(changes) > 2 * len(counts):
        return []
    shown = ", ".join(
        f"{by_time[i].name} ({_camera_of(by_time[i])} after {_camera_of(by_time[i - 1])})" for i in changes[:MOST_NAMED]
    )
    return [
        (SURVEY, f"the camera changes at {shown}", "each camera is calibrated by itself; check that it is one survey")
    ]


def _camera_of(photo: PhotoMetadata) -> str:
    focal = f" {photo.focal_mm:g} mm" if photo.focal_mm else ""
    name = f"{photo.make} {photo.model}".strip() or "unknown camera"
    return f"{name}{f' no. {photo.serial}' if photo.serial else ''}{focal}, {photo.width} × {photo.height}"


def _pictures(photos: Sequence[PhotoMetadata]) -> list[Doubt]:
    turned = [p for p in photos if p.orientation != 1]
    rolling = [p for p in photos if p.shutter == "rolling"]
    blind = [p for p in photos if p.focal_px is None]
    odd = [p for p in photos if focal_is_doubtful(p)]
    found = (
        (turned, "the orientation tag turns the picture", "image coordinates are those of the pixels as stored; remove the tag, or store the picture turned"),
        (rolling, "taken with a rolling shutter, which shifts rows against each other while the camera moves", "fly slowly, or use a mechanical shutter"),
        (blind, "no focal length that can be used", "it is estimated, or give it"),
        (odd, "two focal lengths in the file contradict each other", "the focal length is estimated; give it if you know it"),
    )  # fmt: skip
    return [_of_many(some, photos, problem, remedy) for some, problem, remedy in found if some]


def focal_is_doubtful(photo: PhotoMetadata) -> bool:
    """Whether the focal lengths in the file contradict each other."""
    return _focal_gap(photo) > MOST_FOCAL


def _focal_gap(photo: PhotoMetadata) -> float:
    """Share by which the focal length by the sensor's width differs from the one by 35 mm film; 0 where one is missing."""
    if not (photo.focal_mm and photo.sensor_width_mm and photo.focal_35mm and photo.width):
        return 0.0
    by_sensor = photo.focal_mm / photo.sensor_width_mm * photo.width
    by_film = photo.focal_35mm / 36.0 * max(photo.width, photo.height)
    return abs(by_film / by_sensor - 1)
