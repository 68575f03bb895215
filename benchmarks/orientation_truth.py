"""What errors of poses and pictures cost: a synthetic flight, clean and spoiled, with true, given and refined poses, run as a user's survey would be.

    python benchmarks/orientation_truth.py FOLDER --seed 33                            # makes surveys, catalogs and runs, and prints the table
    python benchmarks/orientation_truth.py FOLDER --seed 33 --only clean spoiled       # these cases alone

Cases: ``clean`` (true poses, clean pictures), ``blurred`` (true poses, pictures of `synth --condition spoiled`), ``spoiled`` (those pictures, each
pose off by itself by 0.4 pixels and 2 cm), ``refined`` (those poses after ``cityflow orient``). Outlines are found and split by the run;
roofs and borders are judged against the true units. Everything is measured on products and kept as FOLDER/CASE.json; what is there already is not made again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cityflow.core.camera import OrientedImage
from cityflow.evaluation.models import compare_model
from cityflow.evaluation.poses import pose_figures
from cityflow.evaluation.relative_accuracy import block_figures
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.orientation.colmap import read_colmap
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.workflow.synth_files import tie_points
from town_figures import Judge, read_surface, surface_figures
from town_images import parameters_of
from town_models import of_run

CLEAN, BLURRED, SPOILED, REFINED = "clean", "blurred", "spoiled", "refined"
CASES = (CLEAN, BLURRED, SPOILED, REFINED)
WORKFLOW = Path(__file__).parents[1] / "workflows" / "oblique_city.yaml"
FLIGHT = {
    "flight.width_px": 900, "flight.height_px": 600, "flight.gsd_m": 0.1, "flight.forward_overlap": 0.6,
    "flight.side_overlap": 0.5, "truth_cell_m": 0.1,
}  # fmt: skip
"""Small pictures, so that a case takes minutes."""
RUN = ("outline.source=found", "export.formats=[cityjson]", "texture.when=never", "orient.refine=never")
ASKED = {
    "dsm NMAD, GSD": "≤ 0.2", "dsm within 3 GSD, %": "≥ 99.5", "rim within 3 GSD, %": "≥ 92",
    "roofs within 15 cm, %": "≥ 98", "planes right ± 1, %": "≥ 95", "borders found": "true poses - 2 points",
}  # fmt: skip
"""Of the refined poses."""


def survey_of(folder: Path, case: str, seed: int, size: str) -> Path:
    """``cityflow synth``; all cases but the first share the spoiled pictures."""
    condition = CLEAN if case == CLEAN else SPOILED
    settings = [w for key, value in FLIGHT.items() for w in ("--set", f"{key}={value}")]
    survey = folder / condition
    if not (survey / "catalog" / "collection.json").exists():
        _cityflow("synth", survey, "--seed", seed, "--size", size, "--condition", condition, "--workers", 1, *settings)
    return survey


def catalog_of(folder: Path, case: str, survey: Path) -> Path:
    """The pictures with the poses of a case."""
    catalog = folder / f"catalog_{case}"
    if (catalog / "collection.json").exists():
        return catalog
    if case == REFINED:
        given = catalog_of(folder, SPOILED, survey)
        _cityflow("orient", given, "--out", catalog, "--workers", 1)
        return catalog
    p = parameters_of(survey)
    poses = survey / "orientation" if case == SPOILED else survey / "truth" / "orientation"
    _cityflow(
        "catalog", "create", catalog, "--images", survey / "images", "--colmap", poses, "--origin", f"{p.origin[0]},{p.origin[1]},0",
        "--crs", p.crs, "--workers", 1,
    )  # fmt: skip
    return catalog


def run_of(folder: Path, case: str, catalog: Path, p: SynthParameters) -> Path:
    run = folder / f"run_{case}"
    if not (run / "products" / "city.city.jsonl").exists():
        settings = [w for setting in RUN for w in ("--set", setting)]
        area = ",".join(f"{v:g}" for v in p.area)
        _cityflow("run", WORKFLOW, "--catalog", catalog, "--out", run, "--aoi", area, "--workers", 1, *settings)
    return run


def _cityflow(*words: object) -> None:
    subprocess.run([sys.executable, "-m", "cityflow", *map(str, words)], check=True)


def poses_in(folder: Path, p: SynthParameters) -> tuple[OrientedImage, ...]:
    """Poses of a COLMAP model of `synth`, in the world."""
    return tuple(replace(i, centre=i.centre + np.array([*p.origin, 0.0])) for i in read_colmap(folder).images)


def surface_part(run: Path, p: SynthParameters) -> dict[str, float]:
    cell = float(json.loads((run / "surface.zarr" / "zarr.json").read_text())["attributes"]["cell"])
    judge = Judge(town_of(p.seed, p.whole_town), p.area, cell, ())
    found = surface_figures(read_surface(run, p.area).dsm, judge)
    gsd = 1.0 if p.flight is None else p.flight.gsd_m
    return {
        "dsm NMAD, GSD": found["nmad_gsd"] * cell / gsd, "dsm bias, GSD": found["bias_gsd"] * cell / gsd,
        "dsm within 3 GSD, %": 100 * found["within"], "rim within 3 GSD, %": 100 * found["rim"],
        "rim, holes as misses, %": 100 * found["rim_holes_missed"], "complete, %": 100 * found["completeness"],
    }  # fmt: skip


def model_part(run: Path, survey: Path) -> dict[str, float]:
    errors = [compare_model(truth, model) for truth, model in of_run(run, survey)]
    area = sum(e.surface.area_m2 for e in errors)
    return {
        "units": len(errors), "roofs within 15 cm, %": 100 * sum(e.surface.within * e.surface.area_m2 for e in errors) / area,
        "planes right ± 1, %": 100 * float(np.mean([e.planes_right for e in errors])),
        "planes": sum(e.planes for e in errors), "true planes": sum(e.true_planes for e in errors),
    }  # fmt: skip


def border_part(run: Path, survey: Path) -> dict[str, float]:
    words = ["evaluate", "units", str(run), str(survey / "truth" / "town.gpkg"), "--layer", "units", "--json"]
    told = subprocess.run([sys.executable, "-m", "cityflow", *words], check=True, capture_output=True, text=True)
    tree = json.loads(told.stdout)
    return {
        "borders": tree["borders"], "borders found": tree["hits"], "false cut lines": tree["false_alarms"],
        "border position, m": tree["position_m"], "unit IoU": tree["unit_iou_mean"],
    }  # fmt: skip


def pose_part(catalog: Path, survey: Path, p: SynthParameters) -> dict[str, float]:
    """The catalog's poses against the true ones; relative errors by true points on ground and roofs."""
    truth = poses_in(survey / "truth" / "orientation", p)
    found = [a.oriented for a in read_catalog(str(catalog)).images]
    named = {Path(i.name).stem: i for i in found}
    found = [replace(named[Path(t.name).stem], name=t.name) for t in truth if Path(t.name).stem in named]
    poses, block = pose_figures(found, truth), block_figures(found, truth, tie_points(town_of(p.seed, p.whole_town), p))
    gsd = 1.0 if p.flight is None else p.flight.gsd_m
    return {
        "images": poses.images, "centres RMSE, GSD": poses.centre_rmse_m / gsd, "rotations RMSE, deg": poses.angle_rmse_deg,
        "focal length, %": poses.focal_percent, "vertical parallax RMS, px": block.parallax_rms_px,
        "intersections plan RMSE, GSD": block.plan_rmse_m / gsd, "intersections height RMSE, GSD": block.height_rmse_m / gsd,
    }  # fmt: skip


