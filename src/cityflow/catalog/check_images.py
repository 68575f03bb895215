"""Checks oriented images: files, poses, resolution, overlap, and the expected quality of the products."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.catalog.file_questions import told_of
from cityflow.catalog.file_reading import ImageContents
from cityflow.catalog.findings import Finding, Level
from cityflow.catalog.height_ranges import low_points, raster_points
from cityflow.catalog.image_entries import box_of
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.errors import CityflowError
from cityflow.imagery.radiometry import exposure_groups, gain_of_mid_grey
from cityflow.io.catalog.stac import Catalog, ImageAsset, united
from cityflow.io.crs import suspicion
from cityflow.io.fetch import local_file
from cityflow.io.images.image_header import check_against
from cityflow.io.points.las import read_points
from cityflow.io.tables.feature_ids import listing
from cityflow.orientation.coverage import Coverage, coverage
from cityflow.orientation.image_overlap import Overlap, overlaps
from cityflow.orientation.look_directions import look_directions
from cityflow.orientation.plausibility import SURVEY, datum_doubt, implausible
from cityflow.orientation.shortfalls import ShortfallParameters, shortfalls
from cityflow.orientation.sights import looks_level
from cityflow.orientation.views import View, footprints, gsd

MAP_CELLS = 300
"""Cells along the longer side of the maps; set by hand, as are those below."""
STEPS_PER_CELL = 2.0
"""A cell is no smaller than this many pixels on the ground."""
LEFT_OUT = "it is left out of a run; fix it and make the catalog again"


@dataclass(frozen=True, slots=True)
class Preflight:
    """What is known of a flight before it is matched.

    Attributes
    ----------
    findings : in order of images, then of the whole
    summary : rows for the report
    maps : on the ground;  frames : look directions;  footprints : by image
    """

    findings: tuple[Finding, ...]
    summary: Mapping[str, str]
    maps: Coverage
    frames: tuple[LocalFrame, ...]
    footprints: Mapping[str, shapely.Polygon]


def check_images(catalog: Catalog, files: Mapping[str, object], unusable: Sequence[str] = ()) -> Preflight:
    """Look at every image's header, and at what all of them see together.

    Parameters
    ----------
    files : name of an image → `file_reading.ImageContents`, or the error of who read it
    unusable : names of images whose files are already known to be bad
    """
    bad = set(unusable)
    groups = _files((a, files[a.name]) for a in catalog.images if a.name not in bad)
    findings = [
        Finding(Level.WARNING, listing(n), problem, remedy or LEFT_OUT) for (problem, remedy), n in groups.items()
    ]
    bad.update(name for names in groups.values() for name in names)
    assets = [a for a in catalog.images if a.name not in bad]
    every = [View(a.oriented, a.heights) for a in assets]
    # photographs from the street are looked at for textures only
    views = [v for v in every if not looks_level(v.image, v.heights[1])] or every
    frames = look_directions([v.image for v in views])
    ground = dict(zip((v.name for v in views), footprints(views), strict=True))
    area = wanted_area(catalog, views)
    lapped = overlaps(views, frames)
    maps = coverage(
        views, frames, _grid(views, area, ground), float(np.median([v.heights[0] for v in views])) if views else 0.0
    )
    inside = _cells_in(area, maps)
    findings += _place(catalog)
    findings += _poses(catalog, every)
    if len(views) < 2 and not catalog.lidar and "dsm" not in catalog.rasters:
        findings.append(
            Finding(Level.ERROR, catalog.href, f"{len(views)} usable images; heights need two", "add images")
        )
    for short in shortfalls(maps, inside, ShortfallParameters(), lapped):
        place = " ".join(f"{v:.0f}" for v in short.places[0]) if short.places else ""
        where = f"around {place}" if place else catalog.title
        findings.append(Finding(Level.WARNING, where, short.sentence, "add images there, or expect less there"))
    summary = _summary(assets, views, frames, maps, lapped, inside)
    return Preflight(tuple(findings), summary, maps, frames, ground)


def _files(files: Iterator[tuple[ImageAsset, object]]) -> Mapping[tuple[str, str], list[str]]:
    """Headers against cameras: problem and remedy → images."""
    groups: dict[tuple[str, str], list[str]] = defaultdict(list)
    for asset, found in files:
        try:
            if not isinstance(found, ImageContents):
                raise told_of(found, asset.href)
            check_against(found.header, asset.oriented.camera)
        except CityflowError as error:
            groups[error.problem, error.remedy].append(asset.name)
    return groups


def _place(catalog: Catalog) -> list[Finding]:
    """Whether the images' places can be coordinates of the CRS."""
    doubt = suspicion(catalog.reference, box_of([a.oriented.centre for a in catalog.images]))
    remedy = "make the catalog again with the right --crs, and with --origin where something was subtracted"
    return [Finding(Level.ERROR, catalog.href, f"images: {doubt}", remedy)] if doubt else []


def _poses(catalog: Catalog, views: Sequence[View]) -> Iterator[Finding]:
    images = [v.image for v in views]
    ground = float(np.median([v.heights[0] for v in views])) if views else None
    highest = max((v.heights[1] for v in views), default=None)
    groups: dict[tuple[str, str], list[str]] = defaultdict(list)
    for name, problem, remedy in implausible(images, ground, highest):
        groups[problem, remedy].append(catalog.title if name == SURVEY else name)
    for (problem, remedy), names in groups.items():
        yield Finding(Level.WARNING, listing(names), problem, remedy)
    dtm = catalog.rasters.get("dtm")
    if dtm is not None and catalog.sparse is not None:
        doubt = datum_doubt(low_points(sparse_points(catalog)), raster_points(dtm, catalog.reference))
        if doubt:
            yield Finding(Level.WARNING, dtm.href, doubt[1], doubt[2])


