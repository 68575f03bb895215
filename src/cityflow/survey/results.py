"""Results of tasks so far: names, digests, reasons."""

from __future__ import annotations

from dataclasses import replace

from cityflow.core.building import Status
from cityflow.flow.stage import Node
from cityflow.flow.task import Record
from cityflow.handover.hull import Hull

HULL = "hull.city.jsonl"
"""What reconstruction leaves of a unit."""


class Results:
    """Records by stage and unit, as far as later tasks ask for them."""

    def __init__(self) -> None:
        self.records: dict[Node, Record] = {}

    def learn(self, record: Record) -> None:
        """Keep what later tasks ask of a record, and no more: a city has very many."""
        kept = {k: v for k, v in record.result.items() if k in ("digest", "refused")}
        inputs = record.inputs if record.stage == "outline" else {}
        self.records[record.stage, record.unit] = replace(
            record, result=kept, parameters={}, inputs=inputs, traceback=""
        )

    def digest_of(self, stage: str, unit: str) -> str:
        """What downstream digests take in of an upstream unit: its contents, or how it failed."""
        record = self.records.get((stage, unit))
        if record is None:
            return "missing"
        return str(record.result.get("digest") or f"{record.status}: {record.reason}")

    def outputs_of(self, stage: str, unit: str) -> dict[str, str]:
        """Path → digest of what a task left; nothing where it has not run or failed."""
        record = self.records.get((stage, unit))
        return dict(record.outputs) if record is not None else {}

    def products_of(self, stage: str, unit: str) -> dict[str, str]:
        """Path → digest of the products of a task."""
        record = self.records.get((stage, unit))
        return {p: d for p, d in record.outputs.items() if p.startswith("products/")} if record else {}

    def reason_of(self, stage: str, unit: str) -> str:
        """Why a task did less than it should; empty where all is well."""
        record = self.records.get((stage, unit))
        return record.reason if record is not None and record.status is not Status.DONE else ""

    def failure_of(self, stage: str, unit: str) -> str:
        """Why a task failed; empty where it has not."""
        record = self.records.get((stage, unit))
        return record.reason if record is not None and record.status is Status.FAILED else ""

    def tiled_image(self, name: str) -> str | None:
        """Where the ingested image is written; None where it could not be read."""
        record = self.records.get(("ingest", name))
        return next(iter(record.outputs), None) if record and record.status is not Status.FAILED else None

    def hull(self, unit: str) -> Hull:
        """Where a unit's hull is written, or why there is none."""
        record = self.records.get(("reconstruct", unit))
        if record is None:
            return Hull(None, Status.FAILED, "was not reconstructed")
        path = next((p for p in record.outputs if p.endswith(HULL)), None)
        return Hull(path, record.status, record.reason)

    def digest_of_hull(self, unit: str) -> str:
        """Of the hull's contents, or of how the unit failed."""
        record = self.records.get(("reconstruct", unit))
        if record is None:
            return "missing"
        hulls = (digest for path, digest in record.outputs.items() if path.endswith(HULL))
        return next(hulls, f"{record.status}: {record.reason}")

    def outlines_of(self, stage: str, tile: str) -> dict[str, str]:
        """Path → digest of the file that holds the outlines or the units of a tile, as the stage ``outline`` or ``units`` left them; none where it has none."""
        record = self.records.get((stage, tile))
        known = (record.outputs, record.inputs if stage == "outline" else {}) if record else ()
        files = ({p: d for p, d in sorted(paths.items()) if p.endswith(".jsonl")} for paths in known)
        return next(filter(None, files), {})

    def split_files(self, tile: str) -> dict[str, str]:
        """Path → digest of the file that says how the outlines of a tile were split."""
        return {p: d for p, d in self.outputs_of("units", tile).items() if p.endswith(".ndjson")}

    def refused_outlines(self) -> dict[str, str]:
        """Outlines and units that cannot be buildings, or that a person has rejected, with the reason."""
        return {str(u): str(why) for r in self._refusing() for u, why in r.result.get("refused", [])}

    def refused_files(self) -> dict[str, str]:
        """Path → digest of the files that hold their polygons."""
        return {p: d for r in self._refusing() for p, d in r.outputs.items() if p.endswith("/refused.json")}

    def _refusing(self) -> list[Record]:
        """What the tasks that may refuse outlines have left."""
        given = self.records.get(("ingest", "outlines"))
        others = [r for (stage, _), r in sorted(self.records.items()) if stage in ("outline", "units")]
        return others if given is None else [given, *others]
