"""How fast the view is: python benchmarks/view_speed.py RUN [--buildings 1000 2000] [--keep FOLDER]

RUN is any finished run with textures; its town is repeated until there are buildings enough. Start to first use, frame time against
3d-tiles-renderer's bare example (built from view/benchmark, wants `npm ci` in view/), and memory, in a Chromium without a screen
that draws in software. Time of the processor is given beside time of the clock, since machines have other work.
"""

from __future__ import annotations

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from browser.chromium import Chromium
from cityflow.flow.store import Store
from cityflow.viewer.server import Served, server_for
from cityflow.workflow.serve import reader
from view_city import write_city

VIEW = Path(__file__).parents[1] / "view"
READY = (
    "window.cityflowView?.isReady && window.cityflowView.stage.frames > 0 && window.cityflowView.city.models.size > 0"
)
DONE = "!window.cityflowView.isBusy"
ERROR_PX, FRAMES = 16, 12
BARE = {"example": "0", "equal": "1"}
"""3d-tiles-renderer's example as it is, and without light and with photographs of the size that the view shows."""
TURN = """(stage, draw, k) => {
  const a = 0.06 * k;
  const [x, y, z] = stage.at, r = stage.away;
  Object.assign(stage.camera, { near: 1, far: 1e4 });
  stage.camera.updateProjectionMatrix();
  stage.camera.position.set(x + r * Math.sin(a) * 0.8, y - r * Math.cos(a) * 0.8, z + 0.6 * r);
  stage.camera.lookAt(x, y, z);
  const gl = stage.gl, pixel = new Uint8Array(4), begun = performance.now();
  draw();
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  return performance.now() - begun;
}"""
STAGES = {
    "view": """{camera: cityflowView.stage.camera, renderer: cityflowView.stage.renderer, busy: () => cityflowView.city.isLoading}""",
    "bare": """{camera: bare.camera, renderer: bare.renderer, busy: () => !bare.tiles.root || bare.tiles.isLoading}""",
}
DRAWS = {"view": "() => cityflowView.stage.render()", "bare": "bare.render"}
# what the panels cover moves the picture aside, which the example cannot do
BEFORE = {
    "view": "cityflowView.stage.coverBy({left: 0, right: 0, top: 0, bottom: 0}, true);",
    "bare": "",
}


@contextmanager
def serving(folder: Path) -> Iterator[str]:
    server = server_for([Served("run", "RUN", reader(Store.open(folder)))], "127.0.0.1", 0)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()


def start(address: str) -> dict[str, float]:
    """Seconds until the city can be walked through, and until all of it is there; memory of the page then."""
    with Chromium(size=(1280, 800)) as browser:
        browser.open("about:blank")
        begun, before = time.perf_counter(), browser.cpu_s()
        browser.open(f"{address}/view/index.html", READY, 180)
        interactive, first_cpu = time.perf_counter() - begun, browser.cpu_s() - before
        browser.wait(DONE, 300)
        whole, cpu = time.perf_counter() - begun, browser.cpu_s() - before
        time.sleep(1)
        heap = browser.call("Performance.getMetrics")["metrics"]
        script = next(m["value"] for m in heap if m["name"] == "JSHeapUsedSize") / 2**20
        return {"interactive_s": interactive, "interactive_cpu_s": first_cpu, "whole_s": whole, "whole_cpu_s": cpu,
                "page_mb": browser.memory_mb(("--type=renderer",)),
                "graphics_mb": browser.memory_mb(("--type=gpu-process",)), "heap_mb": script}  # fmt: skip


@dataclass(frozen=True)
class Frame:
    """Milliseconds of the clock and of the browser's processors, and what was drawn."""

    clock_ms: float
    cpu_ms: float
    triangles: int
    calls: int


