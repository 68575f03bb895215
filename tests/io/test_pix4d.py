from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS

from cityflow.core.camera import OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import omega_phi_kappa
from cityflow.io.orientation.oriented_images import OrientationModel
from cityflow.io.orientation.pix4d import EXTERNAL, INTERNAL, MATRICES, WHOLE, read
from cityflow.io.orientation.readers import OrientationFile
from delivered_flight import ORIGIN, PIXEL_MM, flight, largest_difference_px

LENS = (-0.05, 0.02, 4e-4, -3e-4, -0.004)
CAMERA = """Pix4D camera calibration file 0
#Focal Length mm assuming a sensor width of 17.49998592000000030566x13.12498944000000200560mm
F 15.01175404934517487732
#Principal Point mm
Px 8.48210511970419922534
Py 6.33434629978042273990
#Symmetrical Lens Distortion Coeffs
K1 0.03833474118270804865
K2 -0.01750917966495743258
K3 0.02049798716391852335
#Tangential Lens Distortion Coeffs
T1 0.00240851666319534747
T2 0.00292562392135245920

"""
CALIBRATED = """fileName imageWidth imageHeight
camera matrix K [3x3]
radial distortion [3x1]
tangential distortion [2x1]
camera position t [3x1]
camera rotation R [3x3]
camera model m = K [R|-Rt] X

DJI_0954.JPG 4608 3456
3952.81247514184087776812 0 2233.46124792750424603582
0 3952.81247514184087776812 1667.92521335858214115433
0 0 1
0.03833474118270804865 -0.01750917966495743258 0.02049798716391852335
0.00240851666319534747 0.00292562392135245920
21.54872206687879199194 -29.58734160676452162875 30.85702810138878149360
0.78389904231994589345 -0.62058396220897726892 -0.01943803742353054573
-0.62086105345046738169 -0.78318706257080084043 -0.03390541741516269608
0.00581753884797473961 0.03864674463298682638 -0.99923600083815289352

"""
SIZE = (4608, 3456)


def _read(path: Path, size: tuple[int, int] | None = SIZE, target: CRS | None = None) -> OrientationModel:
    return read(OrientationFile(path, {}, lambda _: size, target))


