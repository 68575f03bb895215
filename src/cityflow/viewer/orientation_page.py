"""The page of an orientation: what was found and what is doubtful, map, cameras, images, known points; and its figures for other pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.orientation_figures import KnownPointFigures, OrientationFigures
from cityflow.viewer.environment import cm, rendered, template_text
from cityflow.viewer.histogram import Histogram, histogram
from cityflow.viewer.orientation_map import OrientationMap
from cityflow.viewer.orientation_rows import CameraRow, ImageRow, PointRow, TiePoints
from cityflow.viewer.report_in_short import Answer

LISTED = 300
"""Images of which the page says all; the others stand in orientation.json."""
BARS = 200_000
"""Tie points of which histograms are made: of more, every n-th."""
NO_CHECK = "No check points: how exact place and scale are was not measured independently."


@dataclass(frozen=True, slots=True)
class SequenceFigures:
    """A video or a sequence of stills, and the carrier's track.

    Attributes
    ----------
    name : of the video or folder;  frames : in it;  taken : chosen
    passed : kind → frames that were passed over, for people
    length_m, seconds : of the track;  doubts : for people
    """

    name: str
    frames: int
    taken: int
    passed: Mapping[str, int]
    length_m: float
    seconds: float
    doubts: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class OrientationPage:
    """All that the page shows.

    Attributes
    ----------
    title : of the catalog;  crs : as a person reads it;  next : the command that uses the catalog
    images : those with a pose;  cameras, points : None of them may be there
    map : None where no image has a pose;  sequence : None where the images are no chosen frames
    """

    title: str
    crs: str
    figures: OrientationFigures
    ties: TiePoints
    cameras: Sequence[CameraRow] = ()
    images: Sequence[ImageRow] = ()
    points: Sequence[PointRow] = ()
    map: OrientationMap | None = None
    next: str = ""
    sequence: SequenceFigures | None = None

    @property
    def listed(self) -> list[ImageRow]:
        """Weak images first, then the largest errors."""
        order = sorted(self.images, key=lambda r: (not r.weak, -(r.reprojection_px or 0.0), r.name))
        return order[:LISTED]


def orientation_page(page: OrientationPage) -> bytes:
    """HTML; opens anywhere, without a network."""
    return rendered(
        "orientation.html.j2", page=page, f=page.figures, verdict=orientation_verdict(page.figures), short=orientation_in_short(page.figures),
        charts=_charts(page), worst=max((abs(v) for p in page.points for v in p.off_m if v is not None), default=0.0),
        style=template_text("report.css"), next=page.next,
    ).encode()  # fmt: skip


def orientation_verdict(figures: OrientationFigures) -> str:
    """One sentence: how many images have a pose, and whether something is doubtful."""
    all_have = figures.images == figures.given
    have = f"All {figures.images:,} images have" if all_have else f"{figures.images:,} of {figures.given:,} images have"
    if figures.images == 1:
        have = "One image has"
    count = len(figures.doubts)
    doubt = "nothing is doubtful" if not count else "one thing is doubtful" if count == 1 else f"{count} things are doubtful"  # fmt: skip
    return f"{have} a pose; {doubt}."


def orientation_in_short(figures: OrientationFigures) -> list[Answer]:
    """Answers in the order in which they are asked."""
    doubts = "\n".join(figures.doubts) or "Nothing: no image is weak or left out, and no known point contradicts."
    return [
        Answer("What was found?", " ".join(figures.found)),
        Answer("How exact?", how_exact(figures), "quality"),
        Answer("What is doubtful?", doubts, "images" if figures.weak or figures.left_out else ""),
    ]


def how_exact(figures: OrientationFigures) -> str:
    """Of images, poses, and known points."""
    parts = [
        f"{figures.tie_points:,} tie points, in {figures.track_length:.1f} images each, lie off by {figures.reprojection_px:.2f} px."
    ]
    if figures.position_sigma_m is not None and figures.angle_sigma_deg is not None:
        parts.append(
            f"Poses have standard deviations of {cm(figures.position_sigma_m)} and {figures.angle_sigma_deg:.4f}° per axis (median)."
        )
    known = ((figures.control, "Control points"), (figures.check, "Check points"))
    parts += [f"{name} ({k.count}): {off_text(k)}." for k, name in known if k is not None]
    return " ".join([*parts, *([NO_CHECK] if figures.check is None else [])])


def off_text(known: KnownPointFigures) -> str:
    """
    >>> off_text(KnownPointFigures(3, 0.0123, None))
    '1.2 cm in plan'
    """
    up = "" if known.height_m is None else f", {cm(known.height_m)} in height"
    return f"{cm(known.plan_m)} in plan{up}"


def _charts(page: OrientationPage) -> list[Histogram]:
    step = -(-len(page.ties.lengths) // BARS) or 1
    errors = page.ties.errors_px[::step]
    errors = errors[np.isfinite(errors)]
    charts = [
        histogram("Track lengths", "images that show a tie point", page.ties.lengths[::step].tolist(), counted="tie points", whole=True)
    ]  # fmt: skip
    if len(errors):
        charts.append(
            histogram("Reprojection errors of tie points", "pixels", errors.tolist(), counted="tie points", unit="px")
        )
    of_images = [r.reprojection_px for r in page.images if r.reprojection_px is not None]
    if of_images:
        charts.append(
            histogram("Reprojection errors of images", "pixels per axis", of_images, counted="images", unit="px")
        )
    sigmas = [100 * float(np.sqrt(np.mean(np.square(r.position_sigmas_m)))) for r in page.images if r.position_sigmas_m]
    if sigmas:
        charts.append(histogram("Standard deviations of positions", "cm per axis", sigmas, counted="images", unit="cm"))
    return charts
