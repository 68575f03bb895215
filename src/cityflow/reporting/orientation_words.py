"""Known points of an orientation, and its registration to a survey, in lines for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot
from typing import Any

FAR_M = 1.0
"""A common shift of given positions from which on another datum is likely; set by hand."""


def control_lines(control: Mapping[str, Any]) -> Iterator[str]:
    """Residuals of control and check points, what is wrong with single ones, and the shift of all given positions."""
    points = control["points"]
    for role, name in (("control", "Control points"), ("check", "Check points")):
        used = [p for p in points if p["role"] == role and p["used"]]
        if not used:
            continue
        plan, up = control[f"{role}_rms_m"]
        yield f"{name}: {len(used)}, root mean square {plan * 100:.1f} cm in plan, {up * 100:.1f} cm in height"
        for p in used:
            yield f"  {_residual(p)}"
    for p in points:
        if "problem" in p:
            left_out = "" if p["used"] else " It is left out."
            yield f"{p['role'].capitalize()} point {p['name']}: {p['problem']}.{left_out} → {p['remedy']}"
    shift = control["shift_of_given_positions_m"]
    if shift is None:
        yield "Fewer than three control points hold the block: a common shift of the given positions could not be told"
        return
    east, north, up = shift
    yield f"Given positions lie off the control points together by {east:+.3f}, {north:+.3f}, {up:+.3f} m (east, north, up); this is taken out"
    if hypot(*shift) > FAR_M:
        what = (
            "heights of another datum (ellipsoid or geoid), or an antenna's height"
            if abs(up) > hypot(east, north)
            else "another datum"
        )
        yield f"That is much: {what} is likely in the positions or in the control points; the control points are taken"


def _residual(point: Mapping[str, Any]) -> str:
    east, north, up = point["off_m"]
    height = "no height" if up is None else f"{up * 100:+.1f} cm up"
    return f"{point['name']}: {east * 100:+.1f} cm east, {north * 100:+.1f} cm north, {height}; {point['marks']} marks, {point['mark_px']:.2f} px"


def registration_words(figures: Mapping[str, Any]) -> tuple[str, ...]:
    """What a registration to a survey found."""
    x, y, z = figures["shift_m"]
    plan = hypot(*figures["shift_sigmas_m"][:2])
    second = f", at the next best place {100 * figures['second']:.0f} %" if figures["second"] else ""
    return (
        f"Registered: moved by {x:.2f}, {y:.2f}, {z:.2f} m (east, north, up), turned by {figures['turn_deg']:.3f}°, "
        f"scale {figures['scale']:.5f}; standard deviations {plan:.3f} m in plan, {figures['shift_sigmas_m'][2]:.3f} m in height, "
        f"{max(figures['turn_sigmas_deg']):.4f}°",
        f"{100 * figures['overlap']:.0f} % of the tie points lie over the survey; {100 * figures['agreement']:.0f} % of those on buildings and trees "
        f"agree with it{second}; {figures['matched']} lie on planes, {figures['distance_m']:.3f} m off (robust)",
        *_held_words(figures),
    )


def _held_words(figures: Mapping[str, Any]) -> Iterator[str]:
    """How the survey holds the adjustment."""
    if (held := figures.get("held")) is not None:
        counts, off = held["patches"], held["off_m"]
        size = "adjusted, too" if held["scale_free"] else "as given"
        if held["stays"]:
            yield "The survey does not contradict where the images were given: they stay there"
        yield (
            f"The survey holds the adjustment by {counts[0]} level and {counts[1]} sloping patches and {counts[2]} of walls, "
            f"{off[0]:.3f}, {off[1]:.3f} and {off[2]:.3f} m off (robust); the block's size is {size}; "
            f"standard deviations of its images {held['position_sigma_m']:.3f} m, {held['angle_sigma_deg']:.4f}°"
        )
    elif (reason := figures.get("not_held")) is not None:
        yield f"The survey does not hold the adjustment, the block is moved as a whole: {reason}"
