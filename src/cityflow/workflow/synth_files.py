"""Files of a synthetic survey: poses, outlines, truth layers, mosaics of the truth rasters, catalog."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import tiles_over
from cityflow.io.control_points.point_table_write import point_table_text
from cityflow.io.crs import resolve
from cityflow.io.orientation.colmap import write_colmap
from cityflow.io.rasters.raster import write_vrt
from cityflow.io.tables.outlines_gpkg import Layer, write_geopackage
from cityflow.stages.synth import DAY, LAYERS, TRUTH_TILE_M, SynthSource, clipped, picture_path, truth_grid, writes_jpeg
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.control_marks import measured_control, true_control
from cityflow.synthetic.town import Town
from cityflow.synthetic.town_truth import town_truth

TIE_STEPS_M, LEAST_TIES = (8.0, 4.0, 2.0, 1.0), 32
"""Tie points on the ground stand so far from each other: the first distance that gives so many of all; a small area has enough to tell heights by."""
TITLE = "Synthetic town {}"
LICENCE = "CC0-1.0"
MADE_BY = "made by cityflow synth"
MADE_OF = {"outlines": ("id",), "blocks": ("id", "units", "count", "filled_gaps")}


def describe_survey(out: Path, source: SynthSource) -> tuple[str, ...]:
    """Write everything that is not a task's; the notes that the catalog made."""
    p = source.parameters
    town = town_of(p.seed, p.whole_town)
    outlines = out / "outlines.gpkg" if _write_layers(out, town, p) else None
    _write_mosaics(out / "truth", p)
    images = _write_poses(out, source, town) if source.images else None
    _write_control(out, source, town)
    if not makes_catalog(p):
        return ()
    scans = [str(out / "lidar")] if p.lidar is not None else []
    column, layer = ("id", "outlines") if outlines else (None, None)
    made = create_catalog(
        out / "catalog",
        SurveyFiles(lidar=scans, images=images, outlines=outlines, id_column=column, layer=layer),
        crs=p.crs,
        text=SurveyText(title=TITLE.format(p.seed), licence=LICENCE, attribution=MADE_BY, date=DAY),
    )
    nothing = () if outlines else ("no whole building stands in the area: the catalog has no outlines",)
    return (*nothing, *made.notes)


def makes_catalog(p: SynthParameters) -> bool:
    """Whether anything but a video is surveyed, of which a catalog can be made."""
    return p.flight is not None or p.lidar is not None


def _write_poses(out: Path, source: SynthSource, town: Town) -> ImageSource:
    """COLMAP models with the poses that are given to the catalog, and with the true ones."""
    p = source.parameters
    jpeg = writes_jpeg(p.render, p.jpeg_quality)
    origin = (*p.origin, 0.0)
    ties = tie_points(town, p)
    moved = ties if p.given_move is None else np.round(p.given_move.moved(ties), 3)
    for folder, poses, points in (("orientation", p.given_images, moved), ("truth/orientation", source.images, ties)):
        write_colmap(out / folder, [_named(i, jpeg) for i in poses], points, origin)
    return ImageSource(out / "images", {"colmap": out / "orientation"}, origin=origin)


def _write_control(out: Path, source: SynthSource, town: Town) -> None:
    """Measured points and marks, and the exact ones as truth; those of an earlier survey go."""
    p = source.parameters
    files = [out / "control.csv", out / "truth" / "control.csv"]
    for path in files if p.control is None else ():
        path.unlink(missing_ok=True)
    if p.control is None:
        return
    jpeg = writes_jpeg(p.render, p.jpeg_quality)
    exact = true_control(town, p.area, [_named(i, jpeg) for i in source.images], p.control, p.seed)
    for path, points in zip(files, (measured_control(exact, p.control, p.seed), exact), strict=True):
        path.write_text(point_table_text(points, "" if p.crs == "local" else p.crs))


def _named(image: OrientedImage, jpeg: bool) -> OrientedImage:
    return replace(image, name=Path(picture_path(image.name, jpeg)).name)


def _write_layers(out: Path, town: Town, p: SynthParameters) -> int:
    """Given outlines as a surveyor would hand them over, blocks for splitting, and all that is known as truth; the number of outlines."""
    reference = resolve(p.crs)
    records = town_truth(town)
    layers = {name: Layer(name, [g for g, _ in rows], [dict(r) for _, r in rows]) for name, rows in records.items()}
    # the truth rasters name units by this number, 0 being none
    layers["units"] = replace(
        layers["units"], rows=[{"number": k, **r} for k, r in enumerate(layers["units"].rows, start=1)]
    )
    (out / "truth").mkdir(parents=True, exist_ok=True)
    outlines = _inside(layers["units"], "outlines", p)
    (out / "outlines.gpkg").write_bytes(write_geopackage([outlines], reference))
    (out / "blocks.gpkg").write_bytes(write_geopackage([_inside(layers["blocks"], "blocks", p)], reference))
    (out / "truth" / "town.gpkg").write_bytes(write_geopackage(layers.values(), reference))
    return len(outlines.geometries)


def _inside(layer: Layer, name: str, p: SynthParameters) -> Layer:
    """What lies in the surveyed area as a whole."""
    area = shapely.box(*p.area)
    kept = [k for k, g in enumerate(layer.geometries) if g is not None and area.contains(g)]
    rows = [{key: layer.rows[k][key] for key in MADE_OF[name]} for k in kept]
    return Layer(name, [layer.geometries[k] for k in kept], rows)


def _write_mosaics(truth: Path, p: SynthParameters) -> None:
    """A VRT over the tiles of each truth raster."""
    reference = resolve(p.crs)
    tiles = [(t.name, truth_grid(clipped(t, p.area), p.truth_cell_m)) for t in tiles_over(p.area, TRUTH_TILE_M)]
    for name, (dtype, nodata) in LAYERS.items():
        parts = [(f"{name}/{tile}.tif", grid) for tile, grid in tiles]
        (truth / f"{name}.vrt").write_bytes(write_vrt(parts, reference, dtype, nodata))


def tie_points(town: Town, p: SynthParameters) -> FloatArray:
    """(N, 3) points on the ground and on roofs, as an aerotriangulation would leave them: thin, but everywhere."""
    faces = [face for unit in town.units for face in unit.roof_planes]
    places = shapely.get_coordinates([face.polygon.representative_point() for face in faces]).reshape(-1, 2)
    heights = [float(face.plane.z(px, py)) for face, (px, py) in zip(faces, places, strict=True)]
    roofs = _within(np.column_stack([places, np.array(heights, np.float64)]), p)
    for step in TIE_STEPS_M:
        ground = _ground_ties(town, p, step)
        if len(ground) + len(roofs) >= LEAST_TIES:
            break
    return np.asarray(np.round(np.concatenate([ground, roofs]), 3))


def _ground_ties(town: Town, p: SynthParameters, step: float) -> FloatArray:
    steps = [np.arange(lo + step / 2, hi, step) for lo, hi in zip(p.area[:2], p.area[2:], strict=True)]
    x, y = (v.ravel() for v in np.meshgrid(*steps))
    # what is under a roof is seen by no image
    free = ~shapely.contains_xy(shapely.union_all([u.roof_outline for u in town.units]), x, y)
    return np.column_stack([x, y, town.dtm(x, y)])[free]


def _within(points: FloatArray, p: SynthParameters) -> FloatArray:
    x_min, y_min, x_max, y_max = p.area
    x, y = points[:, 0], points[:, 1]
    return points[(x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max)]
