"""Edits of outlines at the desk as a person makes them, with their times: python benchmarks/desk_outlines.py RUN UNIT [--workers 1] [--look 0] [--rounds 1]

RUN is a finished one, UNIT a building of it that stands alone. "Not a building", rerun, the model is gone; undo, rerun, the model is back; an edge of its
outline dragged by 40 pixels, rerun, the new model; undo, rerun, the model that was; a border across it, rerun, two models; undo, rerun, the model that was.
RUN ends as it was. Of every part, the clock and the processor time of desk and browser until the scene has it, and until the files of the whole city have;
beside them the seconds of splitting and reconstruction of what was made: buildings' own time.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from browser.chromium import Chromium
from desk_round import READY, Round, Spent, records_of

OWN = ("split", "reconstruct")


class Outlines(Round):
    """Corrects the outline of one building by buttons, keys and the mouse."""

    def go(self, unit: str) -> None:
        self.browser.run(f"cityflowView.go({json.dumps(unit)}); undefined")
        self.browser.wait(f"cityflowView.city.selected === {json.dumps(unit)} && document.querySelector('#desk-move')")
        self.browser.wait(READY)

    def press(self, button: str) -> None:
        self.browser.run(
            f"[...document.querySelectorAll('#desk-correct button, #desk-drawing button')].find((e) => e.textContent === {json.dumps(button)}).click()"
        )

    def handles(self) -> list[list[float]]:
        """Corners of the outline that is being moved, on the page."""
        place = "const V = cityflowView.stage.camera.position.constructor"
        return list(
            self.browser.run(
                f"(() => {{ {place}; return cityflowView.drawing.places.map(({{ at }}) => cityflowView.stage.onPage(new V(...at))); }})()"
            )
        )

    def written(self) -> None:
        self.browser.wait("cityflowView.desk.state.edits.length === 1")

    def reject(self, unit: str) -> None:
        self.go(unit)
        self.press("Not a building")
        self.written()

    def move(self, unit: str) -> None:
        self.go(unit)
        self.press("Move outline")
        self.browser.wait(f"cityflowView.drawing.isActive && {READY}")
        (x_0, y_0), (x_1, y_1) = self.handles()[:2]
        middle = (x_0 + x_1) / 2, (y_0 + y_1) / 2
        length = max(((x_1 - x_0) ** 2 + (y_1 - y_0) ** 2) ** 0.5, 1.0)
        self.browser.drag(middle, (middle[0] + 40 * (y_1 - y_0) / length, middle[1] - 40 * (x_1 - x_0) / length))
        self.press("Save")
        self.written()

    def divide(self, unit: str) -> None:
        """A border through the middle, from one long side to the other."""
        self.go(unit)
        self.press("Move outline")
        self.browser.wait(f"cityflowView.drawing.isActive && {READY}")
        corners = self.handles()
        self.browser.run("cityflowView.drawing.stop()")
        self.press("Add border")
        sides = [(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
        a, b = max(sides, key=lambda s: (s[0][0] - s[1][0]) ** 2 + (s[0][1] - s[1][1]) ** 2)
        middle = [sum(c[k] for c in corners) / len(corners) for k in (0, 1)]
        start = [(a[k] + b[k]) / 2 for k in (0, 1)]
        for share in (0.06, 1.94):
            self.browser.click(*(start[k] + share * (middle[k] - start[k]) for k in (0, 1)))
            time.sleep(0.2)
        self.written()

    def undo(self) -> None:
        self.browser.run(
            "document.getElementById('desk-tab-reruns').click(); document.querySelector('#desk-edits .undo').click()"
        )
        self.browser.wait("!cityflowView.desk.state.edits.length")
        self.browser.run("document.getElementById('desk-tab-review').click()")

    def made(self, scene: str) -> tuple[Spent, Spent, float, float]:
        """By the key of a rerun, until an expression about the scene holds, and until the job is done; seconds of `OWN` tasks, and of all."""
        jobs = int(self.browser.run("cityflowView.desk.state.jobs.length"))
        self.browser.run(
            "cityflowView.city.former && (cityflowView.city.former.isSeen = true); document.activeElement.blur()"
        )
        known, begun = set(records_of(self.run)), self.now()
        self.browser.key("r")
        self.browser.wait(f"({scene}) && !cityflowView.stage.isWaiting", 600, 0.02)
        shown = self.since(begun)
        self.browser.wait(f"cityflowView.desk.reruns.jobs.get({jobs + 1})?.stand === 'done' && {READY}", 600)
        tasks = [json.loads(p.read_text()) for p in set(records_of(self.run)) - known]
        return shown, self.since(begun), sum(r["seconds"] for r in tasks if r["stage"] in OWN), sum(r["seconds"] for r in tasks)  # fmt: skip

    def rows(self) -> dict[str, str]:
        return dict(self.browser.run("cityflowView.desk.review.rows.map((r) => [r.id, r.model])"))


def walked(desk: Outlines, unit: str, name: str, edit: Callable[[str], Any], scene: str, folder: Path | None) -> None:
    """An edit and its undo."""
    before = desk.rows()
    edit(unit)
    back = f"cityflowView.city.renewed.group.children.some((m) => m.userData.unit === {json.dumps(unit)})"
    for step, until in ((name, scene), (f"{name}, undone", back)):
        if step != name:
            desk.undo()
        shown, done, own, tasks = desk.made(until)
        print(
            f"{step}: in the scene after {shown}; all done after {done}; splitting and reconstruction {own:.2f} s, all tasks {tasks:.2f} s; "
            f"load {os.getloadavg()[0]:.1f}",
            flush=True,
        )
        if folder is not None:
            desk.browser.picture(folder / f"{step.replace(' ', '_').replace(',', '')}.png")
        now = desk.rows()
        other = sorted(u for u in before.keys() & now.keys() if before[u] != now[u])
        gone, new = sorted(before.keys() - now.keys()), sorted(now.keys() - before.keys())
        print(f"  buildings gone {gone}, new {new}, other {other}", flush=True)
    assert desk.rows() == before


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("unit")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--look", type=float, default=0.0)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--pictures", type=Path)
    chosen = parser.parse_args()
    print(f"load {os.getloadavg()[0]:.1f}", flush=True)
    gone = f"cityflowView.city.renewed.has({json.dumps(chosen.unit)})"
    other = "cityflowView.city.renewed.group.children.length"
    with Chromium(size=(1280, 800)) as browser:
        desk = Outlines(chosen.run, chosen.workers, browser)
        try:
            desk.first_paint()
            time.sleep(chosen.look)
            for _ in range(chosen.rounds):
                walked(desk, chosen.unit, "not a building", desk.reject, gone, chosen.pictures)
                walked(desk, chosen.unit, "edge moved", desk.move, other, chosen.pictures)
                walked(desk, chosen.unit, "border added", desk.divide, other, chosen.pictures)
        finally:
            desk.close()
        assert browser.messages == [], browser.messages
        print("no console error")


if __name__ == "__main__":
    main()
