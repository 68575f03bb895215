from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyproj import CRS, Transformer
from scipy.spatial.transform import Rotation

from cityflow.core.camera import OrientedImage
from cityflow.errors import CatalogError
from cityflow.io.orientation.opensfm import read
from cityflow.io.orientation.oriented_images import OrientationModel
from cityflow.io.orientation.readers import OrientationFile
from delivered_flight import ORIGIN, flight, ground, largest_difference_px

LENS = (-0.05, 0.02, 4e-4, -3e-4, -0.004)
PLACE = {"latitude": 52.01, "longitude": 4.36, "altitude": 10.0}
EXAMPLE: dict[str, Any] = {
    "cameras": {"v2 dji fc220 4000 3000 perspective 0.8": {
        "projection_type": "perspective", "width": 4000, "height": 3000, "focal": 0.8, "k1": -0.02, "k2": 0.01}},
    "shots": {"DJI_1.JPG": {
        "rotation": [np.pi, 0.0, 0.0], "translation": [-10.0, 20.0, 80.0], "camera": "v2 dji fc220 4000 3000 perspective 0.8",
        "orientation": 1, "capture_time": 1.5e9, "gps_dop": 15.0, "gps_position": [10.0, 20.0, 80.0]}},
    "points": {"7": {"color": [1, 2, 3], "coordinates": [12.0, 18.0, 1.0]}}, "reference_lla": PLACE,
}  # fmt: skip


def _read(path: Path, target: CRS | None = None) -> OrientationModel:
    return read(OrientationFile(path, {}, lambda _: None, target))


def _written(folder: Path, *parts: dict[str, Any]) -> Path:
    path = folder / "reconstruction.json"
    path.write_text(json.dumps(list(parts)))
    return path


def _model(images: tuple[OrientedImage, ...], **more: Any) -> dict[str, Any]:
    cameras, shots = {}, {}
    for image in images:
        c = image.camera
        size, key = max(c.width, c.height), f"{c.fx:.3f}"
        d = (*c.distortion, *(0.0,) * 5)[:5]
        cameras[key] = {
            "projection_type": "brown", "width": c.width, "height": c.height, "focal_x": c.fx / size, "focal_y": c.fy / size,
            "c_x": (c.cx - c.width / 2) / size, "c_y": (c.cy - c.height / 2) / size, **dict(zip(("k1", "k2", "p1", "p2", "k3"), d, strict=True)),
        }  # fmt: skip
        shots[f"{image.name}.jpg"] = {
            "rotation": Rotation.from_matrix(image.rotation).as_rotvec().tolist(),
            "translation": (-image.rotation @ image.centre).tolist(), "camera": key,
        }  # fmt: skip
    return {"cameras": cameras, "shots": shots, "points": {}, **more}


def test_the_synthetic_flight_comes_back(tmp_path: Path) -> None:
    images = flight(distortion=LENS)
    assert largest_difference_px(_read(_written(tmp_path, _model(images))), images) < 1e-6


def test_a_place_on_earth_is_led_to_the_map(tmp_path: Path) -> None:
    """Truth: places on the ground, transformed by PROJ one by one, stand where the poses on the map see them."""
    local = [i for i in flight() if "nadir" in i.name]
    images = tuple(OrientedImage(i.name, i.camera, i.rotation, i.centre - ORIGIN) for i in local)
    model = _read(_written(tmp_path, _model(images, reference_lla=PLACE)), CRS.from_epsg(28992))
    pipeline = (
        f"+proj=pipeline +step +inv +proj=topocentric +ellps=WGS84 +lat_0={PLACE['latitude']} +lon_0={PLACE['longitude']} +h_0={PLACE['altitude']} "
        "+step +inv +proj=cart +ellps=WGS84 +step +proj=unitconvert +xy_in=rad +xy_out=deg"
    )
    lon, lat, height = Transformer.from_pipeline(pipeline).transform(*(ground() - ORIGIN).T)
    on_map = np.stack(
        Transformer.from_crs(CRS.from_epsg(4979), CRS.from_epsg(28992).to_3d(), always_xy=True).transform(
            lon, lat, height
        ),
        axis=1,
    )
    found = {i.name.removesuffix(".jpg"): i for i in model.images}
    for image in images:
        uv, _ = image.project(ground() - ORIGIN)
        other, _ = found[image.name].project(on_map)
        # the scale of the map (1e-4) and the curvature of the Earth remain
        assert np.abs(other - uv)[image.holds(uv)].max() < 0.1
    assert "taken as ellipsoidal" in model.notes[0]


