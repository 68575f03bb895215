"""Serves the files of runs to a browser on this machine."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import quote, unquote, urlsplit

SERVED = ("view/", "products/", "report.html", "report.json", "report/")
SERVED_AS = "view/served.json"
TYPES = {
    "html": "text/html; charset=utf-8", "js": "text/javascript; charset=utf-8", "css": "text/css; charset=utf-8", "txt": "text/plain; charset=utf-8",
    "json": "application/json", "bin": "application/octet-stream", "glb": "model/gltf-binary", "jpg": "image/jpeg", "png": "image/png",
    "svg": "image/svg+xml", "tif": "image/tiff", "laz": "application/vnd.laszip", "gpkg": "application/geopackage+sqlite3", "vrt": "application/xml",
    "gml": "application/gml+xml", "obj": "model/obj", "mtl": "model/mtl", "jsonl": "application/city+json-seq",
}  # fmt: skip
_RANGE = re.compile(r"bytes=(\d*)-(\d*)$")

Read = Callable[[str], bytes | None]
"""A path in RUN → its contents, or None where there is no such file."""


@dataclass(frozen=True, slots=True)
class Served:
    """A run that is served.

    Attributes
    ----------
    name : first part of its addresses where several are served
    run : how it is named on the command line
    more : what else its page learns of the server
    """

    name: str
    run: str
    read: Read
    more: Mapping[str, Any] = field(default_factory=dict)


def server_for(
    runs: Sequence[Served], host: str, port: int, start: Callable[[], bytes] | None = None, base: type[FileHandler] | None = None
) -> ThreadingHTTPServer:  # fmt: skip
    """A server that is bound, and serves when it is told to.

    Parameters
    ----------
    runs : the first one's files stand at the root, those of others below their names; with `start` those of each below its name
    start : makes the page from which several are reached
    base : answers requests, where more than files is asked for

    Raises
    ------
    OSError
        The port is taken.
    """
    server = _Server((host, port), _handler(runs, start, base or FileHandler))
    server.daemon_threads = True
    return server


class _Server(ThreadingHTTPServer):
    # SO_REUSEADDR would let a second server share a port on some systems, and neither would say so
    allow_reuse_address = False
    request_queue_size = 64


def _handler(
    runs: Sequence[Served], start: Callable[[], bytes] | None, base: type[FileHandler]
) -> type[BaseHTTPRequestHandler]:
    class Handler(base):  # type: ignore[misc, valid-type]  # chosen by the caller
        pass

    Handler.runs = {r.name if start or k else "": r for k, r in enumerate(runs)}
    Handler.start = None if start is None else staticmethod(start)
    return Handler


def place_of(target: str, names: Collection[str]) -> tuple[str, str]:
    """The name of a run at the beginning of a request, empty where it has none, and the rest of the request.

    >>> place_of("/a%20town/view/index.html?x", {"a town"}), place_of("/view/index.html", {""})
    (('a town', '/view/index.html?x'), ('', '/view/index.html'))
    """
    first, _, rest = target.lstrip("/").partition("/")
    name = unquote(first)
    return (name, f"/{rest}") if name and name in names else ("", target)


def is_local(host: str) -> bool:
    """Whether a request names this machine as such: a page from elsewhere, whose name was made to lead here, does not.

    >>> is_local("127.0.0.1:8123"), is_local("localhost"), is_local("[::1]:80"), is_local("city.example:8123")
    (True, True, True, False)
    """
    return urlsplit(f"//{host}").hostname in ("127.0.0.1", "localhost", "::1")


def path_of(target: str) -> str | None:
    """The path in RUN that a request names; None where it is none of those that are served.

    >>> path_of("/view/data/a%20b.json?x=1"), path_of("/view/../run.json"), path_of("/run.json")
    ('view/data/a b.json', None, None)
    """
    path = unquote(urlsplit(target).path).lstrip("/")
    parts = path.split("/")
    if any(part in ("", ".", "..") for part in parts[:-1]) or parts[-1] in (".", "..") or "\\" in path or "\0" in path:
        return None
    if path in ("view", "view/"):
        return "view/index.html"
    return path if path.startswith(SERVED) else None


def span_of(header: str, size: int) -> tuple[int, int] | None:
    """First byte and the one after the last of a range; None where the header asks for all, or for several ranges.

    >>> span_of("bytes=2-3", 10), span_of("bytes=-4", 10), span_of("bytes=5-", 10), span_of("", 10)
    ((2, 4), (6, 10), (5, 10), None)

    Raises
    ------
    ValueError
        Nothing of the range is in the file.
    """
    found = _RANGE.match(header.strip())
    if found is None or found.groups() == ("", ""):
        return None
    first, last = found.groups()
    start = max(size - int(last), 0) if not first else int(first)
    end = size if not first or not last else min(int(last) + 1, size)
    if start >= end:
        raise ValueError(header)
    return start, end


class FileHandler(BaseHTTPRequestHandler):
    """One request; `runs` and `start` belong to the server."""

    protocol_version = "HTTP/1.1"
    # without it small answers wait for the acknowledgement of the ones before
    disable_nagle_algorithm = True
    runs: Mapping[str, Served]
    start: Callable[[], bytes] | None

    def do_GET(self) -> None:
        self.answer_file(with_body=True)

    def do_HEAD(self) -> None:
        self.answer_file(with_body=False)

    def is_reached_as(self, host: str) -> bool:
        """Whether a request may name this machine so."""
        return is_local(host)

    def log_message(self, format: str, *args: Any) -> None:
        """Silence: a viewer asks for hundreds of files."""

    def answer_file(self, with_body: bool) -> None:
        if not self.is_reached_as(self.headers.get("Host", "")):
            refused = b"Only reached as 127.0.0.1 or localhost.\n"
            self.send(HTTPStatus.FORBIDDEN, refused, {"Content-Type": TYPES["txt"]}, with_body)
            return
        name, target = place_of(self.path, self.runs)
        start = type(self).start
        if urlsplit(target).path in ("/", ""):
            if name or start is None:
                place = f"/{quote(name)}" if name else ""
                self.send(HTTPStatus.FOUND, b"", {"Location": f"{place}/view/index.html"}, with_body)
            else:
                self.send(
                    HTTPStatus.OK, start(), {"Content-Type": TYPES["html"], "Cache-Control": "no-cache"}, with_body
                )
            return
        path = path_of(target)
        data = None if path is None or name not in self.runs else self._contents(self.runs[name], path)
        if data is None or path is None:
            self.send(
                HTTPStatus.NOT_FOUND, b"There is no such file in this run.\n", {"Content-Type": TYPES["txt"]}, with_body
            )
            return
        headers = {
            "Content-Type": TYPES.get(path.rsplit(".", 1)[-1], TYPES["bin"]),
            "Accept-Ranges": "bytes",
            "Cache-Control": "no-cache",
        }
        try:
            span = span_of(self.headers.get("Range", ""), len(data))
        except ValueError:
            headers["Content-Range"] = f"bytes */{len(data)}"
            self.send(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, b"", headers, with_body)
            return
        if span is None:
            self.send(HTTPStatus.OK, data, headers, with_body)
        else:
            headers["Content-Range"] = f"bytes {span[0]}-{span[1] - 1}/{len(data)}"
            self.send(HTTPStatus.PARTIAL_CONTENT, data[span[0] : span[1]], headers, with_body)

    def _contents(self, served: Served, path: str) -> bytes | None:
        if path == SERVED_AS:
            return json.dumps(
                {"run": served.run, **({"cities": "/"} if type(self).start else {}), **served.more}
            ).encode()
        return served.read(path)

    def send(self, status: HTTPStatus, data: bytes, headers: dict[str, str], with_body: bool) -> None:
        try:
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(data)))
            self.send_header("X-Content-Type-Options", "nosniff")
            self.end_headers()
            if with_body:
                self.wfile.write(data)
        except (BrokenPipeError, ConnectionResetError):
            # A browser that moves on closes its connections.
            self.close_connection = True
