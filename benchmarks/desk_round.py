"""A round at the desk as a person makes it, with its times: python benchmarks/desk_round.py RUN [--rounds 3] [--workers 1] [--look 0] [--pictures FOLDER]

RUN is a finished one with photographs, such as the demonstration's flight. The desk is opened by its command, and a Chromium without a screen goes to it:
the first paint; the worst building that has a model; its photograph; another roof type, rerun, the new model; before and now side by side; undo,
rerun, the model that was. Keys and buttons are pressed as a person would press them. RUN ends as it was. Of every part the time of the clock, and the
processor time of all its processes, since machines have other work; the seconds of its reconstruction are a building's own time.
With --look, the person looks at the worst building for so many seconds before the first correction; the desk prepares its first rerun meanwhile.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from browser.chromium import Chromium

READY = "window.cityflowView?.isReady && !window.cityflowView.isBusy"
PAINT = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime"
TICKS = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Spent:
    """Seconds of the clock, and of the processors of desk and browser."""

    clock: float
    desk: float
    browser: float

    def __str__(self) -> str:
        return f"{self.clock:.2f} s, processors {self.desk + self.browser:.2f} s (desk {self.desk:.2f}, browser {self.browser:.2f})"


class Round:
    """A desk that was opened by its command, and a browser that looks at it."""

    def __init__(self, run: Path, workers: int, browser: Chromium) -> None:
        self.run, self.browser = run, browser
        words = [
            sys.executable,
            "-m",
            "cityflow",
            "desk",
            str(run),
            "--no-browser",
            "--port=0",
            "--name=round",
            f"--workers={workers}",
        ]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert self.process.stdout is not None
        self.address = next(line.split()[0] for line in self.process.stdout if line.startswith("http"))

    def close(self) -> None:
        self.process.send_signal(2)
        self.process.wait(60)

    def now(self) -> Spent:
        return Spent(time.perf_counter(), tree_cpu_s(self.process.pid), self.browser.cpu_s())

    def since(self, begun: Spent) -> Spent:
        end = self.now()
        return Spent(end.clock - begun.clock, end.desk - begun.desk, end.browser - begun.browser)

    def first_paint(self) -> tuple[float, Spent, Spent]:
        """Seconds until the page is painted, by the page's own clock; and what is spent until a look at it finds that, and until the city can be used."""
        self.browser.open("about:blank")
        begun = self.now()
        self.browser.open(self.address, f"{PAINT} > 0")
        painted = self.since(begun)
        self.browser.wait(f"{READY} && document.querySelector('#desk-list li')")
        return float(self.browser.run(PAINT)) / 1000, painted, self.since(begun)

    def worst(self) -> dict[str, Any]:
        """By its key, from the top of the list: the first that a roof type can be set for."""
        self.browser.run(
            "((e) => { e.value = ''; e.dispatchEvent(new Event('change')); })(document.querySelector('#desk-review select')); document.activeElement.blur()"
        )
        row: dict[str, Any] = {}
        while row.get("status") not in ("done", "degraded"):
            before = self.browser.run("cityflowView.city.selected")
            self.browser.key("n")
            self.browser.wait(
                f"cityflowView.city.selected !== {json.dumps(before)} && document.querySelector('#desk-building button')"
            )
            row = self.browser.run("cityflowView.desk.review.row(cityflowView.city.selected)")
        self.browser.wait(READY)
        return row

    def photograph(self, unit: str, picture: Path | None) -> tuple[str, Spent]:
        """By its key; of a RUN with photographs."""
        begun = self.now()
        if not self.browser.run(
            f"cityflowView.desk.get('photographs', {{ unit: {json.dumps(unit)} }}).then((n) => n.length)"
        ):
            return "no photograph", self.since(begun)
        self.browser.key("i")
        self.browser.wait(f"cityflowView.photograph.shown && {READY}")
        spent = self.since(begun)
        text = str(self.browser.run("document.querySelector('#photograph-bar span').textContent"))
        if picture is not None:
            self.browser.picture(picture)
        self.browser.key("i")
        self.browser.wait(f"!cityflowView.photograph.shown && {READY}")
        return text, spent

    def other_roof(self, unit: str) -> str:
        """An edit: a roof type that is not the present one."""
        known = f"fetch('data/units/' + encodeURIComponent(cityflowView.desk.review.row({json.dumps(unit)}).tile) + '.json').then((r) => r.json())"
        kind = self.browser.run(f"{known}.then((of) => of[{json.dumps(unit)}].attributes.roof_type)")
        other = "gable" if kind == "flat" else "flat"
        self.browser.run(
            f"((e) => {{ e.value = '{other}'; e.dispatchEvent(new Event('change')); }})(document.getElementById('desk-roof'))"
        )
        self.browser.wait("cityflowView.desk.state.pending === 1")
        return f"{kind} → {other}"

    def undo(self) -> None:
        self.browser.run("document.querySelector('#desk-building .undo').click()")
        self.browser.wait("cityflowView.desk.state.pending === 1 && !cityflowView.desk.state.edits.length")

    def rerun(self, unit: str, picture: Path | None = None) -> tuple[Spent, float, float]:
        """By its key, until the new model stands in the scene (printed at once), and until its texture does; seconds of reconstruction and of all tasks."""
        jobs = int(self.browser.run("cityflowView.desk.state.jobs.length"))
        self.browser.run(
            "cityflowView.city.former && (cityflowView.city.former.isSeen = true); document.activeElement.blur()"
        )
        known, begun = set(records_of(self.run)), self.now()
        self.browser.key("r")
        self.browser.wait(
            f"cityflowView.city.renewed.group.children.some((m) => m.userData.unit === {json.dumps(unit)}) && !cityflowView.stage.isWaiting",
            600,
            0.02,
        )
        shown = self.since(begun)
        print(f"the model is there after {shown}; load {os.getloadavg()[0]:.1f}", flush=True)
        if picture is not None:
            self.browser.picture(picture)
        self.browser.wait(
            f"cityflowView.city.former && !cityflowView.city.former.isSeen && !cityflowView.city.former.tiles.group.visible && {READY}",
            600,
            0.02,
        )
        spent = self.since(begun)
        self.browser.wait(f"cityflowView.desk.reruns.jobs.get({jobs + 1})?.stand === 'done' && {READY}", 600)
        made = [json.loads(p.read_text()) for p in set(records_of(self.run)) - known]
        own = sum(r["seconds"] for r in made if r["unit"] == unit and r["stage"] == "reconstruct")
        self.browser.run(f"cityflowView.choose({json.dumps(unit)}); undefined")
        self.browser.wait("document.querySelector('#desk-building button')")
        return spent, own, sum(r["seconds"] for r in made)

    def model(self, unit: str) -> str:
        return str(self.browser.run(f"cityflowView.desk.review.row({json.dumps(unit)}).model"))


