"""Pre-flight maps: GeoTIFFs, footprints as GeoPackage, and one HTML page with pictures."""

from __future__ import annotations

import base64
import html
import io
import warnings
from collections.abc import Iterator
from pathlib import Path

import geopandas as gpd
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cityflow.catalog.check_images import Preflight
from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.reference import Reference
from cityflow.io.catalog.stac import Catalog
from cityflow.io.crs import horizontal_crs
from cityflow.io.rasters.raster import write_cog
from cityflow.orientation.coverage import Coverage, wall_name

RAMP = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], np.float64)
"""Dark for little, bright for much; told apart by lightness alone, too."""
NOTHING = (225, 225, 225)
PICTURE_PX = 480
MEANING = {
    "views": ("Images per cell", "more is better; two are needed for heights, three to check them"),
    "gsd": ("Finest pixel on the ground, m", "darker is finer"),
    "angle": ("Largest angle between two rays, degrees", "more is better for heights"),
    "walls": ("Images per wall", "the least seen of the eight façade directions"),
}


def write_maps(folder: str | Path, catalog: Catalog, found: Preflight) -> list[Path]:
    """Write the maps into a folder, which is made; the files written.

    ``views``, ``gsd``, ``angle``: one band each; ``walls``: images that see a wall facing north, northeast, …; ``directions``: images of each look
    direction, in the order of the page.
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    maps = found.maps
    walls = np.stack([maps.walls[k] for k in range(len(maps.walls))]).astype(np.uint16)
    directions = np.stack([maps.by_direction[f.name] for f in found.frames]).astype(np.uint16)
    rasters: dict[str, NDArray[np.generic]] = {
        "views": maps.views.astype(np.uint16), "gsd": maps.gsd, "angle": maps.angle_deg, "walls": walls, "directions": directions,
    }  # fmt: skip
    written = []
    for name, array in rasters.items():
        path = place / f"{name}.tif"
        path.write_bytes(
            write_cog(array, maps.grid, catalog.reference, None if array.dtype == np.uint16 else float("nan"))
        )
        written.append(path)
    written.append(_footprints(place / "footprints.gpkg", catalog.reference, found))
    page = place / "maps.html"
    page.write_text(_page(catalog, found), encoding="utf-8")
    return [*written, page]


def _footprints(path: Path, reference: Reference, found: Preflight) -> Path:
    direction = {name: f.name for f in found.frames for name in f.images}
    names = [n for n, shape in found.footprints.items() if not shape.is_empty]
    shapes = [found.footprints[n] for n in names]
    table = gpd.GeoDataFrame(
        {"image": names, "direction": [direction.get(n, "") for n in names]},
        geometry=shapes,
        crs=horizontal_crs(reference),
    )
    path.unlink(missing_ok=True)
    with warnings.catch_warnings():
        # a local frame has no CRS, and is meant to have none
        warnings.simplefilter("ignore", UserWarning)
        table.to_file(path, layer="footprints", driver="GPKG")
    return path


def _page(catalog: Catalog, found: Preflight) -> str:
    rows = "".join(f"<tr><th>{html.escape(k)}<td>{html.escape(v)}" for k, v in found.summary.items())
    findings = "".join(f"<li>{html.escape(str(f))}" for f in found.findings)
    figures = "".join(_figure(title, note, values) for title, note, values in _pictures(found.maps))
    style = (
        "body{font:15px/1.5 sans-serif;margin:2em;max-width:75em}figure{display:inline-block;margin:0 1.5em 1.5em 0;vertical-align:top}"
        "th{text-align:left;padding-right:1em;vertical-align:top}img{image-rendering:pixelated;border:1px solid #999;display:block}"
    )
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(catalog.title)}: flight</title><style>{style}</style>'
        f"<h1>{html.escape(catalog.title)}: what the flight sees</h1><table>{rows}</table><h2>Findings</h2><ul>{findings or '<li>none'}</ul>"
        f"<h2>Maps</h2><p>Heights are one level, so what hides behind houses is not in these maps. Grey: nothing seen. North is up; "
        f"{found.maps.grid.cols} × {found.maps.grid.rows} cells of {found.maps.grid.cell:g} m.</p>{figures}</html>\n"
    )


def _pictures(maps: Coverage) -> Iterator[tuple[str, str, FloatArray]]:
    seen = maps.views > 0
    yield (*MEANING["views"], np.where(seen, maps.views, np.nan))
    yield (*MEANING["gsd"], maps.gsd.astype(np.float64))
    yield (*MEANING["angle"], maps.angle_deg.astype(np.float64))
    yield (*MEANING["walls"], np.where(seen, maps.walls.min(axis=0), np.nan))
    for k in range(len(maps.walls)):
        yield f"Walls facing {wall_name(k)}", "images that see them", np.where(seen, maps.walls[k], np.nan)
    for name, count in maps.by_direction.items():
        yield f"Looking {name}", "images per cell", np.where(count > 0, count, np.nan)


def _figure(title: str, note: str, values: FloatArray) -> str:
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(np.quantile(known, 0.98))) if known.size else (0.0, 1.0)
    data = base64.b64encode(_png(coloured(values, low, high))).decode()
    bar = base64.b64encode(_png(coloured(np.linspace(0, 1, 120)[None, :].repeat(10, axis=0), 0, 1), 1)).decode()
    text = f"{low:.3g} <img style='display:inline;border:0' alt='' src='data:image/png;base64,{bar}'> {high:.3g}"
    return (
        f"<figure><figcaption><b>{html.escape(title)}</b><br>{html.escape(note)}</figcaption>"
        f"<img alt='{html.escape(title)}' src='data:image/png;base64,{data}'>{text}</figure>"
    )


def coloured(values: FloatArray, low: float, high: float) -> ByteArray:
    """(rows, cols, 3) colours of values; NaN is grey."""
    share = np.clip((np.nan_to_num(values) - low) / max(high - low, 1e-12), 0, 1) * (len(RAMP) - 1)
    at = np.minimum(share.astype(np.int64), len(RAMP) - 2)
    part = (share - at)[..., None]
    picture = np.rint(RAMP[at] * (1 - part) + RAMP[at + 1] * part).astype(np.uint8)
    picture[~np.isfinite(values)] = NOTHING
    return picture


def _png(picture: ByteArray, scale: int = 0) -> bytes:
    times = scale or max(1, PICTURE_PX // max(picture.shape[:2]))
    buffer = io.BytesIO()
    Image.fromarray(picture.repeat(times, axis=0).repeat(times, axis=1)).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
