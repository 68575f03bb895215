"""Windows of rasters on a web server and an object store: only the parts that are needed are read."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import boto3
import numpy as np
import pytest
from moto.server import ThreadedMotoServer

from cityflow.core.arrays import ByteArray
from cityflow.core.grid import Grid
from cityflow.errors import CatalogError
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import read_window, write_cog
from cityflow.io.rasters.raster_header import read_raster_header
from cityflow.io.rasters.remote_raster import raster_file

RD = resolve("EPSG:28992")
WHOLE = Grid(85000.0, 447500.0, 0.25, 4000, 4000)
PART = Grid(85500.0, 447000.0, 0.25, 200, 200)


@cache
def noise() -> ByteArray:
    return np.random.default_rng(1).integers(0, 255, WHOLE.shape).astype(np.uint8)


@pytest.fixture(scope="module")
def ortho() -> bytes:
    return write_cog(noise(), WHOLE, RD)


class Server(ThreadingHTTPServer):
    """Serves one file, with or without ranges, and counts what it gives."""

    daemon_threads = True

    def __init__(self, data: bytes, ranges: bool) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.data, self.ranges, self.given = data, ranges, 0
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/ortho.tif"


class Handler(BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        self._answer(with_body=True)

    def do_HEAD(self) -> None:
        self._answer(with_body=False)

    def _answer(self, with_body: bool) -> None:
        data, wanted = self.server.data, re.match(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        if not self.path.startswith("/ortho.tif"):
            self.send_error(404)
            return
        if wanted and self.server.ranges:
            first, last = int(wanted[1]), min(int(wanted[2] or len(data) - 1), len(data) - 1)
            self.send_response(206)
            self.send_header("Content-Range", f"bytes {first}-{last}/{len(data)}")
            data = data[first : last + 1]
        else:
            self.send_response(200)
        if self.server.ranges:
            self.send_header("Accept-Ranges", "bytes")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        if with_body:
            self.server.given += len(data)
            self.wfile.write(data)

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture
def servers() -> Iterator[list[Server]]:
    made: list[Server] = []
    yield made
    for server in made:
        server.shutdown()
        server.server_close()


def test_a_window_takes_a_small_part_of_the_file(ortho: bytes, servers: list[Server]) -> None:
    servers.append(server := Server(ortho, ranges=True))
    with raster_file(server.url) as name:
        assert read_raster_header(name).shape == WHOLE.shape
        assert np.array_equal(read_window(name, PART, RD, resampling="nearest"), noise()[WHOLE.slices(PART)])
    assert server.given < len(ortho) / 8


def test_a_server_without_ranges_gives_the_whole_file(ortho: bytes, servers: list[Server]) -> None:
    servers.append(server := Server(ortho, ranges=False))
    with raster_file(server.url) as name:
        assert np.array_equal(read_window(name, PART, RD, resampling="nearest"), noise()[WHOLE.slices(PART)])


def test_a_file_that_was_replaced_is_read_anew(ortho: bytes, servers: list[Server]) -> None:
    servers.append(server := Server(ortho, ranges=True))
    for change in (0, 1):
        server.data = write_cog(255 - noise(), WHOLE, RD) if change else ortho
        with raster_file(server.url) as name:
            found = read_window(name, PART, RD, resampling="nearest")
        assert np.array_equal(found, 255 - noise()[WHOLE.slices(PART)] if change else noise()[WHOLE.slices(PART)])


def test_what_is_not_there_is_named(servers: list[Server]) -> None:
    servers.append(server := Server(b"", ranges=True))
    with (
        pytest.raises(CatalogError, match=r"/gone\.tif: cannot be read"),
        raster_file(server.url.replace("ortho", "gone")),
    ):
        pass


def test_windows_from_an_object_store(ortho: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    try:
        host, port = server.get_host_and_port()
        for name, value in {
            "AWS_ENDPOINT_URL": f"http://{host}:{port}", "AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_DEFAULT_REGION": "us-east-1",
        }.items():  # fmt: skip
            monkeypatch.setenv(name, value)
        client = boto3.client("s3")
        client.create_bucket(Bucket="city-orthos")
        client.put_object(Bucket="city-orthos", Key="2024/ortho.tif", Body=ortho)
        with raster_file("s3://city-orthos/2024/ortho.tif") as name:
            assert name == "/vsis3/city-orthos/2024/ortho.tif"
            assert np.array_equal(read_window(name, PART, RD, resampling="nearest"), noise()[WHOLE.slices(PART)])
        client.put_object(Bucket="city-orthos", Key="2024/ortho.tif#2", Body=write_cog(255 - noise(), WHOLE, RD))
        with raster_file("s3://city-orthos/2024/ortho.tif#2") as name:
            assert np.array_equal(read_window(name, PART, RD, resampling="nearest"), 255 - noise()[WHOLE.slices(PART)])
    finally:
        server.stop()


def test_a_local_file_is_itself(ortho: bytes, tmp_path: Path) -> None:
    file = tmp_path / "ortho.tif"
    file.write_bytes(ortho)
    with raster_file(str(file)) as name:
        assert name == str(file)
    with pytest.raises(CatalogError, match="no such file"), raster_file(str(tmp_path / "gone.tif")):
        pass
