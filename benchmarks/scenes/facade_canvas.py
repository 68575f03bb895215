"""A façade under the brush: wall, openings and what is painted over them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.synthetic.town_facades import WINDOW
from scenes.drawn_facades import layout_of, wall_surface, window_part
from scenes.facade_errors import FINE_M


@dataclass(slots=True)
class Canvas:
    """A wall that is being painted, and the share of each of its openings that nothing stands before."""

    image: Float32Array
    size_m: tuple[float, float]
    openings: list[list[float]]
    whole: list[float]
    storeys: int

    def paint(self, left: float, right: float, bottom: float, top: float, colour: FloatArray | float, share: float = 1.0) -> None:  # fmt: skip
        part = window_part(self.image, self.size_m[1], np.array([left, right, bottom, top]))
        part[:] = (1 - share) * part + share * np.asarray(colour)

    def glaze(self, opening: list[float], rng: np.random.Generator, whole: float = 1.0, frame: bool = True) -> None:
        """A window with glass that is lighter above, a frame, and now and then a curtain."""
        part = window_part(self.image, self.size_m[1], np.array(opening))
        rows = len(part)
        part[:] = (rng.uniform(25, 75) * np.linspace(rng.uniform(0.9, 1.6), 1.0, max(rows, 1)))[:, None, None]
        if rng.random() < 0.2:
            part[: rows // 2] += 50
        if frame:
            part[:3] = part[-3:] = part[:, :3] = part[:, -3:] = 225
        self.openings.append([*opening, WINDOW])
        self.whole.append(whole)


def grid_of_windows(rng: np.random.Generator, storeys: int | None = None) -> tuple[Canvas, list[list[float]]]:
    """A wall and the windows of a usual layout, not yet painted."""
    layout = layout_of("plain", rng)
    while len(layout.openings) < 4 or (storeys and layout.storeys < storeys):
        layout = layout_of("plain", rng)
    rows, cols = (round(v / FINE_M) for v in layout.size_m[::-1])
    image = wall_surface(rows, cols, "plain", rng)
    wanted = [o[:4].tolist() for o in layout.openings if o[4] == WINDOW]
    return Canvas(image, layout.size_m, [], [], layout.storeys), wanted
