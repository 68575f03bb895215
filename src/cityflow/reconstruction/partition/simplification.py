"""Merges roof polygons whose description costs more than they explain.

A polygon has to be described: three numbers of its plane, and the lines that bound it. Intersections follow from the planes; a step is a line
of its own. A number known to some two hundred steps takes five nats or six, and a point off every plane costs 4.5 (`plane_labels.OUTLIER`);
as neighbours err alike, two of them count for little more than one: so a number is worth two or three points.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.ring_tracing import Edge, ring_edges

PLANE_NUMBERS = 3
"""Height and two slopes."""
SAME_LINE_M = 0.05
"""Edges so near to one line lie on it; set by hand."""


class CellEnergy(Protocol):
    """What planes cost in cells, and along edges."""

    def costs(self, division: Subdivision, numbers: list[int]) -> tuple[FloatArray, IntArray]: ...

    def border_cost(self, division: Subdivision, edge: Edge, planes: tuple[int, int]) -> float: ...

    def is_step(self, division: Subdivision, edge: Edge, planes: tuple[int, int]) -> bool: ...


def without_worthless(
    division: Subdivision, labels: Mapping[int, int], energy: CellEnergy, number_cost: float
) -> dict[int, int]:
    """Labels after every polygon that a neighbour's plane may replace at less cost has joined it, the greatest saving first.

    Parameters
    ----------
    division : cells that are polygons already: neighbours differ in their labels
    labels : plane of each cell
    number_cost : m² of unexplained roof that each number of a description must save, beyond the cost of edges
    """
    labels = dict(labels)
    known: dict[int, tuple[float, int]] = {}
    while len(division.cells) > 1:
        new = [n for n in division.cells if n not in known]
        cost, _ = energy.costs(division, new)
        for k, number in enumerate(new):
            known[number] = _best_move(division, labels, energy, number, cost[k], number_cost)
        worst = min(known, key=lambda n: (-known[n][0], n))
        if known[worst][0] <= 0:
            break
        near = set(division.neighbours(worst))
        near |= {m for n in near for m in division.neighbours(n)}
        labels = division.merge({**labels, worst: known[worst][1]})
        known = {n: move for n, move in known.items() if n in division.cells and n not in near}
    return labels


def _best_move(
    division: Subdivision,
    labels: Mapping[int, int],
    energy: CellEnergy,
    number: int,
    cost: FloatArray,
    number_cost: float,
) -> tuple[float, int]:
    """What the best change of a polygon's plane to a neighbour's saves, and that plane."""
    mine = labels[number]
    edges = [edge for ring in division.cells[number] for edge in ring_edges(ring)]
    across = [(e, other) for e in edges if (other := division.left.get(e[::-1])) is not None]
    borders = [(e, labels[other]) for e, other in across]
    now = _description(division, energy, borders, mine, number_cost)
    best = (-1.0, mine)
    for label in sorted({other for _, other in borders} - {mine}):
        joined = {other for _, other in across if labels[other] == label}
        then = _description(division, energy, borders, label, number_cost)
        saving = PLANE_NUMBERS * number_cost * len(joined) + float(cost[mine] - cost[label]) + now - then
        best = max(best, (saving, label), key=lambda move: (move[0], -move[1]))
    return best


def _description(
    division: Subdivision, energy: CellEnergy, borders: list[tuple[Edge, int]], plane: int, number_cost: float
) -> float:
    """Cost (m²) of a polygon's edges if it had this plane: their lengths, and a number for each straight step."""
    total, lines = 0.0, []
    for edge, other in borders:
        if other == plane:
            continue
        total += energy.border_cost(division, edge, (plane, other))
        if energy.is_step(division, edge, (plane, other)):
            lines.append(edge)
    return total + number_cost * _straight_runs(division, lines)


def _straight_runs(division: Subdivision, edges: list[Edge]) -> int:
    """Number of different lines that edges lie on, those within `SAME_LINE_M` of an earlier one not counted."""
    lines: list[tuple[float, float, float]] = []
    for u, v in edges:
        (x1, y1), (x2, y2) = division.xy[u], division.xy[v]
        length = max(division.length((u, v)), 1e-9)
        nx, ny = (y1 - y2) / length, (x2 - x1) / length
        if all(max(abs(a * x + b * y - c) for x, y in ((x1, y1), (x2, y2))) > SAME_LINE_M for a, b, c in lines):
            lines.append((nx, ny, nx * x1 + ny * y1))
    return len(lines)
