"""Evidence of one unit for reconstruction: points, façades, rasters, orthos, and its surroundings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple, NoReturn

import numpy as np
import shapely

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.building import Outline
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.points import (
    BUILDING,
    HIGH_VEGETATION,
    NOISE,
    PointCloud,
)
from cityflow.core.reconstruction import Evidence, HeightRaster, Picture
from cityflow.errors import CityflowError, RefusedUnit
from cityflow.flow.json_writers import SHARED
from cityflow.flow.store import Store
from cityflow.flow.typed import TaskInputs
from cityflow.geometry.outline_distances import distances_to_outline
from cityflow.handover.cached_reads import read_points
from cityflow.handover.house_points import LOW_M, NO_PART_OF_HOUSES
from cityflow.handover.layer_files import GivenOrtho, given_colours
from cityflow.handover.surface_windows import read_windows
from cityflow.handover.surfaces import Surfaces
from cityflow.handover.wall_point_files import read_covered, read_walls
from cityflow.io.crs import resolve
from cityflow.io.rasters.remote_raster import raster_file
from cityflow.io.rasters.surface_zarr import window_of
from cityflow.surface.evenness import NEIGHBOURS
from cityflow.surface.sample import sample
from cityflow.surface.vegetation import is_foliage
from cityflow.survey.kept_by_survey import kept_until
from cityflow.survey.surface_source import IMAGES, LIDAR, RASTERS, ZARR
from cityflow.survey.survey import UNREAD, Survey
from cityflow.survey.tile_lattice import SEEN_AROUND_M
from cityflow.survey.unit_entry import UnitEntry

GROUND_SAMPLING_M = 0.5
"""Spacing of the places along an outline whose lowest terrain is the floor."""
LOWEST_ROOF_M = 1.5
"""Lower points are no roof where no classes tell; set by hand."""
AROUND_M = 2.0
"""What stands this near to an outline belongs to its unit's surroundings: eaves, balconies, the outline's own error."""

RASTER_MARGIN_M = SEEN_AROUND_M
"""The widest eaves, and a stretch of ground beyond them."""


@dataclass(frozen=True, slots=True)
class EvidenceInputs(TaskInputs):
    """What `read_evidence` reads.

    Attributes
    ----------
    pieces : RUN-relative paths of index pieces;  unread : files whose points are missing
    walls : RUN-relative paths of façades of images
    failed_surfaces : tiles under the unit without a surface
    own_orthos : whether the run has true orthos;  given_orthos : those of the catalog
    crs : code of the survey's CRS
    classified : whether classes tell buildings;  uneven : else what of a scanner's points is foliage, 0 if not requested
    matched : whether points are matched, not scanned;  alike_m : cell of a given DSM whose points are alike, metres; 0 for others
    """

    pieces: tuple[str, ...]
    unread: tuple[str, ...]
    walls: tuple[str, ...]
    failed_surfaces: tuple[str, ...]
    surfaces: Annotated[Surfaces, SHARED]
    own_orthos: bool
    given_orthos: tuple[GivenOrtho, ...]
    crs: str
    classified: bool
    uneven: float
    matched: bool
    alike_m: float


def evidence_of(survey: Survey, unit: UnitEntry) -> tuple[dict[str, str], EvidenceInputs]:
    """What a unit's evidence depends on, beside its outline: name → digest; and where `read_evidence` finds it."""
    under = survey.lattice.tiles_under(unit)
    around = grown(unit.bounds, AROUND_M)
    pieces, unread = survey.index.over(around), survey.unread(around)
    left = _left_under(survey, under)
    classified, uneven = survey.lidar.has_building_class, _uneven(survey)
    inputs = {
        **left.surfaces, **pieces, **left.walls, **{f"unread {f}": "missing" for f in unread}, **left.orthos,
        "building class": str(classified), **({"uneven": str(uneven)} if uneven else {}),
    }  # fmt: skip
    return inputs, EvidenceInputs(
        tuple(pieces), tuple(unread), tuple(left.walls), left.failed_surfaces, survey.surfaces,
        survey.reads_own_orthos, survey.ortho_inputs, survey.catalog.reference.code, classified, uneven,
        survey.source.kind != LIDAR, survey.catalog.rasters["dsm"].cell if survey.source.kind == RASTERS else 0.0,
    )  # fmt: skip


class _Left(NamedTuple):
    """What tasks have left of the tiles under a unit: name → digest; the same for most units of a tile."""

    surfaces: dict[str, str]
    failed_surfaces: tuple[str, ...]
    walls: dict[str, str]
    orthos: dict[str, str]


