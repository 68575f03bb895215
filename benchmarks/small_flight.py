"""A whole run of the fifteen pictures of ``tests/data/flight``, with frames: processor time of each stage, and whether any byte differs.

    python benchmarks/small_flight.py RUN                   # a new folder; prints the seconds of each stage
    python benchmarks/small_flight.py RUN --like FORMER     # and the files that differ from those of an earlier RUN, of another version of the program

One task after the other in this process, without the engine (``run_here.py``). Files are compared by stage, unit and name: where the digests of
tasks differ, the folders under ``work/`` have other names.
"""

from __future__ import annotations

import argparse
import hashlib
import re
from pathlib import Path

from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from run_here import run_here
from step_times import StepTimes, share_table

ROOT = Path(__file__).parents[1]
FLIGHT = ROOT / "tests" / "data" / "flight"
WORKFLOW = ROOT / "workflows" / "oblique_city.yaml"
ORIGIN = (85050.0, 447025.0, 0.0)
SETTINGS = ("tiles.tile_m=50",)
COMPARED = ("work", "products", "surface.zarr")
TASK = re.compile(r"(work/[^/]+/[^/]+)/[0-9a-f]{16}/")


def catalog_of(folder: Path) -> Path:
    """The catalog of the flight beside the run, made where there is none."""
    out = folder / "catalog"
    if not out.exists():
        source = ImageSource(FLIGHT / "images", {"colmap": FLIGHT / "sparse"}, origin=ORIGIN)
        create_catalog(
            out, SurveyFiles(images=source), crs="EPSG:7415", text=SurveyText(title="flight", date="2026-06-21")
        )
    return out


def contents(run: Path) -> dict[str, str]:
    """File of a RUN, without the digest of its task → digest of what it holds."""
    files = (p for part in COMPARED for p in sorted((run / part).rglob("*")) if p.is_file())
    return {TASK.sub(r"\1/", p.relative_to(run).as_posix()): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def differences(run: Path, former: Path) -> list[str]:
    """What is not the same in both."""
    new, old = contents(run), contents(former)
    return [f"{n}: {_word(n, new, old)}" for n in sorted(new.keys() | old.keys()) if new.get(n) != old.get(n)]


def _word(name: str, new: dict[str, str], old: dict[str, str]) -> str:
    return "new" if name not in old else "gone" if name not in new else "differs"


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("run", type=Path)
    options.add_argument("--like", type=Path, default=None, help="a RUN of before")
    options.add_argument("--set", action="append", default=[], help="of the workflow")
    o = options.parse_args()
    times = StepTimes()
    catalog = catalog_of(o.run.parent)
    with times.watched():
        _, cost = run_here(WORKFLOW, str(catalog), o.run, [*SETTINGS, *o.set], "", times)
    print(*share_table(times, sum(c.seconds for c in cost.stages.values()), "of the run"), sep="\n")
    for name, c in cost.stages.items():
        print(
            f"{name:<14} {c.tasks:>4} tasks {c.failed:>3} failed {c.seconds:>8.2f} s {c.compiling:>6.1f} s compiling {sorted(set(c.compiled)) or ''}"
        )
    if o.like is not None:
        found = differences(o.run, o.like)
        print(*found, f"{len(contents(o.run))} files, {len(found)} of them differ", sep="\n")


if __name__ == "__main__":
    main()
