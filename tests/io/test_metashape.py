from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS, Transformer

from cityflow.errors import CatalogError
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.orientation.metashape import read_metashape

GEOGRAPHIC = CRS.from_epsg(4326).to_wkt("WKT1_GDAL")
UTM = CRS.from_epsg(32633)
CALIBRATION = """<calibration type="frame" class="adjusted"><resolution width="6000" height="4000"/><f>7000</f><cx>10</cx><cy>-15</cy>
<k1>-0.05</k1><p1>0.0003</p1><p2>-0.0002</p2></calibration>"""


def _xml(cameras: str, transform: str = "", reference: str = "", sensor: str = CALIBRATION, kind: str = "frame") -> str:
    return f"""<?xml version="1.0" encoding="UTF-8"?><document version="1.5.0"><chunk label="Chunk 1" enabled="true"><sensors>
    <sensor id="0" label="head" type="{kind}"><resolution width="6000" height="4000"/><property name="pixel_width" value="0.0045"/>{sensor}</sensor>
    </sensors><cameras><group id="0">{cameras}</group></cameras>{transform}<reference>{reference}</reference></chunk></document>"""


def _camera(label: str, pose: np.ndarray, number: int = 0) -> str:
    return f'<camera id="{number}" sensor_id="0" label="{label}"><transform>{" ".join(map(repr, pose.reshape(-1).tolist()))}</transform></camera>'


def _write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "cameras.xml"
    path.write_text(text)
    return path


def test_local_frame_with_a_chunk_transform(tmp_path: Path) -> None:
    rotation = from_omega_phi_kappa(0.3, -0.2, 1.1)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.T, (1.0, 2.0, 3.0)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    text = f"<transform><rotation>{' '.join(map(str, turn.ravel()))}</rotation><translation>100 200 300</translation><scale>2</scale></transform>"
    model = read_metashape(
        _write(tmp_path, _xml(_camera("a", pose) + '<camera id="1" sensor_id="0" label="b"/>', text, 'LOCAL_CS["x"]'))
    )
    (image,) = model.images
    assert image.centre == pytest.approx((100 - 4, 200 + 2, 300 + 6))
    assert image.rotation == pytest.approx(rotation @ turn.T)
    assert (image.camera.cx, image.camera.cy, image.camera.fx) == (3010, 1985, 7000)
    # the tangential terms are OpenCV's the other way round
    assert image.camera.distortion == (-0.05, 0, -0.0002, 0.0003, 0)
    assert model.pixel_mm == {"a": 0.0045}
    assert [(o.name, "no orientation" in o.problem) for o in model.left_out] == [("b", True)]


def test_geocentric_poses_reach_the_map(tmp_path: Path) -> None:
    """A camera placed in UTM by hand, led to geocentric coordinates by its projected points, comes back."""
    centre = np.array([400_000.0, 5_800_000.0, 600.0])
    rotation = from_omega_phi_kappa(0.2, 0.1, 0.8)
    to_earth = Transformer.from_crs(UTM.to_3d(), CRS.from_epsg(4978), always_xy=True)
    tips = np.vstack([centre, centre + rotation])
    earth = np.stack(to_earth.transform(*tips.T), axis=1)
    axes = earth[1:] - earth[0]
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = (axes / np.linalg.norm(axes, axis=1, keepdims=True)).T, 0.0
    text = f"<transform><translation>{' '.join(map(repr, earth[0].tolist()))}</translation></transform>"
    model = read_metashape(_write(tmp_path, _xml(_camera("a", pose), text, GEOGRAPHIC)), UTM)
    (image,) = model.images
    assert image.centre == pytest.approx(centre, abs=1e-4)
    # 1 m arms feel the projection's scale and the Earth's bend
    assert np.degrees(np.abs(image.rotation - rotation).max()) < 0.01
    assert model.crs_wkt is not None


def test_what_cannot_be_used_is_named(tmp_path: Path) -> None:
    path = _write(tmp_path, _xml(_camera("a", np.eye(4)), reference=GEOGRAPHIC))
    with pytest.raises(CatalogError, match="in degrees"):
        read_metashape(path)
    model = read_metashape(_write(tmp_path, _xml(_camera("a", np.eye(4)), kind="spherical")))
    assert "spherical" in model.left_out[0].problem
    model = read_metashape(_write(tmp_path, _xml(_camera("a", np.eye(4)), sensor="")))
    assert "no calibration" in model.left_out[0].problem
    with pytest.raises(CatalogError, match="cannot be read"):
        read_metashape(_write(tmp_path, "<document><chunk>"))
    with pytest.raises(CatalogError, match="no chunk"):
        read_metashape(_write(tmp_path, "<document/>"))
    with pytest.raises(CatalogError, match="16"):
        read_metashape(
            _write(tmp_path, _xml('<camera id="0" sensor_id="0" label="a"><transform>1 2 3</transform></camera>'))
        )