def figures_of(folder: Path, case: str, asked: argparse.Namespace) -> dict[str, float]:
    """All figures of a case, kept."""
    kept = folder / f"{case}.json"
    if kept.exists():
        return dict(json.loads(kept.read_text()))
    survey = survey_of(folder, case, asked.seed, asked.size)
    p = parameters_of(survey)
    catalog = catalog_of(folder, case, survey)
    print(case, poses := pose_part(catalog, survey, p), flush=True)
    run = run_of(folder, case, catalog, p)
    figures = poses | surface_part(run, p) | model_part(run, survey) | border_part(run, survey)
    kept.write_text(json.dumps(figures, indent=1))
    return figures


def print_table(columns: dict[str, dict[str, float]]) -> None:
    print(f"\n{'figure':<28}" + "".join(f"{case:>12}" for case in columns) + "   asked of refined")
    for name in next(iter(columns.values())):
        values = "".join(f"{column.get(name, float('nan')):>12.4g}" for column in columns.values())
        print(f"{name:<28}{values}   {ASKED.get(name, '')}")


def main(words: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", type=Path)
    options.add_argument("--seed", type=int, default=33)
    options.add_argument("--size", default="50x40")
    options.add_argument("--only", nargs="+", choices=CASES, default=CASES)
    asked = options.parse_args(words)
    asked.folder.mkdir(parents=True, exist_ok=True)
    print_table({case: figures_of(asked.folder, case, asked) for case in asked.only})


if __name__ == "__main__":
    main()
