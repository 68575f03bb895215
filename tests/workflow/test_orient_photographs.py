"""``cityflow orient PHOTOS``: photographs without poses become a catalog; what cannot be used is left out by name."""

from __future__ import annotations

import io
import json
import shutil
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from pyproj import CRS as CrsOfFile
from pyproj import Transformer
from rich.console import Console

from adjustment.scenes import rendered_height, rendered_hills
from cityflow.adjustment.block import rotation_of, vector_of
from cityflow.adjustment.mapping import DATABASE, MappingDiedError, MappingInput, map_database, mapped
from cityflow.adjustment.pair_geometry import pair_geometry, pycolmap_camera
from cityflow.adjustment.placing import placed
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.control_points import ControlPoint, ControlPoints, Mark, Role
from cityflow.core.photo_metadata import GnssPosition, PhotoMetadata
from cityflow.core.points import PointCloud
from cityflow.errors import CatalogError, RunError
from cityflow.evaluation.poses import pose_figures
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.geometry.similarity import Similarity
from cityflow.handover.mapped_models import decode_models, encode_models
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.control_points.point_table_write import point_table_text
from cityflow.io.images.exif_write import with_exif
from cityflow.io.points.las_write import write_points
from cityflow.orientation.photo_doubts import usable_positions
from cityflow.reporting.orientation_report import FIGURES, PAGE
from cityflow.runs.first_look import look_at_run
from cityflow.runs.orientation_asked import OrientationAsked
from cityflow.stages.orient import BLOCK
from cityflow.stages.orient.photographs import MAP
from cityflow.workflow.orient_photographs import orient_photographs, photo_parameters
from cityflow.workflow.orientation_run import run_orientation
from cityflow.workflow.orientation_standing import explain_image, print_orientation
from cityflow.workflow.photo_placing import Placed, Placing, known_control, known_positions, place

CAMERA = Camera(480, 360, 520.0, 520.0, 240.0, 180.0, (-0.03, 0.0, 0.0, 0.0))
ORIGIN = np.array([458000.0, 5428000.0, 100.0])
CRS = "EPSG:25832"
PIXEL_M = 50.0 / 520.0
STATED_FOCAL = 1.04
"""Of the true one: what the EXIF blocks say."""
PLACE_SIGMA_M = 0.3


@dataclass(frozen=True)
class Flight:
    """Images by file name in a frame about the origin, and their pictures as JPEG."""

    images: tuple[OrientedImage, ...]
    pictures: dict[str, bytes]


@lru_cache(maxsize=1)
def _flight() -> Flight:
    """Twelve images 50 m over hills of 4 m, some tilted, in three strips."""
    rng = np.random.default_rng(11)
    images = []
    for k in range(12):
        strip, along = divmod(k, 4)
        rotation = from_omega_phi_kappa(
            *(np.radians([(-12, 0, 12)[strip], 0, (0, 180, 0)[strip]]) + rng.normal(0, 0.03, 3))
        )
        centre = np.array([9.0 * along - 13.5, 10.0 * strip - 10.0, 50.0]) + rng.normal(0, 0.8, 3)
        images.append(OrientedImage(f"i{k:02d}.jpg", CAMERA, rotation, centre))
    pictures = {}
    for image in images:
        pixels = np.repeat(rendered_hills(image), 3, axis=2)
        pictures[image.name] = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes()
    return Flight(tuple(images), pictures)


def _tagged(flight: Flight, seed: int = 5) -> dict[str, bytes]:
    """The pictures with EXIF: places that are off by `PLACE_SIGMA_M`, and a focal length that is off by four percent."""
    rng = np.random.default_rng(seed)
    to_degrees = Transformer.from_crs(CRS, "EPSG:4326", always_xy=True)
    pictures = {}
    for k, image in enumerate(flight.images):
        x, y, z = image.centre + ORIGIN + rng.normal(0, PLACE_SIGMA_M, 3)
        longitude, latitude = to_degrees.transform(x, y)
        tags = PhotoMetadata(
            image.name, CAMERA.width, CAMERA.height, "maker", "model", taken=f"2026:06:21 10:00:{k:02d}",
            focal_mm=CAMERA.fx * STATED_FOCAL * 0.005, sensor_width_mm=CAMERA.width * 0.005, position=GnssPosition(latitude, longitude, z),
        )  # fmt: skip
        pictures[image.name] = with_exif(flight.pictures[image.name], tags)
    return pictures


