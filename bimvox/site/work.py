"""The class of work of a part: what the trade calls it, for crew times and for the erection sequence.

The predefined type decides first, then the IFC class. Classes that say little (members, plates, assemblies, bodies of
a mesh) and beams, which real files also use for planks and panels, are told by their shape.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Protocol

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh, plain_class
from bimvox.bim.kinds.words import STEEL_KG_M3, density_by_name
from bimvox.kept import kept


class Work(StrEnum):
    """A class of work."""

    FOOTING = "footing"
    COLUMN = "column"
    WALL = "wall"
    BEAM = "beam"
    SLAB = "slab"
    STAIR = "stair"
    STEEL = "steel"
    """A part of steel, whatever its shape."""
    OTHER = "other"


class Part(Protocol):
    """What the class of a part is told by: a component or an element."""

    @property
    def ifc_class(self) -> str:
        """For example ``IfcBeam``."""

    @property
    def predefined_type(self) -> str | None:
        """For example ``HOLLOWCORE``."""

    @property
    def material(self) -> str | None:
        """Name of its (main) material."""

    @property
    def mesh(self) -> TriangleMesh:
        """Its triangles."""


_BY_TYPE = {
    ("IfcBeam", "HOLLOWCORE"): Work.SLAB,
    ("IfcSlab", "BASESLAB"): Work.FOOTING,
    ("IfcSlab", "LANDING"): Work.STAIR,
    ("IfcMember", "POST"): Work.COLUMN,
    ("IfcMember", "STUD"): Work.COLUMN,
    ("IfcMember", "STRINGER"): Work.STAIR,
    ("IfcElementAssembly", "GIRDER"): Work.BEAM,
    ("IfcElementAssembly", "TRUSS"): Work.BEAM,
    ("IfcElementAssembly", "SLAB_FIELD"): Work.SLAB,
}
_BY_CLASS = {
    "IfcFooting": Work.FOOTING,
    "IfcPile": Work.FOOTING,
    "IfcDeepFoundation": Work.FOOTING,
    "IfcCaissonFoundation": Work.FOOTING,
    "IfcColumn": Work.COLUMN,
    "IfcWall": Work.WALL,
    "IfcSlab": Work.SLAB,
    "IfcRoof": Work.SLAB,
    "IfcStair": Work.STAIR,
    "IfcStairFlight": Work.STAIR,
    "IfcRamp": Work.STAIR,
    "IfcRampFlight": Work.STAIR,
}

_SLENDER = 2.0
"""A part at least this many times as high as wide on plan is a column; as long as wide and high, a beam."""
_FLAT = 2.0
_PLANK_M = 0.5
"""A part at least this wide and ``_FLAT`` times as wide as high is a slab."""
_PANEL_M = 1.5
_THIN, _LONGEST = 4.0, 6.0
"""A part at least ``_PANEL_M`` high, ``_THIN`` times as high as thick, and at most ``_LONGEST`` times as long as high
is a wall; a longer one is a girder."""


def work_of(part: Part) -> Work:
    """Return the class of work that decides how long the crew needs: steel by its material, otherwise its kind."""
    material = part.material
    is_steel = material is not None and density_by_name(material) == STEEL_KG_M3
    return Work.STEEL if is_steel else kind_of(part)


def kind_of(part: Part) -> Work:
    """Return what a part is, whatever its material: never ``STEEL``."""
    ifc_class = plain_class(part.ifc_class)
    found = _BY_TYPE.get((ifc_class, part.predefined_type or "")) or _BY_CLASS.get(ifc_class)
    if found is None:
        found = _by_shape(part.mesh)
    return Work.BEAM if ifc_class == "IfcBeam" and found is Work.OTHER else found


@kept
def _by_shape(mesh: TriangleMesh) -> Work:
    long_m, wide_m = _plan_m(mesh.vertices_m[np.unique(mesh.faces), :2])
    high_m = float(np.ptp(mesh.bounds_m[:, 2]))
    if high_m >= _SLENDER * long_m:
        return Work.COLUMN
    if high_m >= max(_PANEL_M, _THIN * wide_m, long_m / _LONGEST):
        return Work.WALL
    if wide_m >= max(_PLANK_M, _FLAT * high_m):
        return Work.SLAB
    return Work.BEAM if long_m >= _SLENDER * max(wide_m, high_m) else Work.OTHER


def _plan_m(points_m: NDArray[np.float64]) -> tuple[float, float]:
    """Return length and width on plan, of the smallest rectangle around (N, 2) points, turned as they are."""
    box = shapely.MultiPoint(points_m).minimum_rotated_rectangle
    corners = shapely.get_coordinates(box)
    if len(corners) < 4:
        spans = (float(np.hypot(*np.ptp(corners, axis=0))), 0.0) if len(corners) else (0.0, 0.0)
    else:
        first, second = (float(np.hypot(*(corners[n + 1] - corners[n]))) for n in (0, 1))
        spans = (first, second)
    return max(spans), min(spans)
