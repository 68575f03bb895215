from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS

from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import PHOTO_FLIP
from cityflow.io.orientation.inpho import read
from cityflow.io.orientation.oriented_images import OrientationModel
from cityflow.io.orientation.photo_frame import LensTerms, PhotoCamera
from cityflow.io.orientation.readers import OrientationFile
from delivered_flight import PIXEL_MM, flight, ground, largest_difference_px

EXAMPLE = r"""$PROJECT 10.0.1
  $PROJECT_NAME : town
  $LINEAR_UNITS_OF_OBJECT : m
  $LINEAR_UNITS_OF_IMAGE : mm
  $ANGULAR_UNITS : deg
$END
$COORDINATE_SYSTEM_SET
  $ID : ETRS89
  $COORDINATE_SYSTEM : EPSG:25832
$END_COORDINATE_SYSTEM
$PHOTO
  $PHOTO_NUM : LE_01_7420
  $PHOTO_FILE : D:\flight\ 3\LE_01_7420.tif
  $CAMERA_ID : O42_LE
  $TERRAIN_HEIGHT : 110.0
  $IO_STAT : manual
  $ORI_STAT : adjusted
  $EXT_ORI : 12:00:00 01/01/2026
      124.00000   380000.00000   5680000.00000   1000.00000
      1.000000000000   0.000000000000   0.000000000000
      0.000000000000   1.000000000000   0.000000000000
      0.000000000000   0.000000000000   1.000000000000
  $PHOTO_FOOTPRINT :
      1 2 3
  $END_POINTS
$END
$CAMERA_DEFINITION
  $ID : O42_LE
  $CCD_COLUMNS : 80
  $CCD_ROWS : 100
  $PIXEL_REFERENCE : CenterTopLeft
  $CAMERA_MOUNT_ROTATION : 270
  $ACTIVE_CALIBRATION : 2
  $CALIBRATION_SET :
    $ID : 1
    $FOCAL_LENGTH : 1
    $CCD_INTERIOR_ORIENTATION :
      1 0 1
      0 -1 1
    $END
  $CALIBRATION_SET :
    $ID : 2
    $CCD_INTERIOR_ORIENTATION :
      0 -250 39.5
      -250 0 49.5
    $FOCAL_LENGTH : 124
    $PRINCIPAL_POINT_PPA : 0.01 -0.02
    $END
$END
"""


def _read(path: Path, target: CRS | None = None, **options: str) -> OrientationModel:
    return read(OrientationFile(path, options, lambda _: None, target))


