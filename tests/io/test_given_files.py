"""Files without end, and texts that unfold without end: each is a message with file, value and remedy."""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.credentials import stripped, without_credentials
from cityflow.core.points import PointCloud
from cityflow.errors import CatalogError, CityflowError
from cityflow.io.crs import resolve
from cityflow.io.given_files import json_of, yaml_of
from cityflow.io.images.image_header import image_header
from cityflow.io.orientation.bundler import read_bundler
from cityflow.io.orientation.camera_table import read_camera_table
from cityflow.io.orientation.colmap import read_colmap
from cityflow.io.orientation.metashape import read_metashape
from cityflow.io.orientation.oriented_images import in_order
from cityflow.io.points.las_header import read_header
from cityflow.io.points.las_write import write_points
from cityflow.io.rasters.raster_header import read_raster_header
from cityflow.io.tables.outline_file import read_outlines
from cityflow.io.tables.vector import read_layer
from cityflow.runs.setting_text import read_tree

BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{c}: &{c} [{', '.join([f'*{p}'] * 9)}]\n" for p, c in zip("abcdefgh", "bcdefghi", strict=True)
)

YAML = {
    "bomb": BOMB, "deep": "name: " + "[" * 50_000, "itself": "name: &a [*a]", "in a section": "surface: &a {cell_m: *a}",
    "date": "name: 0000-00-00", "digits": "a: " + "9" * 6000, "hexadecimal": "a: 0x" + "f" * 600, "tag": "a: !!python/object/apply:os.system [ls]",
    "binary": '!!binary "a"', "list as key": "? [1]\n: 2", "number as key": "1: 2", "nothing as key": "null: 2", "zero": "a: \0",
}  # fmt: skip


@pytest.mark.parametrize("text", YAML.values(), ids=YAML.keys())
def test_odd_workflows_are_one_line_with_the_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "w.yaml"
    path.write_text(text)
    with pytest.raises(CityflowError) as refused:
        read_tree(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert " → " in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_workflows_may_say_is_read() -> None:
    assert yaml_of("a: &a {b: [1, 2.5, x, null, true]}\nc: *a\n") == {
        "a": (b := {"b": [1, 2.5, "x", None, True]}),
        "c": b,
    }
    assert json_of('{"a": [1, 2]}') == {"a": [1, 2]}
    for text in ("[" * 50_000, "[1"):
        with pytest.raises(ValueError):  # noqa: PT011 - of json's own
            json_of(text)


READERS: dict[str, Callable[[Path], Any]] = {
    "workflow": read_tree, "las": read_header, "image": image_header, "raster": read_raster_header, "cameras": read_camera_table,
    "metashape": lambda p: read_metashape(p, None), "bundler": lambda p: read_bundler(p, lambda _: (64, 64)), "vector": read_layer,
}  # fmt: skip


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS.keys())
@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_what_is_no_plain_file_is_not_waited_for(tmp_path: Path, reader: Callable[[Path], Any], kind: str) -> None:
    path = tmp_path / "given"
    (tmp_path / "list.txt").write_text("a.jpg\n")
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    with pytest.raises(CityflowError, match=str(path)):
        reader(path)


def test_a_colmap_model_of_pipes_is_refused(tmp_path: Path) -> None:
    for name in ("cameras.txt", "images.txt"):
        os.mkfifo(tmp_path / name)
    with pytest.raises(CatalogError, match="this is a pipe"):
        read_colmap(tmp_path)


@pytest.mark.parametrize("centre", [(1e300, 0, 0), (0, np.inf, 0), (0, 0, np.nan)])
def test_images_that_are_nowhere_are_left_out(centre: tuple[float, float, float]) -> None:
    camera = Camera(64, 64, 50.0, 50.0, 32.0, 32.0)
    kept, out = in_order(
        [OrientedImage(n, camera, np.eye(3), np.array(c)) for n, c in (("a", centre), ("b", (5e6, 0, 1)))]
    )
    assert [i.name for i in kept] == ["b"]
    assert "no place on Earth" in out[0].problem


