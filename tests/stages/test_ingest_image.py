"""Raw frames of made sensors go through `ingest` and come out as the scene; what does not fit together is named."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio

from cityflow.core.building import Status
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.imagery.raw_frames import developed
from cityflow.imagery.resampling import pinhole_within
from cityflow.io.catalog.stac import Catalog
from cityflow.io.catalog.stac_assets import ImageAsset
from cityflow.io.images.tiled_images import open_image
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.stages.ingest import camera_corrections as calibration
from cityflow.stages.ingest import images as ingest_image
from cityflow.stages.ingest.develop import Corrections
from cityflow.survey.raw_parameters import InfraredFrames, RawInput
from cityflow.survey.survey import Survey
from cityflow.synthetic.sensor import SensorParameters
from cityflow.synthetic.sensor_readout import RawParameters, dark_frame, flat_frame, raw_frame

pytestmark = pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")

ROWS, COLS = 1100, 260
CAMERA = Camera(COLS, ROWS, 900.0, 900.0, COLS / 2, ROWS / 2)
SENSOR = SensorParameters(bits=16, exposure=1.0, exposure_sigma=0.0, vignetting=0.0)
READ_OUT = RawParameters(pattern="GRBG", bits=12, response_sigma=0.03, hot_share=3e-4)
CALIBRATED = {"pattern": "GRBG", "bits": 12, "calibration": {"folder": "frames"}}


def scene(bands: int = 3) -> np.ndarray:
    """(rows, cols, bands) smooth light between 0.1 and 0.7 of saturation."""
    v, u = np.mgrid[:ROWS, :COLS] + 0.5
    waves = [0.4 + 0.3 * np.sin(u / (23 + 4 * b)) * np.cos(v / (31 - 3 * b)) for b in range(bands)]
    return np.stack(waves, axis=-1).astype(np.float32)


def oriented(name: str, camera: Camera = CAMERA) -> OrientedImage:
    return OrientedImage(name, camera, np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 500.0]))


def write(path: Path, array: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    rows, cols, bands = array.shape
    with rasterio.open(path, "w", driver="GTiff", height=rows, width=cols, count=bands, dtype=array.dtype) as out:
        out.write(np.moveaxis(array, -1, 0))
    return path


class Flight:
    """A folder with one image `flight_nadir` and whatever else is put there, and a RUN beside it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.store = Store.open(folder / "run")
        self.records: list[Record] = []

    def frames(self, seed: int = 5, change: Callable[[np.ndarray], np.ndarray] = lambda f: f, count: int = 6) -> None:
        for kind, make in (("dark", dark_frame), ("flat", flat_frame)):
            for i in range(count):
                frame = make((ROWS, COLS), "nadir", i, SENSOR, READ_OUT, seed)
                write(self.folder / f"frames/nadir_{kind}_{i:02d}.tif", change(frame) if kind == "flat" else frame)

    def survey(self, pixels: np.ndarray, raw: Mapping[str, Any], camera: Camera = CAMERA) -> Survey:
        survey = Survey(self.catalog(pixels, camera), CityParameters.model_validate({"raw": raw}), {})
        for record in self.records:
            survey.learn(record)
        return survey

    def catalog(self, pixels: np.ndarray, camera: Camera = CAMERA) -> Catalog:
        path = write(self.folder / "flight_nadir.tif", pixels)
        asset = ImageAsset(
            "flight_nadir", str(path), hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_size,
            (-90.0, -90.0, 90.0, 90.0), oriented("flight_nadir", camera), (0.0, 10.0), pixels.shape[2], str(pixels.dtype),
        )  # fmt: skip
        return Catalog(str(self.folder), "t", Reference("EPSG:28992", 28992, None, ""), "", "", (), images=(asset,))

    def calibrate(self, survey: Survey) -> Outcome:
        task = calibration.task(survey, "calibration.nadir")
        outcome = calibration.run(Workspace(self.store, task), task)
        self.records.append(recorded(task, outcome))
        return outcome

    def ingest(self, survey: Survey) -> tuple[np.ndarray, Outcome]:
        task = ingest_image.image_task(survey, "flight_nadir")
        outcome = ingest_image.run(Workspace(self.store, task), task)
        image = open_image(self.store.url(next(iter(outcome.outputs))))
        return image.window((0, image.height), (0, image.width)), outcome


