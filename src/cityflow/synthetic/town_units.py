"""Units of the synthetic town on its terrain: outlines that tie to their neighbours, heights, roof planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Bounds
from cityflow.synthetic import roofs
from cityflow.synthetic.known_terrain import Terrain
from cityflow.synthetic.roofs import MAIN, Placement, TruthFace
from cityflow.synthetic.town_drafts import BreakDraft, GapDraft, Style, UnitDraft
from cityflow.synthetic.town_layout import PlacedBlock, StreetNet
from cityflow.synthetic.town_shapes import Volume

MAX_FALL_M, HILL_FALL_M = 4.0, 8.0
"""Terrain under one unit falls no more than this, and where houses are cut into terraces."""
LEAST_EAVE_M = 1.0
"""In terraces, no corner of a roof is nearer to the ground."""
LEVEL_ROW_FALL_M = 1.5
TIE_M = 1e-5


@dataclass(frozen=True)
class Unit:
    """A single unit (house, part of a terrace) as it was made.

    Attributes
    ----------
    id : ``u00001`` …;  index : place in `Town.units`
    block : ``b012``, the street block;  row : ``b012r0``, the terrace in it, or empty
    shape : name of the shape
    wall_outline : where the walls stand; noded with the neighbours, world metres
    roof_outline : where the roof ends, overhang included
    base_m : world height of the unit's floor;  floor_m : lowest terrain height along the outline
    eave_m, ridge_m : lowest and highest world height of the main roof
    style : colours and rhythm of the façades
    twin_of : index of the unit that this one is identical to but for the façade, or -1
    pipes : drain pipes at the left and at the right end of front and back
    volumes : solids in the plan frame of the street net, heights above `base_m`
    frame : places that frame in the world; its z is `base_m`
    breaks : where its storeys differ, in that frame, heights above `base_m`
    """

    id: str
    index: int
    block: str
    row: str
    shape: str
    wall_outline: Polygon
    roof_outline: Polygon
    base_m: float
    floor_m: float
    eave_m: float
    ridge_m: float
    style: Style
    twin_of: int
    pipes: tuple[bool, bool]
    volumes: tuple[Volume, ...]
    frame: Placement
    breaks: tuple[BreakDraft, ...] = ()

    @cached_property
    def prisms(self) -> tuple[TruthFace, ...]:
        """All roof faces before the hidden parts are cut away; they may overlap, the highest counts."""
        return tuple(self.frame.face(f) for volume in self.volumes for f in volume.faces)

    @cached_property
    def roof_planes(self) -> tuple[TruthFace, ...]:
        """Visible roof faces without overlap; together they cover the roof outline."""
        return roofs.visible_faces(self.prisms)

    def z(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Roof height (world metres) at world x, y; NaN outside the roof outline."""
        height = np.full(np.shape(x), -np.inf)
        for face in self.prisms:
            inside = shapely.intersects_xy(face.polygon, x, y)
            height = np.where(inside, np.maximum(height, face.plane.z(x, y)), height)
        return np.where(np.isfinite(height), height, np.nan)

    @property
    def bounds(self) -> Bounds:
        x_min, y_min, x_max, y_max = self.roof_outline.bounds
        return x_min, y_min, x_max, y_max


@dataclass(frozen=True, slots=True)
class Gap:
    """A gap between two units of a row (indices into `Town.units`), world polygon; `tree`: a high tree fills it."""

    polygon: Polygon
    between: tuple[int, int]
    tree: bool


@dataclass(frozen=True, slots=True)
class _Site:
    """A unit in the net's frame, with where it came from."""

    draft: UnitDraft
    block: PlacedBlock
    number: int
    walls: Polygon
    roof: Polygon


