"""Rows of a made-up town of terraced houses."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.building import Status
from cityflow.viewer.report_rows import EditRow, ProblemRow, Product, ReportData, Source, StageRow, UnitRow

REASONS = {
    Status.DONE: "",
    Status.DEGRADED: "the roof with 14 planes would not close: one plane per part instead",
    Status.FAILED: "killed after 600.2 s: time limit of 600 s",
    Status.REFUSED: "the outline has no area",
}


def town(count: int, seed: int = 0) -> ReportData:
    """`count` houses in rows that follow curved streets."""
    rng = np.random.default_rng(seed)
    units = tuple(_house(i, rng, count) for i in range(count))
    stages = tuple(
        StageRow(name, n, n - 1, 0, 1, 0, n * t, t, 3 * t, m)
        for name, n, t, m in (
            ("ingest", 2, 4.0, 480.0),
            ("surface", 25, 1.7, 690.0),
            ("outline", 25, 0.2, 300.0),
            ("reconstruct", max(count, 1), 0.06, 410.0),
            ("export", 26, 0.4, 350.0),
        )
    )
    return ReportData(
        title="A made-up town",
        workflow="lidar_city",
        crs="Amersfoort / RD New (EPSG:28992)",
        vertical_datum="NAP height (EPSG:5709)",
        units=units,
        stages=stages,
        problems=(ProblemRow("surface", "340_1791", Status.FAILED, "no ground point within 50 m"),),
        products=(
            Product("products/city.city.jsonl", "CityJSON", "All buildings at LoD 0, 1.2, 1.3 and 2.2"),
            Product("products/citygml", "CityGML 2.0", "One file per ground tile"),
        ),
        sources=(Source("AHN3", "CC0-1.0", "Rijkswaterstaat"),),
        versions={"numpy": "2.4", "cityflow": "0.1.0"},
        parameters={
            "surface": {"cell_m": 0.5, "dtm": {"method": "classes"}},
            "reconstruct": {"planes": {"angle_deg": 15}},
        },
        unused_edits=(EditRow("roof_types", "hip", (85001.5, 447002.25), "touches no building", "move the point"),),
        overrides={"NL.0503.000000": {"planes": {"angle_deg": 25}}},
    )


VERDICTS = {Status.DONE: "good", Status.DEGRADED: "look", Status.FAILED: "poor", Status.REFUSED: ""}


def _house(i: int, rng: np.random.Generator, count: int) -> UnitRow:
    per_row = max(int(np.sqrt(count * 2)), 1)
    row, place = divmod(i, per_row)
    depth, width = rng.uniform(8, 11), 5.4 + 3 * (rng.random() < 0.1)
    bend = 12 * np.sin(place / 9 + row / 3)
    corner = np.array([85000.0 + 6 * place + 14 * (place // 12), 447000.0 + 32 * row + bend])
    ring = np.array([(0, 0), (width, 0.4), (width, depth), (width / 2, depth + 1.5), (0, depth)]) + corner
    status = rng.choice([Status.DONE, Status.DEGRADED, Status.FAILED, Status.REFUSED], p=[0.93, 0.04, 0.02, 0.01])
    status = Status(status)
    modelled = status in (Status.DONE, Status.DEGRADED)
    return UnitRow(
        id=f"NL.0503.{i:06d}",
        tile=f"{int(corner[0] // 250)}_{int(corner[1] // 250)}",
        status=status,
        reason=REASONS[status],
        method=("partition" if status is Status.DONE else "extruded") if modelled else "",
        lod=("2.2" if status is Status.DONE else "1.3") if modelled else "",
        planes=int(rng.geometric(0.3)) if modelled else 0,
        nmad=float(rng.lognormal(-3.3, 0.5)) if modelled else None,
        rmse=float(rng.lognormal(-2.8, 0.5)) if modelled else None,
        bias=float(rng.normal(0, 0.01)) if modelled else None,
        le95=float(rng.lognormal(-2.3, 0.5)) if modelled else None,
        share_explained=float(rng.beta(60, 1)) if modelled else None,
        seconds=600.2 if status is Status.FAILED else float(rng.lognormal(-2.9, 0.6)),
        peak_mb=float(rng.uniform(280, 420)),
        rings=(ring,),
        attributes={
            "bouwjaar": int(rng.integers(1890, 2020)),
            "ridge_height": float(rng.uniform(6, 14)),
            **({"roof_type": "gable", "claimed_rmse_m": 0.08, "overhang_max_m": 0.4} if modelled else {}),
        },
        reaches_m=(0.3, 0.4) if modelled else (),
        verdict=VERDICTS[status],
        verdict_reason="9 % of the roof has no points nearby" if status is Status.DEGRADED else "",
        good_probability={"good": 0.97, "look": 0.5, "poor": 0.0}.get(VERDICTS[status]),
    )


@pytest.fixture(scope="session")
def small_town() -> ReportData:
    return town(160)
