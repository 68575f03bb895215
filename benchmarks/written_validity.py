"""Every geometry that a run has exported, read back and held against the rules of ISO 19107.

    python benchmarks/written_validity.py RUN [RUN…] [--judge val3dity]

Reads `products/cityjson/*.city.jsonl`, `products/citygml/*.gml` and `products/obj/*.obj`.
With `--judge` the same CityJSON is given to val3dity (tudelft3d/val3dity), and what it finds is printed, too.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from cityflow.core.written_geometry import WrittenGeometry
from cityflow.evaluation.written import counted, faulty
from cityflow.io.city_models.cityjson_sequence import document
from cityflow.io.city_models.written_citygml import written_in_citygml
from cityflow.io.city_models.written_cityjson import written_in_cityjson
from cityflow.io.city_models.written_obj import written_in_obj


def geometries(run: Path, form: str) -> Iterator[WrittenGeometry]:
    if form == "CityJSON":
        for path in sorted((run / "products" / "cityjson").glob("*.city.jsonl")):
            yield from written_in_cityjson(path.read_bytes().splitlines())
        return
    if form == "OBJ":
        for path in sorted((run / "products" / "obj").glob("*.obj")):
            yield from written_in_obj(path.read_bytes().splitlines())
        return
    for path in sorted((run / "products" / "citygml").glob("*.gml")):
        with path.open("rb") as source:
            yield from written_in_citygml(source)


def judged(run: Path, judge: str) -> Counter[str]:
    """Geometries in which val3dity finds an error, by its code; one with several counts for each."""
    found: set[tuple[str, str, str]] = set()
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted((run / "products" / "cityjson").glob("*.city.jsonl")):
            plain, report = Path(folder) / f"{path.stem}.city.json", Path(folder) / "report.json"
            plain.write_bytes(document(path.read_bytes().splitlines()))
            subprocess.run([judge, str(plain), "-r", str(report)], check=True, capture_output=True)
            features = json.loads(report.read_bytes())["features"]
            found |= {
                (f["id"], str(e.get("id")).partition("|face")[0], f"{e['code']} {e['description']}")
                for f in features
                for e in f["errors"]
            }
    return Counter(what for _, _, what in found)


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("runs", type=Path, nargs="+")
    options.add_argument("--judge", default="")
    options.add_argument("--names", action="store_true", help="every geometry that breaks a rule, by its owner")
    chosen = options.parse_args()
    write = sys.stdout.write
    for run in chosen.runs:
        for form in ("CityJSON", "CityGML", "OBJ"):
            read = list(geometries(run, form))
            broken = faulty(read)
            owners = {f.geometry.owner for f in broken}
            polygons = sum(len(g.polygons) for g in read)
            write(
                f"{run} {form}: {len(read)} geometries, {polygons} polygons; {len(broken)} geometries of {len(owners)} objects break a rule\n"
            )
            for key, count in sorted(counted(broken).items()):
                write(f"  {count:5} {' '.join(key)}\n")
            for one in broken if chosen.names else ():
                write(
                    f"    {one.geometry.owner} {one.geometry.kind} {one.geometry.lod}: {'; '.join(map(str, one.faults[:6]))}\n"
                )
        if chosen.judge:
            write(
                f"{run} by val3dity:\n"
                + "".join(f"  {n:5} {what}\n" for what, n in sorted(judged(run, chosen.judge).items()))
            )


if __name__ == "__main__":
    main()
