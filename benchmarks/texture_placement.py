"""Placement of real façade and roof patches on atlas pages, beside xatlas on the same pixel sets in the same run.

python benchmarks/texture_placement.py                               # all sets, xatlas fast and by brute force
python benchmarks/texture_placement.py --sets boruszyn --no-xatlas   # ours alone
python benchmarks/texture_placement.py --picture atlas.png           # the atlas of the first set, a colour for each patch

The patches (`data/texture_patches.npz`) are the walls and roofs of LoD2.2 models as the image with the finest worst-case GSD draws them, party walls
left out: those of two kite surveys (Boruszyn and Ochota), and of a synthetic town. Each is its polygon with all pixels within `PADDING_PX` of it.
Efficiency: pixels of the patches over the tight bounding rectangle of what is placed. xatlas gets the padded polygons as outlines; it makes patches
larger, up to whole pixels of their turned rectangle, so its efficiency is stated with its own pixels, too.
Asked for: 600 patches and more within 5 s, efficiency ≥ 0.80 and at least that of xatlas with brute force.
"""

from __future__ import annotations

import argparse
import importlib
import itertools
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from PIL import Image
from shapely import Polygon

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.texture.placement.place import Placement, place

DATA = Path(__file__).parent / "data" / "texture_patches.npz"

SETS = ("boruszyn", "ochota", "town")

PADDING_PX = 2

ROUND = 2
"""Segments of a quarter circle where a padded outline is round."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table."""

    who: str
    seconds: float
    cpu_seconds: float
    used: int
    tight: tuple[int, int]
    pages: tuple[tuple[int, int], ...]


def outlines(name: str) -> list[Polygon]:
    """The padded outlines of a set, in pixels; the centre of a pixel has whole coordinates."""
    with np.load(DATA) as data:
        corners, lengths, counts = (data[f"{name}_{key}"] for key in ("corners", "ring_lengths", "ring_counts"))
    rings = np.split(corners.astype(np.float64), np.cumsum(lengths)[:-1])
    first = np.concatenate([[0], np.cumsum(counts)])
    return [_padded(rings[a:b]) for a, b in itertools.pairwise(first)]


def _padded(rings: Sequence[np.ndarray]) -> Polygon:
    """Faces seen edge-on may be lines or points; with padding they are polygons like the rest."""
    shell = shapely.MultiPoint(rings[0]).convex_hull if len(np.unique(rings[0], axis=0)) < 3 else Polygon(rings[0])
    holes = [Polygon(r) for r in rings[1:] if len(np.unique(r, axis=0)) >= 3]
    shape = shapely.make_valid(shell).difference(shapely.union_all([shapely.make_valid(h) for h in holes]))
    padded = shapely.simplify(shapely.buffer(shape, PADDING_PX + 0.5, quad_segs=ROUND), 0.05)
    return max(shapely.get_parts(padded), key=lambda part: part.area)


def mask_of(outline: Polygon) -> BoolArray:
    """The pixels whose centres lie in the outline."""
    west, north, east, south = np.round(outline.bounds).astype(int)
    x, y = np.meshgrid(np.arange(west, east + 1), np.arange(north, south + 1))
    shapely.prepare(outline)
    mask = shapely.contains_xy(outline, x, y)
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return np.asarray(mask[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1])


def painted(masks: Sequence[BoolArray], placement: Placement, page: int) -> IntArray:
    """Number of the patch at every pixel of a page, from 1; fails where two meet."""
    canvas = np.zeros(placement.pages[page], np.int64)
    for number, (mask, spot) in enumerate(zip(masks, placement.spots, strict=True), start=1):
        if spot.page == page:
            turned = np.rot90(mask, spot.quarter_turns)
            window = canvas[spot.row : spot.row + turned.shape[0], spot.col : spot.col + turned.shape[1]]
            if window.shape != turned.shape or window[turned].any():
                raise AssertionError(f"patch {number - 1} stands on another or beyond the page")
            window[turned] = number
    return canvas


def ours(masks: Sequence[BoolArray]) -> tuple[Row, Placement]:
    start = time.perf_counter(), time.process_time()
    placement = place(masks)
    seconds, cpu = time.perf_counter() - start[0], time.process_time() - start[1]
    canvases = [painted(masks, placement, page) > 0 for page in range(len(placement.pages))]
    used = int(sum(c.sum() for c in canvases))
    heights = [int(np.flatnonzero(c.any(axis=1))[-1]) + 1 for c in canvases]
    widths = [int(np.flatnonzero(c.any(axis=0))[-1]) + 1 for c in canvases]
    return Row("cityflow", seconds, cpu, used, (sum(heights), max(widths)), placement.pages), placement


