"""How long the report of a large city takes, and how large it is: a RUN is repeated until it has so many buildings.

    python benchmarks/report.py RUN [--units 5000] [--failed 0.02] [--degraded 0.02] [--keep FOLDER]

Of every building records, outline, export row and texture faces are repeated under other names, in the same place, so hulls, rasters and
pages are read as they are in a real city of that size. Shares of the copies are made failed (with a traceback, without a model) and
degraded. Measured is what `cityflow report` does apart from the view in the browser; asked for: 10 s and 15 MB at 5,000 buildings.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import write_record
from cityflow.flow.task import Record
from cityflow.stages import atlas, export, outline, reconstruct, texture, units
from cityflow.workflow.current import CurrentRecords, current_records
from cityflow.workflow.prepare import Prepared
from cityflow.workflow.report import write_report_files
from cityflow.workflow.run_folder import open_run

FAR_M = 20_000.0
"""Faces of copies stand this far apart, so that a picture of one place does not show them all."""
TRACEBACK = (
    'Traceback (most recent call last):\n  File "planes.py", line 84, in found\nValueError: no plane in 3 points\n'
)


def main() -> None:
    args = _arguments()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(args.keep or scratch) / "run"
        shutil.copytree(
            args.run, folder, copy_function=os.link, ignore=shutil.ignore_patterns("ledger.sqlite*", "view")
        )
        run = open_run(str(folder))
        made = _repeated(run, args)
        for what in ("first", "again"):
            _measure(run, folder, f"{made} buildings, {what}")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run")
    parser.add_argument("--units", type=int, default=5000)
    parser.add_argument("--failed", type=float, default=0.02)
    parser.add_argument("--degraded", type=float, default=0.02)
    parser.add_argument("--keep", default="", help="folder on the same disk to leave the made RUN in")
    return parser.parse_args()


def _measure(run: Prepared, folder: Path, what: str) -> None:
    cpu, wall = time.process_time(), time.perf_counter()
    with Ledger.open(run.store) as ledger:
        records = current_records(run, ledger)
    walked = time.process_time() - cpu
    data = write_report_files(run, records)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    pages = list((folder / "report").glob("*.html"))
    sizes = [(folder / "report.html").stat().st_size, *(p.stat().st_size for p in pages)]
    print(
        f"{what}: {cpu:.1f} s of CPU ({walked:.1f} s for the records), {wall:.1f} s on the clock, page {sizes[0] / 1e6:.2f} MB, "
        f"report.json {(folder / 'report.json').stat().st_size / 1e6:.1f} MB, {len(pages)} pages of buildings "
        f"of {sum(sizes[1:]) / max(len(pages), 1) / 1e3:.0f} kB, {data.pages_left_out} left out",
        flush=True,
    )


def _repeated(run: Prepared, args: argparse.Namespace) -> int:
    """Write the copies; returns how many buildings there are."""
    with Ledger.open(run.store) as ledger:
        records = current_records(run, ledger)
    times = -(-args.units // len(records.of(reconstruct.STAGE)))
    outlined = units.STAGE if records.of(units.STAGE) else outline.STAGE
    changed: list[Record] = []
    for number, record in enumerate(records.of(reconstruct.STAGE)):
        changed += [_spoiled(_named(record, k), k * 1009 + number, args) for k in range(1, times)]
    changed += [_named(record, k) for record in records.of(texture.STAGE) for k in range(1, times)]
    changed += [_with_entries(run, record, times) for record in records.of(outlined)]
    changed += [_with_json(run, record, f"/{export.ROWS}", times, _rows) for record in records.of(export.STAGE)]
    changed += [_with_json(run, record, f"/{atlas.LEAF}", times, _leaf) for record in records.of(atlas.STAGE)]
    for record in changed:
        write_record(run.store, replace(record, attempt=record.attempt + 1))
    return _count(run, records)


def _count(run: Prepared, before: CurrentRecords) -> int:
    with Ledger.open(run.store) as ledger:
        count = len(current_records(run, ledger).of(reconstruct.STAGE))
    assert count > len(before.of(reconstruct.STAGE))
    return count


def _copy_name(unit: str, k: int) -> str:
    return unit if k == 0 else f"{unit}~{k}"


def _named(record: Record, k: int) -> Record:
    return replace(record, unit=_copy_name(record.unit, k))


def _spoiled(record: Record, number: int, args: argparse.Namespace) -> Record:
    """Every so many copies are failed or degraded; spread evenly, the same ones whenever it is run."""
    share = number * 0.6180339887 % 1.0
    if share < args.failed:
        reason = f"ValueError: no plane in {3 + number % 5} points"
        return replace(record, status=Status.FAILED, reason=reason, outputs={}, result={}, traceback=TRACEBACK)
    if share < args.failed + args.degraded and record.status is Status.DONE:
        return replace(record, status=Status.DEGRADED, reason="one block with a level top")
    return record


def _with_entries(run: Prepared, record: Record, times: int) -> Record:
    """A tile's outlines, every one so many times, in a file of its own."""
    entries, lines, start = [], [], 0
    for entry in record.result.get("units", []):
        text = run.store.read_bytes(entry["path"])[entry["start"] : entry["start"] + entry["length"]]
        tree = json.loads(text)
        for k in range(times):
            beside = [_copy_name(n, k) for n in entry["neighbours"]]
            copy = {**tree, "id": _copy_name(entry["id"], k), "neighbours": beside}
            line = (json.dumps(copy, ensure_ascii=False, separators=(",", ":")) + "\n").encode()
            place = {"path": f"work/repeated/{record.unit}.jsonl", "start": start, "length": len(line)}
            entries.append({**entry, **place, "id": copy["id"], "neighbours": beside})
            lines.append(line)
            start += len(line)
    run.store.write_bytes(f"work/repeated/{record.unit}.jsonl", b"".join(lines))
    return replace(record, result={**record.result, "units": entries})