def _written(folder: Path, pictures: dict[str, bytes]) -> Path:
    folder.mkdir(parents=True)
    for name, data in pictures.items():
        (folder / name).write_bytes(data)
    return folder


def _points(flight: Flight) -> ControlPoints:
    """Seven control and four check points on the hills, marked to a tenth of a pixel."""
    rng = np.random.default_rng(7)
    points = []
    places = [(-14, -11), (14, -11), (14, 11), (-14, 11), (0, 0), (-5, 9), (6, -8), (-8, -3), (8, 4), (2, 9), (-3, -8)]
    for k, (x, y) in enumerate(places):
        xyz = np.array([x, y, float(rendered_height(np.array([x]), np.array([y]))[0])])
        marks = []
        for image in flight.images:
            uv, depth = image.project(xyz[None])
            if image.holds(uv, 8.0)[0] and depth[0] > 0:
                marks.append(Mark(image.name, *(uv[0] + rng.normal(0, 0.1, 2)).tolist()))
        role = Role.CONTROL if k < 7 else Role.CHECK
        points.append(ControlPoint(f"{'C' if k < 7 else 'K'}{k}", xyz + ORIGIN, (0.01,) * 3, role, tuple(marks)))
    return ControlPoints(tuple(points))


@dataclass(frozen=True)
class Oriented:
    """A finished orientation: its catalog's images by name, report, what was printed, and its work folder."""

    found: dict[str, OrientedImage]
    report: dict[str, Any]
    told: str
    work: Path
    page: str
    covariances: tuple[tuple[float, ...], ...]

    @property
    def model(self) -> tuple[list[OrientedImage], np.ndarray]:
        """Images and tie points as mapped, before they are placed."""
        with Ledger.open(Store.open(str(self.work))) as ledger:
            record = ledger.latest(MAP, BLOCK)
        assert record is not None
        model = decode_models((self.work / next(iter(record.outputs))).read_bytes())[0]
        names = record.result["photographs"]
        return [replace(i, name=names[k]) for i, k in zip(model.images, model.numbers, strict=True)], model.xyz


@pytest.fixture(scope="module")
def oriented(scheduler: str, tmp_path_factory: pytest.TempPathFactory) -> Oriented:
    """The flight with EXIF, a file that is there twice, and a black frame."""
    folder = tmp_path_factory.mktemp("flight")
    pictures = _tagged(_flight())
    pictures["i00b.jpg"] = pictures["i00.jpg"]
    pictures["black.jpg"] = cv2.imencode(".jpg", np.zeros((CAMERA.height, CAMERA.width, 3), np.uint8))[1].tobytes()
    out, work, told = folder / "out", folder / "work", folder / "told.txt"
    with told.open("w") as file:
        photos = _written(folder / "photos", pictures)
        asked = OrientationAsked(str(photos), str(out), True, crs=CRS, title="Flight", attribution="Somebody, CC BY")
        run_orientation(asked, work, scheduler, 0, Console(file=file, width=200))
    made = read_catalog(str(out))
    assert (made.title, made.attribution) == ("Flight", "Somebody, CC BY")
    assets = made.images
    images = {Path(a.name).stem: a.oriented for a in assets}
    covariances = tuple(a.pose_covariance for a in assets)
    report, page = json.loads((out / FIGURES).read_text()), (out / PAGE).read_text()
    return Oriented(images, report, told.read_text(), work, page, covariances)


