"""The folder RUN/view: a page that shows the run in a browser, with the small files that it reads. Works on unfinished runs too."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from typing import Any

import numpy as np

from cityflow.core.building import Status
from cityflow.core.grid import Bounds
from cityflow.core.json_values import finite
from cityflow.flow.records import quoted
from cityflow.flow.store import Store
from cityflow.flow.task import digest_of
from cityflow.io.city_models.tiles3d import FOLDER as TILES3D
from cityflow.io.city_models.tiles3d import PORTABLE, RAW, About
from cityflow.io.city_models.tiles3d_tree import city_tilesets
from cityflow.reporting import view_images, view_layers, view_units
from cityflow.reporting.tile_rows import NO_TILE, TileRows
from cityflow.reporting.view_frame import PageFrame
from cityflow.reporting.view_kept import Files, Kept, json_bytes
from cityflow.reporting.view_tiles import ViewTiles, totals, whole_box
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import export
from cityflow.survey.survey import Survey
from cityflow.viewer.report import verdict
from cityflow.viewer.report_rows import ReportData
from cityflow.viewer.run_figures import figures_of
from cityflow.viewer.unit_figures import verdicts_of
from cityflow.viewer.unit_page import FOLDER as REPORT_PAGES
from cityflow.viewer.view_page import DATA, FOLDER, page_files, page_version, picture_path

Json = Any

CITY = f"{DATA}/city.json"
MADE = f"{DATA}/made.json"
TO_RUN = "../.."
"""From the page's data to the run."""

MARGIN_M, STOREYS_M = 15.0, 10.0


def write_run_view(run: Prepared, records: CurrentRecords, data: ReportData) -> str:
    """Write the page; points, surfaces and images only where they have changed. Returns where the page stands."""
    run = records.checking(run)
    survey = run.source().survey
    view = _View(run, records, data, survey)
    written = set()
    for path, content in view.files():
        run.store.write_bytes(path, content)
        written.add(path)
    _remove_others(run.store, written | view.kept.paths)
    return run.store.url(f"{FOLDER}/index.html")


def state_of(records: CurrentRecords) -> str:
    """A digest that changes when anything has been made again, or the page itself is another one."""
    made = sha256()
    for stage in sorted(records.stages()):
        made.update("\n".join(sorted(f"{stage} {r.unit} {r.attempt}" for r in records.rows(stage))).encode())
    return digest_of([page_version(), made.hexdigest()])


def _remove_others(store: Store, current: set[str]) -> None:
    """Files of tiles that are no more."""
    for path in sorted(set(store.find(FOLDER)) - current):
        store.remove(path)


