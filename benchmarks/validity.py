"""Validity of a solid: time per call, against manifold3d's construction of the same triangles as the reference.

Run: python benchmarks/validity.py
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import manifold3d
import numpy as np

from cityflow.core.building import Polyhedron
from cityflow.geometry.polygon_overlap import overlap_volume
from cityflow.geometry.polyhedron import Mesh, triangulate
from cityflow.geometry.validity import check_polyhedron

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from geometry_shapes import SQUARE, extrude, gable, noded, tower_on_roof


def comb(teeth: int) -> Polyhedron:
    """A block with a toothed outline: 4 · teeth + 4 faces, concave floor and roof."""
    plan = [(0.0, -5.0), (2.0 * teeth, -5.0)]
    for i in reversed(range(teeth)):
        plan += [(2.0 * i + 2, 0.0), (2.0 * i + 2, 3.0), (2.0 * i + 1, 3.0), (2.0 * i + 1, 0.0)]
    return extrude([[*plan, (0.0, 0.0)]], 0, 8)


def median_ms(call: Callable[[], object], rounds: int = 30) -> float:
    call()
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return 1000 * float(np.median(times))


def boolean(one: Mesh, two: Mesh) -> float:
    parts = [manifold3d.Manifold(manifold3d.Mesh64(m.vertices, m.triangles.astype(np.uint64))) for m in (one, two)]
    return float((parts[0] ^ parts[1]).volume())


def main() -> None:
    solids = {"gable": gable(), "tower": noded(tower_on_roof(), 2), "comb 20": comb(20), "comb 75": comb(75)}
    write = sys.stdout.write
    write(f"{'solid':10}{'faces':>7}{'vertices':>10}{'check ms':>10}{'overlap ms':>12}{'Boolean ms':>12}{'ratio':>7}\n")
    for name, solid in solids.items():
        other = extrude([SQUARE], 1, 6)
        check = median_ms(lambda s=solid: check_polyhedron(s))  # type: ignore[misc]
        ours = median_ms(lambda s=solid, o=other: overlap_volume(s, o))  # type: ignore[misc]
        theirs = median_ms(lambda s=solid, o=other: boolean(triangulate(s), triangulate(o)))  # type: ignore[misc]
        sizes = f"{len(solid.faces):7}{len(solid.vertices):10}"
        write(f"{name:10}{sizes}{check:10.2f}{ours:12.2f}{theirs:12.2f}{theirs / ours:7.1f}\n")


if __name__ == "__main__":
    main()
