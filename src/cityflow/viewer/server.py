"""Serves the files of one run to a browser on this machine: whole or in ranges, and nothing else."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import unquote, urlsplit

SERVED = ("view/", "products/", "report.html", "report.json", "report/")
SAID = "view/served.json"
TYPES = {
    "html": "text/html; charset=utf-8", "js": "text/javascript; charset=utf-8", "css": "text/css; charset=utf-8", "txt": "text/plain; charset=utf-8",
    "json": "application/json", "bin": "application/octet-stream", "glb": "model/gltf-binary", "jpg": "image/jpeg", "png": "image/png",
    "svg": "image/svg+xml", "tif": "image/tiff", "laz": "application/vnd.laszip", "gpkg": "application/geopackage+sqlite3", "vrt": "application/xml",
    "gml": "application/gml+xml", "obj": "model/obj", "mtl": "model/mtl", "jsonl": "application/city+json-seq",
}  # fmt: skip
_RANGE = re.compile(r"bytes=(\d*)-(\d*)$")

Read = Callable[[str], bytes | None]
"""A path in RUN → its contents, or None where there is no such file."""


def server_for(read: Read, run: str, host: str, port: int) -> ThreadingHTTPServer:
    """A server that is bound, and serves when it is told to; `run` is how the run is named on the command line.

    Raises
    ------
    OSError
        The port is taken.
    """
    server = _Server((host, port), _handler(read, run))
    server.daemon_threads = True
    return server


class _Server(ThreadingHTTPServer):
    # SO_REUSEADDR would let a second server share a port on some systems, and neither would say so
    allow_reuse_address = False
    request_queue_size = 64


def _handler(read: Read, run: str) -> type[BaseHTTPRequestHandler]:
    class Handler(_Handler):
        pass

    Handler.read, Handler.run = staticmethod(read), run
    return Handler


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


class _Handler(BaseHTTPRequestHandler):
    """One request; `read` and `run` belong to the server."""

    protocol_version = "HTTP/1.1"
    # without it small answers wait for the acknowledgement of the ones before
    disable_nagle_algorithm = True
    read: Read
    run: str

    def do_GET(self) -> None:
        self._answer(with_body=True)

    def do_HEAD(self) -> None:
        self._answer(with_body=False)

    def log_message(self, format: str, *args: Any) -> None:
        """Silence: a viewer asks for hundreds of files."""

    def _answer(self, with_body: bool) -> None:
        if urlsplit(self.path).path in ("/", ""):
            self._send(HTTPStatus.FOUND, b"", {"Location": "/view/index.html"}, with_body)
            return
        path = path_of(self.path)
        data = None if path is None else self._contents(path)
        if data is None or path is None:
            self._send(
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
            self._send(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, b"", headers, with_body)
            return
        if span is None:
            self._send(HTTPStatus.OK, data, headers, with_body)
        else:
            headers["Content-Range"] = f"bytes {span[0]}-{span[1] - 1}/{len(data)}"
            self._send(HTTPStatus.PARTIAL_CONTENT, data[span[0] : span[1]], headers, with_body)

    def _contents(self, path: str) -> bytes | None:
        if path == SAID:
            return json.dumps({"run": self.run}).encode()
        return type(self).read(path)

    def _send(self, status: HTTPStatus, data: bytes, headers: dict[str, str], with_body: bool) -> None:
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
