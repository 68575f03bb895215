"""Cleans given outlines: exploded, repaired, thinned, or refused with a reason."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.core.parameters import Parameters
from cityflow.outlines.identity import Settled, geometry_key, places_of, settled
from cityflow.outlines.noded.rings import Rings, on_lattice


class CleaningParameters(Parameters):
    """How far given outlines are mended before they are refused."""

    collinear_m: float = Field(
        0.001, ge=0, le=0.1, description="a vertex nearer than this to the line without it is dropped, m"
    )
    spike_width_m: float = Field(0.01, ge=0, le=0.5, description="an out-and-back narrower than this is dropped, m")
    minimum_area_m2: float = Field(0.1, gt=0, le=100, description="smaller outlines and parts are refused, m²")
    minimum_hole_m2: float = Field(0.01, ge=0, le=100, description="smaller holes are filled, m²")


@dataclass(frozen=True, slots=True)
class Refusal:
    """An outline that cannot be a building, why, and its geometry as it came, of any kind and quality; None where it has none."""

    id: str
    reason: str
    shape: BaseGeometry | None = None


@dataclass(frozen=True, slots=True)
class _Repaired:
    """Polygon parts of one geometry and what was done to get them; no parts: `remark` says why."""

    parts: tuple[Polygon, ...]
    remark: str = ""


def clean_outlines(
    raw: Sequence[Outline], parameters: CleaningParameters | None = None
) -> tuple[list[Outline], list[Refusal]]:
    """Valid polygons on the 0.1 mm lattice, in the order given, and what had to be refused.

    Several parts of one outline get the suffixes ``-1``, ``-2``, …; outlines without an id (empty) get one from their
    geometry. The polygons may still overlap; see `noding.node_outlines`.

    Parameters
    ----------
    raw : outlines of any quality; their ``polygon`` may also be a MultiPolygon, a collection, empty or None
    """
    mended, refused = mended_outlines(raw, parameters)
    ids, keys = [o.id for o in mended], [geometry_key(o.polygon) for o in mended]
    found = settled(ids, places_where_nameless(mended), keys)
    twins = [twin(mended[i], found, i) for i in found.twin_of]
    return [renamed(o, found, i) for i, o in enumerate(mended) if i not in found.twin_of], refused + twins


def mended_outlines(
    raw: Sequence[Outline], parameters: CleaningParameters | None = None
) -> tuple[list[Outline], list[Refusal]]:
    """The same without a look at other outlines: names may be missing or repeated, and polygons, too. See `identity.settled`."""
    kept: list[Outline] = []
    refused: list[Refusal] = []
    for outline, repaired in zip(raw, _repaired(raw, parameters or CleaningParameters()), strict=True):
        if repaired.parts:
            kept.extend(_as_outlines(outline, repaired))
        else:
            refused.append(Refusal(outline.id, repaired.remark, outline.polygon))
    return kept, refused


def places_where_nameless(outlines: Sequence[Outline]) -> list[str]:
    """See `identity.places_of`; empty for outlines that have an id."""
    found = iter(places_of([o.polygon for o in outlines if not o.id]))
    return ["" if o.id else next(found) for o in outlines]


def twin(outline: Outline, found: Settled, number: int) -> Refusal:
    """An outline whose polygon came before, refused."""
    return Refusal(found.first[number], f"same polygon as {found.first[found.twin_of[number]]}", outline.polygon)


def renamed(outline: Outline, found: Settled, number: int) -> Outline:
    """An outline under its final name, with a remark where it had another one."""
    first, name = found.first[number], found.names[number]
    if name == outline.id:
        return outline
    twice = f"id {first} given twice" if name != first else ""
    return replace(outline, id=name, remark="; ".join(text for text in (outline.remark, twice) if text))


def _repaired(raw: Sequence[Outline], parameters: CleaningParameters) -> Iterator[_Repaired]:
    """Most outlines of a real data set are sound: those are thinned together, the others mended one by one."""
    sound = np.array([_is_sound(outline.polygon) for outline in raw], bool)
    easy = [raw[i].polygon for i in np.flatnonzero(sound).tolist()]
    thinned = iter(_thinned(easy, parameters))
    for outline, is_sound in zip(raw, sound, strict=True):
        first = next(thinned) if is_sound else None
        if first is not None and _is_sound(first) and first.area >= parameters.minimum_area_m2:
            filled = _without_small_holes(first, parameters.minimum_hole_m2)
            yield _Repaired((filled,), "" if filled is first else "tiny holes filled")
        else:
            yield _mended(outline.polygon, parameters)


def _is_sound(geometry: BaseGeometry | None) -> bool:
    return bool(isinstance(geometry, Polygon) and not geometry.is_empty and not geometry.has_z and geometry.is_valid)


def _mended(geometry: BaseGeometry | None, parameters: CleaningParameters) -> _Repaired:
    problem = _unusable(geometry)
    if problem or geometry is None:
        return _Repaired((), problem)
    flat = shapely.force_2d(geometry)
    remarks = [] if flat.is_valid else [f"repaired ({_why_invalid(flat)})"]
    pieces = _polygon_parts(_valid(flat))
    mended = [q for p in _thinned(pieces, parameters) if p is not None for q in _polygon_parts(_valid(p))]
    large = [p for p in mended if p.area >= parameters.minimum_area_m2]
    if not large:
        return _Repaired((), f"area {sum(p.area for p in mended):.3f} m² is below {parameters.minimum_area_m2:g} m²")
    if len(large) < len(mended):
        remarks.append(f"{len(mended) - len(large)} parts below {parameters.minimum_area_m2:g} m² left out")
    filled = [_without_small_holes(p, parameters.minimum_hole_m2) for p in large]
    return _Repaired(tuple(shapely.orient_polygons(filled, exterior_cw=False)), "; ".join(remarks))


def _valid(geometry: BaseGeometry) -> BaseGeometry:
    """Each ring repaired, then holes taken from shells: a hole along the shell becomes a notch, and is not filled."""
    if geometry.is_valid:
        return geometry
    return shapely.make_valid(geometry, method="structure", keep_collapsed=False)


def _unusable(geometry: BaseGeometry | None) -> str:
    """Why there is no polygon in this geometry at all, or an empty text."""
    if geometry is None or geometry.is_empty:
        return "empty geometry"
    if not np.isfinite(shapely.get_coordinates(geometry)).all():
        return "coordinates that are not finite numbers"
    if not any(part.geom_type in ("Polygon", "MultiPolygon") for part in _members(geometry)):
        return f"a {geometry.geom_type}, not a polygon"
    return ""


def _why_invalid(geometry: BaseGeometry) -> str:
    return str(shapely.is_valid_reason(geometry)).split("[")[0].strip().lower()


def _members(geometry: BaseGeometry) -> list[BaseGeometry]:
    if geometry.geom_type != "GeometryCollection":
        return [geometry]
    return [member for part in shapely.get_parts(geometry) for member in _members(part)]


def _polygon_parts(geometry: BaseGeometry) -> list[Polygon]:
    """Polygons in a geometry of any type, largest first; lines and points dropped."""
    parts = [p for member in _members(geometry) for p in shapely.get_parts(member) if isinstance(p, Polygon)]
    return sorted((p for p in parts if p.area > 0), key=lambda p: (-p.area, p.bounds))


def _thinned(polygons: Sequence[Polygon], parameters: CleaningParameters) -> list[Polygon | None]:
    """Polygons on the lattice without spikes and without vertices that say nothing; None where nothing is left."""
    rings = Rings.of(polygons)
    rings = rings.moved(on_lattice(rings.xy))
    while True:
        redundant = _redundant(rings, parameters)
        if not redundant.any():
            return rings.to_polygons()
        rings = rings.kept(~redundant).without_repeats()


def _redundant(rings: Rings, parameters: CleaningParameters) -> np.ndarray:
    """Spikes and collinear vertices; of adjacent ones only every second, since each judges by its neighbours."""
    if not len(rings.xy):
        return np.empty(0, bool)
    before, after = rings.preceding(), rings.following()
    to_before, to_after = rings.xy[before] - rings.xy, rings.xy[after] - rings.xy
    cross = np.abs(to_before[:, 0] * to_after[:, 1] - to_before[:, 1] * to_after[:, 0])
    ahead = (to_before * to_after).sum(axis=1) < 0
    length_b, length_a = np.hypot(*to_before.T), np.hypot(*to_after.T)
    off_line = cross / np.maximum(_chord(to_before, to_after), 1e-12)
    width = cross / np.maximum(np.maximum(length_b, length_a), 1e-12)
    spike = ~ahead & (width <= parameters.spike_width_m) & (np.minimum(length_b, length_a) > 2 * width)
    redundant = spike | (ahead & (off_line <= parameters.collinear_m))
    enough = np.bincount(rings.ring, minlength=len(rings.owner))[rings.ring] > 3
    return _every_second(redundant & (enough | spike), rings)


def _chord(to_before: FloatArray, to_after: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(*(to_after - to_before).T))


def _every_second(marked: np.ndarray, rings: Rings) -> np.ndarray:
    """Of each run of marked vertices the 1st, 3rd, …; the last of a ring not together with its first."""
    index = np.arange(len(marked))
    starts_run = marked & ~(np.append(False, marked[:-1]) & np.append(False, rings.ring[1:] == rings.ring[:-1]))
    run_start = np.maximum.accumulate(np.where(starts_run, index, 0))
    chosen = marked & ((index - run_start) % 2 == 0)
    wraps = chosen & (rings.following() < index) & chosen[rings.following()]
    return chosen & ~wraps


def _without_small_holes(polygon: Polygon, minimum_m2: float) -> Polygon:
    holes = [ring for ring in polygon.interiors if Polygon(ring).area >= minimum_m2]
    return polygon if len(holes) == len(polygon.interiors) else Polygon(polygon.exterior, holes)


def _as_outlines(outline: Outline, repaired: _Repaired) -> Iterator[Outline]:
    several = len(repaired.parts) > 1
    note = f"part of {len(repaired.parts)}" if several else ""
    remark = "; ".join(text for text in (outline.remark, repaired.remark, note) if text)
    for number, polygon in enumerate(repaired.parts, 1):
        suffix = f"-{number}" if several and outline.id else ""
        yield replace(outline, id=f"{outline.id}{suffix}", polygon=polygon, remark=remark)
