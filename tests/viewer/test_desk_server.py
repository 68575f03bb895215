"""The desk answers its own page, and changes something only for those who know the token; everything else is refused."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from cityflow.errors import RunError
from cityflow.viewer.desk_server import MOST_BYTES, Answer, DeskHandler
from cityflow.viewer.server import Served, server_for

TOKEN = "only for this test"
JSON = {"Content-Type": "application/json"}
FILES = {"view/index.html": b"<p>page", "run.json": b"secret"}


class ToyDesk:
    token = TOKEN
    is_open = False

    def __init__(self) -> None:
        self.done: list[tuple[str, Any]] = []

    def read(self, name: str, query: Mapping[str, str]) -> Answer | None:
        return Answer(json.dumps({"unit": query.get("unit")}).encode()) if name == "outline" else None

    def change(self, name: str, body: Mapping[str, Any]) -> Any:
        if name == "undo":
            raise RunError("this edit is gone", where="edits.gpkg", remedy="look at the list")
        if name != "note":
            return None
        self.done.append((name, body))
        return {"noted": True}

    def events(self) -> Iterator[tuple[str, Any] | None]:
        yield "job", {"number": 1}
        yield None
        yield "changed", {}


@pytest.fixture
def desk() -> ToyDesk:
    return ToyDesk()


@pytest.fixture
def port(desk: ToyDesk) -> Iterator[int]:
    handler = type("Handler", (DeskHandler,), {"desk": desk})
    server = server_for([Served("x", "runs/x", FILES.get, {"desk": True})], "127.0.0.1", 0, base=handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.server_address[1]
    server.shutdown()
    server.server_close()


def ask(port: int, method: str, target: str, body: bytes | None = None, **headers: str) -> tuple[int, Any]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request(method, target, body, {k.replace("_", "-"): v for k, v in headers.items()})
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    return answer.status, json.loads(text) if "json" in answer.headers.get("Content-Type", "") else text


def post(port: int, target: str = "/desk/note", body: bytes = b'{"unit": "a"}', **headers: str) -> tuple[int, Any]:
    given = {"X_Desk_Token": TOKEN, "Content_Type": "application/json", **headers}
    return ask(port, "POST", target, body, **{k: v for k, v in given.items() if v})


def test_the_page_of_the_desk_reads_and_changes(port: int, desk: ToyDesk) -> None:
    assert ask(port, "GET", "/view/index.html")[1] == b"<p>page"
    assert ask(port, "GET", "/view/served.json")[1] == {"run": "runs/x", "desk": True}
    assert ask(port, "GET", "/desk/outline?unit=a%20b") == (200, {"unit": "a b"})
    assert post(port, Origin=f"http://127.0.0.1:{port}") == (200, {"noted": True})
    assert desk.done == [("note", {"unit": "a"})]


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"X_Desk_Token": ""}, 403),
        ({"X_Desk_Token": "guessed"}, 403),
        ({"X_Desk_Token": "grün".encode().decode("latin-1")}, 403),
        ({"Origin": "http://city.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://127.0.0.1:1"}, 403),
        ({"Host": "city.example"}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Content_Type": "text/plain"}, 415),
        ({"Content_Type": ""}, 415),
        ({"Content_Length": str(MOST_BYTES + 1)}, 413),
        ({"Content_Length": "-1"}, 413),
    ],
)
def test_what_is_not_asked_by_its_page_changes_nothing(
    port: int, desk: ToyDesk, headers: dict[str, str], status: int
) -> None:
    found, body = post(port, "/desk/note", b'{"unit": "a"}', **headers)
    assert found == status, body
    assert "error" in body
    assert desk.done == []


def test_the_token_is_in_nothing_that_is_read_without_it(port: int) -> None:
    for target in ("/view/index.html", "/view/served.json", "/desk/outline?unit=a", "/"):
        assert TOKEN.encode() not in json.dumps(str(ask(port, "GET", target)[1])).encode()


@pytest.mark.parametrize("body", [b"", b"{", b"[1]", b"\xff"])
def test_what_is_no_object_is_refused(port: int, desk: ToyDesk, body: bytes) -> None:
    assert post(port, body=body)[0] == 400
    assert desk.done == []


def test_unknown_requests_and_problems_are_told(port: int, desk: ToyDesk) -> None:
    assert post(port, "/desk/delete")[0] == 404
    assert post(port, "/view/index.html")[0] == 404
    assert ask(port, "GET", "/desk/run.json")[0] == 404
    assert ask(port, "PUT", "/desk/note", b"{}", X_Desk_Token=TOKEN)[0] == 501
    status, found = post(port, "/desk/undo")
    assert (status, found["error"]) == (409, "edits.gpkg: this edit is gone → look at the list")
    assert desk.done == []


def test_a_page_from_elsewhere_hears_and_reads_nothing(port: int) -> None:
    for target in ("/desk/outline?unit=a", "/desk/events"):
        assert ask(port, "GET", target, Origin="http://city.example")[0] == 403
        assert ask(port, "GET", target, Host="city.example")[0] == 403
        assert ask(port, "GET", target, Sec_Fetch_Site="same-site")[0] == 403


def test_events_come_as_they_happen(port: int) -> None:
    status, text = ask(port, "GET", "/desk/events")
    assert status == 200
    assert text == b'event: job\ndata: {"number":1}\n\n: nothing new\n\nevent: changed\ndata: {}\n\n'


def test_an_open_desk_is_reached_by_an_address_and_its_own_name_only(port: int, desk: ToyDesk) -> None:
    assert ask(port, "GET", "/desk/outline", Host="192.168.1.7")[0] == 403
    desk.is_open = True
    assert ask(port, "GET", "/desk/outline", Host="192.168.1.7")[0] == 200
    assert ask(port, "GET", "/view/index.html", Host="192.168.1.7")[0] == 200
    assert ask(port, "GET", "/desk/outline", Host="city.example")[0] == 403
