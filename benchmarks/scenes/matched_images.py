"""Whole reference images of a synthetic flight, matched with their partners, and the depths that they truly show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import DepthMap
from cityflow.core.ground_cells import GroundCells
from cityflow.core.parameters import merged
from cityflow.core.pixels import Pixels
from cityflow.evaluation.statistics import nmad
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.io.images.tiled_images import open_image, tile_image
from cityflow.matching.match import Matched, MatchParameters, match
from cityflow.orientation.views import View, footprint
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.survey.image_survey import ImageSurvey
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.render import truth_depth

CELL_M = 50.0
AROUND_M = 60.0
"""Cells go so far beyond the footprint, so that no pixel is left out."""
STEP_PX = 2.0
"""A pixel whose neighbour is farther from its plane is a depth step, ground pixels."""
CLEAR_PX = 3
"""Pixels nearer to a depth step are not judged among those away from it (docs/matching.md)."""
EDGE_PX = 6
"""Ground and roofs so much nearer to a depth step than those away from it are judged by themselves, pixels."""
FAR_PX = 12.0
"""Depths beyond are gross errors, ground pixels."""
LEAST_WALL = np.sin(np.radians(12.0))
"""Walls are judged where they are seen at more than 12 degrees (docs/matching.md)."""
WITHIN_PX = 3.0


@dataclass(frozen=True, slots=True)
class ReferenceView:
    """A reference image with its partners, best first, as one task of matching would have them."""

    view: View
    partners: tuple[OrientedImage, ...]
    direction: str

    @property
    def image(self) -> OrientedImage:
        return self.view.image

    @property
    def cells(self) -> GroundCells:
        """Cells over all ground that the image sees."""
        x_0, y_0, x_1, y_1 = footprint(self.view).buffer(AROUND_M).bounds
        cols = range(int(x_0 // CELL_M), int(x_1 // CELL_M) + 1)
        rows = range(int(y_0 // CELL_M), int(y_1 // CELL_M) + 1)
        return GroundCells((x_0, y_0, x_1, y_1), CELL_M, tuple((c, r) for c in cols for r in rows))


def reference_views(catalog: Catalog, count: int, partners: int) -> list[ReferenceView]:
    """Reference images nearest to the middle of the survey, look direction after look direction, nadir first."""
    parameters = merged(CityParameters().model_dump(), {"flight": {"partners": {"partners": partners}}})
    survey = ImageSurvey(catalog, CityParameters.model_validate(parameters))
    middle = np.median([v.image.centre[:2] for v in survey.flown.values()], axis=0)
    chosen: dict[str, list[ReferenceView]] = {}
    for direction in survey.plan.directions:
        names = {survey.plan.around.views[k].name for k in survey.plan.reference_images(direction).view.tolist()}
        views = [ReferenceView(survey.flown[n], tuple(survey.flown[p].image for p in survey.plan.partners(n)), direction) for n in sorted(names)]  # fmt: skip
        full = [v for v in views if len(v.partners) == partners] or views
        chosen[direction] = sorted(full, key=lambda v: _away(v.view, middle))
    order = sorted(chosen, key=lambda d: np.mean([v.image.tilt for v in chosen[d]]))
    return [chosen[d][k] for k in range(count) for d in order if k < len(chosen[d])][:count]


def _away(view: View, middle: FloatArray) -> float:
    centroid = footprint(view).centroid
    return float(np.hypot(centroid.x - middle[0], centroid.y - middle[1]))


def tiled_pixels(catalog: Catalog, names: Sequence[str], folder: Path) -> dict[str, Pixels]:
    """Images as `ingest` leaves them, made where they are not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    assets = {a.name: a for a in catalog.images}
    for name in names:
        if not (folder / f"{name}.tif").exists():
            tile_image(assets[name].href, folder / f"{name}.tif")
    return {name: open_image(folder / f"{name}.tif") for name in names}


def match_whole(
    view: ReferenceView, pixels: dict[str, Pixels], parameters: MatchParameters
) -> tuple[Matched, DepthMap | None]:
    """Match a whole reference image, as if one ground tile were as large as all that it sees."""
    partners = [(p, pixels[p.name]) for p in view.partners]
    made: dict[str, DepthMap] = {}
    found = match(view.image, pixels[view.image.name], partners, {"": view.cells}, view.view.heights, parameters, made.__setitem__)  # fmt: skip
    return found, made.get("")


