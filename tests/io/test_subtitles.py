"""Positions in subtitles as drones write them."""

from __future__ import annotations

from pathlib import Path

import pytest

from cityflow.core.photo_metadata import GnssPosition
from cityflow.errors import CatalogError
from cityflow.io.images.subtitles import CarrierPosition, position_at, read_subtitles, subtitles_of, subtitles_text

BRACKETS = """1
00:00:00,000 --> 00:00:00,033
<font size="28">FrameCnt: 1, DiffTime: 33ms
2026-06-21 10:00:00.123
[iso: 100] [shutter: 1/640.0] [latitude: 48.137400] [longitude: 11.576100] [rel_alt: 30.100 abs_alt: 560.200] </font>

2
00:00:00,033 --> 00:00:00,066
[latitude: 48.137400] [longitude: 11.576100] [rel_alt: 30.100 abs_alt: 560.200]

3
00:00:02,000 --> 00:00:02,033
[latitude: 48.137600] [longtitude: 11.576300] [rel_alt: 32.100 abs_alt: 562.200]
"""
PLAIN = """1
00:00:01,000 --> 00:00:02,000
HOME(11.5760,48.1370) 2026.06.21 10:00:01
GPS(11.5761,48.1374,19) BAROMETER:30.5
ISO:100 Shutter:640 EV: Fnum:F2.8

2
00:01:02,500 --> 00:01:03,000
GPS (11.5762, 48.1375, 19) BAROMETER: 31.5
"""


def _written(folder: Path, text: str) -> Path:
    path = folder / "flight.SRT"
    path.write_text(text)
    return path


def test_two_ways_of_writing(tmp_path: Path) -> None:
    first, last = read_subtitles(_written(tmp_path, BRACKETS))
    # a cue without a new position is no observation
    assert (first.time_s, last.time_s) == (0.0, 2.0)
    assert first.position == GnssPosition(48.1374, 11.5761, 560.2)
    assert last.position == GnssPosition(48.1376, 11.5763, 562.2)
    assert last.above_start_m == 32.1
    first, last = read_subtitles(_written(tmp_path, PLAIN))
    # the third number counts satellites
    assert first == CarrierPosition(1.0, GnssPosition(48.1374, 11.5761), 30.5)
    assert last.time_s == 62.5


def test_positions_between_cues(tmp_path: Path) -> None:
    known = read_subtitles(_written(tmp_path, BRACKETS))
    between = position_at(known, 0.5)
    assert between is not None
    assert between.position.latitude == pytest.approx(48.13745)
    assert between.position.height_m == pytest.approx(560.7)
    assert position_at(known, 2.1) is None
    assert position_at((), 1.0) is None
    far = read_subtitles(_written(tmp_path, PLAIN))
    assert position_at(far, 30.0) is None


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    known = [CarrierPosition(k / 12.5, GnssPosition(48 + 1e-5 * k, 11.5, 100.0 + k), 50.0 + k) for k in range(5)]
    path = _written(tmp_path, subtitles_text(known, 12.5))
    assert list(read_subtitles(path)) == known
    assert subtitles_of(tmp_path / "flight.mp4") == path
    assert subtitles_of(tmp_path / "other.mp4") is None


def test_other_text_is_refused_and_subtitles_without_positions_have_none(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="no subtitles: no line with times") as refused:
        read_subtitles(_written(tmp_path, "all of it"))
    assert "remove it" in refused.value.remedy
    assert read_subtitles(_written(tmp_path, "1\n00:00:01,000 --> 00:00:02,000\nHello\n")) == ()
