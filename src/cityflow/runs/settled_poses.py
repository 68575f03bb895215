"""Poses that a run uses: those of its catalog, or adjusted ones, as the note of the RUN says, which counts for what it was made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from cityflow.adjustment.relative_error import RelativeError
from cityflow.core.json_values import finite
from cityflow.flow.store import Store
from cityflow.flow.task import digest_of
from cityflow.flow.typed import as_json
from cityflow.handover.oriented import to_json
from cityflow.handover.refined_block import decode_poses
from cityflow.handover.refined_images import with_poses
from cityflow.handover.tie_sample import FEWEST, flown_of
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.poses_note import VERSION, SettledPoses, read_note
from cityflow.stages import orient
from cityflow.stages.orient.pair_sample import SAMPLE_VERSION
from cityflow.survey.surface_source import IMAGES
from cityflow.survey.survey import source_kind_of


def sample_figures(error: RelativeError, images: int) -> dict[str, Any]:
    """A sample as a note has it."""
    figures = {
        **asdict(error),
        "images": images,
        "significant": error.is_significant,
        "nmad_gsd": error.expected_nmad_gsd,
    }
    found: dict[str, Any] = finite(figures)
    return found


def is_refinable(city: CityParameters, given: Catalog) -> bool:
    """Whether a run looks at the poses: it makes its surface of images, of enough of them, and nobody has forbidden it."""
    if city.orient.refine == "never" or source_kind_of(given, city.points.source) != IMAGES:
        return False
    return len(flown_of(given.images)) >= FEWEST


def digest_of_poses(city: CityParameters, given: Catalog) -> str:
    """Of all that decides which poses a run uses."""
    images = [
        [a.name, a.checksum, a.size, a.dtype, a.white, list(a.heights), to_json(a.oriented)]
        for a in flown_of(given.images)
    ]
    return digest_of([VERSION, SAMPLE_VERSION, orient.VERSION, orient.ADJUST_VERSION, as_json(city.orient), images])


def settled_poses(city: CityParameters, given: Catalog, store: Store) -> SettledPoses | None:
    """What the RUN knows of the poses of a catalog; None where nothing was found out yet, or something has changed since."""
    found = read_note(store) if is_refinable(city, given) else None
    if found is None or found.of != digest_of_poses(city, given) or (found.refined and not _holds_poses(found.block)):
        return None
    return found


def catalog_in_use(given: Catalog, settled: SettledPoses | None) -> Catalog:
    """The catalog with the poses that the run uses."""
    if settled is None or not settled.refined or settled.block is None:
        return given
    return with_poses(given, decode_poses(settled.block))


def _holds_poses(block: Mapping[str, Any] | None) -> bool:
    try:
        return block is not None and bool(decode_poses(block))
    except (KeyError, TypeError, ValueError, IndexError):
        return False
