"""The coordinate reference of a run: a projected CRS with or without heights, or a local metric frame."""

from __future__ import annotations

from dataclasses import dataclass

LOCAL = "local"


@dataclass(frozen=True, slots=True)
class Reference:
    """Reference system of world coordinates.

    Attributes
    ----------
    code : ``EPSG:n`` (compound where the heights' datum is known), or ``local``
    horizontal_epsg, vertical_epsg : EPSG codes of the parts, None where unknown or local
    name : the CRS's own name
    """

    code: str
    horizontal_epsg: int | None
    vertical_epsg: int | None
    name: str

    @property
    def is_local(self) -> bool:
        return self.code == LOCAL
