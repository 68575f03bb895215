"""Flight plans found once for all surveys of a module that are alike: that those kept are the ones found anew is tested in `survey/test_kept_plans.py`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from cityflow.survey import image_survey
from cityflow.survey.kept_plans import KeptPlan


class RememberedPlans:
    """In memory, by digest."""

    def __init__(self) -> None:
        self.found: dict[str, KeptPlan] = {}

    def get(self, digest: str) -> KeptPlan | None:
        return self.found.get(digest)

    def put(self, digest: str, plan: KeptPlan) -> None:
        self.found[digest] = plan


@pytest.fixture(autouse=True, scope="module")
def remembered_plans() -> Iterator[None]:
    plans = RememberedPlans()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(image_survey, "NotKept", lambda: plans)
        yield
