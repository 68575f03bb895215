"""Pages of single buildings beside the report: all failed ones and those to review, up to the limit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from urllib.parse import quote

import numpy as np
from shapely import Polygon

from cityflow.core.building import Building, Lod, Polyhedron, RoofPlane, Status
from cityflow.flow.records import quoted
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.io.city_models.cityjson import read_feature
from cityflow.reporting.unit_crops import Crops, crop_pictures, photographs
from cityflow.stages import reconstruct
from cityflow.survey.results import HULL
from cityflow.survey.survey import Survey
from cityflow.viewer.environment import parameter_rows
from cityflow.viewer.model_view import draw_models, no_terrain, surfaces_of
from cityflow.viewer.picture import Picture, picture
from cityflow.viewer.plane_plan import draw_planes, plane_colour
from cityflow.viewer.report import listed_units
from cityflow.viewer.report_parameters import ReportParameters
from cityflow.viewer.report_rows import ReportData, UnitRow
from cityflow.viewer.review_list import review_list
from cityflow.viewer.unit_page import FOLDER, CandidateRow, PlaneRow, UnitPage, write_unit_page

CANDIDATE_PX, LOOKING_DEG = 200, 20.0
STOREY_M = 3.0


@dataclass(frozen=True, slots=True)
class Chosen:
    """Buildings that get a page, in order of importance, and how many that did not end as asked get none."""

    units: tuple[UnitRow, ...]
    left_out: int

    @property
    def addresses(self) -> dict[str, str]:
        """Unit → address of its page relative to the report."""
        return {u.id: quote(page_path(u.id)) for u in self.units}


def page_path(unit: str) -> str:
    """Where a unit's page lies in the RUN."""
    return f"{FOLDER}/{quoted(unit)}.html"


def chosen_units(units: Sequence[UnitRow], parameters: ReportParameters) -> Chosen:
    """Failed before refused before simplified ones, large before small; then those that the report lists."""
    most = {
        Status.FAILED: parameters.pages.failed,
        Status.REFUSED: parameters.pages.refused,
        Status.DEGRADED: parameters.pages.degraded,
    }
    ranked = sorted(units, key=lambda u: (-_area(u), u.id))
    bad = [u for status, count in most.items() for u in [r for r in ranked if r.status is status][:count]]
    known = {u.id for u in bad}
    looks = [s.unit for s in review_list(units)] + listed_units(units, parameters.listed)
    listed = {u.id: u for u in looks if u.id not in known and u.status is Status.DONE}
    chosen = (*bad, *list(listed.values())[: parameters.pages.listed])
    left_out = sum(u.status in most for u in units) - len(known)
    return Chosen(chosen, left_out)


def _area(unit: UnitRow) -> float:
    """Of the outline, m²; 0 where it is no polygon."""
    return float(Polygon(unit.rings[0]).area) if unit.rings and len(unit.rings[0]) > 3 else 0.0


def write_pages(
    store: Store, survey: Survey, chosen: Chosen, records: Mapping[str, Record], crops: Crops, data: ReportData,
    looks: Mapping[str, str],
) -> None:  # fmt: skip
    """Write the pages, and remove those of before that are no more; `looks`: why some units are in the review list."""
    written = set()
    for unit in chosen.units:
        record = records.get(unit.id)
        if record is None:
            continue
        page = _page(store, survey, unit, record, crops)
        own = tuple((k, v) for k, v in parameter_rows(dict(data.overrides.get(unit.id, {}))) if k)
        store.write_bytes(
            page_path(unit.id),
            write_unit_page(replace(page, title=data.title, parameters=own, run=data.run, look=looks.get(unit.id, ""))),
        )
        written.add(page_path(unit.id))
    for path in set(store.find(FOLDER)) - written:
        if path.endswith(".html"):
            store.remove(path)


def _page(store: Store, survey: Survey, unit: UnitRow, record: Record, crops: Crops) -> UnitPage:
    solids = candidates_of(store, record)
    shown = shown_model(store, record, solids)
    heights = _heights(survey, unit, shown)
    return UnitPage(
        unit, "", reconstruct.NAME,
        (*crop_pictures(crops, unit), *photographs(store, survey, unit, heights)),
        _plan(crops, unit, shown), tuple(_planes(shown)), tuple(_scored(record, solids)),
        record.traceback, record.attempt, record.version,
    )  # fmt: skip


