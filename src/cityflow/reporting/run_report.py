"""The report of a RUN: its records as rows, written as page and as JSON. Works on unfinished runs too."""

from __future__ import annotations

import gc
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import fsum
from typing import Any

import numpy as np
from rich.console import Console

from cityflow.core.building import Status
from cityflow.core.orientation_figures import OrientationFigures
from cityflow.core.parameters import merged
from cityflow.errors import CityflowError, WorkflowError
from cityflow.flow.ledger import Ledger
from cityflow.flow.tally import Tally
from cityflow.io.crs import vertical_datum
from cityflow.io.globe import globe_of
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.reporting.adjustment_words import figures_file
from cityflow.reporting.change_report import told_changes
from cityflow.reporting.checkpoint_rows import checkpoint_rows
from cityflow.reporting.image_figures import image_figures
from cityflow.reporting.listed_city import listed_city, problems_of
from cityflow.reporting.orientation_doubts import orientation_figures
from cityflow.reporting.pictures import RunPictures, run_pictures
from cityflow.reporting.poses_words import row_of_poses
from cityflow.reporting.raster_pictures import tiles_made
from cityflow.reporting.summed_city import SummedCity
from cityflow.reporting.texture_figures import texture_figures
from cityflow.reporting.unit_crops import THUMB_PX, Crops, thumbnail
from cityflow.reporting.unit_pages import chosen_units, write_pages
from cityflow.reporting.unit_rows import whole_city
from cityflow.reporting.unused_edits import unused_edits
from cityflow.reporting.view import write_run_view
from cityflow.runs.asked import read_asked
from cityflow.runs.current import CurrentRecords, known_records
from cityflow.runs.differences import changed
from cityflow.runs.overrides import read_overrides
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import DESCRIPTION, open_run, workflow_tree
from cityflow.runs.settings import checked, parse_setting
from cityflow.stages import ingest, reconstruct, surface
from cityflow.survey.survey import Survey
from cityflow.viewer.report import listed_units, write_report
from cityflow.viewer.report_rows import Product, ReportData, Source, StageRow
from cityflow.viewer.review_list import review_list
from cityflow.viewer.view_page import FOLDER as VIEW

PRODUCTS = {
    "products/city.city.jsonl": ("CityJSON", "The whole city, CityJSONSeq 2.0"),
    "products/cityjson": ("CityJSON by tile", "CityJSONSeq 2.0, one file per ground tile"),
    "products/citygml": ("CityGML by tile", "CityGML 2.0 with terrain"),
    "products/obj": ("OBJ by tile", "Meshes with textures and materials by surface type"),
    "products/obj_raw": (
        "OBJ by tile, raw",
        "The same with textures that are not resampled, for renderers that divide",
    ),
    "products/glb": ("GLB by tile", "A node per building, for Blender and game engines"),
    "products/outlines.gpkg": ("GeoPackage", "Outlines, units with all attributes, map of status"),
    "products/dsm.vrt": ("DSM", "Surface heights, GeoTIFF tiles under one VRT"),
    "products/dtm.vrt": ("DTM", "Terrain heights, GeoTIFF tiles under one VRT"),
    "products/ortho.vrt": (
        "True ortho",
        "Colours of the steepest views, GeoTIFF tiles under one VRT; the last band says where it has a colour",
    ),
    "products/tiles3d": ("3D Tiles", "The city for map viewers on the globe, with its textures where it has some"),
    "products/textures": (
        "Texture pages",
        "Photographs on the faces, shared by all formats; beside each page, which photograph a pixel is of",
    ),
    "products/points": (
        "Points",
        "LAZ with LAS classes, colour, reference image and precision, one file per ground tile",
    ),
    "products/catalog.json": ("STAC", "The products as a catalog"),
    "oriented/collection.json": ("Catalog with refined poses", "The given catalog with the poses that this run uses"),
    "surface.zarr": ("Zarr", "All surface layers, one chunk per ground tile; docs/formats.md says how xarray opens it"),
}


