from __future__ import annotations

from dataclasses import replace

import pytest

from cityflow.core.photo_metadata import GnssPosition, PhotoMetadata
from cityflow.orientation.photo_doubts import photo_doubts, usable_position
from cityflow.orientation.plausibility import SURVEY


def _flight(count: int = 12, heads: int = 1) -> list[PhotoMetadata]:
    """Photographs every 30 m along a line north of Delft, perhaps with several heads."""
    return [
        PhotoMetadata(
            f"{head}_{i:02d}.jpg", 4000, 3000, "DJI", "P1", f"no{head}", f"2024:05:17 12:00:{i:02d}", 1, 35.0, 35, 36.0,
            position=GnssPosition(52.01 + i * 3e-4, 4.36, 100.0),
        )
        for i in range(count)
        for head in range(heads)
    ]  # fmt: skip


def _at(photo: PhotoMetadata, latitude: float, longitude: float) -> PhotoMetadata:
    return replace(photo, position=GnssPosition(latitude, longitude, 100.0))


@pytest.mark.parametrize("heads", [1, 5])
def test_a_plain_flight_has_no_findings(heads: int) -> None:
    assert photo_doubts(_flight(heads=heads)) == []


def test_no_position_and_none_at_all() -> None:
    photos = _flight()
    photos[3] = _at(photos[3], 0.0, 0.0)
    photos[5] = replace(photos[5], position=None)
    first, second = photo_doubts(photos)
    assert first[:2] == ("0_05.jpg", "no GNSS position")
    assert second[0] == "0_03.jpg"
    assert "0, 0" in second[1]
    assert [usable_position(p) for p in photos[3:6]] == [False, True, False]


def test_a_receiver_that_stopped() -> None:
    photos = _flight()
    photos[4:] = [_at(p, 52.0112, 4.36) for p in photos[4:]]
    ((where, problem, _),) = photo_doubts(photos)
    assert where == SURVEY
    assert problem.startswith("8 of 12 photographs: the GNSS position is the same in all of them (0_04.jpg, 0_05.jpg,")
    assert problem.endswith("and 3 more)")


def test_exchanged_and_far_positions() -> None:
    photos = _flight()
    photos[2] = _at(photos[2], 4.36, 52.0106)
    photos[7] = _at(photos[7], 48.0, 11.0)
    first, second = photo_doubts(photos)
    assert first[0] == "0_02.jpg"
    assert "latitude and longitude are exchanged" in first[1]
    assert second[0] == "0_07.jpg"
    assert "48.00000, 11.00000 is 6" in second[1]
    assert "exchanged" not in second[1]


def test_another_camera_midway() -> None:
    photos = _flight()
    photos[6:] = [replace(p, model="M3E", width=5280) for p in photos[6:]]
    found = photo_doubts(photos)
    assert found[0][0] == SURVEY
    assert "the camera changes at 0_06.jpg (DJI M3E no. no0 35 mm, 5280 × 3000 after DJI P1" in found[0][1]


def test_pictures_that_are_turned_rolled_or_without_a_focal_length() -> None:
    photos = [replace(p, orientation=6, shutter="rolling") for p in _flight()]
    photos[1] = replace(photos[1], focal_mm=None, focal_35mm=None)
    photos[2] = replace(photos[2], focal_35mm=50)
    found = {problem.partition(": ")[2] or problem: where for where, problem, _ in photo_doubts(photos)}
    assert any("orientation tag" in p for p in found)
    assert any("rolling shutter" in p for p in found)
    assert found["no focal length that can be used"] == "0_01.jpg"
    assert found["two focal lengths in the file contradict each other"] == "0_02.jpg"
