"""Figures and doubts of an orientation, from what ``orientation.json`` says of photographs or of refined poses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from cityflow.adjustment.refinement import FEW_TIES, WEAK_PX
from cityflow.core.orientation_figures import PHOTOGRAPHS, REFINEMENT, KnownPointFigures, OrientationFigures
from cityflow.io.tables.feature_ids import listing
from cityflow.reporting.orientation_words import FAR_M, registration_words
from cityflow.viewer.orientation_rows import ImageRow, PointRow

UNREAD = "the file could not be read; its pose stays as given"
ODD_FOCAL = 0.03
"""Share by which a calibrated focal length may differ from the stated one before it is doubted."""
MOST_REPROJECTION_PX = 1.5
"""Above it a mapping counts as failed (`adjustment.mapping`)."""
MOST_CHECK_PX = 3.0
"""Pixels on the ground by which check points may be off before it is a doubt; set by hand."""


def orientation_figures(report: Mapping[str, Any]) -> OrientationFigures:
    """Of a whole report."""
    return _of_photographs(report) if is_of_photographs(report) else _of_refinement(report)


def is_of_photographs(report: Mapping[str, Any]) -> bool:
    """Whether poses were found from photographs alone; their report has a summary, too, where the model was adjusted after its mapping."""
    return "photographs" in report


def image_rows(report: Mapping[str, Any]) -> tuple[ImageRow, ...]:
    """Images with a pose, by name."""
    weak = set(report.get("weak", ())) | set(report.get("summary", {}).get("weak", ()))
    rows = report.get("images") or {}
    return tuple(_image_row(name, rows[name], name in weak) for name in sorted(rows))


def point_rows(report: Mapping[str, Any]) -> tuple[PointRow, ...]:
    """Control and check points, by name."""
    control = _control(report)
    wrong = dict.fromkeys(control.get("contradicting", ()), "contradicts the others")
    wrong |= dict.fromkeys(control.get("exchanged", ()), "is exchanged with another point")
    rows = [
        PointRow(
            str(p["name"]), str(p["role"]), bool(p["used"]) or ("residual_m" in p and p["role"] == "check"), p.get("marks"),
            tuple(p.get("off_m", p.get("residual_m", (None, None, None)))), p.get("mark_px"),
            p.get("problem", wrong.get(p["name"], "")),
        )
        for p in control.get("points", ())
    ]  # fmt: skip
    return tuple(sorted(rows, key=lambda r: (r.role != "check", r.name)))


def _control(report: Mapping[str, Any]) -> Mapping[str, Any]:
    """Known points as the adjustment has them, else as the placing."""
    return {**report.get("placing", {}), **(report.get("summary", {}).get("control") or {})}


def _image_row(name: str, row: Mapping[str, Any], is_weak: bool) -> ImageRow:
    observations, sigma = row.get("observations"), row.get("sigma_px")
    why = [f"only {observations} tie points"] if observations is not None and observations < FEW_TIES else []
    if sigma is not None and sigma > WEAK_PX:
        why.append(f"its pose is uncertain by {sigma:.1f} px")
    return ImageRow(
        name, observations, row.get("reprojection_px"), tuple(row.get("position_sigmas_m") or ()),
        tuple(row.get("angle_sigmas_deg") or ()), weak=", ".join(why) or "few tie points hold it" if is_weak else "",
    )  # fmt: skip


def _of_refinement(report: Mapping[str, Any]) -> OrientationFigures:
    summary, rows, points = report["summary"], image_rows(report), point_rows(report)
    left_out = dict.fromkeys(report["left_out"], UNREAD)
    weak = {r.name: r.weak for r in rows if r.weak}
    lengths = np.asarray(summary["track_lengths"], np.float64)
    control, check = _known(points, "control"), _known(points, "check")
    return OrientationFigures(
        REFINEMENT, summary["images"], summary["images"] + len(left_out), left_out, weak, summary["tie_points"], summary["observations"],
        round(float(np.average(np.arange(len(lengths)), weights=lengths)), 2), summary["reprojection_px"],
        summary["check_before_px"], summary["check_after_px"], summary["median_move_m"], *_pose_sigmas(rows), control, check,
        tuple(_refined_words(summary, report.get("registration"))), (*_refined_doubts(summary, points), *_image_doubts(left_out, weak)),
    )  # fmt: skip


def _of_photographs(report: Mapping[str, Any]) -> OrientationFigures:
    rows, points = image_rows(report), point_rows(report)
    known = {r.name: r.weak for r in rows if r.weak}
    weak = {name: known.get(name, "few tie points hold it") for name in sorted({*report["weak"], *known})}
    control, check = _known(points, "control"), _known(points, "check")
    observations = report.get("observations", round(report["tie_points"] * report["mean_track_length"]))
    doubts = (*_photograph_doubts(report, points, check), *_image_doubts(report["left_out"], weak))
    return OrientationFigures(
        PHOTOGRAPHS, report["oriented"], report["photographs"], dict(report["left_out"]), weak, report["tie_points"], observations,
        report["mean_track_length"], report["reprojection_px"], None, None, None, *_pose_sigmas(rows), control, check,
        tuple(_photograph_words(report, control)), doubts,
    )  # fmt: skip


def _pose_sigmas(rows: Sequence[ImageRow]) -> tuple[float | None, float | None]:
    """Per axis, of the positions in metres and of the angles in degrees, medians over the images."""
    found: list[float | None] = []
    for name, digits in (("position_sigmas_m", 4), ("angle_sigmas_deg", 5)):
        each = [v for r in rows if (v := [x for x in getattr(r, name) if x is not None])]
        axis = [float(np.sqrt(np.mean(np.square(v)))) for v in each]
        found.append(round(float(np.median(axis)), digits) if axis else None)
    return found[0], found[1]


def _known(points: Iterable[PointRow], role: str) -> KnownPointFigures | None:
    used = [p.off_m for p in points if p.role == role and p.used and p.off_m[0] is not None]
    if not used:
        return None
    off = np.array(used, np.float64)
    up = off[np.isfinite(off[:, 2]), 2]
    plan = float(np.sqrt(np.mean(np.sum(off[:, :2] ** 2, axis=1))))
    height = round(float(np.sqrt(np.mean(up**2))), 4) if len(up) else None
    return KnownPointFigures(len(used), round(plan, 4), height)


def _refined_words(summary: Mapping[str, Any], registration: Mapping[str, Any] | None) -> Iterator[str]:
    change = f"{summary['check_before_px']:.2f} to {summary['check_after_px']:.2f} px on tie points that were kept out"
    if summary["better"]:
        yield f"Given poses were refined: errors change from {change}; centres move by {summary['median_move_m'] * 100:.1f} cm in the median."
    elif summary["refined"]:
        yield f"Poses follow the control points; tie points alone would have left them as given ({change})."
    else:
        yield f"Given poses stay, as refined ones are not significantly better ({change})."
    if summary["calibrated"]:
        yield "Cameras were calibrated."
    yield from registration_words(registration) if registration else ()


def _refined_doubts(summary: Mapping[str, Any], points: Sequence[PointRow]) -> Iterator[str]:
    if summary["cameras_doubtful"]:
        yield "Cameras seem to be off, and poses make up for it: --set adjustment.calibrate=true calibrates them."
    if summary["check_after_px"] > MOST_REPROJECTION_PX:
        yield f"Tie points that were kept out still lie off by {summary['check_after_px']:.2f} px: some poses or cameras are wrong."
    yield from _point_doubts(points)
    yield from _shift_doubts(summary)


def _shift_doubts(summary: Mapping[str, Any]) -> Iterator[str]:
    shift = (summary.get("control") or {}).get("shift_of_given_positions_m")
    if shift is not None and np.linalg.norm(shift) > FAR_M:
        yield f"Given positions lie off the control points together by {np.linalg.norm(shift):.2f} m: one of both is in another datum."


def _photograph_words(report: Mapping[str, Any], control: KnownPointFigures | None) -> Iterator[str]:
    yield f"{report['oriented']} of {report['photographs']} photographs have a pose ({report['method']} mapping of {report['verified_pairs']} pairs)."
    put = report["placing"]
    if control is not None:
        yield f"Placed by {control.count} control point{'' if control.count == 1 else 's'}."
    elif put.get("by") in ("local", "scale"):
        known = "whose scale is known from the stated height" if put["by"] == "scale" else "of unknown scale"
        yield f"They stand in a local frame {known}."
    elif put.get("by") == "registration":
        yield from registration_words(put["registration"])
    elif "plan_rms_m" in put:
        yield (
            f"Placed by {put['used']} of {put['positions']} GNSS positions, from which they differ by {put['plan_rms_m']:.2f} m "
            f"per axis in plan and {put['height_rms_m']:.2f} m in height."
        )
    yield from _adjusted_words(report.get("summary", {}))


def _adjusted_words(summary: Mapping[str, Any]) -> Iterator[str]:
    """What the adjustment with positions and control points did; nothing where there was none."""
    if "positions" not in summary:
        return
    gnss = f"{summary['positions']} GNSS positions, exact to {summary['position_sigma_m']:.2f} m"
    by = [gnss] if summary["positions"] else []
    by += ["control points"] if summary.get("control") else []
    yield f"Adjusted with {' and '.join(by)} as observations; centres move by {summary['median_move_m'] * 100:.1f} cm in the median."


def _photograph_doubts(
    report: Mapping[str, Any], points: Sequence[PointRow], check: KnownPointFigures | None
) -> Iterator[str]:
    put = report["placing"]
    if len(report["models"]) > 1:
        sizes = ", ".join(map(str, report["models"]))
        yield f"{len(report['models'])} models show nothing in common ({sizes} images), the largest is used: do flights not overlap?"
    for number, camera in enumerate(report["cameras"], 1):
        stated = camera["stated_focal_px"]
        if camera["focal_sigma_px"] is None:
            yield f"Camera {number}: the scene leaves the focal length open (too flat, or too few images); it was held."
        if stated is not None and abs(camera["focal_px"] / stated - 1) > ODD_FOCAL:
            yield f"Camera {number}: its focal length of {camera['focal_px']:.0f} px contradicts the {stated:.0f} px that the files state."
    if report["reprojection_px"] > MOST_REPROJECTION_PX:
        yield f"Tie points lie off by {report['reprojection_px']:.2f} px in the mean: cameras or poses are wrong."
    yield from _point_doubts(points)
    yield from _shift_doubts(report.get("summary", {}))
    if "refused_adjustment" in report:
        yield "Positions and control points contradict the images: the model is placed by a similarity alone."
    if off := report.get("summary", {}).get("positions_far"):
        yield f"GNSS positions lie far off where the images have them: {listing(off)}."
    pixel = put.get("pixel_m")
    if check is not None and pixel is not None and max(check.plan_m, check.height_m or 0.0) > MOST_CHECK_PX * pixel:
        yield f"Check points are off by more than {MOST_CHECK_PX:g} pixels on the ground ({pixel:.3f} m each)."
    if put.get("by") == "local":
        yield "The scale is unknown: 100 m over the ground are assumed, so lengths mean nothing."
    far = put.get("left_out") or {}
    if far:
        yield f"GNSS positions that contradict the others were not used: {listing(sorted(far))}."


def _point_doubts(points: Iterable[PointRow]) -> Iterator[str]:
    for p in points:
        if p.problem:
            yield f"{p.role.capitalize()} point {p.name}: {p.problem}{'.' if p.used else '; it is left out.'}"


def _image_doubts(left_out: Mapping[str, str], weak: Mapping[str, str]) -> Iterator[str]:
    """Images by the reason for which they have no pose; those that little holds."""
    groups: dict[str, list[str]] = {}
    for name, reason in sorted(left_out.items()):
        groups.setdefault(reason, []).append(name)
    for reason, names in groups.items():
        yield f"Left out: {listing(names)}: {reason}."
    if weak:
        yield f"Weak, as little holds their poses: {listing(f'{name} ({why})' for name, why in sorted(weak.items()))}."
