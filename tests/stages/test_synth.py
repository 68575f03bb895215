"""Synthetic surveys: how much town they need, and tasks whose files are right and always the same."""

from __future__ import annotations

import importlib
import io
from pathlib import Path

import laspy
import numpy as np
import pytest
import rasterio
from pydantic import ValidationError

from cityflow.core.grid import Grid
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.flow.workspace import Workspace
from cityflow.io.images.image_write import jpeg_bytes, tiff_bytes
from cityflow.io.images.subtitles import read_subtitles
from cityflow.io.images.video import video_frames
from cityflow.stages import synth
from cityflow.stages.synth import SynthSource, scene_bounds
from cityflow.stages.synth.film import SUBTITLES_PATH, TRUTH_PATH, VIDEO_PATH, read_truth
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.flight_presets import preset
from cityflow.synthetic.footprints import ground_quad

SMALL = {"width_px": 96, "height_px": 64, "gsd_m": 0.5, "forward_overlap": 0.5, "side_overlap": 0.3}


def small(**more: object) -> SynthParameters:
    return SynthParameters.model_validate(
        {"seed": 4, "size": (40.0, 40.0), "flight": preset("nadir", **SMALL).model_dump(), "truth_cell_m": 0.5, **more}
    )


def run(folder: Path, task: Task) -> dict[str, bytes]:
    """Outputs of one task by path."""
    workspace = Workspace(Store.open(str(folder)), task)
    module, _, name = task.function.partition(":")
    outcome = getattr(importlib.import_module(module), name)(workspace, task)
    return {path: (folder / path).read_bytes() for path in outcome.outputs}


def tasks(parameters: SynthParameters, stage: str) -> list[Task]:
    return [t for t in SynthSource(parameters).initial() if t.stage == stage]


@pytest.mark.parametrize("name", ["five_cameras", "crossing", "five_heads", "nadir"])
def test_no_image_sees_beyond_the_town(name: str) -> None:
    p = SynthParameters(size=(60.0, 60.0), flight=preset(name, width_px=300, height_px=200, gsd_m=0.4))
    town = p.whole_town
    west, south = town.origin_x, town.origin_y
    corners = np.concatenate([ground_quad(i, i.centre[2] - p.flight.flying_height_m) for i in p.images])  # type: ignore[union-attr]
    assert (corners >= [west, south]).all()
    assert (corners <= [west + town.width_m, south + town.height_m]).all()


