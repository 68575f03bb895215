"""Stage ``ingest``, unit ``outlines``: the file of given outlines read once, cleaned, named and dealt out to tiles by chains of neighbours.

What knows no tiles is done here: repeated polygons and ids, edits, chains. Memory is that of a part of the file and about 300 bytes for each outline.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Outline
from cityflow.core.edits import Edits
from cityflow.core.grid import Bounds, tile_at
from cityflow.flow.task import Json, Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import EditsField
from cityflow.handover.outline_spool import OutlineSpool, encode_plain
from cityflow.handover.refused_outlines import REFUSED, encode_refused
from cityflow.handover.source_file import SourceFile
from cityflow.io.crs import resolve
from cityflow.io.fetch import local_file
from cityflow.io.tables.outline_file import OutlineFile
from cityflow.outlines.given.edited import apply_to_many
from cityflow.outlines.given.given import Refusal, mended_outlines, places_where_nameless, renamed, twin
from cityflow.outlines.identity import Settled, geometry_key, settled
from cityflow.outlines.noded.chains import chains_by_cells
from cityflow.outlines.noded.dealing import deal
from cityflow.stages.ingest.outline_sample import SAMPLE, sampled
from cityflow.survey.city import INGEST as NAME
from cityflow.survey.city import OUTLINES
from cityflow.survey.survey import Survey

VERSION = 5
OUTSIDE = "stands outside the survey: nothing was measured there"


@dataclass(frozen=True, slots=True)
class OutlinesInputs(TaskInputs):
    """The file of given outlines, the names of all tiles of the survey, and what a person has drawn."""

    file: SourceFile
    tiles: tuple[str, ...]
    edits: EditsField


@dataclass(frozen=True, slots=True)
class OutlinesParameters(TaskInputs):
    """How given outlines are read and dealt out.

    Attributes
    ----------
    tile_m : edge of a ground tile;  noding_tolerance_m : outlines nearer than this form a chain, metres
    id_column, id_format, layer : as in `OutlineAsset`
    crs : code of the survey's CRS
    files : LiDAR file → its bounds, metres
    """

    tile_m: float
    noding_tolerance_m: float
    id_column: str | None
    id_format: str | None
    layer: str | None
    crs: str
    files: Mapping[str, Bounds]


def task(survey: Survey) -> Task:
    """Read and deal out the given outlines of the whole city."""
    asset, edits = survey.catalog.outlines, survey.edits.of_outlines
    assert asset is not None
    return KIND.task(
        OUTLINES,
        parameters=as_json(OutlinesParameters(
            survey.parameters.tiles.tile_m, survey.parameters.outline.noding_tolerance_m, asset.id_column, asset.id_format, asset.layer,
            survey.catalog.reference.code, {f.name: f.bounds for f in survey.lidar.files.values()},
        )),
        inputs={
            "file": asset.checksum, "tiles": digest_of(list(survey.lattice.tiles)),
            **({"edits": digest_of(edits.lines())} if len(edits) else {}),
        },
        given=OutlinesInputs(
            SourceFile(asset.href, asset.size, asset.checksum), tuple(survey.lattice.tiles), edits
        ),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """One file per tile, of the chains that its task nodes; those refused with their reasons and places; a sample for their accuracy."""
    given, p = task.arguments_as(OutlinesInputs), task.parameters_as(OutlinesParameters)
    with OutlineSpool() as spool:
        read = _Read(spool)
        notes = _clean(read, given.file, p)
        as_given = read.settle()
        chain = _chains(read, as_given, p)
        # how exact they are is a matter of the given ones: no edit changes it, which every unit of the city depends on
        sampled_from, sample = _sampled(read, as_given, chain, set(given.tiles), p)
        named, edited = _edited(read, as_given, given.edits)
        chain = chain if named is as_given else _chains(read, named, p)
        dealt = deal(named.bounds, named.points, chain, p.tile_m, set(given.tiles), p.noding_tolerance_m)
        for tile, members in sorted(dealt.members.items()):
            ordered = sorted(members, key=lambda i: named.names[i])
            workspace.write(f"{tile}.jsonl", b"".join(read.lines(named.numbers[ordered].tolist())))
        far = read.outlines(named.numbers[dealt.outside].tolist())
        outside = [Refusal(o.id, OUTSIDE, o.polygon) for o in far]
        standing = set(named.names) - {r.id for r in outside}
        refused = _unique_names([*read.refused, *read.twins(), *edited, *outside], standing)
        taken = _taken(named.names, [*named.names, *(r.id for r in refused)], dealt.members)
    if sample:
        workspace.write(SAMPLE, sample)
    if refused:
        workspace.write(REFUSED, encode_refused((r.id, r.shape) for r in refused))
    return workspace.outcome(
        reason="; ".join(notes),
        result={
            "refused": [[r.id, r.reason] for r in refused],
            "notes": notes,
            "outlines": read.count,
            "reached": dict(sorted(dealt.reached.items())),
            "taken": taken,
            "sampled_from": sampled_from,
        },
    )


def _clean(read: _Read, source: SourceFile, p: OutlinesParameters) -> list[str]:
    """Read the file; what a user should know about it."""
    with local_file(source.href) as path:
        source.refuse_other(path)
        file = OutlineFile.open(path, p.id_column, p.id_format, resolve(p.crs), p.layer)
        for part in file.parts():
            read.add(part)
    return file.notes


def _chains(read: _Read, named: _Named, p: OutlinesParameters) -> IntArray:
    """Of each outline the chain of neighbours that it belongs to."""
    return chains_by_cells(
        named.bounds, p.noding_tolerance_m, p.tile_m, lambda n: read.spool.polygons(named.numbers[n])
    )


def _edited(read: _Read, named: _Named, edits: Edits) -> tuple[_Named, list[Refusal]]:
    """The outlines that stay, with the edits in force, and those that do not stay because of these."""
    found = apply_to_many(named.names, named.bounds, lambda n: read.outlines(named.numbers[n].tolist()), edits)
    return read.replaced(named, found.numbers, found.instead), found.refused


def _sampled(read: _Read, named: _Named, chain: IntArray, known: set[str], p: OutlinesParameters) -> tuple[str, bytes]:
    """The LiDAR file that tells how exact they are, and the names of a sample with the chains that these belong to; empty where there is none."""
    inside = [tile_at(x, y, p.tile_m).name in known for x, y in named.points.tolist()]
    within = np.flatnonzero(np.array(inside, bool))
    file, chosen = sampled([named.names[i] for i in within], named.bounds[within], p.files)
    if not chosen:
        return "", b""
    numbers = np.flatnonzero(np.isin(chain, chain[within[chosen]]))
    head = json.dumps(sorted(named.names[i] for i in within[chosen]), ensure_ascii=False).encode() + b"\n"
    return file, head + b"".join(sorted(read.lines(named.numbers[numbers].tolist())))


@dataclass(frozen=True, slots=True)
class _Named:
    """Outlines that stay: final names, numbers in the spool, boxes (N, 4) and representative points (N, 2) in metres."""

    names: list[str]
    numbers: IntArray
    bounds: FloatArray
    points: FloatArray


@dataclass(slots=True)
class _Read:
    """What is kept of every outline in memory; the outlines themselves are in the spool."""

    spool: OutlineSpool
    count: int = 0
    refused: list[Refusal] = field(default_factory=list)
    _ids: list[str] = field(default_factory=list)
    _places: list[str] = field(default_factory=list)
    _keys: list[bytes] = field(default_factory=list)
    _boxes: list[FloatArray] = field(default_factory=lambda: [np.empty((0, 6))])
    _settled: Settled = field(default_factory=lambda: Settled([], [], {}))

    def add(self, raw: Sequence[Outline]) -> None:
        """Clean a part of the file."""
        mended, refused = mended_outlines(raw)
        self.count += len(raw)
        self.refused += refused
        self._ids += [o.id for o in mended]
        self._places += places_where_nameless(mended)
        self._keys += [geometry_key(o.polygon) for o in mended]
        self._keep(mended)

    def settle(self) -> _Named:
        """When all parts are read: who stays, under which name."""
        self._settled = found = settled(self._ids, self._places, self._keys)
        self._places, self._keys = [], []
        numbers = np.array([i for i in range(len(self._ids)) if i not in found.twin_of], np.int64)
        boxes = np.concatenate(self._boxes)[numbers]
        return _Named([found.names[i] for i in numbers.tolist()], numbers, boxes[:, :4], boxes[:, 4:])

    def replaced(self, named: _Named, gone: Sequence[int], instead: Sequence[Outline]) -> _Named:
        """The same with others in the place of some."""
        if not len(gone) and not instead:
            return named
        first = len(self.spool)
        self._keep(instead)
        stay = np.setdiff1d(np.arange(len(named.names)), gone)
        new = self._boxes[-1]
        return _Named(
            [*(named.names[i] for i in stay), *(o.id for o in instead)],
            np.r_[named.numbers[stay], np.arange(first, first + len(instead))],
            np.concatenate([named.bounds[stay], new[:, :4]]),
            np.concatenate([named.points[stay], new[:, 4:]]),
        )

    def twins(self) -> list[Refusal]:
        """Outlines whose polygon came before."""
        numbers = list(self._settled.twin_of)
        return [twin(o, self._settled, i) for i, o in zip(numbers, self.spool.outlines(numbers), strict=True)]

    def outlines(self, numbers: Sequence[int]) -> list[Outline]:
        """By their numbers in the spool, under their final names."""
        found = zip(numbers, self.spool.outlines(numbers), strict=True)
        return [renamed(o, self._settled, i) if i < len(self._ids) else o for i, o in found]

    def lines(self, numbers: Sequence[int]) -> list[bytes]:
        """The same as lines of text; most are as they were written."""
        found = self.spool.lines(numbers)
        other = [k for k, i in enumerate(numbers) if i < len(self._ids) and self._settled.names[i] != self._ids[i]]
        for k, line in zip(other, encode_plain(self.outlines([numbers[k] for k in other])), strict=True):
            found[k] = line
        return found

    def _keep(self, outlines: Sequence[Outline]) -> None:
        polygons = np.array([o.polygon for o in outlines], dtype=object)
        points = shapely.get_coordinates(shapely.point_on_surface(polygons))
        self._boxes.append(np.column_stack([shapely.bounds(polygons).reshape(-1, 4), points]))
        self.spool.append(outlines)


def _taken(names: Sequence[str], every: Iterable[str], members: Mapping[str, Sequence[int]]) -> dict[str, Json]:
    """Tile → names of the whole file that parts of its outlines would get, were these cut into parts; only where there are some."""
    known, numbered = set(names), defaultdict[str, set[str]](set)
    for name in every:
        whole, _, number = name.rpartition("-")
        if number.isdecimal() and whole in known:
            numbered[whole].add(name)
    found = {t: sorted(n for i in own for n in numbered.get(names[i], ())) for t, own in sorted(members.items())}
    return {tile: list(taken) for tile, taken in found.items() if taken}


def _unique_names(refusals: Iterable[Refusal], taken: set[str]) -> list[Refusal]:
    """Refused outlines under names of their own: a duplicate must not hide the unit whose id it bears."""
    named = []
    for refusal in refusals:
        name, n = refusal.id, 1
        while name in taken:
            n += 1
            name = f"{refusal.id}~{n}"
        taken.add(name)
        named.append(replace(refusal, id=name))
    return named


KIND = TaskKind(NAME, VERSION, run, OutlinesInputs)
