"""Checks a catalog for missing or contradictory data before a run."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import shapely

from cityflow.catalog.check_files import MADE_AGAIN, check_file, read_files
from cityflow.catalog.check_images import check_images
from cityflow.catalog.check_outlines import check_outlines
from cityflow.catalog.check_poses import check_poses
from cityflow.catalog.check_results import Seen
from cityflow.catalog.file_questions import Reading, told_of
from cityflow.catalog.file_reading import CheckedFile, LidarContents
from cityflow.catalog.findings import CheckReport, Level
from cityflow.catalog.maps import write_maps
from cityflow.core.grid import Bounds, bounds_meet
from cityflow.core.points import GROUND
from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import Catalog, ImageAsset, LidarAsset, RasterAsset, read_catalog
from cityflow.io.catalog.stac_outside import refuse_outside
from cityflow.io.crs import contradiction, suspicion, vertical_datum
from cityflow.io.points.las import Dropped
from cityflow.io.points.las_header import LasHeader
from cityflow.io.rasters.raster_header import read_raster_header
from cityflow.io.tables.feature_ids import listing

SPARSE_PER_M2 = 2.0
"""Below this a roof plane of 10 m² has fewer than 20 points; set by hand."""
TALL_M = 1500.0
"""No town has its lowest and highest point farther apart; heights in feet or blunders do."""
OVERLAP_SHARE = 0.02
"""Outlines of which a larger share lies under others are named; set by hand."""
CLASS_NAMES = {
    0: "never classified", 1: "unclassified", 2: "ground", 3: "low vegetation", 4: "medium vegetation", 5: "high vegetation",
    6: "building", 7: "low noise", 9: "water", 17: "bridge", 18: "high noise", 26: "civil structure",
}  # fmt: skip


def check_catalog(
    catalog: str | Path | Catalog,
    maps: str | Path | None = None,
    *,
    allow_outside: bool = False,
    reading: Reading | None = None,
) -> CheckReport:
    """Read every header, take every checksum, compare; of images, say what their flight will see.

    Parameters
    ----------
    maps : a folder for maps of that
    allow_outside : it may name files elsewhere, wherever it comes from
    reading : where files are read; one after another in this process where it is not given

    Raises
    ------
    CatalogError
        Where there is no readable catalog at all.
    """
    known = catalog if isinstance(catalog, Catalog) else read_catalog(catalog, allow_outside=allow_outside)
    if not allow_outside and not isinstance(catalog, Catalog):
        refuse_outside(known)
    seen = Seen()
    for note in known.notes:
        seen.say(Level.WARNING, known.href, note)
    reading = reading or Reading()
    files = read_files(known, reading)
    for asset, file in zip(known.assets, files, strict=True):
        check_file(asset, file.digest, seen)
    for lidar, file in zip(known.lidar, files[: len(known.lidar)], strict=True):
        _check_lidar(lidar, file, known, seen)
    _check_points(known, seen)
    _check_neighbours(known, seen)
    for raster in known.rasters.values():
        _check_raster(raster, known, seen)
    if known.outlines is not None:
        check_outlines(known.outlines, known, seen)
    _check_whole(known, seen)
    rows = _summary(known, seen)
    if known.images:
        images = [(a, f) for a, f in zip(known.assets, files, strict=True) if isinstance(a, ImageAsset)]
        found = check_images(known, {a.name: f.contents for a, f in images}, seen.bad_images)
        of_poses, relative = check_poses([a for a, f in images if a.name in found.footprints], known.title, reading)
        seen.findings += [*found.findings, *of_poses]
        rows = _with_images(rows, {**found.summary, **relative})
        if maps is not None:
            write_maps(maps, known, found)
    order = {level: i for i, level in enumerate(Level)}
    findings = sorted(seen.findings, key=lambda f: order[f.level])
    return CheckReport(known.title, tuple(findings), rows)


def _with_images(rows: dict[str, str], images: Mapping[str, str]) -> dict[str, str]:
    """What is said of images stands before licence and outlines."""
    last = ("outlines", "licence")
    first = {key: value for key, value in rows.items() if key not in last}
    return first | dict(images) | {key: value for key, value in rows.items() if key in last}


def _check_lidar(asset: LidarAsset, file: CheckedFile, catalog: Catalog, seen: Seen) -> None:
    if not isinstance(file.contents, LidarContents):
        if not any(f.where == asset.href and f.level is Level.ERROR for f in seen.findings):
            error = told_of(file.contents, asset.href)
            seen.say(Level.ERROR, error.where, error.problem, error.remedy)
        return
    header, seen.samples[asset.name] = file.contents.header, file.contents.sample
    seen.headers[asset.name] = header
    if header.points != asset.points:
        problem = f"the header says {header.points:,} points, the catalog {asset.points:,}"
        seen.say(Level.ERROR, asset.href, problem, MADE_AGAIN)
    if not np.allclose(header.bounds, asset.bounds, rtol=0, atol=0.01):
        seen.say(Level.ERROR, asset.href, "the header's extent is not that in the catalog", MADE_AGAIN)
    against = contradiction(catalog.reference, header.crs) if header.crs is not None else ""
    if against:
        level = Level.WARNING if catalog.reference.is_local else Level.ERROR
        seen.say(level, asset.href, against, "make the catalog again with the CRS of the file, or reproject the file")
    _check_values(asset, header, catalog, seen)


def _check_values(asset: LidarAsset, header: LasHeader, catalog: Catalog, seen: Seen) -> None:
    doubt = suspicion(catalog.reference, header.bounds)
    if doubt:
        seen.say(
            Level.ERROR, asset.href, doubt, "assign the CRS in which the coordinates are metres, or reproject the file"
        )
    low, high = header.z_range
    if high - low > TALL_M:
        problem = f"heights from {low:,.0f} to {high:,.0f}: blunders, or not metres"
        seen.say(Level.WARNING, asset.href, problem, "remove outliers, or convert the heights to metres")
    dropped = seen.samples[asset.name].dropped
    if dropped != Dropped():
        problem = f"of {seen.samples[asset.name].points:,} points looked at, {dropped.withheld:,} are withheld and {dropped.absurd:,} impossibly high or low"
        seen.say(Level.NOTE, asset.href, problem, "they are left out")
    if header.density < SPARSE_PER_M2:
        problem = f"{header.density:.2f} points per m² of its extent"
        seen.say(
            Level.WARNING, asset.href, problem, f"small roofs need {SPARSE_PER_M2:g} or more; expect simpler models"
        )


def _check_points(catalog: Catalog, seen: Seen) -> None:
    """Classes and returns concern the survey, not each file."""
    classes, returns = _classes(seen), max((s.returns for s in seen.samples.values()), default=0)
    if seen.samples and GROUND not in classes:
        remedy = "nothing to do, but check the DTM"
        seen.say(
            Level.NOTE,
            catalog.href,
            "no point is classified as ground: the terrain is estimated from the points",
            remedy,
        )
    mixed = [n for n, s in seen.samples.items() if GROUND not in s.classes] if GROUND in classes else []
    if mixed:
        remedy = "classify all files in the same way"
        seen.say(Level.WARNING, listing(mixed), "no ground points, although other files have them", remedy)
    if seen.samples and returns <= 1:
        problem = "no pulse has more than one return: only roughness separates vegetation from buildings"
        seen.say(Level.NOTE, catalog.href, problem)


def _classes(seen: Seen) -> Counter[int]:
    total: Counter[int] = Counter()
    for each in seen.samples.values():
        total.update(each.classes)
    return total


def _check_neighbours(catalog: Catalog, seen: Seen) -> None:
    """The same file twice, and files over the same ground."""
    by_checksum = defaultdict(list)
    for asset in catalog.lidar:
        by_checksum[asset.checksum].append(asset.name)
    for names in by_checksum.values():
        if len(names) > 1:
            seen.say(Level.ERROR, " = ".join(names), "the same file is there more than once", "keep one of them")
    for a, b, share in _overlaps(catalog):
        if a.checksum != b.checksum:
            problem = f"their extents overlap by {share:.0%} of the smaller"
            remedy = "all points are used; if they are the same points, remove one file"
            seen.say(Level.NOTE, f"{a.name}, {b.name}", problem, remedy)


def _overlaps(catalog: Catalog) -> Iterator[tuple[LidarAsset, LidarAsset, float]]:
    boxes = shapely.box(*np.array([a.bounds for a in catalog.lidar]).reshape(-1, 4).T)
    tree = shapely.STRtree(boxes)
    first, second = tree.query(boxes, predicate="intersects")
    for i, j in sorted(zip(first.tolist(), second.tolist(), strict=True)):
        if i < j:
            smaller = min(boxes[i].area, boxes[j].area)
            share = boxes[i].intersection(boxes[j]).area / smaller if smaller > 0 else 0.0
            if share > OVERLAP_SHARE:
                yield catalog.lidar[i], catalog.lidar[j], share


def _check_raster(asset: RasterAsset, catalog: Catalog, seen: Seen) -> None:
    try:
        header = read_raster_header(asset.href)
    except CatalogError as error:
        seen.fail(error, asset.href)
        return
    if header.crs is None:
        seen.say(Level.NOTE, asset.href, f"carries no CRS; {catalog.reference.name} is assumed")
    elif contradiction(catalog.reference, header.crs):
        seen.say(Level.NOTE, asset.href, f"is in {header.crs.name} and is reprojected when it is read")
    if catalog.lidar and not bounds_meet(asset.bounds, catalog.bounds):
        seen.say(Level.ERROR, asset.href, f"the {asset.kind} does not meet the LiDAR survey", "check its CRS")
    elif catalog.lidar and not _contains(asset.bounds, catalog.bounds):
        seen.say(Level.WARNING, asset.href, f"the {asset.kind} covers the LiDAR survey in part only")


def _contains(outer: Bounds, inner: Bounds) -> bool:
    return outer[0] <= inner[0] and outer[1] <= inner[1] and outer[2] >= inner[2] and outer[3] >= inner[3]


def _check_whole(catalog: Catalog, seen: Seen) -> None:
    reference = catalog.reference
    if reference.is_local:
        seen.say(Level.NOTE, catalog.href, "a local frame: products carry no CRS")
    elif reference.vertical_epsg is None:
        remedy = (
            f"make the catalog again with the code of the heights' datum behind a plus: --crs {reference.code}+NNNN"
        )
        seen.say(Level.WARNING, catalog.href, f"{reference.code} does not state the datum of heights", remedy)
    if not catalog.lidar and not catalog.images and "dsm" not in catalog.rasters:
        remedy = "make the catalog again with --lidar, --images or --dsm"
        seen.say(Level.ERROR, catalog.href, "the catalog has no LiDAR file, no image and no DSM", remedy)
    if catalog.licence in ("", "other") and not catalog.attribution:
        seen.say(
            Level.NOTE, catalog.href, "neither licence nor attribution is stated", "give --licence and --attribution"
        )
    undated = [a.name for a in catalog.lidar if not a.date] + [a.name for a in catalog.images if not a.date]
    if undated:
        seen.say(Level.NOTE, listing(undated), "no date is known", "give the day of the survey with --date")


def _summary(catalog: Catalog, seen: Seen) -> dict[str, str]:
    x_min, y_min, x_max, y_max = catalog.bounds
    points = sum(h.points for h in seen.headers.values())
    area = sum((h.bounds[2] - h.bounds[0]) * (h.bounds[3] - h.bounds[1]) for h in seen.headers.values())
    rows = {
        "CRS": f"{catalog.reference.code} {catalog.reference.name}",
        "heights": vertical_datum(catalog.reference),
        "extent": f"{x_min:,.1f} to {x_max:,.1f}, {y_min:,.1f} to {y_max:,.1f} ({x_max - x_min:,.0f} × {y_max - y_min:,.0f} m)",
        "date": catalog.date or "unknown",
    }
    if catalog.lidar:
        rows["LiDAR"] = f"{len(seen.headers)} of {len(catalog.lidar)} files readable, {points:,} points"
    if catalog.sparse is not None:
        rows["tie points"] = f"{catalog.sparse.points:,}"
    if seen.headers:
        low, high = min(h.z_range[0] for h in seen.headers.values()), max(h.z_range[1] for h in seen.headers.values())
        rows["density"] = f"{points / area:.1f} points per m² of the files' extents" if area else "unknown"
        rows["z"] = f"{low:.2f} to {high:.2f}"
        rows["returns"] = f"up to {max(s.returns for s in seen.samples.values())}"
        rows["classes"] = _classes_in_words(seen)
    for kind, raster in catalog.rasters.items():
        rows[kind.upper() if kind != "ortho" else "ortho"] = (
            f"{raster.shape[1]} × {raster.shape[0]} cells of {raster.cell:g} m"
        )
    if catalog.outlines is not None:
        rows["outlines"] = (
            f"{len(seen.outlines)}, {len(seen.outlines) - seen.outside} in the survey, {seen.outside} outside"
        )
    rows["licence"] = f"{catalog.licence}" + (f"; {catalog.attribution}" if catalog.attribution else "")
    return rows


def _classes_in_words(seen: Seen) -> str:
    classes = _classes(seen)
    total = sum(classes.values())
    return ", ".join(f"{c} {CLASS_NAMES.get(c, '')}".strip() + f" {n / total:.1%}" for c, n in sorted(classes.items()))
