"""Pairs for tie points: neighbours, and the other heads over the same ground; none that look from opposite sides."""

from __future__ import annotations

import numpy as np

from cityflow.orientation.tie_pairs import PairParameters, star_sample, tie_pairs
from cityflow.orientation.views import View, footprints
from cityflow.synthetic.flight import plan_flight
from cityflow.synthetic.flight_presets import preset


def test_pairs_of_a_flight_with_five_heads() -> None:
    flight = preset("five_cameras", width_px=1000, height_px=700, forward_overlap=0.7, side_overlap=0.5)
    views = [View(i, (0.0, 20.0)) for i in plan_flight((0.0, 0.0, 120.0, 100.0), 0.0, flight)]
    pairs = tie_pairs(views, PairParameters())
    ground = footprints(views)
    axes = np.array([v.image.axis for v in views])
    turn = np.degrees([np.arccos(np.clip(axes[i] @ axes[j], -1, 1)) for i, j in pairs])
    assert list(pairs) == sorted(set(pairs))
    assert all(i < j for i, j in pairs)
    assert all(ground[i].intersects(ground[j]) for i, j in pairs)
    assert turn.max() < 50
    assert np.sum(turn > 40) > len(views)
    assert len(pairs) < 0.25 * len(views) * (len(views) - 1) / 2
    linked = {k for pair in pairs for k in pair}
    assert len(linked) > 0.9 * len(views)


def test_a_sample_of_stars_reaches_over_survey_and_look_directions_and_is_bounded() -> None:
    flight = preset("five_cameras", width_px=1000, height_px=700, forward_overlap=0.7, side_overlap=0.5)
    views = [View(i, (0.0, 20.0)) for i in plan_flight((0.0, 0.0, 120.0, 100.0), 0.0, flight)]
    stars = star_sample(views, 10, PairParameters(alike=2, turned=1))
    known = set(tie_pairs(views, PairParameters(alike=200, turned=200)))
    centres = np.array([views[s[0]].image.centre[:2] for s in stars])
    heads = {tuple(np.round(views[s[0]].image.axis, 1)) for s in stars}
    assert len(stars) == 10
    assert len({s[0] for s in stars}) == 10
    assert all(len(s) == 4 for s in stars)
    assert len(heads) == 5
    assert np.all(np.ptp(centres, axis=0) > 40)
    assert all((min(s[0], k), max(s[0], k)) in known for s in stars for k in s[1:])
    assert star_sample(views[:1], 10, PairParameters()) == ()