class Walk:
    """A browser of its own that walks around the city; all is loaded before a frame is measured."""

    def __init__(self, browser: Chromium, address: str, kind: str, place: str) -> None:
        self.browser = browser
        browser.open(address, {"view": f"{READY} && {DONE}", "bare": "window.bare"}[kind], 300)
        self._begin = f"""const stage = {{...{STAGES[kind]}, {place}}}, turn = {TURN}, draw = {DRAWS[kind]};
            stage.gl = stage.renderer.getContext(); {BEFORE[kind]}"""
        browser.run(f"""(async () => {{ {self._begin}
            for (let k = 0, quiet = 0; k < 600 && quiet < {FRAMES}; k += 1) {{ turn(stage, draw, k % {FRAMES});
              await new Promise((r) => setTimeout(r, 5)); quiet = stage.busy() ? 0 : quiet + 1; }} }})()""", timeout=400)  # fmt: skip

    def frame(self, k: int) -> Frame:
        before = self.browser.cpu_s()
        clock, triangles, calls = self.browser.run(f"""(() => {{ {self._begin} const ms = turn(stage, draw, {k % FRAMES});
            const {{ triangles, calls }} = stage.renderer.info.render; return [ms, triangles, calls]; }})()""", timeout=400)  # fmt: skip
        return Frame(clock, 1000 * (self.browser.cpu_s() - before), triangles, calls)


def compared(folder: Path, address: str, frames: int) -> None:
    """The view and both forms of the example, each in a browser of its own, frame by frame in turn: same tiles, canvas, camera path and error target."""
    about = json.loads((folder / "view/data/city.json").read_text())
    e0, n0, _, e1, n1, _ = about["bounds"]
    place = f"at: {json.dumps([(e0 + e1) / 2, (n0 + n1) / 2, 0])}, away: {0.75 * max(e1 - e0, n1 - n0)}"
    subprocess.run(
        ["npx", "esbuild", "benchmark/bare.js", "--bundle", "--minify", "--format=esm", f"--outfile={folder / 'view/bare.js'}", "--log-level=error"],
        cwd=VIEW, check=True,
    )  # fmt: skip
    (folder / "view/bare.html").write_text(
        '<style>body{margin:0}</style><canvas id="canvas"></canvas><script type="module" src="bare.js"></script>'
    )
    found: dict[str, list[Frame]] = defaultdict(list)
    with ExitStack() as stack:
        first = Walk(stack.enter_context(Chromium(size=(1280, 800))), f"{address}/view/index.html", "view", place)
        size = "x".join(
            map(str, first.browser.run("[cityflowView.stage.canvas.width, cityflowView.stage.canvas.height]"))
        )
        walks = {"view": first}
        for name, equal in BARE.items():
            bare = f"{address}/view/bare.html?tileset=../products/tiles3d/tileset.json&city=data/city.json&error={ERROR_PX}&size={size}&equal={equal}"
            walks[name] = Walk(stack.enter_context(Chromium(size=(1280, 800))), bare, "bare", place)
        for k in range(frames):
            for name, walk in walks.items():
                found[name].append(walk.frame(k))
    for name, made in found.items():
        clock, cpu = (statistics.median(getattr(f, key) for f in made) for key in ("clock_ms", "cpu_ms"))
        last = made[-1]
        print(
            f"  {size}: {name} {clock:.0f} ms, {cpu:.0f} ms of processors, in the median of {frames} frames; {last.triangles:,} triangles in {last.calls} calls"
        )
    for name in BARE:
        clocks, cpus = (
            sorted(getattr(a, key) / max(getattr(b, key), 1.0) for a, b in zip(found["view"], found[name], strict=True))
            for key in ("clock_ms", "cpu_ms")
        )
        low, high = (cpus[round(share * (len(cpus) - 1))] for share in (0.25, 0.75))
        half = f"half of all between {low:.2f} and {high:.2f}"
        print(
            f"  frame of the view / {name}: {statistics.median(clocks):.2f} by the clock, {statistics.median(cpus):.2f} by processor time, {half}",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--buildings", type=int, nargs="+", default=[1000, 2000, 5000])
    parser.add_argument("--frames-of", type=int, default=2000)
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument("--made", action="store_true", help="the cities are in --keep already")
    parser.add_argument("--keep", type=Path)
    chosen = parser.parse_args()
    for count in chosen.buildings:
        folder = (chosen.keep or Path(tempfile.mkdtemp(prefix="view-", dir=chosen.run.parent))) / str(count)
        made = count
        if not chosen.made:
            shutil.rmtree(folder, ignore_errors=True)
            made = write_city(chosen.run, folder, count)
        with serving(folder) as address:
            figures = start(address)
            print(f"{made:,} buildings: " + ", ".join(f"{k} {v:.2f}" for k, v in figures.items()), flush=True)
            if count == chosen.frames_of:
                compared(folder, address, chosen.frames)
        if chosen.keep is None:
            shutil.rmtree(folder.parent)


if __name__ == "__main__":
    main()
