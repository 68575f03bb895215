"""``cityflow orient`` for photographs without poses: a catalog of those that hang together, placed by GNSS or control points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from cityflow.adjustment.mapping import MappedModel
from cityflow.catalog.create import create_catalog
from cityflow.catalog.image_files import ImageFiles
from cityflow.catalog.orientation import ImageSource
from cityflow.catalog.photo_folder import PhotoFolder, photo_folder
from cityflow.catalog.write_folder import refuse_foreign_folder, store_catalog
from cityflow.core.building import Status
from cityflow.core.control_points import ControlPoints
from cityflow.core.json_values import rounded
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError, RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.mapped_models import decode_models
from cityflow.handover.source_file import SourceFile
from cityflow.io.catalog.stac import Catalog
from cityflow.io.images.subtitles import subtitles_of
from cityflow.io.orientation.colmap import write_colmap
from cityflow.reporting.carrier_track import TRACK, track_lines
from cityflow.reporting.orientation_doubts import orientation_figures
from cityflow.reporting.orientation_report import Oriented, tie_points, write_orientation_report
from cityflow.reporting.photograph_words import photograph_lines
from cityflow.runs.first_look import is_video_file
from cityflow.runs.settings import parameters_from
from cityflow.stages.orient import BLOCK, FEATURES
from cityflow.stages.orient.photographs import MAP, MATCHES, PAIRS, Photo, PhotoCamera, PhotoParameters, PhotoSource
from cityflow.viewer.orientation_rows import TiePoints
from cityflow.workflow.catalog_reading import reading_files
from cityflow.workflow.frame_sequence import add_track, frames_of_video, stills_of_sequence
from cityflow.workflow.onto import registered_to, surveyed
from cityflow.workflow.orient import refuse_other_work, run_stages, say, say_next
from cityflow.workflow.photo_adjusting import Known, add_adjustment, adjusted_model, adjustment_lines, with_covariances
from cityflow.workflow.photo_placing import Placed, Placing, known_control, known_positions, place
from cityflow.workflow.photos_onto import files_of, moved_adjustment, moved_onto, placing_before, usual_search

PHOTOS_CITY, LIDAR_PHOTOS_CITY = "workflows/photos_city.yaml", "workflows/lidar_photos_city.yaml"
MODEL = "model"
"""Folder of the placed COLMAP model in the work folder."""
FEW_POINTS = 20
"""An image that fewer tie points hold is weak; set by hand."""


def photo_parameters(settings: Sequence[str]) -> PhotoParameters:
    """The parameters from ``--set``. Raises WorkflowError where a key is unknown or a value does not fit."""
    return parameters_from(settings, PhotoParameters, "docs/orient.md lists the keys")


def orient_photographs(
    folder: Path, out: Path, work: Path, placing: Placing, parameters: PhotoParameters, scheduler: str, workers: int, console: Console
) -> Catalog:  # fmt: skip
    """Orient the photographs of a folder, or frames of a video, and make a catalog of those that hang together.

    Parameters
    ----------
    folder : of photographs, or the file of a video
    out : folder of the new catalog;  work : folder of features, matches and records: what is there already is kept

    Raises
    ------
    CatalogError, RunError
        Nothing tells place and scale, no two photographs show the same, or the folders hold something else.
    """
    refuse_foreign_folder(out)
    refuse_other_work(work)
    control = known_control(placing)
    survey = None if placing.onto is None else surveyed(placing.onto, work, scheduler, workers, console)
    given, sequence = folder, None
    if is_video_file(str(given)):
        if survey is None and subtitles_of(given) is None:
            known_positions(placing, {}, control)
        sequence = frames_of_video(given, out, work, parameters.frames, scheduler, workers, console)
        folder = sequence.folder
    with reading_files(scheduler, workers, console, kept_beside=out) as reading:
        found = photo_folder(folder, reading)
        if sequence is None and parameters.sequence:
            sequence = stills_of_sequence(folder, found.files, work, parameters.frames, scheduler, workers, console)
            found = photo_folder(folder, reading, sequence.files)
    for note in found.notes:
        say(console, f"Note: {note}")
    if placing.arm is not None and len(found.focals) > 1:
        remedy = "leave it out: it is found for each camera where it is significant"
        raise CatalogError(
            f"the photographs have {len(found.focals)} cameras, an antenna's place is in the frame of one",
            where="--lever-arm", remedy=remedy,
        )  # fmt: skip
    photos = {f.name: f.metadata for f in found.files if f.has_place}
    placing = placing if survey is None else placing_before(placing, survey, list(photos.values()))
    gnss = known_positions(placing, photos, control)
    in_sequence = sequence is not None
    record, store = _mapped(found, in_sequence, work, parameters, scheduler, workers, console)
    models = decode_models(store.read_bytes(next(iter(record.outputs))))
    if not models:
        remedy = "check that the photographs overlap, or compare more pairs with --set pairs.partners=30"
        raise RunError("no photographs could be oriented: they show nothing in common", where=str(given), remedy=remedy)
    model, names = models[0], [str(n) for n in record.result["photographs"]]
    images = tuple(replace(i, name=names[k]) for i, k in zip(model.images, model.numbers, strict=True))
    files = {f.name: f for f in found.files}
    kept = _sound(model)
    marked = _of_these(control, found, folder)
    put = place(images, model.xyz[kept], gnss, placing, marked)
    taken = {f.name: f.metadata.taken for f in found.files}
    known = Known(gnss, marked[0] if marked is not None else None, placing.arm, taken)
    cameras = {f.name: f.camera for f in found.files}
    put, adjustment = adjusted_model(put, cameras, known, record, store, scheduler, workers)
    if survey is not None:
        search = parameters.registration.search(usual_search(placing))
        by = registered_to(survey, put.xyz, search, store, scheduler, workers)
        put, adjustment = moved_onto(put, by, survey), moved_adjustment(adjustment, by)
    origin = np.floor(np.median([i.centre for i in put.images], axis=0))
    source = _write_model(work / MODEL, put, {n: f.relative for n, f in files.items()}, origin)
    left_out = _left_out(found, record.result, models, names)
    report = _report(found, models, put, record.result, left_out)
    if adjustment is not None:
        add_adjustment(report, adjustment)
    with reading_files(scheduler, workers, console, kept_beside=out) as reading:
        made = create_catalog(
            out,
            replace(files_of(survey), images=replace(source, folder=folder)),
            crs=put.crs,
            reading=reading,
            orientation=orientation_figures(report),
            text=placing.text,
        )
    catalog, ties = made.catalog, TiePoints(put.xyz, model.lengths[kept].astype(np.float64), model.errors_px[kept])
    if adjustment is not None and adjustment.is_taken:
        ties = tie_points(adjustment.points)
        catalog = store_catalog(replace(catalog, images=with_covariances(catalog.images, adjustment)), out, copy=False)
    if sequence is not None:
        catalog = add_track(report, catalog, sequence, {f.relative: f.name for f in found.files}, out)
    else:
        (out / TRACK).unlink(missing_ok=True)
    places = {p.name: p.xyz for p in control[0].points} if control is not None else {}
    write_orientation_report(out, Oriented(report, catalog, ties, places=places))
    for note in [*made.notes, *map(str, record.result.get("failures", []))]:
        say(console, f"Note: {note}")
    for line in [
        *photograph_lines(report),
        *track_lines(report),
        *put.lines,
        *(adjustment_lines(adjustment) if adjustment is not None else ()),
    ]:
        say(console, line)
    say_next(out, PHOTOS_CITY if survey is None else LIDAR_PHOTOS_CITY, console)
    return catalog


def _mapped(
    found: PhotoFolder,
    in_sequence: bool,
    work: Path,
    parameters: PhotoParameters,
    scheduler: str,
    workers: int,
    console: Console,
) -> tuple[Record, Store]:
    photos = tuple(
        Photo(f.name, SourceFile(str(Path(f.path).absolute()), f.size, f.checksum), f.camera, f.looks_at, f.white)
        for f in found.files
    )
    sizes = {f.camera: (f.width, f.height) for f in found.files}
    cameras = tuple(PhotoCamera(*sizes[k], focal, known) for k, (focal, known) in enumerate(found.focals))
    store = Store.open(str(work))
    store.check_writable()
    source = PhotoSource(photos, cameras, parameters, store.read_bytes, in_sequence)
    say(console, f"{len(photos)} photographs, {len(cameras)} cameras as their files tell them apart")
    with Ledger.open(store) as ledger:
        counts = {FEATURES: len(photos), PAIRS: 1, MATCHES: len(photos), MAP: 1}
        run_stages(source, counts, store, ledger, scheduler, workers)
        for stage in (MAP, PAIRS):
            record = ledger.latest(stage, BLOCK)
            if record is not None and record.status is Status.FAILED:
                raise RunError(
                    f"the photographs could not be mapped: {record.reason}",
                    where=str(work),
                    remedy="see docs/orient.md",
                )
        if record is None or (last := ledger.latest(MAP, BLOCK)) is None:
            raise RunError("no photographs can be used", where=str(work), remedy="check the files")
        failed = [
            (u, r.reason)
            for u in ledger.units(FEATURES)
            if (r := ledger.latest(FEATURES, u)) and r.status is Status.FAILED
        ]
    for unit, reason in failed:
        if unit in {p.name for p in photos}:
            say(console, f"Left out: {unit}: {reason}")
    return last, store


def _of_these(
    control: tuple[ControlPoints, Reference] | None, found: PhotoFolder, folder: Path
) -> tuple[ControlPoints, Reference] | None:
    """Control points whose marks name images as the tasks do."""
    if control is None:
        return None
    there, name_of = ImageFiles.of(folder), {f.path: f.name for f in found.files}
    points, reference = control
    renamed = []
    for point in points.points:
        marks = [replace(m, image=name_of.get(str(there.of_name(m.image)), m.image)) for m in point.marks]
        renamed.append(replace(point, marks=tuple(sorted(marks, key=lambda m: m.image))))
    return replace(points, points=tuple(renamed)), reference


def _sound(model: MappedModel) -> Any:
    """(P,) which tie points three images show, and where they show them."""
    return (model.lengths >= 3) & (model.errors_px < 2.0)


def _write_model(folder: Path, put: Placed, relative: dict[str, str], origin: Any) -> ImageSource:
    images = [replace(i, name=relative[i.name]) for i in put.images]
    at = (float(origin[0]), float(origin[1]), 0.0)
    write_colmap(folder, images, put.xyz, at)
    return ImageSource(folder, {"colmap": folder}, origin=at)


def _left_out(found: PhotoFolder, result: Any, models: Sequence[MappedModel], names: Sequence[str]) -> dict[str, str]:
    """Photographs that are not oriented → why."""
    why = {each.name: each.problem for each in found.left_out}
    doubles = {name: f"the same picture as {of}" for name, of in result["doubles"]}
    oriented = {k for m in models for k in m.numbers}
    for k, name in enumerate(names):
        if k in oriented:
            continue
        points, pairs = result["points"][k], result["pairs_of"][k]
        why[name] = doubles.get(name) or (
            f"{points} points found: blurred, dark or without texture" if points < 100
            else "shows nothing that another photograph shows" if not pairs
            else f"too little ties it to the others ({pairs} pairs)"
        )  # fmt: skip
    why |= {f.name: "its points could not be found" for f in found.files if f.name not in names}
    for number, model in enumerate(models[1:], 2):
        for k in model.numbers:
            if k not in models[0].numbers:
                why[names[k]] = f"belongs to model {number}, which shows nothing that the largest one shows"
    return why


def _report(
    found: PhotoFolder, models: Sequence[MappedModel], put: Placed, result: Any, left_out: dict[str, str]
) -> dict[str, Any]:
    model = models[0]
    camera_of = {f.name: f.camera for f in found.files}
    cameras = {camera_of[i.name]: i.camera for i in put.images}
    return {
        "oriented": len(put.images), "photographs": len(found.files) + len(found.left_out), "left_out": left_out,
        "models": [len(m.images) for m in models], "method": result["method"], "verified_pairs": result["verified_pairs"],
        "tie_points": len(model.xyz), "mean_track_length": rounded(float(model.lengths.mean()), 2),
        "observations": int(model.lengths.sum()), "track_lengths": np.bincount(model.lengths).tolist(),
        "images": {i.name: {"observations": int(n)} for i, n in zip(put.images, model.observations, strict=True)},
        "reprojection_px": rounded(model.reprojection_px, 4),
        "weak": [i.name for i, n in zip(put.images, model.observations, strict=True) if n < FEW_POINTS],
        "cameras": [
            {
                "number": k, "images": sum(camera_of[i.name] == k for i in put.images), "focal_px": rounded(c.fx, 3), "principal_px": [c.cx, c.cy],
                "distortion": list(c.distortion), "stated_focal_px": rounded(found.focals[k][0], 3) if found.focals[k][1] else None,
                "focal_sigma_px": rounded(sigma, 3) if (sigma := model.focal_sigmas.get(k)) is not None else None,
            }
            for k, c in sorted(cameras.items())
        ],
        "placing": dict(put.figures),
    }  # fmt: skip