def write_run_report(
    run: Prepared, records: CurrentRecords, named: str = "", shown: Callable[[], object] | None = None
) -> str:
    """Write report.json, report.html, the pages of single buildings and the view in the browser; returns where the report's page stands.

    Parameters
    ----------
    named : how commands shall name the run; empty: by its full path
    shown : is called as soon as the view shows the city, which is written first then; None: the view comes last
    """
    if shown is not None:
        write_run_view(run, records, report_data(records.checking(run), records, pictured=False))
        shown()
    data = write_report_files(run, records, named)
    write_run_view(run, records, data)
    return run.store.url("report.html")


def write_report_files(run: Prepared, records: CurrentRecords, named: str = "") -> ReportData:
    """The report without the view in the browser, which it links to."""
    run = records.checking(run)
    with uncollected():
        return _write_files(run, records, named or run.store.root)


@contextmanager
def uncollected() -> Iterator[None]:
    """Half a million small values live until the report is written; to look through them for cycles again and again takes a tenth of the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _write_files(run: Prepared, records: CurrentRecords, named: str) -> ReportData:
    parameters = run.workflow.city.report
    survey = run.source().survey
    for record in records.of(ingest.NAME):
        survey.learn(record)
    data = replace(report_data(run, records), run=named, view=f"{VIEW}/index.html")
    chosen = chosen_units(data.units, parameters)
    addresses = chosen.addresses
    if data.whole is not None:
        ended = (n for status, n in data.whole.status.items() if status != Status.DONE)
        chosen = replace(chosen, left_out=max(sum(ended) - sum(u.status is not Status.DONE for u in chosen.units), 0))
    crops = Crops(run.store, survey, tiles_made(survey, records.rows(surface.NAME)))
    small = {
        u.id: p
        for u in listed_units(data.units, parameters.listed)
        if (p := thumbnail(replace(crops, most_px=THUMB_PX), u)) is not None
    }
    newest = {r.unit: r for r in records.some(reconstruct.NAME, addresses)}
    looks = {s.unit.id: s.reason for s in review_list(data.units)}
    write_pages(run.store, survey, chosen, newest, crops, data, looks)
    data = replace(data, crops=small, pages=addresses, pages_left_out=chosen.left_out)
    page_json, page_html = write_report(data, parameters)
    run.store.write_bytes("report.json", page_json)
    run.store.write_bytes("report.html", page_html)
    return data


def print_report(url: str, settings: Sequence[str], console: Console) -> None:
    """Write the report of an existing RUN anew, with other settings of `report` if wanted, and say where it is.

    Raises
    ------
    WorkflowError
        A setting is none of the report's.
    """
    run = with_settings(open_run(url), settings)
    with uncollected(), Ledger.open(run.store) as ledger:
        page = write_run_report(run, known_records(run, ledger, read_asked(run.store, ledger)), url)
    console.print(page, markup=False, highlight=False, soft_wrap=True)


def with_settings(run: Prepared, settings: Sequence[str]) -> Prepared:
    """The run with `report.key=value` settings, which change what is shown and nothing else."""
    tree = workflow_tree(run.workflow)
    for setting in settings:
        over = parse_setting(setting)
        if set(over) != {"report"}:
            raise WorkflowError(
                f"'{setting}' is no setting of the report",
                where="--set",
                remedy="`cityflow parameters report` lists them; others change results: cityflow rerun, or cityflow run",
            )
        tree = merged(tree, over)
    return replace(run, workflow=checked(tree, where="--set")) if settings else run


def report_data(run: Prepared, records: CurrentRecords, *, pictured: bool = True) -> ReportData:
    """All that the report shows, from the newest record of every task; pictures of the city take most of the time."""
    reference = run.catalog.reference
    unit_stages = (reconstruct.NAME,)
    survey = run.source().survey
    large = len(records.units(reconstruct.NAME)) > run.workflow.city.report.rows
    summed = SummedCity.read(run, records)
    city = listed_city(run, records, survey, summed) if large else whole_city(run, records)
    pictures = RunPictures()
    if pictured:
        pictures = run_pictures(run.store, survey, city.shown, records, run.workflow.city.report)
    return ReportData(
        title=run.catalog.title,
        workflow=run.workflow.name,
        crs="local metric frame" if reference.is_local else f"{reference.code} ({reference.name})",
        vertical_datum=vertical_datum(reference),
        units=city.units,
        stages=tuple(stage_row(stage, records.tally(stage)) for stage in records.stages()),
        problems=(*city.problems, *(p for stage in records.stages() if stage not in unit_stages for p in problems_of(records, stage))),
        products=tuple(_products(run)),
        sources=(Source(run.catalog.title, run.catalog.licence, run.catalog.attribution),),
        versions=json.loads(run.store.read_bytes(DESCRIPTION))["versions"],
        parameters={k: v for k, v in workflow_tree(run.workflow).items() if isinstance(v, Mapping)},
        overrides=_overrides(run),
        changed=_changed(run),
        waiting=city.waiting,
        whole=city.figures,
        districts=summed.rows() if large or summed.has_districts else (),
        pictures=pictures.shown,
        relief=pictures.relief,
        images=image_figures(survey, records, run.area),
        orientation=_orientation(run),
        checkpoints=checkpoint_rows(run.store),
        unused_edits=unused_edits(run, records),
        textures=texture_figures(run.store, survey, records),
        placing=_placing(run, survey),
        changes=tuple(told_changes(run.store)),
        poses=row_of_poses(run.poses),
    )  # fmt: skip


def _orientation(run: Prepared) -> OrientationFigures | None:
    """Of the poses that the run uses: what it found itself, else what their catalog says."""
    found = run.poses
    if found is None or not found.refined or found.summary is None or found.block is None:
        return run.catalog.orientation
    parameters = run.workflow.city.orient.model_dump(mode="json")
    return orientation_figures(figures_file(found.summary, found.block, found.left_out, parameters))


def _changed(run: Prepared) -> tuple[tuple[str, Any, Any], ...]:
    """Parameters of the run that are not as by default."""
    usual, tree = CityParameters().model_dump(mode="json"), run.workflow.city.model_dump(mode="json")
    return tuple((key, new, old) for key, old, new in changed(usual, tree))


def _overrides(run: Prepared) -> dict[str, dict[str, Any]]:
    """Unit → stage → what was set for the unit alone."""
    found: dict[str, dict[str, Any]] = {}
    for (stage, unit), tree in sorted(read_overrides(run.store).items()):
        found.setdefault(unit, {})[stage] = tree
    return found


def _placing(run: Prepared, survey: Survey) -> dict[str, str | float]:
    """How the city stands on the globe; nothing for a local frame, or if unknown."""
    try:
        globe = globe_of(run.catalog.reference, survey.lattice.bounds)
    except CityflowError as error:
        return {"horizontal_operation": "nowhere", "geoid": str(error)}
    return {} if globe is None else dict(globe.placing.as_metadata())


def stage_row(stage: str, tally: Tally) -> StageRow:
    """Figures of the tasks of a stage, at least one."""
    seconds, count = tally.every_seconds, tally.status
    return StageRow(
        stage, tally.records, count[Status.DONE], count[Status.DEGRADED], count[Status.FAILED], count[Status.REFUSED],
        fsum(seconds), float(np.median(seconds)), max(seconds), tally.highest_mb,
    )  # fmt: skip


def _products(run: Prepared) -> Iterator[Product]:
    for path, (title, text) in PRODUCTS.items():
        if run.store.exists(path) or run.store.find(path):
            yield Product(path, title, text)
