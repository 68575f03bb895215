"""The folder RUN/view: a page that shows the run in a browser, with the small files that it reads. Works on unfinished runs too."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
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
from cityflow.reporting.view_frame import PageFrame
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.stages import export
from cityflow.survey.survey import Survey
from cityflow.viewer.report import verdict
from cityflow.viewer.report_rows import ReportData, UnitRow
from cityflow.viewer.unit_figures import verdicts_of
from cityflow.viewer.unit_page import FOLDER as REPORT_PAGES
from cityflow.viewer.view_page import DATA, FOLDER, page_files, page_version, picture_path

Json = Any
Files = Generator[tuple[str, bytes], None, Any]
"""Paths and contents; what is said of them comes at the end."""

CITY = f"{DATA}/city.json"
MADE = f"{DATA}/made.json"
TO_RUN = "../.."
"""From the page's data to the run."""

MARGIN_M = 15.0


def write_run_view(run: Prepared, records: CurrentRecords, data: ReportData) -> str:
    """Write the page; points, surfaces and images only where they have changed. Returns where the page stands."""
    run = records.checking(run)
    survey = run.source().survey
    view = _View(run, records, data, survey)
    written = set()
    for path, content in view.files():
        run.store.write_bytes(path, content)
        written.add(path)
    _remove_others(run.store, written | view.kept)
    return run.store.url(f"{FOLDER}/index.html")


def state_of(records: CurrentRecords) -> str:
    """A digest that changes when anything has been made again, or the page itself is another one."""
    made = sorted([r.stage, r.unit, r.attempt] for stage in records.stages() for r in records.rows(stage))
    return digest_of([page_version(), made])


def _remove_others(store: Store, current: set[str]) -> None:
    """Files of tiles that are no more."""
    for path in sorted(set(store.find(FOLDER)) - current):
        store.remove(path)


