"""What is measured of every unit: how well the roof fits the points, and what an agency asks of a building."""

from __future__ import annotations

import math

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Evidence, Polyhedron, Scalar, Semantic
from cityflow.geometry.polyhedron import face_area_vectors, face_areas, volume
from cityflow.reconstruction.choose import Choice

EXPLAINED_M = 0.2
FLAT_DEG = 5.0


def measure(choice: Choice, evidence: Evidence) -> dict[str, Scalar]:
    """Attributes by name, lengths in metres, areas in m², volumes in m³; None where there is nothing to measure."""
    found: dict[str, Scalar] = {
        "method": choice.candidate.method,
        "points": len(evidence.points),
        "ground_height_m": round(evidence.ground_height, 3),
        "area_footprint_m2": round(float(evidence.outline.area), 2),
        **_roof_percentiles(evidence.points.xyz[:, 2]),
        **fit(choice.residuals),
    }
    if choice.candidate.solid is not None:
        found |= shape(choice.candidate.solid)
        found["lod"] = "1.2" if choice.candidate.method == "extruded" else "2.2"
        found["planes"] = len(roof_planes(choice.candidate.solid))
    return {key: _plain(value) for key, value in found.items()}


def fit(residuals: FloatArray) -> dict[str, Scalar]:
    """Of the points' signed vertical distances from the roof, positive above; NaN where no roof covers a point."""
    known = residuals[np.isfinite(residuals)]
    if not len(known):
        return {
            "points_covered": 0.0,
            "points_explained": 0.0,
            "bias_m": None,
            "rmse_m": None,
            "nmad_m": None,
            "le95_m": None,
        }
    bias = float(np.median(known))
    return {
        "points_covered": round(len(known) / len(residuals), 4),
        "points_explained": round(float(np.sum(np.abs(known) <= EXPLAINED_M)) / len(residuals), 4),
        "bias_m": round(bias, 4),
        "rmse_m": round(float(np.sqrt(np.mean(known**2))), 4),
        "nmad_m": round(1.4826 * float(np.median(np.abs(known - bias))), 4),
        "le95_m": round(float(np.percentile(np.abs(known), 95)), 4),
    }


def _roof_percentiles(z: FloatArray) -> dict[str, Scalar]:
    """Heights that so many per cent of the roof points do not exceed."""
    known = z[np.isfinite(z)]
    return {
        f"roof_height_p{p}_m": round(float(np.percentile(known, p)), 3) if len(known) else None
        for p in (5, 25, 50, 75, 95)
    }


def shape(solid: Polyhedron) -> dict[str, Scalar]:
    """Heights, areas, volume of a closed solid."""
    roof = solid.of_semantic(Semantic.ROOF)
    areas = dict(zip(map(id, solid.faces), face_areas(solid), strict=True))
    normals = dict(zip(map(id, solid.faces), face_area_vectors(solid), strict=True))
    slopes = np.array([_slope_deg(normals[id(f)]) for f in roof])
    sizes = np.array([areas[id(f)] for f in roof])
    corners = np.concatenate([solid.ring(r)[:, 2] for f in roof for r in f.rings])
    return {
        "volume_m3": round(volume(solid), 2),
        "area_roof_m2": round(float(sizes.sum()), 2),
        "ridge_height_m": round(float(corners.max()), 3),
        "eave_height_m": round(_eave_height(solid), 3),
        "roof_slope_deg": round(float(np.average(slopes, weights=sizes)), 1),
        "roof_is_flat": bool(np.all(slopes <= FLAT_DEG)),
    }


def roof_planes(solid: Polyhedron) -> set[int]:
    """The planes that its roof faces lie in."""
    return {f.plane for f in solid.of_semantic(Semantic.ROOF)}


def _eave_height(solid: Polyhedron) -> float:
    """Median of the lowest roof height over each wall that stands on the floor: where water would run off."""
    floor = float(solid.vertices[:, 2].min())
    eaves = []
    for face in solid.of_semantic(Semantic.WALL):
        z = solid.ring(face.rings[0])[:, 2]
        above = z[z > floor + 1e-6]
        if len(above) and len(above) < len(z):
            eaves.append(float(above.min()))
    return float(np.median(eaves)) if eaves else float(solid.vertices[:, 2].max())


def _slope_deg(normal: FloatArray) -> float:
    return math.degrees(math.atan2(math.hypot(normal[0], normal[1]), abs(normal[2])))


def _plain(value: Scalar) -> Scalar:
    return None if isinstance(value, float) and not math.isfinite(value) else value