def _written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def _project(images: tuple[OrientedImage, ...], turned: bool) -> str:
    """The images as Inpho writes them; pixels turned by 90° stand so in every second camera."""
    cameras = sorted({i.camera for i in images}, key=lambda c: (c.fx, c.cx))
    lines = ["$PROJECT 12.0", "  $LINEAR_UNITS_OF_OBJECT : m", "  $LINEAR_UNITS_OF_IMAGE : mm", "$END"]
    axes = [np.diag([1.0, -1.0]), np.array([[0.0, -1.0], [-1.0, 0.0]])]  # of u and v in the photograph's frame
    for n, c in enumerate(cameras):
        q = axes[n % 2 if turned else 0]
        (a, b), (d, e) = q / PIXEL_MM
        # the principal point is half in the affine's zero and half in $PRINCIPAL_POINT_PPA
        ppa = np.array([0.013, -0.007])
        u, v = np.array([c.cx - 0.5, c.cy - 0.5]) - q / PIXEL_MM @ ppa
        lines += [
            "$CAMERA_DEFINITION", f"  $ID : cam{n}", f"  $CCD_COLUMNS : {c.width}", f"  $CCD_ROWS : {c.height}",
            "  $PIXEL_REFERENCE : CenterTopLeft", "  $CALIBRATION_SET :", "    $ID : 1", "    $CCD_INTERIOR_ORIENTATION :",
            f"      {a:.13f} {b:.13f} {u:.13f}", f"      {d:.13f} {e:.13f} {v:.13f}",
            f"    $FOCAL_LENGTH : {c.fx * PIXEL_MM:.16f}", f"    $PRINCIPAL_POINT_PPA : {ppa[0]} {ppa[1]}", "    $END", "$END",
        ]  # fmt: skip
    for image in images:
        n = cameras.index(image.camera)
        turn = np.zeros((3, 3))
        turn[:2, :2], turn[2, 2] = axes[n % 2 if turned else 0], -1.0
        matrix = turn.T @ image.rotation
        lines += [
            "$PHOTO", f"  $PHOTO_NUM : {image.name}", f"  $CAMERA_ID : cam{n}", "  $EXT_ORI : 10:11:12 13/05/2026",
            f"    {image.camera.fx * PIXEL_MM:.16f} " + " ".join(f"{v:.9f}" for v in image.centre),
            *("    " + " ".join(f"{v:.15f}" for v in row) for row in matrix), "$END",
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("turned", [False, True])
def test_the_synthetic_flight_comes_back(tmp_path: Path, turned: bool) -> None:
    images = flight()
    assert len({i.camera for i in images}) == 2
    model = _read(_written(tmp_path / "flight.prj", _project(images, turned)))
    assert largest_difference_px(model, images) < 1e-6
    assert model.pixel_mm[model.images[0].name] == pytest.approx(PIXEL_MM)


def test_the_example(tmp_path: Path) -> None:
    model = _read(_written(tmp_path / "a.prj", EXAMPLE))
    (image,) = model.images
    assert image.name == "LE_01_7420.tif"
    camera = image.camera
    assert (camera.width, camera.height) == (80, 100)
    assert [camera.fx, camera.cx, camera.cy] == pytest.approx([31_000, 40 + 0.02 * 250, 50 - 0.01 * 250])
    # x of the photograph is east: u of the picture grows to the south, v to the west
    east, _ = image.project(np.add(image.centre, [[10.0, 0.0, -1000.0]]))
    assert east[0] - (image.camera.cx, image.camera.cy) == pytest.approx([0.0, -310.0])
    assert model.crs_wkt is not None
    assert CRS.from_wkt(model.crs_wkt).to_epsg() == 25832
    assert not model.notes
    assert "ETRS89 / UTM zone 32N" in str(_read(tmp_path / "a.prj", CRS.from_epsg(25833)).notes)


def test_lens_coefficients_are_displacements_of_what_is_measured() -> None:
    """Truth from the formula by itself: measured → corrected, millimetres; the camera leads back."""
    radial, decentring = (0.0, -1.5e-5, 4.0e-9, -4e-14), (3.4e-6, 4.3e-6)
    affine = np.array([[0.0, -200.0, 4000.0], [-200.0, 0.0, 3000.0]])
    for terms, sign in ((LensTerms.SUBTRACTED, -1), (LensTerms.ADDED, 1)):
        photo = PhotoCamera(8000, 6000, affine, 50.0, (0.1, 0.05), radial, decentring, terms)
        camera, turn = photo.camera_and_turn
        x, y = (a.ravel() for a in np.meshgrid(np.linspace(-14, 14, 15), np.linspace(-19, 19, 15)))
        r2, p1, p2 = x * x + y * y, *decentring
        factor = radial[1] * r2 + radial[2] * r2**2 + radial[3] * r2**3
        ideal_x = x + sign * (x * factor + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y)
        ideal_y = y + sign * (y * factor + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y)
        seen = np.stack([ideal_x, ideal_y, np.full_like(x, -50.0)], axis=1) @ turn.T
        pixels = affine @ np.stack([x + 0.1, y + 0.05, np.ones_like(x)])
        assert np.abs(camera.distort(seen[:, :2] / seen[:, 2:]) - pixels.T).max() < 0.05


def test_lens_terms_are_told(tmp_path: Path) -> None:
    text = EXAMPLE.replace("    $FOCAL_LENGTH : 124\n", "    $FOCAL_LENGTH : 124\n    $DISTORTION_TYPE : Polynomial\n    $RADIAL_COEFFS :\n"
                           "      0 1e-4 0 0\n      0 0 0 0\n    $DECENTRE_COEFFS :\n      0 0 0 0\n")  # fmt: skip
    path = _written(tmp_path / "a.prj", text)
    (first,), (second,) = (_read(path, lens_terms=t).images for t in ("subtracted", "added"))
    assert first.camera.distortion[0] > 0 > second.camera.distortion[0]
    assert "--lens-terms added" in str(_read(path).notes)
    with pytest.raises(CatalogError, match=r"--lens-terms: 'both' is not known → one of subtracted, added"):
        _read(path, lens_terms="both")


@pytest.mark.parametrize(("before", "after", "match"), [
    ("$CAMERA_ID : O42_LE\n  $T", "$CAMERA_ID : X\n  $T", r"a\.prj, line 11: no camera 'X'; there are: O42_LE"),
    ("      124.00000 ", "      120.00000 ", r"line 11: \$EXT_ORI \(line 18\) has a focal length of 120 mm, its camera 124 mm"),
    ("380000.00000", "38o000", r"'38o000' in \$EXT_ORI \(line 18\) is no number"),
    ("      0.000000000000   1.000000000000", "      0.000000000000   -1.000000000000", "not a rotation"),
    ("0 -250 39.5", "0 250 39.5", "mirrored"), ("0 -250 39.5", "9 -250 39.5", "not at a right angle"),
    ("CenterTopLeft", "Middle", r"\$PIXEL_REFERENCE 'Middle' is not known"),
    ("    $FOCAL_LENGTH : 124\n", "", r"camera O42_LE: it has no \$FOCAL_LENGTH \(line 27\)"),
])  # fmt: skip
def test_a_photograph_that_cannot_be_used_is_named(tmp_path: Path, before: str, after: str, match: str) -> None:
    assert before in EXAMPLE
    model = _read(_written(tmp_path / "a.prj", EXAMPLE.replace(before, after, 1)))
    assert not model.images
    with pytest.raises(AssertionError, match=match):
        raise AssertionError(str(model.left_out[0]))


@pytest.mark.parametrize(("text", "match"), [
    (EXAMPLE.replace(": m\n", ": ft\n", 1), r"a\.prj:3: coordinates in 'ft', not in metres → export"),
    (EXAMPLE.replace(": mm\n", ": furlong\n"), r"a\.prj:4: the unit 'furlong' is not known"),
    (EXAMPLE[: EXAMPLE.rindex("$END")], r"a\.prj:27: \$CAMERA_DEFINITION does not end"), ("PROJCS[…]", r"no \$PHOTO in the file"),
])  # fmt: skip
def test_a_file_that_is_none_is_refused(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(CatalogError, match=match):
        _read(_written(tmp_path / "a.prj", text))


def test_initial_orientations_are_said(tmp_path: Path) -> None:
    model = _read(_written(tmp_path / "a.prj", EXAMPLE.replace(": adjusted", ": Initial")))
    assert "marked as initial" in model.notes[0]


def test_a_plain_camera_has_no_turn() -> None:
    camera, turn = PhotoCamera(100, 80, np.array([[100.0, 0, 50], [0, -100, 40]]), 20.0).camera_and_turn
    assert camera == Camera(100, 80, 2000.0, 2000.0, 50.0, 40.0)
    assert (turn == PHOTO_FLIP).all()
    assert len(ground()) == 500
