"""Truth of a synthetic town: rasters by rays cast straight down, and everything with an outline as plain records."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt, maximum_filter, minimum_filter

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray, IntArray
from cityflow.core.grid import Grid, grown
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.mesh import Part, TownMesh
from cityflow.synthetic.prisms import DECK_WIDTH_M
from cityflow.synthetic.town import Town
from cityflow.synthetic.town_cuts import blocks_of, cut_lines
from cityflow.synthetic.town_hulls import Record, hull_layers

NO_PART = 255
PASSING_PARTS = (Part.FOLIAGE, Part.TRUNK, Part.CAR)
GROUND_PARTS = (Part.GROUND, Part.STREET)
NO_BUILDING = (*GROUND_PARTS, Part.WATER, Part.BRIDGE)
STEP_SLOPE, STEP_M = 4.5, 0.1
"""A step is more than 0.1 m + 4.5 cells of fall within 3 x 3 cells: steeper than the steepest roof but spires."""
RAYS_AT_ONCE = 2_000_000
OVER_M = 50.0


@dataclass(frozen=True, slots=True)
class TruthRasters:
    """(rows, cols) each, at the centres of the grid's cells; NaN, `NO_PART` and -1 beyond the town.

    Attributes
    ----------
    dsm : float64 height of the first thing met from above, leaves included; metres
    dsm_bare : the same without trees and cars
    dtm : height of the ground, also under buildings
    part : uint8, `Part` of what `dsm` met;  part_bare : of what `dsm_bare` met
    unit : int64 index into `Town.units` of what `dsm` met, -1 for none
    """

    grid: Grid
    dsm: FloatArray
    dsm_bare: FloatArray
    dtm: FloatArray
    part: ByteArray
    part_bare: ByteArray
    unit: IntArray


def truth_rasters(town: Town, grid: Grid) -> TruthRasters:
    """Cast one ray per cell centre."""
    x, y = grid.centres()
    mesh = town.mesh(grown(grid.bounds, 1.0))
    dsm, triangle = _first_from_above(mesh, x, y)
    bare_mesh = without(mesh, PASSING_PARTS)
    dsm_bare, bare_triangle = _first_from_above(bare_mesh, x, y)
    met = triangle != NOTHING
    part = np.where(met, mesh.part[triangle], NO_PART).astype(np.uint8)
    part_bare = np.where(bare_triangle != NOTHING, bare_mesh.part[bare_triangle], NO_PART).astype(np.uint8)
    unit = np.where(met, mesh.unit[triangle], -1).astype(np.int64)
    return TruthRasters(grid, dsm, dsm_bare, town.dtm(x, y), part, part_bare, unit)


def without(mesh: TownMesh, parts: tuple[Part, ...]) -> TownMesh:
    """The mesh without triangles of some parts."""
    keep = ~np.isin(mesh.part, parts)
    per_triangle = ("part", "material", "unit", "tint", "texture_origin", "texture_u", "texture_v", "seed", "triangles")
    return replace(mesh, **{name: getattr(mesh, name)[keep] for name in per_triangle})


def _first_from_above(mesh: TownMesh, x: FloatArray, y: FloatArray) -> tuple[FloatArray, IntArray]:
    """Height and triangle that a vertical ray at each x, y meets first; NaN and `NOTHING` where there is none."""
    scene = Scene(mesh)
    top = float(mesh.vertices[:, 2].max()) + OVER_M
    start = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, top)]) - scene.origin
    down = np.broadcast_to(np.array([0.0, 0.0, -1.0]), start.shape)
    z, triangle = np.full(x.size, np.nan), np.full(x.size, NOTHING)
    for first in range(0, x.size, RAYS_AT_ONCE):
        rows = slice(first, first + RAYS_AT_ONCE)
        triangle[rows], length = scene.first_hits(start[rows], down[rows])
        z[rows] = np.where(triangle[rows] == NOTHING, np.nan, top - length)
    return z.reshape(x.shape), triangle.reshape(x.shape)


def height_steps(dsm: FloatArray, cell: float) -> BoolArray:
    """Cells at a height step: the 3 x 3 cells around fall more than any roof plane would."""
    filled = np.where(np.isfinite(dsm), dsm, 0.0)
    return np.asarray(maximum_filter(filled, 3) - minimum_filter(filled, 3) > STEP_M + STEP_SLOPE * cell)


@dataclass(frozen=True, slots=True)
class JudgedCells:
    """Where a surface model is judged. `open_cells`: truth is ground or roof, more than 2 cells from a step.
    `rim`: ground, roof or what belongs to buildings within 1 m of a roof's edge."""

    open_cells: BoolArray
    rim: BoolArray


def judged_cells(truth: TruthRasters, apart_px: float = 2.0, rim_m: float = 1.0) -> JudgedCells:
    """Cells of both kinds; those under leaves or cars are in neither."""
    steps = height_steps(truth.dsm, truth.grid.cell)
    plain = np.isin(truth.part, (*GROUND_PARTS, Part.ROOF))
    far = _distance_px(steps) > apart_px
    built = (truth.part_bare != NO_PART) & ~np.isin(truth.part_bare, NO_BUILDING)
    edges = height_steps(truth.dsm_bare, truth.grid.cell) & maximum_filter(built, 3)
    near = _distance_px(edges) * truth.grid.cell <= rim_m
    hard = (truth.part != NO_PART) & ~np.isin(truth.part, PASSING_PARTS)
    return JudgedCells(plain & far, near & hard)


