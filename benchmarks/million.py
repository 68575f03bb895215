"""A RUN of about a million buildings with records of every stage: what its opening and `status` without a note cost, in a folder and on an object store.

    python benchmarks/million.py make RUN [--side 50] [--last 16]
    python benchmarks/million.py ask RUN
    python benchmarks/million.py s3 RUN

A square town as in `city_scale.py` of ``side`` ground tiles along each edge, 400 buildings a tile, flown by smaller frames: 50 tiles have 29,941
images. ``make`` writes the records of all tiles but the last (a square of ``last`` tiles at the north-eastern corner), joined in segments as a
driver leaves them: of each stage a true record with the name of its unit; digests and figures are drawn at random. ``ask`` asks the RUN as
commands do, each question in a process of its own. ``s3`` copies it to an object store of this machine (moto's server), and asks there. With
16 last tiles the RUN has 897,600 buildings and 3.8 GB.
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
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import shapely

import city_driver
import city_scale
from city_scale import TILE_M, X, Y, survey
from cityflow.core.grid import Bounds
from cityflow.flow.ledger import SEGMENT, Ledger
from cityflow.flow.record_segments import write_segment
from cityflow.flow.records import CHECK_DIGITS, encode
from cityflow.flow.row import Line, Row, row_of
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import DESCRIPTION, describe_run
from cityflow.runs.settings import Workflow
from cityflow.survey.area import Area
from cityflow.workflow.last_request import LAST
from cityflow.workflow.recorded import recorded
from cityflow.workflow.status import standing_of
from open_run import ENDPOINT, server
from rerun_one import answered

FRAME_PX = 7_200, 5_000
DIGEST, NUMBER = (
    re.compile(rb"[0-9a-f]{64}|(?<=/)[0-9a-f]{16}(?=/)"),
    re.compile(rb"(?<=: )0\.\d{16,17}|(?<=: )\d\.\d{15,16}"),
)
DRAWN = 1 << 23
HEXADECIMAL, DECIMAL = (
    np.frombuffer(digits, np.uint8)[np.random.default_rng(seed).integers(0, len(digits), DRAWN, np.uint8)]
    for seed, digits in enumerate((b"0123456789abcdef", b"0123456789"))
)
"""Digits at random, of which digests and figures are pieces."""
OF_BUILDINGS = ("split", "reconstruct", "texture", "windows")
OF_TILES = ("fuse", "surface", "walls", "ortho", "outline", "units")
CELLS = 4
"""Atlas cells along the edge of a tile."""
IMAGES_A_TILE, FRAMES_A_TILE = 12, 4


@dataclass(frozen=True)
class Town:
    """Ground tiles along an edge, and along the edge of the square of the last ones."""

    side: int
    last: int

    @property
    def box(self) -> Bounds:
        return X, Y, X + self.side * TILE_M, Y + self.side * TILE_M

    def prepared(self, folder: str) -> Prepared:
        city_scale.FLIGHT = city_scale.FLIGHT.model_copy(update={"width_px": FRAME_PX[0], "height_px": FRAME_PX[1]})
        return Prepared(Workflow(name="city"), survey(self.box), Area(shapely.box(*self.box)), Store.open(folder))

    def tiles(self) -> Iterator[tuple[int, int]]:
        """Column and row of those that are not among the last."""
        first_col, first_row, begin = round(X / TILE_M), round(Y / TILE_M), self.side - self.last
        for row in range(self.side):
            for col in range(self.side):
                if min(col, row) < begin:
                    yield first_col + col, first_row + row


class Template:
    """The text of a record as bytes, and where its unit, its digests and its figures stand in it."""

    def __init__(self, record: Record, unit: str) -> None:
        text = encode(record)
        text = text[: text.rindex(b', "check"')].replace(record.unit.encode(), unit.encode())
        self.row = row_of(record)
        self._text = np.frombuffer(text, np.uint8)
        self._unit = np.array([m.start() for m in re.finditer(re.escape(unit.encode()), text)])
        self._digest_at = text.index(b'"digest": "') + 11
        self._slots = [(*m.span(), HEXADECIMAL) for m in DIGEST.finditer(text)]
        self._slots += [(m.start() + 2, m.end(), DECIMAL) for m in NUMBER.finditer(text)]
        self._unit_bytes = len(unit)

    def lines(self, units: list[str], random: np.random.Generator) -> Iterator[Line]:
        """Records of units whose names are as long as the template's."""
        rows = np.tile(self._text, (len(units), 1))
        names = np.array([list(u.encode()) for u in units], np.uint8)
        assert names.shape[1] == self._unit_bytes
        begins = random.integers(0, DRAWN - 64 * len(units), len(self._slots)).tolist()
        for (start, stop, digits), begin in zip(self._slots, begins, strict=True):
            size = stop - start
            rows[:, start:stop] = digits[begin : begin + size * len(units)].reshape(-1, size)
        for start in self._unit.tolist():
            rows[:, start : start + self._unit_bytes] = names
        for unit, values in zip(units, rows, strict=True):
            body = values.tobytes()
            check = sha256(body + b"}").hexdigest()[:CHECK_DIGITS].encode()
            digest = body[self._digest_at : self._digest_at + 64].decode()
            yield Line(Row(self.row.stage, unit, *self.row[2:]), digest, body + b', "check": "%s"}' % check)