def _errors(found: dict[str, OrientedImage], flight: Flight) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) centres less true ones, metres; (N,) angles between rotations, degrees."""
    truth = {Path(i.name).stem: i for i in flight.images}
    away = np.array([i.centre - truth[n].centre - ORIGIN for n, i in found.items()])
    turns = [np.trace(i.rotation @ truth[n].rotation.T) for n, i in found.items()]
    return away, np.degrees(np.arccos(np.clip((np.array(turns) - 1) / 2, -1, 1)))


@pytest.mark.cluster
def test_photographs_with_gnss_and_bad_frames(oriented: Oriented) -> None:
    assert sorted(oriented.found) == sorted(Path(i.name).stem for i in _flight().images)
    away, turns = _errors(oriented.found, _flight())
    # twelve positions of 0.3 m hold the whole to about 0.1 m
    assert np.sqrt(np.mean(away**2)) < 0.25
    assert turns.max() < 0.8
    focal = next(iter(oriented.found.values())).camera.fx
    assert abs(focal / CAMERA.fx - 1) < 0.01
    assert "which the pictures contradict" in oriented.told
    assert oriented.report["reprojection_px"] < 0.6
    adjusted = oriented.report["summary"]
    assert adjusted["taken"]
    assert adjusted["positions"] == 12
    assert adjusted["position_sigma_m"] == pytest.approx(PLACE_SIGMA_M, rel=0.5)
    assert set(oriented.report["images"]) == set(oriented.found)
    assert "Adjusted with 12 GNSS positions" in oriented.told
    assert [len(c) for c in oriented.covariances] == [21] * 12
    assert oriented.report["left_out"]["i00b.jpg"] == "the same file as i00.jpg"
    assert "blurred, dark" in oriented.report["left_out"]["black"]
    assert oriented.report["weak"] == []
    assert "12 of 14 images have a pose" in oriented.page
    assert f"{oriented.report['tie_points']:,} tie points" in oriented.page
    assert oriented.page.count("<circle") == 12
    assert all(name in oriented.page for name in ("i00b.jpg", "black"))


@pytest.mark.cluster
def test_its_work_folder_says_how_it_stands_and_what_is_known_of_an_image(oriented: Oriented) -> None:
    work, told = str(oriented.work), io.StringIO()
    console = Console(file=told, width=200)
    print_orientation(work, console)
    assert "12 of 14 images have a pose" in told.getvalue()
    rows = {line.split()[0]: line.split()[1:3] for line in told.getvalue().splitlines() if len(line.split()) > 8}
    assert rows["features"] == ["13", "13"]
    assert rows["map"] == ["1", "1"]
    assert "orientation.html" in told.getvalue()
    for image, known in (
        ("i00b", ("Left out: the same file as i00.jpg",)),
        ("black", ("Left out: 0 points found: blurred, dark", "0 points found")),
        ("i05", ("It has a pose", "points found", "matches agree with", "How it was made:", "features, version")),
    ):
        told.truncate(0)
        explain_image(work, image, console)
        assert all(text in told.getvalue() for text in known)
    with pytest.raises(RunError, match="no unit has 'i77'"):
        explain_image(work, "i77", console)
    with pytest.raises(RunError, match="work folder of an orientation"):
        look_at_run(work)


@pytest.mark.cluster
def test_photographs_are_registered_to_a_scan_of_the_hills(scheduler: str, oriented: Oriented, tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    xy = rng.uniform(-35, 35, (20_000, 2))
    xyz = np.column_stack([xy, rendered_height(xy[:, 0], xy[:, 1])]) + rng.normal(0, 0.02, (20_000, 3)) + ORIGIN
    scan, out, work = tmp_path / "hills.laz", tmp_path / "out", tmp_path / "work"
    scan.write_bytes(write_points(PointCloud.of(xyz), crs=CrsOfFile.from_user_input(CRS)))
    shutil.copytree(oriented.work, work)
    # the hills repeat themselves after forty metres
    settings = ("registration.shift_m=15",)
    asked = OrientationAsked(str(work.parent / "photos"), str(out), True, settings, onto=(str(scan),))
    shutil.copytree(oriented.work.parent / "photos", work.parent / "photos")
    with (tmp_path / "told.txt").open("w") as file:
        run_orientation(asked, work, scheduler, 0, Console(file=file, width=300))
    catalog = read_catalog(str(out))
    assert [a.name for a in catalog.lidar] == ["hills"]
    away, turns = _errors({Path(a.name).stem: a.oriented for a in catalog.images}, _flight())
    assert np.sqrt(np.mean(away**2)) < 0.1
    assert turns.max() < 0.15
    assert json.loads((out / FIGURES).read_text())["placing"]["registration"]["agreement"] > 0.9
    assert "Registered: moved by" in (out / PAGE).read_text()
    text = (tmp_path / "told.txt").read_text()
    assert "Registered: moved by" in text
    assert "lidar_photos_city.yaml" in text


@pytest.mark.cluster
def test_control_points_place_the_model_and_exchanged_ones_are_named(oriented: Oriented, tmp_path: Path) -> None:
    flight, points = _flight(), _points(_flight())
    images, xyz = oriented.model
    stems = {i.name: Path(i.name).stem for i in flight.images}
    table = tmp_path / "control.csv"

    def put(given: ControlPoints) -> Placed:
        table.write_text(point_table_text(given, CRS))
        known = known_control(Placing(control=table))
        assert known is not None
        marked = tuple(
            replace(p, marks=tuple(replace(m, image=stems[m.image]) for m in p.marks)) for p in known[0].points
        )
        return place(images, xyz, None, Placing(control=table), (replace(known[0], points=marked), known[1]))

    held = put(points)
    away, turns = _errors({i.name: i for i in held.images}, flight)
    assert held.crs == CRS
    assert np.sqrt(np.mean(away**2)) < 1.5 * PIXEL_M
    assert turns.max() < 0.15
    x, y, z = held.figures["check_rms_m"]
    assert np.hypot(x, y) < PIXEL_M
    assert z < 1.5 * PIXEL_M
    by_name = {p.name: p for p in points.points}
    other = {"C1": "C5", "C5": "C1"}
    swapped = tuple(replace(p, xyz=by_name[other.get(p.name, p.name)].xyz) for p in points.points)
    found = put(replace(points, points=swapped))
    assert found.figures["exchanged"] == ["C1", "C5"]
    assert any("C1 and C5 are exchanged" in line for line in found.lines)
    assert np.sqrt(np.mean(_errors({i.name: i for i in found.images}, flight)[0] ** 2)) < 1.5 * PIXEL_M
    wrong = tuple(replace(p, xyz=p.xyz + np.array([0.0, 3.0, 0.0])) if p.name == "C2" else p for p in points.points)
    found = put(replace(points, points=wrong))
    assert found.figures["contradicting"] == ["C2"]
    assert found.figures["exchanged"] == []


@pytest.mark.cluster
def test_a_frame_of_stated_or_unknown_scale(oriented: Oriented) -> None:
    images, xyz = oriented.model
    found = place(images, xyz, None, Placing(scale_m=50.0), None)
    truth = {Path(i.name).stem: i for i in _flight().images}
    ours, theirs = (np.array([of[i.name].centre for i in images]) for of in ({i.name: i for i in found.images}, truth))
    lengths = [np.linalg.norm(each[:, None] - each[None], axis=2).sum() for each in (ours, theirs)]
    # heights count from the valleys
    assert abs(lengths[0] / lengths[1] - 1) < 0.1
    assert found.crs == "local"
    assert abs(np.median(ours[:, 2]) - 50.0) < 1e-6
    tilt = [np.degrees(np.arccos(-i.axis[2])) - np.degrees(np.arccos(-truth[i.name].axis[2])) for i in found.images]
    # hills of 4 m within 40 m are level to a few degrees
    assert np.abs(tilt).max() < 4.0


def test_without_place_and_scale_nothing_is_computed(tmp_path: Path) -> None:
    photos = _written(
        tmp_path / "photos", {"a.jpg": _flight().pictures["i00.jpg"], "b.jpg": _flight().pictures["i01.jpg"]}
    )
    with pytest.raises(CatalogError, match="place and scale are unknown") as refused:
        orient_photographs(
            photos, tmp_path / "out", tmp_path / "work", Placing(), photo_parameters([]), "", 1, Console(quiet=True)
        )
    assert "--local" in refused.value.remedy
    assert not (tmp_path / "work").exists()


def test_positions_that_cannot_be_true_place_nothing() -> None:
    photos = [PhotoMetadata(f"{k}", taken=f"{k}", position=GnssPosition(49.0 + 1e-4 * k, 9.0, 100.0)) for k in range(8)]
    zero = replace(photos[1], position=GnssPosition(0.0, 0.0, 0.0))
    turned = replace(photos[2], position=GnssPosition(9.0, 49.0, 100.0))
    assert usable_positions([photos[0], zero, turned, *photos[3:]]) == {"0", "3", "4", "5", "6", "7"}
    stuck = [replace(p, position=photos[0].position) for p in photos]
    assert usable_positions(stuck) == frozenset()


def test_two_flights_are_two_models() -> None:
    """Tie points of two parts that have nothing in common are mapped apart, and the larger part comes first."""
    flight = _flight()
    rng = np.random.default_rng(3)
    xy = rng.uniform(-25, 25, (900, 2))
    xyz = np.column_stack([xy, rendered_height(xy[:, 0], xy[:, 1])])
    points, shown = [], []
    for image in flight.images:
        uv, depth = image.project(xyz)
        kept = np.flatnonzero(image.holds(uv) & (depth > 0))
        points.append(uv[kept] + rng.normal(0, 0.3, (len(kept), 2)))
        shown.append({int(p): k for k, p in enumerate(kept)})
    camera = (replace(CAMERA, distortion=()), True)
    known = pycolmap_camera(*camera)
    pairs = {}
    for one in range(12):
        for other in range(one + 1, 12):
            if (one < 8) == (other < 8):
                both = sorted(set(shown[one]) & set(shown[other]))
                matches = np.array([(shown[one][p], shown[other][p]) for p in both])
                found = pair_geometry((known, known), (points[one], points[other]), matches)
                if found is not None:
                    pairs[one, other] = found
    result = mapped(MappingInput([camera], [0] * 12, points, pairs), "radial")
    assert [sorted(m.numbers) for m in result.models] == [list(range(8)), list(range(8, 12))]
    again = mapped(MappingInput([camera], [0] * 12, points, pairs), "radial")
    assert encode_models(again.models) == encode_models(result.models)


def test_level_ground_seen_straight_down_has_the_focal_length_that_files_state() -> None:
    """Twelve parallel images of a plane fit any focal length: it is held, though it is off by 2 %, and poses fit it."""
    rng = np.random.default_rng(3)
    level = from_omega_phi_kappa(0.0, 0.0, 0.0)
    centres = [np.array([12.0 * along, 18.0 * strip, 45.0]) for strip in range(3) for along in range(4)]
    camera = replace(CAMERA, distortion=())
    images = [OrientedImage(f"{k:02d}", camera, level, c) for k, c in enumerate(centres)]
    xyz = np.column_stack([rng.uniform((-25, -20), (60, 55), (2500, 2)), np.zeros(2500)])
    points, shown = [], []
    for image in images:
        uv, depth = image.project(xyz)
        shown.append(np.flatnonzero(image.holds(uv) & (depth > 0)))
        points.append(uv[shown[-1]] + rng.normal(0, 0.3, (len(shown[-1]), 2)))
    stated = (replace(camera, fx=1.02 * camera.fx, fy=1.02 * camera.fy), True)
    known, pairs = pycolmap_camera(*stated), {}
    for one in range(12):
        for other in range(one + 1, 12):
            both = np.intersect1d(shown[one], shown[other])
            matches = np.column_stack([np.searchsorted(shown[k], both) for k in (one, other)])
            found = pair_geometry((known, known), (points[one], points[other]), matches) if len(both) > 30 else None
            if found is not None:
                pairs[one, other] = found
    model = mapped(MappingInput([stated], [0] * 12, points, pairs), "radial").models[0]
    assert len(model.images) == 12
    assert model.focal_sigmas == {0: None}
    assert model.images[0].camera.fx == pytest.approx(1.02 * camera.fx)
    assert model.reprojection_px < 0.5
    named = [replace(i, name=images[k].name) for i, k in zip(model.images, model.numbers, strict=True)]
    figures = pose_figures(named, images, with_similarity=True)
    assert figures.centre_rmse_m < 0.3
    assert figures.angle_rmse_deg < 0.3


def test_a_mapping_that_dies_says_how(tmp_path: Path) -> None:
    (tmp_path / DATABASE).write_text("no database of COLMAP")
    with pytest.raises(
        MappingDiedError, match=r"the global mapping (ended with exit code|was killed by signal) .*last lines: .*\w"
    ):
        map_database(tmp_path, "global", "radial")


def _strip(spread_m: float) -> tuple[list[OrientedImage], dict[str, PhotoMetadata], np.ndarray]:
    """Eight images in one strip 50 m over a plane that falls by 5 % across it, as a mapping has them, and their positions."""
    rng = np.random.default_rng(2)
    slope = rotation_of(np.array([[np.arctan(0.05), 0.0, 0.0]]))[0]
    ground = rng.uniform(-40, 40, (300, 2))
    xyz = np.column_stack([ground, np.zeros(300)]) @ slope.T
    to_degrees = Transformer.from_crs(CRS, "EPSG:4326", always_xy=True)
    images, photos = [], {}
    for k in range(8):
        rotation = from_omega_phi_kappa(*np.radians([3.0, -2.0, 90.0]))
        image = OrientedImage(f"i{k}", CAMERA, rotation, np.array([9.0 * k - 30.0, 0.0, 50.0]))
        images.append(image)
        x, y, z = image.centre + ORIGIN + rng.normal(0, spread_m, 3)
        axis = image.axis
        look = (float(np.degrees(np.arctan2(axis[0], axis[1]))), float(np.degrees(np.arcsin(axis[2]))), 0.0)
        longitude, latitude = to_degrees.transform(x, y)
        photos[image.name] = PhotoMetadata(
            image.name, taken=f"{k}", position=GnssPosition(latitude, longitude, z), look_deg=look
        )
    model = Similarity(0.02, rotation_of(np.array([[0.3, -1.1, 2.0]]))[0], np.array([1.0, 2.0, 3.0]))
    return list(placed(images, model)), photos, model.moved(xyz)


@pytest.mark.parametrize(("gimbal", "tilt"), [(True, 0.0), (False, np.degrees(np.arctan(0.05)))])
def test_a_single_strip_takes_its_roll_from_gimbal_angles_or_level_ground(gimbal: bool, tilt: float) -> None:
    images, photos, xyz = _strip(0.01)
    if not gimbal:
        photos = {n: replace(p, look_deg=None) for n, p in photos.items()}
    asked = Placing(crs=CRS)
    gnss = known_positions(asked, photos, None)
    found = place(images, xyz, gnss, asked, None)
    truth = from_omega_phi_kappa(*np.radians([3.0, -2.0, 90.0]))
    away = np.array([i.centre - ORIGIN - (9.0 * k - 30.0, 0.0, 50.0) for k, i in enumerate(found.images)])
    assert np.sqrt(np.mean(away**2)) < 0.02
    turn = found.images[0].rotation @ truth.T
    assert np.degrees(np.linalg.norm(vector_of(turn[None]))) == pytest.approx(tilt, abs=0.1)
    assert ("gimbal" if gimbal else "level across") in found.figures["roll"]
    assert any("roll about it open" in line for line in found.lines)


def test_positions_in_a_crs_with_heights_are_led_before_anything_is_computed() -> None:
    """Heights of unknown kind count from the sea; a CRS of another continent is refused by name."""
    _, photos, _ = _strip(0.01)
    found = known_positions(Placing(crs="EPSG:25832+7837"), photos, None)
    assert found is not None
    x, y, z = (found.xyz - ORIGIN)[3]
    assert (x, y) == pytest.approx((-3.0, 0.0), abs=0.05)
    assert z == pytest.approx(50.0, abs=0.5)
    with pytest.raises(CatalogError, match="lie outside of"):
        known_positions(Placing(crs="EPSG:2193"), photos, None)
