"""The desk's interface beside the files of a run: reads for the page, and the few requests that change something, each with the token."""

from __future__ import annotations

import hmac
import json
import socket
from collections.abc import Iterator, Mapping
from http import HTTPStatus
from ipaddress import ip_address
from typing import Any, NamedTuple, Protocol
from urllib.parse import parse_qsl, urlsplit

from cityflow.errors import CityflowError
from cityflow.viewer.server import TYPES, FileHandler, is_local

BELOW = "/desk/"
TOKEN = "X-Desk-Token"
MOST_BYTES = 1_000_000
"""Of a request: a drawn outline has some hundreds."""

Json = Any


class Refusal(Exception):
    """A request that is answered with a status and a reason."""

    def __init__(self, status: HTTPStatus, reason: str) -> None:
        self.status, self.reason = status, reason
        super().__init__(reason)


class Answer(NamedTuple):
    """Contents, and their type as a file's ending."""

    data: bytes
    ending: str = "json"


class Desk(Protocol):
    """What the page may ask for."""

    token: str
    """Whoever changes anything knows it."""
    is_open: bool
    """Whether other machines reach the server."""

    def read(self, name: str, query: Mapping[str, str]) -> Answer | None:
        """An answer that changes nothing; None where there is no such request."""

    def change(self, name: str, body: Mapping[str, Json]) -> Json | None:
        """Do something, and tell what was done; None where there is no such request. Raises CityflowError, Refusal."""

    def events(self) -> Iterator[tuple[str, Json] | None]:
        """What happens, as it happens; None now and then where nothing does."""


def is_own_name(host: str) -> bool:
    """Whether a request names this machine by an address or by its own name: no page from elsewhere can make another name lead here.

    >>> is_own_name("192.168.1.7:8124"), is_own_name("[fe80::1]:80"), is_own_name("city.example:8124")
    (True, True, False)
    """
    name = urlsplit(f"//{host}").hostname or ""
    try:
        ip_address(name)
    except ValueError:
        return name in (socket.gethostname().lower(), "localhost")
    return True


class DeskHandler(FileHandler):
    """One request; `desk` belongs to the server."""

    desk: Desk

    def do_GET(self) -> None:
        if not self.path.startswith(BELOW):
            super().do_GET()
            return
        self._answered(self._get)

    def do_POST(self) -> None:
        # what was not read of a refused request would be taken for the next one
        self.close_connection = True
        self._answered(self._post)

    def is_reached_as(self, host: str) -> bool:
        return is_local(host) or (self.desk.is_open and is_own_name(host))

    def _get(self) -> None:
        self._refuse_strangers()
        target = urlsplit(self.path)
        name = target.path.removeprefix(BELOW)
        if name == "events":
            self._tell()
            return
        found = self.desk.read(name, dict(parse_qsl(target.query)))
        if found is None:
            raise Refusal(HTTPStatus.NOT_FOUND, "the desk has no such answer")
        self.send(HTTPStatus.OK, found.data, {"Content-Type": TYPES[found.ending], "Cache-Control": "no-store"}, True)

    def _post(self) -> None:
        self._refuse_strangers()
        if not hmac.compare_digest(self.headers.get(TOKEN, "").encode(), self.desk.token.encode()):
            raise Refusal(HTTPStatus.FORBIDDEN, "this needs the address that `cityflow desk` printed, with its token")
        if self.headers.get("Content-Type", "").split(";")[0].strip() != "application/json":
            raise Refusal(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "give JSON")
        found = self.desk.change(self.path.removeprefix(BELOW) if self.path.startswith(BELOW) else "", self._body())
        if found is None:
            raise Refusal(HTTPStatus.NOT_FOUND, "the desk does no such thing")
        self.send(HTTPStatus.OK, _text(found), {"Content-Type": TYPES["json"], "Cache-Control": "no-store"}, True)

    def _refuse_strangers(self) -> None:
        """Neither another name of this machine nor a page of another origin."""
        host = self.headers.get("Host", "")
        if not self.is_reached_as(host):
            raise Refusal(HTTPStatus.FORBIDDEN, "only reached as 127.0.0.1 or localhost")
        origin = self.headers.get("Origin")
        if origin is not None and origin != f"http://{host}":
            raise Refusal(HTTPStatus.FORBIDDEN, "asked by a page from elsewhere")
        if self.headers.get("Sec-Fetch-Site", "same-origin") not in ("same-origin", "none"):
            raise Refusal(HTTPStatus.FORBIDDEN, "asked by a page from elsewhere")

    def _body(self) -> Mapping[str, Json]:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > MOST_BYTES:
            raise Refusal(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"at most {MOST_BYTES:,} bytes, whose number is told")
        try:
            found = json.loads(self.rfile.read(int(length)))
        except ValueError as error:
            raise Refusal(HTTPStatus.BAD_REQUEST, f"this is no JSON ({error})") from error
        if not isinstance(found, dict):
            raise Refusal(HTTPStatus.BAD_REQUEST, "give an object")
        return found

    def _answered(self, request: Any) -> None:
        try:
            request()
        except Refusal as refusal:
            self._refuse(refusal.status, refusal.reason)
        except CityflowError as error:
            self._refuse(HTTPStatus.CONFLICT, str(error))
        except OSError as error:
            self._refuse(HTTPStatus.INTERNAL_SERVER_ERROR, f"a file cannot be read or written ({error})")

    def _refuse(self, status: HTTPStatus, reason: str) -> None:
        self.send(status, _text({"error": reason}), {"Content-Type": TYPES["json"], "Cache-Control": "no-store"}, True)

    def _tell(self) -> None:
        """Server-sent events, as long as the page listens."""
        self.close_connection = True
        try:
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", "text/event-stream")
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            for event in self.desk.events():
                told = (
                    b": nothing new\n\n"
                    if event is None
                    else b"event: %s\ndata: %s\n\n" % (event[0].encode(), _text(event[1]))
                )
                self.wfile.write(told)
                self.wfile.flush()
        except (BrokenPipeError, ConnectionResetError):
            return


def _text(value: Json) -> bytes:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode()