@dataclass
class _View:
    """What is known while the page is written; `kept` gathers files of before that are still right."""

    run: Prepared
    records: CurrentRecords
    data: ReportData
    survey: Survey

    def __post_init__(self) -> None:
        self.kept: set[str] = set()
        self.before = self._made_before()
        self.made: dict[str, Json] = {}
        self.frame = PageFrame.over(self.run.catalog.reference, _city_bounds(self.survey))
        self.ground = _ground(self.data.units)
        self.heights = view_units.heights_of(self.data.units, self.ground)

    def files(self) -> Iterator[tuple[str, bytes]]:
        """Path and contents of every file to be written; those that the page begins with come last."""
        atlas_cells = {atlas_cell.name: atlas_cell for atlas_cell in view_images.atlas_cells(self.records)}
        atlas_cell_of: dict[str, str] = {}
        for name, atlas_cell in atlas_cells.items():
            path = f"{DATA}/images/{quoted(name)}.json"
            entry = yield from self._kept_or_made(path, atlas_cell.digest, partial(self._images, atlas_cell))
            atlas_cell_of |= dict.fromkeys(entry["units"], name)
        tiles = yield from self._tiles()
        sets = yield from self._tilesets()
        yield from self._units(atlas_cell_of)
        cuts, failed = self._cuts(), view_layers.failures(self.data.units, self.ground, self.frame)
        yield f"{DATA}/cuts.json", _text(cuts)
        yield f"{DATA}/failures.json", _text(failed)
        yield MADE, _text(self.made)
        yield CITY, _text(self._city(tiles, sets, len(cuts["rows"]), len(failed)))
        attribution = "; ".join(s.attribution for s in self.data.sources if s.attribution)
        yield from page_files(self.data.title, attribution, self.data.pictures)

    def _made_before(self) -> Mapping[str, Json]:
        try:
            found = json.loads(self.run.store.read_bytes(MADE))
        except (FileNotFoundError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}

    def _kept_or_made(self, path: str, digest: str, make: Callable[[], tuple[bytes | None, Json]]) -> Files:
        """A file of before where it is of the same inputs, else a new one; returns what is said of it."""
        digest = digest_of([digest, self.frame.frame.matrix])
        old = self.before.get(path)
        if old is not None and old["digest"] == digest and self.run.store.exists(path):
            self.kept.add(path)
            entry = old["said"]
        else:
            content, entry = make()
            if content is not None:
                yield path, content
        self.made[path] = {"digest": digest, "said": entry}
        return entry

    def _images(self, atlas_cell: view_images.AtlasCell) -> tuple[bytes, Json]:
        found = view_images.images_of_atlas_cell(self.run.store, atlas_cell)
        return _text(found), {"units": sorted(found)}

    def _tiles(self) -> Files:
        """Points and surface of every ground tile; returns what the page must know of the tiles."""
        store, found = self.run.store, dict[str, dict[str, Json]]()
        sources = view_layers.point_sources(self.survey, self.records)
        for source in sources:
            path = f"{DATA}/points/{quoted(source.tile)}.bin"
            entry = yield from self._kept_or_made(
                path, source.digest, partial(view_layers.points_of, store, source, len(sources), self.frame)
            )
            if entry["count"]:
                found.setdefault(source.tile, {}).update(points=entry, box=entry["box"])
        for source in view_layers.relief_sources(self.records):
            path = f"{DATA}/dsm/{quoted(source.tile)}.bin"
            entry = yield from self._kept_or_made(path, source.digest, partial(self._relief, source.tile))
            if entry:
                found.setdefault(source.tile, {}).update(dsm=entry)
        return [{"name": name, **known} for name, known in sorted(found.items())]

    def _tilesets(self) -> Files:
        """The roots of both sets; of a run whose last export has not come, roots of their own over the tiles that are there."""
        found: dict[str, str | None] = {}
        for name, file in (("rectified", PORTABLE), ("raw", RAW)):
            found[name] = f"{TILES3D}/{file}" if self.run.store.exists(f"{TILES3D}/{file}") else None
            exported = [p for r in self.records.of(export.NAME) for p in r.outputs if p.startswith(f"{TILES3D}/")]
            own = (
                []
                if found[name]
                else [p for p in sorted(exported) if p.endswith(f"/{file}") and self.run.store.exists(p)]
            )
            if own:
                tiles = {f"{TO_RUN}/{path}": data for path, data in self.run.store.read_many(own)}
                for path, data in city_tilesets(tiles, About(self.data.title), file).items():
                    yield path.replace(TILES3D, DATA, 1), data
                found[name] = f"{DATA}/{file}"
        return found

    def _relief(self, tile: str) -> tuple[bytes | None, Json]:
        relief = view_layers.relief_of(self.run.store, self.survey, tile, self.frame)
        return (None, {}) if relief is None else (relief.heights.tobytes(), relief.as_json())

    def _units(self, atlas_cell_of: Mapping[str, str]) -> Iterator[tuple[str, bytes]]:
        pages = frozenset(self.run.store.find(REPORT_PAGES))
        for tile, known in view_units.unit_files(self.data.units, self.records, atlas_cell_of, pages):
            yield f"{DATA}/units/{quoted(tile)}.json", _text(known)
        yield f"{DATA}/index.json", _text(view_units.index_table(self.data.units, self.frame, self.heights))

    def _cuts(self) -> Json:
        ridges = view_layers.Ridges.of(self.data.units, self.heights)
        return view_layers.cut_lines(self.run.store, self.records, ridges, self.ground + 6.0, self.frame)

    def _city(
        self, tiles: Sequence[Mapping[str, Json]], sets: Mapping[str, str | None], cuts: int, failed: int
    ) -> Json:
        units = self.data.units
        count = {str(s): sum(u.status is s for u in units) for s in Status}
        judged = verdicts_of(units)
        points = [t["points"] for t in tiles if "points" in t]
        low, high = _range(self.heights.values(), self.ground)
        return finite({
            "title": self.data.title, "verdict": verdict({**count, "units": len(units), "verdicts": judged}),
            "crs": self.data.crs, "vertical_datum": self.data.vertical_datum,
            "state": state_of(self.records), "frame": self.frame.frame.matrix, "world": self.frame.to_world.tolist(),
            "sets": dict(sets),
            "texture_pixels": view_images.page_pixels(self.records),
            "bounds": _bounds(units, self.frame, (low, high), _city_bounds(self.survey)), "heights": [low, high], "counts": count,
            "verdicts": judged,
            "scales": {name: view_units.scale_of(units, name) for name in ("nmad", "rmse")},
            "tiles": tiles, "notes": [*self._notes()],
            "layers": {"points": bool(points), "dsm": any("dsm" in t for t in tiles), "cuts": cuts > 0, "failures": failed > 0},
            "pictures": [{"path": picture_path(n), "title": p.title} for n, p in enumerate(self.data.pictures)],
            "missing": MISSING, "said": _notes_of(points, cuts, failed),
        })  # fmt: skip

    def _notes(self) -> Iterator[str]:
        """What did not become as asked, apart from buildings."""
        for problem in self.data.problems:
            if problem.status in (Status.FAILED, Status.REFUSED):
                yield f"{problem.stage} {problem.unit}: {problem.reason}".strip()
        exported = {r.unit for r in self.records.of(export.NAME)}
        waiting = {u.tile for u in self.data.units if u.tile} - exported
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
    shown, whole = (sum(p[key] for p in points) for key in ("count", "of"))
    thin = f"{shown:,} of {whole:,} points, chosen at random" if shown < whole else f"All {whole:,} points"
    return {
        "points": f"{thin}.", "dsm": "The surface as it was measured, small gaps filled, lit from the north-west.",
        "cuts": f"{cuts:,} cut lines and candidates: blue were taken, orange not. Click one to see its evidence.",
        "failures": f"{failed:,} outlines without a model of their own. Click one for the reason.",
    }  # fmt: skip


def _city_bounds(survey: Survey) -> Bounds:
    return survey.lattice.grid.bounds


def _ground(units: Sequence[UnitRow]) -> float:
    """Median floor of the buildings, metres; 0 where none is known."""
    known = [v for u in units if isinstance(v := u.attributes.get("ground_height_m"), int | float)]
    return float(np.median(known)) if known else 0.0


def _range(heights: Iterable[tuple[float, float]], ground: float) -> tuple[float, float]:
    pairs = list(heights) or [(ground, ground + 10.0)]
    return round(min(p[0] for p in pairs), 2), round(max(p[1] for p in pairs), 2)


def _bounds(units: Sequence[UnitRow], frame: PageFrame, heights: tuple[float, float], city: Bounds) -> list[float]:
    """Lower and upper corner of all buildings in the page's frame; of the whole survey where there are none."""
    rings = [u.rings[0] for u in units if u.rings]
    corners = np.concatenate(rings) if rings else np.array([city[:2], city[2:]])
    local = frame.plan(corners, heights[0])
    low, high = local.min(axis=0) - MARGIN_M, local.max(axis=0) + MARGIN_M
    low[2], high[2] = local[:, 2].min(), local[:, 2].max() + heights[1] - heights[0]
    return [round(float(v), 2) for v in (*low, *high)]


def _text(value: Json) -> bytes:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode() + b"\n"
