"""Figures of the images of a run from its records: look directions, pairs, completeness of tiles, time of matching."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from cityflow.core.building import Status
from cityflow.flow.task import Record
from cityflow.reporting.asked_area import asked_area, surveyed_share
from cityflow.runs.current import CurrentRecords
from cityflow.stages import fuse, ingest, match, ortho, surface
from cityflow.survey.area import EVERYWHERE, Area
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.survey import Survey
from cityflow.viewer.image_rows import DirectionRow, ImageFigures, RefusedPairs, TileRow
from cityflow.viewer.run_figures import kind_of_reason

Pairs = Mapping[str, Mapping[str, Any]]


def image_figures(survey: Survey, records: CurrentRecords, area: Area = EVERYWHERE) -> ImageFigures | None:
    """None for a survey that is no survey of images; `area` is what the run is limited to."""
    if survey.source.kind != IMAGES:
        return None
    asked = asked_area(survey, area)
    matched = records.of(match.NAME)
    read = {r.unit: r for r in records.of(ingest.NAME) if r.unit in survey.images.assets}
    left_out = tuple(u for u, r in read.items() if r.status in (Status.FAILED, Status.REFUSED))
    used = {name for r in matched for name in (survey.matches.reference_of(r.unit), *_pairs(r))}
    return ImageFigures(
        images=len(survey.images.assets),
        left_out=left_out,
        unused=len(survey.images.assets) - len(used | set(left_out)),
        directions=tuple(_directions(survey, matched, set(left_out))),
        refused=tuple(_refused(survey, matched)),
        tiles=tuple(_tiles(records)),
        parallaxes_px=tuple(_parallaxes(matched, "parallax_px")),
        match_seconds=sum(r.seconds for r in matched),
        sgm_seconds=sum(float(r.result.get("sgm_seconds") or 0) for r in matched),
        asked_m2=float(asked.area),
        shown_share=surveyed_share(survey, asked),
    )


def _pairs(record: Record) -> Pairs:
    found: Pairs = record.result.get("pairs") or {}
    return found


def _directions(survey: Survey, matched: Iterable[Record], left_out: set[str]) -> Iterable[DirectionRow]:
    """Every cluster of views; a reference image of a small cluster that joined another one still counts for its own."""
    by_name: dict[str, list[Record]] = defaultdict(list)
    for record in matched:
        by_name[survey.images.frame_of[survey.matches.reference_of(record.unit)].name].append(record)
    for frame in survey.images.frames:
        own = by_name[frame.name]
        tilts = np.degrees([survey.images.views[n].image.tilt for n in frame.images])
        pairs = [p for r in own for p in _pairs(r).values()]
        references = {survey.matches.reference_of(r.unit) for r in own}
        yield DirectionRow(
            frame.name, len(frame.images), len(left_out.intersection(frame.images)), float(tilts.mean()),
            (float(tilts.min()), float(tilts.max())), len(references), sum(int(r.result.get("points") or 0) for r in own),
            len(pairs), sum(not p["used"] for p in pairs),
            _median(_parallaxes(own, "parallax_px")), _median(_parallaxes(own, "parallax_rest_px")),
        )  # fmt: skip


def _parallaxes(matched: Iterable[Record], name: str) -> list[float]:
    return [float(p[name]) for r in matched for p in _pairs(r).values() if p["used"] and p.get(name) is not None]


def _refused(survey: Survey, matched: Iterable[Record]) -> list[RefusedPairs]:
    """Pairs not used by kind of reason, the most frequent first; reasons that differ in figures only are one kind."""
    kinds: dict[str, list[tuple[str, str, str]]] = defaultdict(list)
    for record in matched:
        for partner, pair in sorted(_pairs(record).items()):
            if not pair["used"]:
                reason = str(pair["reason"]) or "no reason given"
                kinds[kind_of_reason(reason)].append((reason, survey.matches.reference_of(record.unit), partner))
    rows = [
        RefusedPairs(found[0][0], len(found), tuple(sorted({(base, partner) for _, base, partner in found})))
        for found in kinds.values()
    ]
    return sorted(rows, key=lambda r: (-r.count, r.reason))


def _tiles(records: CurrentRecords) -> list[TileRow]:
    """Ground tiles with an ortho, which are those asked for; before there is one, those with a surface or fused (rings of asked-for tiles among them)."""
    good = (Status.DONE, Status.DEGRADED)
    fused, made, shown = (
        {r.unit: r.result for r in records.of(stage) if r.status in good}
        for stage in (fuse.NAME, surface.NAME, ortho.NAME)
    )
    nothing: Mapping[str, Any] = {}
    return [
        TileRow(
            tile,
            made.get(tile, fused.get(tile, nothing)).get("completeness"),
            shown.get(tile, nothing).get("seen"),
            fused.get(tile, nothing).get("median_sigma_m"),
            int(made.get(tile, nothing).get("points") or 0),
            float(made.get(tile, nothing).get("surveyed_m2") or 0.0),
        )
        for tile in sorted(shown or made or fused)
    ]


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None
