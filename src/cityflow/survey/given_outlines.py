"""Outlines of the catalog, as read, dealt out to tiles and noded."""

from __future__ import annotations

from dataclasses import dataclass

from cityflow.core.building import Status
from cityflow.flow.task import Record
from cityflow.survey.point_files import stem

ACCURACY = "outline_accuracy"
"""Unit of the stage ``ingest`` that says how exact given outlines are."""
OUTLINES = "outlines"
"""Unit of the stage ``ingest`` that reads given outlines."""
_NODED = "outlines."
"""Begins the names of the units of that stage that node them."""
REFUSED_OF = "refused."
"""Begins the names of files of outlines that noding has left nothing of."""


def noding_unit(tile: str) -> str:
    """The unit that nodes the chains dealt to a tile."""
    return f"{_NODED}{tile}"


def noded_tile(unit: str) -> str | None:
    """The other way round; None for a unit that does something else."""
    return unit.removeprefix(_NODED) if unit.startswith(_NODED) else None


@dataclass(frozen=True, slots=True)
class NodedFile:
    """A file that a noding task has left: what it is, whatever digest its task has, where it stands, and the digest of its contents."""

    name: str
    path: str
    digest: str


class GivenOutlines:
    """Files of given outlines.

    Attributes
    ----------
    sigma_m : how exact they are by the survey's own buildings (standard deviation); None if unknown
    """

    def __init__(self) -> None:
        self.sigma_m: float | None = None
        self._dealt: dict[str, tuple[str, str]] = {}
        self._reached: dict[str, tuple[str, ...]] = {}
        self._taken: dict[str, tuple[str, ...]] = {}
        self._sources: dict[str, list[str]] = {}
        self._noded: dict[str, dict[str, NodedFile]] = {}
        self._beside: dict[str, dict[str, list[str]]] = {}
        self._lost: dict[str, str] = {}
        self._sampled_from = ""

    def learn(self, record: Record) -> None:
        """Keep what the tasks that read and node them have left."""
        if record.stage != "ingest":
            return
        if record.unit == OUTLINES:
            self._learn_dealt(record)
        elif record.unit == ACCURACY:
            self.sigma_m = record.result.get("sigma_m")
        elif (tile := noded_tile(record.unit)) is not None:
            files = {stem(p): NodedFile(f"{record.unit} {stem(p)}", p, d) for p, d in record.outputs.items()}
            self._noded[tile] = files
            self._beside[tile] = {str(t): list(map(str, near)) for t, near in record.result.get("beside", {}).items()}
            self._lost.pop(tile, None)
            if record.status is Status.FAILED:
                self._lost[tile] = record.reason

    def _learn_dealt(self, record: Record) -> None:
        self._dealt = {stem(path): (path, digest) for path, digest in record.outputs.items()}
        self._reached = {str(t): tuple(map(str, over)) for t, over in record.result.get("reached", {}).items()}
        self._taken = {str(t): tuple(map(str, names)) for t, names in record.result.get("taken", {}).items()}
        self._sampled_from = str(record.result.get("sampled_from", ""))
        self._sources = {}
        for source, tiles in sorted(self._reached.items()):
            for tile in tiles:
                self._sources.setdefault(tile, []).append(source)

    def dealt(self, tile: str) -> tuple[str, str]:
        """Path and digest of the outlines whose chains the task of a tile nodes."""
        return self._dealt[tile]

    def reached(self, tile: str) -> tuple[str, ...]:
        """The tiles of the survey that may own one of these."""
        return self._reached[tile]

    def taken(self, tile: str) -> tuple[str, ...]:
        """Names of other outlines, of all tiles, that no part of these may get."""
        return self._taken.get(tile, ())

    def sources(self, tile: str) -> list[str]:
        """Tiles whose tasks node outlines that this tile may own; none before outlines are dealt out."""
        return self._sources.get(tile, [])

    def of(self, tile: str) -> list[NodedFile]:
        """Outlines that a tile owns."""
        return self._files([(s, tile) for s in self.sources(tile)])

    def refused_of(self, tile: str) -> list[NodedFile]:
        """Outlines that noding has left nothing of, for this tile to tell."""
        return self._files([(s, f"{REFUSED_OF}{tile}") for s in self.sources(tile)])

    def beside(self, tile: str) -> list[NodedFile]:
        """Outlines of those tiles whose outlines touch ones of this tile."""
        near = [(s, other) for s in self.sources(tile) for other in self._beside.get(s, {}).get(tile, [])]
        return self._files(near)

    def lost(self, tile: str) -> dict[str, str]:
        """Unit → why: noding that failed, without which outlines of the tile may be missing."""
        return {noding_unit(s): self._lost[s] for s in self.sources(tile) if s in self._lost}

    def _files(self, wanted: list[tuple[str, str]]) -> list[NodedFile]:
        found = (self._noded.get(source, {}).get(name) for source, name in wanted)
        return [f for f in found if f is not None]

    @property
    def sample(self) -> tuple[str, tuple[str, str]]:
        """The LiDAR file that tells how exact they are, and path and digest of outlines that stand in it; empty where there are none."""
        return self._sampled_from, self._dealt.get("sample", ("", ""))
