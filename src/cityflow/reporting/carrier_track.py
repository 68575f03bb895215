"""The track of the carrier of a sequence: the chosen frames that have a pose, in the order of their times, as a line and as points."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Scalar
from cityflow.core.camera import OrientedImage
from cityflow.core.json_values import rounded
from cityflow.handover.sequence_files import OtherFrame
from cityflow.io.tables.outlines_gpkg import Layer

TRACK = "track.gpkg"
LINE, STEPS, POINTS = "track", "track_steps", "frames"
GAP_S = 1.0
"""A gap that is longer is told; set by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class CarrierTrack:
    """Where the carrier was.

    Attributes
    ----------
    images : with their poses, in the order of the times;  times_s : (N,) since the start of the sequence;  numbers : of the frames
    knots_s, knots : (K,) times and (K, 3) places along the line through them, with those of frames between them, world metres
    """

    images: tuple[OrientedImage, ...]
    times_s: FloatArray
    numbers: tuple[int, ...]
    knots_s: FloatArray
    knots: FloatArray

    @property
    def places(self) -> FloatArray:
        """(N, 3) projection centres, world metres."""
        return np.array([i.centre for i in self.images]).reshape(-1, 3)

    @property
    def length_m(self) -> float:
        """In space."""
        return float(np.linalg.norm(np.diff(self.places, axis=0), axis=1).sum())


def carrier_track(
    images: Sequence[OrientedImage], frames: Mapping[str, Mapping[str, Any]], between: Iterable[OtherFrame] = ()
) -> CarrierTrack:
    """Of the images with a pose.

    Parameters
    ----------
    frames : name of an image → its ``time_s`` and its ``number``
    between : frames that are no images; those count that lie between two images with a pose which follow each other
    """
    known = sorted((i for i in images if i.name in frames), key=lambda i: (frames[i.name]["time_s"], i.name))
    times = [float(frames[i.name]["time_s"]) for i in known]
    numbers = [int(frames[i.name]["number"]) for i in known]
    taken = sorted(int(f["number"]) for f in frames.values())
    after = dict(pairwise(taken))
    place = dict(zip(numbers, (i.centre for i in known), strict=True))
    knots = list(zip(times, place.values(), strict=True))
    for other in between:
        one, next_one = place.get(other.after), place.get(after.get(other.after, -1))
        if one is not None and next_one is not None:
            knots.append((other.time_s, one + other.share * (next_one - one)))
    knots.sort(key=lambda k: k[0])
    return CarrierTrack(
        tuple(known), np.array(times), tuple(numbers), np.array([t for t, _ in knots]), np.array([p for _, p in knots]).reshape(-1, 3)
    )  # fmt: skip


def track_layers(track: CarrierTrack, name: str) -> list[Layer]:
    """The whole line; its parts with times and speed; a point with its look direction for each image.

    Parameters
    ----------
    name : of the video or the folder
    """
    places, times = track.places, [float(t) for t in track.times_s]
    whole: dict[str, Scalar] = {
        "sequence": name, "start_s": times[0] if times else None, "end_s": times[-1] if times else None,
        "length_m": round(track.length_m, 3), "images": len(times),
    }  # fmt: skip
    lines = [shapely.LineString(places)] if len(places) > 1 else []
    steps = list(zip(pairwise(track.knots), pairwise(track.knots_s.tolist()), strict=True))
    rows: list[dict[str, Scalar]] = [
        {"start_s": s, "end_s": e, "speed_ms": _speed(p, q, e - s)} for (p, q), (s, e) in steps
    ]
    frames: list[dict[str, Scalar]] = [
        {"image": i.name, "frame": n, "time_s": t, **_look(i)}
        for i, n, t in zip(track.images, track.numbers, times, strict=True)
    ]
    return [
        Layer(LINE, lines, [whole] * len(lines), "LineString Z"),
        Layer(STEPS, [shapely.LineString(ends) for ends, _ in steps], rows, "LineString Z"),
        Layer(POINTS, [shapely.Point(p) for p in places], frames, "Point Z"),
    ]


def _speed(one: FloatArray, other: FloatArray, seconds: float) -> float | None:
    return round(float(np.linalg.norm(other - one)) / seconds, 3) if seconds > 0 else None


def _look(image: OrientedImage) -> dict[str, float]:
    """Degrees clockwise from grid north, and below the horizon; of one that looks straight down, the azimuth of the upper edge."""
    axis = image.axis
    level = axis[:2] if np.hypot(*axis[:2]) > 1e-3 else -image.rotation[1, :2]
    azimuth = float(np.degrees(np.arctan2(level[0], level[1]))) % 360.0
    return {
        "azimuth_deg": round(azimuth, 3),
        "below_horizon_deg": round(float(np.degrees(np.arcsin(np.clip(-axis[2], -1, 1)))), 3),
    }


def track_figures(track: CarrierTrack) -> dict[str, Any]:
    """For orientation.json."""
    steps = np.diff(track.knots_s)
    seconds = float(track.times_s[-1] - track.times_s[0]) if len(track.images) else 0.0
    longest = int(np.argmax(steps)) if len(steps) else 0
    gap = bool(len(steps)) and float(steps[longest]) > GAP_S
    return {
        "length_m": rounded(track.length_m, 2), "seconds": rounded(seconds, 3),
        "gap_s": [rounded(float(track.knots_s[longest + n]), 3) for n in (0, 1)] if gap else None,
    }  # fmt: skip


def track_lines(report: Mapping[str, Any]) -> Iterator[str]:
    """What is said of it to people; nothing where there is no sequence."""
    sequence = report.get("sequence")
    if sequence is None:
        return
    track = sequence["track"]
    speed = f", {track['length_m'] / track['seconds']:.1f} m/s" if track["seconds"] else ""
    yield f"Track of {sequence['name']}: {track['length_m']:.1f} m in {track['seconds']:.1f} s{speed} ({TRACK})"
    if track["gap_s"]:
        yield f"Between {track['gap_s'][0]:.2f} and {track['gap_s'][1]:.2f} s no frame says where the carrier was: the track is straight there"