def _with_json(run: Prepared, record: Record, ending: str, times: int, repeat: Any) -> Record:
    """A record whose JSON output with that ending is written anew, with the copies in it."""
    outputs = dict(record.outputs)
    for path in [p for p in outputs if p.endswith(ending)]:
        tree = repeat(json.loads(run.store.read_bytes(path)), times)
        copy = f"work/repeated/{record.stage}/{record.unit}{ending}"
        run.store.write_bytes(copy, json.dumps(tree, ensure_ascii=False).encode())
        outputs[copy] = outputs.pop(path)
    inputs = {n: d for name, d in record.inputs.items() for n in _inputs(name, times)}
    return replace(record, outputs=outputs, inputs=inputs)


def _inputs(name: str, times: int) -> Iterator[str]:
    kind, _, unit = name.partition(" ")
    yield from (f"{kind} {_copy_name(unit, k)}" for k in (range(times) if kind == "texture" else (0,)))


def _rows(tree: dict[str, Any], times: int) -> dict[str, Any]:
    return {_copy_name(unit, k): row for unit, row in tree.items() for k in range(times)}


def _leaf(tree: dict[str, Any], times: int) -> dict[str, Any]:
    plain = {
        _copy_name(u, k): [[_moved(rings, k), *more] for rings, *more in rows]
        for u, rows in tree["plain"].items()
        for k in range(times)
    }
    sets = {
        name: {**made, "faces": [
            {**f, "unit": _copy_name(f["unit"], k), "rings": _moved(f["rings"], k)}
            for f in made["faces"] for k in range(times)
        ]}
        for name, made in tree["sets"].items()
    }  # fmt: skip
    return {**tree, "plain": plain, "sets": sets}


def _moved(rings: Any, k: int) -> Any:
    return rings if k == 0 else [[[x + k * FAR_M, y, z] for x, y, z in ring] for ring in rings]


if __name__ == "__main__":
    main()
