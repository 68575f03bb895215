"""The report of an orientation: counts, weak and left-out images and known points stand on its page and in the report of a run with its catalog."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.catalog.stac import Catalog, ImageAsset, read_catalog
from cityflow.io.catalog.stac_write import write_catalog
from cityflow.io.crs import resolve
from cityflow.reporting.orientation_doubts import orientation_figures
from cityflow.reporting.orientation_report import FIGURES, PAGE, Oriented, write_orientation_report
from cityflow.viewer.orientation_rows import TiePoints
from cityflow.viewer.report import write_report
from cityflow.viewer.report_rows import ReportData

CAMERA = Camera(4000, 3000, 3600.0, 3600.0, 2000.0, 1500.0)


def images() -> list[OrientedImage]:
    """Twelve images 100 m over the ground; some look aside."""
    return [
        OrientedImage(
            f"i{k:02d}", CAMERA, from_omega_phi_kappa(*np.radians([0.0, (0, 20, -35)[k // 4], 5.0])), np.array([20.0 * (k % 4), 25.0 * (k // 4), 100.0])
        )
        for k in range(12)
    ]  # fmt: skip


def catalog(folder: Path, report: dict[str, Any]) -> Catalog:
    assets = tuple(
        ImageAsset(i.name, f"{i.name}.jpg", "0" * 64, 1, (0.0, 0.0, 60.0, 50.0), i, (-2.0, 12.0)) for i in images()
    )
    return Catalog(str(folder), "a flight", resolve("local"), "other", "", (), images=assets, orientation=orientation_figures(report))  # fmt: skip


def refinement() -> dict[str, Any]:
    """As `cityflow orient CATALOG` writes it: one image is weak, one could not be read, one control point is wrong."""
    interior = {"fx": 3600.0, "fy": 3600.0, "cx": 2000.0, "cy": 1500.0, "distortion": [-0.03, 0.0, 0.0, 0.0], "kind": "perspective"}  # fmt: skip
    row = {
        "observations": 900, "reprojection_px": 0.41, "sigma_px": 0.1, "position_sigmas_m": [0.01, 0.01, 0.02], "angle_sigmas_deg": [0.001, 0.001, 0.002],
    }  # fmt: skip
    rows = {i.name: {**row, "reprojection_px": 0.4 + 0.01 * k} for k, i in enumerate(images())}
    rows["i07"] |= {"observations": 11, "sigma_px": 0.8}
    points = [
        {"name": "C1", "role": "control", "used": True, "marks": 5, "off_m": [0.01, -0.02, 0.03], "sigmas_m": [0.01, 0.01, 0.02], "mark_px": 0.3},
        {"name": "C2", "role": "control", "used": False, "marks": 4, "off_m": [0.5, 0.7, None], "sigmas_m": [0.01, 0.01, 0.02], "mark_px": 9.1,
         "problem": "it is off by 0.86 m", "remedy": "check it"},
        {"name": "K1", "role": "check", "used": True, "marks": 6, "off_m": [0.03, 0.04, -0.06], "sigmas_m": [0.01, 0.01, 0.02], "mark_px": 0.4},
    ]  # fmt: skip
    summary = {
        "refined": True, "better": True, "calibrated": False, "cameras_doubtful": True, "images": 12, "tie_points": 4321, "observations": 12963,
        "track_lengths": [0, 0, 1000, 2321, 1000], "check_before_px": 0.9, "check_after_px": 0.5, "reprojection_px": 0.42, "sigma_px": 0.4,
        "position_sigma_m": 0.03, "angle_sigma_deg": 0.004, "median_move_m": 0.021, "weak": ["i07"],
        "control": {"control_rms_m": [0.02, 0.03], "check_rms_m": [0.05, 0.06], "shift_of_given_positions_m": [0.1, 0.1, 2.3], "points": points},
    }  # fmt: skip
    cameras = [
        {"head": "nadir", "images": 12, "given": interior, "adjusted": {**interior, "fx": 3601.5}, "focal_change_percent": 0.04, "focal_sigma_percent": 0.01,
         "principal_sigma_px": [0.4, 0.5], "corner_change_px": 1.2}
    ]  # fmt: skip
    return {"summary": summary, "cameras": cameras, "left_out": ["i99"], "parameters": {}, "images": rows}


def photographs() -> dict[str, Any]:
    """As `cityflow orient PHOTOS` writes it."""
    return {
        "oriented": 12, "photographs": 14, "left_out": {"dark": "12 points found: blurred, dark or without texture", "again": "the same file as i01.jpg"},
        "models": [12], "method": "global", "verified_pairs": 40, "tie_points": 5000, "mean_track_length": 3.2, "observations": 16000,
        "images": {i.name: {"observations": 12 if i.name == "i03" else 800} for i in images()}, "reprojection_px": 0.55, "weak": ["i03"],
        "cameras": [{"images": 12, "focal_px": 3600.0, "principal_px": [2000.0, 1500.0], "distortion": [-0.03, 0.0], "stated_focal_px": 3800.0,
                     "focal_sigma_px": None}],
        "placing": {"by": "control points", "pixel_m": 0.028, "exchanged": [], "contradicting": ["C9"],
                    "points": [{"name": "C1", "role": "control", "used": True, "residual_m": [0.01, 0.0, 0.0]},
                               {"name": "C9", "role": "control", "used": False, "residual_m": [3.0, 0.0, 0.0]},
                               {"name": "K1", "role": "check", "used": False, "residual_m": [0.12, 0.05, 0.05]}]},
    }  # fmt: skip


def adjusted_photographs() -> dict[str, Any]:
    """The same with the figures of an adjustment after the mapping."""
    report, adjusted = photographs(), refinement()
    summary = {key: adjusted["summary"][key] for key in ("weak", "control", "images")}
    return report | {"images": adjusted["images"], "summary": summary}


def ties() -> TiePoints:
    rng = np.random.default_rng(3)
    xyz = np.column_stack([rng.normal(30, 15, 4000), rng.normal(25, 12, 4000), rng.uniform(-2, 8, 4000)])
    return TiePoints(xyz, rng.integers(2, 6, 4000).astype(float), rng.gamma(2.0, 0.2, 4000))


def pages(folder: Path, report: dict[str, Any]) -> tuple[str, str, dict[str, Any]]:
    """The page of the orientation, that of a run with its catalog as it is read back, and that run's figures."""
    made = catalog(folder, report)
    write_catalog(folder, made, {a.name: f"../{a.name}.jpg" for a in made.images})
    places = {"C1": np.array([10.0, 10.0, 0.0]), "K1": np.array([40.0, 30.0, 1.0])}
    given = {} if "photographs" in report else {i.name: i for i in images()}
    write_orientation_report(folder, Oriented(report, made, ties(), given, places))
    read = read_catalog(folder)
    assert read.orientation == made.orientation
    figures, page = write_report(ReportData("a flight", "photos_city", "local", "", orientation=read.orientation))
    assert json.loads((folder / FIGURES).read_text()) == report
    return (folder / PAGE).read_text(), page.decode(), json.loads(figures)