def build_units(
    blocks: Sequence[PlacedBlock], net: StreetNet, terrain: Terrain, bounds: Bounds
) -> tuple[tuple[Unit, ...], tuple[Gap, ...]]:
    """All units that the terrain and the bounds allow, and the gaps between those that remain."""
    sites = [_site(d, b, k) for b in blocks for k, d in enumerate(b.draft.units)]
    z_low, z_mean, z_high, free = _heights([s.walls for s in sites], net, terrain)
    allowed = _inside([s.roof for s in sites], net, bounds) & free
    usual = HILL_FALL_M if terrain.terraces else MAX_FALL_M
    most = [usual if s.draft.most_fall_m is None else s.draft.most_fall_m for s in sites]
    allowed &= z_high - z_low <= np.array(most)
    kept = [int(k) for k in np.flatnonzero(allowed)]
    base = _bases([sites[k] for k in kept], z_mean[kept], z_low[kept], z_high[kept])
    if terrain.terraces:
        bare = [not _buried(sites[k], b, net, terrain) for k, b in zip(kept, base, strict=True)]
        kept, base = [k for k, b in zip(kept, bare, strict=True) if b], base[bare]
    walls = _tied([sites[k].walls for k in kept])
    place = {(id(sites[k].block), sites[k].number): n for n, k in enumerate(kept)}
    units = []
    for n, k in enumerate(kept):
        site = sites[k]
        before = place.get((id(site.block), site.number - 1), -1) if site.draft.twin else -1
        frame = Placement(net.centre[0], net.centre[1], net.heading, float(base[n]))
        units.append(_unit(replace_walls(site, walls[n]), frame, n, before, float(z_low[k])))
    return tuple(units), _gaps(blocks, place, net)


def replace_walls(site: _Site, walls: Polygon) -> _Site:
    return replace(site, walls=walls)


def _site(draft: UnitDraft, block: PlacedBlock, number: int) -> _Site:
    draft = draft.moved(0.0, block.u, block.v)
    grounded = [Polygon(v.ring) for v in draft.volumes if v.of_outline]
    faces = [Polygon(f.ring) for v in draft.volumes for f in v.faces]
    walls = _one(shapely.union_all(grounded, grid_size=1e-6))
    return _Site(draft, block, number, walls, _one(shapely.union_all([walls, *faces], grid_size=1e-6)))


def _one(shape: shapely.Geometry) -> Polygon:
    """The polygon itself, oriented, without vertices in the middle of straight edges."""
    parts = [p for p in shapely.get_parts(shape) if p.geom_type == "Polygon"]
    return orient(max(parts, key=lambda p: p.area).simplify(1e-6))


