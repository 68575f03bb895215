"""The page of an update: new, gone and altered buildings, with pictures before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cityflow.viewer.environment import rendered, template_text
from cityflow.viewer.picture import Picture


@dataclass(frozen=True, slots=True)
class ChangeRow:
    """One change.

    Attributes
    ----------
    kind : new, gone, altered;  id, before : name after and before, empty where there is none;  what : in words
    figures : column → metres, square or cubic metres, or standard deviations; None where unknown
    pictures : some have none
    """

    kind: str
    id: str
    before: str
    tile: str
    what: str
    figures: Mapping[str, float | None]
    pictures: tuple[Picture, ...] = ()


@dataclass(frozen=True, slots=True)
class ChangesPage:
    """All that the page shows.

    Attributes
    ----------
    former, catalog : addresses of the catalogs before and after;  dates : of the surveys
    compared : buildings that were modelled again and found as they were;  untouched : those that did not run again
    without_model : names;  offset_m, scatter_m : of all roofs that were compared
    rules : what counts as an alteration, in words
    failed : tasks without which the comparison is incomplete, with reasons;  retry : the command that runs them again
    unclear : names of buildings that may stand in one of the epochs without anybody knowing, since tasks failed: they are neither new nor gone
    """

    title: str = ""
    former: str = ""
    catalog: str = ""
    dates: tuple[str, str] = ("", "")
    rows: Sequence[ChangeRow] = ()
    compared: int = 0
    untouched: int = 0
    without_model: Sequence[str] = ()
    offset_m: float = 0.0
    scatter_m: float = 0.0
    rules: str = ""
    failed: Sequence[str] = ()
    retry: str = ""
    unclear: Sequence[str] = ()

    @property
    def in_short(self) -> str:
        """
        >>> ChangesPage(compared=3, untouched=4).in_short
        'No building is new, gone or altered; 3 were modelled again and are as before, 4 did not run again.'
        >>> ChangesPage(compared=3, failed=["export-city: no"], unclear=["a"]).in_short.partition(" Incomplete")[2]
        ': tasks have failed (1); buildings of which nobody can say whether they are new or gone: 1.'
        """
        counts = [(k, n) for k in ("new", "gone", "altered") if (n := sum(r.kind == k for r in self.rows))]
        found = ", ".join(f"{n:,} {kind}" for kind, n in counts) or "No building is new, gone or altered"
        lacks = [f"tasks have failed ({len(self.failed):,})"] if self.failed else []
        lacks += [f"buildings of which nobody can say whether they are new or gone: {len(self.unclear):,}"] if self.unclear else []  # fmt: skip
        return (
            f"{found}; {self.compared:,} were modelled again and are as before, {self.untouched:,} did not run again."
            + (f" Incomplete: {'; '.join(lacks)}." if lacks else "")
        )


COLUMNS = (
    ("ridge_m", "Ridge", "m"), ("eaves_m", "Eaves", "m"), ("roof_mean_m", "Roof, mean", "m"), ("roof_rms_m", "Roof, RMS", "m"),
    ("volume_m3", "Volume", "m³"), ("area_m2", "Footprint", "m²"), ("significance", "Significance", "σ"),
)  # fmt: skip
"""Key, heading, unit of the figures in the table; how much of roof and outline is altered is said in words."""


def changes_page(page: ChangesPage) -> bytes:
    """HTML; opens anywhere, without a network."""
    return rendered("changes.html.j2", page=page, columns=COLUMNS, style=template_text("report.css")).encode()
