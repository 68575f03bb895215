"""Two states of a city side by side: rows of the table of differences, and models as triangles in the frame of the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cityflow.core.building import Building, Lod, Polyhedron
from cityflow.evaluation.changes import Change
from cityflow.reporting.change_report import Comparison, change_row
from cityflow.reporting.view_frame import PageFrame
from cityflow.viewer.model_view import surfaces_of

Json = Any

JUDGED = "judged otherwise"
"""What became of a building whose model is the same within the limits of a change, but not what is said of it."""
TOLD = ("status", "verdict", "method")
PLACE_DIGITS = 3


def rows_of(
    found: Comparison, frame: PageFrame, before: Sequence[Mapping[str, Json]], after: Sequence[Mapping[str, Json]]
) -> list[dict[str, Json]]:
    """A row for each difference: new, gone and altered buildings, the surest first of each kind, then those that are only judged otherwise.

    Parameters
    ----------
    before, after : rows of the desk's list of both states; empty where nothing is known of one
    """
    was, now = ({row["id"]: row for row in rows} for rows in (before, after))
    ordered = sorted(found.changes.found, key=lambda c: (c.kind, -(c.figures.significance or 0.0), c.id))
    rows = [_changed(c, found.tiles, frame, was, now) for c in ordered]
    known = {name for row in rows for name in (row["id"], row["before"])}
    both = sorted((was.keys() & now.keys()) - known)
    return rows + [
        {"kind": JUDGED, "id": u, "before": u, "tile": now[u]["tile"], "what": what, "place": None, "size": None, **_told(was[u], now[u])}
        for u in both
        if (what := _otherwise(was[u], now[u]))
    ]  # fmt: skip


def _changed(
    change: Change, tiles: Mapping[str, str], frame: PageFrame, was: Mapping[str, Json], now: Mapping[str, Json]
) -> dict[str, Json]:
    row = asdict(change_row(change, tiles))
    del row["pictures"]
    figures, unit = row.pop("figures"), change.after or change.before
    assert unit is not None
    ring = np.asarray(unit.footprint.exterior.coords, np.float64)[:, :2]
    solid = None if unit.building is None else unit.building.solids.get(Lod.LOD22)
    top = 0.0 if solid is None else float(solid.vertices[:, 2].mean())
    size = float(np.hypot(*np.ptp(ring, axis=0)))
    place = frame.plan((ring.min(axis=0) + ring.max(axis=0)) / 2, top)[0]
    told = _told(was.get(row["before"]), now.get(row["id"]))
    return {**row, **figures, "place": place.round(2).tolist(), "size": round(size, 1), **told}


def _told(was: Mapping[str, Json] | None, now: Mapping[str, Json] | None) -> dict[str, Json]:
    """Status, verdict, method and NMAD, before and after."""
    return {key: [None if row is None else row[key] for row in (was, now)] for key in (*TOLD, "nmad")}


def _otherwise(was: Mapping[str, Json], now: Mapping[str, Json]) -> str:
    """What is said otherwise of a building, in words; empty where nothing is.

    >>> _otherwise({"status": "done", "verdict": "look", "method": "volumetric"}, {"status": "done", "verdict": "good", "method": "roof_types"})
    'verdict look → good, method volumetric → roof types'
    """
    return ", ".join(f"{key} {_word(was[key])} → {_word(now[key])}" for key in TOLD if was[key] != now[key])


def _word(value: str) -> str:
    return value.replace("_", " ") or "none"


def triangles_of(buildings: Iterable[Building], frame: PageFrame) -> list[dict[str, Json]]:
    """Of each building its id, corners of its triangles one after the other in the page's frame, and a colour (0 to 255) for each triangle."""
    return [made for b in buildings if (made := _triangles(b.id, _shells(b), frame))]


def _triangles(name: str, shells: Sequence[Polyhedron], frame: PageFrame) -> dict[str, Json] | None:
    found = surfaces_of(shells)
    if not len(found.corners):
        return None
    places = frame.local(found.corners.reshape(-1, 3))
    return {
        "id": name, "corners": places.round(PLACE_DIGITS).reshape(-1).tolist(), "colours": found.colours.astype(int).reshape(-1).tolist(),
    }  # fmt: skip


def _shells(building: Building) -> list[Polyhedron]:
    if Lod.LOD22 not in building.solids:
        return []
    return [building.solids[Lod.LOD22], *([building.beyond] if building.beyond is not None else [])]
