"""Time and memory of the whole texture stage for a large unit: 73 faces with about 100 images each, placement and pages included.

The published figure is 462 s (Frommholz 2017, section 6). The unit is made of true houses that stand side by side, as no single one has so many faces.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.building import Semantic
from cityflow.core.colour_image import ColourImage
from cityflow.core.texture import FacePlane
from cityflow.synthetic.town import make_town
from cityflow.texture.pages import pages_of
from cityflow.texture.placement.place import place
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.views import views_of
from cityflow.texture.unit import Surroundings, TexturedUnit, TextureParameters, texture_unit
from texture_visibility import House, cut, run_surface, true_houses
from texture_world import images_of, parameters_of

FACES, IMAGES, NEAR_M = 73, 100, 60.0


def stage(asked: argparse.Namespace, p: TextureParameters) -> dict[str, object]:
    """Twice, so that nothing is compiled in the second, which counts."""
    parameters = parameters_of(asked.survey)
    houses = true_houses(make_town(parameters.seed, parameters.whole_town))
    x_0, y_0, x_1, y_1 = parameters.area
    middle = np.array([(x_0 + x_1) / 2, (y_0 + y_1) / 2])
    houses.sort(key=lambda h: float(np.hypot(*(h.outline.centroid.coords[0] - middle))))
    faces, used = _faces(houses)
    xyz = np.concatenate([f.rings[0] for f in faces]).mean(axis=0)
    images, pairs = _enough(faces, images_of(asked.survey, asked.run))
    bounds = (*(xyz[:2] - NEAR_M), *(xyz[:2] + NEAR_M))
    grid, heights = cut(
        run_surface(asked.run), (float(bounds[0]), float(bounds[1]), float(bounds[2]), float(bounds[3]))
    )
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
        pages_of(patches, placement)
        pages.append([edge for page in placement.pages for edge in page])
    return made, pages


def _enough(faces: list[FacePlane], images: list[ColourImage]) -> tuple[list[ColourImage], int]:
    """Images so that a face has as many candidates as wanted on average: a survey of little overlap is flown again, a metre beside.

    Returns
    -------
    the images, and how many pairs of a face and a candidate there are
    """
    flown = list(images)
    for again in range(10):
        pairs = sum(len(views_of(f, [i.image for i in flown])) for f in faces)
        if pairs >= IMAGES * len(faces):
            break
        shift = np.array([1.0, 0.5, 0.2]) * (again + 1)
        flown += [replace(i, image=replace(i.image, name=f"{i.image.name}_{again}", centre=i.image.centre + shift)) for i in images]  # fmt: skip
    return flown, pairs


def _faces(houses: list[House]) -> tuple[list[FacePlane], int]:
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
