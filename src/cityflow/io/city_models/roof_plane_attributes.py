"""Roof planes as JSON: all planes of a building, and the plane attributes of a roof surface."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cityflow.core.building import RoofPlane, Scalar


def plane_attributes(plane: RoofPlane) -> dict[str, Scalar]:
    """What a roof surface says of its plane; a level plane has no aspect."""
    known: dict[str, Scalar] = {"slope_deg": round(plane.slope_deg, 4), "points": int(plane.points)}
    if math.isfinite(plane.aspect_deg):
        known["aspect_deg"] = round(plane.aspect_deg, 4)
    figures = (("rmse", plane.rmse), ("sigma_height_m", plane.sigma_height), ("sigma_slope_deg", plane.sigma_slope_deg))
    known |= {name: round(float(value), 4) for name, value in figures if math.isfinite(value)}
    return known if plane.seen == 1.0 else known | {"seen_share": round(float(plane.seen), 3)}


def counted_points(points: int | None) -> dict[str, Scalar]:
    """What the surface of a face without a plane says of the points that show it."""
    return {} if points is None else {"points": points}


def plane_json(plane: RoofPlane) -> dict[str, Any]:
    """All of a plane, so that it comes back bit for bit."""
    return {
        "slope_x": float(plane.slope_x),
        "slope_y": float(plane.slope_y),
        "height": float(plane.height),
        "origin": [float(plane.origin[0]), float(plane.origin[1])],
        "points": int(plane.points),
        "rmse": number_or_none(plane.rmse),
        "sigma_height": number_or_none(plane.sigma_height),
        "sigma_slope_deg": number_or_none(plane.sigma_slope_deg),
        "seen": float(plane.seen),
    }


def plane_of(plane: Mapping[str, Any]) -> RoofPlane:
    """The plane that `plane_json` gave."""
    rmse, height, slope = (
        math.nan if plane.get(k) is None else plane[k] for k in ("rmse", "sigma_height", "sigma_slope_deg")
    )
    x, y = plane["origin"]
    first = plane["slope_x"], plane["slope_y"], plane["height"], (x, y), plane["points"]
    return RoofPlane(*first, rmse, height, slope, plane.get("seen", 1.0))


def number_or_none(value: float) -> float | None:
    """JSON has no NaN."""
    return float(value) if math.isfinite(value) else None
