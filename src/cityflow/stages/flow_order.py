"""The stages by name, in the order in which a survey passes through them: how every list of stages is sorted. Imports nothing, so that all may use it."""

from __future__ import annotations

from collections.abc import Iterable

FLOW_ORDER = (
    "ingest", "match", "fuse", "surface", "ortho", "frame", "walls", "outline", "split", "units", "reconstruct", "texture", "windows",
    "atlas", "export",
)  # fmt: skip


def in_flow_order(stages: Iterable[str]) -> list[str]:
    """Stages as data passes through them; names that are no stage of a city come last, by the alphabet.

    >>> in_flow_order(["export", "toy", "ingest", "atlas"])
    ['ingest', 'atlas', 'export', 'toy']
    """
    place = {stage: k for k, stage in enumerate(FLOW_ORDER)}
    return sorted(set(stages), key=lambda stage: (place.get(stage, len(place)), stage))
