"""Control points hold a block: it comes to where they are, check points tell so, and wrong points are named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from adjustment.scenes import CAMERA, PIXEL_M, Scene, disturbed, scene
from cityflow.adjustment.block import Block
from cityflow.adjustment.bundle import AdjustmentParameters
from cityflow.adjustment.control import control_of
from cityflow.adjustment.control_check import Agreement, ContradictionError, agreement
from cityflow.adjustment.refinement import refined
from cityflow.core.control_points import ControlPoint, Mark, Role
from cityflow.handover.known_points import control_points, known_points

SIGMA_M, SIGMA_PX = 0.01, 0.3


def _points(truth: Scene, controls: int, checks: int, seed: int) -> list[ControlPoint]:
    """Points in the corners and the middle, then anywhere, measured and marked with errors."""
    rng = np.random.default_rng(seed)
    corners = np.array([(4993.0, 1983.0), (5057.0, 2047.0), (5057.0, 1983.0), (4993.0, 2047.0), (5025.0, 2015.0)])
    xy = np.concatenate([corners[:controls], rng.uniform((4995, 1985), (5055, 2045), (checks, 2))])
    xyz = np.column_stack([xy, 15 * np.sin(xy[:, 0] / 9) * np.cos(xy[:, 1] / 12)])
    made = []
    for k, place in enumerate(xyz):
        marks = []
        for image in truth.images:
            uv, depth = image.project(place[None])
            if depth[0] > 0 and image.holds(uv, 5.0)[0]:
                col, row = (uv[0] + rng.normal(0, SIGMA_PX, 2)).tolist()
                marks.append(Mark(image.name, col, row, SIGMA_PX))
        role, name = (Role.CONTROL, f"C{k + 1}") if k < controls else (Role.CHECK, f"K{k + 1 - controls}")
        made.append(ControlPoint(name, place + rng.normal(0, SIGMA_M, 3), (SIGMA_M,) * 3, role, tuple(marks)))
    return made


def _moved(points: Sequence[ControlPoint], name: str, by: Sequence[float]) -> list[ControlPoint]:
    return [replace(p, xyz=p.xyz + np.array(by)) if p.name == name else p for p in points]


def _with_places(points: Sequence[ControlPoint], places: dict[str, np.ndarray]) -> list[ControlPoint]:
    return [replace(p, xyz=places.get(p.name, p.xyz)) for p in points]


def test_five_points_hold_a_block_of_poor_positions_and_unknown_cameras() -> None:
    """Positions are off by 1 m each and by 30 m in height together, the focal length by 1 %, the lens and the principal point are unknown."""
    truth = scene(22)
    sheet = replace(CAMERA, fx=1515.0, fy=1515.0, cx=600.0, cy=450.0, distortion=())
    up = np.array([0.0, 0.0, 30.0])
    given = [replace(i, camera=sheet, centre=i.centre + up) for i in disturbed(truth.images, 1.0, 2.6, seed=22)]
    found = refined(given, truth.ties, AdjustmentParameters(), _points(truth, 5, 6, seed=3))
    assert found.adjusted.calibrated
    assert found.is_taken
    off = np.array([i.centre - t.centre for i, t in zip(found.images, truth.images, strict=True)])
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 1.0 * PIXEL_M
    told = np.sqrt(np.einsum("nii->ni", found.covariances)[:, 3:])
    assert 0.3 < np.sqrt(np.mean((off / told) ** 2)) < 2.0
    assert found.images[0].camera.fx == pytest.approx(1500.0, rel=3e-4)
    figures = found.control
    assert figures is not None
    assert figures.shift_known
    assert figures.shift[2] == pytest.approx(-30.0, abs=0.7)
    plan, height = figures.rms(holds=False) or (np.inf, np.inf)
    assert plan < 0.7 * PIXEL_M
    assert height < 1.0 * PIXEL_M
    assert [p.problem for p in figures.points] == [""] * 11
    assert found.adjusted.position_sigma_m == pytest.approx(1.0, rel=0.3)


def test_a_wrong_point_does_not_bend_the_block_and_is_named() -> None:
    truth = scene(23)
    given = disturbed(truth.images, 0.1, 1.0, seed=5)
    points = _moved(_points(truth, 5, 3, seed=4), "C4", (0.0, 0.0, 0.25))
    found = refined(given, truth.ties, AdjustmentParameters(calibrate=False), points)
    figures = found.control
    assert figures is not None
    assert {p.name for p in figures.points if p.problem} == {"C4"}
    wrong = next(p for p in figures.points if p.name == "C4")
    assert wrong.off[2] == pytest.approx(-0.25, abs=0.08)
    _, height = figures.rms(holds=False) or (np.inf, np.inf)
    assert height < 1.0 * PIXEL_M


def _agreed(points: Sequence[ControlPoint], truth: Scene) -> Agreement:
    origin = np.array([5000.0, 2000.0, 0.0])
    block = Block.of(truth.images, origin)
    number = {i.name: k for k, i in enumerate(truth.images)}
    return agreement(control_of(points, number, origin), block, 1.0)


def test_points_that_are_swapped_or_of_another_datum_are_named() -> None:
    truth = scene(24)
    points = _points(truth, 5, 2, seed=6)
    place = {p.name: p.xyz for p in points}
    assert _agreed(points, truth).doubts == ()
    swapped = _agreed(_with_places(points, {"C1": place["C2"], "C2": place["C1"]}), truth)
    assert [d.name for d in swapped.doubts] == ["C1", "C2"]
    assert "exchanged with C2" in swapped.doubts[0].problem
    assert np.linalg.norm(swapped.similarity.shift) < 0.1
    higher = _agreed(_moved(points, "C3", (0.0, 0.0, 34.2)), truth)
    assert [d.name for d in higher.doubts] == ["C3"]
    assert "height is +34" in higher.doubts[0].problem
    astray = _agreed(_moved(points, "K2", (80.0, -60.0, 0.0)), truth)
    assert "100." in astray.doubts[0].problem or "99.9" in astray.doubts[0].problem
    together = _agreed([replace(p, xyz=p.xyz + np.array([110.0, -90.0, 40.0])) for p in points], truth)
    assert together.doubts == ()
    assert together.good.all()
    with pytest.raises(ContradictionError, match=r"C1 and C2 are exchanged"):
        _agreed(_with_places(points[:2], {"C1": place["C2"], "C2": place["C1"]}), truth)


def test_a_point_without_a_height_holds_in_plan() -> None:
    truth = scene(24)
    points = [
        replace(p, xyz=np.array([*p.xyz[:2], np.nan])) if p.name == "C2" else p for p in _points(truth, 5, 0, seed=6)
    ]
    origin = np.array([5000.0, 2000.0, 0.0])
    control = control_of(points, {i.name: k for k, i in enumerate(truth.images)}, origin)
    assert control.weights[1].tolist() == pytest.approx([1e4, 1e4, 0.0])
    assert _agreed(points, truth).good.all()


def test_points_are_told_to_a_task_exactly() -> None:
    points = _points(scene(24), 2, 1, seed=6)
    points[1] = replace(points[1], xyz=np.array([*points[1].xyz[:2], np.nan]), sigmas_m=None)
    again = control_points(known_points(points))
    for one, other in zip(points, again, strict=True):
        assert np.array_equal(one.xyz, other.xyz, equal_nan=True)
        assert (one.name, one.sigmas_m, one.role, one.marks) == (other.name, other.sigmas_m, other.role, other.marks)


def test_a_focal_length_that_is_off_is_calibrated_without_being_asked_for() -> None:
    """By 0.2 %, with exact poses: without calibration these would be moved to make up for it."""
    truth = scene(25)
    wrong = replace(CAMERA, fx=1503.0, fy=1503.0)
    given = [replace(i, camera=wrong) for i in truth.images]
    found = refined(given, truth.ties, AdjustmentParameters())
    assert found.adjusted.calibrated
    assert found.images[0].camera.fx == pytest.approx(1500.0, rel=3e-4)
    moved = [np.linalg.norm(i.centre - t.centre) for i, t in zip(found.images, truth.images, strict=True)]
    assert np.median(moved) < 0.003
    assert not refined(truth.images, truth.ties, AdjustmentParameters()).adjusted.calibrated
