"""Speed and accuracy of dense matching, and the budget of a whole run, against one plain StereoSGBM per image in the same session.

    python benchmarks/matching_speed.py images --seed 1                  # whole reference images: pixels a second, steps, limit of the machine, truth
    python benchmarks/matching_speed.py run --seed 1 --run RUN           # a whole run, in this process: seconds of each stage / baseline; DSM and façades
    python benchmarks/matching_speed.py large --survey FOLDER --factor 4 # one reference image of 24 megapixels with its partners: time and memory

All seconds are of the processor (this process, all its threads), so other work on the machine matters little; ratios are within one call. The process keeps
its heap as the children of a run do.
The baseline is OpenCV's StereoSGBM: five paths, 128 disparities, one way, one thread, whole images of the flight. ``images`` and ``run`` make
their town (``cityflow synth``) where --survey names none that exists. Matching was developed on seeds 1 and 7.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from cityflow.flow.child_environment import KEPT_HEAP
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.matching.match import MatchParameters
from cityflow.stages.synth.synthetic_survey import town_of
from matching_steps import STEPS
from run_here import RunCost, run_here
from scenes.matched_images import (
    depth_figures,
    match_whole,
    reference_views,
    tiled_pixels,
    true_views,
)
from scenes.vector_loops import bare_rate, path_rate, plain_sgbm_seconds
from step_times import COMPILING, StepTimes, share_table
from town_figures import Judge, read_surface, surface_figures, wall_figures
from town_images import ASKED, WORKFLOW, make_survey, parameters_cell, parameters_of, survey_images

FLIGHT = (
    "flight.width_px=1500", "flight.height_px=1000", "flight.forward_overlap=0.7", "flight.side_overlap=0.5",
)  # fmt: skip
BASELINE_PAIRS, BASELINE_REPEATS = 3, 3
BUDGET = {"match": 5.0}
OTHERS, WHOLE = 3.0, 8.0
ASKED_CORE_HOURS = 7.0
BUDGET_ASKED = {"match_ratio": "<= 5", "others_ratio": "<= 3", "whole_ratio": "<= 8", "core_hours_km2": "<= 7"}
SURFACE_ASKED = {"nmad_gsd": "<= 0.15", "within": ">= 0.996", "completeness": ">= 0.999", "rim_holes_missed": ">= 0.92"}


def survey_of(o: argparse.Namespace) -> Path:
    """The town with its flight, made where there is none."""
    survey = o.survey or Path("runs") / f"speed_{o.seed}_{o.size}"
    if not (survey / "catalog").exists():
        make_survey(survey, o.seed, o.size, [*FLIGHT, *o.synth], 1)
    return Path(survey)


def baseline_of(catalog: Catalog) -> float:
    """Seconds of plain matching per image: of consecutive exposures of the same head, from the middle of the flight."""
    assets = sorted(catalog.images, key=lambda a: (a.name.rpartition("_")[2], a.name))
    middle = len(assets) // 2
    grey = []
    for asset in assets[middle : middle + BASELINE_PAIRS + 1]:
        image = cv2.imread(asset.href, cv2.IMREAD_GRAYSCALE)
        assert image is not None, asset.href
        grey.append(np.asarray(image, np.uint8))
    return plain_sgbm_seconds(list(pairwise(grey)), BASELINE_REPEATS)


def measure_images(o: argparse.Namespace) -> dict[str, float]:
    """Whole reference images, one after the other, each with its partners."""
    survey = survey_of(o)
    catalog = read_catalog(str(survey / "catalog"))
    views = reference_views(catalog, o.images, o.partners)
    names = sorted({n for v in views for n in (v.image.name, *(p.name for p in v.partners))})
    pixels = tiled_pixels(catalog, names, survey / "tiled")
    baseline = baseline_of(catalog)
    times, matched, accuracy = StepTimes(STEPS), 0, []
    begun = time.process_time()
    found = []
    with times.watched():
        for view in views:
            found.append(match_whole(view, pixels, MatchParameters()))
            matched += view.image.camera.width * view.image.camera.height
    seconds = time.process_time() - begun - times.seconds[COMPILING]
    truths = [] if o.no_truth else true_views(parameters_of(survey), [v.image for v in views], survey / "tiled")
    for k, (view, (result, depth_map)) in enumerate(zip(views, found, strict=True)):
        pairs = f"{sum(p.used for p in result.pairs)} of {len(result.pairs)} pairs used"
        line = f"{view.image.name}, {view.direction}: {pairs}"
        if truths and depth_map is not None:
            accuracy.append(depth_figures(depth_map, truths[k]))
            line += "; " + ", ".join(f"{k} {v:.4g}" for k, v in accuracy[-1].items())
        print(line)
    print(*share_table(times, seconds, "of match"), sep="\n")
    searched = sum(times.counted.values())
    rate, bare = path_rate(o.limit_disparities), bare_rate()
    figures = {
        "baseline_s": baseline, "reference_px": float(matched), "seconds": seconds, "px_per_s": matched / seconds,
        "seconds_per_image_over_baseline": seconds / len(views) / baseline,
        "disparities_per_px": searched / matched, "searched_per_s": searched / seconds,
        "path_rate": rate, "bare_rate": bare, "limit_s": o.limit_paths * searched / rate,
        "of_limit": o.limit_paths * searched / rate / seconds,
        "compiled": float(len(times.compiled)), "peak_mb": peak_mb(),
    }  # fmt: skip
    for key in accuracy[0] if accuracy else ():
        figures[key] = float(np.nanmean([a[key] for a in accuracy]))
    asked = {"px_per_s": ">= 10 times the state before; goal 1e6"}
    print_figures(figures, asked)
    return figures


def measure_run(o: argparse.Namespace) -> dict[str, float]:
    """A whole run over the surveyed area in this process."""
    survey = survey_of(o)
    catalog = read_catalog(str(survey / "catalog"))
    p = parameters_of(survey)
    aoi = o.aoi or ",".join(f"{v:g}" for v in p.area)
    bounds = tuple(float(v) for v in aoi.split(","))
    out = o.run or survey.with_name(f"{survey.name}_run")
    before = baseline_of(catalog)
    times = StepTimes(STEPS)
    with times.watched():
        _, cost = run_here(WORKFLOW, str(survey / "catalog"), out, o.set, aoi, times)
    baseline = (before + baseline_of(catalog)) / 2
    figures = budget(cost, baseline, len(catalog.images), surveyed_m2(out))
    print(*share_table(times, sum(c.seconds for c in cost.stages.values()), "of the run"), sep="\n")
    judge = Judge(town_of(p.seed, p.whole_town), bounds, parameters_cell(out), survey_images(survey))  # type: ignore[arg-type]
    figures |= surface_figures(read_surface(out, judge.bounds).dsm, judge)
    walls = wall_figures(out, judge)
    figures |= {"covered": walls.covered, "wall_nmad_gsd": walls.nmad / judge.cell_m, "wall_area_m2": walls.area_m2}
    print_figures(figures, ASKED | BUDGET_ASKED | SURFACE_ASKED)
    return figures


def surveyed_m2(run: Path) -> float:
    """Ground that surfaces were made of: that of whole ground tiles, more than an area of interest in their middle."""
    records = [json.loads(p.read_bytes()) for p in (run / "records" / "surface").rglob("*.json")]
    return float(sum(r["result"].get("surveyed_m2", 0.0) for r in records))


def budget(cost: RunCost, baseline: float, images: int, area_m2: float) -> dict[str, float]:
    """Print what each stage takes of what it may; returns the sums."""
    unit = baseline * images
    print(f"\nbaseline {baseline:.3f} s an image, {images} images, {area_m2:.0f} m² of surface made")
    print(f"{'stage':<14} {'tasks':>6} {'failed':>6} {'s':>9} {'/ baseline':>11} {'asked':>6} {'compiling s':>12}")
    for name, c in cost.stages.items():
        asked = f"{BUDGET[name]:g}" if name in BUDGET else ""
        kernels = f"{c.compiling:>12.1f} {sorted(set(c.compiled))}" if c.compiled else ""
        print(f"{name:<14} {c.tasks:>6} {c.failed:>6} {c.seconds:>9.1f} {c.seconds / unit:>11.2f} {asked:>6} {kernels}")
    match = cost.stages["match"].seconds
    others = sum(c.seconds for n, c in cost.stages.items() if n != "match")
    for name, seconds, limit in (("match", match, BUDGET["match"]), ("all others", others, OTHERS), ("whole run", match + others, WHOLE)):  # fmt: skip
        print(f"{name:<14} {'':>13} {seconds:>9.1f} {seconds / unit:>11.2f} {limit:>6g}")
    hours = (match + others) / 3600 / area_m2 * 1e6
    print(f"{hours:.1f} core-hours per km² (asked <= {ASKED_CORE_HOURS:g}); making the tasks: {cost.driver:.1f} s")
    print("compiling is not in these seconds: kernels are shipped compiled")
    stages = {f"{n}_s": c.seconds for n, c in cost.stages.items()}
    return {
        "baseline_s": baseline, "images": float(images), "match_ratio": match / unit, "others_ratio": others / unit,
        "whole_ratio": (match + others) / unit, "core_hours_km2": hours, "driver_s": cost.driver, **stages,
        "compiled": float(sum(len(c.compiled) for c in cost.stages.values())),
        "compiling_s": sum(c.compiling for c in cost.stages.values()), "peak_mb": cost.peak_mb,
    }  # fmt: skip


def measure_large(o: argparse.Namespace) -> dict[str, float]:
    """One flight tile of an enlarged flight through match and fuse, by the engine (benchmarks/town_memory.py), and its peaks."""
    if o.survey is None or o.run is None:
        raise SystemExit("large wants --survey and --run")
    command = [sys.executable, str(Path(__file__).with_name("town_memory.py")), "--survey", str(o.survey)]
    command += ["--factor", str(o.factor), "--out", str(o.run), "--limit-mb", str(o.limit_mb), "--fuse"]
    subprocess.run(command, check=True)
    return {}


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def print_figures(figures: dict[str, float], asked: dict[str, str]) -> None:
    print(f"\n{'figure':<34} {'measured':>14}   asked")
    for name, value in figures.items():
        print(f"{name:<34} {value:>14.6g}   {asked.get(name, '')}")


def _arguments() -> argparse.Namespace:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("what", choices=("images", "run", "large"))
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--size", default="40")
    options.add_argument("--survey", type=Path, default=None, help="a synthetic survey; made where it is not there")
    options.add_argument("--synth", action="append", default=[], help="further settings of `cityflow synth`")
    options.add_argument("--json", type=Path, default=None, help="write the figures there")
    images = options.add_argument_group("images")
    images.add_argument("--images", type=int, default=3, help="reference images, look direction after look direction")
    images.add_argument("--partners", type=int, default=6)
    images.add_argument("--no-truth", action="store_true", help="time only")
    images.add_argument("--limit-disparities", type=int, default=32, help="of the vectorised path that is the limit")
    images.add_argument("--limit-paths", type=int, default=4, help="paths of semi-global matching that the limit has")
    run = options.add_argument_group("run")
    run.add_argument("--run", type=Path, default=None, help="folder of the run, a new one")
    run.add_argument("--aoi", default="", help="x_min,y_min,x_max,y_max; the surveyed area")
    run.add_argument("--set", action="append", default=[], help="of the workflow")
    large = options.add_argument_group("large")
    large.add_argument("--factor", type=int, default=4, help="4: 24 megapixels, 10: 150 megapixels")
    large.add_argument("--limit-mb", type=float, default=3000.0)
    return options.parse_args()


def keep_heap() -> None:
    """Begin this process anew with the settings of a run's children: the C library reads them once, at the start."""
    if any(os.environ.get(name) != value for name, value in KEPT_HEAP.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **KEPT_HEAP})


def main() -> None:
    o = _arguments()
    keep_heap()
    cv2.setNumThreads(1)
    figures = {"images": measure_images, "run": measure_run, "large": measure_large}[o.what](o)
    if o.json is not None:
        o.json.write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
