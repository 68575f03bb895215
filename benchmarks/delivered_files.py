"""Small sound files of what contractors and photographers deliver: orientations, control points, photographs with EXIF and XMP; for `fuzz_inputs.py`."""

# ruff: noqa: E501 - small files as texts
from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import ExifTags, Image
from pyproj import CRS

from cityflow.io.control_points.pix4d_points import read_pix4d_points
from cityflow.io.control_points.read_points import read_control_points
from cityflow.io.images.exif_and_xmp import photo_metadata
from cityflow.io.orientation.readers import OrientationFile, read_orientation

SIZE = (4608, 3456)
CAMERAS = [
    {"id": "cam", "width": 4608, "height": 3456, "focal_mm": 15.0, "pixel_mm": 0.0038, "k1": 0.01, "images": "*"}
]
INPHO = r"""$PROJECT 10.0.1
  $LINEAR_UNITS_OF_OBJECT : m
  $LINEAR_UNITS_OF_IMAGE : mm
$END
$COORDINATE_SYSTEM_SET
  $COORDINATE_SYSTEM : EPSG:25832
$END_COORDINATE_SYSTEM
$PHOTO
  $PHOTO_NUM : 7420
  $PHOTO_FILE : D:\flight\7420.tif
  $CAMERA_ID : left
  $ORI_STAT : adjusted
  $EXT_ORI : 12:00:00 01/01/2026
      124.00000   380000.00000   5680000.00000   1000.00000
      1.000000000000   0.000000000000   0.000000000000
      0.000000000000   1.000000000000   0.000000000000
      0.000000000000   0.000000000000   1.000000000000
$END
$CAMERA_DEFINITION
  $ID : left
  $CCD_COLUMNS : 80
  $CCD_ROWS : 100
  $PIXEL_REFERENCE : CenterTopLeft
  $ACTIVE_CALIBRATION : 2
  $CALIBRATION_SET :
    $ID : 2
    $CCD_INTERIOR_ORIENTATION :
      0 -250 39.5
      -250 0 49.5
    $FOCAL_LENGTH : 124
    $PRINCIPAL_POINT_PPA : 0.01 -0.02
    $DISTORTION_TYPE : Polynomial
    $DISTORTION_COEFFICIENTS :
      0 0.001 0.0001
    $END
$END
"""
PIX4D = """fileName imageWidth imageHeight
camera matrix K [3x3]
radial distortion [3x1]
tangential distortion [2x1]
camera position t [3x1]
camera rotation R [3x3]
camera model m = K [R|-Rt] X

a.jpg 4608 3456
3952.8 0 2233.4
0 3952.8 1667.9
0 0 1
0.038 -0.017 0.020
0.0024 0.0029
21.5 -29.5 30.8
0.78389904231994589345 -0.62058396220897726892 -0.01943803742353054573
-0.62086105345046738169 -0.78318706257080084043 -0.03390541741516269608
0.00581753884797473961 0.03864674463298682638 -0.99923600083815289352
"""
EXTERNAL = "imageName X Y Z Omega Phi Kappa\na.jpg 21.5 -29.5 30.8 0.5 -0.25 90\nb.jpg 31.5 -29.5 30.8 0.5 -0.25 90\n"
INTERNAL = """Pix4D camera calibration file 0
#Focal Length mm assuming a sensor width of 17.5x13.125mm
F 15.01
Px 8.48
Py 6.33
K1 0.038
K2 -0.0175
K3 0.0205
T1 0.0024
T2 0.0029
"""
MATRIX = "a.jpg 4000 0 2300 10 0 -4000 1700 20 0 0 -1 30\n"
OPENSFM = [{
    "cameras": {"c": {"projection_type": "brown", "width": 4000, "height": 3000, "focal_x": 0.8, "focal_y": 0.8, "c_x": 0.01, "c_y": 0.0, "k1": -0.02, "k2": 0.01, "p1": 0, "p2": 0, "k3": 0}},
    "shots": {"a.jpg": {"rotation": [3.14, 0.0, 0.1], "translation": [-10.0, 20.0, 80.0], "camera": "c"}},
    "points": {"7": {"color": [1, 2, 3], "coordinates": [12.0, 18.0, 1.0]}},
    "reference_lla": {"latitude": 52.01, "longitude": 4.36, "altitude": 10.0},
}]  # fmt: skip
BINGO = "ORIA a 458000.0 5428000.0 900.0 1.5 -0.5 100.25\nORIA b 458100.0 5428000.0 900.0 1.5 -0.5 100.25\nCORD 1 458010.0 5428010.0 110.0\n"
GEOIN = "CAPA 1 0 15.0\n"
PATB = (
    "a 15.000 458000.0 5428000.0 900.0 1 0 0\n0 1 0 0 0 1\nb 15.000 458100.0 5428000.0 900.0 1 0 0 0 1 0 0 0 1\n-99\n"
)
ISAT_CAMERA = """begin camera_parameters c(1)
    focal_length:                      15.005
    ppac:                              0.0279 -0.0218
    film_format:                       13.12 17.5
    lens_distortion_flag:              off
    pixel_size:                        3.79774 3.79774
    image_size_in_pixels:              3456 4608
    photo_coord_sys_orientation:       1
    photo_coord_sys_origin:            1727.5 2303.5
end camera_parameters
"""
ISAT_PHOTO = """begin photo_parameters 1_1\tstrip_id 1
 camera_name:\tc(1)
 camera_orientation:\t0
 image_id:\tD:\\flight\\a.jpg
 EO_parameters:\t1000.0\t2000.0\t300.0\t0.0\t0.0\t90.0
end photo_parameters
"""
OPK = "name,x,y,z,omega,phi,kappa\na.jpg,458000,5428000,900,0.5,-0.25,90\n"
TABLE = """# crs: EPSG:25832+7837
point,x,y,z,sigma_xy,sigma_z,role,image,col,row,sigma_px
a,458010.5,5428020.25,112.125,0.01,0.02,control,s1.jpg,100.5,200.25,0.3
a,,,,,,,s2.jpg,300,40,
b,458110.5,5428120.25,113.5,,,check,s1.jpg,7,8,
"""
GCP_LIST = "EPSG:25832\n458010.5 5428020.25 112.125 100 199.75 s1.jpg\n458110.5 5428120.25 nan 6.5 7.5 s1.jpg CHK-b\n"
MARKERS = """<?xml version="1.0" encoding="UTF-8"?>
<document version="1.2.0"><chunk>
  <cameras><camera id="0" label="s1.jpg"/><camera id="1" label="s2.jpg"/></cameras>
  <markers next_id="4"><marker id="0" label="a"><reference x="458010.5" y="5428020.25" z="112.125" sx="0.01" sy="0.012" sz="0.02" enabled="1"/></marker></markers>
  <frames><frame id="0"><markers><marker marker_id="0"><location camera_id="0" pinned="1" x="100.5" y="200.25"/></marker></markers></frame></frames>
  <reference>EPSG:25832</reference><settings><property name="accuracy_markers" value="0.005"/></settings>
</chunk></document>
"""
POINTS, MARKS = (
    "label,x,y,z,h,v\na,458010.5,5428020.25,112.125,0.01,0.02\n",
    "s1.jpg,a,100.5,200.25,0.5\ns2.jpg,a,300,40,1.0\n",
)
XMP = """<?xpacket begin="" id="W5M0MpCehiHzreSzNTczkc9d"?><x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description rdf:about="" xmlns:drone-dji="http://www.dji.com/drone-dji/1.0/" xmlns:Camera="http://pix4d.com/camera/1.0" drone-dji:AltitudeType="RtkAlt"
 drone-dji:GpsLatitude="+52.0116012" drone-dji:GpsLongitude="+4.3571034" drone-dji:AbsoluteAltitude="+123.456" drone-dji:RelativeAltitude="+80.013"
 drone-dji:GimbalRollDegree="+0.00" drone-dji:GimbalYawDegree="-93.40" drone-dji:GimbalPitchDegree="-89.90" drone-dji:RtkFlag="50" drone-dji:RtkStdLon="0.01105"
 drone-dji:RtkStdLat="0.01220" drone-dji:RtkStdHgt="0.02518" drone-dji:DewarpData="2021-11-24;8180.5,8180.5,12.5,-7.25,-0.0411,0.0201,0.0011,-0.0004,-0.0302">
<Camera:PrincipalPoint>6.4,4.2</Camera:PrincipalPoint><Camera:PerspectiveDistortion><rdf:Seq><rdf:li>-0.1</rdf:li><rdf:li>0.02</rdf:li></rdf:Seq></Camera:PerspectiveDistortion>
</rdf:Description></rdf:RDF></x:xmpmeta><?xpacket end="w"?>"""

