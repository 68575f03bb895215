"""Parameters of patches."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters


class PatchParameters(Parameters):
    """How the pixels of a face are made."""

    padding_px: int = Field(3, ge=2, le=16, description="pixels around a face that get its colours, against bleeding")
    inset_px: float = Field(
        1.0,
        ge=0,
        le=3,
        description="pixels whose centre is nearer than this to the face's edge take the colour of the next",
    )
    feather_px: float = Field(3.0, ge=0, le=32, description="pixels over which one image fades into the next")
    fade_px: float = Field(
        6.0,
        gt=0,
        le=100,
        description="unseen parts of a wall fade from the colours around into the wall's plain colour over so many pixels",
    )
    retreat_px: float = Field(1.5, ge=0, le=8, description="pixels this near to an occluding edge are used last")
    slim_px: float = Field(
        3.0, ge=0, le=10, description="faces narrower than this in their root image get colours averaged along them: their pixels show neighbours too"
    )  # fmt: skip
    most_outside: float = Field(
        0.5, ge=0, le=1, description="share of a face outside its root image from which it is rectified"
    )
    largest_px: int = Field(8192, ge=64, le=16384, description="longest side of a patch; larger ones are scaled down")
    largest_mpx: float = Field(
        16.0,
        ge=0.05,
        le=268,
        description="largest area of a patch, million pixels; each pixel needs about 65 bytes of memory",
    )
    finest_m: float = Field(0.005, gt=0, le=1, description="finest cell of a rectified patch, metres")

    @property
    def most_px(self) -> int:
        """Pixels of a patch, at most."""
        return int(self.largest_mpx * 1e6)