def _distance_px(cells: BoolArray) -> FloatArray:
    """Distance of every cell to the nearest chosen one, cells; infinite where none is chosen."""
    if not cells.any():
        return np.full(cells.shape, np.inf)
    return np.asarray(distance_transform_edt(~cells), np.float64)


def town_truth(town: Town) -> dict[str, list[Record]]:
    """Layers of geometry (world) with properties that any vector format takes."""
    layers: dict[str, list[Record]] = {
        "units": [(u.wall_outline, _unit_properties(town, u.index)) for u in town.units],
        "wall_outlines": [(u.wall_outline, {"unit": u.id, "block": u.block}) for u in town.units],
        "roof_outlines": [(u.roof_outline, {"unit": u.id, "block": u.block}) for u in town.units],
        "roof_planes": _roof_planes(town),
        "windows": _windows(town),
        "cut_lines": _cut_lines(town),
        "blocks": _blocks(town),
        "gaps": [(g.polygon, {"tree": g.tree, "units": _ids(town, g.between)}) for g in town.gaps],
        "trees": _trees(town),
        "cars": [(p, {"height_m": 1.45}) for p in town.cars.polygons()],
    }
    if town.parameters.level:
        layers |= hull_layers(town.units)
    if town.bridge is not None:
        layers["water"] = [(town.terrain.water_polygon(town.bounds), {"height_m": town.terrain.river[3]})]
        layers["bridges"] = [(town.bridge.polygon, {"width_m": DECK_WIDTH_M})]
    return layers


def _unit_properties(town: Town, index: int) -> dict[str, Any]:
    unit = town.units[index]
    style = unit.style
    return {
        "id": unit.id,
        "block": unit.block,
        "row": unit.row,
        "shape": unit.shape,
        "base_m": round(unit.base_m, 3),
        "floor_m": round(unit.floor_m, 3),
        "eave_m": round(unit.eave_m, 3),
        "ridge_m": round(unit.ridge_m, 3),
        "overhang_m": round(_overhang(unit.wall_outline, unit.roof_outline), 3),
        "facade": style.facade.material.name.lower(),
        "facade_colour": _hex(style.facade.tint),
        "roof": style.roof.material.name.lower(),
        "roof_colour": _hex(style.roof.tint),
        "twin_of": town.units[unit.twin_of].id if unit.twin_of >= 0 else "",
        "pipe_left": unit.pipes[0],
        "pipe_right": unit.pipes[1],
    }


def _overhang(walls: shapely.Polygon, roof: shapely.Polygon) -> float:
    """How far the roof reaches beyond the walls, metres."""
    edge = shapely.points(shapely.get_coordinates(roof.exterior))
    return float(shapely.distance(edge, walls).max())


def _roof_planes(town: Town) -> list[Record]:
    records: list[Record] = []
    for unit in town.units:
        for number, face in enumerate(unit.roof_planes):
            ring = shapely.get_coordinates(face.polygon)
            heights = face.plane.z(ring[:, 0], ring[:, 1])
            values = {
                "unit": unit.id,
                "face": number,
                "type": face.kind,
                "slope_deg": round(face.plane.slope_deg, 4),
                "aspect_deg": None
                if face.plane.slope_x == face.plane.slope_y == 0
                else round(face.plane.aspect_deg, 4),
                "slope_x": face.plane.slope_x,
                "slope_y": face.plane.slope_y,
                "height_at_first_corner_m": float(heights[0]),
            }
            records.append((face.polygon, values))
    return records


def _windows(town: Town) -> list[Record]:
    windows = town.windows
    return [
        (shapely.Polygon(corners), {"unit": town.units[int(k)].id, "type": "door" if is_door else "window"})
        for k, corners, is_door in zip(windows.unit, windows.corners, windows.is_door, strict=True)
    ]


def _cut_lines(town: Town) -> list[Record]:
    return [
        (
            cut.line,
            {
                "units": _ids(town, cut.units),
                "height": cut.height,
                "roof": cut.roof,
                "facade": cut.facade,
                "gap": cut.gap,
                "tree": cut.tree,
                "none": cut.none,
            },
        )
        for cut in cut_lines(town.units, town.gaps)
    ]


def _blocks(town: Town) -> list[Record]:
    return [
        (b.outline, {"id": b.id, "units": _ids(town, b.units), "count": len(b.units), "filled_gaps": b.filled_gaps})
        for b in blocks_of(town.units, town.gaps)
    ]


def _trees(town: Town) -> list[Record]:
    t = town.trees
    return [
        (shapely.Point(x, y), {"ground_m": float(z), "radius_m": float(r), "height_m": float(h)})
        for x, y, z, r, h in zip(t.x, t.y, t.ground, t.radius, t.height, strict=True)
    ]


def _ids(town: Town, units: tuple[int, ...]) -> str:
    """Ids with a blank between: no list, so that every vector format takes it."""
    return " ".join(town.units[k].id for k in units)


def _hex(tint: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*tint)
