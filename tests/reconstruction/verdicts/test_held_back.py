"""Which points the fit does not see: the same ones whatever their order and neighbours, about a tenth, all over the roof."""

from __future__ import annotations

import numpy as np

from cityflow.reconstruction.verdicts.held_back import groups_of, without_group
from roof_scenes import OUTLINE, gable, scan

XYZ = np.random.default_rng(5).uniform((84_900, 447_500, 0), (85_000, 447_600, 20), (20_000, 3)).round(3)


def test_a_point_is_in_the_same_group_wherever_it_is_read() -> None:
    order = np.random.default_rng(1).permutation(len(XYZ))
    assert np.array_equal(groups_of(XYZ[order], 10), groups_of(XYZ, 10)[order])
    assert np.array_equal(groups_of(XYZ[:77], 10), groups_of(XYZ, 10)[:77])
    # a reader's last digit is below a millimetre
    assert np.array_equal(groups_of(XYZ + 1e-8, 10), groups_of(XYZ, 10))


def test_groups_are_alike_in_size_and_stand_everywhere() -> None:
    group = groups_of(XYZ, 10)
    assert np.all(np.abs(np.bincount(group, minlength=10) - 2000) < 5 * np.sqrt(2000))
    quarter = (XYZ[:, 0] > 84_950).astype(int) + 2 * (XYZ[:, 1] > 447_550)
    assert np.all(np.abs(np.bincount(quarter[group == 0], minlength=4) - 500) < 120)
    # points of a lattice are no worse off
    col, row = np.meshgrid(np.arange(200.0), np.arange(100.0))
    lattice = np.column_stack([col.ravel(), row.ravel(), np.full(col.size, 5.0)])
    assert abs(np.mean(groups_of(lattice, 10) == 0) - 0.1) < 0.01


def test_the_fit_has_neither_the_points_nor_their_twins_around() -> None:
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 1)
    fitted = without_group(evidence, 0, 10)
    assert not np.any(groups_of(fitted.points.xyz, 10) == 0)
    assert len(fitted.points) < len(evidence.points)
