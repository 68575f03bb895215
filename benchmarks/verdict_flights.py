"""Cases for verdicts from whole flights: buildings of finished runs over synthetic towns, as the runs have them.

    python benchmarks/verdict_flights.py rows RUN SURVEY OUT.pkl       # all that is known of each building, a few MB; SURVEY: what `cityflow synth` made

Nothing is written to the runs. The truth is that of ``verdicts_run.py``. Units at the edge of a survey,
which are never called good, are marked, and those without terrain, which have no model, are left out. Rows hold evidence, model and truth of each unit,
so that other figures can be made from them without the run; lengths are rounded to millimetres.
"""

from __future__ import annotations

import argparse
import importlib
import io
import json
import lzma
import pickle
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.building import Lod, Polyhedron, Scalar
from cityflow.core.facade_points import WallPoints
from cityflow.core.reconstruction import Evidence
from cityflow.errors import RefusedUnit
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.io.city_models.cityjson import read_feature
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.shared_ramps import without_ramps
from cityflow.reconstruction.verdicts.figures import Figures, HeldBack, figures_of
from cityflow.reconstruction.verdicts.held_back import groups_of
from cityflow.reconstruction.verdicts.judge import judged_model
from cityflow.reconstruction.verdicts.roof_fit import fit_of
from cityflow.reconstruction.verdicts.seen_elsewhere import probability_of_harm, seen_elsewhere
from cityflow.reconstruction.verdicts.survey_edge import survey_end
from cityflow.runs.run_folder import open_run
from cityflow.stages.reconstruct import UnitInputs
from cityflow.stages.reconstruct.evidence import read_evidence
from cityflow.survey.results import HULL
from cityflow.synthetic.roofs import DORMER
from cityflow.synthetic.town_units import Unit
from flight_layers import Layers, fused_layers, layers_over
from texture_world import images_of
from verdict_cases import GOOD_SHARE, WITHIN_M, distances_of_truth
from verdicts_run import places_of, units_of

BORDER_M = 0.75
"""What is wrong so near to another building of the run is a strip along their border."""
RIGHT, ROOF, DORMERS, BORDER, OUTLINE = range(5)
CAUSES = ("right", "roof", "dormer", "border", "outline")
"""Of a place: right; wrong in a dormer, beside another building, where outline and building differ, or elsewhere on the roof."""
LAYERS_AROUND_M, LAYERS_ROUNDED_M, MOST_COUNTED = 1.0, 4e-3, 20.0
FACADE_ROUNDED_M, FACING_DEG = 0.02, 20.0
ROUNDED_M, LEAST_PACKED = 1e-3, 64


@dataclass(frozen=True)
class FlownUnit:
    """A building of a run with its truth and all that its verdict could come from.

    Attributes
    ----------
    true : share of its roof within 20 cm of the truth
    attributes : as the run has them, its verdict among them; none where there is no model
    survey_end : where the survey ends at it; empty where it does not
    evidence : as the model has it, without pictures, façades rounded to 2 cm;  solid : the model;  held : points held back from it
    claim : error that the model expects, metres
    places : (P, 3) world, truth;  away : (P,) metres from the model;  cause : (P,) of `CAUSES`
    layers : (rows, cols) of the grid of the evidence's heights, as `flight_layers.LAYERS`, but `moved` for `raw`: by how much the height before
        averaging was above that after it, metres
    seen : (E, 2) square metres of its roof between edges and where photographs show them, and their standard deviation
    """

    seed: int
    unit: str
    true: float
    attributes: dict[str, Scalar]
    survey_end: str
    evidence: Evidence
    solid: Polyhedron | None
    held: HeldBack | None
    claim: float | None
    places: FloatArray
    away: FloatArray
    cause: ByteArray
    layers: dict[str, FloatArray]
    seen: FloatArray

    @property
    def wrong(self) -> dict[str, float]:
        """Share of the roof that is wrong, by cause."""
        count = np.bincount(self.cause, minlength=len(CAUSES)) / max(len(self.cause), 1)
        return {name: float(count[k]) for k, name in enumerate(CAUSES) if k != RIGHT}

    @property
    def main_cause(self) -> str:
        """Of what is wrong; of a unit that is right over 95 % none."""
        return max(self.wrong, key=lambda name: self.wrong[name]) if self.true < GOOD_SHARE else CAUSES[RIGHT]


def figures_now(unit: FlownUnit) -> Figures | None:
    """As the present code makes them; None where there is no model."""
    if unit.solid is None or unit.held is None:
        return None
    figures = figures_of(unit.solid, unit.evidence, fit_of(unit.solid, unit.evidence), unit.held, unit.claim)
    return replace(figures, elsewhere=probability_of_harm(unit.seen, unit.evidence.outline.area))


