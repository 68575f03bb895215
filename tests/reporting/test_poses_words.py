"""What is said of the poses that a run uses."""

from __future__ import annotations

from cityflow.adjustment.relative_error import RelativeError
from cityflow.reporting.poses_words import lines_of_poses, row_of_poses
from cityflow.runs.poses_note import SettledPoses
from cityflow.runs.settled_poses import sample_figures

NAN = float("nan")


def _told(error: RelativeError, problem: str = "") -> list[str]:
    found = SettledPoses("", False, sample_figures(error, 9), problem=problem, is_final=not problem)
    return list(lines_of_poses(found))


def test_a_sample_is_told_in_a_line() -> None:
    assert "which is not significant" in _told(RelativeError(0.1, 0.05, 0.4, NAN, 6, 6, 900))[0]
    assert "contradict each other by 0.60 px" in _told(RelativeError(0.6, 0.05, 0.4, 1.2, 6, 6, 900))[0]
    assert "nobody knows how exact they are" in _told(RelativeError(0, 0, 0, NAN, 6, 0, 0))[0]
    assert "2 of 6 pairs of 9 images have ties" in _told(RelativeError(0.1, 0.05, 0.4, NAN, 6, 2, 90))[0]


def test_what_could_not_be_adjusted_is_said_with_what_follows() -> None:
    told = _told(RelativeError(0.6, 0.05, 0.4, NAN, 6, 6, 900), "no two images see the same ground")
    assert told[1].startswith("Poses stay as given, as they could not be adjusted: no two images")
    assert told[1].endswith("the next run tries again")
    assert row_of_poses(None) is None