def test_the_example(tmp_path: Path) -> None:
    (image,) = _read(_written(tmp_path, EXAMPLE)).images
    assert image.centre == pytest.approx([10.0, 20.0, 80.0])
    camera = image.camera
    assert (camera.fx, camera.cx, camera.cy, camera.distortion) == (3200.0, 2000.0, 1500.0, (-0.02, 0.01, 0.0, 0.0))
    uv, _ = image.project(np.array([[18.0, 20.0, 0.0]]))  # looks down, its top to the north: east is to the right
    x = 0.1 * (1 - 0.02 * 0.01 + 0.01 * 1e-4)
    assert uv[0] == pytest.approx([2000 + 3200 * x, 1500.0])


@pytest.mark.parametrize(("kind", "terms", "expected"), [
    ("fisheye", {"focal": 0.5, "k1": 0.1, "k2": 0.2}, (0.1, 0.2)),
    ("fisheye_opencv", {"focal": 0.5, "aspect_ratio": 1.01, "k1": 0.1, "k2": 0.2, "k3": 0.3, "k4": 0.4}, (0.1, 0.2, 0.3, 0.4)),
    ("simple_radial", {"focal": 0.5, "k1": 0.1}, (0.1, 0.0, 0.0, 0.0)), ("radial", {"focal": 0.5}, ()),
])  # fmt: skip
def test_kinds_of_cameras(tmp_path: Path, kind: str, terms: dict[str, float], expected: tuple[float, ...]) -> None:
    cameras = {k: {"projection_type": kind, "width": 4000, "height": 3000, **terms} for k in EXAMPLE["cameras"]}
    (image,) = _read(_written(tmp_path, EXAMPLE | {"cameras": cameras})).images
    assert image.camera.distortion == expected
    assert image.camera.fy == pytest.approx(2000 * terms.get("aspect_ratio", 1.0))


def test_what_is_wrong_is_named(tmp_path: Path) -> None:
    shot = next(iter(EXAMPLE["shots"].values()))
    for change, match in (
        ({"camera": "x"}, "no camera 'x'"), ({"rotation": [1, 2]}, "are no pose"), ({"translation": ["a", 1, 2]}, "'a'"),
    ):  # fmt: skip
        (out,) = _read(_written(tmp_path, EXAMPLE | {"shots": {"a.jpg": shot | change}})).left_out
        assert out.name == "a.jpg"
        assert match in out.problem
    cameras = {k: v | {"projection_type": "spherical"} for k, v in EXAMPLE["cameras"].items()}
    assert "'spherical' cannot be undistorted" in str(
        _read(_written(tmp_path, EXAMPLE | {"cameras": cameras})).left_out[0]
    )
    for text, match in (("[", "cannot be read"), ("[]", "no reconstruction with shots"), ('[{"shots": 3}]', "damaged")):
        (tmp_path / "reconstruction.json").write_text(text)
        with pytest.raises(CatalogError, match=match):
            _read(tmp_path / "reconstruction.json")


def test_separate_models_are_said(tmp_path: Path) -> None:
    other = EXAMPLE | {"shots": {"DJI_2.JPG": next(iter(EXAMPLE["shots"].values()))}}
    model = _read(_written(tmp_path, EXAMPLE, other))
    assert [i.name for i in model.images] == ["DJI_1.JPG", "DJI_2.JPG"]
    assert "2 separate models (1, 1 images)" in model.notes[0]
    assert len(model.sparse) == 2


def test_what_opendronemap_has_overwritten_is_read_from_beside(tmp_path: Path) -> None:
    """The file holds UTM less an offset (its north is off by the meridian convergence); OpenSfM's own stands beside."""
    place = PLACE | {"altitude": 0.0}
    images = tuple(OrientedImage(i.name, i.camera, i.rotation, i.centre - ORIGIN) for i in flight())
    turn = Rotation.from_euler("z", 1.5, degrees=True).as_matrix()
    utm = tuple(replace(i, rotation=i.rotation @ turn.T, centre=turn @ i.centre) for i in images)
    path = _written(tmp_path, _model(utm, reference_lla=place))
    target = CRS.from_epsg(28992)
    assert "name reconstruction.topocentric.json" in _read(path, target).notes[0]
    (tmp_path / "reconstruction.topocentric.json").write_text(json.dumps([_model(images, reference_lla=place)]))
    model = _read(path, target)
    assert len(model.notes) == 1
    alone = _read(tmp_path / "reconstruction.topocentric.json", target)
    assert [i.centre.tolist() for i in model.images] == [i.centre.tolist() for i in alone.images]