Sound = tuple[Path, Callable[[], Any]]


def delivered_files(folder: Path) -> dict[str, Sound]:
    """Kind → a sound file, and what reads it with those beside it; all in folders of their own below `folder`."""
    return orientations(folder) | control_points(folder) | photographs(folder)


def orientations(folder: Path) -> dict[str, Sound]:
    options = {"cameras": str(_written(folder / "delivered" / "cameras", {"cameras.json": json.dumps(CAMERAS)}))}
    formats: Mapping[str, tuple[str, Mapping[str, str], Mapping[str, str]]] = {
        "inpho": ("inpho", {"block.prj": INPHO}, {}),
        "opensfm": ("opensfm", {"reconstruction.json": json.dumps(OPENSFM)}, {}),
        "pix4d": ("pix4d", {"p_calibrated_camera_parameters.txt": PIX4D, "p_offset.xyz": "458000 5428000 0\n"}, {}),
        "pix4d places": ("pix4d", {"p_calibrated_external_camera_parameters.txt": EXTERNAL, "p_pix4d_calibrated_internal_camera_parameters.cam": INTERNAL}, {}),
        "pix4d matrices": ("pix4d", {"p_pmatrix.txt": MATRIX}, {}),
        "bingo": ("bingo", {"itera.dat": BINGO, "geoin.dat": GEOIN}, options),
        "patb": ("patb", {"patb.ori": PATB}, options),
        "isat": ("isat", {"p_photo.ssk": ISAT_PHOTO, "p_camera.ssk": ISAT_CAMERA}, {}),
        "opk": ("opk", {"photos.csv": OPK}, options),
    }  # fmt: skip
    found: dict[str, Sound] = {}
    target = CRS("EPSG:25832")
    for kind, (name, texts, given) in formats.items():
        first = _written(folder / "delivered" / kind, texts)
        read = partial(read_orientation, name, OrientationFile(first, given, lambda _: SIZE, target))
        found[kind] = first, read
        for beside in list(texts)[1:]:
            found[f"{kind}: {beside}"] = first.with_name(beside), read
    return found


