"""The server gives out files of the run that it was told, whole and in parts, and nothing else."""

from __future__ import annotations

import http.client
import threading
from collections.abc import Iterator

import pytest

from cityflow.viewer.server import path_of, server_for, span_of

FILES = {
    "view/index.html": b"<p>page",
    "products/tiles3d/a b.glb": bytes(range(100)),
    "products/t.jpg": b"\xff\xd8",
    "run.json": b"secret",
}


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    server = server_for(FILES.get, "runs/x", "127.0.0.1", 0)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.server_address[1]
    server.shutdown()
    server.server_close()


def _get(port: int, target: str, method: str = "GET", **headers: str) -> tuple[int, bytes, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    connection.putrequest(method, target, skip_host=False)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    found = answer.status, answer.read(), dict(answer.getheaders())
    connection.close()
    return found


@pytest.mark.parametrize(
    ("target", "kind"),
    [
        ("/view/index.html", "text/html; charset=utf-8"),
        ("/products/tiles3d/a%20b.glb", "model/gltf-binary"),
        ("/products/t.jpg?v=1", "image/jpeg"),
    ],
)
def test_files_come_with_their_type(port: int, target: str, kind: str) -> None:
    status, body, headers = _get(port, target)
    assert (status, headers["Content-Type"]) == (200, kind)
    assert body in FILES.values()
    status, none, headers = _get(port, target, method="HEAD")
    assert (status, none, headers["Content-Length"]) == (200, b"", str(len(body)))


@pytest.mark.parametrize(
    "target",
    [
        "/run.json",
        "/view/../run.json",
        "/view/%2e%2e/run.json",
        "//run.json",
        "/products/../run.json",
        "/etc/passwd",
        "/view/..%2frun.json",
        "/view/missing",
        "/view\\..\\run.json",
    ],
)
def test_nothing_else_is_served(port: int, target: str) -> None:
    status, body, _ = _get(port, target)
    assert status == 404
    assert b"secret" not in body


def test_ranges(port: int) -> None:
    whole = FILES["products/tiles3d/a b.glb"]
    status, body, headers = _get(port, "/products/tiles3d/a%20b.glb", Range="bytes=10-19")
    assert (status, body, headers["Content-Range"]) == (206, whole[10:20], "bytes 10-19/100")
    assert _get(port, "/products/tiles3d/a%20b.glb", Range="bytes=-5")[1] == whole[-5:]
    assert _get(port, "/products/tiles3d/a%20b.glb", Range="bytes=95-900")[1] == whole[95:]
    status, _, headers = _get(port, "/products/tiles3d/a%20b.glb", Range="bytes=100-")
    assert (status, headers["Content-Range"]) == (416, "bytes */100")
    assert _get(port, "/products/tiles3d/a%20b.glb", Range="bytes=0-1,5-6")[:2] == (200, whole), (
        "several ranges: all of it"
    )


def test_the_page_learns_how_the_run_is_named_and_the_root_leads_to_it(port: int) -> None:
    assert _get(port, "/view/served.json")[1] == b'{"run": "runs/x"}'
    status, _, headers = _get(port, "/")
    assert (status, headers["Location"]) == (302, "/view/index.html")


def test_a_taken_port_is_an_error(port: int) -> None:
    with pytest.raises(OSError, match="in use"):
        server_for(FILES.get, "x", "127.0.0.1", port)


def test_paths_and_spans() -> None:
    assert path_of("/view/") == "view/index.html"
    assert path_of("/report.html#x") == "report.html"
    assert path_of("/reports/secret") is None
    assert span_of("bytes=0-0", 1) == (0, 1)
    with pytest.raises(ValueError, match="bytes"):
        span_of("bytes=3-2", 10)
