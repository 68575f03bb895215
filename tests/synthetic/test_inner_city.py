from __future__ import annotations

import numpy as np
import pytest

from scenes.inner_city import InnerCityParameters, OldHouse, inner_city

BARE = InnerCityParameters(houses=1, density_m2=4, clutter=0.0, unevenness_m=0.0, sigma_z_m=0.0, sigma_xy_m=0.0)


def test_the_same_seed_gives_the_same_bytes() -> None:
    one, two = (inner_city(5, InnerCityParameters(houses=1, density_m2=1)) for _ in range(2))
    assert [h.evidence.points.xyz.tobytes() for h in one] == [h.evidence.points.xyz.tobytes() for h in two]
    assert [h.evidence.outline.wkb for h in one] == [h.evidence.outline.wkb for h in two]


@pytest.mark.parametrize("seed", [1, 2])
def test_bare_roofs_are_scanned_where_they_are(seed: int) -> None:
    for house in inner_city(seed, BARE):
        xyz = house.evidence.points.xyz
        off = xyz[:, 2] - house.building.z(xyz[:, 0], xyz[:, 1])
        assert np.mean(np.abs(off[np.isfinite(off)]) < 0.005) > 0.75  # the others are walls between the storeys
        assert sum(f.polygon.area for f in house.building.faces) == pytest.approx(house.evidence.outline.area, rel=1e-3)
        assert 3 <= house.planes <= 25


def test_clutter_stands_on_the_roof_and_is_no_part_of_the_truth() -> None:
    bare, full = (inner_city(7, InnerCityParameters(houses=1, density_m2=4, clutter=c)) for c in (0.0, 2.5))
    assert np.mean([_share_above(h) for h in full]) > np.mean([_share_above(h) for h in bare]) + 0.15


def _share_above(house: OldHouse) -> float:
    xyz = house.evidence.points.xyz
    return float(np.mean(xyz[:, 2] > house.building.z(xyz[:, 0], xyz[:, 1]) + 0.25))
