"""``cityflow orient``: a catalog whose images have refined poses."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from rich.console import Console

from cityflow.adjustment.control import LEAST_MARKS
from cityflow.catalog.write_folder import refuse_foreign_folder, store_catalog
from cityflow.core.building import Status
from cityflow.core.control_points import ControlPoints
from cityflow.core.parameters import merged
from cityflow.errors import CatalogError, RunError, WorkflowError
from cityflow.flow.cluster import connect, threads_of
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import watcher
from cityflow.flow.progress_counts import Expected
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.flow.task_source import Source
from cityflow.handover.refined_block import RefinedPose, decode_points, decode_poses
from cityflow.io.catalog.stac import Catalog
from cityflow.io.catalog.stac_assets import ImageAsset
from cityflow.io.control_points.marked_images import with_catalog_names
from cityflow.io.control_points.read_points import read_control_points
from cityflow.io.control_points.references import in_crs
from cityflow.io.crs import crs_of, resolve
from cityflow.io.tables.feature_ids import listing
from cityflow.orientation.sights import looks_level
from cityflow.orientation.views import View, footprint
from cityflow.reporting.orientation_doubts import orientation_figures
from cityflow.reporting.orientation_report import FIGURES, Oriented, tie_points, write_orientation_report
from cityflow.reporting.orientation_words import control_lines
from cityflow.runs.settings import explain_invalid, parse_setting
from cityflow.stages.orient import (
    ADJUST,
    BLOCK,
    BLOCK_FILE,
    FEATURES,
    POINTS_FILE,
    TIES,
    OrientParameters,
    OrientSource,
)
from cityflow.stages.orient.photographs import MAP, MATCHES, PAIRS

REPORT = FIGURES
OF_AN_IMAGE = ("observations", "reprojection_px", "sigma_px", "position_sigmas_m", "angle_sigmas_deg", "covariance")
SECONDS = {FEATURES: 20.0, TIES: 5.0, ADJUST: 30.0, PAIRS: 10.0, MATCHES: 5.0, MAP: 60.0}
"""Of a task, before some are done."""
FEWEST = 3
"""Images below which no block is adjusted."""


def orient_parameters(settings: Sequence[str]) -> OrientParameters:
    """The parameters from ``--set``. Raises WorkflowError where a key is unknown or a value does not fit."""
    tree: dict[str, Any] = {}
    for setting in settings:
        tree = merged(tree, parse_setting(setting, OrientParameters))
    try:
        return OrientParameters.model_validate(tree)
    except ValidationError as error:
        problem = explain_invalid(error, OrientParameters)
        raise WorkflowError(problem, where="--set", remedy="docs/orient.md lists the keys") from None


def orient_catalog(
    given: Catalog,
    out: Path,
    work: Path,
    parameters: OrientParameters,
    scheduler: str,
    workers: int,
    console: Console,
    control: ControlPoints | None = None,
) -> Catalog:
    """Refine the poses of a catalog, and write the catalog that has them; all else in it stays.

    Parameters
    ----------
    out : folder of the new catalog;  work : folder of features, ties and records: what is there already is kept
    control : known points in the catalog's CRS, with its names of images; see `control_in`

    Raises
    ------
    CatalogError, RunError
        The catalog has too few images, the folders hold something else, or the images show nothing in common.
    """
    refuse_foreign_folder(out)
    if out.resolve() == Path(given.href).resolve():
        raise CatalogError("this is the given catalog", where=str(out), remedy="name another folder with --out")
    flown = tuple(a for a in given.images if not looks_level(a.oriented, a.heights[1]))
    if len(flown) < FEWEST:
        problem = f"the catalog has {len(flown)} images from the air, {FEWEST} are needed"
        raise CatalogError(problem, where=given.href, remedy="make it with --images and an orientation")
    refuse_other_work(work)
    for note in control.notes if control is not None else ():
        say(console, note)
    points = control.points if control is not None else ()
    store, source = Store.open(str(work)), OrientSource(flown, parameters, points)
    store.check_writable()
    if not source.pairs:
        raise CatalogError("no two images see the same ground", where=given.href, remedy="cityflow catalog check")
    say(console, f"{len(flown)} images, {source.pairs} pairs of {len(flown) * (len(flown) - 1) // 2} are compared")
    with Ledger.open(store) as ledger:
        counts = {FEATURES: len(source.partners), TIES: sum(map(bool, source.partners.values())), ADJUST: 1}
        run_stages(source, counts, store, ledger, scheduler, workers)
        record = ledger.latest(ADJUST, BLOCK)
        if record is None or record.status is Status.FAILED:
            reason = record.reason if record is not None else "no ties"
            raise RunError(f"the block could not be adjusted: {reason}", where=str(work), remedy="see docs/orient.md")
        failed = sorted(u for u in ledger.units(FEATURES) if _failed(ledger, u) and u in source.partners)
    summary = dict(record.result)
    outputs = {Path(path).name: path for path in record.outputs}
    block = json.loads(store.read_bytes(outputs[BLOCK_FILE]))
    poses = decode_poses(block)
    images = tuple(_with_pose(a, poses[a.name]) if a.name in poses else a for a in given.images)
    report = {
        "summary": summary, "cameras": block["cameras"], "left_out": failed, "parameters": parameters.model_dump(mode="json"),
        "images": {i["name"]: {key: i[key] for key in OF_AN_IMAGE} for i in block["images"]},
    }  # fmt: skip
    refined = replace(
        given, href=str(out.absolute()), images=images, made_in="", orientation=orientation_figures(report)
    )
    made = store_catalog(refined, out, copy=False)
    ties = tie_points(decode_points(store.read_bytes(outputs[POINTS_FILE])))
    places = {p.name: p.xyz for p in points}
    write_orientation_report(out, Oriented(report, made, ties, {a.name: a.oriented for a in given.images}, places))
    for line in described(summary, failed):
        say(console, line)
    say(console, f"Catalog written to {out}. Next: cityflow run WORKFLOW --catalog {shlex.quote(str(out))}")
    return made


def control_in(given: Catalog, path: Path, marks: Path | None = None, crs: str = "") -> ControlPoints:
    """Known points in the catalog's CRS, with its names of images.

    Parameters
    ----------
    path : as `read_control_points`;  marks : file of marks, for Pix4D
    crs : of the points, where their file states none

    Raises
    ------
    CatalogError
        The file cannot be read or led to the catalog's CRS, or no point is marked in two images of the catalog.
    """
    own = crs_of(resolve(crs)) if crs else None
    found = in_crs(read_control_points(path, marks), crs_of(given.reference), own)
    named = with_catalog_names(found, {a.name: a.href for a in given.images})
    if not any(len(p.marks) >= LEAST_MARKS for p in named.points):
        problem = f"none of its {len(named.points)} points is marked in two images of the catalog"
        raise CatalogError(problem, where=str(path), remedy="check the names of images; see docs/control_points.md")
    short = [p.name for p in named.points if len(p.marks) < LEAST_MARKS]
    notes = (f"marked in fewer than {LEAST_MARKS} images and not used: {listing(short)}",) if short else ()
    return replace(named, notes=(*named.notes, *notes))


def described(summary: Mapping[str, Any], failed: Sequence[str]) -> Iterator[str]:
    """What the adjustment found, in lines for people."""
    yield (
        f"{summary['tie_points']} tie points in {summary['observations']} places, image coordinates exact to {summary['sigma_px']:.2f} px; "
        f"given poses are off by {summary['position_sigma_m'] * 100:.1f} cm and {summary['angle_sigma_deg']:.4f}° (estimated)"
    )
    change = f"{summary['check_before_px']:.2f} → {summary['check_after_px']:.2f} px on tie points that were kept out"
    if summary["better"]:
        yield f"Poses refined: {change}; centres move by {summary['median_move_m'] * 100:.1f} cm in the median"
    elif summary["refined"]:
        yield f"Poses follow the control points; tie points alone would have left them as given: {change}"
    else:
        yield f"Poses stay as given, as refined ones are not significantly better: {change}"
    if summary["calibrated"]:
        yield "Cameras calibrated: see cameras in orientation.json"
    elif summary["cameras_doubtful"]:
        yield "Cameras seem to be off, and poses make up for it: see cameras in orientation.json, and --set adjustment.calibrate=true"
    yield from control_lines(summary["control"]) if "control" in summary else ()
    if summary["weak"]:
        yield f"Weak: {listing(summary['weak'])}: few or no tie points hold their poses"
    if failed:
        yield f"Left out: {listing(failed)}: the file could not be read; the pose stays"


def _with_pose(asset: ImageAsset, pose: RefinedPose) -> ImageAsset:
    seen = footprint(View(pose.image, asset.heights))
    bounds = asset.bounds
    if not seen.is_empty:
        x_min, y_min, x_max, y_max = (round(float(v), 3) for v in seen.bounds)
        bounds = x_min, y_min, x_max, y_max
    return replace(asset, oriented=pose.image, bounds=bounds, pose_covariance=pose.covariance)


def run_stages(
    source: Source, counts: Mapping[str, int], store: Store, ledger: Ledger, scheduler: str, workers: int
) -> None:
    """Run all tasks of a source; what failed is tried again. Raises KeyboardInterrupt where somebody stopped it.

    Parameters
    ----------
    counts : stage → tasks that are expected
    """
    with connect(scheduler or None, workers or os.cpu_count() or 1) as client, closing(watcher()) as progress:
        progress.message(f"Dashboard: {client.dashboard_link}")
        progress.expect({s: Expected(n, SECONDS[s]) for s, n in counts.items()}, threads_of(client))
        if run_tasks(source, client, store, ledger, progress=progress, redo=_has_failed).interrupted:
            raise KeyboardInterrupt


def _has_failed(_task: Task, record: Record) -> bool:
    return record.status is Status.FAILED


def _failed(ledger: Ledger, unit: str) -> bool:
    record = ledger.latest(FEATURES, unit)
    return record is not None and record.status is Status.FAILED


def refuse_other_work(work: Path) -> None:
    """Raises RunError where the folder of features and records holds something else."""
    if work.exists() and not work.is_dir():
        raise RunError("this is no folder", where=str(work), remedy="name another one with --work")
    if work.is_dir() and any(work.iterdir()) and ((work / "run.json").exists() or not (work / "records").is_dir()):
        raise RunError("the folder holds something else", where=str(work), remedy="name another one with --work")


def say(console: Console, text: str) -> None:
    """A line as it is, without markup."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)
