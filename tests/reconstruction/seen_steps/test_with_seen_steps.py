"""Steps of a roof move to where photographs show them: a high and a low flat roof, photographed from eight places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from cityflow.core.building import Polyhedron, Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid
from cityflow.core.pixels import ArrayPixels
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence, HeightRaster
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction import orientation_histogram
from cityflow.reconstruction.seen_steps.edge_lines import roof_steps
from cityflow.reconstruction.seen_steps.moved_steps import StepPlan
from cityflow.reconstruction.seen_steps.with_seen_steps import SeenStepParameters, with_seen_steps
from cityflow.reconstruction.verdicts.seen_elsewhere import probability_of_harm, seen_elsewhere
from cityflow.splitting.cuts.seen_borders import border_shifts

ORIGIN = np.array([5000.0, 7000.0])
HIGH, LOW, TRUE_X, FOUND_X, CELL = 9.0, 6.0, 10.0, 10.3, 0.125
OUTLINE = shapely.transform(shapely.box(0, 0, 20, 12), lambda xy: xy + ORIGIN)
P = SeenStepParameters()


def colours(xy: NDArray[np.float64], kind: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Tiles, a wall, and gravel: bright, dark and between, each with a pattern."""
    waves = 12 * np.sin(xy[..., 0] * 3.1 + 0.7 * kind) * np.sin(xy[..., 1] * 2.3)
    bright = np.array([170.0, 60.0, 110.0])[kind] + waves
    return np.asarray(np.clip(bright, 0, 255)[..., None], np.uint8)


