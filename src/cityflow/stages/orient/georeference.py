"""The last stage of ``cityflow orient`` for photographs: the placed model, adjusted with GNSS positions and control points as observations."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from cityflow.adjustment.georeferencing import Georeferenced, Positions, georeferenced
from cityflow.adjustment.tracks import of_tracks
from cityflow.core.arrays import FloatArray
from cityflow.core.json_values import rounded
from cityflow.errors import CatalogError
from cityflow.flow.task import Json, Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import OrientedField
from cityflow.handover.known_points import KnownPoint, control_points
from cityflow.handover.mapped_models import decode_models
from cityflow.handover.oriented import to_json
from cityflow.handover.refined_block import encode_refinement
from cityflow.handover.tie_files import decode_features
from cityflow.stages.orient import ADJUST, BLOCK, BLOCK_FILE, POINTS_FILE, WHOLE_BLOCK

VERSION = 7
LEAST_VIEWS, MOST_ERROR_PX = 3, 2.0
"""Tie points that become the catalog's: so many images show them, with a mean reprojection error below this; set by hand."""
Numbers = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class PlacedImage(TaskInputs):
    """An image of the model, placed by a similarity; its head is its camera's number.

    Attributes
    ----------
    features : RUN-relative path;  position, sigmas_m : by GNSS, metres
    station : images of one station were taken together
    """

    image: OrientedField
    features: str
    position: Numbers | None
    sigmas_m: Numbers | None
    station: int | None = None


@dataclass(frozen=True, slots=True)
class GeoreferenceInputs(TaskInputs):
    """The images of the first model of `models` (RUN-relative path) in its order; see `Positions` and `georeferenced`."""

    images: tuple[PlacedImage, ...]
    models: str
    arm: Numbers | None
    on_line: bool
    points: tuple[KnownPoint, ...]
    wrong: Mapping[str, str]


@dataclass(frozen=True)
class GeoreferenceSource:
    """The one task; `digests`: of the models and of each image's features."""

    given: GeoreferenceInputs
    digests: tuple[str, ...]

    def initial(self) -> Iterable[Task]:
        """It waits for nothing: the mapping has ended."""
        asked = self.given
        images = [
            [to_json(i.image), list(i.position or ()), list(i.sigmas_m or ()), i.station, d]
            for i, d in zip(asked.images, self.digests[1:], strict=True)
        ]
        yield GEOREFERENCE_KIND.task(
            BLOCK, parameters={"arm": list(asked.arm or ()), "on_line": asked.on_line},
            inputs={
                "models": self.digests[0], "images": digest_of(images),
                "points": digest_of([[as_json(p) for p in asked.points], sorted(asked.wrong.items())]),
            },
            given=asked, limits=WHOLE_BLOCK,
        )  # fmt: skip

    def after(self, task: Task, record: Record) -> Iterable[Task]:  # noqa: ARG002 - the signature of a source
        """Nothing follows."""
        return ()


def run_georeference(workspace: Workspace, task: Task) -> Outcome:
    """Poses, cameras and tie points, adjusted.

    Raises
    ------
    CatalogError
        The ties hold no block.
    """
    given = task.arguments_as(GeoreferenceInputs)
    model = decode_models(workspace.read(given.models))[0]
    features = [decode_features(workspace.read(i.features)) for i in given.images]
    tracks = model.tracks.copy()
    tracks[:, 1] = np.searchsorted(np.array(model.numbers), tracks[:, 1])
    ties = of_tracks(tracks, [f.uv for f in features], [f.scale for f in features])
    positions = Positions(
        _rows([i.position for i in given.images]), _rows([i.sigmas_m for i in given.images]),
        None if given.arm is None else np.array(given.arm), given.on_line, tuple(i.station for i in given.images),
    )  # fmt: skip
    try:
        found = georeferenced(
            [i.image for i in given.images], ties, positions, control_points(given.points), given.wrong
        )
    except ValueError as error:
        raise CatalogError(str(error), where="the tie points of the mapping") from error
    text, summary = encode_refinement(found.refinement)
    data = io.BytesIO()
    kept = (found.lengths >= LEAST_VIEWS) & (found.errors_px < MOST_ERROR_PX)
    np.save(data, np.column_stack([found.xyz, found.lengths, found.errors_px])[kept], allow_pickle=False)
    workspace.write(POINTS_FILE, data.getvalue())
    workspace.write(BLOCK_FILE, json.dumps(text, sort_keys=True, separators=(",", ":"), allow_nan=False).encode())
    return workspace.outcome(result={**summary, **_figures(found)})


def _rows(values: list[Numbers | None]) -> FloatArray:
    return np.array([v or (np.nan,) * 3 for v in values], np.float64).reshape(-1, 3)


def _figures(found: Georeferenced) -> dict[str, Json]:
    adjusted, names = found.refinement.adjusted, [i.name for i in found.refinement.images]
    off = adjusted.away[:, 3:]
    used = off[found.used]
    rms = [rounded(float(v), 4) for v in np.sqrt(np.mean(used**2, axis=0))] if len(used) else None
    return {
        "taken": found.is_taken,
        "held_focals": [adjusted.block.heads[int(np.argmax(adjusted.block.camera == k))] for k in found.held_focals],
        "positions": int(found.used.sum()), "positions_rms_m": rms, "positions_far": list(found.far),
        "positions_off_m": {
            n: [rounded(float(v), 4) for v in row] for n, row, u in zip(names, off, found.used, strict=True) if u
        },
        "mounts": None if found.mounts is None else {
            "relations": len(found.mounts.mount), "heads": len(found.mounts.offsets) + 1,
            "angle_sigma_deg": rounded(float(np.degrees(found.mounts.sigmas[0])), 5), "offset_sigma_m": rounded(found.mounts.sigmas[1], 4),
        },
        "arms": [
            {
                "head": adjusted.block.heads[int(np.argmax(adjusted.block.camera == k))],
                "arm_m": [rounded(float(v), 4) for v in arm], "sigmas_m": [rounded(float(v), 4) for v in sigma],
            }
            for k, (arm, sigma) in enumerate(zip(adjusted.arms, adjusted.arm_sigmas, strict=True)) if arm.any()
        ],
    }  # fmt: skip


GEOREFERENCE_KIND = TaskKind(ADJUST, VERSION, run_georeference, GeoreferenceInputs)