def _whole(images: tuple[OrientedImage, ...]) -> str:
    lines = [*CALIBRATED.splitlines()[:7], ""]
    for image in images:
        c, d = image.camera, (*image.camera.distortion, *(0.0,) * 5)[:5]
        lines += [
            f"{image.name}.tif {c.width} {c.height}", f"{c.fx:.17g} 0 {c.cx:.17g}", f"0 {c.fy:.17g} {c.cy:.17g}", "0 0 1",
            f"{d[0]:.17g} {d[1]:.17g} {d[4]:.17g}", f"{d[2]:.17g} {d[3]:.17g}", " ".join(f"{v:.12f}" for v in image.centre - ORIGIN),
            *(" ".join(f"{v:.17g}" for v in row) for row in image.rotation),
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


def test_the_synthetic_flight_comes_back(tmp_path: Path) -> None:
    images = flight(distortion=LENS)
    (tmp_path / f"town_{WHOLE}").write_text(_whole(images))
    (tmp_path / "town_offset.xyz").write_text("{:.3f} {:.3f} {:.3f}".format(*ORIGIN))
    (tmp_path / "town_wkt.prj").write_text(CRS.from_epsg(25832).to_wkt("WKT1_GDAL"))
    model = _read(tmp_path, None, CRS.from_epsg(25832))
    assert largest_difference_px(model, images) < 1e-6
    assert not model.notes
    assert "ETRS89 / UTM zone 33N" in str(_read(tmp_path, None, CRS.from_epsg(25833)).notes)


def test_the_flight_comes_back_from_angles_and_a_camera(tmp_path: Path) -> None:
    images = tuple(i for i in flight(distortion=LENS) if "nadir" in i.name)
    lines = ["imageName X Y Z Omega Phi Kappa"]
    for image in images:
        angles = np.degrees(omega_phi_kappa(image.rotation))
        lines.append(" ".join([f"{image.name}.tif", *(f"{v:.12f}" for v in (*image.centre, *angles))]))
    (tmp_path / f"town_{EXTERNAL}").write_text("\n".join(lines))
    c, mm = images[0].camera, PIXEL_MM
    k1, k2, t1, t2, k3 = c.distortion
    (tmp_path / f"town_{INTERNAL}").write_text(
        f"Pix4D camera calibration file 0\n#Focal Length mm assuming a sensor width of {c.width * mm:.17g}x{c.height * mm:.17g}mm\n"
        f"F {c.fx * mm:.17g}\n#Principal Point mm\nPx {c.cx * mm:.17g}\nPy {c.cy * mm:.17g}\nK1 {k1}\nK2 {k2}\nK3 {k3}\nT1 {t1}\nT2 {t2}\n"
    )
    assert largest_difference_px(_read(tmp_path, (c.width, c.height)), images) < 1e-6


def test_the_flight_comes_back_from_matrices(tmp_path: Path) -> None:
    images = flight()
    lines = []
    for image in images:
        matrix = image.camera.matrix @ image.rotation @ np.column_stack([np.eye(3), -(image.centre - ORIGIN)])
        lines.append(" ".join([f"{image.name}.tif", *(f"{v:.12f}" for v in matrix.ravel())]) + " ")
    (tmp_path / f"town_{MATRICES}").write_text("\n".join(lines))
    (tmp_path / "town_offset.xyz").write_text("{} {} {}\n".format(*ORIGIN))
    camera = images[0].camera
    assert largest_difference_px(_read(tmp_path, (camera.width, camera.height)), images) < 1e-6


def test_both_examples_are_the_same_camera(tmp_path: Path) -> None:
    """The angles of the matrix; both files are of one project of Pix4D's."""
    (tmp_path / f"p_{WHOLE}").write_text(CALIBRATED)
    (whole,) = _read(tmp_path).images
    omega, phi, kappa = np.degrees(omega_phi_kappa(whole.rotation))
    (tmp_path / f"q_{EXTERNAL}").write_text(
        f"imageName X Y Z Omega Phi Kappa\nDJI_0954.JPG 21.548722 -29.587342 30.857028 {omega:.9f} {phi:.9f} {kappa:.9f}\n"
    )
    (tmp_path / f"q_{INTERNAL}").write_text(CAMERA)
    (external,) = _read(tmp_path / f"q_{EXTERNAL}").images
    points = np.array([[21.0, -29.0, 0.0], [35.0, -20.0, 1.0], [10.0, -40.0, 2.0]])
    assert external.project(points)[0] == pytest.approx(whole.project(points)[0], abs=1e-3)
    assert "p_offset.xyz is missing" in _read(tmp_path / f"p_{WHOLE}").notes[0]


def test_what_is_wrong_is_named(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="no calibrated cameras in the folder"):
        _read(tmp_path)
    path = tmp_path / f"p_{WHOLE}"
    path.write_text(CALIBRATED.replace("21.548", "2l.548"))
    assert f"p_{WHOLE}, line 9: '2l.54872206687879199194' in t is no number" in str(_read(path).left_out[0])
    path.write_text("\n".join(CALIBRATED.splitlines()[:-2]))
    with pytest.raises(CatalogError, match=rf"p_{WHOLE}:9: the file ends within an image"):
        _read(path)
    external = tmp_path / f"q_{EXTERNAL}"
    external.write_text("imageName X Y Z Omega Phi Kappa\na.jpg 1 2 3 4 5 6\n")
    with pytest.raises(CatalogError, match=f"q_{INTERNAL}: the file cannot be read"):
        _read(external)
    (tmp_path / f"q_{INTERNAL}").write_text(CAMERA + CAMERA)
    with pytest.raises(CatalogError, match="it has 2 cameras"):
        _read(external)
    (tmp_path / f"q_{INTERNAL}").write_text(CAMERA)
    assert "cannot be read" in str(_read(external, None).left_out[0])
    with pytest.raises(CatalogError, match="none of Pix4D's"):
        _read(tmp_path / "cameras.txt")
    (tmp_path / f"r_{WHOLE}").write_text(CALIBRATED)
    with pytest.raises(CatalogError, match="several projects"):
        _read(tmp_path)
