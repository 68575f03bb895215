"""Figures of many models in one column, with their targets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.evaluation.models import ModelErrors
from cityflow.evaluation.models_overhangs import shares_within

ASKED = {
    "planes right (± 1)": "≥ 95 %", "type right": "≥ 95 %", "area within 0.15 m": "≥ 97 %", "ridge ends RMSE m": "≤ 0.25",
    "corners median m": "≤ 0.12", "corners mean m": "≤ 0.2", "overhang median m": "≤ 0.08", "overhang within 2 GSD": "≥ 90 %",
    "edges with invented overhang": "0", "valid": "100 %", "claims kept": "≥ 90 %", "s median": "≤ 0.2 (all ≤ 2)", "s worst": "≤ 10 medians",
}  # fmt: skip


def summary(results: Sequence[tuple[ModelErrors, float]], gsd_m: float) -> dict[str, str]:
    """One column: figures of all units together, with the seconds that each took."""
    errors, seconds = [e for e, _ in results], np.array([s for _, s in results])
    overhang = np.abs(_joined([e.overhangs.errors_m for e in errors]))
    shares = shares_within([e.overhangs for e in errors], 2 * gsd_m)
    return {
        "units": str(len(errors)),
        "valid": _percent([not e.fault for e in errors]),
        "planes right (± 1)": _percent([e.planes_right for e in errors]),
        "planes exactly right": _percent([e.planes == e.true_planes for e in errors]),
        "faces narrower than 0.1 m": str(sum(e.slivers for e in errors)),
        "type right": _percent([e.type_right for e in errors]),
        "area within 0.15 m": _share(
            sum(e.surface.within * e.surface.area_m2 for e in errors), sum(e.surface.area_m2 for e in errors)
        ),
        "units with 97 % of it": _percent([e.surface.within >= 0.97 for e in errors]),
        "RMSE median m": _median([e.surface.rmse_m for e in errors]),
        "RMSE in space median m": _median([e.surface.rmse_3d_m for e in errors]),
        **_points(errors),
        "overhangs": str(len(overhang)),
        "overhang median m": _number(np.median(overhang)) if len(overhang) else "",
        "overhang within 2 GSD": _percent(overhang <= 2 * gsd_m),
        "edges that state one": _ratio(shares.stated),
        "of these within 2 GSD": _ratio(shares.stated_within),
        "edges without overhang": str(sum(len(e.overhangs.bare_m) for e in errors)),
        "edges with invented overhang": str(sum(e.overhangs.invented for e in errors)),
        "greatest of them m": _number(max((float(e.overhangs.bare_m.max(initial=0.0)) for e in errors), default=0.0)),
        "claims (RMSE ≤ 0.1 m)": str(sum(e.claims for e in errors)),
        "claims kept": _percent([e.keeps_claim for e in errors if e.claims]),
        "have it": _percent([e.surface.rmse_3d_m <= 0.1 for e in errors]),
        "s median": _number(np.median(seconds)),
        "s worst": _number(seconds.max()),
    }


def _points(errors: Sequence[ModelErrors]) -> dict[str, str]:
    ridge, corners = (_joined([getattr(e, n).distances for e in errors]) for n in ("ridge_ends", "corners"))
    return {
        "ridge ends RMSE m": _number(float(np.sqrt(np.mean(ridge**2)))) if len(ridge) else "",
        "ridge ends median m": _number(np.median(ridge)) if len(ridge) else "",
        "ridge ends matched, missed, invented": f"{len(ridge)}, {sum(e.ridge_ends.missed for e in errors)}, {sum(e.ridge_ends.invented for e in errors)}",
        "corners median m": _number(np.median(corners)) if len(corners) else "",
        "corners mean m": _number(float(np.mean(corners))) if len(corners) else "",
        "corners matched, missed, invented": f"{len(corners)}, {sum(e.corners.missed for e in errors)}, {sum(e.corners.invented for e in errors)}",
    }


def _joined(parts: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate(parts) if parts else np.empty(0)


def _median(values: Sequence[float]) -> str:
    known = np.array(values)[np.isfinite(values)]
    return _number(float(np.median(known))) if len(known) else ""


def _percent(right: Sequence[bool] | BoolArray) -> str:
    return _share(float(np.sum(right)), len(right))


def _ratio(share: float) -> str:
    return f"{100 * share:.1f} %" if np.isfinite(share) else ""


def _share(part: float, whole: float) -> str:
    return f"{100 * part / whole:.1f} %" if whole else ""


def _number(value: float) -> str:
    return f"{value:.3f}"