@kept_until("surface", "ortho", "walls")
def _left_under(survey: Survey, under: tuple[str, ...]) -> _Left:
    results = survey.results
    # façades of images, independent of the source of the outlines
    seen = under if survey.source.kind == IMAGES else ()
    own_orthos = {f"ortho {t}": results.digest_of("ortho", t) for t in under}
    return _Left(
        {f"surface {t}": results.digest_of("surface", t) for t in under}, tuple(t for t in under if results.has_failed("surface", t)),
        {p: d for t in seen for p, d in results.outputs_of("walls", t).items()},
        own_orthos if survey.reads_own_orthos else {kind: r.checksum for kind, r in survey.given_orthos().items()},
    )  # fmt: skip


def _uneven(survey: Survey) -> float:
    """What of a scanner's points is foliage; 0 where classes tell, or where points are cells of a surface."""
    scanned = survey.source.kind == LIDAR and not survey.lidar.has_building_class
    return survey.parameters.surface.vegetation.uneven if scanned else 0.0


def read_evidence(store: Store, given: EvidenceInputs, outline: Outline, wanted_type: str = "") -> Evidence:
    """All that is given, cut out around the unit.

    Raises
    ------
    RefusedUnit
        There is no terrain along the outline.
    CityflowError
        There is none because something before this failed.
    """
    near = grown(outline.polygon.bounds, AROUND_M)
    seen = _rasters(store, given, outline)
    grid, layers = seen.grid, seen.layers
    points = in_order(read_points(store, given.pieces, near))
    shapely.prepare(outline.polygon)
    inside = points.take(shapely.contains_xy(outline.polygon, points.xyz[:, 0], points.xyz[:, 1]))
    floor = floor_of(grid, layers["dtm"], outline.polygon)
    if not np.isfinite(floor):
        _complain(given, len(inside))
    close = points.take(distances_to_outline(outline.polygon, points.xyz) <= AROUND_M)
    return Evidence(
        outline.id, outline.polygon, roof_points(inside, grid, layers, given.classified, given.uneven), floor,
        outline.aspects, outline.slopes,
        around=part_of_houses(close, grid, layers["dtm"]), walls=_walls_in_order(read_walls(store, given.walls, near)),
        heights=seen.heights, pictures=seen.pictures or _given_pictures(given, outline),
        party=outline.party, edges=outline.edges, roof=outline.roof, wanted_type=wanted_type, alike_m=given.alike_m,
        rims=outline.rims, matched=given.matched, covered=_covered(store, given, outline, near),
    )  # fmt: skip


def in_order(points: PointCloud) -> PointCloud:
    """The same points in an order of their own: another index or tiling must not change a sum in its last digit."""
    x, y, z = points.xyz.T
    keys = (points.number_of_returns, points.return_number, points.classification, z, y, x)
    return points.take(np.lexsort(keys))


def _covered(store: Store, given: EvidenceInputs, outline: Outline, near: Bounds) -> FloatArray:
    """Covered points inside the outline, in an order of their own."""
    xyz = read_covered(store, given.walls, near)
    xyz = xyz[shapely.contains_xy(outline.polygon, xyz[:, 0], xyz[:, 1])]
    return np.asarray(xyz[np.lexsort(xyz.T[::-1])])


def _walls_in_order(walls: WallPoints) -> WallPoints:
    x, y, z = walls.xyz.T
    return walls.take(np.lexsort((walls.views, walls.sigma, walls.normal[:, 1], walls.normal[:, 0], z, y, x)))


@dataclass(frozen=True, slots=True)
class _Rasters:
    """What the run's rasters show of a unit.

    Attributes
    ----------
    grid, layers : terrain and classes within `AROUND_M`, on the grid that they are found on
    heights : within `RASTER_MARGIN_M`, on the finest grid that there is
    pictures : the run's own true ortho, where it has one
    """

    grid: Grid
    layers: Mapping[str, np.ndarray]
    heights: HeightRaster
    pictures: tuple[Picture, ...]


