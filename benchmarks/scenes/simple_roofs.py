"""Faces of simple roofs in a building's own frame."""

from __future__ import annotations

from cityflow.synthetic.roofs import CHIMNEY, DORMER, LocalFace, rectangle


def flat(length: float, depth: float, eave: float) -> list[LocalFace]:
    return [LocalFace(rectangle(0, 0, length, depth), 0, 0, eave)]


def shed(length: float, depth: float, eave: float, slope: float) -> list[LocalFace]:
    return [LocalFace(rectangle(0, 0, length, depth), 0, slope, eave)]


def gable(u_0: float, u_1: float, v: tuple[float, float], eave: float, slope: float) -> list[LocalFace]:
    """Ridge along u in the middle of v[0] to v[1]."""
    middle = (v[0] + v[1]) / 2
    return [
        LocalFace(rectangle(u_0, v[0], u_1, middle), 0, slope, eave - slope * v[0]),
        LocalFace(rectangle(u_0, middle, u_1, v[1]), 0, -slope, eave + slope * v[1]),
    ]


def gable_across(u: tuple[float, float], v_0: float, v_1: float, eave: float, slope: float) -> list[LocalFace]:
    """Ridge along v in the middle of u[0] to u[1]."""
    middle = (u[0] + u[1]) / 2
    return [
        LocalFace(rectangle(u[0], v_0, middle, v_1), slope, 0, eave - slope * u[0]),
        LocalFace(rectangle(middle, v_0, u[1], v_1), -slope, 0, eave + slope * u[1]),
    ]


def dormer(u: float, v: tuple[float, float], width: float, height: float) -> LocalFace:
    """A level box roof standing out of a slope; where the slope is higher it stays hidden."""
    return LocalFace(rectangle(u, v[0], u + width, v[1]), 0, 0, height, DORMER)


def chimney(u: float, v: float, height: float) -> LocalFace:
    return LocalFace(rectangle(u, v, u + 0.6, v + 0.6), 0, 0, height, CHIMNEY)