def flown_units(run: str, truth: Path, with_layers: bool = True) -> Iterator[FlownUnit]:
    """All buildings of a run that have terrain. `truth`: what ``cityflow synth`` made; layers take as long as the surfaces have taken."""
    store, tasks = recorded_tasks(run)
    tiles = [fused_layers(store, task) for task, _ in recorded_tasks(run, "fuse")[1]] if with_layers else []
    made = []
    for task, record in tasks:
        given, parameters = task.arguments_as(UnitInputs), task.parameters_as(ModelParameters)
        outline = given.outline.read(store)
        try:
            evidence = read_evidence(store, given.evidence, outline, given.roofs.roof_type_of(outline.polygon))
        except RefusedUnit:
            continue
        evidence = without_ramps(evidence)
        made.append((task.unit, evidence, _made(store, record, evidence, parameters)))
    units = units_of(truth)
    tree = shapely.STRtree([u.wall_outline for u in units])
    images = tuple(images_of(truth / "catalog", Path(run)))
    for number, (name, evidence, model) in enumerate(made):
        others = shapely.union_all([e.outline for k, (_, e, _) in enumerate(made) if k != number])
        _, own, places = places_of(evidence.outline, others, units, tree)
        solid = model.solid
        away = (
            distances_of_truth(solid, places, evidence.outline) if solid is not None else np.full(len(places), np.nan)
        )
        yield FlownUnit(
            seed_of(truth), name, float(np.mean(away <= WITHIN_M)) if len(away) else 0.0, model.attributes,
            survey_end(evidence.outline, evidence.heights), _lean(evidence), solid, model.held, model.claim,
            places, away, _causes(away, places, own, evidence, others),
            _layers(tiles, evidence) if tiles else {},
            seen_elsewhere(solid, replace(evidence, photographs=images)) if solid is not None else np.empty((0, 2)),
        )  # fmt: skip


def _lean(evidence: Evidence) -> Evidence:
    """Without pictures, and façades rounded, side by side: these are most of a row, and judged in steps of 10 cm."""
    x, y, z = evidence.walls.xyz.T
    facing = np.rint(np.degrees(np.arctan2(evidence.walls.normal[:, 1], evidence.walls.normal[:, 0])) / FACING_DEG)
    w = evidence.walls.take(np.lexsort((z, y, x, facing)))
    xyz = np.rint(w.xyz / FACADE_ROUNDED_M) * FACADE_ROUNDED_M
    walls = WallPoints(xyz, (np.rint(w.normal * 50) / 50).astype(np.float32), np.zeros(len(w), np.float32), w.views)
    return replace(evidence, pictures=(), walls=walls)


def _layers(tiles: Sequence[Layers], evidence: Evidence) -> dict[str, FloatArray]:
    """Around the unit; elsewhere NaN."""
    if evidence.heights is None:
        return {}
    x, y = evidence.heights.grid.centres()
    near = shapely.contains_xy(shapely.buffer(evidence.outline, LAYERS_AROUND_M), x, y)
    found = layers_over(tiles, evidence.heights.grid)
    found["count"] = np.minimum(found["count"], MOST_COUNTED)
    found["moved"] = found.pop("raw") - evidence.heights.dsm
    return {name: np.where(near, np.rint(z / LAYERS_ROUNDED_M) * LAYERS_ROUNDED_M, np.nan) for name, z in found.items()}


class _Model(NamedTuple):
    """The model of a unit as the run has made it, what it says of itself, and the points held back from it."""

    solid: Polyhedron | None
    attributes: dict[str, Scalar]
    held: HeldBack | None
    claim: float | None


def _made(store: Store, record: Record | None, evidence: Evidence, parameters: ModelParameters) -> _Model:
    """Of a unit with few points, whose models are tested by each other, the judgement is made again."""
    hulls = [p for p in record.outputs if p.endswith(HULL)] if record else []
    if not hulls:
        return _Model(None, {}, None, None)
    building = read_feature(store.read_bytes(hulls[0]))
    solid, claim = building.solids[Lod.LOD22], building.attributes.get("claimed_rmse_m")
    held = groups_of(evidence.points.xyz, parameters.held_back.groups) == 0
    back: HeldBack | None = HeldBack(held, fit_of(solid, evidence).distance)
    if int(held.sum()) < parameters.held_back.least:
        back = judged_model(evidence, parameters.model_copy(update={"with_overhangs": False})).held
    return _Model(solid, dict(building.attributes), back, float(claim) if isinstance(claim, int | float) else None)


