"""The page of one building: input, result, problems, and the command for another attempt."""

from __future__ import annotations

from dataclasses import dataclass

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict
from cityflow.viewer.environment import rendered, template_text
from cityflow.viewer.picture import Picture
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.run_figures import explain_command, rerun_command

FOLDER = "report"
"""Where the pages lie, beside report.html."""


@dataclass(frozen=True, slots=True)
class PlaneRow:
    """A roof plane: number in the picture, degrees of slope and of the direction it falls to (from north), support.

    Attributes
    ----------
    points, rmse : that support it, and their distance from it (m);  sigma : expected error of its height (m)
    seen : share of its roof faces' area that points cover
    """

    number: int
    slope_deg: float
    aspect_deg: float
    points: int
    rmse: float
    sigma: float
    seen: float


@dataclass(frozen=True, slots=True)
class CandidateRow:
    """One method's model with its scores; None where it has no such figure."""

    method: str
    kept: bool
    valid: bool
    fault: str
    faces: int | None = None
    penalty: float | None = None
    within_20cm: float | None = None
    covered: float | None = None
    nmad: float | None = None
    picture: Picture | None = None


@dataclass(frozen=True, slots=True)
class UnitPage:
    """All that the page of a building shows.

    Attributes
    ----------
    title : of the survey;  stage : whose task the building is
    crops : what stands there: heights, ortho, photographs
    plan, planes : roof planes in plan, numbered, and their figures; of the kept model, else of the best one
    attempt, seconds, peak_mb, version : of the newest attempt
    look : why it is in the review list though it did not fail; may be empty
    run : where the run lies, as commands name it
    parameters : what differs from the survey's for this building alone
    """

    unit: UnitRow
    title: str
    stage: str
    crops: tuple[Picture, ...] = ()
    plan: Picture | None = None
    planes: tuple[PlaneRow, ...] = ()
    candidates: tuple[CandidateRow, ...] = ()
    traceback: str = ""
    attempt: int = 1
    version: int = 0
    parameters: tuple[tuple[str, str], ...] = ()
    look: str = ""
    run: str = "RUN"


OUTCOMES = {
    Status.DONE: "This building has a model, made by a version without verdicts.",
    Status.DEGRADED: "This building has a simpler model than requested.",
    Status.FAILED: "No method gave a model of this building. Where its heights are known a block stands for it in the products, marked as failed.",
    Status.REFUSED: "The outline cannot be a building, so no model was tried.",
}

VERDICTS = {
    Verdict.GOOD: "Good: at least 95 % of the roof is expected within 20 cm of the truth.",
    Verdict.LOOK: "A person should check this building: the points leave doubts about its model.",
    Verdict.POOR: "Poor: more than a fifth of the roof is probably off by more than 20 cm.",
}
"""Of buildings that have a model."""


def write_unit_page(page: UnitPage) -> bytes:
    """The page as HTML; the same values give the same bytes."""
    unit = page.unit
    attributes = sorted((k, v) for k, v in unit.attributes.items() if not isinstance(v, dict | list))
    return rendered(
        "unit.html.j2",
        page=page,
        unit=unit,
        verdict=_verdict(unit),
        command=rerun_command(page.stage, [unit.id], page.stage, unit.status, page.run),
        other=_with_other_parameters(page),
        explain=explain_command(unit.id, page.run),
        attributes=attributes,
        style=template_text("report.css"),
    ).encode()


def _verdict(unit: UnitRow) -> str:
    """What may be expected of the model in a sentence, or why there is none."""
    if unit.status in (Status.FAILED, Status.REFUSED) or not unit.verdict:
        return OUTCOMES[unit.status]
    simpler = f" {OUTCOMES[Status.DEGRADED]}" if unit.status is Status.DEGRADED else ""
    return VERDICTS[Verdict(unit.verdict)] + simpler


def _with_other_parameters(page: UnitPage) -> str:
    """The same command with a parameter changed, where that may help."""
    if page.unit.status is Status.REFUSED:
        return ""
    return (
        rerun_command(page.stage, [page.unit.id], page.stage, page.unit.status, page.run)
        + f" --set {page.stage}.KEY=VALUE"
    )
