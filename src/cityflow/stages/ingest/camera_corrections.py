"""Stage ``ingest``, for raw frames: the corrections of each camera, found once on its dark and flat frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path, PurePosixPath

import fsspec
import numpy as np
from rasterio.io import DatasetReader
from rasterio.windows import Window

from cityflow.core.arrays import Float32Array
from cityflow.errors import CatalogError
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.array_file import decode_arrays, encode_arrays
from cityflow.imagery.raw_calibration import Calibration, RawFrame, calibration_from, master_dark
from cityflow.imagery.raw_frames import right_aligned
from cityflow.io.catalog.stac import sha256_of
from cityflow.io.fetch import local_file
from cityflow.io.images.image_header import opened
from cityflow.survey.city import INGEST as NAME
from cityflow.survey.raw_parameters import MOST_SATURATED, RawInput
from cityflow.survey.survey import Survey

VERSION = 1
UNIT = "calibration."
ROWS = 512
"""At a time; bounds memory."""
LEAST_LIGHT = 0.02
"""Flat frames lie at least this share of the range above the dark ones, or there is nothing to divide by; set by hand."""


@dataclass(frozen=True, slots=True)
class CalibrationInputs(TaskInputs):
    """Folder and addresses of a camera's dark and flat frames."""

    folder: str
    camera: str
    dark: tuple[str, ...]
    flat: tuple[str, ...]


def unit_of(survey: Survey, image: str) -> str | None:
    """The unit that calibrates the camera of an image; None where no calibration is asked for, or the name tells no camera."""
    frames = survey.parameters.raw.calibration
    camera = frames.camera_of(image) if frames else ""
    return UNIT + camera if camera else None


