"""Rows with known borders, as the model of borders with pictures sees them: places that are proposed along the strips of outlines, and what shows there.

    python benchmarks/picture_rows.py --cache FOLDER RUN SURVEY [RUN SURVEY ...]     # of flights: kept as FOLDER/NAME.rows, NAME that of SURVEY's parent
    python benchmarks/picture_rows.py --cache FOLDER --drawn                         # of drawn rows, a drawn town, and groups of buildings

`fit_borders.py --pictures` fits weights to the files of a folder.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString

import split_unbroken
from border_rows import NONE, KnownRow, borders_across, kept, strips_within
from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import SplitEvidence
from cityflow.splitting.borders.picture_features import picture_table
from cityflow.splitting.borders.place_evidence import places_of
from cityflow.splitting.borders.station_features import FEATURES, STATION_M, StationTable
from cityflow.splitting.cuts.cuts import free_ends, proposals, reach
from drawn_town import drawn_town, true_borders
from scenes import drawn_farms
from scenes.drawn_evidence import split_evidence
from split_flights import evidences_of, truth_of
from split_town import given
from splitting.row_scene import House, row_evidence

NEAR_M = 0.75
"""A place so near to a true border may be it."""
END_M = 1.0
CELL_M = 0.15
SCENES = {("row", True): range(5000, 5006)}
STREETS, TOWN = range(6000, 6028), (402, 100)
GROUPS = {"farm": 24, "barns": 24, "winged": 24, "church": 24, "hall": 16}
"""How many of each kind (`scenes/drawn_farms.py`), from seed 8000 on."""
GROUP_WEIGHT = 0.3
"""Drawn groups count less than photographed rows: they tell how steps are taken, not how often there is a border."""
CHANGES: dict[str, Sequence[int]] = {
    "roof": (0,), "eave": (1,), "facade": (2,), "all": (0, 1, 2), "two": (), "same": (), "shadow": (),
}  # fmt: skip
KINDS = tuple(CHANGES)
SHADOWED, DORMERS = 0.15, 0.3
Colour = tuple[int, int, int]
ROOFS: Sequence[Colour] = ((140, 74, 66), (70, 76, 84), (122, 96, 70), (165, 98, 70), (90, 92, 88))
WALLS: Sequence[Colour] = ((214, 200, 172), (240, 236, 230), (140, 90, 74), (186, 178, 160), (200, 150, 110))


def rows_of(block: int, evidence: SplitEvidence, lines: Sequence[LineString]) -> list[KnownRow]:
    """The strips of an outline, with the true borders across each."""
    rows = []
    for seen, part in strips_within(evidence):
        strip, free = seen.strip, free_ends(seen.strip, part)
        u = np.array(proposals(seen, free))
        values = picture_table(*places_of(seen, part, u.tolist(), reach(strip, free)), strip, free)
        borders = borders_across(strip, lines)
        stations = strip.stations[0] + STATION_M * np.arange(int(strip.length / STATION_M) + 1)
        rows.append(known_row(block, stations, (u, values), borders, (0 if free[0] else -1, 0 if free[1] else -1)))
    return rows


def known_row(
    block: int, stations: FloatArray, places: tuple[FloatArray, FloatArray], borders: FloatArray, ends: tuple[int, int]
) -> KnownRow:
    """Places at their stations; where two share one, the true one, else the first. Borders at free ends, where none is looked for, are left out.

    Parameters
    ----------
    places : (P,) u and (P, F) features
    """
    u, values = places
    clear = [END_M if end == 0 else -np.inf for end in ends]
    borders = borders[(borders - stations[0] >= clear[0]) & (stations[-1] - borders >= clear[1])]
    off = np.abs(u[:, None] - borders[None]) if len(borders) else np.full((len(u), 1), np.inf)
    true = np.where(off.min(axis=1) < NEAR_M, off.argmin(axis=1), NONE)
    at = np.clip(np.round((u - stations[0]) / STATION_M).astype(np.int64), 0, len(stations) - 1)
    table = np.full((len(stations), len(FEATURES)), np.nan)
    group, may = np.full(len(stations), NONE), np.zeros(len(stations), bool)
    for k in np.lexsort((u, true < 0)).tolist():
        if not may[at[k]]:
            table[at[k]], may[at[k]], group[at[k]] = values[k], True, true[k]
    known = np.unique(group[group >= 0])
    group = np.where(group >= 0, np.searchsorted(known, group), NONE)
    return KnownRow(block, StationTable(stations, table), ends, borders, group, len(known), may)


def flight_rows(run: Path, survey: Path) -> list[KnownRow]:
    _, borders = truth_of(survey)
    lines = [b.line for b in borders]
    return [row for k, e in enumerate(evidences_of(run, survey)) for row in rows_of(k, e, lines)]


def scene_rows(kind: str, clean: bool, seeds: Sequence[int]) -> list[KnownRow]:
    """Blocks without borders, or rows, under the errors of a weak survey or of a clean one (`split_unbroken.py`)."""
    rows = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        scene = split_unbroken.block(rng) if kind == "block" else split_unbroken.row(rng)
        survey = split_unbroken.survey_of(rng, CELL_M)
        if clean:
            scene, survey = replace(scene, seams=()), split_unbroken.Survey(0.02, 1.0, 0.9, CELL_M)
        evidence, middles = split_unbroken.evidence_of(scene, survey, rng)
        ring = shapely.get_coordinates(evidence.outline)
        across = 0.5 * scene.depth * (ring[1] - ring[0]) / np.hypot(*(ring[1] - ring[0]))
        rows += rows_of(seed, evidence, [LineString([m - across, m + across]) for m in middles])
    return rows


def street_rows(seeds: Sequence[int]) -> list[KnownRow]:
    """Rows as the tests draw them: houses that differ in one thing, in two, in all, or in none; the last have no border."""
    rows = []
    for seed in seeds:
        rng, kind = np.random.default_rng(seed), KINDS[seed % len(KINDS)]
        number = int(rng.integers(2, 6))
        houses = [
            House(
                float(rng.uniform(5, 9)),
                float(rng.uniform(5, 8)),
                ROOFS[int(rng.integers(5))],
                WALLS[int(rng.integers(5))],
            )
        ]
        for _ in range(number - 1):
            houses.append(_next(rng, houses[-1], rng.permutation(3)[:2].tolist() if kind == "two" else CHANGES[kind]))
        turn, length = float(rng.uniform(-40, 40)), sum(h.width for h in houses)
        shadow = float(rng.uniform(0.25, 0.75) * length) if kind == "shadow" or rng.random() < SHADOWED else None
        evidence, true = row_evidence(houses, turn, shadow=shadow)
        same = kind in ("same", "shadow")
        rows += rows_of(seed, evidence, [] if same else [LineString(line) for line in true])
    return rows


def _next(rng: np.random.Generator, last: House, changes: Sequence[int]) -> House:
    """A neighbour that differs in some of roof (0), eaves (1) and façade (2)."""
    width = float(rng.uniform(5, 9)) if changes else last.width
    eave = last.eave + float(rng.choice([-1, 1]) * rng.uniform(0.3, 1.2)) if 1 in changes else last.eave
    roof = _other(rng, ROOFS, last.roof) if 0 in changes else last.roof
    wall = _other(rng, WALLS, last.facade) if 2 in changes else last.facade
    return House(width, eave, roof, wall, bool(rng.random() < DORMERS))


def _other(rng: np.random.Generator, colours: Sequence[Colour], than: Colour) -> Colour:
    return colours[int(rng.choice([k for k, colour in enumerate(colours) if colour != than]))]


def town_rows(seed: int, size: int) -> list[KnownRow]:
    """The true outlines of a drawn town."""
    town = drawn_town(seed, size)
    _, borders = true_borders(town.truth)
    lines = [b.line for b in borders]
    rows = []
    for number, (outline, _) in enumerate(given(town)):
        rows += rows_of(number, split_evidence(f"o{number}", outline, town.frames, town.terrain), lines)
    return rows


def group_rows() -> list[KnownRow]:
    """Farms, barns end to end, and wings, churches and halls that have no border."""
    rows = []
    for kind, number in GROUPS.items():
        for seed in range(8000, 8000 + number):
            rows += rows_of(seed, *drawn_farms.group_evidence(kind, seed))
    return [replace(row, weight=GROUP_WEIGHT) for row in rows]


def drawn_rows() -> list[KnownRow]:
    rows = street_rows(STREETS) + town_rows(*TOWN) + group_rows()
    for (kind, clean), seeds in SCENES.items():
        rows += scene_rows(kind, clean, seeds)
    return rows


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folders", type=Path, nargs="*", help="RUN and SURVEY of each flight")
    options.add_argument("--cache", type=Path, required=True)
    options.add_argument("--drawn", action="store_true")
    asked = options.parse_args()
    for run, survey in zip(asked.folders[::2], asked.folders[1::2], strict=True):
        kept(asked.cache, survey.resolve().parent.name, partial(flight_rows, run, survey))
    if asked.drawn:
        kept(asked.cache, "drawn", drawn_rows)


if __name__ == "__main__":
    main()
