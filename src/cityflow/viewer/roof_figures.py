"""Figures of roofs for readers who do not model cities: types, expected errors, eaves, methods."""

from __future__ import annotations

from collections import Counter
from typing import Any

from cityflow.core.roof_type_names import RoofType
from cityflow.viewer.unit_figures import CLAIM, ROOF_TYPE, UnitFigures, quantile

CLAIMS_M = (0.1, 0.2)

TYPE_TEXTS: dict[str, str] = {
    RoofType.FLAT: "level, or nearly so",
    RoofType.STEPPED_FLAT: "level parts at several heights",
    RoofType.SHED: "one slope",
    RoofType.GABLE: "two slopes that meet in a ridge, upright walls at both ends",
    RoofType.HIP: "a ridge, slopes on all sides",
    RoofType.HALF_HIP: "a ridge whose ends slope in their upper part only",
    RoofType.PYRAMID: "slopes on all sides that meet in one point",
    RoofType.MANSARD: "slopes that are steep below and gentle above",
    RoofType.CONE: "round, to a point",
    RoofType.DOME: "round, vaulted",
    RoofType.SAWTOOTH: "several ridges side by side, as on factories",
    RoofType.BUTTERFLY: "two slopes that fall to the middle",
    RoofType.COMPLEX: "a combination of these",
    RoofType.UNKNOWN: "not recognised",
}

METHOD_TEXTS = {
    "orientation_histogram": "planes found by the directions that points lie in",
    "monolithic": "walls and roof planes found together in a grid of cells",
    "volumetric": "surfaces intersected in space; steps, passages and set-backs",
    "roof_types": "known shapes of roofs fitted to edges in the picture and to heights",
    "primitives": "straight cuts and simple shapes, for few points",
    "extruded": "a block with a flat top",
}


def roof_figures(found: UnitFigures) -> dict[str, Any]:
    """Counts of modelled buildings by roof type, by expected error and by method; edges that stand out beyond walls."""
    types, methods = found.texts[ROOF_TYPE], found.texts["method"]
    return {
        "models": found.models,
        "types": [{"type": t, "text": TYPE_TEXTS.get(t, ""), "count": n} for t, n in _ranked(types)],
        "claims": _claims(found),
        "overhangs": _overhangs(found),
        "methods": [{"method": m, "text": METHOD_TEXTS.get(m, ""), "count": n} for m, n in _ranked(methods)],
    }


def _ranked(counts: Counter[str]) -> list[tuple[str, int]]:
    return sorted(counts.items(), key=lambda entry: (-entry[1], entry[0]))


def _claims(found: UnitFigures) -> dict[str, Any] | None:
    """How many models expect an error of no more than each of `CLAIMS_M`; None where no model says anything."""
    known = found.values[CLAIM]
    if not known:
        return None
    within = [{"most_m": most, "count": sum(v <= most for v in known)} for most in CLAIMS_M]
    return {
        "within": within, "more": sum(v > CLAIMS_M[-1] for v in known), "unknown": found.models - len(known),
        "median_m": quantile(known, 0.5),
    }  # fmt: skip


def _overhangs(found: UnitFigures) -> dict[str, Any] | None:
    """Edges whose roof reaches beyond the wall; None if not searched."""
    if found.with_overhangs is None:
        return None
    return {
        "buildings": found.with_overhangs, "edges": len(found.reaches),
        "median_m": quantile(found.reaches, 0.5), "longest_m": max(found.reaches, default=None),
    }  # fmt: skip