def records_of(run: Path) -> list[Path]:
    return list((run / "records").glob("*/*/[0-9]*.json"))


def tree_cpu_s(root: int) -> float:
    """Processor time of a process and all below it, also of those that have ended, seconds."""
    fields: dict[int, list[str]] = {}
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit():
                fields[int(folder.name)] = (folder / "stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
    found, below = 0, [root]
    while below:
        pid = below.pop()
        found += sum(map(int, fields.get(pid, ["0"] * 15)[11:15]))
        below += [child for child, of in fields.items() if int(of[1]) == pid]
    return found / TICKS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--look", type=float, default=0.0)
    parser.add_argument("--pictures", type=Path)
    chosen = parser.parse_args()
    print(f"load {os.getloadavg()[0]:.1f}", flush=True)
    with Chromium(size=(1280, 800)) as browser:
        desk = Round(chosen.run, chosen.workers, browser)
        try:
            paints = []
            for _ in range(chosen.rounds):
                paint, painted, usable = desk.first_paint()
                paints.append(paint)
                print(
                    f"first paint {paint:.2f} s by the page's clock; found after {painted}; usable after {usable}",
                    flush=True,
                )
            print(f"first paint in the median {statistics.median(paints):.2f} s", flush=True)
            row = desk.worst()
            print(f"the worst with a model: {row['id']}, {row['status']}, {row['verdict']}: {row['reason']}")
            picture = None if chosen.pictures is None else chosen.pictures / "photograph.png"
            print("in its photograph {} after {}".format(*desk.photograph(row["id"], picture)), flush=True)
            time.sleep(chosen.look)
            for number in range(chosen.rounds):
                walked(desk, row["id"], chosen.pictures if not number else None)
        finally:
            desk.close()
        assert browser.messages == [], browser.messages
        print("no console error")


def walked(desk: Round, unit: str, pictures: Path | None) -> None:
    """Correct, rerun, see it change, undo."""
    was, browser = desk.model(unit), desk.browser
    print(f"roof {desk.other_roof(unit)}", flush=True)
    for step in ("corrected", "undone"):
        if step == "undone":
            desk.undo()
        spent, own, tasks = desk.rerun(unit, None if pictures is None else pictures / f"{step}_model.png")
        print(
            f"{step}: its reconstruction {own:.2f} s of that; its texture is there after {spent}; all tasks {tasks:.2f} s; "
            f"load {os.getloadavg()[0]:.1f}",
            flush=True,
        )
        if pictures is not None:
            browser.picture(pictures / f"{step}.png")
        assert (desk.model(unit) == was) == (step == "undone"), f"{step}: {desk.model(unit)}"
        for is_beside in (True, False):
            browser.run("document.activeElement.blur()")
            browser.key("v")
            browser.wait(f"Boolean(cityflowView.stage.beside) === {json.dumps(is_beside)} && {READY}")
            if pictures is not None and is_beside:
                browser.picture(pictures / f"{step}_beside.png")


if __name__ == "__main__":
    main()
