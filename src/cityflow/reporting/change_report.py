"""The report of an update: what became of the buildings, as GeoPackage, JSON and page."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import asdict, dataclass, replace

from cityflow.core.building import Scalar
from cityflow.evaluation.change_pairs import EpochUnit, Pair, pair_up
from cityflow.evaluation.changes import Change, ChangeParameters, Changes, Figures, Kind, changes_of
from cityflow.flow.store import Store
from cityflow.flow.task import digest_of
from cityflow.handover.epoch_rows import EpochRow
from cityflow.io.tables.outlines_gpkg import Layer, write_geopackage
from cityflow.reporting.change_pictures import change_pictures
from cityflow.reporting.epoch import epoch_rows, unlisted_tiles
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.viewer.changes_page import ChangeRow, ChangesPage, changes_page
from cityflow.viewer.picture import Picture

PICTURED = 200
"""Changes with pictures, of 50 kB each; the table has all."""
LAYER, PAGE, FIGURES = "changes.gpkg", "changes.html", "changes.json"
UPDATES = "updates"
"""Folder of a RUN, with one for each update."""


@dataclass(frozen=True, slots=True)
class FormerState:
    """The buildings before.

    Attributes
    ----------
    rows : gives them, whenever it is called: only those that may have changed are held
    unlisted : ground tiles whose buildings were not known
    """

    rows: Callable[[], Iterable[EpochRow]]
    unlisted: frozenset[str]


def write_change_report(
    run: Prepared, records: CurrentRecords, former: FormerState, page: ChangesPage, folder: str
) -> ChangesPage:
    """Compare with the former state and write all three.

    Parameters
    ----------
    page : what the page says of surveys and failures;  folder : of the RUN, for the files
    """
    parameters, survey = run.workflow.city.changes, run.source().survey
    found = compare_states(run, records, former)
    changes = found.changes
    shown = tuple(
        change_row(c, found.tiles, tuple(change_pictures(run.store, survey, c)) if k < PICTURED else ())
        for k, c in enumerate(changes.found)
    )
    page = replace(
        page, rows=shown, compared=changes.compared, untouched=found.untouched, without_model=changes.without_model, offset_m=changes.offset_m,
        scatter_m=changes.scatter_m, rules=_rules(parameters), unclear=found.unclear,
    )  # fmt: skip
    run.store.write_bytes(f"{folder}/{LAYER}", write_geopackage([_layer(changes, shown)], run.catalog.reference))
    run.store.write_bytes(f"{folder}/{FIGURES}", _json(page, parameters))
    run.store.write_bytes(f"{folder}/{PAGE}", changes_page(page))
    return page


@dataclass(frozen=True, slots=True)
class Comparison:
    """A run and an earlier or another state of it.

    Attributes
    ----------
    tiles : ground tile of every building that was compared
    untouched : how many have the same outline and model
    unclear : names of buildings that may well have stood, or stand, in a tile where nobody knows which do
    """

    changes: Changes
    tiles: Mapping[str, str]
    untouched: int
    unclear: tuple[str, ...]


def compare_states(run: Prepared, records: CurrentRecords, former: FormerState) -> Comparison:
    """What became of every building since the former state; only those that are not the same are held."""
    states, same = {row.id: _state(row) for row in former.rows()}, set[str]()

    def is_other(row: EpochRow) -> bool:
        if states.get(row.id) == _state(row):
            same.add(row.id)
        return row.id not in same

    after = [row for _, rows in epoch_rows(run, records, is_other) for row in rows]
    before = [row for row in former.rows() if row.id not in same]
    tiles = {row.id: row.tile for row in (*before, *after)}
    every, lost = pair_up([_unit(row) for row in before], [_unit(row) for row in after]), unlisted_tiles(run, records)
    is_unclear = [_is_unclear(p, tiles, (former.unlisted, lost)) for p in every]
    changes = changes_of([p for p, skip in zip(every, is_unclear, strict=True) if not skip], run.workflow.city.changes)
    unclear = tuple(sorted(_name(p) for p, skip in zip(every, is_unclear, strict=True) if skip))
    return Comparison(changes, tiles, len(same), unclear)


def told_changes(store: Store) -> list[tuple[str, str]]:
    """Each update of a RUN that has been compared, the last first: address of its page, relative to the RUN, and its changes in short."""
    numbers = sorted((int(n) for n in store.folders(UPDATES) if n.isdecimal()), reverse=True)
    folders = [f for n in numbers if store.exists(f"{(f := f'{UPDATES}/{n}')}/{FIGURES}")]
    return [(f"{f}/{PAGE}", str(json.loads(store.read_bytes(f"{f}/{FIGURES}"))["in_short"])) for f in folders]


def _is_unclear(pair: Pair, tiles: Mapping[str, str], unlisted: tuple[Set[str], Set[str]]) -> bool:
    """Whether a building may well have stood, or stand, without anybody knowing: it is neither new nor gone."""
    (before, after), (former, now) = pair, unlisted
    return (after is None and tiles[_name(pair)] in now) or (before is None and tiles[_name(pair)] in former)


def _name(pair: Pair) -> str:
    unit = pair[1] or pair[0]
    assert unit is not None
    return unit.id


def _state(row: EpochRow) -> str:
    """Digest of outline and model, as little memory as will do."""
    return digest_of([row.digest, row.outline])


def _unit(row: EpochRow) -> EpochUnit:
    return EpochUnit(row.id, row.footprint, row.building, row.outline_sigma_m)


def change_row(change: Change, tiles: Mapping[str, str], pictures: tuple[Picture, ...] = ()) -> ChangeRow:
    """One line of the table, figures to the millimetre."""
    figures = {key: None if value is None else round(value, 3) for key, value in asdict(change.figures).items()}
    after, before = (u.id if u is not None else "" for u in (change.after, change.before))
    return ChangeRow(
        change.kind.value, after, before, tiles[change.id], in_words(change.kind, change.figures), figures, pictures
    )  # fmt: skip


def in_words(kind: Kind, f: Figures) -> str:
    """What has changed, most telling first.

    >>> in_words(Kind.ALTERED, Figures(3.0, 2.9, 300.0, 0.0, 3.0, 3.0, 95.4, 0.0, 40.0))
    'roof +3.0 m in the mean, altered over 95 m²'
    """
    if kind is not Kind.ALTERED:
        return f"{abs(f.area_m2):,.0f} m²" + ("" if f.volume_m3 is None else f", {abs(f.volume_m3):,.0f} m³")
    found = []
    if f.roof_changed_m2 and f.roof_mean_m is not None:
        found.append(f"roof {f.roof_mean_m:+.1f} m in the mean, altered over {f.roof_changed_m2:,.0f} m²")
    if f.outline_changed_m2:
        found.append(f"outline altered by {f.outline_changed_m2:,.0f} m²")
    return "; ".join(found)


def _rules(p: ChangeParameters) -> str:
    return (
        f"A building is altered where {p.least_area_m2:g} m² or more of its roof differ by at least {p.least_height_m:g} m and {p.sigmas:g} standard "
        f"deviations of both models, or as much of its outline by {p.sigmas:g} of both outlines."
    )


def _layer(changes: Changes, rows: Iterable[ChangeRow]) -> Layer:
    """Footprints as they are now, of what is gone as they were."""
    shapes = [(c.after or c.before).footprint for c in changes.found]  # type: ignore[union-attr]
    columns: list[dict[str, Scalar]] = [
        {"kind": r.kind, "id": r.id, "before": r.before, "tile": r.tile, "what": r.what, **r.figures} for r in rows
    ]
    return Layer("changes", shapes, columns)


def _json(page: ChangesPage, parameters: ChangeParameters) -> bytes:
    tree = {
        "in_short": page.in_short, "former": page.former, "catalog": page.catalog, "parameters": parameters.model_dump(mode="json"),
        "compared": page.compared, "untouched": page.untouched, "without_model": list(page.without_model),
        "failed": list(page.failed), "unclear": list(page.unclear),
        "offset_m": page.offset_m, "scatter_m": page.scatter_m,
        "changes": [
            {"kind": r.kind, "id": r.id, "before": r.before, "tile": r.tile, "what": r.what, **r.figures} for r in page.rows
        ],
    }  # fmt: skip
    return (json.dumps(tree, indent=1, ensure_ascii=False) + "\n").encode()