def test_other_overlaps_leave_the_town_as_it_is() -> None:
    towns = {
        small(flight=preset("five_cameras", **{**SMALL, "forward_overlap": f}).model_dump()).whole_town
        for f in (0.6, 0.8)
    }
    assert len(towns) == 1


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"size": (10.0, 10.0)}, "too small"),
        ({"flight": None}, "nothing to survey"),
        ({"size": (4900.0, 4900.0)}, "at most 5000 m"),
        ({"flight": None, "lidar": {}, "raw": {}}, "raw frames need a flight"),
    ],
)
def test_surveys_that_cannot_be_are_refused(wrong: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        small(**wrong)


def test_truth_tiles_meet_without_a_seam(tmp_path: Path) -> None:
    """Two tiles side by side judge cells as one raster over both does, and lie on one lattice."""
    p = small(origin=(85080.0, 447020.0), truth_cell_m=0.25)
    outputs = [run(tmp_path, t) for t in tasks(p, "truth")]
    assert len(outputs) == 2
    whole = synth._truth_layers(town_of(p.seed, p.whole_town), Grid.covering(p.area, 0.25))
    for name in synth.LAYERS:
        parts = [next(data for path, data in o.items() if path.startswith(f"truth/{name}/")) for o in outputs]
        read = [rasterio.open(io.BytesIO(data)).read(1) for data in parts]
        assert np.array_equal(np.concatenate(read, axis=1), whole[name], equal_nan=True), name


def test_a_picture_its_raw_frame_and_calibration_frames(tmp_path: Path) -> None:
    p = small(raw={"calibration_frames": 2})
    picture = tasks(p, "picture")[0]
    found = run(tmp_path / "a", picture)
    assert found == run(tmp_path / "b", picture)
    raw = rasterio.open(io.BytesIO(found[f"raw/{picture.unit}.tif"]))
    assert (raw.height, raw.width, raw.count, raw.dtypes[0]) == (64, 96, 1, "uint16")
    assert 80 < raw.read(1).mean() < 4095
    frames = run(tmp_path / "a", tasks(p, "calibration")[0])
    dark, flat = (
        rasterio.open(io.BytesIO(frames[f"raw/calibration/nadir_{k}_00.tif"])).read(1) for k in ("dark", "flat")
    )
    assert dark.mean() < 0.1 * flat.mean()
    assert len(tasks(p, "calibration")) == 2


def test_twelve_bits_and_near_infrared_come_as_tiff(tmp_path: Path) -> None:
    p = small(render={"near_infrared": True, "sensor": {"bits": 12}})
    found = run(tmp_path, tasks(p, "picture")[0])
    (path,) = found
    image = rasterio.open(io.BytesIO(found[path]))
    assert path.endswith(".tif")
    assert image.dtypes == ("uint16",) * 4
    assert "alpha" not in [c.name for c in image.colorinterp]
    assert 255 < image.read().max() <= 4095


def test_the_scan_lies_in_the_area_and_its_truth_beside_it(tmp_path: Path) -> None:
    p = small(flight=None, lidar={"density_m2": 2.0})
    found = run(tmp_path, tasks(p, "scan")[0])
    given, truth = (laspy.read(io.BytesIO(data)) for _, data in sorted(found.items()))
    x_min, _, x_max, _ = p.area
    assert 1.5 * 1600 < len(given.x) == len(truth.x)
    assert (given.x >= x_min - 0.01).all()
    assert (given.x <= x_max + 0.01).all()
    assert not np.any(given.classification)
    assert {2, 6} <= set(np.unique(truth.classification))


def test_a_wide_town_is_cut_for_each_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(synth, "WHOLE_TOWN_M", 100.0)
    p = SynthParameters(size=(40.0, 40.0), surroundings_m=200.0, flight=preset("nadir", **SMALL))
    town = town_of(p.seed, p.whole_town)
    image = p.images[0]
    x_0, y_0, x_1, y_1 = scene_bounds(town, image)
    assert x_1 - x_0 < 400
    quad = ground_quad(image, 20.0)
    assert (quad.min(axis=0) - [x_0, y_0] > 50).all()
    assert ([x_1, y_1] - quad.max(axis=0) > 50).all()


def test_files_of_pictures_keep_their_pixels() -> None:
    rng = np.random.default_rng(1)
    pixels = rng.integers(0, 4096, (70, 90, 4)).astype(np.uint16)
    assert np.array_equal(np.moveaxis(rasterio.open(io.BytesIO(tiff_bytes(pixels))).read(), 0, 2), pixels)
    red = np.zeros((16, 16, 3), np.uint8)
    red[..., 0] = 200
    assert rasterio.open(io.BytesIO(jpeg_bytes(red, 95))).read().mean(axis=(1, 2)) == pytest.approx([200, 0, 0], abs=4)
    with pytest.raises(ValueError, match="no JPEG"):
        jpeg_bytes(pixels, 95)


def test_a_video_has_its_truth_beside_it(tmp_path: Path) -> None:
    """Hovering and repeated frames show what the truth says; the same seed gives the same bytes."""
    film = {
        "width_px": 96, "height_px": 64, "seconds": 1.2, "frames_a_second": 10.0, "hover_s": 0.2, "repeated_s": 0.2, "blurred_share": 0.3,
    }  # fmt: skip
    p = small(video=film)
    (task,) = tasks(p, "video")
    outputs = run(tmp_path / "one", task)
    assert outputs == run(tmp_path / "two", task)
    assert p.video is not None
    truth = read_truth(outputs[TRUTH_PATH].decode(), p.video)
    assert [f.kind for f in truth].count("hovering") == [f.kind for f in truth].count("repeated") == 2
    assert [f.image.name for f in truth] == [f.image.name for f in p.video_frames]
    assert all(
        np.allclose(a.image.rotation, b.image.rotation, atol=1e-8) for a, b in zip(truth, p.video_frames, strict=True)
    )
    pictures = [f.pixels.astype(float) for f in video_frames(tmp_path / "one" / VIDEO_PATH)]
    assert len(pictures) == 12
    again = next(k for k, f in enumerate(truth) if f.shows != k)
    same, other = (np.abs(pictures[again] - pictures[k]).mean() for k in (truth[again].shows, 0))
    assert same < 0.5 * other
    places = read_subtitles(tmp_path / "one" / SUBTITLES_PATH)
    assert len(places) > 6
    assert 51.9 < places[0].position.latitude < 52.1


def test_videos_that_cannot_be_are_refused() -> None:
    for wrong, said in (
        ({"tilt_deg": 70.0}, "shows the horizon"),
        ({"seconds": 1.0, "hover_s": 1.0}, "nothing is flown"),
    ):
        with pytest.raises(ValidationError, match=said):
            small(video=wrong)
    with pytest.raises(ValidationError, match="no latitudes for subtitles"):
        small(video={}, crs="local")
