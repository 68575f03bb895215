"""``cityflow join``: the city of many tiles as one file, tile after tile."""

from __future__ import annotations

import json
import os
import posixpath
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from rich.console import Console

from cityflow.errors import RunError
from cityflow.flow.inputs import LeftBehind
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.export_rows import ROWS
from cityflow.handover.export_summary import around, decode_summary
from cityflow.io.city_models.cityjson import Transform, json_line
from cityflow.io.city_models.cityjson_sequence import extent_of_headers, join
from cityflow.io.export_formats.cityjson import FOLDER as CITYJSON
from cityflow.io.tables.outlines_gpkg import Layer, write_geopackage_in_parts
from cityflow.runs.known_keys import nearest
from cityflow.runs.run_folder import open_run
from cityflow.stages import export, ingest, outline, units
from cityflow.stages.export.joined_products import JoinInputs, Refused, map_layers
from cityflow.stages.export.merge import summary_of
from cityflow.survey.city import OUTLINES
from cityflow.survey.districts import CITY
from cityflow.survey.results import Results

MAP, MODEL = ".gpkg", ".city.jsonl"
PART = "part "
"""Begins the names of the inputs of a merge."""


@dataclass(frozen=True, slots=True)
class Left:
    """What the tasks of one tile have left, or those that belong to no tile; the store compares what it reads with their records."""

    results: Results
    store: Store


@dataclass(frozen=True)
class JoinedRun:
    """The exports of a run, read tile by tile.

    Attributes
    ----------
    tiles : those asked for, sorted
    everywhere : whether these are all
    """

    url: str
    store: Store
    ledger: Ledger
    tiles: Sequence[str]
    everywhere: bool

    def of(self, tile: str) -> Left:
        """What stands of a tile: of an export that failed, what an earlier one left."""
        named = [self.ledger.latest(stage, tile) for stage in (outline.NAME, units.NAME)]
        return self._left([*named, self.ledger.last_good(export.NAME, tile)])

    def of_no_tile(self) -> Left:
        return self._left([self.ledger.latest(ingest.NAME, OUTLINES)])

    def _left(self, named: Sequence[Record | None]) -> Left:
        records = [r for r in named if r is not None]
        results = Results()
        for record in records:
            results.learn(record)
        return Left(results, self.store.expecting(LeftBehind(records)))

    @cached_property
    def models(self) -> list[str]:
        """Paths of the tiles' CityJSON."""
        paths = (p for t in self.tiles for p in self.of(t).results.outputs_of(export.NAME, t) if p.startswith(CITYJSON))
        return sorted(paths)


def join_run(url: str, out: str, tiles: Sequence[str], console: Console) -> None:
    """Write the map of a run (``.gpkg``) or its model (``.city.jsonl``) as one file; memory is that of a tile.

    Parameters
    ----------
    out : ends in one of `WRITERS`
    tiles : names of ground tiles; none: all

    Raises
    ------
    RunError
        The run has no such tile, or its exports have not been merged yet.
    """
    path = Path(out).expanduser()
    write = next(w for ending, w in WRITERS.items() if path.name.lower().endswith(ending))
    store = Store.open(url)
    with Ledger.open(store) as ledger, _replacing(path) as made:
        known = tiles_of(ledger, url)
        write(JoinedRun(url, store, ledger, _chosen(tiles, known, url), not tiles), made, path)
    console.print(f"{path}", markup=False, highlight=False, soft_wrap=True)


def tiles_of(ledger: Ledger, url: str) -> list[str]:
    """Names of the tiles that the last merge is made of, sorted. Raises RunError where there is none."""
    found, left = [], [CITY]
    while left:
        record = ledger.last_good(export.NAME, left.pop())
        if record is None:
            continue
        parts = [name.removeprefix(PART) for name in record.inputs if name.startswith(PART)]
        left.extend(parts)
        if not parts and record.unit != CITY:
            found.append(record.unit)
    if not found:
        raise RunError("its exports have not been merged yet", where=url, remedy="finish the run first")
    return sorted(found)


def _chosen(asked: Sequence[str], known: Sequence[str], url: str) -> list[str]:
    if missing := sorted(set(asked) - set(known)):
        near = nearest(missing[0], known)
        raise RunError(f"no tile '{missing[0]}' in {url}", where="--tiles", remedy=f"the nearest is '{near}'")
    return sorted(set(asked)) or list(known)


@contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """A place beside `path` that takes its place when all went well."""
    with tempfile.TemporaryDirectory(prefix=".join-", dir=path.absolute().parent) as folder:
        made = Path(folder) / path.name
        yield made
        os.replace(made, path)


def _write_map(run: JoinedRun, made: Path, _path: Path) -> None:
    wanted = open_run(run.url)
    # what is refused belongs to no tile of an area: the map of a small city leaves it out, too
    told = wanted.area.is_everywhere

    def parts() -> Iterator[Sequence[Layer]]:
        for tile in run.tiles:
            yield _map_of(run.of(tile), tile, with_refused=told)
        if run.everywhere and told:
            yield _map_of(run.of_no_tile(), "", with_refused=True)

    write_geopackage_in_parts(made, parts, wanted.catalog.reference)


def _map_of(left: Left, tile: str, *, with_refused: bool) -> list[Layer]:
    found = left.results
    of_units = units.NAME if found.of(units.NAME, tile) is not None else outline.NAME
    rows = [p for p in found.outputs_of(export.NAME, tile) if p.endswith(f"/{ROWS}")]
    given = JoinInputs(
        tuple(found.outlines_of(outline.NAME, tile)), tuple(found.outlines_of(of_units, tile)), tuple(found.split_files(tile)), tuple(rows),
    )  # fmt: skip
    refused = Refused(found.refused_outlines(), tuple(found.refused_files())) if with_refused else Refused({}, ())
    return map_layers(left.store, given, refused)


def _write_model(run: JoinedRun, made: Path, path: Path) -> None:
    if not run.models:
        raise RunError(
            "its tiles have no CityJSON", where=run.url, remedy="ask for it: --set export.formats=[cityjson]"
        )
    headers = [_header(run, p) for p in run.models]
    bounds = around(
        decode_summary(left.store.read_bytes(p), p).bounds
        for tile in run.tiles
        for left in [run.of(tile)]
        for p, _ in [summary_of(left.results, tile)]
        if p
    )
    tree = json.loads(headers[0])
    tree["transform"] = Transform.over(bounds).json
    extent = extent_of_headers(headers)
    if extent is not None:
        tree["metadata"]["geographicalExtent"] = [round(float(v), 4) for v in extent]
    files = (run.store.read_bytes(p).splitlines(keepends=True) for p in run.models)
    with made.open("wb") as file:
        file.writelines(join(files, json_line(tree), _folders(run.store, path)))


def _header(run: JoinedRun, path: str) -> bytes:
    return run.store.read_bytes(path).split(b"\n", 1)[0]


def _folders(store: Store, path: Path) -> tuple[str, str]:
    """Where the tiles' files stand, and from where the joined one names pages of textures: as if it were a product, where the RUN is no folder."""
    if not store.is_local:
        return CITYJSON, posixpath.dirname(CITYJSON)
    return posixpath.join(os.path.abspath(store.root), CITYJSON), str(path.absolute().parent)


WRITERS: dict[str, Callable[[JoinedRun, Path, Path], None]] = {MAP: _write_map, MODEL: _write_model}
"""Ending → what writes such a file."""
