"""Roof types of surfaces as drawn, of disturbed ones, and of solids."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from shapely import box
from shapely.affinity import rotate, translate

from cityflow.core.building import Face, Polyhedron, RoofPlane, Semantic
from cityflow.core.roof_type_names import RoofType
from cityflow.geometry.roof_adjacency import RoofSurface
from cityflow.geometry.roof_type import roof_type, type_of_surfaces
from cityflow.synthetic import roofs, town_shapes
from cityflow.synthetic.roofs import LocalFace, Placement, visible_faces
from cityflow.synthetic.town_shapes import Overhang, Volume
from scenes import simple_roofs

Build = Callable[[], list[LocalFace]]


def _faces(*volumes: Volume) -> list[LocalFace]:
    return [f for v in volumes for f in v.faces]


def _ring(n: int, radius: float) -> np.ndarray:
    angle = np.arange(n) * 2 * np.pi / n
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _gable(length: float = 11.0, depth: float = 8.0, eave: float = 5.0, slope: float = 0.8) -> Volume:
    return town_shapes.gable_roof(length, depth, eave, slope, Overhang())


def _mansard() -> list[LocalFace]:
    """Steep for 1.2 m, then shallow, on both long sides."""
    low, high = 2.2, 0.5
    return [
        LocalFace(roofs.rectangle(0, 0, 12, 1.2), 0, low, 5.0),
        LocalFace(roofs.rectangle(0, 1.2, 12, 4.5), 0, high, 5.0 + 1.2 * (low - high)),
        LocalFace(roofs.rectangle(0, 4.5, 12, 7.8), 0, -high, 5.0 + 1.2 * (low - high) + 9.0 * high),
        LocalFace(roofs.rectangle(0, 7.8, 12, 9.0), 0, -low, 5.0 + 9.0 * low),
    ]


def _butterfly() -> list[LocalFace]:
    return [
        LocalFace(roofs.rectangle(0, 0, 10, 4), 0, -0.3, 7.0),
        LocalFace(roofs.rectangle(0, 4, 10, 8), 0, 0.3, 4.6),
    ]


def _teeth() -> list[LocalFace]:
    return [LocalFace(roofs.rectangle(6.0 * k, 0, 6.0 * k + 6, 20), -0.4, 0, 8 + 0.4 * (6.0 * k + 6)) for k in range(4)]


def _dome() -> list[LocalFace]:
    """A ring of steep sides below one of shallow ones, over a 16-sided floor."""
    steep = town_shapes.cone_roof(_ring(16, 6.0), (0.0, 0.0), 5.0, 1.6, 0.0)
    shallow = town_shapes.cone_roof(_ring(16, 6.0), (0.0, 0.0), 8.0, 0.5, 0.0)
    return [face for pair in zip(steep.faces, shallow.faces, strict=True) for face in _lower_of(*pair)]


def _lower_of(steep: LocalFace, shallow: LocalFace) -> list[LocalFace]:
    """A sector under two planes of the same aspect, cut where they cross."""
    a, b, tip = (np.array(p) for p in steep.ring)
    turn = np.array([steep.slope_u - shallow.slope_u, steep.slope_v - shallow.slope_v])
    gap = [float(turn @ p) + steep.height - shallow.height for p in (a, b, tip)]
    c, d = (p + g / (g - gap[2]) * (tip - p) for p, g in zip((a, b), gap, strict=False))
    rings = ((a, b, d, c), steep), ((c, d, tip), shallow)
    return [replace(face, ring=tuple((float(u), float(v)) for u, v in ring)) for ring, face in rings]


CASES: dict[str, tuple[Build, RoofType]] = {
    "flat": (lambda: simple_roofs.flat(10, 8, 6), RoofType.FLAT),
    "drained flat": (lambda: simple_roofs.shed(10, 8, 6, 0.02), RoofType.FLAT),
    "shed": (lambda: simple_roofs.shed(10, 8, 4, 0.15), RoofType.SHED),
    "gable": (lambda: _faces(_gable()), RoofType.GABLE),
    "low gable": (lambda: _faces(_gable(30, 18, 8, 0.07)), RoofType.GABLE),
    "ridge off the middle": (
        lambda: _faces(town_shapes.gable_roof(11, 8, 5, 0.8, Overhang(), 0.35)), RoofType.GABLE,
    ),
    "hip": (lambda: roofs.hip(12, 8, 5, 0.7), RoofType.HIP),
    "half-hip": (lambda: _faces(town_shapes.half_hip_roof(12, 8, 5, 0.9, 0.0, 0.5)), RoofType.HALF_HIP),
    "pyramid": (lambda: roofs.hip(8, 8, 5, 0.7), RoofType.PYRAMID),
    "cone": (lambda: _faces(town_shapes.cone_roof(_ring(24, 6), (0, 0), 6, 0.6, 0.3)), RoofType.CONE),
    "dome": (_dome, RoofType.DOME),
    "mansard": (_mansard, RoofType.MANSARD),
    "butterfly": (_butterfly, RoofType.BUTTERFLY),
    "saw-tooth": (_teeth, RoofType.SAWTOOTH),
    "stepped": (
        lambda: [LocalFace(roofs.rectangle(10.0 * k, 0, 10.0 * k + 10, 12), 0, 0, h) for k, h in enumerate((9.0, 5.0, 14.0))],
        RoofType.STEPPED_FLAT,
    ),
    "L": (
        lambda: _faces(_gable(), town_shapes.moved(_gable(8.5, 5.5, 4.6), np.pi / 2, 5.5, 4.0)), RoofType.GABLE,
    ),
    "gable with dormers": (
        lambda: [*_faces(_gable()), *(simple_roofs.dormer(u, (0.7, 4.0), 2.0, 7.2) for u in (1.0, 4.5, 8.0))], RoofType.GABLE,
    ),
    "gable with chimney and annexe": (
        lambda: [*_faces(_gable()), simple_roofs.chimney(4, 4.6, 9.0), LocalFace(roofs.rectangle(1, 7.5, 6, 10.5), 0, 0, 3.0)],
        RoofType.GABLE,
    ),
    "flat with lift house": (
        lambda: [*simple_roofs.flat(12, 9, 9), LocalFace(roofs.rectangle(4, 3, 7, 6), 0, 0, 11.4)], RoofType.FLAT,
    ),
    "flat with a slanting rim": (
        lambda: [*simple_roofs.flat(12, 9, 9), LocalFace(roofs.rectangle(12, 0, 12.6, 9), -0.6, 0, 9 + 0.6 * 12)], RoofType.FLAT,
    ),
    "flat top, steep all round": (
        lambda: [
            LocalFace(roofs.rectangle(1, 1, 11, 8), 0, 0, 9.0),
            LocalFace(((0, 0), (12, 0), (11, 1), (1, 1)), 0, 2.5, 6.5), LocalFace(((12, 0), (12, 9), (11, 8), (11, 1)), -2.5, 0, 36.5),
            LocalFace(((12, 9), (0, 9), (1, 8), (11, 8)), 0, -2.5, 29.0), LocalFace(((0, 9), (0, 0), (1, 1), (1, 8)), 2.5, 0, 6.5),
        ], RoofType.MANSARD,
    ),
    "two levels and a ramp": (
        lambda: [
            LocalFace(roofs.rectangle(0, 0, 10, 6), 0, 0, 6.0), LocalFace(roofs.rectangle(0, 6, 10, 6.8), 0, 1.0, 0.0),
            LocalFace(roofs.rectangle(0, 6.8, 10, 10), 0, 0, 6.8),
        ], RoofType.FLAT,
    ),
    "gable with a slanting strip": (
        lambda: [*_faces(_gable()), LocalFace(roofs.rectangle(10.2, 0.8, 11.0, 7.2), -1.2, 0, 19.5)], RoofType.GABLE,
    ),
    "half gable, half flat": (
        lambda: [*_faces(_gable(10, 8)), LocalFace(roofs.rectangle(10, 0, 20, 8), 0, 0, 6.0)], RoofType.COMPLEX,
    ),
}  # fmt: skip


STEADY = ("cone", "low gable")
"""Large surfaces of little slope, and those that differ little: their slopes must be known better."""


def _placed(build: Build, heading: float) -> list[RoofSurface]:
    place = Placement(84_931.3, 447_512.9, heading, 1.7)
    return [RoofSurface(f.polygon, f.plane) for f in visible_faces([place.face(f) for f in build()])]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("heading", [0.0, 0.61])
def test_types_as_drawn(name: str, heading: float) -> None:
    build, kind = CASES[name]
    assert type_of_surfaces(_placed(build, heading)) is kind


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(4))
def test_types_survive_noise(name: str, seed: int) -> None:
    """Slopes off by half a degree, heights by 3 cm, polygons by 2 cm."""
    build, kind = CASES[name]
    rng = np.random.default_rng(seed)
    noisy = []
    for s in _placed(build, 0.3):
        middle = s.polygon.centroid
        slope = s.gradient + rng.normal(0, np.radians(0.5), 2) * (0.3 if name in STEADY else 1.0)
        height = float(s.plane.z(middle.x, middle.y)) + rng.normal(0, 0.03)
        plane = RoofPlane(float(slope[0]), float(slope[1]), float(height), (middle.x, middle.y))
        noisy.append(RoofSurface(translate(s.polygon, *rng.normal(0, 0.01, 2)), plane))
    assert type_of_surfaces(noisy) is kind


def test_a_solid_tells_its_type_with_and_without_planes() -> None:
    """A gable over a triangle's prism: faces of the solid, in any turn."""
    xy = np.array(rotate(box(0, 0, 10, 8), 25).exterior.coords)[:4]
    ridge = np.array([(xy[0] + xy[1]) / 2, (xy[2] + xy[3]) / 2])
    corners = np.vstack([np.c_[xy, np.zeros(4)], np.c_[xy, np.full(4, 5.0)], np.c_[ridge, np.full(2, 8.0)]])
    roof = [Face(((4, 8, 9, 7),), Semantic.ROOF, 0), Face(((5, 6, 9, 8),), Semantic.ROOF, 1)]
    walls = [((0, 1, 5, 8, 4),), ((1, 2, 6, 5),), ((2, 3, 7, 9, 6),), ((3, 0, 4, 7),)]
    faces = [*roof, *(Face(w, Semantic.WALL) for w in walls), Face(((3, 2, 1, 0),), Semantic.GROUND)]
    solid = Polyhedron(corners, tuple(faces))
    plane = RoofPlane(0.0, 0.0, 0.0, (0.0, 0.0))
    assert roof_type(solid) is RoofType.GABLE
    assert roof_type(solid, (plane, plane)) is RoofType.GABLE


def test_nothing_is_unknown() -> None:
    assert type_of_surfaces([]) is RoofType.UNKNOWN