def _causes(
    away: FloatArray, places: FloatArray, own: list[Unit], evidence: Evidence, others: shapely.Geometry
) -> ByteArray:
    """(P,) of `CAUSES`."""
    x, y = places[:, 0], places[:, 1]
    dormers = shapely.union_all([f.polygon for u in own for f in u.prisms if f.kind == DORMER])
    cause = np.full(len(x), ROOF, np.uint8)
    cause[shapely.contains_xy(dormers, x, y)] = DORMERS
    cause[shapely.contains_xy(shapely.buffer(others, BORDER_M), x, y)] = BORDER
    cause[~shapely.contains_xy(evidence.outline, x, y) | np.isnan(places[:, 2])] = OUTLINE
    cause[away <= WITHIN_M] = RIGHT
    return cause


def tasks_of(run: str) -> tuple[Store, list[Task]]:
    """The tasks of all buildings of a finished run, as the present code makes them."""
    store, found = recorded_tasks(run)
    return store, [task for task, _ in found]


def recorded_tasks(run: str, stage: str = "reconstruct") -> tuple[Store, list[tuple[Task, Record | None]]]:
    """The tasks of a stage of a finished run, those of all buildings or tiles, as the present code makes them, and what became of them."""
    wanted, found = open_run(run), []
    with Ledger.open(wanted.store) as ledger:
        source = wanted.source(ledger)
        queue = deque(source.initial())
        while queue:
            task = queue.popleft()
            record = ledger.latest(task.stage, task.unit)
            if task.stage == stage and task.function.endswith(":run"):
                found.append((task, record))
            if record is not None:
                queue.extend(source.after(task, record))
    return wanted.store, sorted(found, key=lambda pair: pair[0].unit)


def seed_of(truth: Path) -> int:
    """Of a synthetic survey."""
    return int(json.loads((truth / "synth.json").read_text())["parameters"]["seed"])


class _Packer(pickle.Pickler):
    """Arrays of lengths as whole millimetres above their mean, byte by byte: that is a fifth of the size."""

    def reducer_override(self, obj: object) -> Any:
        if isinstance(obj, np.ndarray) and obj.dtype.kind == "f" and obj.size >= LEAST_PACKED:
            flat = obj.reshape(len(obj), -1).astype(np.float64)
            base = (
                np.array([np.rint(np.nanmean(c)) if np.isfinite(c).any() else 0.0 for c in flat.T])
                if flat.shape[1] <= 3
                else (np.full(flat.shape[1], np.rint(np.nanmean(flat)) if np.isfinite(flat).any() else 0.0))
            )
            whole = np.where(np.isfinite(flat), np.rint((flat - base) / ROUNDED_M), np.iinfo(np.int32).min)
            whole = np.clip(whole, np.iinfo(np.int32).min, np.iinfo(np.int32).max).astype(np.int32)
            packed = whole.T.copy().view(np.uint8).reshape(-1, 4).T.tobytes()
            return _unpacked, (packed, obj.shape, base.astype(np.float64).tolist(), obj.dtype.str)
        return NotImplemented


def _unpacked(packed: bytes, shape: tuple[int, ...], base: list[float], kind: str) -> NDArray[Any]:
    columns = len(base)
    whole = np.frombuffer(packed, np.uint8).reshape(4, -1).T.copy().view(np.int32).reshape(columns, -1).T
    values = np.where(whole == np.iinfo(np.int32).min, np.nan, whole * ROUNDED_M + np.array(base))
    return np.asarray(values.reshape(shape), kind)


def write_rows(rows: list[FlownUnit], path: Path) -> None:
    """For `read_rows`."""
    into = io.BytesIO()
    _Packer(into, pickle.HIGHEST_PROTOCOL).dump(rows)
    path.write_bytes(lzma.compress(into.getvalue(), preset=3))


def read_rows(path: Path) -> list[FlownUnit]:
    """Of a file that `write_rows` has written."""
    found: list[FlownUnit] = pickle.loads(lzma.decompress(path.read_bytes()))
    return found


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = options.add_subparsers(dest="command", required=True)
    rows = commands.add_parser("rows", help="all that is known of each building of a finished run")
    rows.add_argument("run")
    rows.add_argument("survey", type=Path)
    rows.add_argument("out", type=Path)
    rows.add_argument("--without-layers", action="store_true", help="leave out what fusion knows: a third of the time")
    asked = options.parse_args()
    found = list(flown_units(asked.run, asked.survey, not asked.without_layers))
    write_rows(found, asked.out)
    for u in found:
        wrong = ", ".join(f"{name} {100 * share:.1f} %" for name, share in u.wrong.items() if share > 0)
        print(
            f"{u.seed} {u.unit}: {100 * u.true:.1f} % right; wrong: {wrong or 'nothing'}{'; ' + u.survey_end if u.survey_end else ''}"
        )
    print(f"{len(found)} units, {asked.out.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    # rows name the module of their class
    verdict_flights = importlib.import_module("verdict_flights")
    verdict_flights.main()
