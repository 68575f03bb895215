"""Cases for verdicts where points are few: houses of drawn suburbs, whose dormers, annexes and porches three points may show, or none.

Nothing is spoilt but by the lack of points.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cityflow.reconstruction.model import ModelParameters
from drawn_suburb import suburb
from verdict_cases import Case

DENSITIES = (0.5, 0.8, 1.2, 1.2, 2.0, 4.0)
"""Points per square metre, each as often as the others."""
HOUSES = 36


def sparse_cases(seed: int) -> Iterator[Case]:
    """Some houses of a suburb, the same for the same seed."""
    rng = np.random.default_rng([seed, 95])
    for k, roof in zip(range(HOUSES), suburb(seed), strict=False):
        density = float(rng.choice(DENSITIES))
        evidence = roof.thinned(density)
        evidence = replace(evidence, around=evidence.points)
        yield Case(
            f"s{k}_{roof.kind}", "few points", density, evidence, ModelParameters(with_overhangs=False), roof.truth
        )
