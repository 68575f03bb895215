"""A Chromium without a screen, driven through a pipe (Chrome DevTools Protocol), for tests and benchmarks of the view."""

from __future__ import annotations

import base64
import io
import json
import os
import queue
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from PIL import Image

from cityflow.core.arrays import ByteArray

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless=new", "--remote-debugging-pipe", "--no-sandbox", "--no-first-run", "--no-default-browser-check", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--mute-audio",
    "--disable-dev-shm-usage", "--force-color-profile=srgb", "--enable-precise-memory-info",
)  # fmt: skip
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
WITHOUT_WEBGL = ("--disable-gpu", "--disable-3d-apis")
PATIENCE_S = 300.0
"""How long an answer may take: software draws, and a machine that others use gives it no core for many seconds now and then."""


def executable() -> str | None:
    """Chromium's path, or None where it is not installed; the variable CHROMIUM names another one."""
    named = os.environ.get("CHROMIUM")
    return named or next((found for name in NAMES if (found := shutil.which(name))), None)


class Chromium:
    """One browser with one page. Leaving the context ends it. `coarse`: drawn in so many times fewer pixels each way."""

    def __init__(self, flags: tuple[str, ...] = SOFTWARE, size: tuple[int, int] = (1300, 820), coarse: int = 1) -> None:
        found = executable()
        assert found is not None
        self._coarse, self._size = coarse, size
        self._profile = tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True)
        self.messages: list[str] = []
        """What the page has said on its console as a warning or an error, and failed requests."""
        self._answers: dict[int, queue.SimpleQueue[dict[str, Any]]] = {}
        self._last, self._session = 0, ""
        self._process, self._to, self._from = self._started(found, flags, size)
        threading.Thread(target=self._listen, daemon=True).start()
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network", "Performance"):
            self.call(f"{domain}.enable")
        self.resize(*size)

    @contextmanager
    def drawn(self, coarse: int) -> Iterator[None]:
        """For a while in more pixels, or fewer."""
        usual, self._coarse = self._coarse, coarse
        self.resize(*self._size)
        try:
            yield
        finally:
            self._coarse = usual
            self.resize(*self._size)

    def resize(self, width: int, height: int) -> None:
        """Give the window another size in pixels of the page."""
        self._size, scale = (width, height), 1 / self._coarse
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=False
        )

    def _started(
        self, found: str, flags: tuple[str, ...], size: tuple[int, int]
    ) -> tuple[subprocess.Popen[bytes], Any, Any]:
        for_it, to_it = os.pipe()
        from_it, by_it = os.pipe()
        arguments = [*FLAGS, *flags, f"--user-data-dir={self._profile.name}", f"--window-size={size[0]},{size[1]}"]
        # it reads from descriptor 3 and writes to 4, whatever the pipes are called here
        shell = f'exec "$0" "$@" 3<&{for_it} 4>&{by_it}'
        environment = {**os.environ, "HOME": self._profile.name}
        process = subprocess.Popen(
            ["bash", "-c", shell, found, *arguments], pass_fds=(for_it, by_it), env=environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(for_it)
        os.close(by_it)
        return process, os.fdopen(to_it, "wb", buffering=0), os.fdopen(from_it, "rb")

    def __enter__(self) -> Chromium:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.call("Browser.close", session=False, timeout=5)
            self._process.wait(15)
        except (OSError, queue.Empty, subprocess.TimeoutExpired):
            self._process.kill()
        self._profile.cleanup()

    def call(self, method: str, session: bool = True, timeout: float = PATIENCE_S, **parameters: Any) -> dict[str, Any]:
        """Send a command and wait for what it returns."""
        self._last += 1
        number = self._last
        self._answers[number] = queue.SimpleQueue()
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if session and self._session:
            message["sessionId"] = self._session
        self._to.write(json.dumps(message).encode() + b"\0")
        answer = self._answers[number].get(timeout=timeout)
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']}")
        result: dict[str, Any] = answer["result"]
        return result

    def _listen(self) -> None:
        rest = b""
        while data := os.read(self._from.fileno(), 1 << 20):
            *whole, rest = (rest + data).split(b"\0")
            for text in whole:
                self._heard(json.loads(text))

    def _heard(self, message: dict[str, Any]) -> None:
        if "id" in message:
            self._answers[message["id"]].put(message)
            return
        said = message.get("params", {})
        if message["method"] == "Runtime.exceptionThrown":
            detail = said["exceptionDetails"]
            self.messages.append(str(detail.get("exception", {}).get("description", detail["text"])))
        elif message["method"] == "Runtime.consoleAPICalled" and said["type"] == "error":
            self.messages.append(" ".join(str(a.get("value", a.get("description"))) for a in said["args"]))
        elif message["method"] == "Log.entryAdded" and said["entry"]["level"] == "error":
            self.messages.append(f"{said['entry']['text']} {said['entry'].get('url', '')}")

    def open(
        self, address: str, ready: str = "document.readyState === 'complete'", seconds: float = PATIENCE_S
    ) -> float:
        """Go to an address and wait until an expression holds; returns how long that took."""
        begun = time.perf_counter()
        self.call("Page.navigate", url=address)
        self.wait(ready, seconds)
        return time.perf_counter() - begun

    def run(self, expression: str, timeout: float = PATIENCE_S) -> Any:
        """Value of an expression in the page; promises are waited for."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True, timeout=timeout
        )
        if "exceptionDetails" in answer:
            detail = answer["exceptionDetails"]
            raise RuntimeError(str(detail.get("exception", {}).get("description", detail["text"])))
        return answer["result"].get("value")

    def wait(self, expression: str, seconds: float = PATIENCE_S, step: float = 0.05) -> None:
        """Until an expression holds."""
        end = time.monotonic() + seconds
        # while a page is being replaced its parts are not there, which is no more than not yet
        safe = f"(() => {{ try {{ return Boolean({expression}); }} catch {{ return false; }} }})()"
        while not self.run(safe):
            if time.monotonic() > end:
                raise TimeoutError(f"{expression} did not come true; the page said {self.messages[:5]}")
            time.sleep(step)

    def click(self, x: float, y: float) -> None:
        """A click of the left button, as the system would report it."""
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def drag(self, begin: tuple[float, float], end: tuple[float, float], button: str = "left", steps: int = 5) -> None:
        """A button pressed at one place, and let go at another; places between are passed."""
        held: dict[str, Any] = {"button": button, "buttons": {"left": 1, "right": 2}[button]}
        way = np.linspace(begin, end, steps + 1).tolist()
        self.call("Input.dispatchMouseEvent", type="mousePressed", x=way[0][0], y=way[0][1], clickCount=1, **held)
        for x, y in way[1:]:
            self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, **held)
        held["buttons"] = 0
        self.call("Input.dispatchMouseEvent", type="mouseReleased", x=way[-1][0], y=way[-1][1], clickCount=1, **held)

    def key(self, key: str, code: str = "", shift: bool = False) -> None:
        """A key pressed and let go."""
        text: dict[str, Any] = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent", type=kind, key=key, code=code or key, modifiers=8 if shift else 0, **text
            )

    def picture(self, path: Path | None = None) -> ByteArray:
        """(rows, cols, 3) pixels of what the window shows; written as PNG where a path is given."""
        data = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            path.write_bytes(data)
        pixels = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
        return pixels.repeat(self._coarse, axis=0).repeat(self._coarse, axis=1)

    def memory_mb(self, kinds: tuple[str, ...] = ("--type=renderer", "--type=gpu-process")) -> float:
        """Memory of the page's own processes that no other process shares, in MB; what software draws with counts as graphics."""
        return sum(_private_mb(pid) for pid in _children(self._process.pid, kinds))

    def cpu_s(self) -> float:
        """Processor time of the whole browser so far, seconds."""
        return sum(_cpu_s(pid) for pid in _children(self._process.pid, ("",)))


def _children(root: int, kinds: tuple[str, ...]) -> list[int]:
    parents: dict[int, int] = {}
    arguments: dict[int, str] = {}
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit():
                parents[int(folder.name)] = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
                arguments[int(folder.name)] = (folder / "cmdline").read_text()
        except (OSError, IndexError):
            continue
    return [
        pid
        for pid in parents
        if pid in arguments and _is_below(pid, root, parents) and any(kind in arguments[pid] for kind in kinds)
    ]


def _is_below(pid: int, root: int, parents: dict[int, int]) -> bool:
    while pid in parents:
        if pid == root:
            return True
        pid = parents[pid]
    return False


def _private_mb(pid: int) -> float:
    rows = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return sum(int(row.split()[1]) for row in rows if row.startswith(("Private_Clean", "Private_Dirty"))) / 1024


def _cpu_s(pid: int) -> float:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
