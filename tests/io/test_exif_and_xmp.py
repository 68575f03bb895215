from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import ExifTags, Image
from PIL.TiffImagePlugin import IFDRational

from cityflow.core.photo_metadata import HeightKind, PhotoMetadata
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import PHOTO_FLIP, from_gimbal, gimbal_angles
from cityflow.io.images.exif_and_xmp import metadata_of_bytes, photo_metadata
from cityflow.io.images.xmp_tags import xmp_tags

BASE, GPS = ExifTags.Base, ExifTags.GPS
SIZE = (8192, 5460)
DJI = """ drone-dji:AltitudeType="RtkAlt" drone-dji:GpsLatitude="+52.0116012" drone-dji:GpsLongitude="+4.3571034" drone-dji:AbsoluteAltitude="+123.456"
 drone-dji:RelativeAltitude="+80.013" drone-dji:GimbalRollDegree="+0.00" drone-dji:GimbalYawDegree="-93.40" drone-dji:GimbalPitchDegree="-89.90"
 drone-dji:FlightYawDegree="-93.1" drone-dji:RtkFlag="50" drone-dji:RtkStdLon="0.01105" drone-dji:RtkStdLat="0.01220" drone-dji:RtkStdHgt="0.02518"
 drone-dji:DewarpFlag="0" drone-dji:DewarpData="2021-11-24;8180.5,8180.5,12.5,-7.25,-0.0411,0.0201,0.0011,-0.0004,-0.0302"
 drone-dji:ShutterType="Mechanical" drone-dji:CameraSerialNumber="3XCDJ" """
SENSEFLY = """<Camera:Yaw>33.5</Camera:Yaw><Camera:Pitch>4.5</Camera:Pitch><Camera:Roll>-1.25</Camera:Roll><Camera:GPSXYAccuracy>0.03</Camera:GPSXYAccuracy>
 <Camera:GPSZAccuracy>0.05</Camera:GPSZAccuracy><Camera:PerspectiveFocalLength>10.6</Camera:PerspectiveFocalLength>
 <Camera:PrincipalPoint>6.4,4.2</Camera:PrincipalPoint><Camera:VertCS>ellipsoidal</Camera:VertCS><Camera:ModelType>perspective</Camera:ModelType>
 <Camera:PerspectiveDistortion><rdf:Seq><rdf:li>-0.1</rdf:li><rdf:li>0.02</rdf:li><rdf:li>0.0</rdf:li><rdf:li>0.001</rdf:li><rdf:li>-0.002</rdf:li></rdf:Seq></Camera:PerspectiveDistortion>"""
AUTEL = ' a:GimbalYawDegree="10" a:GimbalPitchDegree="-90" a:GimbalRollDegree="0" a:RelativeAltitude="50.5" a:AbsoluteAltitude="61" '


def _xmp(attributes: str = "", elements: str = "") -> bytes:
    return (
        '<?xpacket begin="" id="W5M0MpCehiHzreSzNTczkc9d"?><x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        '<rdf:Description rdf:about="" xmlns:drone-dji="http://www.dji.com/drone-dji/1.0/" xmlns:Camera="http://pix4d.com/camera/1.0" '
        f'xmlns:a="http://www.autelrobotics.com/drone-autel/1.0/"{attributes}>{elements}</rdf:Description></rdf:RDF></x:xmpmeta><?xpacket end="w"?>'
    ).encode()


def _exif(main: dict[int, Any], fine: dict[int, Any], place: dict[Any, Any] | None = None) -> bytes:
    tags = Image.Exif()
    for key, value in main.items():
        tags[key] = value
    tags.get_ifd(ExifTags.IFD.Exif).update(fine)
    tags.get_ifd(ExifTags.IFD.GPSInfo).update(place or {})
    return tags.tobytes()


