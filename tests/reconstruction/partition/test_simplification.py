from __future__ import annotations

import numpy as np
import pytest
from shapely import box

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.partition.plane_energy import PartitionParameters
from cityflow.reconstruction.partition.roof_partition import partition_roof
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

OUTLINE = box(0, 0, 10, 8)
PLANES = np.array([[0.0, 0.0, 6.0], [0.0, 0.0, 7.0]])


def raised(width: float, density: float, seed: int) -> PlaneSegments:
    """A level roof with a square of some width raised by a metre in its middle."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform((0, 0), (10, 8), (int(80 * density), 2))
    on = (np.abs(xy - (5.0, 4.0)) < width / 2).all(axis=1)
    z = 6.0 + on + rng.normal(0, 0.03, len(xy))
    return PlaneSegments(
        (0.0, 0.0, 0.0), np.column_stack([xy, z]), np.asarray(on, np.int64), PLANES, np.full(2, 0.03), 0.03
    )


def areas(segments: PlaneSegments, **changed: float) -> FloatArray:
    partition, _ = partition_roof(OUTLINE, segments, PartitionParameters(min_width=0.0, **changed))
    return np.sort([partition.polygon(cell).area for cell in partition.cells])


@pytest.mark.parametrize("seed", range(4))
def test_a_small_polygon_is_worth_its_description_where_points_tell(seed: int) -> None:
    assert len(areas(raised(2.3, 16.0, seed))) == 2
    assert len(areas(raised(2.8, 4.0, seed))) == 2
    assert len(areas(raised(1.2, 4.0, seed))) == 1


@pytest.mark.parametrize("seed", range(4))
def test_points_that_err_alike_are_fewer_than_they_seem(seed: int) -> None:
    assert len(areas(raised(2.3, 16.0, seed), number_cost=2.0, alike_m=0.0)) == 2
    assert len(areas(raised(2.3, 16.0, seed), number_cost=2.0, alike_m=0.6)) == 1


@pytest.mark.parametrize("seed", range(4))
def test_a_large_polygon_stays_and_keeps_its_place(seed: int) -> None:
    found = areas(raised(3.0, 6.0, seed))
    assert len(found) == 2
    assert found[0] == pytest.approx(9.0, abs=1.2)


def test_dearer_numbers_leave_no_more_polygons() -> None:
    counts = [len(areas(raised(2.0, 10.0, 5), number_cost=c)) for c in (0.0, 2.0, 8.0, 30.0)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] == 2
    assert counts[-1] == 1