def recorded(task: Task, outcome: Outcome) -> Record:
    return Record(
        task.stage, task.unit, 1, task.digest, task.version, outcome.status, outcome.reason, outcome.outputs, outcome.result,
        task.parameters, task.inputs,
    )  # fmt: skip


@pytest.fixture
def flight(tmp_path: Path) -> Flight:
    return Flight(tmp_path)


def raw_of(seed: int = 5) -> np.ndarray:
    return raw_frame(scene(), oriented("flight_nadir"), SENSOR, READ_OUT, seed)


def deviation(made: np.ndarray) -> float:
    """Robust, from the light of the scene, as share of saturation, without the rim."""
    off = (made / 65535.0 - scene())[8:-8, 8:-8]
    return float(1.4826 * np.median(np.abs(off - np.median(off))))


@pytest.mark.parametrize("seed", [5, 6])
def test_a_calibrated_frame_shows_the_scene(flight: Flight, seed: int) -> None:
    flight.frames(seed)
    raw = raw_of(seed)
    found = flight.calibrate(flight.survey(raw, CALIBRATED))
    calm, outcome = flight.ingest(flight.survey(raw, CALIBRATED))
    rough, _ = flight.ingest(flight.survey(raw, {"pattern": "GRBG", "bits": 12}))
    assert found.result["shape"] == [ROWS, COLS]
    assert 0.5 < found.result["bad"] / (3e-4 * ROWS * COLS) < 1.5
    assert calm.dtype == np.uint16
    assert outcome.result["bands"] == 3
    assert abs(np.median(calm / 65535.0 - scene())) < 0.001
    assert np.median(rough / 65535.0 - scene()) > 0.015  # the dark signal is 0.02 of saturation
    assert deviation(calm) < 0.75 * deviation(rough)
    hot = np.abs(calm / 65535.0 - scene())[8:-8, 8:-8].max()
    assert hot < 0.5 * np.abs(rough / 65535.0 - scene())[8:-8, 8:-8].max()


def test_strips_leave_no_trace(flight: Flight) -> None:
    flight.frames()
    raw = raw_of()
    flight.calibrate(flight.survey(raw, CALIBRATED))
    survey = flight.survey(raw, CALIBRATED)
    made, _ = flight.ingest(survey)
    paths = list(flight.records[0].outputs)
    assert len(paths) == 3
    whole = Corrections.of(flight.store, paths).rows(0, ROWS)
    np.testing.assert_array_equal(made, developed(raw[..., 0], "GRBG", 12, whole))


def test_bits_of_pictures_fill_the_range(flight: Flight) -> None:
    twelve = np.rint(scene() * 4095).astype(np.uint16)
    made, _ = flight.ingest(flight.survey(twelve, {"bits": 12}))
    left, _ = flight.ingest(
        flight.survey(np.left_shift(twelve, 4).astype(np.uint16), {"bits": 12, "left_aligned": True})
    )
    assert np.abs(made / 65535.0 - scene()).max() < 1 / 4095
    np.testing.assert_array_equal(made, left)


def test_nothing_asked_is_nothing_done(flight: Flight) -> None:
    picture = np.rint(scene() * 255).astype(np.uint8)
    survey = flight.survey(picture, {})
    made, _ = flight.ingest(survey)
    np.testing.assert_array_equal(made, picture)
    assert ingest_image.image_task(survey, "flight_nadir").parameters == {}
    assert (survey.images.bands, survey.images.dtype) == (3, "uint8")


