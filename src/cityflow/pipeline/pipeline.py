"""The pipeline: every stage in the order of the flow. All other lists of stages are derived from it."""

from __future__ import annotations

from collections.abc import Iterable

from cityflow.flow.stage import Stage
from cityflow.stages import (
    atlas,
    detect,
    export,
    frame,
    fuse,
    ingest,
    match,
    ortho,
    outline,
    reconstruct,
    split,
    surface,
    texture,
    units,
    walls,
    windows,
)  # fmt: skip
from cityflow.survey.city import City

PIPELINE: tuple[Stage[City], ...] = (
    ingest.STAGE,
    match.STAGE,
    fuse.STAGE,
    surface.STAGE,
    ortho.STAGE,
    frame.STAGE,
    walls.STAGE,
    detect.STAGE,
    outline.STAGE,
    split.STAGE,
    units.STAGE,
    reconstruct.STAGE,
    texture.STAGE,
    windows.STAGE,
    atlas.STAGE,
    export.STAGE,
)

STAGES = {stage.name: stage for stage in PIPELINE}
PLACE_IN_FLOW = {stage.name: k for k, stage in enumerate(PIPELINE)}
UNTIL_EXPORT = tuple(stage.name for stage in PIPELINE if stage.until_export)
"""What these have left of a unit is asked for by no task after the export of its tile."""


def table_of_stages(stages: Iterable[Stage[City]] = PIPELINE) -> str:
    """The stages as a table in Markdown, a row each."""
    rows = (f"| `{s.name}` | {s.unit} | {s.text} |" for s in stages)
    return "\n".join(["| stage | unit of work | in → out |", "|---|---|---|", *rows])


def line_of_stages(stages: Iterable[Stage[City]] = PIPELINE) -> str:
    """The way of the data as a line of Markdown, with what stands before and after the stages."""
    return " → ".join(["catalog", "orient", *(f"`{s.name}`" for s in stages), "report"])


def in_flow_order(stages: Iterable[str]) -> list[str]:
    """Names of stages as data passes through them; names that are no stage of a city come last, by the alphabet.

    >>> in_flow_order(["export", "toy", "ingest", "atlas"])
    ['ingest', 'atlas', 'export', 'toy']
    """
    return sorted(set(stages), key=lambda stage: (PLACE_IN_FLOW.get(stage, len(PLACE_IN_FLOW)), stage))
