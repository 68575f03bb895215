"""What figures of a run are made of: counts and values of its buildings, from rows, or from the counts of a whole city."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict, verdict_counts
from cityflow.viewer.report_rows import UnitRow

RATIO, STOREYS, COUNT, MISSING = "window_to_wall_ratio", "storeys_by_windows", "windows", "windows_missing"
ROOF_TYPE, CLAIM, OVERHANG = "roof_type", "claimed_rmse_m", "overhang_max_m"
MEASURES = ("nmad", "rmse", "bias", "share_explained")
Counts = Mapping[str, Mapping[str, int]]


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitFigures:
    """Of all buildings; values are finite and in no order.

    Attributes
    ----------
    status : how they ended;  verdicts : `verdicts_of`;  texts : lod, method, roof_type, windows_missing → value → buildings
    models : buildings with a method
    values : nmad, rmse, bias, share_explained, planes, good_probability; claimed_rmse_m of models; figures of windows
    seconds : of every building;  peak_mb : the highest, None where there is none
    reaches : of overhangs, metres;  with_overhangs : buildings that have some; None if not searched
    """

    status: Counter[str]
    verdicts: dict[str, int]
    texts: Mapping[str, Counter[str]]
    models: int
    values: Mapping[str, Sequence[float]]
    seconds: Sequence[float]
    peak_mb: float | None
    reaches: Sequence[float]
    with_overhangs: int | None

    @property
    def units(self) -> int:
        return self.status.total()

    @classmethod
    def of(cls, units: Sequence[UnitRow]) -> Self:
        """From rows."""
        made = [u for u in units if u.method]
        searched = any(OVERHANG in u.attributes for u in made)
        return cls(
            status=Counter(str(u.status) for u in units),
            verdicts=verdicts_of(units),
            texts={
                "lod": Counter(u.lod for u in units if u.lod), "method": Counter(u.method for u in made),
                ROOF_TYPE: Counter(str(u.attributes[ROOF_TYPE]) for u in made if u.attributes.get(ROOF_TYPE)),
                MISSING: Counter(str(why) for u in units if (why := u.attributes.get(MISSING))),
            },
            models=len(made),
            values={
                **{name: measured(units, name) for name in (*MEASURES, "planes", "good_probability")},
                CLAIM: _known(made, CLAIM), **{name: _known(units, name) for name in (RATIO, STOREYS, COUNT)},
            },
            seconds=[u.seconds for u in units],
            peak_mb=max((u.peak_mb for u in units), default=None),
            reaches=[r for u in made for r in u.reaches_m],
            with_overhangs=sum(bool(u.reaches_m) for u in made) if searched else None,
        )  # fmt: skip

    @classmethod
    def of_counts(cls, counts: Counts, seconds: Sequence[float], peak_mb: float | None) -> Self:
        """From `handover.unit_counts`: numbers are rounded as these are."""
        judged, overhangs = counts["verdict"], counts["with_overhangs"]
        verdicts = {v.value: judged.get(v.value, 0) for v in Verdict}
        names = (*MEASURES, "planes", "good_probability", CLAIM, RATIO, STOREYS, COUNT)
        return cls(
            status=Counter(counts["status"]),
            verdicts={**verdicts, "unjudged": sum(judged.values()) - sum(verdicts.values())},
            texts={name: Counter(counts[name]) for name in ("lod", "method", ROOF_TYPE, MISSING)},
            models=sum(counts["method"].values()),
            values={name: _repeated(counts[name]) for name in names},
            seconds=seconds,
            peak_mb=peak_mb,
            reaches=_repeated(counts["reach_m"]),
            with_overhangs=overhangs.get("yes", 0) if overhangs else None,
        )


def verdicts_of(units: Sequence[UnitRow]) -> dict[str, int]:
    """Buildings by verdict, failed ones being poor; refused outlines have none, and those not judged are counted apart."""
    made = [u for u in units if u.status is not Status.REFUSED]
    judged = [u for u in made if u.verdict or u.status is Status.FAILED]
    return {
        **{v.value: n for v, n in verdict_counts(u.verdict for u in judged).items()},
        "unjudged": len(made) - len(judged),
    }


def measured(units: Iterable[UnitRow], name: str) -> list[float]:
    """Finite values of a measure."""
    values = (getattr(u, name) for u in units)
    return [float(v) for v in values if v is not None and math.isfinite(v)]


def quantile(values: Sequence[float], share: float) -> float | None:
    return float(np.quantile(values, share)) if len(values) else None


def _known(units: Sequence[UnitRow], key: str) -> list[float]:
    values = (u.attributes.get(key) for u in units)
    return [float(v) for v in values if isinstance(v, int | float) and not isinstance(v, bool) and v == v]


def _repeated(counts: Mapping[str, int]) -> list[float]:
    found: list[float] = np.repeat([float(v) for v in counts], list(counts.values())).tolist()
    return found
