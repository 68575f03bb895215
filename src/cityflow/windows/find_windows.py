"""Windows and doors of walls, from their rectified textures (Frommholz 2017, section 6, extended by rows and columns)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS, Semantic
from cityflow.core.openings import FaceOpenings, Opening, OpeningKind, UnitOpenings
from cityflow.core.texture import FaceKey, FacePlane, Patch
from cityflow.windows.facade_picture import Picture, picture_of
from cityflow.windows.fitting import fitted
from cityflow.windows.panels import JOINT_PX, barred, panelled
from cityflow.windows.storeys import storeys_of
from cityflow.windows.window_parameters import WindowParameters
from cityflow.windows.window_search import LEAST_KEPT, Found, found_on

MOST_GLASS = 0.6
"""Share of a wall covered by openings from which it is a glass façade; set by hand on drawn façades."""

TOO_COARSE = "the texture is too coarse for windows"
UNSEEN = "too little of the wall is seen in images"
GLASS = "a glass façade: windows cannot be told from reflections"
PANELS = "a façade of panels, panes or beams: windows cannot be separated"
SURE, FEW, LIKELY, MANY = 0.9, 4, 0.7, 8
"""Confidence and number of windows from which a wall with bars over its whole length is no glass; of likely ones also at least half; set by hand."""
LEAST_SEEN_M2 = 0.5
"""Less of a wall than this is not looked at: less than a window; set by hand."""
LEAST_SEEN_SHARE = 0.25
"""Least area of a wall, and least share of a wall and of all walls of a unit, with true texture: less is not representative; set by hand on drawn façades."""


def find_unit_windows(
    faces: Iterable[FacePlane], patches: Mapping[FaceKey, Patch], parameters: WindowParameters
) -> UnitOpenings:
    """Openings of all walls of a unit that have a texture; `patches` are its rectified ones."""
    walls = [f for f in faces if f.semantic is Semantic.WALL]
    return unit_openings(walls, [find_windows(f, patches[f.key], parameters) for f in walls if f.key in patches])


def unit_openings(walls: Sequence[FacePlane], found: Sequence[FaceOpenings]) -> UnitOpenings:
    """Openings of a unit from those of its walls. The share of windows and the storeys are given only where enough of all walls was seen.

    Parameters
    ----------
    walls : all walls, also those without a texture
    """
    area = sum(float(w.polygon.area) for w in walls)
    examined = [f for f in found if not f.reason]
    seen = sum(min(f.seen_m2, f.area_m2) for f in examined)
    share = seen / area if area > 0 else 0.0
    windows = sum(o.area for f in examined for o in f.openings if o.kind == "window")
    ratio = windows / seen if share >= LEAST_SEEN_SHARE and seen > 0 else None
    return UnitOpenings(tuple(found), _unit_storeys(walls, found), ratio, min(share, 1.0))


def find_windows(face: FacePlane, patch: Patch, parameters: WindowParameters) -> FaceOpenings:
    """Windows and doors that the rectified texture of a wall shows.

    The rectified texture lies in the wall's plane, so corners are only transformed from the frame of the face to the world.
    """
    picture = picture_of(face, patch, parameters)
    area, seen_m2 = float(face.polygon.area), float(np.count_nonzero(picture.seen)) * picture.cell**2
    if seen_m2 < LEAST_SEEN_M2:
        return FaceOpenings(face.key, (), 0, area, seen_m2, None, UNSEEN)
    if max(picture.gsd_m, picture.cell) > parameters.coarsest_m:
        return FaceOpenings(face.key, (), 0, area, seen_m2, None, TOO_COARSE)
    found = found_on(picture, parameters)
    openings = _openings(face, found, parameters)
    covered = sum(o.area for o in openings)
    telling = (found.sure >= LEAST_KEPT) | found.lattice
    if panelled(found.bounds[telling], JOINT_PX * picture.cell):
        return FaceOpenings(face.key, (), 0, area, seen_m2, None, PANELS)
    windows = [o for o in openings if o.kind == "window"]
    if covered > MOST_GLASS * seen_m2 or _is_glass(openings, picture):
        return FaceOpenings(face.key, (), 0, area, seen_m2, None, GLASS)
    storeys = storeys_of([o.bounds for o in windows], float(face.polygon.bounds[1]))
    ratio = sum(o.area for o in windows) / seen_m2 if seen_m2 >= LEAST_SEEN_SHARE * area else None
    return FaceOpenings(face.key, openings, storeys, area, seen_m2, ratio)


def _is_glass(openings: Sequence[Opening], picture: Picture) -> bool:
    """Whether bars cover the whole façade; windows of high confidence outweigh them."""
    sure, likely = (sum(o.confidence >= least for o in openings) for least in (SURE, LIKELY))
    if sure >= FEW or likely >= max(MANY, len(openings) / 2):
        return False
    return barred(picture, likely == 0)


def _openings(face: FacePlane, found: Found, parameters: WindowParameters) -> tuple[Opening, ...]:
    """Boxes that are sure enough, as holes of the wall."""
    found = found.of(found.sure >= parameters.least_confidence)
    bounds, good = fitted(found.bounds, found.sure, found.doors, face.polygon)
    made = [_opening(face, bounds[k], found, int(k)) for k in np.flatnonzero(good)]
    return tuple(sorted(made, key=lambda o: (round(o.bounds[1], 1), o.bounds[0])))


def _opening(face: FacePlane, bounds: FloatArray, found: Found, k: int) -> Opening:
    s_0, t_0, s_1, t_1 = (float(v) for v in bounds)
    ring = np.round(face.world(np.array([[s_0, t_0], [s_1, t_0], [s_1, t_1], [s_0, t_1]])), VERTEX_DECIMALS)
    kind: OpeningKind = "door" if found.doors[k] else "window"
    sure, support = round(float(found.sure[k]), 3), int(found.support[k])
    return Opening(face.key, ring, (s_0, t_0, s_1, t_1), kind, sure, support, bool(found.completed[k]))


def _unit_storeys(walls: Sequence[FacePlane], found: Sequence[FaceOpenings]) -> int | None:
    """Rows over all walls, by heights in the world."""
    base = min((float(r[:, 2].min()) for w in walls for r in w.rings), default=0.0)
    bounds = [
        (0.0, float(o.ring[0, 2]), 1.0, float(o.ring[2, 2])) for f in found for o in f.openings if o.kind == "window"
    ]
    return storeys_of(bounds, base) or None
