"""How much of a part is there that is drawn as one solid block: a plank, a room, a stair, a truss, a machine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from bimvox.bim.building import TriangleMesh, plain_class
from bimvox.bim.kinds.evidence import called_by
from bimvox.bim.kinds.machines import MODULE_CLASSES, machine_of
from bimvox.bim.kinds.words import meaning_of
from bimvox.bim.own_box import own_sides_m, plan_sides_m

_SOLID = 0.9
"""Least share of its convex hull that a part without its voids is."""
_OF_MACHINE = 0.3
"""A machine of metal that fills more of its convex hull is no vessel as it is."""
_STAIR_CLASSES = frozenset({"IfcStair", "IfcStairFlight", "IfcRamp", "IfcRampFlight"})
_FRAME_CLASSES = MODULE_CLASSES | {"IfcBeam", "IfcMember", "IfcColumn"}
_METAL_KG_M3, _CONCRETE_KG_M3 = 2650.0, 1500.0
"""Densities above which a part is of metal, and of concrete or stone; below, it is of timber."""
_SOLID_FLIGHT_M = 0.45
"""A flight that is thicker on average is drawn solid: plates with steps are 0.17 to 0.3 m thick."""
_NARROWEST_M, _LOWEST_M = 0.5, 0.6
"""A flight is at least so wide, and more than a few block steps so high; a stringer is narrower."""
_FLIGHT_M = {"metal": 0.014, "concrete": 0.28, "timber": 0.08}
"""Volume of a flight per area of its slope, a little above that of products: a waist of 0.2 m and half a step of
concrete, 110 kg/m2 of steel, 40 kg/m2 of timber (professional judgement)."""
_FRAME_M = 0.5
"""Frames are at least so high; so a chord that has the name of its truss is none."""
_FRAME_SLENDER = 4.0
"""And so many times as high as wide, if they are not as high as a space frame."""
_SPACE_FRAME_M = 1.0
_BARS = 3.2
"""Cross sections of bars in one of a plane frame: two chords, and webs that weigh a little more than one."""
_BAR_OF_HEIGHT = 8.0
"""No bar is thicker than the height of its frame over this."""
_HOLLOW_BAR = 0.15
"""Share of steel in the square around a rolled or hollow section."""
_TIMBER_BAR_M = 0.2
"""Bars of timber are so deep, however thin."""


def solid_share(
    ifc_class: str,
    names: Sequence[str | None],
    predefined_type: str | None,
    mesh: TriangleMesh,
    volume_m3: float,
    kg_m3: float,
    *,
    is_assumed: bool = False,
) -> float | None:
    """Return how much of its volume a part is that is drawn as one solid block; None if it is all of it.

    Of a machine of unknown material it may be more: it is drawn as a hull of sheets.

    Args:
        ifc_class: Its class.
        names: Of the part, its type and its object type.
        predefined_type: In capitals, if any.
        mesh: Its triangles.
        volume_m3: The volume that they enclose.
        kg_m3: Density of its material.
        is_assumed: Whether that is an assumption.
    """
    plain = plain_class(ifc_class)
    if (machine := machine_of(ifc_class, names)) is not None and machine.kg_m3 is not None:
        hull_m3 = _hull_m3(mesh)
        is_block = is_assumed or (kg_m3 > _METAL_KG_M3 and volume_m3 > _OF_MACHINE * hull_m3)
        return machine.kg_m3 * hull_m3 / (volume_m3 * kg_m3) if is_block and hull_m3 else None
    what = _shape_by_name(names)
    if plain in _STAIR_CLASSES or (what == "stairs" and plain in MODULE_CLASSES | {"IfcSlab"}):
        return _share_of_flight(mesh, volume_m3, kg_m3)
    if plain in _FRAME_CLASSES and (what == "frame" or predefined_type == "TRUSS"):
        return _share_of_frame(mesh, volume_m3, kg_m3)
    meaning = meaning_of("hollow core", "part") if predefined_type == "HOLLOWCORE" else called_by(names)
    if meaning is None or meaning.share is None or (meaning.says == "module" and plain not in MODULE_CLASSES):
        return None
    return meaning.share if _is_solid(mesh, volume_m3) else None


def _shape_by_name(names: Sequence[str | None]) -> str | None:
    found = (meaning_of(name, "shape") for name in names if name)
    return next((meaning.says for meaning in found if meaning is not None), None)


def _share_of_flight(mesh: TriangleMesh, volume_m3: float, kg_m3: float) -> float | None:
    """Return the share of a plate with steps as long as the slope in a flight that is much thicker."""
    width_m, run_m = plan_sides_m(mesh)
    rise_m = float(np.ptp(mesh.bounds_m[:, 2]))
    slope_m2 = width_m * float(np.hypot(run_m, rise_m))
    if width_m < _NARROWEST_M or rise_m < _LOWEST_M or volume_m3 <= _SOLID_FLIGHT_M * slope_m2:
        return None
    return _FLIGHT_M[_stuff(kg_m3)] * slope_m2 / volume_m3


def _share_of_frame(mesh: TriangleMesh, volume_m3: float, kg_m3: float) -> float | None:
    """Return the share of chords and webs in the plate or block that a frame is drawn as."""
    width_m, height_m, _ = own_sides_m(mesh)
    if height_m < max(_FRAME_M, min(_FRAME_SLENDER * width_m, _SPACE_FRAME_M)) or not _is_solid(mesh, volume_m3):
        return None
    bar_m = min(width_m, height_m / _BAR_OF_HEIGHT)
    planes = 1 if bar_m == width_m else 2
    stuff = _stuff(kg_m3)
    deep_m = max(bar_m, _TIMBER_BAR_M) if stuff == "timber" else bar_m
    share = _BARS * planes * bar_m * deep_m * (_HOLLOW_BAR if stuff == "metal" else 1.0) / (width_m * height_m)
    return share if share < 1.0 else None


def _stuff(kg_m3: float) -> str:
    return "metal" if kg_m3 > _METAL_KG_M3 else "concrete" if kg_m3 >= _CONCRETE_KG_M3 else "timber"


def _is_solid(mesh: TriangleMesh, volume_m3: float) -> bool:
    """Return whether a part fills its convex hull."""
    return 0.0 < _SOLID * _hull_m3(mesh) <= volume_m3


def _hull_m3(mesh: TriangleMesh) -> float:
    """Return the volume of the convex hull of a mesh; 0 if it is flat."""
    try:
        return float(ConvexHull(mesh.vertices_m[np.unique(mesh.faces)]).volume)
    except (QhullError, ValueError):
        return 0.0
