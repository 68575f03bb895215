from __future__ import annotations

from dataclasses import replace

import numpy as np

from cityflow.core.building import Building, Lod, Polyhedron, RoofPlane
from cityflow.io.roof_type import FLAT, GABLED, MONOPITCH, roof_type_code


def test_flat_and_gabled_roofs_are_known(gable: Building, courtyard: Building) -> None:
    assert roof_type_code(gable) == GABLED
    assert roof_type_code(courtyard) == FLAT


def test_a_valley_is_no_gable(gable: Building) -> None:
    """The same two planes turned upside down: opposite as well, but the highest vertices lie on the eaves."""
    solid = gable.solids[Lod.LOD22]
    mirrored = Polyhedron(solid.vertices * np.array([1, 1, -1]), solid.faces)
    planes = tuple(RoofPlane(-p.slope_x, -p.slope_y, -p.height, p.origin) for p in gable.planes)
    roof = replace(mirrored, vertices=np.where(solid.vertices[:, 2:] < 0, solid.vertices, mirrored.vertices))
    assert roof_type_code(replace(gable, solids={Lod.LOD22: roof}, planes=planes)) is None


def test_one_slope_is_monopitch_and_two_that_fall_the_same_way_are_nothing_known(gable: Building) -> None:
    slope = gable.planes[0]
    assert roof_type_code(replace(gable, planes=(slope,))) == MONOPITCH
    assert roof_type_code(replace(gable, planes=(slope, slope))) is None


def test_without_planes_or_solid_nothing_is_said(gable: Building) -> None:
    assert roof_type_code(replace(gable, planes=())) is None
    assert roof_type_code(replace(gable, solids={})) is None
