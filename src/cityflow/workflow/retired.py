"""Removes products of earlier requests (other formats, other tiles) at the end of a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record, digest_of
from cityflow.pipeline.city_part import CityPart
from cityflow.stages import atlas, export, ortho, surface
from cityflow.survey.districts import CITY
from cityflow.survey.survey import Survey
from cityflow.survey.texture_inputs import atlas_cells_of

PRODUCTS = "products"


def standing(record: Record, ledger: Ledger) -> Record:
    """The record, or where an export failed, with what an earlier one left: products go when there are new ones."""
    if record.stage != export.NAME or record.status is not Status.FAILED:
        return record
    good = ledger.last_good(record.stage, record.unit)
    return record if good is None else replace(record, outputs=good.outputs)


def remove_stale_products(store: Store, ledger: Ledger, survey: Survey) -> int:
    """Remove what lies among the products and is none of this run's; returns how many files that were.

    Tiles beyond the area of interest keep theirs as long as they were made as they would be now. A run that did not come
    to its last export has replaced nothing, so all stays.
    """
    if (export.NAME, CITY) not in survey.results:
        return 0
    kept = {path for _, left in survey.results for path in left.paths}
    kept |= {path for record in _before_they_failed(ledger, survey) for path in record.outputs}
    kept |= {path for record in _beyond_the_area(ledger, survey) for path in record.outputs}
    stale = [path for path in store.find(PRODUCTS) if path not in kept]
    folders = {_folder(path) for path in kept}
    for path in sorted({path if _folder(path) in folders else _folder(path) for path in stale}):
        store.remove(path)
    return len(stale)


def remove_replaced_products(store: Store, ledger: Ledger, part: CityPart, ran: Iterable[Record]) -> None:
    """Remove the products of what ran that its new records do not name, and those of atlas cells that have no building any more."""
    gone: set[str] = set()
    for record in ran:
        if record.status is not Status.FAILED:
            former = [r for r in ledger.attempts(record.stage, record.unit) if r.attempt < record.attempt and r.outputs]
            gone |= {p for r in former[-1:] for p in r.outputs} - record.outputs.keys()
    edge = part.city.survey.parameters.atlas.atlas_cells(part.city.survey.lattice.tile_m)
    for tile in part.renamed:
        now = atlas_cells_of(part.city, tile) if tile in part.city.chosen else {}
        names = (f"{tile}.{col}_{row}" for row in range(edge) for col in range(edge))
        left = (ledger.latest(atlas.NAME, name) for name in names if name not in now)
        gone |= {p for r in left if r is not None for p in r.outputs}
    for path in sorted(path for path in gone if path.startswith(f"{PRODUCTS}/") and store.exists(path)):
        store.remove(path)


def _folder(path: str) -> str:
    """``products/obj``: a folder of which nothing is kept goes as a whole."""
    return "/".join(path.split("/")[:2])


def _before_they_failed(ledger: Ledger, survey: Survey) -> Iterator[Record]:
    """What stands of tasks that failed this time."""
    for (stage, unit), left in survey.results:
        if left.status is Status.FAILED and (good := ledger.last_good(stage, unit)) is not None:
            yield good


def _beyond_the_area(ledger: Ledger, survey: Survey) -> Iterator[Record]:
    for name in survey.lattice.tiles:
        if (surface.NAME, name) in survey.results and (export.NAME, name) in survey.results:
            continue
        heights, city = ledger.latest(surface.NAME, name), ledger.latest(export.NAME, name)
        if heights is None or not surface.is_made_alike(survey, heights):
            continue
        yield heights
        picture = ledger.latest(ortho.NAME, name)
        if picture is not None and picture.inputs.get(f"surface {name}") == heights.result.get("digest"):
            yield picture
        if city is not None and export.is_made_alike(survey, city, heights):
            yield city
            yield from _its_leaves(ledger, city)


def _its_leaves(ledger: Ledger, city: Record) -> Iterator[Record]:
    """The pages that an export shows."""
    for name, digest in city.inputs.items():
        stage, _, atlas_cell = name.partition(" ")
        pages = ledger.latest(atlas.NAME, atlas_cell) if stage == atlas.NAME else None
        if pages is not None and digest_of(dict(pages.outputs)) == digest:
            yield pages
