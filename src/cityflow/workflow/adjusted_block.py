"""What the tasks of an adjustment left, and the catalog that has it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cityflow.catalog.write_folder import store_catalog
from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.handover.refined_block import decode_points, decode_poses
from cityflow.handover.refined_images import with_poses
from cityflow.io.catalog.stac import Catalog
from cityflow.reporting.adjustment_words import figures_file
from cityflow.reporting.orientation_doubts import orientation_figures
from cityflow.reporting.orientation_report import Oriented, tie_points, write_orientation_report
from cityflow.stages.orient import ADJUST, BLOCK, BLOCK_FILE, FEATURES, POINTS_FILE, OrientSource
from cityflow.survey.orient_parameters import OrientParameters
from cityflow.viewer.orientation_rows import TiePoints


@dataclass(frozen=True, slots=True)
class AdjustedBlock:
    """An adjusted block.

    Attributes
    ----------
    summary, block : as `handover.refined_block.encode_refinement` makes them
    failed : images that could not be read
    ties : tie points;  places : name of a known point → (3,) world metres
    """

    summary: Mapping[str, Any]
    block: Mapping[str, Any]
    failed: tuple[str, ...]
    ties: TiePoints
    places: Mapping[str, FloatArray]


def adjusted_block(source: OrientSource, store: Store, ledger: Ledger) -> AdjustedBlock:
    """What is there when all tasks of the source have ended.

    Raises
    ------
    RunError
        The block could not be adjusted.
    """
    record = ledger.latest(ADJUST, BLOCK)
    if record is None or record.status is Status.FAILED:
        reason = record.reason if record is not None else "no ties"
        raise RunError(f"the block could not be adjusted: {reason}", where=store.root, remedy="see docs/orient.md")
    failed = sorted(u for u in ledger.units(FEATURES) if _failed(ledger, u) and u in source.partners)
    outputs = {Path(path).name: path for path in record.outputs}
    block = json.loads(store.read_bytes(outputs[BLOCK_FILE]))
    ties = tie_points(decode_points(store.read_bytes(outputs[POINTS_FILE])))
    return AdjustedBlock(dict(record.result), block, tuple(failed), ties, {p.name: p.xyz for p in source.points})


def write_refined(given: Catalog, found: AdjustedBlock, parameters: OrientParameters, out: Path) -> Catalog:
    """The catalog with the poses of the block and its report, in a folder of its own. Raises CatalogError where it cannot be written."""
    report = figures_file(found.summary, found.block, found.failed, parameters.model_dump(mode="json"))
    refined = replace(
        with_poses(given, decode_poses(found.block)), href=str(out.absolute()), made_in="",
        orientation=orientation_figures(report),
    )  # fmt: skip
    made = store_catalog(refined, out, copy=False)
    before = {a.name: a.oriented for a in given.images}
    write_orientation_report(out, Oriented(report, made, found.ties, before, found.places))
    return made


def _failed(ledger: Ledger, unit: str) -> bool:
    record = ledger.latest(FEATURES, unit)
    return record is not None and record.status is Status.FAILED
