"""The adjustment of a block that planes of a scan hold, after its registration; Dask tasks, whose records stay."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.held_block import HeldBlock, decode_held
from cityflow.handover.refined_block import decode_poses
from cityflow.handover.registration_file import decode_registration
from cityflow.handover.source_file import SourceFile
from cityflow.io.catalog.stac_assets import LIDAR, Catalog
from cityflow.stages.orient import ADJUST, BLOCK, BLOCK_FILE, BLOCK_TIES_FILE, POINTS_FILE
from cityflow.stages.orient.hold import HOLD, TOO_FEW, GivenBlock, GivenImage, HoldSource
from cityflow.stages.orient.register import REGISTER, REGISTRATION_FILE, survey_files
from cityflow.stages.orient.scan_patches import CROPS, PATCHES
from cityflow.workflow.orient import run_stages


def held_onto(given: Catalog, survey: Catalog, store: Store, scheduler: str, workers: int) -> HeldBlock | str:
    """Adjust the block to the LiDAR files of a survey, after its adjustment and registration; else why the block stays where the registration has it.

    Parameters
    ----------
    given : the catalog before its poses were refined
    """
    files = survey_files(survey)
    if not files or files[0].kind != LIDAR:
        return "only LiDAR files hold it"
    with Ledger.open(store) as ledger:
        adjust, register = ledger.latest(ADJUST, BLOCK), ledger.latest(REGISTER, BLOCK)
        assert adjust is not None
        assert register is not None
        paths = _outputs(adjust) | _outputs(register)
        block = json.loads(store.read_bytes(paths[BLOCK_FILE]))
        assets = {a.name: a for a in given.images}
        images = tuple(
            GivenImage(
                a.oriented, pose.image, SourceFile(a.href, a.size, a.checksum), a.white or float(np.iinfo(a.dtype).max)
            )
            for name, pose in decode_poses(block).items()
            for a in (assets[name],)
        )
        sigmas = tuple(float(adjust.result[key]) for key in ("sigma_px", "position_sigma_m", "angle_sigma_deg"))
        source = HoldSource(
            GivenBlock(
                images, paths[POINTS_FILE], paths[BLOCK_TIES_FILE], paths[REGISTRATION_FILE], {**adjust.outputs, **register.outputs}, files,
                survey.reference.code, (sigmas[0], sigmas[1], sigmas[2]),
            )
        )  # fmt: skip
        counts = {PATCHES: 1, CROPS: len(images), HOLD: 1}
        run_stages(source, counts, store, ledger, scheduler, workers)
        # the adjustment of an earlier command does not count where the patches failed in this one
        ended = [ledger.latest(stage, BLOCK) for stage in (PATCHES, HOLD)]
    failed = [r for r in ended if r is None or r.status is Status.FAILED]
    if failed:
        return failed[0].reason if failed[0] is not None else "nothing was done"
    record = ended[-1]
    assert record is not None
    tree = json.loads(store.read_bytes(next(iter(record.outputs))))
    if not tree:
        return TOO_FEW
    return decode_held(tree, decode_registration(json.loads(store.read_bytes(paths[REGISTRATION_FILE]))))


def _outputs(record: Record) -> dict[str, str]:
    """Name of a file → its path."""
    return {Path(path).name: path for path in record.outputs}
