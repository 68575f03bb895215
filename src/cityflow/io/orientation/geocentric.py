"""Poses in geocentric coordinates, led to a map: the world's axes are those of the map at each camera."""

from __future__ import annotations

import numpy as np
from pyproj import CRS, Transformer

from cityflow.core.arrays import FloatArray
from cityflow.geometry.rotations import nearest_rotation

STEP_M = 10.0
"""Half the distance over which the world's axes at a camera are taken from the map projection."""


def geocentric_to_map(datum: CRS, goal: CRS) -> Transformer:
    """From geocentric coordinates of a geographic CRS's datum to east, north and ellipsoidal height in the horizontal part of `goal`."""
    flat = goal.sub_crs_list[0] if goal.is_compound else goal
    return Transformer.from_crs(CRS.from_json_dict(_geocentric(datum)), flat.to_3d(), always_xy=True)


def on_map(projection: Transformer, place: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """World centre, NaN where the place is outside the map, and (3, 3) world_from_camera of a pose in geocentric coordinates.

    Parameters
    ----------
    place : (3,) metres;  axes : (3, 3) geocentric_from_camera
    """
    steps = np.concatenate([np.eye(3), -np.eye(3)]) * STEP_M
    moved = np.stack(projection.transform(*(place + np.vstack([steps, np.zeros(3)])).T), axis=1)
    if not np.isfinite(moved).all():
        return np.full(3, np.nan), axes
    # columns: where the geocentric axes lead on the map
    lead = (moved[:3] - moved[3:6]).T / (2 * STEP_M)
    return moved[6], nearest_rotation(lead) @ axes


def _geocentric(datum: CRS) -> dict[str, object]:
    """The geocentric CRS of a geographic one's datum."""
    tree = datum.to_json_dict()
    kept = {k: tree[k] for k in ("datum", "datum_ensemble") if k in tree}
    axes = [
        {"name": f"Geocentric {a}", "abbreviation": a, "direction": f"geocentric{a}", "unit": "metre"} for a in "XYZ"
    ]
    return {
        "type": "GeodeticCRS", "name": f"{datum.name} (geocentric)", **kept,
        "coordinate_system": {"subtype": "Cartesian", "axis": axes},
    }  # fmt: skip
