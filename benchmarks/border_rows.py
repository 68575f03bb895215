"""Rows with known borders, as the model of borders sees them: strips of synthetic rows under a scanner, and of footprints over a real survey."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
import shapely
from shapely import LineString, Polygon

import split_delft
from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.points import concatenate
from cityflow.core.splitting import SplitEvidence
from cityflow.evaluation.outlines import united_by_adjacency
from cityflow.evaluation.unit_borders import borders_of
from cityflow.io.points.las import read_points
from cityflow.splitting import split as splitting
from cityflow.splitting.borders.border_model import LEAST_STATIONS, row_ends
from cityflow.splitting.borders.station_features import StationTable, station_table
from cityflow.splitting.cuts.cuts import free_ends
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.strip_evidence import StripEvidence
from cityflow.synthetic.town_lidar import TownLidarParameters
from lidar_rows import row_town
from lidar_streets import street_drafts
from split_lidar import evidence_of

TOLERANCE_M = 0.45
"""A station so near to a true border may be it."""
NONE = -2
TURN_DEG, COVERED, SAME_M = 15.0, 0.5, 0.8
"""A true border across a strip: turned by less against the chord, along so much of it; those nearer to one another are one."""


@dataclass(frozen=True, slots=True)
class KnownRow:
    """A strip with its table, its ends, and what is true of it.

    Attributes
    ----------
    block : number of the complex that it belongs to
    ends : stations beyond both ends, as `row_choice.Row` has them
    borders : (B,) u of the true borders across it, metres
    group : (S,) as `row_choice.Row` has it;  groups : how many of the borders have a station
    may : (S,) stations that may be borders; None where all may
    weight : how much the row counts in a fit
    """

    block: int
    table: StationTable
    ends: tuple[int, int]
    borders: FloatArray
    group: IntArray
    groups: int
    may: BoolArray | None = None
    weight: float = 1.0


def strips_within(evidence: SplitEvidence) -> list[tuple[StripEvidence, Polygon]]:
    """Every strip that splitting looks at when it finds no border, and the part of the outline that it lies in."""
    looked: list[tuple[StripEvidence, Polygon]] = []

    def look(seen: StripEvidence, part: Polygon, _: float) -> list[object]:
        looked.append((seen, part))
        return []

    with patch.object(splitting, "possible_borders", look):
        splitting.split(evidence, splitting.SplitParameters())
    return looked


def known_rows(block: int, evidence: SplitEvidence, lines: Sequence[LineString]) -> list[KnownRow]:
    """The strips of an outline that are long enough for the model, with the true borders across each."""
    rows = []
    for seen, part in strips_within(evidence):
        table = station_table(seen.strip, seen.roof, seen.marks, seen.slices)
        if len(table.u) >= LEAST_STATIONS:
            borders = borders_across(seen.strip, lines)
            group, groups = _groups(table.u, borders)
            ends = row_ends(seen.strip, table.u, free_ends(seen.strip, part))
            rows.append(KnownRow(block, table, ends, borders, group, groups))
    return rows


def borders_across(strip: AxisStrip, lines: Sequence[LineString]) -> FloatArray:
    """(B,) u of the lines that run across a strip, metres."""
    found: list[float] = []
    for line in lines:
        uv = strip.to_uv(shapely.get_coordinates(line)[[0, -1]])
        length, u = float(np.hypot(*(uv[1] - uv[0]))), float(uv[:, 0].mean())
        beyond = u < strip.stations[0] - 0.2 or u > strip.stations[-1] + 0.2
        if beyond or length < 1.0 or abs(uv[1, 0] - uv[0, 0]) > np.sin(np.radians(TURN_DEG)) * length:
            continue
        low, high = strip.ends_at(u)
        if min(high, uv[:, 1].max()) - max(low, uv[:, 1].min()) > COVERED * (high - low):
            found.append(u)
    kept: list[float] = []
    for u in sorted(found):
        if not kept or u - kept[-1] > SAME_M:
            kept.append(u)
    return np.array(kept)


def _groups(u: FloatArray, borders: FloatArray) -> tuple[IntArray, int]:
    group, number = np.full(len(u), NONE), 0
    for border in borders.tolist():
        near = np.abs(u - border) <= TOLERANCE_M
        if near.any() and not (group[near] >= 0).any():
            group[near] = number
            number += 1
    return group, number


def street_rows(seed: int, density: float, width_m: float = 240.0, plain: bool = False) -> list[KnownRow]:
    """Rows of a synthetic town; odd seeds have twice the noise in height. `plain`: those of `lidar_rows` without annexes."""
    scanner = TownLidarParameters(density_m2=density, sigma_z_m=0.05 if seed % 2 else 0.025)
    town = row_town(seed, width_m, scanner, None if plain else street_drafts)
    rows = []
    for number, row in enumerate(town.rows):
        rows += known_rows(number, evidence_of(town, row), [line for line, _ in row.traces])
    return rows


def delft_rows(folder: Path = split_delft.DELFT) -> list[KnownRow]:
    """Rows of Delft: footprints of 20 m² or more have the borders."""
    points = concatenate([read_points(p) for p in sorted(folder.rglob("*.laz"))])
    units = split_delft.footprints(next(iter(sorted(folder.rglob("*.gpkg")))))
    surface = split_delft.surface_over(points)
    lines = [b.line for b in borders_of([u for u in units if u.area >= split_delft.UNIT_M2])]
    rows = []
    for number, outline in enumerate(united_by_adjacency(units)):
        near = [line for line in lines if outline.distance(line) < 0.1]
        rows += known_rows(number, split_delft.evidence_of(str(number), outline, points, surface), near)
    return rows


def kept(cache: Path, name: str, make: Callable[[], list[KnownRow]]) -> list[KnownRow]:
    """Rows from a folder of earlier ones, made where they are not there."""
    path = cache / f"{name}.rows"
    if not path.exists():
        cache.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(make()))
    found: list[KnownRow] = pickle.loads(path.read_bytes())
    return found