def photograph(centre: tuple[float, float, float], step_x: float, seed: int, low_z: float = LOW) -> ColourImage:
    """Of the roofs, the step at `step_x`, from a place that looks at their middle."""
    eye, middle = np.array([*ORIGIN, 0.0]) + centre, np.array([ORIGIN[0] + 10, ORIGIN[1] + 6, 7.0])
    forward = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross(forward, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    rotation = np.array([right, np.cross(forward, right), forward])
    image = OrientedImage(f"{seed}", Camera(420, 420, 900.0, 900.0, 210.0, 210.0), rotation, eye)
    row, col = np.mgrid[:420, :420]
    rays = image.rays(np.column_stack([col.ravel() + 0.5, row.ravel() + 0.5]))
    high, low = (eye + rays * ((z - eye[2]) / rays[:, 2])[:, None] for z in (HIGH, low_z))
    on_high, on_low = high[:, 0] - ORIGIN[0] < step_x, low[:, 0] - ORIGIN[0] >= step_x
    kind = np.where(on_high, 0, np.where(on_low, 2, 1))
    seen = colours(np.where(on_high[:, None], high, low)[:, :2], kind).reshape(420, 420, 1).astype(float)
    noise = np.random.default_rng(seed).normal(0, 3, seen.shape)
    return ColourImage(image, ArrayPixels(np.clip(seen + noise, 0, 255).astype(np.uint8)))


CENTRES = ((10.0, 6.0, 80.0), *((10 + 35 * np.cos(a), 6 + 35 * np.sin(a), 75.0) for a in np.arange(7) * 0.9))


def evidence_of(xyz: NDArray[np.float64], outline: Polygon = OUTLINE, step_x: float | None = TRUE_X) -> Evidence:
    """Points at a spacing of 25 cm; without a step in the photographs each of them shows it elsewhere."""
    places = (
        np.random.default_rng(5).uniform(9.0, 11.0, len(CENTRES)) if step_x is None else np.full(len(CENTRES), step_x)
    )
    images = tuple(photograph(c, x, k) for k, (c, x) in enumerate(zip(CENTRES, places, strict=True)))
    grid = Grid(ORIGIN[0] - 4, ORIGIN[1] + 16, CELL, 160, 224)
    flat = np.zeros(grid.shape)
    cloud = PointCloud.of(xyz + np.append(ORIGIN, 0.0), BUILDING)
    return Evidence("u", outline, cloud, 0.0, heights=HeightRaster(grid, flat, flat), matched=True, photographs=images)


def grid_points() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, y = np.meshgrid(np.arange(0.125, 20, 0.25), np.arange(0.125, 12, 0.25))
    return x.ravel(), y.ravel()


def two_roofs() -> NDArray[np.float64]:
    x, y = grid_points()
    return np.column_stack([x, y, np.where(x < FOUND_X, HIGH, LOW)])


def modelled(evidence: Evidence) -> Candidate:
    found = orientation_histogram.reconstruct(evidence, orientation_histogram.OrientationHistogramParameters())
    assert found.solid is not None
    return found


def steps_x(solid: Polyhedron) -> NDArray[np.float64]:
    ring = np.concatenate([solid.ring(f.rings[0]) for f in solid.of_semantic(Semantic.WALL)])
    x = ring[:, 0] - ORIGIN[0]
    return np.asarray(x[(x > 0.5) & (x < 19.5)])


def test_a_step_moves_to_where_photographs_show_it() -> None:
    evidence = evidence_of(two_roofs())
    before = modelled(evidence)
    assert before.solid is not None
    assert abs(np.median(steps_x(before.solid)) - FOUND_X) < 0.15
    after = with_seen_steps(before, evidence, P)
    assert after.solid is not None
    assert not check_polyhedron(after.solid)
    assert np.abs(steps_x(after.solid) - TRUE_X).max() < 0.04
    again = with_seen_steps(before, evidence, P).solid
    assert again is not None
    assert np.array_equal(again.vertices, after.solid.vertices)
    assert (after.notes["steps"], after.notes["steps_moved"]) == (1, 1)
    assert np.ptp(after.solid.vertices, axis=0) == pytest.approx(np.ptp(before.solid.vertices, axis=0), abs=1e-9)
    ground = [
        {tuple(v) for f in s.of_semantic(Semantic.GROUND) for v in s.ring(f.rings[0])}
        for s in (before.solid, after.solid)
    ]
    assert ground[0] == ground[1]


@pytest.mark.parametrize("how", ["disagree", "few", "off", "none"])
def test_a_step_stays_where_photographs_do_not_agree_or_are_few_or_none(how: str) -> None:
    evidence = evidence_of(two_roofs(), step_x=None if how == "disagree" else TRUE_X)
    kept = {"disagree": 8, "few": 3, "off": 8, "none": 0}[how]
    before = modelled(evidence)
    after = with_seen_steps(
        before, replace(evidence, photographs=evidence.photographs[:kept]), SeenStepParameters(wanted=how != "off")
    )
    assert after.solid is not None
    assert before.solid is not None
    assert np.array_equal(after.solid.vertices, before.solid.vertices)


def test_a_step_that_ends_at_a_corner_of_the_outline_stays() -> None:
    corner = Polygon([(0, 0), (20, 0), (20, 9), (10.25, 9), (10.25, 12), (0, 12)])
    x, y = grid_points()
    xyz = two_roofs()[(x < 10.25) | (y < 9)]
    evidence = evidence_of(xyz, shapely.transform(corner, lambda xy: xy + ORIGIN))
    before = modelled(evidence)
    after = with_seen_steps(before, evidence, P)
    assert after.solid is not None
    assert before.solid is not None
    assert np.array_equal(after.solid.vertices, before.solid.vertices)
    assert after.notes["steps_moved"] == 0


def box_on_roof() -> tuple[StepPlan, Polyhedron, Evidence]:
    x, y = grid_points()
    on = (x > 5) & (x < 11) & (y > 4) & (y < 8)
    evidence = evidence_of(np.column_stack([x, y, np.where(on, HIGH, LOW)]))
    solid = modelled(evidence).solid
    assert solid is not None
    return StepPlan.of(solid, OUTLINE), solid, evidence


def test_corners_of_two_steps_that_move_are_where_their_lines_meet() -> None:
    plan, solid, _ = box_on_roof()
    steps = roof_steps(solid, OUTLINE)
    east = next(s for s in steps if s.normal[0] > 0.99)
    north = next(s for s in steps if s.normal[1] > 0.99)
    made = plan.moved([(east, 0.3), (north, -0.2)])
    assert made is not None
    assert not check_polyhedron(made)
    high = [
        made.ring(f.rings[0])[:, :2] - ORIGIN
        for f in made.of_semantic(Semantic.ROOF)
        if made.ring(f.rings[0])[0, 2] > 8
    ]
    before = [
        solid.ring(f.rings[0])[:, :2] - ORIGIN
        for f in solid.of_semantic(Semantic.ROOF)
        if solid.ring(f.rings[0])[0, 2] > 8
    ]
    wide = np.ptp(high[0], axis=0) - np.ptp(before[0], axis=0)
    assert wide == pytest.approx([0.3, -0.2], abs=1e-3)


def test_a_step_does_not_move_beyond_what_it_would_meet() -> None:
    plan, solid, _ = box_on_roof()
    east = next(s for s in roof_steps(solid, OUTLINE) if s.normal[0] > 0.99)
    assert plan.moved([(east, -6.5)]) is None
    assert plan.moved([(east, 9.5)]) is None


def test_a_ridge_goes_on_along_its_own_line() -> None:
    x, y = grid_points()
    gable = HIGH - 0.5 * np.abs(y - 6.0)
    evidence = evidence_of(np.column_stack([x, y, np.where(x < FOUND_X, gable, 3.0)]))
    solid = modelled(evidence).solid
    assert solid is not None
    steps = roof_steps(solid, OUTLINE)
    made = StepPlan.of(solid, OUTLINE).moved([(s, -0.25 * float(np.sign(s.normal[0]))) for s in steps])
    assert made is not None
    assert not check_polyhedron(made)
    top = made.vertices[made.vertices[:, 2] > HIGH - 0.1]
    assert np.ptp(top[:, 1]) < 0.01
    assert np.ptp(top[:, 2]) < 0.01
    assert np.median(steps_x(made)) == pytest.approx(np.median(steps_x(solid)) - 0.25, abs=1e-3)


def unit_beside(border_x: float, high: bool) -> Evidence:
    """One of two units that touch at `border_x`, where the surface has its step; photographs show it at `TRUE_X`."""
    evidence = evidence_of(two_roofs())
    x, y = grid_points()
    mine = (x < border_x) == high
    xyz = np.column_stack([x, y, np.full(len(x), HIGH if high else LOW)])[mine]
    ends = (0.0, border_x) if high else (border_x, 20.0)
    outline, line = (
        shapely.transform(g, lambda xy: xy + ORIGIN)
        for g in (shapely.box(ends[0], 0, ends[1], 12), shapely.LineString([(border_x, 0), (border_x, 12)]))
    )
    assert evidence.heights is not None
    grid = evidence.heights.grid
    dsm = np.where(grid.centres()[0] - ORIGIN[0] < border_x, HIGH, LOW)
    cloud = PointCloud.of(xyz + np.append(ORIGIN, 0.0), BUILDING)
    return replace(
        evidence, outline=outline, points=cloud, party=(line,), heights=HeightRaster(grid, dsm, evidence.heights.dtm)
    )


@pytest.mark.parametrize(("border_x", "high", "off_m"), [
    (10.8, True, 0.8), (10.8, False, 0.0), (9.2, True, 0.0), (9.2, False, 0.8), (10.0, True, 0.0), (10.0, False, 0.0),
])  # fmt: skip
def test_photographs_tell_which_of_two_units_their_border_harms(border_x: float, high: bool, off_m: float) -> None:
    evidence = unit_beside(border_x, high)
    solid = modelled(evidence).solid
    assert solid is not None
    seen = seen_elsewhere(solid, evidence)
    assert seen[:, 0].sum() == pytest.approx(12 * off_m, abs=0.8)
    harm = probability_of_harm(seen, evidence.outline.area)
    assert harm > 0.99 if off_m else harm < 0.01
    for nothing in (replace(evidence, photographs=()), replace(evidence, party=())):
        assert probability_of_harm(seen_elsewhere(solid, nothing), evidence.outline.area) == 0.0


def border_and_surface(low_z: float, off: float) -> tuple[list[shapely.LineString], Grid, NDArray[np.float64]]:
    """A border so far to the right of the true one, upwards, and a surface whose step is smeared beyond it."""
    grid = Grid(ORIGIN[0] - 4, ORIGIN[1] + 16, CELL, 160, 224)
    x = grid.centres()[0] - ORIGIN[0]
    line = shapely.LineString(np.array([[TRUE_X + off, 0.0], [TRUE_X + off, 12.0]]) + ORIGIN)
    return [line], grid, np.interp(x, (TRUE_X, TRUE_X + 0.6), (HIGH, low_z))


@pytest.mark.parametrize("low_z", [LOW, HIGH])
@pytest.mark.parametrize("off", [0.6, -0.4])
def test_a_border_between_roofs_is_where_all_photographs_show_it(low_z: float, off: float) -> None:
    images = [photograph(c, TRUE_X, k, low_z) for k, c in enumerate(CENTRES)]
    lines, grid, dsm = border_and_surface(low_z, off)
    assert border_shifts(lines, grid, dsm, images) == pytest.approx([-off], abs=0.05)
    back = [shapely.reverse(line) for line in lines]
    assert border_shifts(back, grid, dsm, images) == pytest.approx([off], abs=0.05)


def test_a_border_stays_where_photographs_do_not_agree_or_nothing_is_known_of_the_roofs() -> None:
    places = np.random.default_rng(5).uniform(9.0, 11.0, len(CENTRES))
    contrary = [photograph(c, x, k) for k, (c, x) in enumerate(zip(CENTRES, places, strict=True))]
    lines, grid, dsm = border_and_surface(LOW, 0.6)
    assert border_shifts(lines, grid, dsm, contrary) == [0.0]
    images = [photograph(c, TRUE_X, k) for k, c in enumerate(CENTRES)]
    assert border_shifts(lines, grid, np.full(grid.shape, np.nan), images) == [0.0]
    assert border_shifts(lines, grid, dsm, ()) == [0.0]