def control_points(folder: Path) -> dict[str, Sound]:
    texts = {"points table": TABLE, "gcp_list.txt": GCP_LIST, "markers.xml": MARKERS}
    found: dict[str, Sound] = {}
    for kind, text in texts.items():
        path = _written(folder / "control" / kind, {kind.replace(" ", "_"): text})
        found[kind] = path, partial(read_control_points, path)
    path = _written(folder / "control" / "pix4d", {"gcp.csv": POINTS, "gcp_marks.csv": MARKS})
    return found | {
        "pix4d points": (path, partial(read_pix4d_points, path)),
        "pix4d marks": (path.with_name("gcp_marks.csv"), partial(read_pix4d_points, path)),
    }


def photographs(folder: Path) -> dict[str, Sound]:
    """A JPEG and a TIFF with EXIF and XMP: what is changed is mostly these."""
    tags = Image.Exif()
    tags[ExifTags.Base.Make], tags[ExifTags.Base.Model] = "DJI", "FC6310"
    tags.get_ifd(ExifTags.IFD.Exif).update({ExifTags.Base.FocalLength: 8.8, ExifTags.Base.FocalLengthIn35mmFilm: 24})
    tags.get_ifd(ExifTags.IFD.GPSInfo).update(
        {
            ExifTags.GPS.GPSLatitudeRef: "N", ExifTags.GPS.GPSLatitude: (52.0, 0.0, 36.5), ExifTags.GPS.GPSLongitudeRef: "E",
            ExifTags.GPS.GPSLongitude: (4.0, 21.0, 25.5), ExifTags.GPS.GPSAltitudeRef: b"\0", ExifTags.GPS.GPSAltitude: 100.25,
        }
    )  # fmt: skip
    place = folder / "photographs"
    place.mkdir()
    picture = Image.fromarray(np.zeros((16, 16, 3), np.uint8))
    picture.save(place / "a.jpg", exif=tags, xmp=XMP.encode())
    picture.save(place / "a.tif", exif=tags, tiffinfo={700: XMP.encode()})
    return {f"EXIF and XMP: {p.name}": (p, partial(photo_metadata, p)) for p in sorted(place.iterdir())}


def _written(folder: Path, texts: Mapping[str, str]) -> Path:
    """The files in the folder; the path of the first."""
    folder.mkdir(parents=True)
    for name, text in texts.items():
        (folder / name).write_text(text)
    return folder / next(iter(texts))
