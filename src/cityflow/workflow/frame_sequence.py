"""A video, or a folder of stills in sequence, as a folder of photographs: frames are chosen by a task, those of a video are written beside the catalog."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from rich.console import Console

from cityflow.adjustment.frame_choice import BLURRED, DOUBLE, STILL, FrameParameters
from cityflow.catalog.file_reading import read_digest
from cityflow.catalog.photo_folder import PhotoFile
from cityflow.catalog.write_folder import store_catalog
from cityflow.core.building import Status
from cityflow.errors import CatalogError, RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.sequence_files import SequenceTable, decode_sequence
from cityflow.handover.source_file import SourceFile
from cityflow.io.catalog.stac import Catalog
from cityflow.io.images.subtitles import subtitles_of
from cityflow.io.images.video import stated_frames
from cityflow.io.tables.outlines_gpkg import write_geopackage
from cityflow.reporting.carrier_track import TRACK, carrier_track, track_figures, track_layers
from cityflow.stages.orient import BLOCK
from cityflow.stages.orient.frames import FRAMES, FRAMES_FILE, FrameInputs, FrameSource, Still, chosen_in
from cityflow.workflow.orient import run_stages, say


@dataclass(frozen=True, slots=True)
class FrameSequence:
    """What was chosen, and the folder with its photographs; `name`: of the video or folder."""

    name: str
    folder: Path
    table: SequenceTable

    @property
    def files(self) -> frozenset[str]:
        """Names of the photographs' files."""
        return frozenset(e.file for e in self.table.chosen)


def frames_of_video(
    video: Path, out: Path, work: Path, parameters: FrameParameters, scheduler: str, workers: int, console: Console
) -> FrameSequence:
    """Choose frames of a video, and write them to the folder `OUT-frames`.

    Raises
    ------
    CatalogError
        It is no video, or none of a moving camera.
    RunError
        The folder of frames holds something else.
    """
    folder = out.absolute().with_name(f"{out.absolute().name}-frames")
    if folder.exists() and not (folder.is_dir() and (not any(folder.iterdir()) or (folder / FRAMES_FILE).is_file())):
        remedy = "name another catalog with --out, or move it away"
        raise RunError("the folder for the video's frames holds something else", where=str(folder), remedy=remedy)
    # whether it can be opened is known before a cluster starts
    stated_frames(video)
    beside = subtitles_of(video)
    given = FrameInputs(_source(video), _source(beside) if beside is not None else None)
    record, store = _chosen(given, parameters, work, video, scheduler, workers)
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    for path in record.outputs:
        (folder / Path(path).name).write_bytes(store.read_bytes(path))
    return _told(FrameSequence(video.name, folder, decode_sequence(store.read_bytes(chosen_in(record)))), console)


def stills_of_sequence(
    folder: Path, files: tuple[PhotoFile, ...], work: Path, parameters: FrameParameters, scheduler: str, workers: int, console: Console
) -> FrameSequence:  # fmt: skip
    """Choose photographs of a folder whose names are in the order of the flight. Raises CatalogError as `frames_of_video`."""
    ordered = sorted(files, key=lambda f: f.relative)
    times = _times([f.metadata.taken for f in ordered])
    stills = tuple(
        Still(f.relative, SourceFile(str(Path(f.path).absolute()), f.size, f.checksum), t)
        for f, t in zip(ordered, times, strict=True)
    )
    record, store = _chosen(FrameInputs(stills=stills), parameters, work, folder, scheduler, workers)
    return _told(FrameSequence(folder.name, folder, decode_sequence(store.read_bytes(chosen_in(record)))), console)


def add_track(
    report: dict[str, Any], catalog: Catalog, sequence: FrameSequence, name_of: Mapping[str, str], out: Path
) -> Catalog:
    """Note the frames and the carrier's track in the report, write the track, and give the catalog's images their times.

    Parameters
    ----------
    name_of : a photograph's file → its name in the catalog
    """
    frames = {
        name_of[e.file]: {"time_s": e.time_s, "number": e.number, "overlap": e.overlap, "parallax_px": e.parallax_px}
        for e in sequence.table.chosen if e.file in name_of
    }  # fmt: skip
    track = carrier_track([a.oriented for a in catalog.images], frames, sequence.table.between)
    table = sequence.table
    report["sequence"] = {
        "name": sequence.name, "frames": table.frames, "kinds": dict(table.counts), "pieces": table.pieces, "notes": list(table.notes),
        "chosen": frames, "track": track_figures(track),
    }  # fmt: skip
    (out / TRACK).write_bytes(write_geopackage(track_layers(track, sequence.name), catalog.reference))
    timed = [replace(a, video_s=frames[a.name]["time_s"]) if a.name in frames else a for a in catalog.images]
    return store_catalog(replace(catalog, images=tuple(timed)), out, copy=False)


def _source(path: Path) -> SourceFile:
    digest = read_digest(str(path))
    return SourceFile(str(path.absolute()), digest.size, digest.checksum)


def _chosen(
    given: FrameInputs, parameters: FrameParameters, work: Path, where: Path, scheduler: str, workers: int
) -> tuple[Record, Store]:  # fmt: skip
    store = Store.open(str(work))
    store.check_writable()
    with Ledger.open(store) as ledger:
        run_stages(FrameSource(given, parameters), {FRAMES: 1}, store, ledger, scheduler, workers)
        record = ledger.latest(FRAMES, BLOCK)
    if record is None or record.status is Status.FAILED:
        problem, _, remedy = (record.reason if record is not None else "no record").partition(" → ")
        plain = problem.removeprefix("CatalogError: ").removeprefix(f"{where.absolute()}: ")
        raise CatalogError(plain, where=str(where), remedy=remedy or "see docs/orient.md")
    return record, store


def _times(taken: list[str]) -> list[float]:
    """Seconds since the first, by EXIF; numbers where one of them is not known."""
    found = []
    for text in taken:
        match = re.match(r"(\d{4}:\d\d:\d\d \d\d:\d\d:\d\d)(\.\d+)?", text)
        if match is None:
            return [float(k) for k in range(len(taken))]
        found.append((datetime.strptime(match[1], "%Y:%m:%d %H:%M:%S"), float(match[2] or 0)))
    return [round((t - found[0][0]).total_seconds() + part - found[0][1], 3) for t, part in found]


def _told(found: FrameSequence, console: Console) -> FrameSequence:
    table = found.table
    counts = table.counts
    say(
        console,
        f"{len(table.chosen)} of {table.frames} frames are taken; {counts[BLURRED]} are blurred, {counts[STILL]} show no step, "
        f"{counts[DOUBLE]} show a picture again",
    )
    if table.pieces > 1:
        say(console, f"Note: the sequence has {table.pieces} pieces that do not continue one another")
    for note in table.notes:
        say(console, f"Note: {note}")
    return found