def test_a_pinhole_image_is_what_its_camera_saw(flight: Flight) -> None:
    """Light painted on rays: every pixel of the new camera shows the light of its own ray, none is empty."""
    camera = replace(CAMERA, distortion=(-0.12, 0.03, 0.0004, -0.0003))

    def painted(kind: Camera) -> np.ndarray:
        v, u = np.mgrid[: kind.height, : kind.width] + 0.5
        n = kind.undistort(np.column_stack([u.ravel(), v.ravel()])).reshape(*u.shape, 2)
        light = 0.4 + 0.3 * np.sin(30 * n[..., 0]) * np.cos(25 * n[..., 1])
        return np.rint(np.stack([light, 0.5 * light, 1 - light], axis=-1) * 65535).astype(np.uint16)

    survey = flight.survey(painted(camera), {"undistort": True}, camera)
    made, outcome = flight.ingest(survey)
    seen = survey.images.views["flight_nadir"].image.camera
    assert seen.is_pinhole
    assert (outcome.result["height"], outcome.result["width"]) == (seen.height, seen.width) == made.shape[:2]
    assert np.abs(made.astype(int) - painted(seen)).max() < 0.004 * 65535
    assert 0.85 * ROWS * COLS < made.shape[0] * made.shape[1] <= ROWS * COLS


@pytest.mark.parametrize("k1", [-0.2, 0.2])
def test_a_pinhole_camera_sees_nothing_that_the_lens_did_not(k1: float) -> None:
    camera = Camera(400, 300, 380.0, 384.0, 190.0, 160.0, (k1, 0.03, 0.001, -0.002))
    pinhole = pinhole_within(camera)
    v, u = np.mgrid[: pinhole.height, : pinhole.width] + 0.5
    at = camera.distort(pinhole.undistort(np.column_stack([u.ravel(), v.ravel()])))
    assert oriented("a", camera).holds(at).all()
    assert pinhole.width <= 400
    assert pinhole.height <= 300


def test_infrared_becomes_the_fourth_band(flight: Flight) -> None:
    light = scene(4)
    shifted = np.zeros((ROWS, COLS, 1), np.uint16)
    shifted[:-5, :-3, 0] = np.rint(light[5:, 3:, 3] * 4095)
    write(flight.folder / "nir/flight_nadir_nir.tif", shifted)
    raw = {"bits": 12, "near_infrared": {"folder": "nir", "infrared_from_colour": [1, 0, -3, 0, 1, -5, 0, 0, 1]}}
    survey = flight.survey(np.rint(light[..., :3] * 4095).astype(np.uint16), raw)
    made, outcome = flight.ingest(survey)
    assert outcome.result["bands"] == survey.images.bands == 4
    assert np.abs(made[6:, 4:] / 65535.0 - light[6:, 4:]).max() < 0.001


def test_images_wait_for_their_camera(flight: Flight) -> None:
    flight.frames(count=2)
    source = CitySource(flight.catalog(raw_of()), CityParameters.model_validate({"raw": CALIBRATED}))
    (first,) = source.walk.want([("ingest", "flight_nadir")])
    assert (first.stage, first.unit) == ("ingest", "calibration.nadir")
    outcome = calibration.run(Workspace(flight.store, first), first)
    (then,) = source.after(first, recorded(first, outcome))
    assert then.unit == "flight_nadir"
    assert then.inputs["calibration"] == outcome.result["digest"]


def test_other_frames_are_another_task(flight: Flight) -> None:
    flight.frames(count=2)
    survey = flight.survey(raw_of(), CALIBRATED)
    before = calibration.task(survey, "calibration.nadir")
    assert calibration.task(survey, "calibration.nadir").digest == before.digest
    write(flight.folder / "frames/nadir_dark_01.tif", np.full((ROWS, COLS, 1), 90, np.uint16))
    assert calibration.task(survey, "calibration.nadir").digest != before.digest


def test_an_unreadable_frame_is_left_to_its_task(flight: Flight) -> None:
    flight.frames(count=2)
    broken = flight.folder / "frames/nadir_flat_01.tif"
    broken.write_bytes(broken.read_bytes()[:4000])
    with pytest.raises(CatalogError) as caught:
        flight.calibrate(flight.survey(raw_of(), CALIBRATED))
    assert caught.value.remedy
    assert calibration.matching(str(flight.folder / "nowhere"), "a*.tif") == []