@dataclass(frozen=True, slots=True)
class TrueView:
    """What a reference image truly shows, (height, width) each.

    Attributes
    ----------
    depth : metres along the camera's axis, NaN for sky;  across : metres across the surface of a metre of depth;  gsd : metres
    ground_or_roof, wall : which pixels are judged as what, three pixels from depth steps;  edge : ground and roofs nearer, and a little around
    """

    depth: Float32Array
    across: Float32Array
    gsd: Float32Array
    ground_or_roof: BoolArray
    wall: BoolArray
    edge: BoolArray


def true_views(parameters: SynthParameters, images: Sequence[OrientedImage], folder: Path) -> list[TrueView]:
    """The truth of each image, kept in the folder."""
    missing = [image for image in images if not _file(folder, image).exists()]
    if missing:
        town = town_of(parameters.seed, parameters.whole_town)
        scene = Scene(town.mesh(town.bounds))
        for image in missing:
            made = _true_view(scene, image)
            np.savez(_file(folder, image), **{f.name: getattr(made, f.name) for f in fields(made)})
    return [TrueView(**np.load(_file(folder, image))) for image in images]


def _file(folder: Path, image: OrientedImage) -> Path:
    return folder / f"{image.name}.npz"


def _true_view(scene: Scene, image: OrientedImage) -> TrueView:
    depth, triangle = truth_depth(scene, image)
    hit = triangle != NOTHING
    rows, cols = np.mgrid[0 : depth.shape[0], 0 : depth.shape[1]]
    rays = image.rays(np.stack([cols + 0.5, rows + 0.5], axis=-1).reshape(-1, 2)).reshape(*depth.shape, 3)
    normal, part = scene.surfaces.normal[triangle], scene.surfaces.part[triangle]
    across = np.abs((normal * rays).sum(axis=-1)).astype(np.float32)
    gsd = depth / np.float32(image.camera.fx)
    clear = hit & ~_near_steps(depth[..., None] * rays, normal, STEP_PX * gsd)
    seen = across / np.linalg.norm(rays, axis=-1)
    solid = np.isin(part, (Part.GROUND, Part.STREET, Part.ROOF))
    near = cv2.dilate((~clear).astype(np.uint8), np.ones((2 * EDGE_PX + 1,) * 2, np.uint8)) > 0
    return TrueView(
        depth, across, gsd, clear & solid, clear & (part == Part.WALL) & (seen > LEAST_WALL), hit & near & solid
    )


def _near_steps(xyz: FloatArray, normal: FloatArray, limit: Float32Array) -> BoolArray:
    """Pixels within `CLEAR_PX` of one whose neighbour lies off its plane."""
    step = np.zeros(limit.shape, np.uint8)
    for axis in (0, 1):
        here, there = ((slice(None, -1), slice(1, None))[k] for k in (0, 1))
        a, b = ((here, slice(None)), (there, slice(None))) if axis == 0 else ((slice(None), here), (slice(None), there))
        between = xyz[b] - xyz[a]
        for at in (a, b):
            step[at] |= ~(np.abs((between * normal[at]).sum(axis=-1)) <= limit[at])
    return np.asarray(cv2.dilate(step, np.ones((2 * CLEAR_PX + 1,) * 2, np.uint8)) > 0)


def depth_figures(depth_map: DepthMap, truth: TrueView) -> dict[str, float]:
    """NMAD in ground pixels; shares known, of these within three of them and beyond twelve, and of all within three; across the surface that is seen."""
    found = np.full(truth.depth.shape, np.nan)
    h, w = depth_map.depth.shape
    found[depth_map.row : depth_map.row + h, depth_map.col : depth_map.col + w] = depth_map.depth
    error = (found - truth.depth) * truth.across / truth.gsd
    figures = {"known": float(np.isfinite(found).mean())}
    for name, judged in (("away", truth.ground_or_roof), ("walls", truth.wall), ("edge", truth.edge)):
        off = error[judged].astype(np.float64)
        known = off[np.isfinite(off)]
        figures |= {
            f"{name}_px": float(off.size), f"{name}_nmad": nmad(off), f"{name}_known": known.size / max(off.size, 1),
            f"{name}_within": float((np.abs(known) <= WITHIN_PX).mean()) if known.size else float("nan"),
            f"{name}_far": float((np.abs(known) > FAR_PX).mean()) if known.size else float("nan"),
            f"{name}_right": float((np.abs(off) <= WITHIN_PX).mean()) if off.size else float("nan"),
        }  # fmt: skip
    return figures
