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
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from browser.chromium import Chromium
from cityflow.flow.store import Store
from cityflow.viewer.server import Served, server_for
from cityflow.workflow.serve import reader
from view_city import write_city

VIEW = Path(__file__).parents[1] / "view"
READY = (
    "window.cityflowView?.isReady && window.cityflowView.stage.frames > 1 && window.cityflowView.city.models.size > 0"
)
DONE = "!window.cityflowView.isBusy"
ERROR_PX, FRAMES = 4, 25
TURN = """(stage, draw, k) => {
  const a = 0.06 * k;
  const [x, y, z] = stage.at, r = stage.away;
  stage.camera.position.set(x + r * Math.sin(a) * 0.8, y - r * Math.cos(a) * 0.8, z + 0.6 * r);
  stage.camera.lookAt(x, y, z);
  const gl = stage.gl, pixel = new Uint8Array(4), begun = performance.now();
  draw();
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  return performance.now() - begun;
}"""


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


def frames(address: str, page: str, ready: str, stage: str, draw: str, away: float) -> tuple[float, int]:
    """Median milliseconds of a frame while one walks around the city, and how many triangles it drew."""
    with Chromium(size=(1280, 800)) as browser:
        browser.open(f"{address}/{page}", ready, 300)
        loop = f"for (let k = 0; k < {FRAMES}; k += 1) times.push(turn(stage, draw, k));"
        settle = f"""(async () => {{ const stage = {stage}, turn = {TURN}, draw = {draw};
            for (let k = 0; k < 400; k += 1) {{ turn(stage, draw, k % {FRAMES}); await new Promise((r) => setTimeout(r, 5));
              if (k > {FRAMES} && !stage.busy()) break; }} return 1; }})()"""
        browser.run(settle.replace("AWAY", str(away)), timeout=400)
        measured = f"(() => {{ const stage = {stage}, turn = {TURN}, draw = {draw}, times = []; {loop} return [times, stage.triangles()]; }})()"
        times, triangles = browser.run(measured.replace("AWAY", str(away)), timeout=400)
        return statistics.median(times), triangles


def compared(folder: Path, address: str, rounds: int) -> None:
    about = json.loads((folder / "view/data/city.json").read_text())
    e0, n0, _, e1, n1, _ = about["bounds"]
    at, away = json.dumps([(e0 + e1) / 2, (n0 + n1) / 2, 0]), 0.75 * max(e1 - e0, n1 - n0)
    bundle = folder / "view/bare.js"
    subprocess.run(
        ["npx", "esbuild", "benchmark/bare.js", "--bundle", "--minify", "--format=esm", f"--outfile={bundle}", "--log-level=error"],
        cwd=VIEW, check=True,
    )  # fmt: skip
    style = "<style>body{margin:0}canvas{position:fixed;left:0;top:59px;width:1280px;height:714px}</style>"
    (folder / "view/bare.html").write_text(
        f'{style}<canvas id="canvas"></canvas><script type="module" src="bare.js"></script>'
    )
    bare = f"view/bare.html?tileset=/products/tiles3d/tileset.json&city=/view/data/city.json&error={ERROR_PX}"
    ours = (
        "{camera: cityflowView.stage.camera, gl: cityflowView.stage.renderer.getContext(), at: AT, away: AWAY,"
        " busy: () => cityflowView.city.isLoading, triangles: () => cityflowView.stage.renderer.info.render.triangles}".replace(
            "AT,", f"{at},"
        )
    )
    theirs = (
        "{camera: bare.camera, gl: bare.renderer.getContext(), at: AT, away: AWAY,"
        " busy: () => !bare.tiles.root || bare.tiles.isLoading, triangles: () => bare.renderer.info.render.triangles}".replace(
            "AT,", f"{at},"
        )
    )
    found: dict[str, list[float]] = {"view": [], "bare": []}
    for _ in range(rounds):
        for name, page, ready, stage, draw in (
            ("view", "view/index.html", READY, ours, "() => cityflowView.stage.render()"),
            ("bare", bare, "window.bare", theirs, "bare.render"),
        ):
            ms, triangles = frames(address, page, ready, stage, draw, away)
            found[name].append(ms)
            print(f"  {name}: {ms:.1f} ms a frame, {triangles:,} triangles", flush=True)
    ratio = statistics.median(found["view"]) / statistics.median(found["bare"])
    print(f"  frame time {ratio:.2f} × that of the bare example")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--buildings", type=int, nargs="+", default=[1000, 2000, 5000])
    parser.add_argument("--frames-of", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=2)
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
