"""Stage ``register`` of ``cityflow orient --onto``: tie points of a block are led onto LiDAR files, a DSM or outlines."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from cityflow.adjustment.coarse_registration import Search
from cityflow.adjustment.outline_registration import registered_to_outlines
from cityflow.adjustment.registration import RegistrationError, registered
from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds, Grid
from cityflow.errors import CatalogError
from cityflow.flow.task import Limits, Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.handover.registration_file import encode_registration
from cityflow.handover.source_file import SourceFile
from cityflow.io.catalog.stac_assets import LIDAR, OUTLINES, Catalog
from cityflow.io.crs import resolve
from cityflow.io.fetch import local_file
from cityflow.io.points.las import stream
from cityflow.io.rasters.raster import read_window
from cityflow.io.tables.outline_file import read_outlines
from cityflow.stages.orient import BLOCK

REGISTER, DSM = "register", "dsm"
VERSION = 1
REGISTRATION_FILE = "registration.json"
LIMITS = Limits(time_s=6 * 3600, memory_mb=16000)
VOXEL_M = 0.25
"""Of the points of a scan that fall into a cube of this size one is kept; set by hand, as are those below."""
LEAST_CELL_M = 0.25
"""A DSM is read on cells of its own, but none finer than this."""
MOST_REFERENCE = 30_000_000
"""Points that are kept in memory (0.7 GB, thrice while they are joined)."""


@dataclass(frozen=True, slots=True)
class SurveyFile(TaskInputs):
    """A file of the survey; `kind` is ``lidar``, ``dsm`` or ``outlines``; `cell`: of a DSM, metres; `layer`: of outlines."""

    kind: str
    file: SourceFile
    bounds: Bounds
    cell: float = 0.0
    layer: str | None = None


@dataclass(frozen=True, slots=True)
class RegisterInputs(TaskInputs):
    """RUN-relative path of the tie points ((N, 3) as numpy's file, metres), files of the survey, code of their CRS, and how far the points may be off."""

    points: str
    survey: tuple[SurveyFile, ...]
    crs: str
    yaw_deg: float
    scale: float
    shift_m: float | None


@dataclass
class RegisterSource:
    """The one task of a registration."""

    task: Task

    def initial(self) -> Iterator[Task]:
        """The task."""
        yield self.task

    def after(self, task: Task, record: Record) -> Iterable[Task]:  # noqa: ARG002
        """Nothing follows."""
        return []


def survey_files(survey: Catalog) -> tuple[SurveyFile, ...]:
    """What photographs can be registered to: the LiDAR files of a catalog, else its DSM, else its outlines."""
    if survey.lidar:
        return tuple(SurveyFile(LIDAR, SourceFile(a.href, a.size, a.checksum), a.bounds) for a in survey.lidar)
    if (dsm := survey.rasters.get(DSM)) is not None:
        return (SurveyFile(DSM, SourceFile(dsm.href, dsm.size, dsm.checksum), dsm.bounds, dsm.cell),)
    if (given := survey.outlines) is not None:
        file = SourceFile(given.href, given.size, given.checksum)
        return (SurveyFile(OUTLINES, file, given.bounds, layer=given.layer),)
    return ()


def register_task(points: str, digest: str, survey: Catalog, search: Search) -> Task:
    """The task.

    Parameters
    ----------
    points : RUN-relative path of the tie points;  digest : of their contents
    survey : a catalog with LiDAR files, a DSM or outlines
    """
    files, shift = survey_files(survey), search.shift_m if np.isfinite(search.shift_m) else None
    return REGISTER_KIND.task(
        BLOCK, parameters={"yaw_deg": search.yaw_deg, "scale": search.scale, "shift_m": shift},
        inputs={
            "points": digest, "crs": digest_of(survey.reference.code),
            **{f"survey {k}": digest_of([f.kind, f.file.checksum, f.cell, f.layer]) for k, f in enumerate(files)},
        },
        given=RegisterInputs(points, files, survey.reference.code, search.yaw_deg, search.scale, shift),
        limits=LIMITS,
    )  # fmt: skip


def run_register(workspace: Workspace, task: Task) -> Outcome:
    """The similarity that leads the tie points onto the survey.

    Raises
    ------
    CatalogError
        A file cannot be read, or the place is not found, ambiguous or left open.
    """
    given = task.arguments_as(RegisterInputs)
    xyz = decode_tie_points(workspace.read(given.points))
    search = Search(given.yaw_deg, given.scale, np.inf if given.shift_m is None else given.shift_m)
    origin = np.floor(np.median(xyz, axis=0))
    around = _around(xyz, search)
    if given.survey[0].kind == OUTLINES:
        return _onto_outlines(workspace, given, xyz - origin, origin, search)
    survey = survey_points(given.survey, given.crs, around)
    if not len(survey):
        remedy = "check that both are of one place and in one CRS; for photographs without GNSS positions give --scale"
        raise CatalogError(
            f"no point of the survey lies within {search.shift_m:.0f} m of the tie points",
            where="--onto",
            remedy=remedy,
        )
    # the scan may lie far from a frame of its own: each about its own middle
    place = np.floor(np.median(survey, axis=0)) if given.shift_m is None else origin
    try:
        found = registered(xyz - origin, survey - place, search)
    except RegistrationError as error:
        raise CatalogError(str(error), where="--onto", remedy=error.remedy) from error
    return _written(workspace, encode_registration(found, origin, place))


def _written(workspace: Workspace, tree: dict[str, Any]) -> Outcome:
    workspace.write(REGISTRATION_FILE, json.dumps(tree, sort_keys=True, allow_nan=False).encode())
    return workspace.outcome(result=tree["figures"])


def _onto_outlines(
    workspace: Workspace, given: RegisterInputs, xyz: FloatArray, origin: FloatArray, search: Search
) -> Outcome:
    """As `run_register`, of points less their `origin`; heights stay."""
    (each,) = given.survey
    with local_file(each.file.href) as path:
        each.file.refuse_other(path)
        found = read_outlines(path, None, None, resolve(given.crs), each.layer)[0]
    parts = [p for o in found for p in shapely.get_parts(o.polygon) if not p.is_empty]
    middle = np.floor(np.median([p.bounds[:2] for p in parts], axis=0)) if given.shift_m is None else origin[:2]
    place = np.array([*middle, origin[2]])
    if not parts:
        raise CatalogError("no outlines", where=each.file.href, remedy="name the layer that has them in a catalog")
    local = [shapely.transform(p, lambda xy: xy - place[:2]) for p in parts]
    try:
        done = registered_to_outlines(xyz, local, search)
    except RegistrationError as error:
        raise CatalogError(str(error), where="--onto", remedy=error.remedy) from error
    return _written(workspace, encode_registration(done, origin, place))


def encode_tie_points(xyz: FloatArray) -> bytes:
    """(N, 3) float64 as numpy's file."""
    data = io.BytesIO()
    np.save(data, np.ascontiguousarray(xyz, np.float64), allow_pickle=False)
    return data.getvalue()


def decode_tie_points(data: bytes) -> FloatArray:
    """What `encode_tie_points` wrote."""
    return np.asarray(np.load(io.BytesIO(data), allow_pickle=False), np.float64)


def _around(xyz: FloatArray, search: Search) -> Bounds | None:
    """Where the survey matters; None: anywhere."""
    if not np.isfinite(search.shift_m):
        return None
    low, high = np.percentile(xyz[:, :2], [0.5, 99.5], axis=0)
    more = search.shift_m + 0.5 * float(np.max(high - low)) * (search.scale - 1.0) + 10.0
    return float(low[0] - more), float(low[1] - more), float(high[0] + more), float(high[1] + more)


def survey_points(files: tuple[SurveyFile, ...], crs: str, around: Bounds | None) -> FloatArray:
    """(N, 3) points of LiDAR files or a DSM around a block (None: all), one in a voxel."""
    return _thinned([p for f in files for p in _points_of(f, crs, around)])


def _points_of(each: SurveyFile, crs: str, around: Bounds | None) -> Iterator[FloatArray]:
    """(N, 3) points of a file around a block, part by part."""
    bounds = _common(each.bounds, around)
    if bounds is None:
        return
    with local_file(each.file.href) as path:
        each.file.refuse_other(path)
        if each.kind == DSM:
            grid = Grid.covering(bounds, max(each.cell, LEAST_CELL_M))
            z = read_window(path, grid, resolve(crs))
            x, y = grid.centres()
            known = np.isfinite(z)
            yield np.column_stack([x[known], y[known], z[known]])
            return
        for cloud, _ in stream(path):
            x, y = cloud.xyz[:, 0], cloud.xyz[:, 1]
            near = (x >= bounds[0]) & (x <= bounds[2]) & (y >= bounds[1]) & (y <= bounds[3])
            yield _one_per_voxel(cloud.xyz[near])


def _common(one: Bounds, other: Bounds | None) -> Bounds | None:
    if other is None:
        return one
    both = max(one[0], other[0]), max(one[1], other[1]), min(one[2], other[2]), min(one[3], other[3])
    return both if both[0] < both[2] and both[1] < both[3] else None


def _thinned(parts: list[FloatArray]) -> FloatArray:
    """All points, one in a voxel."""
    count = sum(map(len, parts))
    if count > MOST_REFERENCE:
        problem = (
            f"{count:,} points of the survey lie where the photographs may be, at most {MOST_REFERENCE:,} are compared"
        )
        remedy = "name fewer files, or say how far the photographs may be off with --set registration.shift_m=…"
        raise CatalogError(problem, where="--onto", remedy=remedy)
    return _one_per_voxel(np.concatenate(parts)) if parts else np.empty((0, 3))


def _one_per_voxel(xyz: FloatArray) -> FloatArray:
    """The first point of each voxel, in the points' order."""
    if not len(xyz):
        return xyz
    cell = np.floor(xyz / VOXEL_M).astype(np.int64)
    cell -= cell.min(axis=0)
    size = cell.max(axis=0) + 1
    key = (cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2]
    first = np.unique(key, return_index=True)[1]
    return np.asarray(xyz[np.sort(first)])


REGISTER_KIND = TaskKind(REGISTER, VERSION, run_register, RegisterInputs)
