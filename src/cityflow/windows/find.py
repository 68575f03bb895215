"""Windows and doors of walls, from their rectified textures (Frommholz 2017, section 6, and beyond it rows and columns)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import VERTEX_DECIMALS, Semantic
from cityflow.core.openings import FaceOpenings, Opening, OpeningKind, UnitOpenings
from cityflow.core.texture import FaceKey, FacePlane, Patch
from cityflow.windows.candidates import Candidates, candidates, judged, looks_of, on_foot, sized, within_wall
from cityflow.windows.choice import chosen, support
from cityflow.windows.confidence import confidence
from cityflow.windows.edges import Edges
from cityflow.windows.fitting import bounds_of, fitted
from cityflow.windows.picture import Picture, picture_of
from cityflow.windows.proposals import WHOLE, framed, fused, hold_panes
from cityflow.windows.rows import aligned, in_column, overlap, places
from cityflow.windows.shutters import between_shutters
from cityflow.windows.storeys import door_like, storeys_of
from cityflow.windows.window_parameters import WindowParameters

TOO_COARSE = "the texture is too coarse for windows"
UNSEEN = "no image sees enough of it"
GLASS = "a façade of glass: what it mirrors is no row of windows"
LEAST_SEEN_M2 = 0.5
LEAST_SEEN_SHARE = 0.25
"""Of a wall, and of all walls of a unit, with true texture: what is said from less is said of a corner, not of the building."""
BONUS = (0.0, 0.2, 0.1, 0.35)
"""What speaks for plain boxes, fused ones, those with their frames, and those between shutters, beside the parts that they hold."""
PANE = 0.6
"""Shortest side of a pane by that of a window."""
AREA_BONUS = 0.05
"""For each square metre: a window before one of its panes, where both are as sound."""


def find_unit_windows(
    faces: Iterable[FacePlane], patches: Mapping[FaceKey, Patch], parameters: WindowParameters
) -> UnitOpenings:
    """Openings of all walls of a unit that have a texture; `patches` are its rectified ones."""
    walls = [f for f in faces if f.semantic is Semantic.WALL]
    return unit_openings(walls, [find_windows(f, patches[f.key], parameters) for f in walls if f.key in patches])


def unit_openings(walls: Sequence[FacePlane], found: Sequence[FaceOpenings]) -> UnitOpenings:
    """A unit from what its walls show: the share of windows and the storeys are said only where enough of all its walls was looked at.

    Parameters
    ----------
    walls : all walls, also those without a texture
    """
    area = sum(float(w.polygon.area) for w in walls)
    judged = [f for f in found if not f.reason]
    seen = sum(min(f.seen_m2, f.area_m2) for f in judged)
    share = seen / area if area > 0 else 0.0
    windows = sum(o.area for f in judged for o in f.openings if o.kind == "window")
    ratio = windows / seen if share >= LEAST_SEEN_SHARE and seen > 0 else None
    return UnitOpenings(tuple(found), _unit_storeys(walls, found), ratio, min(share, 1.0))


def find_windows(face: FacePlane, patch: Patch, parameters: WindowParameters) -> FaceOpenings:
    """Windows and doors that the rectified texture of a wall shows.

    The texture lies in the wall's plane, so the ray from the eye through a corner of a window meets the wall where the corner is: tracing it is the
    identity, but for the frame of the face.
    """
    picture = picture_of(face, patch, parameters)
    area, seen_m2 = float(face.polygon.area), float(np.count_nonzero(picture.seen)) * picture.cell**2
    if seen_m2 < LEAST_SEEN_M2:
        return FaceOpenings(face.key, (), 0, area, seen_m2, None, UNSEEN)
    if max(picture.gsd_m, picture.cell) > parameters.coarsest_m:
        return FaceOpenings(face.key, (), 0, area, seen_m2, None, TOO_COARSE)
    openings = _openings(face, picture, parameters)
    windows = [o for o in openings if o.kind == "window"]
    if sum(o.area for o in openings) / seen_m2 > parameters.most_glass:
        return FaceOpenings(face.key, (), 0, area, seen_m2, None, GLASS)
    storeys = storeys_of([o.bounds for o in windows], float(face.polygon.bounds[1]))
    ratio = sum(o.area for o in windows) / seen_m2 if seen_m2 >= LEAST_SEEN_SHARE * area else None
    return FaceOpenings(face.key, openings, storeys, area, seen_m2, ratio)


def _openings(face: FacePlane, picture: Picture, parameters: WindowParameters) -> tuple[Opening, ...]:
    looks = looks_of(picture, parameters)
    found, company, completed = searched(picture, looks, parameters)
    sure = confidence(found, company, completed, picture, looks)
    keep = sure >= parameters.least_confidence
    if not keep.any():
        return ()
    found, company, completed, sure = found.of(keep), company[keep], completed[keep], sure[keep]
    boxes = aligned(found.boxes, sure, _tolerance(picture, parameters))
    alike = in_column(found.boxes, found.boxes, _tolerance(picture, parameters)).any(axis=1)
    doors = door_like(boxes, picture) | (on_foot(found.boxes, picture) & ~alike)
    bounds, good = fitted(bounds_of([picture.bounds(b) for b in boxes]), sure, doors, face.polygon)
    made = [
        _opening(
            face, bounds[k], "door" if doors[k] else "window", float(sure[k]), (int(company[k]), bool(completed[k]))
        )
        for k in np.flatnonzero(good)
    ]
    return tuple(sorted(made, key=lambda o: (round(o.bounds[1], 1), o.bounds[0])))


def searched(
    picture: Picture, looks: Sequence[Edges], parameters: WindowParameters
) -> tuple[Candidates, IntArray, FloatArray]:
    """Boxes, their company, and which of them were only looked for because rows and columns ask for them."""
    tolerance = _tolerance(picture, parameters)
    found, company = _first(picture, looks, parameters)
    sure = confidence(found, company, np.zeros(len(found)), picture, looks) >= parameters.least_confidence
    more = _completed(picture, found.of(sure), parameters)
    more = more.of(overlap(more.boxes, found.boxes[sure])[1].max(axis=1, initial=0) < 0.1)
    both = Candidates.joined([found, more])
    late = np.repeat([0.0, 1.0], [len(found), len(more)])
    return both, support(both, tolerance), late


def _first(picture: Picture, looks: Sequence[Edges], parameters: WindowParameters) -> tuple[Candidates, IntArray]:
    """What the picture shows by itself: segments, and what follows from them."""
    panes = parameters.model_copy(
        update={"least_m": PANE * parameters.least_m, "most_aspect": parameters.most_aspect / PANE}
    )
    plain = candidates(picture, looks, panes)
    whole = fused(plain, picture, looks, panes)
    whole = Candidates.joined([whole, fused(Candidates.joined([plain, whole]), picture, looks, panes)])
    grown = framed(Candidates.joined([plain, whole]), picture, looks, panes)
    between, shut = between_shutters(plain, picture, looks, parameters)
    parts = (plain, whole, grown, between)
    found = Candidates.joined(parts)
    area = picture.cell**2 * (found.boxes[:, 2:] - found.boxes[:, :2]).prod(axis=1)
    bonus = np.repeat(BONUS, [len(p) for p in parts])
    holding = hold_panes(found.boxes, whole.boxes, picture) & (found.sides.min(axis=1) >= WHOLE)
    bonus = np.where(holding, np.maximum(bonus, BONUS[1]), bonus) + AREA_BONUS * np.minimum(area, 3)
    fits = (found.seen >= parameters.least_seen) & sized(found.boxes, picture, parameters)
    fits &= within_wall(found.boxes, picture, parameters, on_foot(found.boxes, picture))
    return chosen(found.of(fits), bonus[fits], shut[fits[len(fits) - len(shut) :]], _tolerance(picture, parameters))


def _completed(picture: Picture, found: Candidates, parameters: WindowParameters) -> Candidates:
    """Boxes at the places that rows and columns leave, where the picture shows at least half of the contrast of a window."""
    tolerance = _tolerance(picture, parameters)
    parts = [found.of(np.zeros(0, np.int64))]
    faint = parameters.model_copy(
        update={"edge_sigmas": parameters.edge_sigmas / 2, "least_contrast": parameters.least_contrast / 2}
    )
    looks = looks_of(picture, faint) if len(found) >= 2 else []
    for look in np.unique(found.look):
        asked = places(found.boxes[found.look == look], tolerance, picture.light.shape[::-1])
        if len(asked) and looks:
            made = judged(picture, looks, int(look), asked)
            good = (made.sides.mean(axis=1) >= 0.6) & (made.contrast > 1) & (made.seen >= parameters.least_seen)
            parts.append(made.of(good & within_wall(asked, picture, parameters, np.zeros(len(asked), bool))))
    more = Candidates.joined(parts)
    apart = overlap(more.boxes, found.boxes)[1].max(axis=1, initial=0) < 0.1
    more = more.of(apart)
    return chosen(more, np.zeros(len(more)), np.empty((0, 4), np.int64), tolerance)[0]


def _tolerance(picture: Picture, parameters: WindowParameters) -> float:
    return max(picture.pixels(parameters.align_m), 1.5)


def _opening(face: FacePlane, bounds: FloatArray, kind: OpeningKind, sure: float, row: tuple[int, bool]) -> Opening:
    s_0, t_0, s_1, t_1 = (float(v) for v in bounds)
    ring = np.round(face.world(np.array([[s_0, t_0], [s_1, t_0], [s_1, t_1], [s_0, t_1]])), VERTEX_DECIMALS)
    return Opening(face.key, ring, (s_0, t_0, s_1, t_1), kind, round(sure, 3), *row)


def _unit_storeys(walls: Sequence[FacePlane], found: Sequence[FaceOpenings]) -> int | None:
    """Rows over all walls, at their heights in the world."""
    foot = min((float(r[:, 2].min()) for w in walls for r in w.rings), default=0.0)
    bounds = [
        (0.0, float(o.ring[0, 2]), 1.0, float(o.ring[2, 2])) for f in found for o in f.openings if o.kind == "window"
    ]
    return storeys_of(bounds, foot) or None
