"""Codes and tolerances of the geometric rules of ISO 19107, by the numbers that val3dity made common."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import Field

from cityflow.core.parameters import Parameters

FAULT_NAMES = {
    101: "TOO_FEW_POINTS", 102: "CONSECUTIVE_POINTS_SAME", 104: "RING_SELF_INTERSECTION",
    201: "INTERSECTION_RINGS", 202: "DUPLICATED_RINGS", 203: "NON_PLANAR_POLYGON_DISTANCE_PLANE",
    204: "NON_PLANAR_POLYGON_NORMALS_DEVIATION", 205: "POLYGON_INTERIOR_DISCONNECTED", 206: "INNER_RING_OUTSIDE",
    207: "INNER_RINGS_NESTED", 208: "ORIENTATION_RINGS_SAME", 301: "TOO_FEW_POLYGONS",
    302: "SHELL_NOT_CLOSED", 303: "NON_MANIFOLD_CASE", 305: "MULTIPLE_CONNECTED_COMPONENTS",
    306: "SHELL_SELF_INTERSECTION", 307: "POLYGON_WRONG_ORIENTATION", 405: "WRONG_ORIENTATION_SHELL",
    901: "INVALID_INPUT_FILE", 902: "EMPTY_PRIMITIVE",
}  # fmt: skip


class Tolerances(Parameters):
    """How exactly the rules are checked; the first three default to what val3dity uses."""

    snap_m: float = Field(0.001, gt=0, le=0.1, description="vertices closer than this are one vertex (m)")
    planarity_m: float = Field(0.01, gt=0, le=1, description="farthest a corner may lie from the plane of its face (m)")
    normals_deg: float = Field(20.0, gt=0, le=180, description="largest angle between triangles of one face (degrees)")
    touch_m: float = Field(
        1e-6, gt=0, le=1e-4, description="rings or faces closer than this touch, without sharing a vertex (m)"
    )


@dataclass(frozen=True, slots=True, order=True)
class Fault:
    """One broken rule.

    Attributes
    ----------
    code, name : number and name of the rule, see `FAULT_NAMES`
    where : ``face=3|ring=1``, counted from 0 in the order of the polyhedron; empty where it concerns the whole
    """

    code: int
    name: str
    where: str = ""

    @classmethod
    def of(cls, code: int, where: str = "") -> Fault:
        return cls(code, FAULT_NAMES[code], where)

    def __str__(self) -> str:
        return f"{self.code} {self.name}" + (f" ({self.where})" if self.where else "")
