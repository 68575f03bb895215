"""The task that takes frames of a video or of stills as photographs: files, positions, and what it refuses."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from adjustment.film import RATE, filmed, pictures
from cityflow.adjustment.frame_choice import FrameParameters
from cityflow.core.photo_metadata import GnssPosition
from cityflow.errors import CatalogError
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome
from cityflow.flow.workspace import Workspace
from cityflow.handover.sequence_files import SequenceTable, decode_sequence
from cityflow.handover.source_file import SourceFile
from cityflow.io.images.exif_and_xmp import photo_metadata
from cityflow.io.images.subtitles import CarrierPosition, subtitles_text
from cityflow.io.images.video import video_frames, write_video
from cityflow.stages.orient.frames import FRAMES_FILE, FrameInputs, FrameSource, Still, run_frames
from cityflow.synthetic.video_flight import HOVERING, SHARP, VideoParameters

SIZE = (240, 180)
FILM = VideoParameters(
    width_px=SIZE[0], height_px=SIZE[1], frames_a_second=RATE, seconds=3.0, altitude_m=50.0, tilt_deg=20.0, speed_ms=10.0, turn_deg=60.0,
    hover_s=0.3, repeated_s=0.0, blurred_share=0.1, blur_px=6.0,
)  # fmt: skip


@lru_cache(maxsize=1)
def _pictures() -> tuple[np.ndarray, ...]:
    return tuple(pictures(filmed(FILM)))


def _source(path: Path) -> SourceFile:
    data = path.read_bytes()
    return SourceFile(str(path), len(data), hashlib.sha256(data).hexdigest())


def _filmed(folder: Path, frames: tuple[np.ndarray, ...] | None = None, name: str = "flight.mp4") -> Path:
    path = folder / name
    write_video(path, _pictures() if frames is None else frames, SIZE, RATE)
    return path


def _run(folder: Path, given: FrameInputs) -> tuple[Outcome, SequenceTable]:
    task = next(FrameSource(given, FrameParameters()).initial())
    outcome = run_frames(Workspace(Store.open(str(folder)), task), task)
    table = next(p for p in outcome.outputs if p.endswith(FRAMES_FILE))
    return outcome, decode_sequence((folder / table).read_bytes())


def test_photographs_of_a_video_carry_time_and_place(tmp_path: Path) -> None:
    frames = filmed(FILM)
    video, places = _filmed(tmp_path), tmp_path / "flight.srt"
    known = [
        CarrierPosition(f.time_s, GnssPosition(48.0 + 1e-5 * k, 11.0, 500.0 + k), 50.0) for k, f in enumerate(frames)
    ]
    places.write_text(subtitles_text(known, RATE))
    outcome, table = _run(tmp_path / "one", FrameInputs(_source(video), _source(places)))
    assert len(table.chosen) >= 3
    assert {frames[e.number].kind for e in table.chosen} == {SHARP}
    assert [e.time_s for e in table.chosen] == pytest.approx([frames[e.number].time_s for e in table.chosen])
    assert outcome.result["frames"] == len(frames)
    decoded = {f.number: f.pixels for f in video_frames(video)}
    for entry in table.chosen:
        path = tmp_path / "one" / next(p for p in outcome.outputs if p.endswith(entry.file))
        pixels = np.asarray(cv2.imread(str(path)))[..., ::-1]
        assert np.abs(pixels.astype(int) - decoded[entry.number]).mean() < 2
        position = photo_metadata(path).position
        assert position is not None
        assert position.latitude == pytest.approx(48.0 + 1e-5 * entry.number, abs=2e-6)
        assert position.height_m == pytest.approx(500.0 + entry.number, abs=0.01)
    again, _ = _run(tmp_path / "two", FrameInputs(_source(video), _source(places)))
    assert again.outputs == outcome.outputs


def test_stills_in_sequence_are_chosen_alike(tmp_path: Path) -> None:
    stills = []
    for k, picture in enumerate(_pictures()):
        path = tmp_path / f"i{k:03d}.png"
        cv2.imwrite(str(path), picture)
        stills.append(Still(path.name, _source(path), k / RATE))
    _, table = _run(tmp_path / "run", FrameInputs(stills=tuple(stills)))
    kinds = [filmed(FILM)[e.number].kind for e in table.chosen]
    # the first frame that hovers is a step away from the one before
    assert set(kinds) <= {SHARP, HOVERING}
    assert kinds.count(HOVERING) <= 1
    assert [e.file for e in table.chosen] == [f"i{e.number:03d}.png" for e in table.chosen]
    other = tmp_path / "i999.png"
    cv2.imwrite(str(other), _pictures()[0][:100])
    with pytest.raises(CatalogError, match=r"it has 240 x 100 pixels, i000.png has 240 x 180") as refused:
        _run(tmp_path / "run", FrameInputs(stills=(*stills, Still(other.name, _source(other), 9.0))))
    assert "of one camera" in refused.value.remedy


@pytest.mark.parametrize(
    ("contents", "said"),
    [
        (b"", "the video is empty"),
        (b"all of it " * 50, "no video that can be decoded .500 bytes.: of another kind, damaged, or cut off"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, contents: bytes, said: str) -> None:
    path = tmp_path / "film.mp4"
    path.write_bytes(contents)
    with pytest.raises(CatalogError, match=said) as refused:
        _run(tmp_path / "run", FrameInputs(_source(path)))
    assert refused.value.where == str(path)
    assert refused.value.remedy


def test_a_video_that_is_cut_off_is_refused_or_used_as_far_as_it_goes(tmp_path: Path) -> None:
    whole = _filmed(tmp_path)
    cut = tmp_path / "cut.mp4"
    cut.write_bytes(whole.read_bytes()[:-2000])
    with pytest.raises(CatalogError, match="cut off"):
        _run(tmp_path / "run", FrameInputs(_source(cut)))
    other = tmp_path / "cut.avi"
    writer = cv2.VideoWriter(str(other), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"MJPG"), RATE, SIZE)
    for picture in _pictures():
        writer.write(picture)
    writer.release()
    data = other.read_bytes()
    other.write_bytes(data[: len(data) * 2 // 3])
    _, table = _run(tmp_path / "run", FrameInputs(_source(other)))
    assert 15 < table.frames < len(_pictures())
    assert "could be decoded" in table.notes[0]


def test_one_frame_and_a_camera_that_stands_or_turns_are_refused(tmp_path: Path) -> None:
    one = _filmed(tmp_path, _pictures()[:1], "one.mp4")
    with pytest.raises(CatalogError, match="the video has one frame"):
        _run(tmp_path / "run", FrameInputs(_source(one)))
    still = _filmed(tmp_path, _pictures()[:1] * 20, "still.mp4")
    with pytest.raises(
        CatalogError, match=r"the camera does not move: pictures shift by 0.\d px of 640 over 20 frames"
    ) as refused:
        _run(tmp_path / "run", FrameInputs(_source(still)))
    assert "moving camera" in refused.value.remedy
    turning = filmed(FILM.model_copy(update={"speed_ms": 0.0, "turn_deg": 120.0, "blurred_share": 0.0}))
    turned = _filmed(tmp_path, tuple(pictures(turning)), "turned.mp4")
    with pytest.raises(CatalogError, match="the camera turns, but does not move from its place"):
        _run(tmp_path / "run", FrameInputs(_source(turned)))