def test_a_metashape_file_in_an_unknown_encoding_is_named(tmp_path: Path) -> None:
    path = tmp_path / "m.xml"
    path.write_bytes(b'<?xml version="1.0" encoding="klingon"?><document/>')
    with pytest.raises(CatalogError, match="klingon"):
        read_metashape(path, None)


@pytest.mark.parametrize("counts", ["99999999999999 1", "1 99999999999999", "-1 -1"])
def test_a_bundler_file_that_promises_too_much_is_refused(tmp_path: Path, counts: str) -> None:
    path = tmp_path / "bundle.out"
    path.write_text(f"# Bundle file v0.3\n{counts}\n")
    (tmp_path / "list.txt").write_text("a.jpg\n")
    with pytest.raises(CatalogError, match=counts.split()[0]):
        read_bundler(path, lambda _: (64, 64))


def png(width: int, height: int) -> bytes:
    """Little more than a header."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize("side", [65535, 11000])
def test_pictures_that_would_fill_the_memory_are_refused(tmp_path: Path, side: int) -> None:
    (tmp_path / "a.png").write_bytes(png(side, side))
    with pytest.raises(CatalogError, match=r"a\.png: .* is no photograph →"):
        image_header(tmp_path / "a.png")


@pytest.mark.parametrize(("at", "layout"), [(100, "<I"), (243, "<I")])
def test_las_headers_that_announce_endless_records_are_refused(tmp_path: Path, at: int, layout: str) -> None:
    cloud = PointCloud(
        np.random.default_rng(1).random((50, 3)), np.zeros(50, np.uint8), np.ones(50, np.uint8), np.ones(50, np.uint8)
    )
    data = bytearray(write_points(cloud, crs=None))
    path = tmp_path / "a.laz"
    path.write_bytes(data)
    assert read_header(path).points == 50
    struct.pack_into(layout, data, at, 0x7FFFFFFF)
    path.write_bytes(data)
    with pytest.raises(CatalogError, match=r"2,147,483,647.* records"):
        read_header(path)


def test_a_chunk_table_that_counts_more_chunks_than_bytes_is_refused(tmp_path: Path) -> None:
    """Found by benchmarks/fuzz_inputs.py: the decoder made room for all of them, and the process was gone."""
    cloud = PointCloud(np.random.default_rng(1).random((50, 3)), *[np.ones(50, np.uint8) for _ in range(3)])
    data = bytearray(write_points(cloud, crs=None))
    (start,) = struct.unpack_from("<I", data, 96)
    (table,) = struct.unpack_from("<q", data, start)
    struct.pack_into("<I", data, table + 4, 0x7FFFFFFF)
    (tmp_path / "a.laz").write_bytes(data)
    with pytest.raises(CatalogError, match=r"a\.laz"):
        read_header(tmp_path / "a.laz")


def test_geometries_with_infinite_coordinates_are_none(tmp_path: Path) -> None:
    rings = ([[[9, 52], [9.1, 52], [9.1, 52.1], [9, 52]]], [[[float("inf"), 0], [1, 0], [1, 1], [float("inf"), 0]]])
    features = [{"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": r}} for r in rings]
    path = tmp_path / "o.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    layer = read_layer(path)
    assert shapely.is_missing(layer.geometry).tolist() == [False, True]
    assert layer.endless == {1: float("inf")}
    _, notes = read_outlines(path, None, None, resolve("EPSG:25832"))
    assert any("no finite number: 1 (feature 2: inf)" in note for note in notes)


def test_addresses_lose_what_nobody_else_may_know() -> None:
    tree = {"a": ["https://joe:pass@host/x?token=12&y=1"], "b": 3, "c": "mail joe@example.org"}
    assert stripped(tree) == {"a": ["https://host/x?token=…&y=1"], "b": 3, "c": "mail joe@example.org"}
    for url in ("s3://bucket/a@b/c", "https://host/x?keyframe", "/home/joe@work/x"):
        assert without_credentials(url) == url
    assert "secret" not in without_credentials(
        "cannot read https://u:secret@h/a?sig=secret&X-Amz-Credential=secret: 403"
    )
