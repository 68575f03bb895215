"""Time and memory of the whole texture stage for a large unit of 73 faces: candidates, patches, placement, and pages encoded as the stage `atlas` does.

The published figure is 462 s for about 100 images a face (Frommholz 2017, section 6). The unit is made of true houses that stand side by side, as no single one
has so many faces. Candidates are the survey's own images: with less than `IMAGES` of them a face the run is refused, since copies of images would be kept or
dropped together. A flight with enough: `cityflow synth DIR --seed 7 --size 120x120 --set flight.forward_overlap=0.9 --set flight.side_overlap=0.8`.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Semantic
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Bounds, Grid
from cityflow.core.texture import FacePlane
from cityflow.io.images.image_write import jpeg_bytes, png_bytes
from cityflow.stages.atlas import without_black
from cityflow.survey.atlas_parameters import AtlasParameters
from cityflow.synthetic.town import make_town
from cityflow.texture.pages import pages_of
from cityflow.texture.placement.place import place
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.face_views import views_of
from cityflow.texture.unit import Surroundings, TexturedUnit, TextureParameters, texture_unit
from texture_visibility import House, cut, run_surface, true_houses
from texture_world import images_of, parameters_of

FACES, IMAGES, NEAR_M = 73, 100, 60.0
ATLAS = AtlasParameters()


def stage(asked: argparse.Namespace, p: TextureParameters) -> dict[str, object]:
    """With images and surface of a run."""
    parameters = parameters_of(asked.survey)
    images = images_of(asked.survey / "catalog", asked.run)
    houses = true_houses(make_town(parameters.seed, parameters.whole_town))
    return timed(nearest(houses, parameters.area), images, run_surface(asked.run), p, asked.least)


def nearest(houses: Sequence[House], area: Bounds) -> list[House]:
    """Those at the middle of an area first."""
    middle = np.array([(area[0] + area[2]) / 2, (area[1] + area[3]) / 2])
    return sorted(houses, key=lambda h: float(np.hypot(*(h.outline.centroid.coords[0] - middle))))


def timed(
    houses: Sequence[House], images: list[ColourImage], surface: tuple[Grid, FloatArray], p: TextureParameters, least: int
) -> dict[str, object]:  # fmt: skip
    """Of faces of the first houses; twice, so that nothing is compiled in the second, which counts. `least`: candidates a face must have on average."""
    faces, used = faces_of(houses)
    xyz = np.concatenate([f.rings[0] for f in faces]).mean(axis=0)
    pairs = sum(len(views_of(f, [i.image for i in images])) for f in faces)
    if pairs < least * len(faces):
        raise SystemExit(
            f"{pairs / len(faces):.0f} candidates a face, {least} wanted: fly more images (see --help), or ask with --least"
        )
    bounds = (*(xyz[:2] - NEAR_M), *(xyz[:2] + NEAR_M))
    grid, heights = cut(surface, (float(bounds[0]), float(bounds[1]), float(bounds[2]), float(bounds[3])))
    around = Surroundings([s for h in houses[:used] for s in h.all], [s for h in houses[used:] for s in h.all], heights, grid)  # fmt: skip
    _once(faces, images, around, p)
    before = _peak_mb()
    began, cpu = time.perf_counter(), time.process_time()
    made, pages = _once(faces, images, around, p)
    return {"faces": len(faces), "images": len(images), "candidates of a face": round(pairs / len(faces)),
            **{f"most {k}": made.figures[k] for k in ("candidates", "seen", "kept")}, "textured": made.figures["textured"],
            "seconds": round(time.perf_counter() - began, 1), "CPU s": round(time.process_time() - cpu, 1), "pages": pages,
            "peak MB": round(_peak_mb()), "of these before": round(before), "load": os.getloadavg()[0]}  # fmt: skip


def _once(faces: list[FacePlane], images: list[ColourImage], around: Surroundings, p: TextureParameters) -> tuple[TexturedUnit, list[list[int]]]:  # fmt: skip
    made = texture_unit(faces, images, around, p)
    pages = []
    for patches in (made.texture.raw, made.texture.rectified):
        placement = place([patch.mask for patch in patches], p.placement)
        written = 0
        for page in pages_of(patches, placement):
            written += len(jpeg_bytes(without_black(page), ATLAS.quality, ATLAS.full_colour))
            written += len(png_bytes(page.index[..., None]))
        pages.append([*(edge for page in placement.pages for edge in page), written])
    return made, pages


def faces_of(houses: Sequence[House]) -> tuple[list[FacePlane], int]:
    """The faces of the first houses but their party walls, as many as wanted; and of how many houses."""
    faces: list[FacePlane] = []
    plan = shapely.union_all([h.outline for h in houses])
    shapely.prepare(plan)
    for used, house in enumerate(houses, start=1):  # noqa: B007 (used after the loop)
        own = [f for f in face_planes(*house.shells) if f.polygon.area > 1.0]
        before = np.array([f.world(np.array([f.polygon.centroid.coords[0]]))[0] + 0.3 * f.normal for f in own])
        party = shapely.contains_xy(plan, before[:, 0], before[:, 1])
        faces += [f for f, p in zip(own, party, strict=True) if f.semantic is not Semantic.WALL or not p]
        if len(faces) >= FACES:
            break
    # one unit has each key once
    return [replace(f, key=("solid", k)) for k, f in enumerate(faces[:FACES])], used


def _peak_mb() -> float:
    """The most memory that this process ever had."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM"):
            return float(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
