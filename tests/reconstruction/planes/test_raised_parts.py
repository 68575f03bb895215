"""Parts that stand on a roof plane of a matched surface: what they are, where they are, and that none is invented."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from shapely import box

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.orientation_histogram import OrientationHistogramParameters, reconstruct

CELL_M, BLUR_M, WAVES_M, WAVE_M, NOISE_M = 0.25, 0.25, 0.02, 0.7, 0.02
"""Of a surface from images: cells; how wide steps are smoothed; errors that neighbours share, how far; and those of their own."""
LENGTH, DEPTH, EAVE, SLOPE = 11.0, 9.0, 6.0, 0.8


def gable(x: FloatArray, y: FloatArray) -> FloatArray:
    return EAVE + SLOPE * np.minimum(y, DEPTH - y) + 0.0 * x


def level_dormer(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where((np.abs(x - 4.0) <= 1.1) & (y >= 0.9) & (y <= DEPTH / 2), EAVE + 2.2, 0.0)


def shed_dormer(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where((np.abs(x - 4.0) <= 1.5) & (y >= 0.9) & (y <= DEPTH / 2), EAVE + 2.0 + 0.3 * (y - 0.9), 0.0)


def gabled_dormer(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where((np.abs(x - 4.0) <= 1.4) & (y >= 0.9) & (y <= DEPTH / 2), EAVE + 3.1 - 0.8 * np.abs(x - 4.0), 0.0)


def flat(x: FloatArray, y: FloatArray) -> FloatArray:
    return EAVE + 0.0 * (x + y)


def lift_house(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where((np.abs(x - 6.0) <= 1.4) & (np.abs(y - 4.0) <= 1.2), EAVE + 2.5, 0.0)


def chimney(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where((np.abs(x - 7.5) <= 0.35) & (np.abs(y - 3.0) <= 0.35), EAVE + 4.0, 0.0)


def nothing(x: FloatArray, y: FloatArray) -> FloatArray:
    return 0.0 * (x + y)


def matched(roof, parts, seed: int, waves: float = WAVES_M) -> Evidence:  # type: ignore[no-untyped-def]
    """A unit whose surface is the highest of some functions, smoothed and with waves."""
    rng, fine, beyond = np.random.default_rng(seed), 0.05, 2.0
    x, y = np.meshgrid(np.arange(-beyond, LENGTH + beyond, fine), np.arange(-beyond, DEPTH + beyond, fine))
    z = gaussian_filter(np.maximum.reduce([f(x, y) for f in (roof, *parts)]), BLUR_M / fine)
    wave = gaussian_filter(rng.normal(size=z.shape), WAVE_M / fine)
    z = z + waves * wave / wave.std()
    every = round(CELL_M / fine)
    xyz = np.column_stack([a[::every, ::every].ravel() for a in (x, y, z)])
    xyz[:, 2] += rng.normal(0.0, NOISE_M, len(xyz))
    inside = (xyz[:, :2] >= 0).all(axis=1) & (xyz[:, :2] <= (LENGTH, DEPTH)).all(axis=1)
    return Evidence("u", box(0, 0, LENGTH, DEPTH), PointCloud.of(xyz[inside], 6), 0.0, matched=True)


def right(solid: Polyhedron, roof, parts) -> tuple[FloatArray, FloatArray, BoolArray]:  # type: ignore[no-untyped-def]
    """x, y of places, and which of them a solid meets within 20 cm."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(0.05, LENGTH, 0.1), np.arange(0.05, DEPTH, 0.1)))
    z = np.maximum.reduce([f(x, y) for f in (roof, *parts)])
    return x, y, np.abs(distances_to_roof(solid, np.column_stack([x, y, z]))) <= 0.2


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("roof", "part", "faces", "area"),
    [(gable, level_dormer, 3, 3.9), (gable, shed_dormer, 3, 7.8), (gable, gabled_dormer, 4, 6.0), (flat, lift_house, 2, 6.7)],
)  # fmt: skip
def test_parts_become_faces_where_they_are(roof, part, faces: int, area: float, seed: int) -> None:  # type: ignore[no-untyped-def]
    """Without the search the level dormer is missed over half of its plan."""
    candidate = reconstruct(matched(roof, (part,), seed), OrientationHistogramParameters())
    assert candidate.solid is not None
    assert not check_polyhedron(candidate.solid)
    assert len(candidate.solid.of_semantic(Semantic.ROOF)) == faces
    x, y, meets = right(candidate.solid, roof, (part,))
    over = part(x, y) > roof(x, y)
    assert np.sum(over) * 0.01 == pytest.approx(area, abs=0.4)
    assert meets[over].mean() > 0.9
    assert meets[~over].mean() > 0.97
    assert len(candidate.planes) == faces
    assert all(plane.points > 10 for plane in candidate.planes)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("roof", [gable, flat])
@pytest.mark.parametrize(("parts", "waves"), [((nothing,), 0.06), ((chimney,), WAVES_M)])
def test_waves_and_chimneys_are_no_parts(roof, parts, waves: float, seed: int) -> None:  # type: ignore[no-untyped-def]
    candidate = reconstruct(matched(roof, parts, seed, waves), OrientationHistogramParameters())
    assert candidate.solid is not None
    assert len(candidate.solid.of_semantic(Semantic.ROOF)) == (2 if roof is gable else 1)


def test_two_dormers_and_the_order_of_points() -> None:
    """Two alike: both are found; the order of the points changes nothing."""

    def second(x: FloatArray, y: FloatArray) -> FloatArray:
        return level_dormer(x - 4.0, y)

    evidence = matched(gable, (level_dormer, second), 7)
    solid = reconstruct(evidence, OrientationHistogramParameters()).solid
    assert solid is not None
    assert len(solid.of_semantic(Semantic.ROOF)) == 4
    order = np.random.default_rng(1).permutation(len(evidence.points))
    other = Evidence("u", evidence.outline, evidence.points.take(order), 0.0, matched=True)
    again = reconstruct(other, OrientationHistogramParameters()).solid
    assert again is not None
    assert np.array_equal(solid.vertices, again.vertices)
    assert solid.faces == again.faces
