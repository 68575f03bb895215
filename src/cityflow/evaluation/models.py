"""Comparison of a building model with the truth: roof planes, roof type, heights, ridge ends, corners, overhangs, claimed accuracy."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import EdgeOverhang, Polyhedron, RoofPlane, Semantic
from cityflow.core.roof_type_names import RoofType
from cityflow.evaluation.models_overhangs import OverhangErrors, overhang_errors
from cityflow.evaluation.models_planes import model_surfaces, slivers, whole_planes
from cityflow.evaluation.models_points import Matched, match_points, outline_corners
from cityflow.evaluation.models_ridges import model_ridge_ends, true_ridge_ends
from cityflow.evaluation.models_surface import SurfaceErrors, surface_errors
from cityflow.evaluation.roof_planes import RoofSurface
from cityflow.geometry.validity import check_polyhedron

CLAIM_M = 0.1
"""A model that claims this RMSE or less counts as one that claims to be exact (docs/reconstruction.md)."""


@dataclass(frozen=True, slots=True)
class TrueModel:
    """A building as it is.

    Attributes
    ----------
    id : of the unit;  shape : what it was made as
    walls, roof : outlines in plan, world metres
    surfaces : what is seen from above, without overlap, chimneys left out: polygon in plan and plane
    types : roof types that are right; the first is the best name
    unjudged : places in plan where heights are not looked at (chimneys)
    """

    id: str
    shape: str
    walls: Polygon
    roof: Polygon
    surfaces: tuple[RoofSurface, ...]
    types: tuple[RoofType, ...]
    unjudged: tuple[Polygon, ...] = ()


@dataclass(frozen=True, slots=True)
class Model:
    """What was made of it; `claimed_rmse_m` is what the model says of itself, NaN where it says nothing."""

    solid: Polyhedron | None
    planes: tuple[RoofPlane, ...] = ()
    roof_type: str = ""
    overhangs: tuple[EdgeOverhang, ...] = ()
    claimed_rmse_m: float = float("nan")


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """Figures of one building.

    Attributes
    ----------
    true_planes, planes : connected roof planes of at least 2 m² within the walls (`models_planes`)
    true_type, roof_type : names;  type_right : among those that are right
    surface : heights of the roof
    ridge_ends : ends of level ridges, within the walls;  corners : of the ground, in plan
    overhangs : per edge of the walls
    slivers : roof faces narrower than 0.1 m
    fault : first fault of the solid, empty for a valid one
    claimed_rmse_m : as in `Model`
    """

    id: str
    shape: str
    true_planes: int
    planes: int
    true_type: str
    roof_type: str
    type_right: bool
    surface: SurfaceErrors
    ridge_ends: Matched
    corners: Matched
    overhangs: OverhangErrors
    slivers: int = 0
    fault: str = ""
    claimed_rmse_m: float = field(default=float("nan"))

    @property
    def planes_right(self) -> bool:
        """The right number of planes, or one more or fewer."""
        return abs(self.planes - self.true_planes) <= 1

    @property
    def claims(self) -> bool:
        return self.claimed_rmse_m <= CLAIM_M

    @property
    def keeps_claim(self) -> bool:
        return self.claims and self.surface.rmse_3d_m <= CLAIM_M


def compare_model(truth: TrueModel, model: Model) -> ModelErrors:
    """All figures of one model. A unit without a solid has no planes, no type, and nothing of its roof is right."""
    right = tuple(t.value for t in truth.types)
    surfaces = [] if model.solid is None else model_surfaces(model.solid)
    planes = whole_planes(surfaces, truth.walls)
    ends = np.empty((0, 3)) if model.solid is None else model_ridge_ends(model.solid, truth.walls)
    found = np.empty((0, 2)) if model.solid is None else ground_corners(model.solid)
    return ModelErrors(
        truth.id,
        truth.shape,
        len(whole_planes(truth.surfaces, truth.walls)),
        len(planes),
        right[0] if right else "",
        model.roof_type,
        model.solid is not None and model.roof_type in right,
        surface_errors(truth.surfaces, truth.walls, truth.unjudged, model.solid),
        match_points(true_ridge_ends(truth.surfaces, truth.walls), ends),
        match_points(outline_corners(truth.walls), found),
        overhang_errors(truth.walls, truth.roof, model.overhangs),
        slivers(surfaces),
        _fault(model.solid),
        model.claimed_rmse_m,
    )


def ground_corners(solid: Polyhedron) -> FloatArray:
    """(n, 2) corners of the floor, metres; vertices on straight edges are none."""
    floors = [Polygon(solid.ring(f.rings[0])[:, :2], [solid.ring(r)[:, :2] for r in f.rings[1:]]) for f in solid.of_semantic(Semantic.GROUND)]  # fmt: skip
    whole = shapely.union_all(shapely.buffer(floors, 0.0)) if floors else Polygon()
    parts = [p for p in shapely.get_parts(whole) if isinstance(p, Polygon) and not p.is_empty]
    return np.concatenate([outline_corners(p) for p in parts]) if parts else np.empty((0, 2))


def _fault(solid: Polyhedron | None) -> str:
    if solid is None:
        return "no solid"
    faults = check_polyhedron(solid)
    return f"{faults[0].code} {faults[0].name} {faults[0].where}".strip() if faults else ""
