"""A synthetic town, flown with five cameras and run as a user's survey would be: surface, façades, terrain, time and memory against truth.

    python benchmarks/town_images.py --seed 7 --size 100 --overlap 0.8                 # makes the survey, runs it, prints the table
    python benchmarks/town_images.py --survey FOLDER --run RUN                         # takes what is there already
    python benchmarks/town_images.py --survey FOLDER --tiles 60 --also 50 --workers 2  # the same with another tile and two workers, compared

Survey and run are commands of their own (``cityflow synth``, the stages of ``cityflow run`` through the same engine); everything is measured on
the products. With ``--cut`` the survey ends at the edge of the tiles that are judged: far less is matched, and only what is two metres
inside is judged. ``--every`` leaves stations of each strip out, which is a flight of less forward overlap over the same pictures.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console

from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds, tiles_over
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.io.orientation.colmap import read_colmap
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import check_run, describe_run
from cityflow.runs.settings import load_workflow
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.survey.area import parse_area
from cityflow.workflow.run import execute
from town_figures import (
    Judge,
    other_surface_figures,
    read_surface,
    stage_figures,
    surface_figures,
    terrain_figures,
    wall_figures,
)

ROOT = Path(__file__).parents[1]
WORKFLOW = ROOT / "workflows" / "oblique_city.yaml"
STATION = re.compile(r"s(\d+)_(\d+)_")
INSIDE_M = 2.0
"""What is this near to the edge of a cut survey lacks the points of its neighbours."""
SMALL_PICTURES = ("flight.width_px=1500", "flight.height_px=1000")
ASKED = {
    "nmad_gsd": "≤ 0.5", "within": "≥ 98.5 %", "completeness": "≥ 99 %", "rim": "≥ 93 %",
    "covered": "≥ 80 %", "wall_nmad_gsd": "≤ 1.5",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Pictures(Prepared):
    """A run that makes the surface and the ortho of some tiles and no buildings; `cut`: as if the survey had no other tiles."""

    only: tuple[str, ...] = ()
    cut: bool = True

    def source(self, ledger: Ledger | None = None) -> CitySource:
        source = _PictureSource(self.catalog, self.workflow.city, self.area, self.overrides, memory=ledger)
        source.only = self.only
        if self.cut:
            images = source.survey.images
            images.__dict__["tiles"] = {n: t for n, t in images.tiles.items() if n in self.only}
        return source


class _PictureSource(CitySource):
    only: tuple[str, ...] = ()

    def initial(self):  # type: ignore[no-untyped-def]
        tiles = [name for name in self.survey.lattice.tiles if name in self.only]
        yield from self.walk.want((stage, name) for stage in ("surface", "ortho") for name in tiles)


def make_survey(folder: Path, seed: int, size: str, settings: Sequence[str], workers: int) -> None:
    """``cityflow synth``; what is there already is kept."""
    command = [sys.executable, "-m", "cityflow", "synth", str(folder), "--seed", str(seed), "--size", size]
    command += ["--workers", str(workers)]
    for setting in settings:
        command += ["--set", setting]
    subprocess.run(command, check=True)


def parameters_of(folder: Path) -> SynthParameters:
    return SynthParameters.model_validate(json.loads((folder / "synth.json").read_text())["parameters"])


def thinned(catalog: Catalog, forward: float, wanted: float) -> Catalog:
    """The catalog with the stations of each strip that a flight of less forward overlap would have, nearest first."""
    if wanted >= forward:
        return catalog
    step = (1 - wanted) / (1 - forward)
    kept = []
    for asset in catalog.images:
        found = STATION.search(asset.name)
        station = int(found.group(2)) if found else 0
        # the k-th station of the thinner flight stands at k · step of this one's
        if station == round(round(station / step) * step):
            kept.append(asset)
    return replace(catalog, images=tuple(kept))


def run_pictures(
    survey: Path, run: Path, tiles: Sequence[str], settings: Sequence[str], options: argparse.Namespace
) -> None:
    """Match, fuse and make surfaces and orthos of some tiles through the engine."""
    catalog = read_catalog(str(survey / "catalog"))
    forward = parameters_of(survey).flight
    if options.overlap is not None and forward is not None:
        catalog = thinned(catalog, forward.forward_overlap, options.overlap)
    workflow = load_workflow(WORKFLOW, settings)
    area, store = parse_area("", catalog.reference), Store.open(str(run))
    wanted = Pictures(workflow, catalog, area, store, only=tuple(tiles), cut=options.cut)
    check_run(wanted)
    execute(wanted, "", options.workers, Console(stderr=True), lambda: describe_run(wanted))


def settings_of(tile_m: float) -> list[str]:
    """A workflow with small tiles."""
    return [f"tiles.tile_m={tile_m:g}", f"outline.found.halo_m={min(tile_m, 100.0):g}", "tiles.index_cell_m=25"]


def judged_area(area: Bounds, tiles: Sequence[str], tile_m: float, cut: bool) -> Bounds:
    """The part of the surveyed area under the tiles; of a cut survey without its edge."""
    corners = np.array([[float(v) * tile_m for v in name.split("_")] for name in tiles])
    low, high = corners.min(axis=0), corners.max(axis=0) + tile_m
    inside = INSIDE_M if cut else 0.0
    low, high = np.maximum(low + inside, area[:2]), np.minimum(high - inside, area[2:])
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def table(run: Path, judge: Judge) -> dict[str, float]:
    """All figures of a run."""
    surface = read_surface(run, judge.bounds)
    figures = surface_figures(surface.dsm, judge)
    figures |= {
        f"filled_{k}": v
        for k, v in surface_figures(surface.filled, judge).items()
        if k in ("within", "rim", "completeness")
    }
    other = other_surface_figures(surface.dsm, judge)
    figures |= {"other_nmad_gsd": other.nmad / judge.cell_m, "other_within": other.within, "other_rim": other.rim}
    walls = wall_figures(run, judge)
    figures |= {
        "covered": walls.covered, "covered_all": walls.covered_all, "wall_nmad_gsd": walls.nmad / judge.cell_m,
        "wall_bias_gsd": walls.bias / judge.cell_m, "wall_area_m2": walls.area_m2,
    }  # fmt: skip
    figures |= terrain_figures(surface, judge)
    for stage, values in stage_figures(run).items():
        figures |= {f"{stage}_{k}": v for k, v in values.items() if k != "sgm_seconds" or stage == "match"}
    return figures


def print_table(figures: dict[str, float]) -> None:
    print(f"\n{'figure':<28} {'measured':>12}   asked")
    for name, value in figures.items():
        print(f"{name:<28} {value:>12.4f}   {ASKED.get(name, '')}")


def products(run: Path) -> dict[str, bytes]:
    """All products of a run by path, but those that name tiles' times."""
    return {str(p.relative_to(run)): p.read_bytes() for p in sorted((run / "products").rglob("*")) if p.is_file()}


