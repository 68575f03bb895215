"""How fast the point index is made, against laspy reading and writing the same file in the same run.

Replicates a LAZ file in x and y to the size asked for, then measures, each in a process of its own so that peak memory is its own:
`reference`: laspy reads the file in chunks and writes it again as one LAZ file of the same point format as the pieces;
`index`: `cityflow.io.points.point_index.split_file` into cells.

    python benchmarks/ingest.py --million 50 --cell 50
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import tempfile
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import laspy
import numpy as np

from cityflow.io.points.las import CHUNK_POINTS, stream_records
from cityflow.io.points.las_header import BACKEND
from cityflow.io.points.las_write import blank_header
from cityflow.io.points.point_index import split_file

SOURCE = Path(__file__).parents[1] / "catalogs" / "delft" / "data" / "ahn3_cropped_1.laz"


def replicate(source: Path, target: Path, points: int) -> int:
    """Copies of a file side by side in strips, as a survey would fly them, each moved by its own extent."""
    with laspy.open(source, laz_backend=BACKEND) as reader:
        header, records = reader.header, reader.read_points(-1)
    step = np.ceil((header.maxs - header.mins)[:2] / header.scales[:2]).astype(np.int64)
    copies = -(-points // len(records))
    columns = int(np.ceil(np.sqrt(copies * step[1] / step[0])))
    x, y = np.array(records.X), np.array(records.Y)
    with laspy.open(target, mode="w", header=header, laz_backend=BACKEND, do_compress=True) as writer:
        for k in range(copies):
            records.X, records.Y = x + (k % columns) * step[0], y + (k // columns) * step[1]
            writer.write_points(records)
    return copies * len(records)


def reference(path: Path, folder: Path) -> int:
    """Plain laspy, in chunks of the same size."""
    total = 0
    with laspy.open(path, laz_backend=BACKEND) as reader:
        head = blank_header(tuple(reader.header.scales), tuple(reader.header.offsets), date(2000, 1, 1))
    with laspy.open(folder / "copy.laz", mode="w", header=head, laz_backend=BACKEND, do_compress=True) as writer:
        for records in stream_records(path, CHUNK_POINTS):
            same = laspy.ScaleAwarePointRecord.zeros(len(records), header=head)
            for name in ("X", "Y", "Z", "classification", "return_number", "number_of_returns"):
                same[name] = np.asarray(records[name])
            writer.write_points(same)
            total += len(records)
    return total


def index(path: Path, folder: Path, cell_m: float) -> int:
    """One piece per cell, written to a folder."""
    return split_file(path, cell_m, lambda cell, data: (folder / f"{cell}.laz").write_bytes(data)).points


def measured(task: Callable[..., int], *arguments: Any) -> dict[str, float]:
    """Seconds, points and peak MB of a function in a fresh process."""
    context = multiprocessing.get_context("spawn")
    queue: Any = context.SimpleQueue()
    process = context.Process(target=_measure, args=(queue, task, arguments))
    process.start()
    result: dict[str, float] = queue.get()
    process.join()
    return result


def _measure(queue: Any, task: Callable[..., int], arguments: tuple[Any, ...]) -> None:
    start, busy = time.perf_counter(), time.process_time()
    points = task(*arguments)
    seconds, busy = time.perf_counter() - start, time.process_time() - busy
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    speed = {"mpts_per_s": points / seconds / 1e6, "mpts_per_cpu_s": points / busy / 1e6}
    queue.put({"points": points, "seconds": seconds, "cpu_seconds": busy, **speed, "peak_mb": peak})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--million", type=float, default=50)
    parser.add_argument("--cell", type=float, default=50.0)
    parser.add_argument("--source", type=Path, default=SOURCE)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        big = Path(folder) / "big.laz"
        points = replicate(chosen.source, big, int(chosen.million * 1e6))
        print(f"{points:,} points, {big.stat().st_size / 1e6:.0f} MB")
        (pieces := Path(folder) / "pieces").mkdir()
        plain = measured(reference, big, Path(folder))
        ours = measured(index, big, pieces, chosen.cell)
        count = sum(1 for _ in pieces.iterdir())
        size = sum(p.stat().st_size for p in pieces.iterdir())
    ours["pieces"], ours["pieces_mb"] = count, size / 1e6
    ratios = {f"ratio_{key}": ours[key] / plain[key] for key in ("mpts_per_s", "mpts_per_cpu_s")}
    print(json.dumps({"reference": plain, "index": ours, **ratios}, indent=2))


if __name__ == "__main__":
    main()
