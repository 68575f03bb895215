"""A run of a synthetic survey up to its façade points, what its depth maps have of given places, and evidence for true outlines as ``reconstruct`` reads it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.core.building import Outline, OutlineEdge
from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import DepthMap
from cityflow.core.reconstruction import Evidence
from cityflow.flow.shared import SharedTexts
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.geometry.straight_edges import wall_edges
from cityflow.handover.depth_map_files import decode_depth_map
from cityflow.handover.vote_files import decode_votes
from cityflow.runs.prepare import Prepared, prepared
from cityflow.stages.reconstruct.evidence import evidence_of, read_evidence
from cityflow.stages.walls import WallInputs
from cityflow.survey.survey import Survey
from cityflow.survey.unit_entry import UnitEntry
from cityflow.synthetic.town_units import Unit
from discontinuities import NOISE_M, cleaned
from matched_models import party_of
from run_here import run_here
from stages_again import records_of
from step_times import StepTimes

WORKFLOW = Path(__file__).parents[1] / "workflows" / "demo_flight.yaml"
UNTIL_WALLS = ("ingest", "match", "fuse", "surface", "walls")
BEHIND_GSD = 3.0
"""A depth is right where it is off by no more."""


class WalkedRun(NamedTuple):
    """A run whose tasks and results are known."""

    store: Store
    survey: Survey
    walls: tuple[WallInputs, ...]


def made(run: Path, catalog: str, aoi: str, settings: Sequence[str]) -> Prepared:
    """The run up to its façade points, made where there is none; one task after the other in this process."""
    if not run.exists():
        run_here(WORKFLOW, catalog, run, settings, aoi, StepTimes(), UNTIL_WALLS)
    return prepared(WORKFLOW, catalog, str(run), settings, aoi)


def walked(run: Path, catalog: str, aoi: str, settings: Sequence[str] = ()) -> WalkedRun:
    """Its tasks by its records."""
    wanted = made(run, catalog, aoi, settings)
    source, texts, records = wanted.source(), SharedTexts(wanted.store), records_of(run)
    ready, walls = list(source.initial()), list[Task]()
    while ready:
        task = ready.pop()
        record = records.get((task.stage, task.unit))
        if record is not None:
            walls += [texts.stored(task)] if task.stage == "walls" else []
            ready.extend(source.after(task, record))
    return WalkedRun(wanted.store, source.survey, tuple(t.arguments_as(WallInputs) for t in walls))


class Depths:
    """Depth maps of a run, and the votes for them."""

    def __init__(self, store: Store, inputs: Sequence[WallInputs]) -> None:
        self.images: dict[str, OrientedImage] = {}
        self.maps: dict[str, list[tuple[DepthMap, ByteArray]]] = defaultdict(list)
        known: set[str] = set()
        for given in (i.depths for i in inputs):
            self.images |= {i.name: i for i in given.references}
            for path, votes, name in zip(given.maps, given.votes, given.names, strict=True):
                if path not in known:
                    known.add(path)
                    voted = decode_votes(store.read_bytes(votes), [name])[name]
                    self.maps[name].append((decode_depth_map(store.read_bytes(path), colour=False), voted))

    def right(self, xyz: FloatArray, seen: BoolArray, names: Sequence[str], gsd: float) -> tuple[BoolArray, BoolArray]:
        """(N,) whether an image that sees a place has its depth, and whether that is not refuted."""
        has, kept = np.zeros(len(xyz), bool), np.zeros(len(xyz), bool)
        for name, sees in zip(names, seen, strict=True):
            image = self.images.get(name)
            if image is None or not sees.any():
                continue
            at = np.flatnonzero(sees)
            uv, depth = image.project(xyz[at])
            for one, votes in self.maps[name]:
                row, col = (np.floor(uv[:, 1]).astype(int) - one.row), (np.floor(uv[:, 0]).astype(int) - one.col)
                held = (row >= 0) & (col >= 0) & (row < one.depth.shape[0]) & (col < one.depth.shape[1])
                near = np.abs(one.depth[row[held], col[held]] - depth[held]) <= BEHIND_GSD * gsd
                has[at[held]] |= near
                kept[at[held]] |= near & (votes[row[held], col[held]] > 0)
        return has, kept


def evidence_in(run: WalkedRun, unit: Unit, units: Sequence[Unit]) -> Evidence:
    """What the stage would read for the true outline of a unit, without orthos and photographs."""
    outline = cleaned(unit.wall_outline)
    entry = UnitEntry(unit.id, "", "", 0, 0, "", (*outline.bounds,), (0.0, 0.0), (), ())
    party = party_of(unit, list(units), shapely.STRtree([u.wall_outline for u in units]))
    edges = tuple(OutlineEdge(e.line, "given", NOISE_M) for e in wall_edges(outline, ()))
    given = replace(evidence_of(run.survey, entry)[1], own_orthos=False)
    return read_evidence(run.store, given, Outline(unit.id, outline, party=party, edges=edges))
