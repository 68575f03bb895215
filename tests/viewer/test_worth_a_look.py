from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.building import Status
from cityflow.viewer.report_parameters import WorthALookParameters
from cityflow.viewer.rows import UnitRow
from cityflow.viewer.worth_a_look import worth_a_look

ALWAYS, MOST_SHARE = WorthALookParameters().always, WorthALookParameters().most_share


def models(count: int, nmad: float, explained: float, claim: float, seed: int) -> list[UnitRow]:
    """Units whose figures scatter by a fifth about these."""
    rng = np.random.default_rng(seed)
    row = UnitRow("", "0_0", Status.DONE)
    return [
        replace(
            row, id=f"u{i:04d}", nmad=nmad * f[0], share_explained=1 - (1 - explained) * f[1],
            attributes={"claimed_rmse_m": claim * f[2]},
        )
        for i, f in enumerate(rng.lognormal(0, 0.2, (count, 3)))
    ]  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("nmad", "explained", "claim"), [(0.03, 0.98, 0.05), (0.25, 0.6, 0.3), (0.8, 0.2, 1.0)])
def test_a_survey_of_any_noise_lists_few_and_finds_the_bad_ones(
    nmad: float, explained: float, claim: float, seed: int
) -> None:
    good = models(400, nmad, explained, claim, seed)
    bad = [replace(good[k], id=f"bad{k}", nmad=max(5 * nmad, 0.5)) for k in range(6)]
    found = worth_a_look([*good, *bad])
    assert {s.unit.id for s in found[:6]} == {b.id for b in bad}
    assert len(found) <= MOST_SHARE * 406
    median = 100 * float(np.median([u.nmad for u in [*good, *bad] if u.nmad is not None]))
    assert all(f"about the roof (median of all {median:.0f} cm)" in s.reason for s in found[:6])


def test_never_more_than_a_sensible_share() -> None:
    half = models(50, 0.02, 0.99, 0.04, 1) + [replace(u, id=f"x{u.id}", nmad=2.0) for u in models(40, 1, 0.5, 1, 2)]
    assert len(worth_a_look(half)) == ALWAYS
    many = [replace(u, id=f"{u.id}_{k}") for k in range(10) for u in half]
    assert len(worth_a_look(many)) == int(MOST_SHARE * 900)


def test_small_errors_and_failures_do_not_stand_out() -> None:
    good = models(50, 0.01, 0.995, 0.02, 3)
    fine = replace(good[0], id="fine", nmad=0.15)
    failed = replace(good[1], id="failed", status=Status.FAILED, nmad=3.0)
    assert worth_a_look([*good, fine, failed]) == []
    assert worth_a_look([UnitRow("a", "0_0", Status.DONE)]) == []


def test_each_way_to_stand_out_has_its_words() -> None:
    good = models(50, 0.05, 0.97, 0.08, 4)
    lost = replace(good[0], id="lost", share_explained=0.3)
    unsure = replace(good[1], id="unsure", attributes={"claimed_rmse_m": 0.9})
    reasons = {s.unit.id: s.reason for s in worth_a_look([*good, lost, unsure])}
    assert "70 % of the points are off the roof" in reasons["lost"]
    assert "expects an error of 90 cm (median of all 8 cm)" in reasons["unsure"]