@dataclass
class _View:
    """What is known while the page is written; `kept` are files of before that are still right."""

    run: Prepared
    records: CurrentRecords
    data: ReportData
    survey: Survey

    def __post_init__(self) -> None:
        self.frame = PageFrame.over(self.run.catalog.reference, _city_bounds(self.survey))
        self.kept = Kept(self.run.store, MADE, self.frame.frame.matrix)

    def files(self) -> Iterator[tuple[str, bytes]]:
        """Path and contents of every file to be written; those that the page begins with come last."""
        atlas_cell_of: dict[str, str] = {}
        for atlas_cell in view_images.atlas_cells(self.records):
            path = f"{DATA}/images/{quoted(atlas_cell.name)}.json"
            entry = yield from self.kept.or_made([path], atlas_cell.digest, partial(self._images, atlas_cell))
            atlas_cell_of |= dict.fromkeys(entry["units"], atlas_cell.name)
        tiles = yield from self._tiles()
        sets = yield from self._tilesets()
        rows = self._rows()
        pages = frozenset(self.run.store.find(REPORT_PAGES))
        surface = partial(view_layers.surface_over, self.run.store, self.survey)
        found = ViewTiles(self.run.store, self.records, rows, self.frame, atlas_cell_of, pages, surface)
        entries = yield from found.files(self.kept)
        yield MADE, json_bytes(self.kept.note())
        yield CITY, json_bytes(self._city(tiles, sets, entries, rows.ids.keys() - {NO_TILE}))
        attribution = "; ".join(s.attribution for s in self.data.sources if s.attribution)
        yield from page_files(self.data.title, attribution, self.data.pictures)

    def _rows(self) -> TileRows:
        """Of a large city the report has rows of a few buildings only; the page shows all."""
        if self.data.whole is None:
            return TileRows.of(self.data.units)
        return TileRows.stored(self.run, self.records, self.survey)

    def _images(self, atlas_cell: view_images.AtlasCell) -> tuple[list[bytes | None], Json]:
        found = view_images.images_of_atlas_cell(self.run.store, atlas_cell)
        return [json_bytes(found)], {"units": sorted(found)}

    def _tiles(self) -> Files:
        """Points and surface of every ground tile; returns what the page must know of the tiles."""
        found = dict[str, dict[str, Json]]()
        sources = view_layers.point_sources(self.survey, self.records)
        for source in sources:
            path = f"{DATA}/points/{quoted(source.tile)}.bin"
            entry = yield from self.kept.or_made([path], source.digest, partial(self._points, source, len(sources)))
            if entry["count"]:
                found.setdefault(source.tile, {}).update(points=entry, box=entry["box"])
        reliefs = view_layers.relief_sources(self.records)
        most = view_layers.most_relief_cells(len(reliefs))
        for source in reliefs:
            path = f"{DATA}/dsm/{quoted(source.tile)}.bin"
            entry = yield from self.kept.or_made([path], source.digest, partial(self._relief, source.tile, most))
            if entry:
                found.setdefault(source.tile, {}).update(dsm=entry)
        return [{"name": name, **known} for name, known in sorted(found.items())]

    def _tilesets(self) -> Files:
        """The roots of both sets; of a run whose last export has not come, roots of their own over the tiles that are there."""
        found: dict[str, str | None] = {}
        for name, file in (("rectified", PORTABLE), ("raw", RAW)):
            found[name] = f"{TILES3D}/{file}" if self.run.store.exists(f"{TILES3D}/{file}") else None
            exported = () if found[name] else (p for r in self.records.of(export.NAME) for p in r.outputs)
            here = (p for p in exported if p.startswith(f"{TILES3D}/") and p.endswith(f"/{file}"))
            own = sorted(p for p in here if self.run.store.exists(p))
            if own:
                tiles = {f"{TO_RUN}/{path}": data for path, data in self.run.store.read_many(own)}
                for path, data in city_tilesets(tiles, About(self.data.title), file).items():
                    yield path.replace(TILES3D, DATA, 1), data
                found[name] = f"{DATA}/{file}"
        return found

    def _points(self, source: view_layers.TileSource, tiles: int) -> tuple[list[bytes | None], Json]:
        data, entry = view_layers.points_of(self.run.store, source, tiles, self.frame)
        return [data], entry

    def _relief(self, tile: str, most: int) -> tuple[list[bytes | None], Json]:
        relief = view_layers.relief_of(self.run.store, self.survey, tile, most, self.frame)
        return ([None], {}) if relief is None else ([relief.heights.tobytes()], relief.as_json())

    def _city(
        self,
        tiles: Sequence[Mapping[str, Json]],
        sets: Mapping[str, str | None],
        entries: Mapping[str, Json],
        owners: Set[str],
    ) -> Json:
        """What the page begins with; `entries` of tiles and their buildings, `owners` are tiles that own some."""
        status, judged = totals(entries, "status"), dict(totals(entries, "verdicts"))
        count = {str(s): status[s] for s in Status}
        cuts, failed = (sum(one[key] for one in entries.values()) for key in ("cuts", "failures"))
        points = [t["points"] for t in tiles if "points" in t]
        values = figures_of(self.data).values
        return finite({
            "title": self.data.title,
            "verdict": verdict({**count, "units": status.total(), "verdicts": {**verdicts_of(()), **judged}}),
            "crs": self.data.crs, "vertical_datum": self.data.vertical_datum,
            "state": state_of(self.records), "frame": self.frame.frame.matrix, "world": self.frame.to_world.tolist(),
            "sets": dict(sets),
            "texture_pixels": view_images.page_pixels(self.records),
            "bounds": whole_box(entries, self._survey_box, MARGIN_M), "heights": _range(entries), "counts": count,
            "verdicts": {**verdicts_of(()), **judged},
            "scales": {name: view_units.scale_of(values[name]) for name in ("nmad", "rmse")},
            "tiles": tiles, "notes": [*self._notes(owners)],
            "layers": {"points": bool(points), "dsm": any("dsm" in t for t in tiles), "cuts": cuts > 0, "failures": failed > 0},
            "pictures": [{"path": picture_path(n), "title": p.title} for n, p in enumerate(self.data.pictures)],
            "missing": MISSING, "layer_notes": _notes_of(points, cuts, failed),
        })  # fmt: skip

    def _survey_box(self) -> list[float]:
        """The whole survey, up to the height of a few storeys."""
        x_min, y_min, x_max, y_max = _city_bounds(self.survey)
        local = self.frame.plan(np.array([(x_min, y_min), (x_max, y_max)]), 0.0)
        return [*local.min(axis=0), *local[:, :2].max(axis=0), local[:, 2].max() + STOREYS_M]

    def _notes(self, owners: Set[str]) -> Iterator[str]:
        """What did not become as asked, apart from buildings; `owners`: tiles with buildings."""
        of_buildings = self.data.unit_stage
        for problem in (p for p in self.data.problems if p.stage != of_buildings):
            if problem.status in (Status.FAILED, Status.REFUSED):
                yield f"{problem.stage} {problem.unit}: {problem.reason}".strip()
        exported = frozenset(self.records.units(export.NAME))
        waiting = owners - exported
        if waiting:
            tiles = (
                "1 ground tile with buildings is"
                if len(waiting) == 1
                else f"{len(waiting):,} ground tiles with buildings are"
            )
            yield f"{tiles} not exported yet"


MISSING = {
    "points": "The run has no points yet", "dsm": "The run has no surface yet",
    "cuts": "No outline was cut: outlines that are given are units already, or the stage has not run yet",
    "failures": "Nothing failed",
}  # fmt: skip


def _notes_of(points: Sequence[Mapping[str, Json]], cuts: int, failed: int) -> dict[str, str]:
    """What stands at the foot of the page when a layer is switched on."""
    shown, whole, noise = (sum(p[key] for p in points) for key in ("count", "of", "noise"))
    left_out = f" {noise:,} that are noise are left out." if noise else ""
    thin = f"{shown:,} of {whole:,} points, chosen at random" if shown < whole else f"All {whole:,} points"
    return {
        "points": f"{thin}.{left_out}", "dsm": "The surface as it was measured, small gaps filled, lit from the north-west.",
        "cuts": f"{cuts:,} cut lines and candidates: blue were taken, orange not. Click one to see its evidence.",
        "failures": f"{failed:,} outlines without a model of their own. Click one for the reason.",
    }  # fmt: skip


def _city_bounds(survey: Survey) -> Bounds:
    return survey.lattice.bounds


def _range(entries: Mapping[str, Json]) -> list[float]:
    """Lowest floor and highest ridge, world metres."""
    pairs = [one["heights"] for one in entries.values() if one["heights"]] or [[0.0, STOREYS_M]]
    return [round(min(p[0] for p in pairs), 2), round(max(p[1] for p in pairs), 2)]
