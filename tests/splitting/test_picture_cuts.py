"""Places where a border may be, with pictures: where they are, and what is known there."""

from __future__ import annotations

import pytest

from cityflow.splitting.borders.picture_features import picture_table
from cityflow.splitting.borders.place_evidence import places_of
from cityflow.splitting.borders.station_features import FEATURES
from cityflow.splitting.cuts.cuts import free_ends, proposals, reach
from cityflow.splitting.segments.segments import find_segments
from cityflow.splitting.split import SplitParameters, split
from cityflow.splitting.strips.axis_strips import axis_strips
from cityflow.splitting.strips.slices import points_on_segments
from cityflow.splitting.strips.strip_evidence import look_at_strip
from cityflow.splitting.strips.strip_rasters import facade_cells
from splitting.row_scene import House, row_evidence


def test_features_at_a_border_and_beside_it() -> None:
    """Two houses of other colours: at 6 m roofs and façades change, in the middle of a house they are alike."""
    evidence, _ = row_evidence([House(), House(roof=(80, 84, 92), facade=(150, 84, 66))], turn_deg=0.0)
    strip = axis_strips(evidence.outline, (0.0, 90.0), 0.16, 4.5)[0]
    points = points_on_segments(find_segments(evidence), evidence.gsd_m)
    seen = look_at_strip(strip, evidence.outline, evidence, points, facade_cells(evidence.frames[1:]))
    free = free_ends(strip, evidence.outline)
    assert free == (True, True)
    border = float(strip.stations[0] + strip.stations[-1]) / 2
    assert min(abs(u - border) for u in proposals(seen, free)) < 0.2
    u = [border - 3.0, border, border + 3.0]
    values = picture_table(*places_of(seen, evidence.outline, u, reach(strip, free)), strip, free)
    table = dict(zip([f.name for f in FEATURES], values.T.tolist(), strict=True))
    assert table["roof_far_sigmas"][1] > 5.0 > 2.0 > max(table["roof_far_sigmas"][0], table["roof_far_sigmas"][2])
    assert table["hue_sigmas"][1] > 2.0 > 0.5 > max(table["hue_sigmas"][0], table["hue_sigmas"][2])
    assert table["clearest"][1] > 0.95
    assert table["other_facade_sigmas"][1] > 3.0
    assert table["facade_hue_sigmas"][1] > 2.0 > 0.5 > max(table["facade_hue_sigmas"][0], table["facade_hue_sigmas"][2])
    assert table["facade_alike"][1] < 0.1 < 0.5 < min(table["facade_alike"][0], table["facade_alike"][2])
    assert max(table["turned_step"]) < 0.1
    assert table["smaller_m2"][1] == pytest.approx(evidence.outline.area / 2, rel=0.05)
    assert table["narrower_m"] == [0.0, 0.0, 0.0]


def test_confidence_is_a_probability() -> None:
    evidence, true = row_evidence([House(), House(roof=(80, 84, 92), facade=(150, 84, 66)), House()])
    found = split(evidence, SplitParameters())
    assert len(found.cut_lines) == len(true)
    assert all(0.5 <= c.confidence < 1.0 for c in found.cut_lines)