def true_records() -> dict[str, Record]:
    """A record of each stage, with results of true size, of a town of one tile."""
    box = (X, Y, X + TILE_M, Y + TILE_M)
    source, found = CitySource(survey(box), Workflow(name="city").city, Area(shapely.box(*box))), dict[str, Record]()
    for record in answered(source):
        found[record.stage] = city_driver.true_size(record)
    return found


def make(town: Town, folder: str) -> None:
    """Description and segments."""
    records, wanted = true_records(), town.prepared(folder)
    describe_run(wanted)
    random, templates, waiting, written = np.random.default_rng(17), dict[str, Template](), list[Line](), list[int]()
    for number, tile in enumerate(town.tiles()):
        for stage, units in units_of(number, *tile).items():
            if stage not in templates:
                templates[stage] = Template(records[stage], units[0])
            waiting += templates[stage].lines(units, random)
        while len(waiting) >= SEGMENT:
            written += [len(line.text) for line in waiting[:SEGMENT]]
            write_segment(wanted.store, waiting[:SEGMENT])
            del waiting[:SEGMENT]
    # what ends a run
    waiting += Template(replace(records["export"], unit=LAST[1]), LAST[1]).lines([LAST[1]], random)
    if waiting:
        written += [len(line.text) for line in waiting]
        write_segment(wanted.store, waiting)
    size = sum(p.stat().st_size for p in Path(folder).rglob("segments/*")) / 1e6
    print(
        f"{len(written):,} records of {sum(written) / 1e6:,.0f} MB, {size:,.0f} MB in segments; {time.process_time():.0f} s of processor time"
    )


def units_of(number: int, col: int, row: int) -> dict[str, list[str]]:
    """Stage → names of the units that a tile brings with it, in the order in which they end."""
    tile, step, n = f"{col}_{row}", TILE_M / city_scale.OUTLINES_A_SIDE, city_scale.OUTLINES_A_SIDE
    houses = [
        f"{round(col * TILE_M + (k % n + 0.5) * step)}_{round(row * TILE_M + (k // n + 0.5) * step)}"
        for k in range(n * n)
    ]
    images = [f"image{IMAGES_A_TILE * number + k:08d}" for k in range(IMAGES_A_TILE)]
    frames = [f"frame{k}.{tile}" for k in range(FRAMES_A_TILE)]
    cells = [f"{tile}.{k % CELLS}_{k // CELLS}" for k in range(CELLS**2)]
    found = {"ingest": images, "match": images, **{stage: [tile] for stage in OF_TILES}, "frame": frames}
    return {**found, **dict.fromkeys(OF_BUILDINGS, houses), "atlas": cells, "export": [tile]}


def ask(url: str, what: str) -> dict[str, float]:
    """One question, in this process; seconds on the clock, of processor time, and MB."""
    store = Store.open(url)
    begun, cpu = time.perf_counter(), time.process_time()
    with Ledger.open(store) as ledger:
        if what == "status":
            standing_of(store, recorded(url, ledger), ledger, url)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    return {"seconds": time.perf_counter() - begun, "cpu": time.process_time() - cpu, "mb": peak}


def asked_apart(url: str, environment: Mapping[str, str]) -> None:
    for what in ("opening", "opening", "status"):
        command = [sys.executable, __file__, what, url]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env={**os.environ, **environment})
        f = json.loads(done.stdout)
        print(f"  {what:<8} {f['seconds']:7.2f} s  CPU {f['cpu']:7.2f} s  peak {f['mb']:.0f} MB", flush=True)


def on_s3(folder: str) -> None:
    """Opened where no copy of it is, and again."""
    import boto3

    with tempfile.TemporaryDirectory(prefix="million-") as copies, server():
        client = boto3.client("s3", endpoint_url=ENDPOINT["AWS_ENDPOINT_URL"])
        every = [Path(folder) / DESCRIPTION, *sorted(Path(folder).rglob("segments/*"))]
        for path in every:
            client.put_object(Bucket="open", Key=f"run/{path.relative_to(folder)}", Body=path.read_bytes())
        print(f"{len(every):,} files on the store", flush=True)
        asked_apart("s3://open/run", {"XDG_CACHE_HOME": copies})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "step", choices=["make", "ask", "s3", "opening", "status"], help="the last two: one question, in this process"
    )
    parser.add_argument("run")
    parser.add_argument("--side", type=int, default=50)
    parser.add_argument("--last", type=int, default=16)
    given: Any = parser.parse_args()
    if given.step == "make":
        make(Town(given.side, given.last), given.run)
    elif given.step == "ask":
        asked_apart(given.run, {})
    elif given.step == "s3":
        on_s3(given.run)
    else:
        print(json.dumps(ask(given.run, given.step)))


if __name__ == "__main__":
    main()
