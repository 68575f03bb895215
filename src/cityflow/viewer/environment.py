"""Loading of templates, and text forms of figures."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict

STATUS_TEXTS = {
    Status.DONE: ("Done", "every step was done"),
    Status.DEGRADED: ("Simplified", "a simpler model than requested (degraded)"),
    Status.FAILED: ("Failed", "no model of its own"),
    Status.REFUSED: ("Refused", "the input cannot be a building"),
}

VERDICT_TEXTS = {
    Verdict.GOOD: ("Good", "at least 95 % of the roof is expected within 20 cm of the truth"),
    Verdict.LOOK: ("To look at", "the points leave doubts: a person should check it"),
    Verdict.POOR: ("Poor", "probably more than a fifth of the roof is off by more than 20 cm, or there is no model"),
}

ADVICE = {
    Status.FAILED: "Read the reason, change a parameter if it names one (--set key=value), run them again:",
    Status.REFUSED: "Fix these in the source and run the workflow again; only changed units are computed again:",
    Status.DEGRADED: "Usable as they are. To try again, for instance with other parameters (--set key=value):",
}


ADVICE_FOR_ONE = {
    Status.FAILED: "Read the reason, change a parameter if it names one, run the building again:",
    Status.REFUSED: "Fix the outline in its source and run the workflow again; only changed units are computed again:",
    Status.DEGRADED: "Usable as it is. To try again, as it was or with another parameter:",
    Status.DONE: "The same task once more, as it was or with another parameter:",
}


def rendered(template: str, **values: Any) -> str:
    """A page of `templates/`, with what all pages share."""
    return (
        _environment()
        .get_template(template)
        .render(
            status_texts={s.value: texts for s, texts in STATUS_TEXTS.items()},
            advice_for_one={s.value: text for s, text in ADVICE_FOR_ONE.items()},
            advice={s.value: text for s, text in ADVICE.items()},
            verdict_texts={v.value: texts for v, texts in VERDICT_TEXTS.items()},
            **values,
        )
    )


def template_text(name: str) -> Markup:
    """A style or a script, to stand in a page as it is."""
    return Markup((files("cityflow.viewer") / "templates" / name).read_text("utf-8"))


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("cityflow.viewer", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(
        cm=cm, share=share, seconds=seconds_as_text, tree=parameter_rows, pixels=pixels_as_text, json=json_as_text
    )
    return environment


def cm(metres: float | None) -> str:
    """Centimetres to a tenth.

    >>> cm(0.0234), cm(None)
    ('2.3 cm', '–')
    """
    return "–" if metres is None or metres != metres else f"{round(100 * metres, 1) + 0.0:.1f} cm"


def share(value: float | None) -> str:
    """Percent to a tenth.

    >>> share(0.975), share(float("nan"))
    ('97.5 %', '–')
    """
    return "–" if value is None or value != value else f"{100 * value:.1f} %"


def pixels_as_text(value: float | None) -> str:
    """Pixels to a hundredth."""
    return "–" if value is None else f"{value:.2f} px"


def seconds_as_text(value: float | None) -> str:
    """Time as a person says it.

    >>> [seconds_as_text(v) for v in (0.0123, 4.56, 75.0, 5400.0)]
    ['12 ms', '4.6 s', '1 min 15 s', '1 h 30 min']
    """
    if value is None or value != value:
        return "–"
    if value < 1:
        return f"{1000 * value:.0f} ms"
    if value < 60:
        return f"{value:.1f} s"
    if value < 3600:
        return f"{int(value // 60)} min {int(value % 60)} s"
    return f"{int(value // 3600)} h {int(value % 3600 // 60)} min"


def json_as_text(value: Any) -> str:
    """A value as a workflow file has it; a text without its quotes."""
    return value if isinstance(value, str) and value else json.dumps(value, ensure_ascii=False)


def parameter_rows(value: Any, prefix: str = "") -> list[tuple[str, str]]:
    """Nested parameters as dotted keys with their values.

    >>> parameter_rows({"a": {"b": 1}})
    [('a.b', '1')]
    """
    if isinstance(value, dict) and value:
        return [row for k, v in value.items() for row in parameter_rows(v, f"{prefix}.{k}" if prefix else str(k))]
    return [(prefix, value if isinstance(value, str) else json.dumps(value, ensure_ascii=False))]
