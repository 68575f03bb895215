"""The monolithic method: roofs with known planes, roofs that it must refuse, and bad input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely import Polygon, box, contains_xy, get_coordinates

from cityflow.core.building import Semantic, Status
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.roof_distances import distances_to_roof, summarise
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.monolithic import INCONSISTENT, MonolithicParameters, reconstruct
from roof_scenes import ORIGIN, OUTLINE, gable, gable_with_dormer, hip, parallel_slopes, scan, two_levels

Array = NDArray[np.float64]
P = MonolithicParameters()
T_OUTLINE = Polygon([(0, 0), (12, 0), (12, 6), (9, 6), (9, 11), (3, 11), (3, 6), (0, 6)])
L_OUTLINE = Polygon([(0, 0), (14, 0), (14, 6), (6, 6), (6, 12), (0, 12)])


def pyramid(x: Array, y: Array) -> Array:
    return np.asarray(9 - 0.7 * np.maximum(np.abs(x - 4), np.abs(y - 4)))


def tee(x: Array, y: Array) -> Array:
    """A wing with a lower ridge that runs into the main roof."""
    main, wing = 9 - 0.8 * np.abs(y - 3), 8.2 - 0.8 * np.abs(x - 6)
    return np.where(y > 3, np.maximum(main, wing), main)


def ell(x: Array, y: Array) -> Array:
    """Two hipped wings of one height: six planes, a hip at the outer corner, a valley at the inner one."""
    lying = np.minimum.reduce([x, y, 14 - x, 6 - y])
    standing = np.minimum.reduce([x, y, 6 - x, 12 - y])
    return np.asarray(5 + 0.8 * np.maximum(lying, standing))


def faces_of(candidate: Candidate) -> int:
    assert candidate.solid is not None
    return len(candidate.solid.of_semantic(Semantic.ROOF))


@pytest.mark.parametrize(
    ("roof", "outline", "planes"),
    [(gable, OUTLINE, 2), (hip, OUTLINE, 4), (pyramid, box(0, 0, 8, 8), 4), (tee, T_OUTLINE, 4), (ell, L_OUTLINE, 6)],
    ids=["gable", "hip", "pyramid", "T", "L"],
)
@pytest.mark.parametrize(("density", "noise"), [(12, 0.03), (60, 0.05), (150, 0.08)])
def test_roofs_without_steps(
    roof: Callable[[Array, Array], Array], outline: Polygon, planes: int, density: float, noise: float
) -> None:
    """Every plane one face, the solid valid, the outline's vertices bit for bit, the roof within millimetres to centimetres."""
    evidence = scan(roof, outline, density, noise, seed=3)
    candidate = reconstruct(evidence, P)
    assert candidate.solid is not None, candidate.reason
    assert candidate.status is Status.DONE
    assert faces_of(candidate) == planes
    assert check_polyhedron(candidate.solid) == []
    ground = candidate.solid.of_semantic(Semantic.GROUND)[0]
    corners = {tuple(v) for v in candidate.solid.ring(ground.rings[0])[:, :2]}
    assert {tuple(v) for v in get_coordinates(evidence.outline)} <= corners
    true = scan(roof, outline, 40, 0.0, seed=4).points.xyz
    true = true[contains_xy(evidence.outline, true[:, 0], true[:, 1])]
    distances = distances_to_roof(candidate.solid, true)
    assert float(np.sqrt(np.nanmean(distances**2))) < 2.0 * noise / np.sqrt(density) + 0.02
    assert summarise(distances).covered > 0.999


def test_ridge_ends_are_where_planes_meet() -> None:
    candidate = reconstruct(scan(hip, OUTLINE, 100, 0.05, seed=0), P)
    assert candidate.solid is not None
    top = candidate.solid.vertices - ORIGIN
    top = top[top[:, 2] > 8.5]
    expected = np.array([[4.0, 4.0, 9.0], [8.0, 4.0, 9.0]])
    assert len(top) == 2
    assert np.linalg.norm(top[np.argsort(top[:, 0])] - expected, axis=1).max() < 0.06


