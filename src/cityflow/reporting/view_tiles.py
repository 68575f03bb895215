"""Files of the page that tell of the buildings of each ground tile, and the small index over them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict
from cityflow.flow.records import quoted
from cityflow.flow.store import Store
from cityflow.flow.task import digest_of
from cityflow.reporting import view_cuts, view_layers, view_units
from cityflow.reporting.tile_rows import NO_TILE, TileRows, attempts_of
from cityflow.reporting.unit_pages import page_path
from cityflow.reporting.view_frame import PageFrame
from cityflow.reporting.view_kept import Files, Kept, json_bytes
from cityflow.runs.current import CurrentRecords
from cityflow.stages import export, outline, reconstruct, split, texture, units
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.unit_figures import verdicts_of
from cityflow.viewer.view_page import DATA

Json = Any
VERSION = 2
ROOF_M = 6.0
"""Above the ground, where no roof is known."""
INDEX, TABLES, UNITS, IDS = f"{DATA}/index.json", f"{DATA}/index", f"{DATA}/units", f"{DATA}/ids"
STATES, VERDICTS = [str(s) for s in Status], [v.value for v in Verdict]
FIELDS = ("name", "units", *STATES, *VERDICTS, "cuts", "failures", "box")


@dataclass(frozen=True)
class ViewTiles:
    """Buildings by their tiles, and what is asked of each: `atlas_cells` by unit; `pages` are those that the report has; `surface` is what cut lines lie on."""

    store: Store
    records: CurrentRecords
    rows: TileRows
    frame: PageFrame
    atlas_cells: Mapping[str, str]
    pages: Set[str]
    surface: view_cuts.Surface

    def files(self, kept: Kept) -> Files:
        """Table and figures of every tile, the sorted ids of all, the index; returns what is known of each tile, by its name."""
        found: dict[str, Json] = {}
        for tile, ground in self._ordered(found):
            paths = f"{TABLES}/{quoted(tile)}.json", f"{UNITS}/{quoted(tile)}.json"
            found[tile] = yield from kept.or_made(paths, self._digest(tile, ground), partial(self._made, tile, ground))
        entries = dict(sorted(found.items()))
        first = []
        for number, (key, rows) in enumerate(view_units.id_parts(self._shown(entries))):
            yield f"{IDS}/{number}.json", json_bytes(rows)
            first.append(key)
        yield INDEX, json_bytes(_index(entries, first))
        return entries

    def _ordered(self, found: Mapping[str, Json]) -> Iterator[tuple[str, float | None]]:
        """Tiles, first those with a model, which know their ground; the others stand on the median of these."""
        made = self._attempts[reconstruct.NAME]
        bare = []
        for tile, ids in self.rows.ids.items():
            if any(unit in made and made[unit][1] for unit in ids):
                yield tile, None
            else:
                bare.append(tile)
        ground = float(np.median([one["ground"] for one in found.values()])) if found else 0.0
        yield from ((tile, ground) for tile in bare)

    def _shown(self, entries: Mapping[str, Json]) -> Mapping[str, Iterable[str]]:
        """Tile → its buildings that are polygons."""
        return {t: [u for u in self.rows.ids[t] if u not in s["without"]] for t, s in entries.items()}

    @cached_property
    def _attempts(self) -> dict[str, dict[str, tuple[int, bool]]]:
        stages = (reconstruct.NAME, texture.NAME, split.NAME, export.NAME, units.NAME, outline.NAME)
        return {stage: attempts_of(self.records, stage) for stage in stages}

    def _digest(self, tile: str, ground: float | None) -> str:
        """Of all that the files of a tile are made from."""
        ids = self.rows.ids[tile]
        of_tile = {stage: self._attempts[stage].get(tile) for stage in (export.NAME, units.NAME, outline.NAME)}
        of_units = {
            stage: [self._attempts[stage].get(unit) for unit in ids] for stage in (reconstruct.NAME, texture.NAME)
        }
        cuts = [(unit, self._attempts[split.NAME][unit]) for unit in self._outlines(tile)]
        beside = [[self.atlas_cells.get(unit), page_path(unit) in self.pages] for unit in ids]
        return digest_of([VERSION, list(ids), of_tile, of_units, cuts, beside, ground])

    def _outlines(self, tile: str) -> list[str]:
        """Outlines of a tile that were split, or not, by a task."""
        known = self._attempts[split.NAME]
        if not known or tile == NO_TILE:
            return []
        found = (r for r in self.records.some(outline.NAME, [tile]))
        return sorted(e["id"] for r in found for e in r.result.get("units", []) if e["id"] in known)

    def _made(self, tile: str, ground: float | None) -> tuple[tuple[bytes, bytes], Json]:
        rows = sorted(self.rows.rows(tile), key=lambda u: u.id)
        base = _ground(rows) if ground is None else ground
        heights = view_units.heights_of(rows, base)
        table = view_units.table_of(rows, tile, self.frame, heights)
        failures = view_layers.failures(rows, base, self.frame)
        cuts = self._cuts(tile, rows, heights, base)
        known = view_units.known_units(rows, self.records, self.atlas_cells, self.pages)
        content = json_bytes({**table, "failures": failures, "cuts": cuts}), json_bytes(known)
        drawn = [heights[u.id] for u in rows if u.rings]
        return content, {
            "status": Counter(str(u.status) for u in rows), "verdicts": verdicts_of(rows),
            "box": _box(rows, self.frame, heights), "ground": base, "heights": [min(p[0] for p in drawn), max(p[1] for p in drawn)] if drawn else None,
            "ends": view_units.ends_of(table["rows"]), "cuts": len(cuts["rows"]), "failures": len(failures),
            "without": [u.id for u in rows if not u.rings],
        }  # fmt: skip

    def _cuts(
        self, tile: str, rows: Sequence[UnitRow], heights: Mapping[str, tuple[float, float]], ground: float
    ) -> Json:
        made = self.records.some(split.NAME, self._outlines(tile))
        roofs = view_cuts.Roofs(view_cuts.Ridges.of(rows, heights), ground + ROOF_M, self.surface)
        return view_cuts.cut_lines(self.store, made, roofs, self.frame)


def _index(entries: Mapping[str, Json], first: Sequence[str]) -> Json:
    """What the page reads at its beginning, whatever the city's size: where tiles are, and how their buildings ended."""
    rows = [
        [tile, sum(s["status"].values()), *(s["status"].get(k, 0) for k in STATES), *(s["verdicts"].get(k, 0) for k in VERDICTS),
         s["cuts"], s["failures"], s["box"]]
        for tile, s in entries.items()
    ]  # fmt: skip
    return {
        "fields": FIELDS,
        "rows": rows,
        "ids": first,
        "ends": view_units.farthest([s["ends"] for s in entries.values()]),
    }