SPOILT: dict[str, tuple[Callable[[Flight], None], str]] = {
    "none": (lambda f: f.frames(count=0), "no dark frame of the camera nadir"),
    "saturated": (lambda f: f.frames(count=2, change=lambda x: np.maximum(x, 4095)), "saturated"),
    "small": (lambda f: f.frames(count=2, change=lambda x: x[:900]), "260 x 1100 pixels, flat frames of 260 x 900"),
    "bits": (lambda f: f.frames(count=2, change=lambda x: x * 16), "numbers of 12 bits end at 4095"),
    "dim": (lambda f: f.frames(count=2, change=lambda x: x // 20), "brighter than dark"),
    "colour": (lambda f: f.frames(count=2, change=lambda x: np.repeat(x, 3, axis=2)), "a mosaic of one"),
}


@pytest.mark.parametrize("how", SPOILT)
def test_spoilt_calibration_frames_are_named(flight: Flight, how: str) -> None:
    spoil, words = SPOILT[how]
    spoil(flight)
    survey = flight.survey(raw_of(), CALIBRATED)
    with pytest.raises(CatalogError, match=words) as caught:
        flight.calibrate(survey)
    assert caught.value.where.startswith(str(flight.folder / "frames"))
    assert caught.value.remedy


WRONG: dict[str, tuple[Callable[[], np.ndarray], Mapping[str, Any], str]] = {
    "bits": (lambda: raw_of() * 8, {"pattern": "GRBG", "bits": 12}, "numbers of 12 bits end at 4095"),
    "pattern": (lambda: np.repeat(raw_of(), 3, axis=2), {"pattern": "GRBG"}, "a picture already"),
    "container": (lambda: (raw_of() >> 4).astype(np.uint8), {"pattern": "GRBG", "bits": 12}, "holds uint8"),
    "uncalibrated": (raw_of, CALIBRATED, "cannot be calibrated"),
    "infrared": (lambda: np.repeat(raw_of(), 3, axis=2), {"near_infrared": {"folder": "nir"}}, "no such file"),
}


@pytest.mark.parametrize("how", WRONG)
def test_frames_that_are_not_what_the_workflow_says(flight: Flight, how: str) -> None:
    pixels, raw, words = WRONG[how]
    if how == "uncalibrated":
        task = calibration.task(flight.survey(pixels(), raw), "calibration.nadir")
        flight.records.append(replace(recorded(task, Outcome(Status.FAILED, "no dark frame"))))
    with pytest.raises(CatalogError, match=words) as caught:
        flight.ingest(flight.survey(pixels(), raw))
    assert "flight_nadir" in caught.value.where
    assert caught.value.remedy


def test_calibration_of_another_size_is_refused(flight: Flight) -> None:
    flight.frames(count=2)
    flight.calibrate(flight.survey(raw_of(), CALIBRATED))
    survey = flight.survey(raw_of()[:1000], CALIBRATED, replace(CAMERA, height=1000))
    with pytest.raises(CatalogError, match="260 x 1000 pixels, the calibration frames of its camera 260 x 1100"):
        flight.ingest(survey)


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        ({"calibration": {"folder": "f", "camera": "nadir"}}, "no group"),
        ({"calibration": {"folder": "f", "camera": "("}}, "no regular expression"),
        ({"calibration": {"folder": "f", "dark": "dark*.tif"}}, "share their frames"),
        ({"near_infrared": {"folder": "f", "file": "nir.tif"}}, "share one"),
        ({"left_aligned": True}, "without bits"),
    ],
)
def test_names_that_cannot_work_are_refused(raw: Mapping[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        CityParameters.model_validate({"raw": raw})


def test_gains_of_the_catalog_hold_for_developed_images(flight: Flight) -> None:
    """A picture of 12 bits, balanced before or after it fills the range, is the same; the infrared head is left alone."""
    (asset,) = flight.catalog(raw_of()).images
    asset = replace(asset, gain=(1.2,), gamma=(0.9,), shoulder=0.8)
    value, top, wider = 700.0, 65535.0, 16.0
    made = RawInput(bits=12).balance_of(asset)
    before = 1.2 * top * (value / top) ** 0.9
    assert made.gain[0] * top * (wider * value / top) ** made.gamma[0] == pytest.approx(wider * before)
    assert made.shoulder * (wider * before) ** 2 == pytest.approx(wider * 0.8 * before**2)
    with_head = RawInput(pattern="RGGB", near_infrared=InfraredFrames()).balance_of(asset)
    assert (with_head.gain, with_head.gamma) == ((1.2, 1.2, 1.2, 1.0), (0.9, 0.9, 0.9, 1.0))
    assert RawInput().balance_of(asset) == asset
