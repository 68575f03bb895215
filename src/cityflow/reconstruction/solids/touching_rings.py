"""Outlines whose rings touch in a vertex, pulled apart by millimetres: four walls must not meet in one edge."""

from __future__ import annotations

import math

from cityflow.reconstruction.partition.subdivision import Subdivision

APART = 0.003
"""So far (m) the later of two touching vertices moves into its courtyard; readers join vertices nearer than 1 mm."""


def pulled_apart(division: Subdivision) -> dict[int, tuple[float, float]]:
    """New places of the outline's vertices that lie where an earlier one lies, away from the roofed side.

    A polygon may have holes that touch each other or the exterior in a vertex, and is still valid (OGC simple
    features); the walls on its rings would not be a 2-manifold (ISO 19107).
    """
    seen: set[tuple[float, float]] = set()
    twice = []
    for vertex in range(division.fixed):
        place = (round(division.xy[vertex][0], 3), round(division.xy[vertex][1], 3))
        if place in seen:
            twice.append(vertex)
        seen.add(place)
    if not twice:
        return {}
    border = [(u, v) for u, v in division.left if (v, u) not in division.left]
    after, before = dict(border), {v: u for u, v in border}
    return {v: _moved_out(division, before[v], v, after[v]) for v in twice if v in after and v in before}


def _moved_out(division: Subdivision, before: int, vertex: int, after: int) -> tuple[float, float]:
    """The vertex moved along the middle of the angle that is not roofed."""
    x, y = division.xy[vertex]
    to_before, to_after = (math.atan2(division.xy[v][1] - y, division.xy[v][0] - x) for v in (before, after))
    middle = to_before + ((to_after - to_before) % (2 * math.pi)) / 2
    return x + APART * math.cos(middle), y + APART * math.sin(middle)