def compare_bytes(first: Path, second: Path) -> None:
    """Whether two runs left the same bytes, products and chunks alike."""
    a, b = products(first), products(second)
    chunks = [
        {str(p.relative_to(r)): p.read_bytes() for p in sorted((r / "surface.zarr").rglob("*")) if p.is_file()}
        for r in (first, second)
    ]
    unlike = [n for n in sorted({*a, *b}) if a.get(n) != b.get(n)]
    unlike += [n for n in sorted({*chunks[0], *chunks[1]}) if chunks[0].get(n) != chunks[1].get(n)]
    print(f"{len(a)} products and {len(chunks[0])} files of surface.zarr: {len(unlike)} differ {unlike[:5]}")


def compare_heights(first: Path, second: Path, bounds: Bounds) -> None:
    """Cells of two surfaces that agree to a millimetre, or are holes in both."""
    a, b = (read_surface(r, bounds).dsm for r in (first, second))
    both = np.isfinite(a) & np.isfinite(b)
    alike = (np.abs(np.where(both, a - b, np.inf)) <= 1e-3) | (np.isnan(a) & np.isnan(b))
    print(f"another tile: {alike.mean():.5%} of {alike.size} cells within 1 mm (asked ≥ 99.9 %)")


def survey_images(survey: Path) -> tuple[OrientedImage, ...]:
    """True poses."""
    area = parameters_of(survey).area
    model = read_colmap(survey / "truth" / "orientation")
    return tuple(replace(i, centre=i.centre + np.array([area[0], area[1], 0.0])) for i in model.images)


def _arguments() -> argparse.Namespace:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seed", type=int, default=7)
    options.add_argument("--size", default="100")
    options.add_argument("--survey", type=Path, default=None)
    options.add_argument("--run", type=Path, default=None)
    options.add_argument("--tiles", type=float, default=100.0, help="edge of a ground tile, metres")
    options.add_argument("--aoi", default="", help="x_min,y_min,x_max,y_max; the surveyed area")
    options.add_argument("--overlap", type=float, default=None, help="forward overlap, less than that of the pictures")
    options.add_argument("--cut", action="store_true", help="no tiles but those judged")
    options.add_argument("--also", type=float, default=0.0, help="another edge of tiles, to compare heights with")
    options.add_argument("--workers", type=int, default=1)
    options.add_argument(
        "--bytes", action="store_true", help="run again with another number of workers, and compare bytes"
    )
    options.add_argument("--set", action="append", default=[], dest="synth", help="of `cityflow synth`")
    options.add_argument("--json", type=Path, default=None, help="write the figures there")
    return options.parse_args()


def main() -> None:
    o = _arguments()
    survey = o.survey or Path("runs") / f"town_{o.seed}_{o.size}"
    if not (survey / "catalog").exists():
        make_survey(survey, o.seed, o.size, [*SMALL_PICTURES, *o.synth], o.workers)
    p = parameters_of(survey)
    area: Bounds = tuple(float(v) for v in o.aoi.split(",")) if o.aoi else p.area  # type: ignore[assignment]
    tiles = [t.name for t in tiles_over(area, o.tiles)]
    run = o.run or survey.with_name(f"{survey.name}_run_{o.tiles:g}")
    run_pictures(survey, run, tiles, settings_of(o.tiles), o)
    bounds = judged_area(area, tiles, o.tiles, o.cut)
    cell = parameters_cell(run)
    figures = table(run, Judge(town_of(p.seed, p.whole_town), bounds, cell, survey_images(survey)))
    print_table(figures)
    if o.json is not None:
        o.json.write_text(json.dumps(figures, indent=1))
    if o.also:
        other = run.with_name(f"{run.name}_also_{o.also:g}")
        wanted = [t.name for t in tiles_over(area, o.also)]
        run_pictures(survey, other, wanted, settings_of(o.also), o)
        compare_heights(run, other, judged_area(area, wanted, o.also, o.cut))
    if o.bytes:
        again = run.with_name(f"{run.name}_again")
        run_pictures(
            survey,
            again,
            tiles,
            settings_of(o.tiles),
            argparse.Namespace(**{**vars(o), "workers": 3 - min(o.workers, 2)}),
        )
        compare_bytes(run, again)


def parameters_cell(run: Path) -> float:
    """Cell of the run's DSM, metres."""
    return float(json.loads((run / "surface.zarr" / "zarr.json").read_text())["attributes"]["cell"])


if __name__ == "__main__":
    main()