def _dms(value: float) -> tuple[IFDRational, ...]:
    seconds = round(value * 3600 * 10_000)
    return (
        IFDRational(seconds // 36_000_000),
        IFDRational(seconds % 36_000_000 // 600_000),
        IFDRational(seconds % 600_000, 10_000),
    )


PLACE = {
    GPS.GPSLatitudeRef: "N", GPS.GPSLatitude: _dms(52.01), GPS.GPSLongitudeRef: "W", GPS.GPSLongitude: _dms(4.5), GPS.GPSAltitudeRef: b"\0",
    GPS.GPSAltitude: IFDRational(100_250, 1000),
}  # fmt: skip


def test_dji_with_rtk() -> None:
    exif = _exif(
        {BASE.Make: "DJI", BASE.Model: "ZenmuseP1", BASE.Orientation: 1},
        {BASE.FocalLength: IFDRational(35), BASE.FocalLengthIn35mmFilm: 35, BASE.DateTimeOriginal: "2024:05:17 12:00:00", BASE.SubsecTimeOriginal: "25"}, PLACE,
    )  # fmt: skip
    photo = metadata_of_bytes("a.jpg", SIZE, exif, _xmp(DJI))
    assert (photo.make, photo.model, photo.serial, photo.taken) == (
        "DJI",
        "ZenmuseP1",
        "3XCDJ",
        "2024:05:17 12:00:00.25",
    )
    place = photo.position
    assert place is not None
    assert (place.latitude, place.longitude, place.height_m) == (52.0116012, 4.3571034, 123.456)
    assert (place.height_kind, place.sigmas_m, place.fixed) == (HeightKind.ELLIPSOID, (0.01105, 0.0122, 0.02518), True)
    assert (photo.above_start_m, photo.look_deg, photo.shutter) == (80.013, (-93.4, -89.9, 0.0), "global")
    camera = photo.calibrated
    assert camera is not None
    assert (camera.fx, camera.cx, camera.cy) == (8180.5, 4108.5, 2722.75)
    assert camera.distortion == (-0.0411, 0.0201, 0.0011, -0.0004, -0.0302)
    assert photo.focal_px == 8180.5


def test_sensefly() -> None:
    exif = _exif(
        {BASE.Make: "senseFly", BASE.Model: "S.O.D.A."},
        {BASE.FocalPlaneXResolution: IFDRational(5472, 12), BASE.FocalPlaneResolutionUnit: 4, BASE.FocalLength: IFDRational(106, 10),
         BASE.BodySerialNumber: "77"},
        PLACE,
    )  # fmt: skip
    photo = metadata_of_bytes("a.jpg", (5472, 3648), exif, _xmp("", SENSEFLY))
    assert photo.look_deg is not None
    # nose up by 4.5°: the camera looks ahead of straight down; the left wing is up by 1.25°, as senseFly counts: it looks to the left, too
    ahead, left = np.radians(4.5), np.radians(1.25)
    body = np.array([np.sin(ahead) * np.cos(left), -np.sin(left), np.cos(ahead) * np.cos(left)])  # ahead, right, down
    yaw = np.radians(33.5)
    north, east = np.cos(yaw) * body[0] - np.sin(yaw) * body[1], np.sin(yaw) * body[0] + np.cos(yaw) * body[1]
    assert photo.axis == pytest.approx([east, north, -body[2]], abs=1e-12)
    assert photo.sensor_width_mm == pytest.approx(12.0)
    camera, place = photo.calibrated, photo.position
    assert camera is not None
    assert (camera.fx, camera.cx, camera.cy) == pytest.approx((10.6 * 456, 6.4 * 456, 4.2 * 456))
    assert camera.distortion == (-0.1, 0.02, 0.001, -0.002, 0.0)
    assert place is not None
    assert (place.longitude, place.height_m, place.height_kind) == (-4.5, 100.25, HeightKind.ELLIPSOID)
    assert (place.sigmas_m, photo.serial) == ((0.03, 0.03, 0.05), "77")


def test_autel_and_a_plain_camera() -> None:
    autel = metadata_of_bytes("a.jpg", SIZE, b"", _xmp(AUTEL))
    assert (autel.look_deg, autel.above_start_m, autel.position) == ((10.0, -90.0, 0.0), 50.5, None)
    exif = _exif({BASE.Make: "SONY\0", BASE.Model: "ILCE-7RM4", BASE.Orientation: 6}, {BASE.FocalLengthIn35mmFilm: 24},
                 PLACE | {GPS.GPSAltitudeRef: b"\x01", GPS.GPSLatitudeRef: "S", GPS.GPSHPositioningError: IFDRational(15, 10)})  # fmt: skip
    sony = metadata_of_bytes("b.jpg", (9000, 6000), exif)
    assert (sony.make, sony.orientation, sony.focal_px, sony.look_deg) == ("SONY", 6, 6000.0, None)
    assert sony.position is not None
    assert (sony.position.latitude, sony.position.height_m) == (-52.01, -100.25)
    assert (sony.position.height_kind, sony.position.sigmas_m) == (HeightKind.UNKNOWN, (1.5, 1.5, 1.5))


def test_a_block_made_by_hand() -> None:
    """Phase One writes the focal plane in micrometres; big-endian, one directory that points to the next."""
    entries = [
        (BASE.FocalLength, 5, 1, 0),
        (BASE.FocalPlaneXResolution, 5, 1, 0),
        (BASE.FocalPlaneResolutionUnit, 3, 1, 5 << 16),
    ]
    data = 8 + 2 + 2 * 12 + 4
    values = data + 2 + 3 * 12 + 4
    fine = struct.pack(">H", 3)
    for i, (tag, kind, count, value) in enumerate(entries):
        fine += struct.pack(">HHII", tag, kind, count, value if kind == 3 else values + 8 * i)
    fine += struct.pack(">I", 0) + struct.pack(">4I", 50, 1, 10_000, 37_600)
    main = (
        struct.pack(">2sHI", b"MM", 42, 8)
        + struct.pack(">H", 2)
        + struct.pack(">HHI4s", 0x010F, 2, 4, b"P1\0\0")
        + struct.pack(">HHII", 0x8769, 4, 1, data)
    )
    photo = metadata_of_bytes("a.iiq", (14204, 10652), b"Exif\0\0" + main + struct.pack(">I", 0) + fine)
    assert (photo.make, photo.focal_mm) == ("P1", 50.0)
    assert photo.sensor_width_mm == pytest.approx(14204 * 3.76e-3)
    assert photo.focal_px == pytest.approx(50 / 3.76e-3)


def test_damage_is_as_if_nothing_were_there() -> None:
    exif = _exif({BASE.Make: "DJI"}, {BASE.FocalLength: IFDRational(0, 0)}, PLACE | {GPS.GPSLatitude: (1, 2)})
    assert metadata_of_bytes("a", SIZE, exif, _xmp(DJI)[:300]) == PhotoMetadata("a", *SIZE, make="DJI")
    for block in (b"", b"Exif\0\0", b"Exif\0\0II*\0\xff\xff\xff\xff", exif[:30]):
        assert metadata_of_bytes("a", SIZE, block).position is None
    bomb = b'<!DOCTYPE a [<!ENTITY b "cc">]>' + _xmp(DJI)
    assert xmp_tags(bomb) == xmp_tags(b"\xff\xfe") == xmp_tags(b"x" * 2_000_000) == {}
    odd = _xmp(DJI.replace("8180.5,8180.5", "x,y").replace("-89.90", "down"))
    photo = metadata_of_bytes("a", SIZE, b"", odd)
    assert (photo.calibrated, photo.look_deg) == (None, None)


def test_files(tmp_path: Path) -> None:
    picture = Image.new("RGB", (64, 48))
    picture.save(tmp_path / "a.jpg", exif=_exif({BASE.Make: "DJI"}, {}, PLACE), xmp=_xmp(DJI))
    photo = photo_metadata(tmp_path / "a.jpg")
    assert (photo.name, photo.width, photo.height, photo.make, photo.look_deg) == (
        "a.jpg",
        64,
        48,
        "DJI",
        (-93.4, -89.9, 0.0),
    )
    picture.save(tmp_path / "b.tif", tiffinfo={700: _xmp(DJI)})
    assert photo_metadata(tmp_path / "b.tif").above_start_m == 80.013
    (tmp_path / "c.jpg").write_bytes(b"no picture")
    for name in ("c.jpg", "d.jpg"):
        with pytest.raises(CatalogError, match=f"{name}: this is no image"):
            photo_metadata(tmp_path / name)


@pytest.mark.parametrize("make", ["senseFly", "Parrot"])
def test_wings_that_roll_tilt_the_axis(make: str) -> None:
    """Heading north, level, right wing down by 20°: a camera in the floor looks to the west of straight down."""
    roll = -20 if make == "senseFly" else 20
    tags = f"<Camera:Yaw>0</Camera:Yaw><Camera:Pitch>0</Camera:Pitch><Camera:Roll>{roll}</Camera:Roll>"
    photo = metadata_of_bytes("a.jpg", SIZE, _exif({BASE.Make: make}, {}), _xmp("", tags))
    assert photo.axis == pytest.approx([-np.sin(np.radians(20)), 0.0, -np.cos(np.radians(20))])
    assert photo.look_deg is not None
    x_of_picture = from_gimbal(*np.radians(photo.look_deg).tolist())[0]
    assert x_of_picture == pytest.approx([np.cos(np.radians(20)), 0.0, -np.sin(np.radians(20))], abs=1e-12)


@pytest.mark.parametrize(
    "degrees", [(40.0, -50.0, 20.0), (-170.0, 30.0, -120.0), (25.0, -90.0, 0.0), (0.0, 0.0, 0.0), (77.0, 90.0, 0.0)]
)
def test_angles_of_a_gimbal_come_back(degrees: tuple[float, float, float]) -> None:
    assert np.degrees(gimbal_angles(from_gimbal(*np.radians(degrees).tolist()))) == pytest.approx(degrees, abs=1e-6)


def test_the_look_of_a_gimbal() -> None:
    """Straight down with the top of the picture to the east; level to the north; rolled, the horizon turns about the axis."""
    down = from_gimbal(np.pi / 2, -np.pi / 2, 0.0)
    assert down == pytest.approx(PHOTO_FLIP @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    assert from_gimbal(0.0, 0.0, 0.0) == pytest.approx(np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]))
    yaw, pitch, roll = np.radians([40.0, -50.0, 20.0])
    level, rolled = from_gimbal(yaw, pitch, 0.0), from_gimbal(yaw, pitch, roll)
    assert rolled[2] == pytest.approx(level[2])
    axis = PhotoMetadata("a", look_deg=(40.0, -50.0, 20.0)).axis
    assert axis is not None
    assert rolled[2] == pytest.approx(axis)
    assert rolled[1] @ level[1] == pytest.approx(np.cos(roll))
    assert rolled[0][2] < 0  # the right wing is down
