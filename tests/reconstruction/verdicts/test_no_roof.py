"""Echoes of façades, crowns and strays leave the figures; a structure that the model lacks stays in them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.choose import Choice, ReconstructParameters, choose
from cityflow.reconstruction.measures import measure
from cityflow.reconstruction.verdicts.no_roof import Kind
from cityflow.reconstruction.verdicts.roof_fit import fit_of
from roof_scenes import ORIGIN, OUTLINE, gable, scan

PLAIN = scan(gable, OUTLINE, 8.0, 0.02, 1)


@cache
def plain_choice() -> Choice:
    """The gable's model."""
    return choose(PLAIN, ReconstructParameters())


def with_points(extra: FloatArray) -> Evidence:
    """The gable's points and others, given in its local frame."""
    return replace(PLAIN, points=PointCloud.of(np.concatenate([PLAIN.points.xyz, extra + ORIGIN]), BUILDING))


def kinds(extra: FloatArray) -> IntArray:
    """What the others are taken for, against the model of the gable alone."""
    solid = plain_choice().candidate.solid
    assert solid is not None
    return fit_of(solid, with_points(extra)).kinds[-len(extra) :]


def facade(rng: np.random.Generator) -> FloatArray:
    return np.column_stack([rng.uniform(0, 12, 120), np.full(120, 0.1), rng.uniform(0.3, 5.3, 120)])


def crown(rng: np.random.Generator) -> FloatArray:
    return np.column_stack([rng.uniform(7, 12, 150), rng.uniform(4, 8, 150), rng.uniform(10.5, 15, 150)])


def strays(rng: np.random.Generator) -> FloatArray:
    return np.column_stack([rng.uniform(1, 11, 12), rng.uniform(1.5, 6.5, 12), rng.uniform(2.6, 5.0, 12)])


@pytest.mark.parametrize(("make", "kind"), [(facade, Kind.FACADE), (crown, Kind.ABOVE), (strays, Kind.BELOW)])
def test_what_is_no_roof_is_known_by_its_kind(make: object, kind: Kind) -> None:
    found = kinds(make(np.random.default_rng(3)))  # type: ignore[operator]
    assert np.mean(found == kind) > 0.9


def test_it_leaves_rmse_and_share_explained_and_is_counted() -> None:
    rng = np.random.default_rng(3)
    told = measure(plain_choice(), with_points(np.concatenate([facade(rng), crown(rng)])))
    assert told["rmse"] is not None
    assert float(told["rmse"]) < 0.15
    assert float(told["share_explained"] or 0) > 0.95
    assert int(told["points_facade"] or 0) > 100
    assert int(told["points_above_roof"] or 0) > 130


@pytest.mark.parametrize("height", [7.9, 11.5, 3.0])
@pytest.mark.parametrize("density", [8.0, 3.0])
def test_a_missed_structure_is_not_excused(height: float, density: float) -> None:
    """A level surface of 3 by 3 m above or below the model: an upper storey, a dormer, a terrace."""
    rng = np.random.default_rng(4)
    n = int(9 * density)
    level = np.column_stack([rng.uniform(4, 7, n), rng.uniform(0.3, 3.3, n), height + rng.normal(0, 0.02, n)])
    assert np.mean(kinds(level) == Kind.ROOF) > 0.85
    assert float(measure(plain_choice(), with_points(level))["rmse"] or 0) > 0.15
