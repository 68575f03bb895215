"""``cityflow orient … --onto``: a block of photographs is led onto a survey whose place is known, and both stand in one catalog."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from cityflow.adjustment.coarse_registration import OF_A_BLOCK, Search
from cityflow.catalog.create import LIDAR_SUFFIXES, SurveyFiles, create_catalog
from cityflow.catalog.height_ranges import heights_of_points
from cityflow.catalog.image_entries import sparse_of
from cityflow.catalog.write_folder import refuse_foreign_folder, store_catalog
from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError, RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.shared import FOLDER
from cityflow.flow.store import Store
from cityflow.handover.refined_block import RefinedPose, decode_points
from cityflow.handover.registration_file import RegistrationResult, covariance_matrix, decode_registration, upper_of
from cityflow.io.catalog.stac import OUTLINES, Catalog, is_catalog, read_catalog, sha256_of
from cityflow.io.catalog.stac_assets import ImageAsset, OutlineAsset, united
from cityflow.io.crs import reference_of, resolve
from cityflow.io.tables.outline_file import read_outlines
from cityflow.io.tables.vector import read_layer
from cityflow.orientation.views import View, footprint
from cityflow.reporting.orientation_doubts import orientation_figures
from cityflow.reporting.orientation_report import FIGURES, Oriented, tie_points, write_orientation_report
from cityflow.reporting.orientation_words import registration_words
from cityflow.stages.orient import ADJUST, BLOCK, POINTS_FILE
from cityflow.stages.orient.register import REGISTER, RegisterSource, encode_tie_points, register_task, survey_files
from cityflow.survey.orient_parameters import OntoParameters
from cityflow.workflow.catalog_reading import reading_files
from cityflow.workflow.held_onto import held_onto
from cityflow.workflow.orient import orient_catalog, refuse_other_work, run_stages, say

CATALOG, REFINED = "onto", "refined"
"""Folders in the work folder: what describes the files of a survey; the catalog with refined poses, before they are moved."""
RASTER_SUFFIXES, VECTOR_SUFFIXES = (
    (".tif", ".tiff", ".vrt"),
    (".gpkg", ".geojson", ".json", ".shp", ".fgb", ".gml", ".parquet"),
)


@dataclass(frozen=True, slots=True)
class Onto:
    """What the user names: files, a folder or pattern of LiDAR files, or a catalog; `crs` of files that state none."""

    named: tuple[str, ...]
    crs: str = ""
    allow_outside: bool = False


def surveyed(onto: Onto, work: Path, scheduler: str, workers: int, console: Console) -> Catalog:
    """The survey as a catalog: that which is named, or one of the named files, made in the work folder.

    Raises
    ------
    CatalogError
        A file cannot be read, states another CRS or none, or nothing in it has heights.
    """
    if len(onto.named) == 1 and is_catalog(onto.named[0]):
        survey = read_catalog(onto.named[0], allow_outside=onto.allow_outside)
    else:
        rasters = [n for n in onto.named if Path(n).suffix.lower() in RASTER_SUFFIXES]
        vectors = [n for n in onto.named if Path(n).suffix.lower() in VECTOR_SUFFIXES]
        lidar = [n for n in onto.named if n not in (*rasters, *vectors)]
        odd = [n for n in lidar if (end := Path(n).suffix.lower()) and end not in LIDAR_SUFFIXES and Path(n).is_file()]
        if odd or len(rasters) + len(vectors) + bool(lidar) > 1:
            problem = (
                f"{len(odd)} files are neither LAS, LAZ, a raster nor outlines" if odd else "it is more than one survey"
            )
            remedy = "name LiDAR files or a folder of them, one DSM as GeoTIFF, one file of outlines, or a catalog with any of them"
            raise CatalogError(problem, where=", ".join(odd or onto.named), remedy=remedy)
        if vectors:
            return _of_outlines(vectors[0], onto.crs)
        # a folder of records holds nothing else, whatever becomes of this command
        (work / "records").mkdir(parents=True, exist_ok=True)
        place = work / CATALOG
        with reading_files(scheduler, workers, console, kept_beside=place) as reading:
            files = SurveyFiles(lidar=lidar, dsm=rasters[0] if rasters else None)
            survey = create_catalog(place, files, crs=onto.crs or None, reading=reading).catalog
    if not survey_files(survey):
        remedy = "name LiDAR files, a DSM, outlines, or a catalog that has any of them"
        raise CatalogError(
            "there are neither LiDAR files nor a DSM nor outlines", where=", ".join(onto.named), remedy=remedy
        )
    return survey


def _of_outlines(path: str, crs: str) -> Catalog:
    """A survey that has outlines alone."""
    layer = read_layer(path)
    if crs:
        reference = resolve(crs)
    elif layer.crs is not None:
        reference = reference_of(layer.crs)
    else:
        raise CatalogError("the outlines state no CRS", where=path, remedy="name it with --crs EPSG:n")
    found, _ = read_outlines(path, None, None, reference, layer.name)
    boxes = [o.polygon.bounds for o in found if not o.polygon.is_empty]
    if not boxes:
        raise CatalogError("there are no outlines", where=path, remedy="name another file")
    checksum, size = sha256_of(path)
    given = OutlineAsset(OUTLINES, path, checksum, size, united(boxes), len(found), layer=layer.name)
    return Catalog(path, "", reference, "", "", (), given)


def refuse_other_crs(reference: Reference, survey: Catalog) -> None:
    """Raises CatalogError where images and survey stand in different CRSs."""
    if (reference.is_local, reference.horizontal_epsg) != (survey.reference.is_local, survey.reference.horizontal_epsg):
        problem = f"the images stand in {reference.code}, the survey in {survey.reference.code}"
        raise CatalogError(
            problem, where=survey.href, remedy="reproject one of them, or make the catalog anew with --crs"
        )


def orient_onto(
    given: Catalog, onto: Onto, out: Path, work: Path, parameters: OntoParameters, scheduler: str, workers: int, console: Console
) -> Catalog:  # fmt: skip
    """Refine the poses of a catalog, move all of its images onto a survey, and write the catalog that has both.

    Parameters
    ----------
    out : folder of the new catalog;  work : folder of features, ties and records: what is there already is kept

    Raises
    ------
    CatalogError, RunError
        As `orient_catalog`; the survey cannot be read; or the place is not found, ambiguous or left open: nothing is written then.
    """
    refuse_foreign_folder(out)
    refuse_other_work(work)
    survey = surveyed(onto, work, scheduler, workers, console)
    refuse_other_crs(given.reference, survey)
    refined = orient_catalog(given, work / REFINED, work, parameters, scheduler, workers, console)
    store = Store.open(str(work))
    table = _points_table(store)
    xyz = table[:, :3].copy()
    by = registered_to(survey, xyz, parameters.registration.search(OF_A_BLOCK), store, scheduler, workers)
    poses: Mapping[str, RefinedPose] = {}
    held = held_onto(given, survey, store, scheduler, workers)
    if isinstance(held, str):
        by = replace(by, figures={**by.figures, "not_held": held})
    else:
        by, poses = held.registration, held.poses
    catalog, made = joined(replace(refined, href=str(out.absolute()), made_in=""), survey, by, xyz, poses)
    report = json.loads((work / REFINED / FIGURES).read_text()) | {"registration": dict(by.figures)}
    catalog = replace(catalog, orientation=orientation_figures(report))
    stored = store_catalog(catalog, out, copy=False, made=made)
    table[:, :3] = by.similarity.moved(table[:, :3])
    before = {a.name: a.oriented for a in given.images}
    write_orientation_report(out, Oriented(report, stored, tie_points(table), before))
    shutil.rmtree(work / REFINED)
    for line in registration_words(by.figures):
        say(console, line)
    return stored


def _points_table(store: Store) -> FloatArray:
    """Tie points of the adjusted block: metres, and how many images show each."""
    with Ledger.open(store) as ledger:
        record = ledger.latest(ADJUST, BLOCK)
    assert record is not None
    return decode_points(store.read_bytes(next(p for p in record.outputs if Path(p).name == POINTS_FILE)))


def registered_to(
    survey: Catalog, xyz: FloatArray, search: Search, store: Store, scheduler: str, workers: int
) -> RegistrationResult:
    """Lead tie points onto a survey; a Dask task, whose record stays.

    Parameters
    ----------
    xyz : (N, 3) tie points, metres

    Raises
    ------
    RunError
        The place is not found, ambiguous or left open.
    """
    data = encode_tie_points(xyz)
    digest = hashlib.sha256(data).hexdigest()
    path = f"{FOLDER}/{digest[:32]}.npy"
    store.write_bytes(path, data)
    with Ledger.open(store) as ledger:
        source = RegisterSource(register_task(path, digest, survey, search))
        run_stages(source, {REGISTER: 1}, store, ledger, scheduler, workers)
        record = ledger.latest(REGISTER, BLOCK)
    if record is None or record.status is Status.FAILED:
        reason = record.reason if record is not None else "nothing was done"
        raise RunError(
            f"the photographs could not be registered: {reason}", where=store.address, remedy="see docs/orient.md"
        )
    return decode_registration(json.loads(store.read_bytes(next(iter(record.outputs)))))


def joined(
    given: Catalog, survey: Catalog, by: RegistrationResult, xyz: FloatArray, poses: Mapping[str, RefinedPose]
) -> tuple[Catalog, dict[str, bytes]]:
    """Images moved onto a survey, and that, in one catalog; and contents of the files that are made for it.

    Parameters
    ----------
    given : images as they were;  xyz : (N, 3) their tie points, as they were
    poses : name → where the survey holds an image; others are moved
    """
    moved = by.similarity.moved(xyz)
    heights = heights_of_points(moved)
    images = []
    for asset in given.images:
        if asset.name in poses:
            image = poses[asset.name].image
            own = poses[asset.name].covariance
        else:
            image, own = by.similarity.moved_image(asset.oriented), asset.pose_covariance
            own = upper_of(by.covariance_of(image, covariance_matrix(own))) if own else own
        images.append(_described(replace(asset, oriented=image, pose_covariance=own), heights.over(image)))
    taken = {i.name for i in images}
    lidar = given.lidar or tuple(replace(a, name=_free(a.name, taken)) for a in survey.lidar)
    catalog = replace(
        given, reference=survey.reference, images=tuple(images), lidar=lidar, outlines=given.outlines or survey.outlines,
        rasters={**survey.rasters, **given.rasters},
    )  # fmt: skip
    sparse, made = sparse_of(moved, catalog)
    return replace(catalog, sparse=sparse), made


def _described(asset: ImageAsset, heights: tuple[float, float]) -> ImageAsset:
    seen, bounds = footprint(View(asset.oriented, heights)), asset.bounds
    if not seen.is_empty:
        x_min, y_min, x_max, y_max = (round(float(v), 3) for v in seen.bounds)
        bounds = x_min, y_min, x_max, y_max
    return replace(asset, heights=heights, bounds=bounds)


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name = f"{name}-lidar"
    return name