@pytest.mark.parametrize(
    ("roof", "reason"),
    [(two_levels, "step"), (parallel_slopes, "step"), (gable_with_dormer, "without ends")],
    ids=["two levels", "parallel slopes", "dormer"],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_steps_are_inconsistent(roof: Callable[[Array, Array], Array], reason: str, seed: int) -> None:
    candidate = reconstruct(scan(roof, OUTLINE, 60, 0.05, seed), P)
    assert candidate.solid is None
    assert candidate.reason.startswith(INCONSISTENT)
    assert reason in candidate.reason


def test_a_chimney_is_grown_over() -> None:
    def roof(x: Array, y: Array) -> Array:
        return np.where((np.abs(x - 5) < 0.35) & (np.abs(y - 3) < 0.35), 10.0, gable(x, y))

    candidate = reconstruct(scan(roof, OUTLINE, 60, 0.04, seed=2), P)
    assert candidate.solid is not None, candidate.reason
    assert faces_of(candidate) == 2


def test_an_outline_with_a_courtyard_keeps_its_hole() -> None:
    yard = Polygon([(0, 0), (12, 0), (12, 8), (0, 8)], [[(4, 3), (4, 5), (8, 5), (8, 3)]])
    evidence = scan(gable, OUTLINE, 60, 0.04, seed=1)
    shell, hole = (np.asarray(r.coords) + ORIGIN[:2] for r in (yard.exterior, yard.interiors[0]))
    candidate = reconstruct(replace(evidence, outline=Polygon(shell, [hole])), P)
    assert candidate.solid is not None, candidate.reason
    assert check_polyhedron(candidate.solid) == []
    assert len(candidate.solid.of_semantic(Semantic.GROUND)[0].rings) == 2


def bad_clouds() -> dict[str, Array]:
    rng = np.random.default_rng(5)
    plan = rng.uniform((0, 0), (12, 8), (4000, 2))
    along = np.linspace(0, 12, 500)
    return {
        "none": np.empty((0, 3)),
        "ten": rng.uniform(0, 8, (10, 3)),
        "one place": np.tile([[3.0, 3.0, 5.0]], (500, 1)),
        "on a line": np.column_stack([along, np.full(500, 4.0), np.full(500, 7.0)]),
        "a wall": np.column_stack([np.full(2000, 2.0), rng.uniform(0, 8, (2000, 2))]),
        "a tree": np.column_stack([plan, 5 + rng.gamma(2.0, 1.2, len(plan))]),
        "not numbers": np.full((300, 3), np.nan),
        "under the floor": np.column_stack([plan, np.full(len(plan), -20.0)]),
    }


@pytest.mark.parametrize("name", sorted(bad_clouds()))
def test_what_is_no_roof_is_inconsistent(name: str) -> None:
    outline = Polygon(get_coordinates(OUTLINE) + ORIGIN[:2])
    cloud = PointCloud.of(bad_clouds()[name] + ORIGIN, BUILDING)
    candidate = reconstruct(Evidence("unit", outline, cloud, ORIGIN[2]), P)
    assert candidate.solid is None
    assert candidate.reason.startswith(INCONSISTENT)


def test_half_a_roof_is_extended_and_says_so() -> None:
    evidence = scan(gable, OUTLINE, 60, 0.04, seed=1)
    seen = evidence.points.take(evidence.points.xyz[:, 0] < ORIGIN[0] + 6)
    candidate = reconstruct(replace(evidence, points=seen), P)
    assert candidate.solid is not None
    assert candidate.status is Status.DEGRADED
    assert 0.4 < float(candidate.notes["unseen"] or 0) < 0.6


def test_the_order_of_points_does_not_matter() -> None:
    evidence = scan(hip, OUTLINE, 60, 0.05, seed=7)
    turned = evidence.points.take(np.random.default_rng(0).permutation(len(evidence.points)))
    first, second = reconstruct(evidence, P), reconstruct(replace(evidence, points=turned), P)
    assert first.solid is not None
    assert second.solid is not None
    assert first.solid.vertices.tobytes() == second.solid.vertices.tobytes()
    assert first.solid.faces == second.solid.faces
