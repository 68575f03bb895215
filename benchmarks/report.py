"""How long the report of a large city takes, and how large it is: a RUN is repeated until it has so many buildings.

    python benchmarks/report.py RUN [--units 5000] [--failed 0.02] [--degraded 0.02] [--rows 100000] [--keep FOLDER]

Of every building records, outline and export row are repeated under other names, in the same place, so hulls and rasters are read as they
are in a real city of that size; of textures the report reads no more in a larger city. Shares of the copies are made failed (with a
traceback, without a model) and degraded. Measured is what `cityflow report` does apart from the view in the browser; asked for: 10 s and
15 MB at 5,000 buildings.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.flow.records import write_record
from cityflow.flow.task import Record
from cityflow.handover.export_rows import ROWS
from cityflow.reporting.run_report import uncollected, with_settings, write_report_files
from cityflow.runs.current import CurrentRecords, current_records
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import open_run
from cityflow.stages import export, outline, reconstruct, texture, units

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
        run = with_settings(open_run(str(folder)), [f"report.rows={args.rows}"])
        made = _repeated(run, args)
        for what in ("first", "again"):
            _measure(run, folder, f"{made} buildings, {what}")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run")
    parser.add_argument("--units", type=int, default=5000)
    parser.add_argument("--failed", type=float, default=0.02)
    parser.add_argument("--degraded", type=float, default=0.02)
    parser.add_argument("--rows", type=int, default=100_000, help="report.rows: beyond so many, some are listed")
    parser.add_argument("--keep", default="", help="folder on the same disk to leave the made RUN in")
    return parser.parse_args()


def _measure(run: Prepared, folder: Path, what: str) -> None:
    cpu, wall = time.process_time(), time.perf_counter()
    with uncollected(), Ledger.open(run.store) as ledger:
        records = current_records(run, ledger)
        walked = time.process_time() - cpu
        data = write_report_files(run, records)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    pages = list((folder / "report").glob("*.html"))
    sizes = [(folder / "report.html").stat().st_size, *(p.stat().st_size for p in pages)]
    print(
        f"{what}: {cpu:.1f} s of CPU ({walked:.1f} s for the records), {wall:.1f} s on the clock, page {sizes[0] / 1e6:.2f} MB, "
        f"report.json {(folder / 'report.json').stat().st_size / 1e6:.1f} MB, {len(pages)} pages of buildings "
        f"of {sum(sizes[1:]) / max(len(pages), 1) / 1e3:.0f} kB, {data.pages_left_out} left out, "
        f"peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB",
        flush=True,
    )


def _repeated(run: Prepared, args: argparse.Namespace) -> int:
    """Write the copies; returns how many buildings there are."""
    with Ledger.open(run.store) as ledger:
        records = current_records(run, ledger)
        times = -(-args.units // len(records.of(reconstruct.NAME)))
        outlined = units.NAME if records.of(units.NAME) else outline.NAME
        changed: list[Record] = []
        for number, record in enumerate(records.of(reconstruct.NAME)):
            changed += [_spoiled(_named(record, k), k * 1009 + number, args) for k in range(1, times)]
        changed += [_named(record, k) for record in records.of(texture.NAME) for k in range(1, times)]
        changed += [_with_entries(run, record, times) for record in records.of(outlined)]
        changed += [_with_json(run, record, f"/{ROWS}", times, _rows) for record in records.of(export.NAME)]
        for record in changed:
            write_record(run.store, replace(record, attempt=record.attempt + 1))
        return _count(run, records)


def _count(run: Prepared, before: CurrentRecords) -> int:
    with Ledger.open(run.store) as ledger:
        count = len(current_records(run, ledger).of(reconstruct.NAME))
    assert count > len(before.of(reconstruct.NAME))
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
        return replace(record, status=Status.DEGRADED, reason="one block with a flat top")
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
    return replace(record, outputs=outputs)


def _rows(tree: dict[str, Any], times: int) -> dict[str, Any]:
    return {_copy_name(unit, k): row for unit, row in tree.items() for k in range(times)}


if __name__ == "__main__":
    main()