def _rasters(store: Store, given: EvidenceInputs, outline: Outline) -> _Rasters:
    """Each group is opened once: that takes longer than to read the few cells of a unit."""
    bounds, near = (grown(outline.polygon.bounds, m) for m in (RASTER_MARGIN_M, AROUND_M))
    surfaces, own = given.surfaces, given.own_orthos
    alone = surfaces.group == ZARR
    names = ("dsm", "dtm", *(("class",) if alone else ()), *(("ortho", "ortho_seen") if own else ()))
    fine, found = read_windows(store, ZARR, surfaces.fine, bounds, names)
    if alone:
        grid = window_of(fine, near)
        layers = {k: found[k][fine.slices(grid)] for k in ("dtm", "class")}
    else:
        grid, layers = read_windows(store, surfaces.group, surfaces.working, near, ("dtm", "class"))
    heights = HeightRaster(fine, found["dsm"].astype(np.float64), found["dtm"].astype(np.float64))
    return _Rasters(
        grid,
        layers,
        heights,
        (Picture(fine, found["ortho"], True, "ortho"),) if own and found["ortho_seen"].any() else (),
    )


def _given_pictures(given: EvidenceInputs, outline: Outline) -> tuple[Picture, ...]:
    """The orthos that the catalog names, each on cells of its own size."""
    bounds = grown(outline.polygon.bounds, RASTER_MARGIN_M)
    found = []
    for ortho in given.given_orthos:
        grid = Grid.covering(bounds, ortho.cell_m)
        with raster_file(ortho.href) as path:
            colours = given_colours(path, grid, resolve(given.crs))
        if np.isfinite(colours).any():
            found.append(
                Picture(grid, np.clip(np.rint(np.nan_to_num(colours)), 0, 255).astype(np.uint8), False, ortho.kind)
            )
    return tuple(found)


def _complain(given: EvidenceInputs, points: int) -> NoReturn:
    """No terrain: the survey's fault where something before this failed, else the outline's."""
    problem = f"no terrain height along the outline ({points} points inside)"
    unread, failed = given.unread, given.failed_surfaces
    if failed:
        raise CityflowError(
            f"{problem}: the surface of tile {', '.join(failed)} failed", remedy="rerun --failed repairs both"
        )
    if unread:
        raise CityflowError(
            f"{problem}: {UNREAD.format(', '.join(unread))}", remedy="fix the file, then rerun --failed"
        )
    raise RefusedUnit(problem)


def floor_of(grid: Grid, dtm: FloatArray | Float32Array, outline: shapely.Polygon) -> float:
    """Lowest terrain along an outline, in whole centimetres below: floors of neighbours are equal, or differ by more than a sliver.

    NaN where there is no terrain.
    """
    ground = sample(grid, dtm, *_along(outline))
    return float(np.floor(np.nanmin(ground) * 100)) / 100 if np.isfinite(ground).any() else float("nan")


def roof_points(
    points: PointCloud, grid: Grid, layers: Mapping[str, np.ndarray], classified: bool, uneven: float
) -> PointCloud:
    """Points of the building class; where the survey has no such class, high points that are not vegetation.

    Among scanned points an even patch is a roof, whatever its cells were taken for: those of a shed in a garden are few, and
    half of them have leaves in them. Where nothing is even, or too few points are there to say, those count that stopped their pulse.

    Parameters
    ----------
    layers : ``dtm`` and ``class`` on `grid`
    classified, uneven : as in `EvidenceInputs`
    """
    usable = points.take(np.isfinite(points.xyz[:, 2]))
    if classified:
        return usable.of_class(BUILDING)
    x, y, z = usable.xyz.T
    noise = np.isin(usable.classification, NOISE)
    high = usable.take((z - sample(grid, layers["dtm"], x, y) > LOWEST_ROOF_M) & ~noise)
    row, col = (np.clip(i, 0, n - 1) for i, n in zip(grid.indices(*high.xyz[:, :2].T), grid.shape, strict=True))
    kept = layers["class"][row, col] != HIGH_VEGETATION
    if not uneven:
        return high.take(kept)
    kept |= ~is_foliage(high, uneven)
    return high.take(kept if kept.sum() >= NEIGHBOURS else high.return_number >= high.number_of_returns)


def part_of_houses(points: PointCloud, grid: Grid, dtm: np.ndarray) -> PointCloud:
    """What is above the ground and of no other class."""
    usable = points.take(np.isfinite(points.xyz[:, 2]) & ~np.isin(points.classification, NO_PART_OF_HOUSES))
    x, y, z = usable.xyz.T
    return usable.take(z - sample(grid, dtm, x, y) > LOW_M)


def _along(polygon: shapely.Polygon) -> tuple[np.ndarray, np.ndarray]:
    xy = shapely.get_coordinates(shapely.segmentize(polygon, GROUND_SAMPLING_M))
    return xy[:, 0], xy[:, 1]
