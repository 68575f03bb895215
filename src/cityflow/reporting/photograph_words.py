"""What was found of photographs without poses, in lines for a terminal."""

from __future__ import annotations

from typing import Any

from cityflow.io.tables.feature_ids import listing

ODD_FOCAL = 0.03
"""Share by which the calibrated focal length may differ from the stated one before it is told."""


def photograph_lines(report: dict[str, Any]) -> list[str]:
    """What was found, for people."""
    lines = [
        f"{report['oriented']} of {report['photographs']} photographs oriented ({report['method']} mapping, {report['verified_pairs']} pairs): "
        f"{report['tie_points']} tie points in {report['mean_track_length']:.1f} images each, mean reprojection error {report['reprojection_px']:.2f} px"
    ]
    for number, camera in enumerate(report["cameras"], 1):
        stated = camera["stated_focal_px"]
        odd = stated is not None and abs(camera["focal_px"] / stated - 1) > ODD_FOCAL
        against = f"; the files say {stated:.0f} px, which the pictures contradict" if odd else ""
        sigma = camera["focal_sigma_px"]
        exact = (
            f" ± {sigma:.1f}"
            if sigma is not None
            else ", which the scene leaves open (too flat, or too few images): held"
        )
        lines.append(
            f"Camera {number}: {camera['images']} images, focal length {camera['focal_px']:.1f} px{exact}{against}"
        )
    if len(report["models"]) > 1:
        lines.append(
            f"{len(report['models'])} models that show nothing in common ({', '.join(map(str, report['models']))} images): "
            "flights that do not overlap? The largest is used"
        )
    if report["weak"]:
        lines.append(f"Weak: {listing(report['weak'])}: few tie points hold them")
    groups: dict[str, list[str]] = {}
    for name, reason in sorted(report["left_out"].items()):
        groups.setdefault(reason, []).append(name)
    lines += [f"Left out: {listing(names)}: {reason}" for reason, names in groups.items()]
    return lines
