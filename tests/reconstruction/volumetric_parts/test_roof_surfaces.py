from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import LineString

from cityflow.core.arrays import FloatArray
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.volumetric_parts.roof_surfaces import SurfaceParameters, roof_surfaces
from roof_scenes import ORIGIN, OUTLINE, SCENES, gable, scan

DEFAULT = SurfaceParameters()


def blurred(seed: int) -> Evidence:
    """A gable beside a higher neighbour in the east: over the last 0.8 m its roof leans up to the neighbour's."""

    def height(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.asarray(gable(x, y) + 1.4 * np.clip((x - 11.2) / 0.8, 0, 1))

    evidence = scan(height, OUTLINE, 60.0, 0.05, seed)
    party = LineString([(ORIGIN[0] + 12, ORIGIN[1]), (ORIGIN[0] + 12, ORIGIN[1] + 8)])
    return replace(evidence, party=(party,))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_blur_along_a_party_wall_is_no_surface(seed: int) -> None:
    evidence = blurred(seed)
    with_blur, _ = roof_surfaces(evidence, SurfaceParameters(party_strip=0.0))
    without, _ = roof_surfaces(evidence, DEFAULT)
    assert len(with_blur) > 2
    assert len(without) == 2
    slopes = sorted(float(b) for b in without.coefficients[:, 1])
    assert slopes == pytest.approx([-np.tan(np.radians(40)), np.tan(np.radians(40))], abs=0.02)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_as_many_surfaces_as_the_roof_has(name: str, seed: int) -> None:
    height, planes = SCENES[name]
    segments, noisy = roof_surfaces(scan(height, OUTLINE, 20.0, 0.05, seed), DEFAULT)
    assert len(segments) == planes
    assert noisy < 0.05


def test_strays_do_not_tilt_planes() -> None:
    evidence = scan(gable, OUTLINE, 40.0, 0.05, 4)
    rng = np.random.default_rng(0)
    strays = rng.uniform([0, 0, 0], [12, 8, 14], (500, 3)) + np.array(ORIGIN)
    xyz = np.concatenate([evidence.points.xyz, strays])
    segments, noisy = roof_surfaces(replace(evidence, points=PointCloud.of(xyz, 6)), DEFAULT)
    assert len(segments) == 2
    assert noisy > 0.06
    for a, b, _ in segments.coefficients:
        assert abs(a) < 0.01
        assert abs(b) == pytest.approx(np.tan(np.radians(40)), abs=0.01)


@pytest.mark.parametrize("slope", [2.2, 3.2])
def test_spires_are_surfaces(slope: float) -> None:
    """A tower's spire of 66 and 73 degrees: as seen from above its points stand metres apart in height."""

    def spire(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.asarray(40 - slope * np.maximum(np.abs(x - 6) / 1.5, np.abs(y - 4)))

    segments, _ = roof_surfaces(scan(spire, OUTLINE, 30.0, 0.03, 5), DEFAULT)
    assert len(segments) == 4
    steepest = np.sort(np.hypot(*segments.coefficients[:, :2].T))
    assert steepest == pytest.approx([slope / 1.5, slope / 1.5, slope, slope], rel=0.03)