def task(survey: Survey, unit: str) -> Task:
    """Find the corrections of one camera."""
    raw, camera = survey.parameters.raw, unit.removeprefix(UNIT)
    assert raw.calibration is not None
    folder = placed(survey, raw.calibration.folder)
    darks, flats = (
        matching(folder, name.replace("{camera}", camera)) for name in (raw.calibration.dark, raw.calibration.flat)
    )
    how = RawInput(bits=raw.bits, left_aligned=raw.left_aligned, calibration=raw.calibration)
    return KIND.task(
        unit, parameters=as_json(how, without=("calibration.folder",)),
        inputs={"dark": digest_of([checksum(h) for h in darks]), "flat": digest_of([checksum(h) for h in flats])},
        given=CalibrationInputs(folder, camera, tuple(darks), tuple(flats)),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """One file of corrections for every so many rows: images are corrected by strips, too.

    Raises
    ------
    CatalogError
        Frames are missing, of different sizes, of other numbers than said, saturated or hardly lit.
    """
    given, raw = task.arguments_as(CalibrationInputs), task.parameters_as(RawInput)
    assert raw.calibration is not None
    for kind, frames in (("dark", given.dark), ("flat", given.flat)):
        _refuse_none(frames, kind, given)
    dark = _mean(given.dark, raw, 1.0)
    flat = _mean(given.flat, raw, MOST_SATURATED)
    if dark.shape != flat.shape:
        raise CatalogError(
            f"dark frames of {_size(dark.shape)} pixels, flat frames of {_size(flat.shape)}",
            where=given.folder, remedy=f"take both with the camera {given.camera}, without binning",
        )  # fmt: skip
    _refuse_unlit(dark, flat, raw, given.folder)
    found = calibration_from(dark, flat, raw.calibration.sensor)
    for row in range(0, len(found.gain), ROWS):
        rows = slice(row, row + ROWS)
        part = {"dark": found.dark[rows], "gain": found.gain[rows], "bad": found.bad[rows]}
        workspace.write(_name(row), encode_arrays(part, {"camera": given.camera, "shape": list(found.gain.shape)}))
    digest = digest_of(list(workspace.outputs.values()))
    figures = {"bad": int(found.bad.sum()), "dark": round(float(np.median(found.dark)), 3),
               "gain_deviation": round(float(np.std(found.gain)), 5)}  # fmt: skip
    return workspace.outcome(result={"digest": digest, "shape": list(found.gain.shape), **figures})


def rows_of(data: Sequence[bytes]) -> Calibration:
    """The corrections of adjoining files, joined."""
    parts = [decode_arrays(d)[0] for d in data]
    dark, gain, bad = (np.concatenate([p[name] for p in parts]) for name in ("dark", "gain", "bad"))
    return Calibration(dark, gain, bad)


def placed(survey: Survey, folder: str) -> str:
    """A folder that a workflow names, seen from the catalog."""
    if "://" in folder or PurePosixPath(folder).is_absolute():
        return folder
    home = survey.catalog.href
    if "://" in home:
        return f"{home.rstrip('/')}/{folder}"
    return str((Path(home) / folder).resolve())


def matching(folder: str, name: str) -> list[str]:
    """Addresses of the files of a folder whose names match, sorted; none where there is no such folder.

    Only the last part of `name` may hold ``*``: folders are taken by their very names, brackets and all.
    """
    place, name = f"{folder.rstrip('/')}/{PurePosixPath(name).parent}", PurePosixPath(name).name
    try:
        fs, path = fsspec.core.url_to_fs(place.removesuffix("/."))
        found = sorted(str(p) for p in fs.ls(path, detail=False) if fnmatchcase(PurePosixPath(p).name, name))
    except FileNotFoundError:
        return []
    except (OSError, ImportError) as error:
        remedy = "check the address and your keys"
        raise CatalogError(f"cannot be listed: {error}", where=folder, remedy=remedy) from error
    return [str(fs.unstrip_protocol(p)) for p in found] if "://" in folder else found


def checksum(href: str) -> str:
    """SHA-256 of the contents, computed anew only for a file that has changed; what cannot be read is left to the task to name."""
    try:
        return _checksum(href, stamp(href))
    except OSError:
        return "unreadable"


def stamp(href: str) -> str:
    """Size and date of a file, or what its store has in place of a date; empty where it is not there."""
    try:
        fs, path = fsspec.core.url_to_fs(href)
        about = fs.info(path)
    except (OSError, ImportError):
        return ""
    date = next((str(about[k]) for k in ("ETag", "etag", "mtime", "LastModified", "updated") if about.get(k)), "")
    return f"{about.get('size')} {date}"


@lru_cache(maxsize=4096)
def _checksum(href: str, _stamp: str) -> str:
    return sha256_of(href)[0]


def _mean(hrefs: Sequence[str], raw: RawInput, most_saturated: float) -> Float32Array:
    """Mean of frames, strip by strip over all of them."""
    with ExitStack() as stack:
        frames = [stack.enter_context(opened(stack.enter_context(local_file(h)))) for h in hrefs]
        for frame, href in zip(frames, hrefs, strict=True):
            _refuse_other_kind(frame, frames[0], href, hrefs[0])
        out = np.empty(frames[0].shape, np.float32)
        saturated = np.zeros(len(frames))
        for row in range(0, len(out), ROWS):
            strips = _strips(frames, row, hrefs, raw, saturated)
            out[row : row + ROWS] = master_dark(strips)
    worst = int(np.argmax(saturated))
    if saturated[worst] > most_saturated * out.size:
        raise CatalogError(
            f"{saturated[worst] / out.size:.1%} of the flat frame is saturated, more than {most_saturated:.1%}",
            where=hrefs[worst], remedy="take flat frames at about half of saturation, or leave this one out",
        )  # fmt: skip
    return out


def _strips(
    frames: Sequence[DatasetReader], row: int, hrefs: Sequence[str], raw: RawInput, saturated: np.ndarray
) -> Iterator[RawFrame]:
    for i, frame in enumerate(frames):
        window = Window(0, row, frame.width, min(ROWS, frame.height - row))
        strip = numbers(frame.read(1, window=window), raw, hrefs[i])
        saturated[i] += np.count_nonzero(strip >= top_of(strip, raw))
        yield strip


def numbers(frame: RawFrame, raw: RawInput, where: str) -> RawFrame:
    """Values in the lowest bits.

    Raises
    ------
    CatalogError
        One is greater than it can be.
    """
    values = right_aligned(frame, raw.bits) if raw.bits and raw.left_aligned and _fits(frame, raw.bits) else frame
    highest, top = int(values.max(initial=0)), top_of(values, raw)
    if highest > top:
        raise CatalogError(
            f"a value of {highest}, but numbers of {raw.bits} bits end at {top}",
            where=where, remedy="set raw.bits to the sensor's, or raw.left_aligned if the highest bits hold the value",
        )  # fmt: skip
    return values


def _fits(frame: RawFrame, bits: int) -> bool:
    return 8 * frame.dtype.itemsize >= bits


def top_of(frame: RawFrame, raw: RawInput) -> int:
    """Greatest value that a sensor's number can have."""
    container = 8 * frame.dtype.itemsize
    return int((1 << min(raw.bits or container, container)) - 1)


def _refuse_none(hrefs: Sequence[str], kind: str, given: CalibrationInputs) -> None:
    if not hrefs:
        raise CatalogError(
            f"no {kind} frame of the camera {given.camera}", where=given.folder,
            remedy=f"put it there, or name the files by raw.calibration.{kind} and the camera by raw.calibration.camera",
        )  # fmt: skip


def _refuse_other_kind(frame: DatasetReader, first: DatasetReader, href: str, first_href: str) -> None:
    if frame.count != 1:
        raise CatalogError(
            f"{frame.count} bands: a calibration frame is a mosaic of one",
            where=href, remedy="take the frames as the sensor wrote them",
        )  # fmt: skip
    if frame.dtypes[0] not in ("uint8", "uint16") or frame.dtypes != first.dtypes:
        raise CatalogError(
            f"pixels of type {frame.dtypes[0]}, where {first_href} has {first.dtypes[0]}",
            where=href, remedy="store all frames as uint8 or all as uint16",
        )  # fmt: skip
    if frame.shape != first.shape:
        raise CatalogError(
            f"{_size(frame.shape)} pixels, where {first_href} has {_size(first.shape)}",
            where=href, remedy="keep the frames of one camera at one setting",
        )  # fmt: skip


def _refuse_unlit(dark: Float32Array, flat: Float32Array, raw: RawInput, folder: str) -> None:
    top = (1 << (raw.bits or 8)) - 1
    light = float(np.median(flat[::7, ::7]) - np.median(dark[::7, ::7]))
    if light < LEAST_LIGHT * top:
        raise CatalogError(
            f"flat frames are only {light:.1f} brighter than dark ones",
            where=folder, remedy="see that dark and flat frames are not exchanged; light them to half of saturation",
        )  # fmt: skip


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} x {shape[0]}"


def _name(row: int) -> str:
    """Sorted by name they are sorted by row."""
    return f"rows_{row:06d}.cfa"


KIND = TaskKind(NAME, VERSION, run, CalibrationInputs)
