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
from collections.abc import Iterator
from contextlib import contextmanager
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
ERROR_PX, FRAMES = 4, 25
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
class Walk:
    """Frames of one walk around the city: milliseconds of the clock and of the browser's processors, and what was drawn."""

    clock_ms: float
    cpu_ms: float
    triangles: int
    calls: int


def walked(browser: Chromium, address: str, kind: str, ready: str, place: str) -> Walk:
    """Walk around once until everything is there, then again with a clock."""
    browser.open("about:blank")
    browser.open(address, ready, 300)
    begin = f"""const stage = {{...{STAGES[kind]}, {place}}}, turn = {TURN}, draw = {DRAWS[kind]};
        stage.gl = stage.renderer.getContext(); {BEFORE[kind]}"""
    browser.run(f"""(async () => {{ {begin}
        for (let k = 0, quiet = 0; k < 600 && quiet < {FRAMES}; k += 1) {{ turn(stage, draw, k % {FRAMES});
          await new Promise((r) => setTimeout(r, 5)); quiet = stage.busy() ? 0 : quiet + 1; }} }})()""", timeout=400)  # fmt: skip
    before = browser.cpu_s()
    times, triangles, calls = browser.run(f"""(() => {{ {begin} const times = [];
        for (let k = 0; k < {FRAMES}; k += 1) times.push(turn(stage, draw, k));
        const {{ triangles, calls }} = stage.renderer.info.render; return [times, triangles, calls]; }})()""", timeout=400)  # fmt: skip
    return Walk(statistics.median(times), 1000 * (browser.cpu_s() - before) / FRAMES, triangles, calls)


def compared(folder: Path, address: str, rounds: int) -> None:
    """The view and both forms of the example in turn, in one browser: same tiles, canvas, camera path and error target."""
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
    found: dict[str, list[Walk]] = {"view": [], **{name: [] for name in BARE}}
    with Chromium(size=(1280, 800)) as browser:
        for _ in range(rounds):
            found["view"].append(walked(browser, f"{address}/view/index.html", "view", f"{READY} && {DONE}", place))
            size = "x".join(
                map(str, browser.run("[cityflowView.stage.canvas.width, cityflowView.stage.canvas.height]"))
            )
            for name, equal in BARE.items():
                bare = f"{address}/view/bare.html?tileset=../products/tiles3d/tileset.json&city=data/city.json&error={ERROR_PX}&size={size}&equal={equal}"
                found[name].append(walked(browser, bare, "bare", "window.bare", place))
            print(
                f"  {size}: "
                + "; ".join(
                    f"{name} {w[-1].clock_ms:.0f} ms, {w[-1].cpu_ms:.0f} ms of processors, {w[-1].triangles:,} triangles in {w[-1].calls} calls"
                    for name, w in found.items()
                ),
                flush=True,
            )
    for name in BARE:
        clock, cpu = (
            statistics.median(getattr(w, key) for w in found["view"])
            / statistics.median(getattr(w, key) for w in found[name])
            for key in ("clock_ms", "cpu_ms")
        )
        print(f"  frame of the view / {name}: {clock:.2f} by the clock, {cpu:.2f} by processor time")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--buildings", type=int, nargs="+", default=[1000, 2000, 5000])
    parser.add_argument("--frames-of", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--keep", type=Path)
    chosen = parser.parse_args()
    for count in chosen.buildings:
        folder = (chosen.keep or Path(tempfile.mkdtemp(prefix="view-", dir=chosen.run.parent))) / str(count)
        shutil.rmtree(folder, ignore_errors=True)
        made = write_city(chosen.run, folder, count)
        with serving(folder) as address:
            figures = start(address)
            print(f"{made:,} buildings: " + ", ".join(f"{k} {v:.2f}" for k, v in figures.items()), flush=True)
            if count == chosen.frames_of:
                compared(folder, address, chosen.rounds)
        if chosen.keep is None:
            shutil.rmtree(folder.parent)


if __name__ == "__main__":
    main()
