"""Memory of a worker on frames of 24 and of 150 megapixels: some pictures of a synthetic town enlarged, the world with them.

    python benchmarks/town_memory.py --survey FOLDER --factor 4      # 1500 x 1000 becomes 24 megapixels; 10: 150 megapixels

Pictures, poses and tie points are enlarged alike, so the ground sampling distance stays and a ground tile is as many pixels as it would be in a
real frame of that size; disparities are as many times longer, which real ones are not. One reference image is matched over all its ground, with
all its partners, under the limit that is asked for; beyond it the engine kills the task, and the run fails.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console

from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import tile_at
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.orientation.colmap import read_colmap, write_colmap
from cityflow.orientation.flight_plan import FlightTile
from cityflow.orientation.views import View
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import check_run, describe_run
from cityflow.runs.settings import load_workflow
from cityflow.survey.area import parse_area
from cityflow.survey.image_survey import ImageSurvey
from cityflow.workflow.run import execute
from town_figures import stage_figures

WORKFLOW = Path(__file__).parents[1] / "workflows" / "oblique_city.yaml"
QUALITY = 90
MOST_TILT = np.radians(20.0)


class _OneMatch(CitySource):
    fuse = False

    def initial(self):  # type: ignore[no-untyped-def]
        images = self.survey.images
        chosen, every = central_flight_tile(images), images.flight_tiles
        if self.fuse:  # the tile is fused from the depths of this one image
            images.__dict__["flight_tiles"] = lambda tile: [f for f in every(tile) if f.reference == chosen.reference]
        yield from self.walk.want([("fuse", chosen.tile) if self.fuse else ("match", chosen.reference)])


@dataclass(frozen=True, slots=True)
class OneMatch(Prepared):
    """A run of one reference image and what it reads; with `fuse`, of the ground tile under its middle, too."""

    fuse: bool = False

    def source(self, ledger: Ledger | None = None) -> CitySource:
        source = _OneMatch(self.catalog, self.workflow.city, self.area, self.overrides, memory=ledger)
        source.fuse = self.fuse
        return source


def central_flight_tile(images: ImageSurvey) -> FlightTile:
    """Of the ground tile under the middle of all views, and of bases that look down: the one with most partners and cells."""
    centres = np.array([_ground_point(v) for v in images.views.values()])
    x, y = np.median(centres, axis=0)
    tile = images.tiles[tile_at(float(x), float(y), images.parameters.tiles.tile_m).name]
    found = sorted(images.flight_tiles(tile), key=lambda f: f.name)
    level = [f for f in found if images.views[f.reference].image.tilt < MOST_TILT]
    return max(level or found, key=lambda f: (len(f.partners), len(f.cells.chosen)))


def _ground_point(view: View) -> tuple[float, float]:
    image = view.image
    point = image.centre + image.axis * (view.heights[0] - image.centre[2]) / image.axis[2]
    return float(point[0]), float(point[1])


def enlarged_survey(survey: Path, out: Path, factor: int) -> None:
    """A catalog of one reference image and its partners, `factor` times as wide and as high, in a world as many times as large."""
    catalog = read_catalog(str(survey / "catalog"))
    chosen = central_flight_tile(ImageSurvey(catalog, CityParameters()))
    names = {chosen.reference, *chosen.partners}
    model = read_colmap(survey / "orientation")
    images = [i for i in model.images if Path(i.name).stem in names]
    (out / "images").mkdir(parents=True, exist_ok=True)
    for image in images:
        target = out / "images" / image.name
        if not target.exists():
            small = cv2.imread(str(survey / "images" / image.name))
            assert small is not None, image.name
            large = cv2.resize(small, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
            cv2.imwrite(str(target), large, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    write_colmap(out / "orientation", [enlarged(i, factor) for i in images], model.sparse * factor)
    source = ImageSource(out / "images", {"colmap": out / "orientation"}, gains=False)
    create_catalog(
        out / "catalog", SurveyFiles(images=source), crs="local", text=SurveyText(title=f"enlarged {factor} times")
    )


def enlarged(image: OrientedImage, factor: int) -> OrientedImage:
    c = image.camera
    camera = replace(
        c, width=c.width * factor, height=c.height * factor, fx=c.fx * factor, fy=c.fy * factor, cx=c.cx * factor, cy=c.cy * factor
    )  # fmt: skip
    return replace(image, camera=camera, centre=image.centre * factor)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--survey", type=Path, required=True)
    options.add_argument("--factor", type=int, default=4)
    options.add_argument("--out", type=Path, required=True, help="folder for the enlarged survey and its run")
    options.add_argument("--limit-mb", type=float, default=3000.0)
    options.add_argument(
        "--fuse", action="store_true", help="fuse the ground tile under its middle from its depths, too"
    )
    o = options.parse_args()
    enlarged_survey(o.survey, o.out, o.factor)
    limits = [f"execution.{stage}.memory_mb={o.limit_mb:g}" for stage in ("ingest", "match", "fuse")]
    workflow = load_workflow(WORKFLOW, limits)
    catalog = read_catalog(str(o.out / "catalog"))
    wanted = OneMatch(workflow, catalog, parse_area("", catalog.reference), Store.open(str(o.out / "run")), fuse=o.fuse)
    check_run(wanted)
    execute(wanted, "", 1, Console(stderr=True), lambda: describe_run(wanted))
    camera = catalog.images[0].oriented.camera
    print(
        f"{camera.width} x {camera.height} = {camera.width * camera.height / 1e6:.0f} megapixels, limit {o.limit_mb:.0f} MB"
    )
    for stage, figures in stage_figures(o.out / "run").items():
        print(
            f"{stage:<8} {figures['tasks']:.0f} tasks, {figures['failed']:.0f} failed, peak {figures['peak_mb']:.0f} MB, {figures['seconds']:.0f} s"
        )


if __name__ == "__main__":
    main()
