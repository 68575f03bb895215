"""Stage of ``cityflow orient`` for a video or a sequence of stills: which frames are taken as photographs; those of a video are written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from cityflow.adjustment.frame_choice import FrameChoice, FrameParameters, choose_frames
from cityflow.core.photo_metadata import PhotoMetadata
from cityflow.core.pixels import PixelArray
from cityflow.errors import CatalogError
from cityflow.flow.task import Limits, Outcome, Record, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.sequence_files import OtherFrame, SequenceEntry, SequenceTable, encode_sequence
from cityflow.handover.source_file import SourceFile
from cityflow.io.fetch import local_file
from cityflow.io.images.exif_write import with_exif
from cityflow.io.images.image_write import JPEG_ENDING, jpeg_bytes
from cityflow.io.images.subtitles import CarrierPosition, position_at, read_subtitles
from cityflow.io.images.video import READABLE, DecodedFrame, stated_frames, video_frames
from cityflow.stages.orient import BLOCK

FRAMES = "frames"
VERSION = 1
FRAMES_FILE = "frames.json"
JPEG_QUALITY = 97
LEAST_WAY = 0.02
"""Of the width: a sequence in which points move less does not move."""
MISSING_SHARE = 0.02
"""Of the frames that a file states: more are told where they are missing."""
STILLS_A_SECOND = 8.0
"""Of a sequence of stills, so that each is compared with as many around it."""
LIMITS = Limits(time_s=24 * 3600, memory_mb=6000)


@dataclass(frozen=True, slots=True)
class Still(TaskInputs):
    """A photograph of a sequence: its file, and seconds since the first one."""

    name: str
    file: SourceFile
    time_s: float


@dataclass(frozen=True, slots=True)
class FrameInputs(TaskInputs):
    """A video with its subtitles, or the stills of a sequence in their order."""

    video: SourceFile | None = None
    subtitles: SourceFile | None = None
    stills: tuple[Still, ...] = ()


@dataclass(frozen=True, slots=True)
class FrameSource:
    """The one task of a sequence."""

    given: FrameInputs
    parameters: FrameParameters

    def initial(self) -> Iterator[Task]:
        """It waits for nothing."""
        given = self.given
        files = {
            "video": given.video,
            "subtitles": given.subtitles,
            **{f"still {s.name}": s.file for s in given.stills},
        }
        yield FRAMES_KIND.task(
            BLOCK, parameters=as_json(self.parameters), inputs={name: file.checksum for name, file in files.items() if file is not None},
            given=given, limits=LIMITS,
        )  # fmt: skip

    def after(self, _task: Task, _record: Record) -> Iterable[Task]:
        return ()


def run_frames(workspace: Workspace, task: Task) -> Outcome:
    """Choose frames; those of a video become JPEG files with the carrier's position in their EXIF block.

    Raises
    ------
    CatalogError
        It is no video, has fewer than two frames, shows one place only, or stills differ in size.
    """
    given, parameters = task.arguments_as(FrameInputs), task.parameters_as(FrameParameters)
    if given.video is not None:
        with local_file(given.video.href) as path:
            given.video.refuse_other(path)
            return _of_video(workspace, path, given, parameters)
    choice = choose_frames(_stills(given.stills), STILLS_A_SECOND, parameters)
    where = str(Path(given.stills[0].file.href).parent) if given.stills else "the sequence"
    refuse_still_camera(choice, where)
    entries = [
        SequenceEntry(given.stills[c.number].name, c.number, c.time_s, c.overlap, c.parallax_px) for c in choice.chosen
    ]
    return _written(workspace, choice, entries, ())


def _of_video(workspace: Workspace, path: Path, given: FrameInputs, parameters: FrameParameters) -> Outcome:
    assert given.video is not None
    where = given.video.href
    stated, times = stated_frames(path), list[float]()

    def decoded() -> Iterator[tuple[float, PixelArray]]:
        for frame in video_frames(path):
            times.append(frame.time_s)
            yield frame.time_s, frame.pixels

    choice = choose_frames(decoded(), _rate(path), parameters)
    count = len(times)
    if count < 2:
        problem = f"the video has {'one frame' if count else 'no frame that can be decoded'}"
        raise CatalogError(problem, where=where, remedy="a video of a moving camera is needed" if count else READABLE)
    refuse_still_camera(choice, where)
    notes = []
    if stated - count > max(1, MISSING_SHARE * stated):
        notes.append(
            f"the video is cut off or damaged: {count} of its {stated} frames could be decoded, up to {times[-1]:.2f} s"
        )
    known = _positions(given.subtitles, notes)
    names = {c.number: f"{Path(where).stem}_{c.number:06d}{JPEG_ENDING}" for c in choice.chosen}
    for frame in video_frames(path, max(names)):
        if frame.number in names:
            workspace.write(names[frame.number], _photograph(frame, names[frame.number], known))
    entries = [SequenceEntry(names[c.number], c.number, c.time_s, c.overlap, c.parallax_px) for c in choice.chosen]
    return _written(workspace, choice, entries, notes)


def _rate(path: Path) -> float:
    """Frames a second, from the times of the first ones."""
    times = [f.time_s for f in video_frames(path, 20)]
    return (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 and times[-1] > times[0] else 25.0


def refuse_still_camera(choice: FrameChoice, where: str) -> None:
    """Raises CatalogError where no two frames were taken from different places."""
    width, count = 640, len(choice.kinds)
    if choice.widest_px < LEAST_WAY * width and choice.pieces <= 1:
        problem = (
            f"the camera does not move: pictures shift by {choice.widest_px:.1f} px of {width} over {count} frames"
        )
        raise CatalogError(
            problem, where=where, remedy="a sequence of a moving camera is needed: nothing else shows depth"
        )
    if choice.moves:
        return
    if all(c.overlap is None for c in choice.chosen):
        problem = f"no two of {count} frames overlap by what is asked, or show the same: {choice.pieces} pieces"
        remedy = "take more frames a second; photographs that are no sequence need no --sequence"
        raise CatalogError(problem, where=where, remedy=remedy)
    problem = f"the camera turns, but does not move from its place ({count} frames)"
    raise CatalogError(problem, where=where, remedy="film from a moving carrier, or lower --set frames.parallax_px")


def _stills(stills: Iterable[Still]) -> Iterator[tuple[float, PixelArray]]:
    first: tuple[str, tuple[int, ...]] | None = None
    for still in stills:
        with local_file(still.file.href) as path:
            still.file.refuse_other(path)
            data = np.frombuffer(path.read_bytes(), np.uint8)
        pixels = cv2.imdecode(data, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION) if len(data) else None
        if pixels is None:
            raise CatalogError(
                "the picture cannot be decoded", where=still.file.href, remedy="remove it from the sequence"
            )
        shape = pixels.shape[:2]
        if first is not None and shape != first[1]:
            problem = f"it has {shape[1]} x {shape[0]} pixels, {first[0]} has {first[1][1]} x {first[1][0]}"
            remedy = "a sequence is of one camera: put others into a folder of their own, or leave out --sequence"
            raise CatalogError(problem, where=still.file.href, remedy=remedy)
        first = first or (still.name, shape)
        yield still.time_s, np.asarray(pixels[..., ::-1], np.uint8)


def _positions(subtitles: SourceFile | None, notes: list[str]) -> tuple[CarrierPosition, ...]:
    if subtitles is None:
        return ()
    with local_file(subtitles.href) as path:
        subtitles.refuse_other(path)
        known = read_subtitles(path)
    if not known:
        notes.append(f"{Path(subtitles.href).name} has no positions: the video is taken without them")
    return known


def _photograph(frame: DecodedFrame, name: str, known: tuple[CarrierPosition, ...]) -> bytes:
    height, width = frame.pixels.shape[:2]
    place = position_at(known, frame.time_s)
    position, above = (None, None) if place is None else (place.position, place.above_start_m)
    known_of_it = PhotoMetadata(name, width, height, model="video", position=position, above_start_m=above)
    return with_exif(jpeg_bytes(frame.pixels, JPEG_QUALITY, full_colour=True), known_of_it)


def _written(workspace: Workspace, choice: FrameChoice, entries: list[SequenceEntry], notes: Iterable[str]) -> Outcome:
    between = tuple(OtherFrame(b.time_s, b.after, b.share) for b in choice.between)
    table = SequenceTable(tuple(entries), len(choice.kinds), choice.counts, choice.pieces, tuple(notes), between)
    workspace.write(FRAMES_FILE, encode_sequence(table))
    return workspace.outcome(result={"frames": len(choice.kinds), "chosen": len(entries), **choice.counts})


def chosen_in(record: Record) -> str:
    """RUN-relative path of the table of what a record's task has chosen."""
    return next(path for path in record.outputs if Path(path).name == FRAMES_FILE)


FRAMES_KIND = TaskKind(FRAMES, VERSION, run_frames, FrameInputs)
