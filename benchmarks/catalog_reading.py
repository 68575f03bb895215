"""Reading files for a catalog: files a second in this process, on one and on two workers, and with what was kept.

    python benchmarks/catalog_reading.py [--images 60] [--lidar 60] [--folder DIR]

Images are JPEGs of 12 megapixels (noise, 5 MB), LiDAR files copies of Delft's (2.9 MB, 0.64 million points). "Images" and "LiDAR files" are
digest and header, of LiDAR a sample of the points, too; "colours" is what the balance of exposures takes: each image decoded at an eighth and
looked up at 400 points. Processor time is that of the workers (or of this process), and beside it that of driver and scheduler, which share
this process.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from cityflow.catalog.colour_reading import COLOURS, ColourJob
from cityflow.catalog.file_questions import Question, Reading
from cityflow.catalog.file_reading import IMAGE_FILES, LIDAR_FILES
from cityflow.catalog.kept_answers import KeptAnswers
from cityflow.core.camera import Camera, OrientedImage
from cityflow.flow.spread import Spread
from cityflow.imagery.colour_samples import SampleParameters

DELFT = Path(__file__).parents[1] / "catalogs" / "delft" / "data" / "ahn3_cropped_1.laz"
WIDTH, HEIGHT, POINTS = 4000, 3000, 400


def photographs(folder: Path, count: int) -> list[str]:
    rng = np.random.default_rng(1)
    coarse = Image.fromarray(rng.integers(40, 215, (HEIGHT // 4, WIDTH // 4, 3), np.uint8)).resize((WIDTH, HEIGHT))
    coarse.save(folder / "0.jpg", quality=88)
    copies = [shutil.copy(folder / "0.jpg", folder / f"{k}.jpg") for k in range(1, count)]
    return [str(path) for path in (folder / "0.jpg", *copies)]


def jobs_of(paths: Sequence[str]) -> list[ColourJob]:
    xyz = np.column_stack([np.random.default_rng(2).uniform(-40, 40, (POINTS, 2)), np.zeros(POINTS)])
    camera = Camera(WIDTH, HEIGHT, 4000.0, 4000.0, WIDTH / 2, HEIGHT / 2)
    down = OrientedImage("i", camera, np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 100.0]))
    return [ColourJob(p, down, xyz, SampleParameters()) for p in paths]


def measure(name: str, question: Question[Any, Any], jobs: list[Any], reading: Reading, how: str) -> None:
    client = reading.spread.cluster(is_long=False)
    before, own = _of_workers(client), time.process_time()
    start = time.perf_counter()
    answers = reading.answers(question, jobs, len(jobs))
    wall, own = time.perf_counter() - start, time.process_time() - own
    assert not any(isinstance(a, Exception) for a in answers)
    working = _of_workers(client) - before if client is not None else own
    print(
        f"| {name} | {how} | {len(jobs) / wall:.1f} | {1000 * working / len(jobs):.1f} | "
        f"{1000 * own / len(jobs) if client is not None else 0:.1f} |",
        flush=True,
    )


def _of_workers(client: Any) -> float:
    return sum(client.run(time.process_time).values()) if client is not None else 0.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--images", type=int, default=60)
    parser.add_argument("--lidar", type=int, default=60)
    parser.add_argument("--folder", type=Path)
    asked = parser.parse_args()
    folder = Path(tempfile.mkdtemp(dir=asked.folder))
    images = photographs(folder, asked.images)
    lidar = [str(shutil.copy(DELFT, folder / f"{k}.laz")) for k in range(asked.lidar)]
    work = (("LiDAR files", LIDAR_FILES, lidar), ("images", IMAGE_FILES, images), ("colours", COLOURS, jobs_of(images)))
    print(
        "| what | where | files a second, wall | processor ms a file | driver and scheduler, ms a file |\n|---|---|---|---|---|"
    )
    for how, spread in (("this process", Spread()), ("1 worker", Spread()), ("2 workers", Spread())):
        with spread:
            if how != "this process":
                spread.start(int(how[0]))  # before the clock runs
            for name, question, jobs in work:
                measure(name, question, list(jobs), Reading(spread), how)
    with KeptAnswers(folder / "kept") as kept:
        for how in ("this process, keeping", "kept before"):
            for name, question, jobs in work:
                measure(name, question, list(jobs), Reading(kept=kept), how)
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
