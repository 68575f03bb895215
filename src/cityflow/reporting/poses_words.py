"""What a run found out about the poses of its images, in lines for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cityflow.io.tables.feature_ids import listing
from cityflow.reporting.adjustment_words import described
from cityflow.runs.poses_note import SettledPoses
from cityflow.viewer.image_rows import PosesRow

ANEW = "the next run tries again"


def lines_of_poses(found: SettledPoses) -> Iterator[str]:
    """How far given poses contradict each other, and whether the run uses them or adjusted ones."""
    sample = found.sample
    if sample is not None:
        yield _of_sample(sample)
    if found.summary is not None:
        yield from described(found.summary, found.left_out)
    elif found.problem:
        yield f"Poses stay as given, as they could not be adjusted: {found.problem}; {ANEW}"
    if not found.is_final and found.left_out:
        yield f"Poses of {listing(found.left_out)} are adjusted, and those of the others again, when the files can be read"


def lines_before(poses: SettledPoses | None, *, unknown: bool, how: str) -> Iterator[str]:
    """What a plan says of the poses.

    Parameters
    ----------
    unknown : a run looks at them first
    how : `orient.refine`
    """
    if poses is not None:
        yield from lines_of_poses(poses)
    elif unknown:
        what = "adjusted" if how == "always" else "looked at by a sample"
        yield f"Poses are {what} first (orient.refine={how}); where adjusted ones are better, all that is made of images is made of these"


def row_of_poses(found: SettledPoses | None) -> PosesRow | None:
    """What the report says; of adjusted poses it has figures of its own beside this."""
    if found is None:
        return None
    before = [_of_sample(found.sample)] if found.sample is not None else []
    lines = before if found.refined else lines_of_poses(found)
    return PosesRow(found.refined, tuple(lines), found.sample, found.summary, tuple(found.left_out))


def _of_sample(sample: Mapping[str, Any]) -> str:
    pairs = f"{sample['pairs']} pairs of {sample['images']} images"
    if not sample["tied"]:
        return f"Poses are taken as given: a sample of {pairs} shows nothing in common where they have it, so nobody knows how exact they are"
    if 2 * sample["tied"] < sample["pairs"]:
        told = f"{sample['tied']} of {pairs} have ties where the given poses have them"
        return f"Given poses are off by many pixels, or pictures are plain: {told}"
    parallax = f"{sample['parallax_px']:.2f} px of vertical parallax (a sample of {pairs}; noise: below {sample['sure_px']:.2f} px)"
    if sample["significant"]:
        return f"Given poses contradict each other by {parallax}: about {sample['nmad_gsd']:.1f} GSD of noise in the surface"
    return f"Poses are taken as given: they contradict each other by {parallax}, which is not significant"
