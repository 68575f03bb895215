"""A proxy before a server that answers 503 for a while: an object store that fails."""

from __future__ import annotations

import http.client
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from urllib.parse import urlsplit

HOP = {"connection", "keep-alive", "transfer-encoding", "content-length", "host"}


class FailingProxy:
    """Hands requests on to `behind`, but for those during an outage.

    Attributes
    ----------
    answered : status → number of answers
    """

    def __init__(self, behind: str, port: int = 0) -> None:
        self.behind = urlsplit(behind)
        self.answered: Counter[int] = Counter()
        self._fails_until = 0.0
        self.server = ThreadingHTTPServer(("127.0.0.1", port), type("Handler", (_Handler,), {"proxy": self}))
        self.server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}"

    def fail(self, seconds: float) -> None:
        self._fails_until = time.monotonic() + seconds

    @property
    def is_failing(self) -> bool:
        return time.monotonic() < self._fails_until


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    proxy: FailingProxy

    def log_message(self, *_: object) -> None:
        """Says nothing."""

    def _pass(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        if self.proxy.is_failing:
            self._answer(503, [], b"<Error><Code>ServiceUnavailable</Code><Message>out of order</Message></Error>")
            return
        assert self.proxy.behind.hostname is not None
        connection = http.client.HTTPConnection(self.proxy.behind.hostname, self.proxy.behind.port, timeout=60)
        headers = {name: value for name, value in self.headers.items() if name.lower() not in HOP}
        connection.request(self.command, self.path, body, {**headers, "Content-Length": str(len(body))})
        response = connection.getresponse()
        data = response.read()
        kept = [(name, value) for name, value in response.getheaders() if name.lower() not in HOP]
        length = response.getheader("Content-Length", "0") if self.command == "HEAD" else str(len(data))
        self._answer(response.status, [*kept, ("Content-Length", length)], data)
        connection.close()

    def _answer(self, status: int, headers: list[tuple[str, str]], data: bytes) -> None:
        self.proxy.answered[status] += 1
        self.send_response_only(status)
        for name, value in headers or [("Content-Length", str(len(data)))]:
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    do_GET = do_PUT = do_POST = do_HEAD = do_DELETE = _pass


@contextmanager
def failing_proxy(behind: str) -> Iterator[FailingProxy]:
    proxy = FailingProxy(behind)
    thread = Thread(target=proxy.server.serve_forever, daemon=True)
    thread.start()
    try:
        yield proxy
    finally:
        proxy.server.shutdown()
        proxy.server.server_close()
