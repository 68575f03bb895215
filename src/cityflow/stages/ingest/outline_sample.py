"""Sample of outlines for the accuracy of all given ones: some of those in the LiDAR file that contains most of them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

from cityflow.core.grid import Bounds, grown
from cityflow.handover.outline_lines import Standing, lines
from cityflow.outlines.under_eaves.facades_inside import LARGEST_M, NEAR_M

SAMPLE = "sample.jsonl"
MOST = 400
"""So many outlines tell enough; set by hand."""


def sampled(standings: Sequence[Standing], files: Mapping[str, Bounds]) -> tuple[str, bytes]:
    """The file that most outlines stand in, and lines of some of these, by a hash of their names; empty where there is none."""
    near = {s.outline.id: grown(s.outline.polygon.bounds, NEAR_M) for s in standings}
    inside = {
        name: [s for s in standings if _fits(near[s.outline.id], bounds)] for name, bounds in sorted(files.items())
    }
    name = min(inside, key=lambda n: (-len(inside[n]), n), default="")
    if not name or not inside[name]:
        return "", b""
    chosen = sorted(inside[name], key=lambda s: hashlib.sha256(s.outline.id.encode()).hexdigest())[:MOST]
    return name, lines(chosen)


def _fits(inner: Bounds, outer: Bounds) -> bool:
    narrow = max(inner[2] - inner[0], inner[3] - inner[1]) <= LARGEST_M
    return narrow and inner[0] >= outer[0] and inner[1] >= outer[1] and inner[2] <= outer[2] and inner[3] <= outer[3]
