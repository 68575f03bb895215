"""Results of tasks so far: names, digests, reasons."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from sys import intern
from typing import NamedTuple

from cityflow.core.building import Status
from cityflow.flow.stage import Node
from cityflow.flow.task import Record, digest_of
from cityflow.handover.hull_input import Hull

HULL = "hull.city.jsonl"
"""What reconstruction leaves of a unit."""
INGEST, RECONSTRUCT = "ingest", "reconstruct"


class Left(NamedTuple):
    """What later tasks ask of a task that has ended, and no more: a city has millions.

    Attributes
    ----------
    digest : of its contents, as its result says; empty where it does not
    paths, sums : RUN-relative paths that it left, and the digests of their contents
    sizes : bytes of the files, in the order of the paths, of the stage ``ingest`` alone; 0 where they are not known
    """

    status: Status
    reason: str
    digest: str
    paths: tuple[str, ...]
    sums: tuple[str, ...]
    sizes: tuple[int, ...] = ()

    @property
    def outputs(self) -> dict[str, str]:
        """Path → digest."""
        return dict(zip(self.paths, self.sums, strict=True))

    @property
    def contents(self) -> str:
        """What downstream digests take in of it: its contents, or how it failed."""
        return self.digest or f"{self.status}: {self.reason}"


def nothing(_: Node) -> None:
    """The memory of a walk that comes to all tasks: what it has not come to has not ended."""


class Results:
    """What tasks have left, by stage and unit.

    Attributes
    ----------
    recall : asked for a task that nobody has told of: may have its record learned
    changes : stage → records learned so far; answers about a stage hold as long as its number stays
    """

    def __init__(self, recall: Callable[[Node], None] = nothing) -> None:
        self.recall = recall
        self.changes: Counter[str] = Counter()
        self._left: dict[str, dict[str, Left]] = {}
        self._refused: dict[Node, dict[str, str]] = {}

    def learn(self, record: Record) -> None:
        """Keep what later tasks ask of a record."""
        node = record.stage, record.unit
        self.changes[record.stage] += 1
        outputs = record.outputs
        if record.stage == RECONSTRUCT:
            outputs = {p: d for p, d in outputs.items() if p.endswith(HULL)}
        digest = str(record.result.get("digest") or "")
        digest = next((d for d in outputs.values() if d == digest), digest)  # one text less
        sizes = tuple(record.sizes.get(path, 0) for path in outputs) if record.stage == INGEST else ()
        left = Left(record.status, record.reason, digest, tuple(outputs), tuple(outputs.values()), sizes)
        self._left.setdefault(record.stage, {})[intern(record.unit)] = left
        self._refused.pop(node, None)
        if refused := record.result.get("refused"):
            self._refused[node] = {str(unit): str(reason) for unit, reason in refused}

    def forget(self, stage: str, units: Iterable[str]) -> None:
        """Drop what nobody will ask for again."""
        found = self._left.get(stage, {})
        for unit in units:
            found.pop(unit, None)

    def part(self, nodes: Iterable[Node]) -> Results:
        """What some tasks have left, and no more: it travels."""
        found = Results()
        for stage, unit in nodes:
            if (left := self.of(stage, unit)) is not None:
                found._left.setdefault(stage, {})[unit] = left
        return found

    def of(self, stage: str, unit: str) -> Left | None:
        """What a task has left; None where it has not ended."""
        left = self._left.get(stage, {}).get(unit)
        if left is None and self.recall is not nothing:
            self.recall((stage, unit))
            left = self._left.get(stage, {}).get(unit)
        return left

    def of_stage(self, stage: str) -> dict[str, Left]:
        """Unit → what its task has left. Nobody changes it."""
        return self._left.get(stage, {})

    def __iter__(self) -> Iterator[tuple[Node, Left]]:
        """All of them, stage by stage."""
        return (((stage, unit), left) for stage, found in self._left.items() for unit, left in found.items())

    def __contains__(self, node: Node) -> bool:
        return self.of(*node) is not None

    def digest_of(self, stage: str, unit: str) -> str:
        """What downstream digests take in of an upstream unit: its contents, or how it failed."""
        left = self.of(stage, unit)
        return "missing" if left is None else left.contents

    def outputs_of(self, stage: str, unit: str) -> dict[str, str]:
        """Path → digest of what a task left; nothing where it has not run or failed."""
        left = self.of(stage, unit)
        return {} if left is None else left.outputs

    def products_of(self, stage: str, unit: str) -> dict[str, str]:
        """Path → digest of the products of a task."""
        return {p: d for p, d in self.outputs_of(stage, unit).items() if p.startswith("products/")}

    def output_of(self, stage: str, unit: str, name: str) -> tuple[str, str] | None:
        """Path and digest of what a task left under a name; None where it left no such file."""
        left = self.of(stage, unit)
        found = () if left is None else zip(left.paths, left.sums, strict=True)
        return next((written for written in found if written[0].endswith(f"/{name}")), None)

    def reason_of(self, stage: str, unit: str) -> str:
        """Why a task did less than it should; empty where all is well."""
        left = self.of(stage, unit)
        return left.reason if left is not None and left.status is not Status.DONE else ""

    def has_failed(self, stage: str, unit: str) -> bool:
        """Whether a task has ended without a result."""
        left = self.of(stage, unit)
        return left is not None and left.status is Status.FAILED

    def failure_of(self, stage: str, unit: str) -> str:
        """Why a task failed; empty where it has not."""
        left = self.of(stage, unit)
        return left.reason if left is not None and left.status is Status.FAILED else ""

    def tiled_image(self, name: str) -> str | None:
        """Where the ingested image is written; None where it could not be read."""
        left = self.of("ingest", name)
        return next(iter(left.paths), None) if left and left.status is not Status.FAILED else None

    def hull(self, unit: str) -> Hull:
        """Where a unit's hull is written, or why there is none."""
        left = self.of(RECONSTRUCT, unit)
        if left is None:
            return Hull(None, Status.FAILED, "was not reconstructed")
        return Hull(left.paths[0] if left.paths else None, left.status, left.reason)

    def digest_of_hull(self, unit: str) -> str:
        """Of the hull's contents, or of how the unit failed."""
        left = self.of(RECONSTRUCT, unit)
        if left is None:
            return "missing"
        return left.sums[0] if left.sums else f"{left.status}: {left.reason}"

    def hulls(self, units: Sequence[str]) -> tuple[dict[str, str], str]:
        """Unit → where its hull is written, of those that have one; and one digest of `digest_of_hull` of all."""
        known = self.of_stage(RECONSTRUCT)
        found = [known.get(unit) or self.of(RECONSTRUCT, unit) for unit in units]
        paths = {unit: left.paths[0] for unit, left in zip(units, found, strict=True) if left and left.paths}
        digests = [
            left.sums[0] if left and left.sums else self.digest_of_hull(unit)
            for unit, left in zip(units, found, strict=True)
        ]
        return paths, digest_of([units, digests])

    def outlines_of(self, stage: str, tile: str) -> dict[str, str]:
        """Path → digest of the file that holds the outlines or the units of a tile, as the stage ``outline`` or ``units`` left them; none where it has none."""
        return {p: d for p, d in sorted(self.outputs_of(stage, tile).items()) if p.endswith(".jsonl")}

    def split_files(self, tile: str) -> dict[str, str]:
        """Path → digest of the file that says how the outlines of a tile were split."""
        return {p: d for p, d in self.outputs_of("units", tile).items() if p.endswith(".ndjson")}

    def refused_by(self, node: Node) -> dict[str, str]:
        """Outlines that a task has refused, with the reason."""
        return self._refused.get(node, {}) if self.of(*node) is not None else {}

    def refused_outlines(self) -> dict[str, str]:
        """Outlines and units that cannot be buildings, or that a person has rejected, with the reason."""
        return {unit: why for node in self._refusing() for unit, why in self.refused_by(node).items()}

    def refused_files(self) -> dict[str, str]:
        """Path → digest of the files that hold their polygons."""
        return {
            p: d for node in self._refusing() for p, d in self.outputs_of(*node).items() if p.endswith("/refused.json")
        }

    def _refusing(self) -> list[Node]:
        """The tasks that may refuse outlines, and have ended."""
        given = ("ingest", "outlines")
        others = [(stage, tile) for stage in ("outline", "units") for tile in sorted(self.of_stage(stage))]
        return [given, *others] if given in self else others