def sparse_points(catalog: Catalog) -> FloatArray:
    """(N, 3) tie points of a catalog; empty where it has none."""
    if catalog.sparse is None:
        return np.empty((0, 3))
    with local_file(catalog.sparse.href) as path:
        return read_points(path).xyz


def wanted_area(catalog: Catalog, views: Sequence[View]) -> shapely.Polygon:
    """What matters: where outlines are, else between the places that the images' axes look at."""
    if catalog.outlines is not None:
        return shapely.box(*catalog.outlines.bounds)
    places = [p for p in map(_looked_at, views) if p is not None]
    if not places:
        return (
            shapely.box(*united([(*v.image.centre[:2], *v.image.centre[:2]) for v in views]))
            if views
            else shapely.Polygon()
        )
    usual = float(np.median([gsd(v) * v.image.camera.width for v in views]))
    return shapely.MultiPoint(places).convex_hull.buffer(0.1 * usual)


def _grid(views: Sequence[View], area: shapely.Polygon, ground: Mapping[str, shapely.Polygon]) -> Grid:
    """Over the area that matters and as much again around it, as far as images see."""
    shapes = [s for s in ground.values() if not s.is_empty]
    if not shapes or area.is_empty:
        return Grid(0.0, 1.0, 1.0, 1, 1)
    room = 0.5 * max(area.bounds[2] - area.bounds[0], area.bounds[3] - area.bounds[1])
    seen = shapely.box(*shapely.total_bounds(np.array(shapes, object)).tolist())
    box = shapely.box(*area.buffer(room).bounds).intersection(seen)
    x_min, y_min, x_max, y_max = (box if not box.is_empty else seen).bounds
    finest = STEPS_PER_CELL * float(np.median([gsd(v) for v in views]))
    cell = max(max(x_max - x_min, y_max - y_min) / MAP_CELLS, finest if np.isfinite(finest) else 0.0)
    step = 10.0 ** np.floor(np.log10(cell))
    return Grid.covering((x_min, y_min, x_max, y_max), float(step * np.ceil(cell / step)))


def _cells_in(area: shapely.Polygon, maps: Coverage) -> BoolArray:
    x, y = maps.grid.centres()
    inside = shapely.contains_xy(area, x, y)
    return np.asarray(inside if inside.any() else maps.views > 0)


def _looked_at(view: View) -> tuple[float, float] | None:
    centre, axis = view.image.centre, view.image.axis
    if axis[2] > -0.35 or centre[2] <= view.heights[0]:
        return None
    x, y = centre[:2] + axis[:2] * (centre[2] - view.heights[0]) / -axis[2]
    return float(x), float(y)


def _exposures(assets: Sequence[ImageAsset]) -> dict[str, str]:
    """Groups of like exposure as the gains tell, the brightest first; nothing where there is one."""
    rows = {}
    for bands in sorted({a.bands for a in assets}):
        chosen = [a for a in assets if a.bands == bands]
        gain = gain_of_mid_grey(
            np.array([a.gain for a in chosen]), np.array([a.gamma or (1.0,) * bands for a in chosen])
        )
        group = exposure_groups(gain)
        if group.max(initial=0) == 0:
            continue
        members = [[a.name for a, g in zip(chosen, group, strict=True) if g == k] for k in range(int(group.max()) + 1)]
        stops = [float(np.log2(gain[group == k]).mean()) for k in range(len(members))]
        rows[f"exposures, {bands} bands"] = "; ".join(
            f"{len(m)} raised by {s:+.2f} stops ({listing(m)})" for m, s in zip(members, stops, strict=True)
        )
    return rows


def _summary(
    assets: Sequence[ImageAsset],
    views: Sequence[View],
    frames: Sequence[LocalFrame],
    maps: Coverage,
    lapped: Sequence[Overlap],
    inside: BoolArray,
) -> dict[str, str]:
    cameras = Counter(a.oriented.camera for a in assets)
    rows = {"images": f"{len(assets)}, {sum(a.size for a in assets) / 1e6:,.1f} MB"}
    rows["cameras"] = "; ".join(
        f"{n} of {c.width} × {c.height}, f = {c.fx:,.0f} px, {'no distortion' if c.is_pinhole else c.kind}"
        for c, n in cameras.items()
    )
    rows["look directions"] = ", ".join(f"{f.name} {len(f.images)}" for f in frames)
    if views:
        sizes = np.array([gsd(v) for v in views])
        rows["GSD"] = _range(sizes[np.isfinite(sizes)] * 100, "cm")
        rows["tilt"] = _range(np.degrees([v.image.tilt for v in views]), "°")
        rows["heights in view"] = f"{min(v.heights[0] for v in views):.1f} to {max(v.heights[1] for v in views):.1f} m"
    counted = maps.views[inside]
    if counted.size:
        rows["views"] = (
            f"{np.median(counted):.0f} per ground cell in the median, {counted.min()} to {counted.max()}; cells of {maps.grid.cell:g} m"
        )
    rows["overlap"] = ", ".join(
        f"{o.direction} {np.median(o.forward):.0%} forward, {np.median(o.side):.0%} sideways" for o in lapped
    )
    rows |= _exposures(assets)
    return rows


def _range(values: FloatArray, unit: str) -> str:
    if not len(values):
        return "unknown"
    return f"{values.min():.1f} to {values.max():.1f} {unit}, {np.median(values):.1f} in the median"
