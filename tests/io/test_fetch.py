from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from cityflow.errors import CatalogError
from cityflow.io import fetch
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.fetch import local_file


class Trickle(BaseHTTPRequestHandler):
    """A byte every 50 ms, without end."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "100000")
        self.end_headers()
        for _ in range(2000):
            self.wfile.write(b"x")
            time.sleep(0.05)

    do_HEAD = do_GET

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture
def trickling() -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Trickle)
    server.daemon_threads = True
    server.handle_error = lambda *_: None  # type: ignore[method-assign]
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


def test_a_server_that_trickles_holds_no_command(trickling: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fetch, "READ_S", 1.0)
    start = time.monotonic()
    with (
        pytest.raises(CatalogError, match=r"a\.laz: cannot be read \(ConnectionError: \d+ bytes"),
        local_file(f"{trickling}/a.laz"),
    ):
        pass
    assert time.monotonic() - start < 30, "all of it takes 100 s"


def test_a_catalog_that_trickles_holds_no_command(trickling: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fetch, "SMALL_S", 0.3)
    start = time.monotonic()
    with pytest.raises(CatalogError, match="Timeout"):
        read_catalog(f"{trickling}/collection.json")
    assert time.monotonic() - start < 30, "all of it takes 100 s"