@pytest.mark.parametrize(
    ("report", "told"),
    [
        (refinement(), ("4,321", "12,963", "i07", "only 11 tie points", "0.50 px", "i99", "C2", "5.0 cm", "adjustment.calibrate=true", "2.30 m")),
        (photographs(), ("5,000", "16,000", "i03", "only 12 tie points", "0.55 px", "dark", "blurred", "C9", "13.0 cm", "3800 px", "leaves the focal")),
        (adjusted_photographs(), ("5,000", "i03", "i07", "only 11 tie points", "its pose is uncertain by 0.8 px", "C2", "2.30 m")),
    ],
    ids=["refinement", "photographs", "adjusted photographs"],
)  # fmt: skip
def test_counts_weak_images_and_doubts_stand_on_both_pages(
    tmp_path: Path, report: dict[str, Any], told: tuple[str, ...]
) -> None:
    own, of_run, figures = pages(tmp_path, report)
    for text in told:
        assert text in own
        assert text in of_run
    weak = {name for name in ("i03", "i07") if name in told or (name == "i03" and "photographs" in report)}
    assert own.count('class="weak"') == len(weak)
    assert own.count("<circle") == len(images())
    assert figures["orientation"]["weak"].keys() == weak
    assert ("12 of 14 images have a pose" if "photographs" in report else "12 of 13 images have a pose") in own


def test_a_good_orientation_is_said_to_be_one(tmp_path: Path) -> None:
    report = photographs()
    camera = {**report["cameras"][0], "stated_focal_px": 3610.0, "focal_sigma_px": 0.4}
    report |= {
        "photographs": 12,
        "left_out": {},
        "weak": [],
        "cameras": [camera],
        "placing": {"by": "scale", "height_m": 50.0},
    }
    own, of_run, _ = pages(tmp_path, report)
    assert "All 12 images have a pose; nothing is doubtful." in own
    assert "No check points" in own
    assert "Nothing is doubtful." in of_run
