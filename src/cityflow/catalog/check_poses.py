"""Checks how far given poses of images contradict each other, by a sample of pairs, and says what it will cost."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from cityflow.catalog.file_questions import Question, Reading
from cityflow.catalog.findings import Finding, Level
from cityflow.handover.tie_sample import FEWEST, QUICK_PX, StarTies, error_of, flown_of, star_ties, stars_of
from cityflow.io.catalog.stac_assets import ImageAsset

REMEDY = "cityflow run refines poses by itself (orient.refine); cityflow orient makes a catalog that has them"


def check_poses(assets: Sequence[ImageAsset], title: str, reading: Reading) -> tuple[list[Finding], dict[str, str]]:
    """What ties of some pairs say of the relative error of the poses: findings, and rows of the summary.

    An image that cannot be read is left out; the check of files has named it.
    """
    flown = flown_of(assets)
    if len(flown) < FEWEST:
        return [], {}
    stars = stars_of(flown)
    question = Question("pairs of images", partial(star_ties, most_px=QUICK_PX, checked=False))
    answers = reading.answers(question, stars, len(stars))
    found = error_of([a for a in answers if isinstance(a, StarTies)])
    looked = {i.image.name for s in stars for i in s.images}
    sample = f"a sample of {found.pairs} pairs of {len(looked)} of {len(flown)} images"
    if not found.tied:
        problem = f"{sample} shows nothing in common where the poses have it: their relative error is unknown"
        return [Finding(Level.NOTE, title, problem)], {}
    height = f", heights of two pairs {found.height_gsd:.1f} GSD" if np.isfinite(found.height_gsd) else ""
    told = f"vertical parallax by poses {found.parallax_px:.2f} px (can be told from {found.sure_px:.2f} on)"
    rows = {
        "relative error": f"{told}, by image measurement {found.noise_px:.2f} px{height}; {found.ties:,} ties, {sample}"
    }
    findings = []
    if 2 * found.tied < found.pairs:
        problem = f"{found.tied} of {found.pairs} pairs of a sample have ties where poses have them: poses are off by many pixels, or pictures are plain"
        remedy = "check the orientation; cityflow orient --set bound_px=… searches farther"
        findings.append(Finding(Level.WARNING, title, problem, remedy))
    elif found.is_significant:
        problem = (
            f"poses contradict each other by {found.parallax_px:.2f} px (vertical parallax of ties): left as they are, they would add a noise of about "
            f"{found.expected_nmad_gsd:.1f} GSD (NMAD) to the surface, in proportion to what a synthetic flight with 0.60 px lost (docs/results.md)"
        )
        findings.append(Finding(Level.WARNING, title, problem, REMEDY))
    return findings, rows
