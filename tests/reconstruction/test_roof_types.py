"""Houses of known type, drawn with ortho and surface model, go through the whole method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon, contains_xy

from cityflow.core.building import Lod, Status
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Candidate, Evidence, Picture
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.roof_types import reconstruct
from cityflow.reconstruction.roof_types_parts import roof_evidence as readings
from cityflow.reconstruction.roof_types_parts.line_categories import Category
from cityflow.reconstruction.roof_types_parts.roof_evidence import Reading, RoofTypesParameters, read
from cityflow.reconstruction.roof_types_parts.roof_lines import RoofLines
from cityflow.synthetic.roofs import MAIN, visible_faces
from roof_skeletons import node_errors, roof_polygons, skeleton_nodes, united_by_plane
from scenes.drawn_houses import BEYOND, COMPLEX, SIMPLE, DrawnHouse, disturbed, drawn_house

PARAMETERS = RoofTypesParameters()


def evidence_of(
    house: DrawnHouse,
    cell: float = 1.0,
    outline: Polygon | None = None,
    pictures: tuple[Picture, ...] | None = None,
    wanted: str = "",
) -> Evidence:
    shown = (house.ortho(),) if pictures is None else pictures
    return Evidence(
        house.shape, outline or house.outline, PointCloud.empty(), house.ground,
        heights=house.heights(cell), pictures=shown, wanted_type=wanted,
    )  # fmt: skip


def nodes_of(house: DrawnHouse) -> np.ndarray:
    x, y = house.outline.bounds[:2]
    faces = visible_faces([p for p in house.prisms if p.kind == MAIN])
    planes = [np.array([f.plane.slope_x, f.plane.slope_y, float(f.plane.z(x, y))]) for f in faces]
    return skeleton_nodes(united_by_plane([(f.polygon, p) for f, p in zip(faces, planes, strict=True)]), house.outline)


def rmse(candidate: Candidate, house: DrawnHouse, outline: Polygon) -> float:
    assert candidate.solid is not None
    return node_errors(nodes_of(house), skeleton_nodes(roof_polygons(candidate.solid), outline)).rmse()


@pytest.mark.parametrize("shape", [*SIMPLE, *COMPLEX, *BEYOND])
def test_type_and_valid_solid(shape: str) -> None:
    house = drawn_house(shape, 1)
    candidate = reconstruct(evidence_of(house), PARAMETERS)
    assert candidate.roof_type == house.type
    assert candidate.solid is not None
    assert not check_polyhedron(candidate.solid)
    assert candidate.status is Status.DONE
    assert {Lod.LOD12, Lod.LOD13} <= set(candidate.blocks)
    corners = {tuple(p) for p in np.asarray(house.outline.exterior.coords)}
    assert corners <= {tuple(p) for p in candidate.solid.vertices[:, :2]}


@pytest.mark.parametrize("shape", ["gable", "gable off", "hip", "pyramid", "L gable", "L hip"])
def test_skeleton_lies_where_it_is(shape: str) -> None:
    house = drawn_house(shape, 0)
    assert rmse(reconstruct(evidence_of(house), PARAMETERS), house, house.outline) < 0.5


def long_inside(reading: Reading) -> RoofLines:
    """Lines of 4 m and more whose middle is well inside."""
    lines = reading.lines.lines
    middle = contains_xy(reading.outline.buffer(-1.5), *lines.ends.mean(axis=1).T)
    return lines.take(middle & (lines.length >= 4))


def test_a_second_epoch_shows_the_ridge_that_the_first_does_not() -> None:
    alone, united = list[float](), list[float]()
    for seed in (0, 1, 2):
        house = drawn_house("gable off", seed)
        # Both slopes lit alike, and neither in shadow: nothing shows the ridge.
        even = replace(house, slope=np.zeros_like(house.slope), height=np.minimum(house.height, house.ground + 3))
        dull = even.ortho(0)
        first, both = (evidence_of(house, 2.0, pictures=shown) for shown in ((dull,), (dull, house.ortho(1))))
        assert len(long_inside(read(first, PARAMETERS))) == 0
        assert 1 in long_inside(read(both, PARAMETERS)).epoch
        alone.append(rmse(reconstruct(first, PARAMETERS), house, house.outline))
        united.append(rmse(reconstruct(both, PARAMETERS), house, house.outline))
    assert max(united) < 0.5
    assert np.nanmean(united) < 0.5 * np.nanmean(np.where(np.isnan(alone), 3.0, alone))


def test_the_solid_stands_on_the_outline_as_given() -> None:
    house = drawn_house("L hip", 2)
    outline = disturbed(house.outline, np.random.default_rng(4), 0.73)
    evidence = evidence_of(house, outline=outline)
    reading = read(evidence, PARAMETERS)
    assert reading.fitted is not reading.outline
    solid = reconstruct(evidence, PARAMETERS).solid
    assert solid is not None
    assert not check_polyhedron(solid)
    assert {tuple(p) for p in np.asarray(outline.exterior.coords)} <= {tuple(p) for p in solid.vertices[:, :2]}


def test_an_outline_that_loses_the_few_heights_is_not_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    xyz = np.array([[0.2, 0.2, 3.0], [3.8, 0.2, 3.0], [0.2, 3.8, 3.0], [3.8, 3.8, 3.0], [0.2, 2.0, 3.0]])
    evidence = Evidence("few", Polygon([(0, 0), (4, 0), (4, 4), (0, 4)]), PointCloud.of(xyz, 6), 0.0)
    moved_in = Polygon([(1, 1), (3, 1), (3, 3), (1, 3)])
    monkeypatch.setattr(readings, "fitted_outline", lambda *_: moved_in)
    assert len(read(evidence, PARAMETERS).cells) == 5
    assert reconstruct(evidence, PARAMETERS).solid is not None


def test_disturbed_outlines_keep_type_and_skeleton() -> None:
    errors, right = [], 0
    for shape, seed in (("gable", 0), ("gable", 1), ("hip", 2), ("pyramid", 3), ("L gable", 0), ("L hip", 1)):
        house = drawn_house(shape, seed)
        outline = disturbed(house.outline, np.random.default_rng(seed), 0.73)
        candidate = reconstruct(evidence_of(house, outline=outline), PARAMETERS)
        right += candidate.roof_type == house.type
        errors.append(rmse(candidate, house, outline))
    assert right >= 5
    assert np.sqrt(np.mean(np.square(errors))) < 0.8


def test_same_type_from_coarse_heights() -> None:
    for shape in ("gable", "hip", "flat"):
        house = drawn_house(shape, 3)
        kinds = {reconstruct(evidence_of(house, cell), PARAMETERS).roof_type for cell in (0.5, 2.0)}
        assert kinds == {house.type.value}


def test_heights_are_those_of_the_surface() -> None:
    house = drawn_house("gable", 4)
    solid = reconstruct(evidence_of(house), PARAMETERS).solid
    assert solid is not None
    ridge = max(
        float(f.plane.z(*np.asarray(f.polygon.exterior.coords).T[:2]).max()) for f in house.faces if f.kind == MAIN
    )
    assert abs(float(solid.vertices[:, 2].max()) - ridge) < 0.5


def test_wanted_type_is_obeyed_where_its_skeleton_fits() -> None:
    house = drawn_house("hip", 5)
    assert reconstruct(evidence_of(house, wanted="gable"), PARAMETERS).roof_type == "gable"
    flat = drawn_house("flat", 5)
    refused = reconstruct(evidence_of(flat, wanted="dome"), PARAMETERS)
    assert refused.solid is None
    assert refused.reason


def test_without_pictures_heights_alone_tell_steep_roofs() -> None:
    for shape in ("gable", "flat", "pyramid"):
        house = drawn_house(shape, 6)
        assert reconstruct(evidence_of(house, pictures=()), PARAMETERS).roof_type == house.type


def test_plain_ortho_is_brought_back() -> None:
    house = drawn_house("gable off", 7)
    lean = (0.08, 0.06)
    candidate = reconstruct(evidence_of(house, pictures=(house.ortho(lean=lean),)), PARAMETERS)
    assert candidate.roof_type == house.type
    assert rmse(candidate, house, house.outline) < 0.6


def test_nothing_to_see_is_said() -> None:
    house = drawn_house("gable", 8)
    nothing = Evidence("x", house.outline, PointCloud.empty(), house.ground)
    candidate = reconstruct(nothing, PARAMETERS)
    assert candidate.solid is None
    assert "heights" in candidate.reason
    assert candidate.roof_type == "unknown"


def test_points_alone_are_enough() -> None:
    house = drawn_house("hip", 9)
    rng = np.random.default_rng(0)
    x0, y0, x1, y1 = house.outline.bounds
    xy = rng.uniform((x0, y0), (x1, y1), (1500, 2))
    z = np.full(len(xy), -np.inf)
    for f in house.prisms:
        inside = np.array([f.polygon.covers(p) for p in map(_point, xy)])
        z = np.where(inside, np.maximum(z, f.plane.z(*xy.T)), z)
    seen = np.isfinite(z)
    points = PointCloud.of(np.column_stack([xy, z + rng.normal(0, 0.05, len(z))])[seen], 6)
    assert reconstruct(Evidence("x", house.outline, points, house.ground), PARAMETERS).roof_type == "hip"


def _point(xy: np.ndarray) -> object:
    from shapely import Point

    return Point(xy)


def test_same_bytes_again() -> None:
    house = drawn_house("T gable", 3)
    first, second = (reconstruct(evidence_of(house), PARAMETERS) for _ in range(2))
    assert first.solid is not None
    assert second.solid is not None
    assert first.solid.vertices.tobytes() == second.solid.vertices.tobytes()
    assert first.solid.faces == second.solid.faces


def test_ridge_and_hips_are_sorted_so() -> None:
    reading = read(evidence_of(drawn_house("hip", 1)), PARAMETERS)
    assert len(reading.lines.of(Category.RIDGE)) >= 1
    assert len(reading.lines.of(Category.HIP)) >= 2
