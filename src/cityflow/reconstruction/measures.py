"""Attributes of a finished unit: method, fit to the points, size."""

from __future__ import annotations

import math

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Lod, Polyhedron, RoofPlane, Scalar, Semantic
from cityflow.core.json_values import rounded
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.polyhedron import face_areas, volume
from cityflow.geometry.roof_distances import summarise
from cityflow.geometry.roof_type import roof_type
from cityflow.reconstruction.choose import Choice
from cityflow.reconstruction.verdicts.no_roof import NAMES
from cityflow.reconstruction.verdicts.roof_fit import RoofFit, fit_of


def measure(choice: Choice, evidence: Evidence, fit: RoofFit | None = None) -> dict[str, Scalar]:
    """Attributes of one unit, snake_case with units (metres where none is named); None where unknown.

    `fit` says which points are no roof: they are counted, and leave all figures of the fit; found here where it is not given.
    """
    solid, candidate = choice.candidate.solid, choice.candidate
    chosen: dict[str, Scalar] = {
        "method": candidate.method,
        "roof_points": len(evidence.points),
        "points_per_m2": rounded(len(evidence.points) / evidence.outline.area),
        "ground_height_m": rounded(evidence.ground_height),
        "footprint_area_m2": rounded(evidence.outline.area),
    }
    if solid is None:
        return chosen
    return {
        **chosen,
        "lod": str(Lod.LOD12 if candidate.method == "extruded" else Lod.LOD22),
        "planes": len(used_planes(solid, candidate.planes)),
        "roof_faces": len(solid.of_semantic(Semantic.ROOF)),
        "roof_type": candidate.roof_type or str(roof_type(solid, candidate.planes)),
        **_fit(fit or fit_of(solid, evidence)),
        "claimed_rmse_m": candidate.notes.get("claimed_rmse_m"),
        **_heights(solid, evidence.points.xyz[:, 2]),
        **_overhangs(candidate),
        **_sizes(solid),
    }


def used_planes(solid: Polyhedron, planes: tuple[RoofPlane, ...]) -> list[RoofPlane]:
    """Planes that at least one roof face lies on."""
    used = {f.plane for f in solid.of_semantic(Semantic.ROOF) if f.plane >= 0}
    return [planes[k] for k in sorted(used)]


def _fit(fit: RoofFit) -> dict[str, Scalar]:
    d = summarise(fit.distance[fit.roof])
    figures = {
        "bias": d.bias,
        "rmse": d.rmse,
        "nmad": d.nmad,
        "le95": d.le95,
        "share_explained": d.within_20cm,
        "share_covered": d.covered,
    }
    counts = {f"points_{name}": int((fit.kinds == kind).sum()) for kind, name in NAMES.items()}
    return {**{name: rounded(value, 4) for name, value in figures.items()}, **counts}


def _overhangs(candidate: Candidate) -> dict[str, Scalar]:
    """Mean over the edges that stand out, by length, and the largest; nothing if not searched."""
    if not candidate.overhangs:
        return {}
    out = [o for o in candidate.overhangs if o.reach_m > 0]
    length = sum(o.line.length for o in out)
    mean = sum(o.reach_m * o.line.length for o in out) / length if length else 0.0
    return {"overhang_mean_m": rounded(mean), "overhang_max_m": rounded(max((o.reach_m for o in out), default=0.0))}


def _heights(solid: Polyhedron, z: FloatArray) -> dict[str, Scalar]:
    """Ridge: highest point of the roof; eave: lowest corner of any roof face."""
    corners = np.concatenate([solid.ring(f.rings[0])[:, 2] for f in solid.of_semantic(Semantic.ROOF)])
    found: dict[str, Scalar] = {"ridge_height_m": rounded(corners.max()), "eave_height_m": rounded(corners.min())}
    finite = z[np.isfinite(z)]
    percents = (5, 50, 70, 95)
    for percent, value in zip(
        percents, np.percentile(finite, percents) if len(finite) else [math.nan] * 4, strict=True
    ):
        found[f"roof_height_p{percent:02d}_m"] = rounded(value)
    return found


def _sizes(solid: Polyhedron) -> dict[str, Scalar]:
    areas = face_areas(solid)
    kinds = np.array([f.semantic.value for f in solid.faces])
    return {
        "volume_m3": rounded(volume(solid)),
        "roof_area_m2": rounded(areas[kinds == Semantic.ROOF.value].sum()),
        "wall_area_m2": rounded(areas[kinds == Semantic.WALL.value].sum()),
    }