def totals(entries: Mapping[str, Json], key: str) -> Counter[str]:
    """Buildings of all tiles by `status` or `verdicts`."""
    found = Counter[str]()
    for one in entries.values():
        found.update(one[key])
    return found


def whole_box(entries: Mapping[str, Json], box: Callable[[], list[float]], margin: float) -> list[float]:
    """Lower and upper corner of all buildings in the page's frame, with a margin in plan; `box` where there are none."""
    known = np.array([s["box"] for s in entries.values() if s["box"]] or [box()])
    low, high = known[:, :3].min(axis=0), known[:, 3:].max(axis=0)
    low[:2] -= margin
    high[:2] += margin
    return [round(float(v), 2) for v in (*low, *high)]


def _box(rows: Sequence[UnitRow], frame: PageFrame, heights: Mapping[str, tuple[float, float]]) -> list[float] | None:
    """Lower and upper corner of what stands on a tile, in the page's frame; None where nothing has a place."""
    drawn = [u for u in rows if u.rings]
    if not drawn:
        return None
    low, high = min(heights[u.id][0] for u in drawn), max(heights[u.id][1] for u in drawn)
    local = frame.plan(np.concatenate([u.rings[0] for u in drawn]), low)
    top = [*local[:, :2].max(axis=0), local[:, 2].max() + high - low]
    return [round(float(v), 2) for v in (*local.min(axis=0), *top)]


def _ground(rows: Sequence[UnitRow]) -> float:
    """Median floor of the buildings, metres; 0 where none is known."""
    known = [v for u in rows if isinstance(v := u.attributes.get("ground_height_m"), int | float)]
    return float(np.median(known)) if known else 0.0