def by_xatlas(shapes: Sequence[Polygon], brute: bool) -> Row:
    """Its own pixels over its own tight rectangle; it turns patches by any angle."""
    xatlas, earcut = importlib.import_module("xatlas"), importlib.import_module("mapbox_earcut")
    atlas = xatlas.Atlas()
    for shape in shapes:
        rings = [np.asarray(r.coords[:-1], np.float32) for r in (shape.exterior, *shape.interiors)]
        flat = np.concatenate(rings)
        ends = np.cumsum([len(r) for r in rings]).astype(np.uint32)
        triangles = earcut.triangulate_float32(flat, ends).reshape(-1, 3).astype(np.uint32)
        # as plane meshes: given as texture coordinates, patches came back with others' sizes (0.0.11)
        atlas.add_mesh(np.column_stack([flat, np.zeros(len(flat), np.float32)]), triangles)
    options = xatlas.PackOptions()
    options.bruteForce, options.padding, options.bilinear, options.texels_per_unit = brute, 0, False, 1.0
    options.create_image = True
    start = time.perf_counter(), time.process_time()
    atlas.generate(xatlas.ChartOptions(), options)
    seconds, cpu = time.perf_counter() - start[0], time.process_time() - start[1]
    image = np.asarray(atlas.get_chart_image(0))
    taken = (image.reshape(*image.shape[:2], -1) != 0).any(axis=2)
    tight = tuple(int(np.ptp(np.flatnonzero(taken.any(axis=axis)))) + 1 for axis in (1, 0))
    page = (1 << (tight[0] - 1).bit_length(), 1 << (tight[1] - 1).bit_length())
    return Row(
        f"xatlas, {'brute force' if brute else 'fast'}", seconds, cpu, int(taken.sum()), (tight[0], tight[1]), (page,)
    )


def compared(name: str, repeats: int, xatlas_ways: Sequence[bool]) -> tuple[list[Row], list[BoolArray], Placement]:
    shapes = outlines(name)
    masks = [mask_of(s) for s in shapes]
    place(masks[:3])  # kernels are compiled or read from the cache
    rows = []
    trials = [ours(masks) for _ in range(repeats)]
    assert all(trial[1] == trials[0][1] for trial in trials)
    rows.append(min((trial[0] for trial in trials), key=lambda row: row.seconds))
    rows += [by_xatlas(shapes, brute) for brute in xatlas_ways]
    return rows, masks, trials[0][1]


def table(name: str, patches: int, rows: Sequence[Row]) -> str:
    """Efficiency with the patches' own pixels, and with those that the packer gives them: xatlas enlarges patches to whole pixels."""
    head = "| s (of ours) | CPU s | rectangle | efficiency | its own pixels | efficiency with these | pages | power-of-two fill |"
    lines = [f"{name}, {patches} patches, {rows[0].used:,} pixels", f"| {head}", "|---" * 9 + "|"]
    for row in rows:
        high, wide = row.tight
        pages = ", ".join(f"{h} × {w}" for h, w in row.pages)
        filled = rows[0].used / sum(h * w for h, w in row.pages)
        lines.append(
            f"| {row.who} | {row.seconds:.2f} ({row.seconds / rows[0].seconds:.2f}) | {row.cpu_seconds:.2f} | {high} × {wide}"
            f" | {rows[0].used / (high * wide):.3f} | {row.used:,} | {row.used / (high * wide):.3f} | {pages} | {filled:.3f} |"
        )
    return "\n".join(lines)


def picture(masks: Sequence[BoolArray], placement: Placement, path: Path, longest: int = 1100) -> None:
    """The first page down to its last patch, lying, with few colours so that the file stays small."""
    canvas = painted(masks, placement, 0)
    canvas = canvas[: int(np.flatnonzero(canvas.any(axis=1))[-1]) + 1]
    colours = np.random.default_rng(2).integers(70, 250, (len(masks) + 1, 3)).astype(np.uint8)
    colours[0] = 255
    drawn = Image.fromarray(colours[np.rot90(canvas) if canvas.shape[0] > canvas.shape[1] else canvas])
    scale = longest / max(canvas.shape)
    small = drawn.resize((round(drawn.width * scale), round(drawn.height * scale)), Image.Resampling.LANCZOS)
    small.quantize(48).save(path, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", nargs="+", choices=SETS, default=SETS)
    parser.add_argument("--repeats", type=int, default=3, help="the fastest counts")
    parser.add_argument("--no-xatlas", action="store_true")
    parser.add_argument("--no-brute-force", action="store_true", help="xatlas by its fast way only")
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    ways = () if arguments.no_xatlas else (False,) if arguments.no_brute_force else (False, True)
    for number, name in enumerate(arguments.sets):
        rows, masks, placement = compared(name, arguments.repeats, ways)
        print(table(name, len(masks), rows), flush=True)
        if arguments.picture and number == 0:
            picture(masks, placement, arguments.picture)


if __name__ == "__main__":
    main()
