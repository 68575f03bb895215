"""Subtitles that drones write beside their videos (``.srt``): where the carrier was at which time.

Two ways of writing are read, a cue for each frame or each second::

    [latitude: 48.137400] [longitude: 11.576100] [rel_alt: 30.100 abs_alt: 560.200]
    GPS (11.5761, 48.1374, 19) BAROMETER: 30.5
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cityflow.core.photo_metadata import GnssPosition
from cityflow.errors import CatalogError

SUFFIXES = (".srt", ".SRT")
MOST_GAP_S = 5.0
"""Between two positions, above which nothing is interpolated; set by hand."""
_TIME = re.compile(r"(\d+):(\d\d):(\d\d)[,.](\d+)\s*-->")
_NUMBER = r"\s*:\s*(-?\d+(?:\.\d+)?)"
_LATITUDE, _LONGITUDE = re.compile("latitude" + _NUMBER, re.I), re.compile("longt?itude" + _NUMBER, re.I)
_ABOVE_START = re.compile("rel_alt" + _NUMBER, re.I)
_HEIGHTS = (re.compile("abs_alt" + _NUMBER, re.I), re.compile(r"\baltitude" + _NUMBER, re.I))
_GPS = re.compile(r"GPS\s*\(\s*(-?[\d.]+)\s*,\s*(-?[\d.]+)\s*(?:,\s*(-?[\d.]+)\s*M?\s*)?\)", re.I)
_BAROMETER = re.compile("barometer" + _NUMBER, re.I)


@dataclass(frozen=True, slots=True)
class CarrierPosition:
    """Seconds since the start of the video, the position, and the height over the place of take-off where it is stated."""

    time_s: float
    position: GnssPosition
    above_start_m: float | None = None


def subtitles_of(video: Path) -> Path | None:
    """The file beside a video with the same name; None where there is none."""
    return next((p for s in SUFFIXES if (p := video.with_suffix(s)).is_file()), None)


def read_subtitles(path: Path) -> tuple[CarrierPosition, ...]:
    """Positions in the order of their times; a receiver that updates less often than cues are written counts when it does.

    Raises
    ------
    CatalogError
        It is no file of subtitles. One without positions gives none.
    """
    text = path.read_bytes().decode("utf-8", errors="replace").replace("\r", "")
    cues = re.split(r"\n\s*\n", text)
    found: list[CarrierPosition] = []
    times = 0
    for cue in cues:
        time = _TIME.search(cue)
        if time is None:
            continue
        times += 1
        hours, minutes, seconds, fraction = time.groups()
        at = int(hours) * 3600 + int(minutes) * 60 + int(seconds) + float(f"0.{fraction}")
        known = _position(cue)
        if known is not None and (not found or known[0] != found[-1].position):
            found.append(CarrierPosition(at, *known))
    if not times:
        remedy = "remove it, or name it otherwise: the video is then taken without positions"
        raise CatalogError("no subtitles: no line with times", where=str(path), remedy=remedy)
    return tuple(sorted(found, key=lambda p: p.time_s))


def _position(cue: str) -> tuple[GnssPosition, float | None] | None:
    latitude, longitude = _LATITUDE.search(cue), _LONGITUDE.search(cue)
    above = _ABOVE_START.search(cue) or _BAROMETER.search(cue)
    over = float(above.group(1)) if above else None
    if latitude and longitude:
        height = next((float(m.group(1)) for e in _HEIGHTS if (m := e.search(cue))), None)
        return GnssPosition(float(latitude.group(1)), float(longitude.group(1)), height), over
    plain = _GPS.search(cue)
    if plain is None:
        return None
    # the third number counts satellites in some makes and metres in others
    return GnssPosition(float(plain.group(2)), float(plain.group(1))), over


def position_at(known: Sequence[CarrierPosition], time_s: float) -> CarrierPosition | None:
    """Between the two positions around a time; None outside of them, and where they are far apart.

    >>> known = [CarrierPosition(0.0, GnssPosition(48.0, 11.0, 100.0)), CarrierPosition(2.0, GnssPosition(48.2, 11.0, 110.0))]
    >>> position_at(known, 1.0).position.height_m
    105.0
    """
    times = np.array([k.time_s for k in known])
    after = int(np.searchsorted(times, time_s))
    if after < len(known) and times[after] == time_s:
        return known[after]
    if after in (0, len(known)) or times[after] - times[after - 1] > MOST_GAP_S:
        return None
    one, other = known[after - 1], known[after]
    share = (time_s - one.time_s) / (other.time_s - one.time_s)

    def between(a: float, b: float) -> float:
        return round(a + share * (b - a), 9)

    def where_both(a: float | None, b: float | None) -> float | None:
        return None if a is None or b is None else between(a, b)

    p, q = one.position, other.position
    place = GnssPosition(
        between(p.latitude, q.latitude), between(p.longitude, q.longitude), where_both(p.height_m, q.height_m)
    )
    return CarrierPosition(time_s, place, where_both(one.above_start_m, other.above_start_m))


def subtitles_text(positions: Iterable[CarrierPosition], rate: float) -> str:
    """Subtitles with a cue for each frame, as drones write them."""
    cues = []
    for number, known in enumerate(positions, 1):
        p = known.position
        times = f"{_clock(known.time_s)} --> {_clock(known.time_s + 1 / rate)}"
        place = f"[latitude: {p.latitude:.6f}] [longitude: {p.longitude:.6f}] [rel_alt: {known.above_start_m or 0.0:.3f} abs_alt: {p.height_m or 0.0:.3f}]"
        cues.append(f"{number}\n{times}\nFrameCnt: {number}, DiffTime: {1000 / rate:.0f}ms\n{place}\n")
    return "\n".join(cues)


def _clock(seconds: float) -> str:
    """
    >>> _clock(61.5)
    '00:01:01,500'
    """
    thousandths = round(seconds * 1000)
    return f"{thousandths // 3_600_000:02d}:{thousandths // 60_000 % 60:02d}:{thousandths // 1000 % 60:02d},{thousandths % 1000:03d}"
