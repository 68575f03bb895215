"""The server gives out files of the run that it was told, whole and in parts, and nothing else."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Iterator
from functools import partial

import pytest

from cityflow.viewer.cities_page import cities_page
from cityflow.viewer.server import Served, path_of, server_for, span_of

FILES = {
    "view/index.html": b"<p>page",
    "products/tiles3d/a b.glb": bytes(range(100)),
    "products/t.jpg": b"\xff\xd8",
    "run.json": b"secret",
}


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    server = server_for([Served("x", "runs/x", FILES.get)], "127.0.0.1", 0)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.server_address[1]
    server.shutdown()
    server.server_close()


def _get(port: int, target: str, method: str = "GET", **headers: str) -> tuple[int, bytes, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
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
        server_for([Served("x", "x", FILES.get)], "127.0.0.1", port)


def test_paths_and_spans() -> None:
    assert path_of("/view/") == "view/index.html"
    assert path_of("/report.html#x") == "report.html"
    assert path_of("/reports/secret") is None
    assert span_of("bytes=0-0", 1) == (0, 1)
    with pytest.raises(ValueError, match="bytes"):
        span_of("bytes=3-2", 10)


@pytest.fixture(scope="module")
def several() -> Iterator[int]:
    city = {"title": "Old <Town>", "verdict": "All 3 buildings are modelled as asked.", "texture_pixels": {"raw": 9, "rectified": 8},
            "pictures": [{"path": "pictures/0.jpg", "title": "Models"}, {"path": "pictures/1.jpg", "title": "From the south"}]}  # fmt: skip
    files = {"view/index.html": b"other", "view/data/city.json": json.dumps(city).encode(), "run.json": b"secret"}
    runs = [Served("x", "runs/x", FILES.get), Served("old town", "runs/old town", files.get)]
    server = server_for(runs, "127.0.0.1", 0, partial(cities_page, runs))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.server_address[1]
    server.shutdown()
    server.server_close()


def test_several_runs_stand_below_their_names_beside_a_page_that_leads_to_them(several: int) -> None:
    assert _get(several, "/x/view/index.html")[1] == b"<p>page"
    assert _get(several, "/old%20town/view/index.html")[1] == b"other"
    assert json.loads(_get(several, "/old%20town/view/served.json")[1]) == {"run": "runs/old town", "cities": "/"}
    assert _get(several, "/old%20town")[2]["Location"] == "/old%20town/view/index.html"
    status, page, headers = _get(several, "/")
    assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    text = page.decode()
    assert "Old &lt;Town&gt;" in text
    assert (text.count("Textured."), text.count("Without textures.")) == (1, 1)
    assert 'src="old%20town/view/pictures/1.jpg"' in text
    assert {'href="old%20town/view/index.html"', 'href="old%20town/report.html"', 'href="x/view/index.html"'} <= set(
        text.replace(">", " ").split()
    )


@pytest.mark.parametrize(
    "target",
    [
        "/x/run.json",
        "/old%20town/../x/run.json",
        "/run.json",
        "/view/index.html",
        "/x/../run.json",
        "/other/view/index.html",
    ],
)
def test_of_several_runs_nothing_else_is_served(several: int, target: str) -> None:
    status, body, _ = _get(several, target)
    assert status == 404
    assert b"secret" not in body


def test_one_run_says_of_no_others(port: int) -> None:
    assert json.loads(_get(port, "/view/served.json")[1]) == {"run": "runs/x"}
    assert _get(port, "/")[2]["Location"] == "/view/index.html"


def test_a_page_from_elsewhere_reads_nothing(port: int) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request("GET", "/view/index.html", headers={"Host": "city.example"})
    answer = connection.getresponse()
    assert (answer.status, b"page" in answer.read()) == (403, False)
    connection.close()
