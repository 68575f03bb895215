"""What an adjustment of poses found, in lines for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cityflow.io.tables.feature_ids import listing
from cityflow.reporting.orientation_words import control_lines

OF_AN_IMAGE = ("observations", "reprojection_px", "sigma_px", "position_sigmas_m", "angle_sigmas_deg", "covariance")


def figures_file(
    summary: Mapping[str, Any], block: Mapping[str, Any], left_out: Sequence[str], parameters: Mapping[str, Any]
) -> dict[str, Any]:
    """``orientation.json`` of refined poses.

    Parameters
    ----------
    summary, block : as `handover.refined_block.encode_refinement` makes them
    left_out : images that could not be read
    """
    images = {i["name"]: {key: i[key] for key in OF_AN_IMAGE} for i in block["images"]}
    return {
        "summary": dict(summary), "cameras": block["cameras"], "left_out": list(left_out), "parameters": dict(parameters), "images": images
    }  # fmt: skip


def described(summary: Mapping[str, Any], failed: Sequence[str]) -> Iterator[str]:
    """What the adjustment found, in lines for people."""
    yield (
        f"{summary['tie_points']} tie points in {summary['observations']} places, image coordinates exact to {summary['sigma_px']:.2f} px; "
        f"given poses are off by {summary['position_sigma_m'] * 100:.1f} cm and {summary['angle_sigma_deg']:.4f}° (estimated)"
    )
    change = f"{summary['check_before_px']:.2f} → {summary['check_after_px']:.2f} px on tie points that were kept out"
    if summary["better"]:
        yield f"Poses refined: {change}; centres move by {summary['median_move_m'] * 100:.1f} cm in the median"
    elif summary["refined"]:
        yield f"Poses follow the control points; tie points alone would have left them as given: {change}"
    else:
        yield f"Poses stay as given, as refined ones are not significantly better: {change}"
    if summary["calibrated"]:
        yield "Cameras calibrated: see cameras in orientation.json"
    elif summary["cameras_doubtful"]:
        yield "Cameras seem to be off, and poses make up for it: see cameras in orientation.json, and --set adjustment.calibrate=true"
    yield from control_lines(summary["control"]) if "control" in summary else ()
    if summary["weak"]:
        yield f"Weak: {listing(summary['weak'])}: few or no tie points hold their poses"
    if failed:
        yield f"Left out: {listing(failed)}: the file could not be read; the pose stays"
