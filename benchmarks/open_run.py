"""How long it takes to open a RUN of so many buildings, and how much memory: with records joined in segments, and as files.

``python benchmarks/open_run.py [BUILDINGS …]`` makes RUNs in a temporary folder (3 GB for a million buildings) and asks each in processes
of their own: to open without an index (cold) and with it (warm), for `status`, and for every whole record of `reconstruct`, one by one
(records). ``--ask`` says which of these, or to hold all whole records at once, as commands did before (held), or to join records that are
files (join). Each building has records of the sizes that the demo flight has: split 1.9 kB, reconstruct 7.2, texture 2.7, windows 1.2 and
three fifths of a match, 1.8. ``--files``: records as files instead. ``--s3``: on an object store, moto's server.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from hashlib import sha256, shake_128
from itertools import islice
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import psutil

from cityflow.core.building import Status
from cityflow.flow.ledger import SEGMENT, Ledger
from cityflow.flow.record_segments import write_segment
from cityflow.flow.records import CHECK_DIGITS, encode, record_path
from cityflow.flow.row import Line, Row
from cityflow.flow.some_units import ALL
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.runs.asked import DESCRIPTION, NOTE, Asked, circumstances, read_asked, write_asked
from cityflow.workflow.status import standing_of

PORT = 29517
ENDPOINT = {
    "AWS_ENDPOINT_URL": f"http://127.0.0.1:{PORT}", "AWS_ACCESS_KEY_ID": "open", "AWS_SECRET_ACCESS_KEY": "open", "AWS_DEFAULT_REGION": "us-east-1",
}  # fmt: skip
UNIT, DIGEST, NUMBER = "@unit@", "@digest@", "@number@"
SLOTS = re.compile(b'@unit@|@digest@|"@number@"')
STARTED = "2026-05-04T10:11:12.345+00:00"


@dataclass(frozen=True, slots=True)
class Kind:
    """What a record of a stage is made of; `every`: of five buildings, so many have one."""

    stage: str
    parameters: int
    inputs: int
    numbers: int
    outputs: int
    every: int = 5


KINDS = (
    Kind("split", 17, 6, 6, 1), Kind("reconstruct", 95, 7, 62, 2), Kind("texture", 17, 15, 8, 1), Kind("windows", 5, 1, 8, 1),
    Kind("match", 8, 4, 15, 1, every=3),
)  # fmt: skip


class Pieces:
    """Text of a record between the places where units differ."""

    def __init__(self, kind: Kind) -> None:
        record = Record(
            stage=kind.stage, unit=UNIT, attempt=1, digest=DIGEST, version=1, status=Status.DONE, reason="",
            outputs={f"work/{kind.stage}/{UNIT}/1234567890123456/output{i}.json": DIGEST for i in range(kind.outputs)},
            result={"verdict": "good", **{f"measured_figure_{i}": NUMBER for i in range(kind.numbers)}},
            parameters={f"group_{i // 9}.parameter_number_{i}": i / 8 for i in range(kind.parameters)},
            inputs={f"input {i}": DIGEST for i in range(kind.inputs)}, started=STARTED, seconds=0.25, peak_mb=120.5, worker="host:1234",
            sizes={f"work/{kind.stage}/{UNIT}/1234567890123456/output{i}.json": 12345 for i in range(kind.outputs)},
        )  # fmt: skip
        text = encode(record)
        text = text[: text.rindex(b', "check"')] + b"}"
        self.kind, self.texts, self.slots = kind, SLOTS.split(text), SLOTS.findall(text)

    def line(self, number: int) -> Line:
        unit = f"b{number:08d}".encode()
        digits = shake_128(f"{self.kind.stage} {number}".encode()).hexdigest(32 * len(self.slots)).encode()
        parts, digest = [self.texts[0]], ""
        for i, (slot, text) in enumerate(zip(self.slots, self.texts[1:], strict=True)):
            found = digits[64 * i : 64 * i + 64]
            if slot == b"@unit@":
                parts.append(unit)
            elif slot == b"@digest@":
                digest = digest or found.decode()
                parts.append(found)
            else:
                parts.append(b"0.%d" % int(found[:9], 16))
            parts.append(text)
        text = b"".join(parts)
        sealed = text[:-1] + b', "check": "%s"}' % sha256(text).hexdigest()[:CHECK_DIGITS].encode()
        return Line(
            Row(self.kind.stage, unit.decode(), 1, Status.DONE, "", "good", 0.25, 120.5, 1777889472.345), digest, sealed
        )


def lines(buildings: int) -> Iterator[Line]:
    pieces = [Pieces(kind) for kind in KINDS]
    for number in range(buildings):
        yield from (p.line(number) for p in pieces if number % 5 < p.kind.every)


def make(store: Store, buildings: int, *, as_files: bool) -> None:
    every = lines(buildings)
    if as_files:
        for line in every:
            store.write_bytes(record_path(line.row.stage, line.row.unit, 1), line.text)
    else:
        while batch := list(islice(every, SEGMENT)):
            write_segment(store, batch)
    store.write_bytes(DESCRIPTION, b"{}\n")
    units = {k.stage: [f"b{n:08d}" for n in range(buildings) if n % 5 < k.every] for k in KINDS}
    total = {stage: len(found) for stage, found in units.items()}
    write_asked(
        store,
        Asked(
            "open",
            "open",
            dict.fromkeys(units, ALL),
            total,
            {},
            records=sum(total.values()),
            under=circumstances(store),
        ),
    )


def measure(url: str, what: str) -> dict[str, float]:
    """In a process of its own, so that its peak is that of this question."""
    store = Store.open(url)
    before = _resident_mb()
    begun, cpu = time.perf_counter(), time.process_time()
    with Ledger.open(store) as ledger:
        if what == "status":
            asked = read_asked(store, ledger)
            assert asked is not None
            standing_of(store, asked, ledger, url)
        elif what == "records":
            assert sum(1 for _ in ledger.records("reconstruct"))
        elif what == "held":
            held = list(ledger.records())
            assert held
        elif what == "join":
            while ledger.join():
                pass
        more = _resident_mb() - before
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    return {"seconds": time.perf_counter() - begun, "cpu_s": time.process_time() - cpu, "more_mb": more, "mb": peak}


def _resident_mb() -> float:
    return float(psutil.Process().memory_info().rss / 1e6)


def asked_in_a_process(url: str, what: str, environment: dict[str, str]) -> dict[str, float]:
    command = [sys.executable, __file__, "--measure", what, "--url", url]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, **environment})
    found: dict[str, float] = json.loads(done.stdout)
    return found


@contextmanager
def server() -> Iterator[None]:
    process = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-p", str(PORT)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        for _ in range(600):
            try:
                urlopen(ENDPOINT["AWS_ENDPOINT_URL"], timeout=1).close()
                break
            except OSError:
                time.sleep(0.1)
        os.environ.update(ENDPOINT)
        import boto3

        boto3.client("s3").create_bucket(Bucket="open")
        yield
    finally:
        process.kill()
        process.wait()


def table(buildings: int, questions: list[str], *, as_files: bool, on_s3: bool) -> None:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="open-run-")))
        environment = {"XDG_CACHE_HOME": str(folder / "cache")}
        if on_s3:
            stack.enter_context(server())
        url = "s3://open/run" if on_s3 else str(folder / "run")
        begun = time.perf_counter()
        make(Store.open(url), buildings, as_files=as_files)
        made_s = time.perf_counter() - begun
        where = f"{'files' if as_files else 'segments'}{' on S3' if on_s3 else ''}"
        size = sum(p.stat().st_size for p in folder.rglob("*") if p.is_file() and p.name != NOTE) / 1e6
        print(f"{buildings:,} buildings, {where}: made in {made_s:.0f} s, {size:,.0f} MB", flush=True)
        for what in questions:
            f = asked_in_a_process(url, what, environment)
            told = f"{f['seconds']:7.2f} s  CPU {f['cpu_s']:7.2f} s  {f['more_mb']:7.0f} MB more than before, peak {f['mb']:.0f} MB"
            print(f"  {what:<8} {told}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("buildings", nargs="*", type=int, default=[10_000, 100_000])
    parser.add_argument("--files", action="store_true")
    parser.add_argument("--s3", action="store_true")
    parser.add_argument("--ask", nargs="*", default=["cold", "warm", "status", "records"], help="also: held, join")
    parser.add_argument("--measure", default="")
    parser.add_argument("--url", default="")
    given: Any = parser.parse_args()
    if given.measure:
        print(json.dumps(measure(given.url, given.measure)))
        return
    for buildings in given.buildings:
        table(buildings, given.ask, as_files=given.files, on_s3=given.s3)


if __name__ == "__main__":
    main()