def _heights(
    polygons: Sequence[Polygon], net: StreetNet, terrain: Terrain
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Lowest, mean and highest terrain height along each outline, and whether one may build there."""
    dense = shapely.segmentize(shapely.get_exterior_ring(np.array(polygons, dtype=object)), 2.0)
    uv, owner = shapely.get_coordinates(dense, return_index=True)
    xy = net.to_world(uv[:, 0], uv[:, 1])
    z, free = terrain.z(*xy), terrain.is_buildable(*xy)
    first = np.searchsorted(owner, np.arange(len(polygons)))
    count = np.diff(np.r_[first, len(owner)])
    mean = np.add.reduceat(z, first) / count
    return np.minimum.reduceat(z, first), mean, np.maximum.reduceat(z, first), np.logical_and.reduceat(free, first)


def _buried(site: _Site, base_m: float, net: StreetNet, terrain: Terrain) -> bool:
    """Whether the ground comes nearer than `LEAST_EAVE_M` to a corner of the roof."""
    faces = [(np.array(f.ring), f) for v in site.draft.volumes for f in v.faces]
    uv = np.concatenate([ring for ring, _ in faces])
    roof = np.concatenate([base_m + ring @ (f.slope_u, f.slope_v) + f.height for ring, f in faces])
    return bool((roof < terrain.z(*net.to_world(*uv.T)) + LEAST_EAVE_M).any())


def _inside(polygons: Sequence[Polygon], net: StreetNet, bounds: Bounds) -> IntArray:
    uv, owner = shapely.get_coordinates(np.array(polygons, dtype=object), return_index=True)
    x, y = net.to_world(uv[:, 0], uv[:, 1])
    out = (x < bounds[0] + 1) | (x > bounds[2] - 1) | (y < bounds[1] + 1) | (y > bounds[3] - 1)
    return np.bincount(owner[out], minlength=len(polygons)) == 0


def _bases(sites: Sequence[_Site], mean: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Floors in whole centimetres: common to level rows on nearly level ground; a twin stands with its predecessor."""
    base = np.round(mean, 2)
    groups: dict[tuple[int, int], list[int]] = {}
    for n, site in enumerate(sites):
        if site.draft.level >= 0:
            groups.setdefault((id(site.block), site.draft.level), []).append(n)
    for rows in groups.values():
        if high[rows].max() - low[rows].min() <= LEVEL_ROW_FALL_M:
            base[rows] = np.round(mean[rows].mean(), 2)
    for n in range(1, len(sites)):
        copied = sites[n].draft.row >= 0 and sites[n].number == sites[n - 1].number + 1
        if copied and sites[n].block is sites[n - 1].block and sites[n].draft.twin:
            base[n] = base[n - 1]
    return base


def _tied(polygons: Sequence[Polygon]) -> list[Polygon]:
    """Outlines with the vertices of those that they touch."""
    tree = shapely.STRtree(list(polygons))
    a, b = tree.query(np.array(polygons, dtype=object), predicate="dwithin", distance=TIE_M)
    order = np.lexsort((b, a))
    tied = list(polygons)
    for i, j in zip(a[order], b[order], strict=True):
        if i != j:
            tied[i] = orient(shapely.snap(tied[i], shapely.multipoints(shapely.get_coordinates(polygons[j])), TIE_M))
    return tied


def to_world(shape: Polygon, net: StreetNet | Placement) -> Polygon:
    """A polygon of the net's frame in the world."""
    if isinstance(net, Placement):
        return shapely.transform(shape, lambda uv: net.to_world([(float(u), float(v)) for u, v in uv]))
    return shapely.transform(shape, lambda uv: np.column_stack(net.to_world(uv[:, 0], uv[:, 1])))


def _unit(site: _Site, frame: Placement, index: int, twin_of: int, floor_m: float) -> Unit:
    draft, block = site.draft, site.block
    name = f"b{block.row:03d}{block.col:03d}"
    main = [v for v in draft.volumes if v.kind == MAIN and (v.bottom is None or v.carried)]
    heights = np.concatenate([_corner_heights(v) for v in main])
    return Unit(
        id=f"u{index + 1:05d}",
        index=index,
        block=name,
        row=f"{name}r{draft.row}" if draft.row >= 0 else "",
        shape=draft.shape,
        wall_outline=to_world(site.walls, frame),
        roof_outline=to_world(site.roof, frame),
        base_m=frame.z,
        floor_m=floor_m,
        eave_m=frame.z + float(heights.min()),
        ridge_m=frame.z + float(heights.max()),
        style=draft.style,
        twin_of=twin_of,
        pipes=draft.pipes,
        volumes=draft.volumes,
        frame=frame,
        breaks=draft.breaks,
    )


def _corner_heights(volume: Volume) -> FloatArray:
    corners = [(u * f.slope_u + v * f.slope_v + f.height) for f in volume.faces for u, v in f.ring]
    return np.array(corners)


def _gaps(blocks: Sequence[PlacedBlock], place: dict[tuple[int, int], int], net: StreetNet) -> tuple[Gap, ...]:
    gaps = []
    for block in blocks:
        for gap in block.draft.gaps:
            ends = _ends(gap, block, place)
            if min(ends) >= 0:
                ring = [(u + block.u, v + block.v) for u, v in gap.ring]
                gaps.append(Gap(to_world(orient(Polygon(ring)), net), ends, gap.tree))
    return tuple(gaps)


def _ends(gap: GapDraft, block: PlacedBlock, place: dict[tuple[int, int], int]) -> tuple[int, int]:
    a, b = (place.get((id(block), n), -1) for n in gap.between)
    return a, b