def candidates_of(store: Store, record: Record) -> dict[str, Building]:
    """The solid of each method that gave one, by the method's name."""
    paths = [p for p in record.outputs if p.endswith(f"/{reconstruct.CANDIDATES}")]
    lines = store.read_bytes(paths[0]).splitlines() if paths and store.exists(paths[0]) else []
    return {b.id: b for b in map(read_feature, lines) if Lod.LOD22 in b.solids}


def shown_model(store: Store, record: Record, candidates: Mapping[str, Building]) -> Building | None:
    """The model that the run kept, else the candidate of the least penalty."""
    hulls = [p for p in record.outputs if p.endswith(HULL)]
    if hulls and store.exists(hulls[0]):
        return read_feature(store.read_bytes(hulls[0]))
    scores = [s for s in record.result.get("scores", []) if s["method"] in candidates and s["penalty"] is not None]
    best = min(scores, key=lambda s: (s["penalty"], s["method"]), default=None)
    return candidates[best["method"]] if best is not None else next(iter(candidates.values()), None)


def _heights(survey: Survey, unit: UnitRow, shown: Building | None) -> tuple[float, float]:
    """Of floor and ridge, of the model or the attributes, else what the survey expects around there."""
    if shown is not None:
        z = shown.solids[Lod.LOD22].vertices[:, 2]
        return float(z.min()), float(z.max())
    floor = unit.attributes.get("ground_height_m")
    if isinstance(floor, int | float):
        ridge = unit.attributes.get("ridge_height_m")
        return float(floor), float(ridge) if isinstance(ridge, int | float) else float(floor) + STOREY_M
    if survey.images.assets and unit.rings:
        low, _ = survey.images.heights_over(Polygon(unit.rings[0]).bounds)
        return low, low + STOREY_M
    return 0.0, STOREY_M


def _plan(crops: Crops, unit: UnitRow, shown: Building | None) -> Picture | None:
    grounds = crops.grounds(unit) if shown is not None and shown.planes else []
    if not grounds or shown is None:
        return None
    pixels = draw_planes(grounds[-1].pixels, grounds[-1].grid, shown.solids[Lod.LOD22])
    key = tuple((str(k + 1), plane_colour(k)) for k in range(min(len(shown.planes), 40)))
    return picture("Planes in plan", "Faces of the roof by the plane that they lie in; north is up.", pixels, key)


def _planes(shown: Building | None) -> Iterator[PlaneRow]:
    for number, plane in enumerate(shown.planes if shown is not None else (), start=1):
        yield PlaneRow(number, *_slope(plane), plane.points, plane.rmse, plane.sigma_height, plane.seen)


def _slope(plane: RoofPlane) -> tuple[float, float]:
    """Degrees of slope, and of the direction in which it falls, clockwise from north."""
    slope = float(np.degrees(np.arctan(np.hypot(plane.slope_x, plane.slope_y))))
    return slope, float(np.degrees(np.arctan2(-plane.slope_x, -plane.slope_y)) % 360.0)


def _scored(record: Record, solids: Mapping[str, Building]) -> Iterator[CandidateRow]:
    scores = record.result.get("scores")
    for number, s in enumerate(scores if isinstance(scores, list) else []):
        found = solids.get(s["method"])
        kept = number == record.result.get("kept")
        view = _view(s["method"], found.solids[Lod.LOD22], kept) if found is not None else None
        yield CandidateRow(
            s["method"], kept, bool(s["valid"]), "" if s["valid"] else (s["fault"] or "no solid"), s.get("faces"),
            s.get("penalty"), s.get("within_20cm"), s.get("covered"), s.get("nmad"), view,
        )  # fmt: skip


def _view(method: str, solid: Polyhedron, kept: bool) -> Picture:
    pixels = draw_models(surfaces_of([solid]), no_terrain(), CANDIDATE_PX, looking_deg=LOOKING_DEG)
    return picture(method.replace("_", " "), "Kept." if kept else "", pixels)
