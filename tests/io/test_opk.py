from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cityflow.errors import CatalogError
from cityflow.geometry.rotations import AngleUnit, RotationOrder, from_angles
from cityflow.io.orientation.opk import OpkTable, parsed_columns, read_opk

ROWS = [("a.tif", 100.5, 200.25, 500.0, 1.5, -2.5, 91.0), ("b.tif", 160.5, 201.0, 502.0, 30.0, 10.0, -170.0)]


def _cameras(folder: Path, *more: dict[str, object]) -> Path:
    path = folder / "cameras.json"
    path.write_text(json.dumps([{"id": "c1", "width": 4000, "height": 3000, "focal_px": 3500}, *more]))
    return path


def _table(folder: Path, text: str, columns: str = "", **how: object) -> OpkTable:
    path = folder / "orientation.csv"
    path.write_text(text)
    return OpkTable(path, _cameras(folder), parsed_columns(columns), **how)  # type: ignore[arg-type]


def _lines(sign: str, header: str = "") -> str:
    lines = [header] if header else []
    return "\n".join([*lines, *(sign.join(str(v) for v in row) for row in ROWS)]) + "\n"


FORMS = {
    "commas": (_lines(","), ""),
    "spaces": (_lines("   "), ""),
    "tabs and a comment": ("# made by somebody\n\n" + _lines("\t"), ""),
    "header": (_lines(";", "Image;Easting;Northing;Height;Omega [deg];Phi [deg];Kappa [deg]"), ""),
    "header in a comment": ("# survey\n" + _lines(",", "#Label,X,Y,Z,Omega,Phi,Kappa"), ""),
    "decimal commas": (_lines(";").replace(".", ",").replace(",tif", ".tif"), ""),
    "positions": ("".join(f"{i},{r[4]},{r[5]},{r[6]},{r[1]},{r[2]},{r[3]},{r[0]}\n" for i, r in enumerate(ROWS)),
                  "name=7,x=4,y=5,z=6,omega=1,phi=2,kappa=3"),
    "names": (_lines(",", "Bild,Rechts,Hoch,H,w1,w2,w3"), "name=Bild,x=Rechts,y=Hoch,z=H,omega=w1,phi=w2,kappa=w3"),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_tables(tmp_path: Path, form: str) -> None:
    model = read_opk(_table(tmp_path, *FORMS[form]))
    assert model.left_out == ()
    assert [i.name for i in model.images] == ["a.tif", "b.tif"]
    for image, row in zip(model.images, ROWS, strict=True):
        assert image.centre == pytest.approx(row[1:4])
        omega, phi, kappa = np.radians(row[4:]).tolist()
        assert image.rotation == pytest.approx(from_angles(omega, phi, kappa, RotationOrder.OMEGA_PHI_KAPPA))


@pytest.mark.parametrize("order", RotationOrder)
@pytest.mark.parametrize("unit", AngleUnit)
def test_units_and_orders(tmp_path: Path, order: RotationOrder, unit: AngleUnit) -> None:
    angles = 0.1, -0.2, 0.7
    values = ",".join(str(a / unit.radians) for a in angles)
    image = read_opk(_table(tmp_path, f"a.tif,1,2,3,{values}\n", unit=unit, order=order)).images[0]
    assert image.rotation == pytest.approx(from_angles(*angles, order), abs=1e-12)


def test_cameras_by_column_and_by_pattern(tmp_path: Path) -> None:
    table = _table(tmp_path, "image,x,y,z,omega,phi,kappa,camera\na.tif,1,2,3,0,0,0,c2\nb.tif,1,2,3,0,0,0,c9\n")
    other = {"id": "c2", "width": 2000, "height": 1000, "focal_mm": 50, "pixel_mm": 0.005}
    _cameras(tmp_path, other)
    model = read_opk(table)
    assert [(i.name, i.camera.width, round(i.camera.fx, 6)) for i in model.images] == [("a.tif", 2000, 10_000.0)]
    assert model.pixel_mm == {"a.tif": 0.005}
    assert "'c9'" in model.left_out[0].problem
    table.path.write_text("left_1.tif,1,2,3,0,0,0\nnadir_1.tif,1,2,3,0,0,0\n")
    table.cameras.write_text(json.dumps([
        {"id": "n", "width": 2000, "height": 1000, "focal_px": 1000, "images": "nadir_*"},
        {"id": "l", "width": 3000, "height": 1000, "focal_px": 1000, "images": "left_*|right_*"},
    ]))  # fmt: skip
    assert [(i.name, i.camera.width) for i in read_opk(table).images] == [("left_1.tif", 3000), ("nadir_1.tif", 2000)]


def test_bad_lines_cost_their_image_alone(tmp_path: Path) -> None:
    text = "a.tif,1,2,3,0,0,0\nb.tif,1,2,three,0,0,0\nc.tif,1,2\nd.tif,1,2,3,nan,0,0\n"
    model = read_opk(_table(tmp_path, text))
    assert [i.name for i in model.images] == ["a.tif"]
    assert [o.name for o in model.left_out] == ["b.tif", "c.tif", "d.tif"]
    assert "line 2" in model.left_out[0].problem


def test_what_cannot_be_told_is_said(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="columns not found: kappa"):
        read_opk(_table(tmp_path, "image,x,y,z,omega,phi,angle\na,1,2,3,0,0,0\n"))
    with pytest.raises(CatalogError, match="no column 'Foo'"):
        read_opk(_table(tmp_path, "image,x,y,z,omega,phi,kappa\na,1,2,3,0,0,0\n", "x=Foo"))
    with pytest.raises(CatalogError, match="names no column"):
        parsed_columns("easting=3")
    with pytest.raises(CatalogError, match="cannot be read"):
        read_opk(OpkTable(tmp_path / "none.csv", _cameras(tmp_path), {}))
