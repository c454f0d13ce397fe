"""The height of the ground in a model, and why: from terrain, a stated level, storeys, foundations, the lowest part."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Element, Role, Storey, TriangleMesh, plain_class
from bimvox.bim.kinds.kind import Kind
from bimvox.errors import SelectionError
from bimvox.kept import kept
from bimvox.site.limits import FAR_FROM_GROUND_M
from bimvox.site.outlines import PLAN, hull

_GROUND_FLOOR = re.compile(
    r"\b(ground|grd|street level|level 0+|floor 0+|00|e\.?g\.?|erdgescho(ss|ß)|parterre|begane\s*grond|bg|"
    r"rez[- ]de[- ]chauss[ée]e|rdc|piano terra|planta baja|pb|t[ée]rreo|r[ée]s[- ]do[- ]ch[ãa]o|"
    r"bottenv[åa]n\w*|entr[ée]plan|stueetage?n?|stuen|1\. etasje|pohjakerros|maantasokerros|parter|"
    r"p[řr][íi]zem[íi]|f[öo]ldszint|zemin|первый этаж)\b|^(1階|地上1階|首层|一层|1층|1fl\b)",
    re.IGNORECASE,
)
"""Names of the floor at the ground. Where the first floor is meant, its elevation, which is 0, decides."""
_GROUND_ITSELF = re.compile(
    r"\b(finish(ed)? grade|exist(ing)? grade|grade|maaiveld|gel[äa]nde(h[öo]he|oberkante)?|okg|terrain naturel|"
    r"marknivå|terreng|piano di campagna|rasante|cota de terreno|poziom terenu|ter[ée]n|maanpinta|gl)\b|^設計 ?gl",
    re.IGNORECASE,
)
"""Names of a level that is the ground, not a floor on it."""
_BELOW = re.compile(
    r"(below grade|"
    r"found|fdn|footing|fundament|basement|cellar|keller|kelder|sous[- ]sol|cave|sotto|s[óo]tano|t\.?o\.?\b)",
    re.IGNORECASE,
)
_SLAB_OVER_M, _SLAB_UNDER_M = 0.15, 0.35
"""So far over or under the level of its storey lies the top of a ground floor, with or without its finish."""
_THICKEST_M, _LEAST_M2 = 0.6, 4.0
_LAYER_GAP_M = 0.02
"""So far apart are layers of one floor at most."""
_FLOOR_M = 0.3
"""What the floor at the ground is taken to be thick if the model has none."""
_SHALLOW_M = 0.5
"""What reaches less far below that level stands on the ground: the lowest part is the level then."""
_RING_M, _STEP_M, _MOST_POINTS = (1.0, 6.0), 0.5, 4000
"""So far around the building's outline is the terrain looked at, and so dense."""
_BURIED_M = 3.0
"""Ground further below the lowest part, or above the highest, is not that of this building."""


class GroundLevel(NamedTuple):
    """The height of the ground.

    Attributes:
        height_m: In the model's coordinates, metres; to the millimetre.
        why: What it was taken from, for people.
    """

    height_m: float
    why: str


@kept
def ground_level(building: Building) -> GroundLevel:
    """Return the height that is the top of the ground around a building.

    Evidence in this order: the terrain of the model around the building; the level of the terrain that the file states;
    the storey at the ground, less its floor; the top of the piles; the lowest part. If that is within half a metre of
    the storey's level, it lies on the ground, and so it does in a model without a storey that is called so.

    Args:
        building: As read.

    Raises:
        SelectionError: If there are neither components nor structure.
    """
    built = [element for element in building.elements if element.role in BUILT]
    if not built:
        raise SelectionError(
            "the model has neither components nor structure", hint="see bimvox inspect, and [model] select"
        )
    up_m = float(building.origin_m[2])
    heights_m = np.array([element.mesh.bounds_m[:, 2] for element in built]) + up_m
    lowest, highest = float(heights_m[:, 0].min()), float(heights_m[:, 1].max())
    around = _terrain_around(building.elements)
    if around is not None and _fits(around + up_m, lowest, highest):
        return _level(around + up_m, "the terrain of the model around the building")
    if building.terrain_m is not None and _fits(building.terrain_m, lowest, highest):
        return _level(building.terrain_m, "the level of the terrain that the model states")
    low_m, high_m = lowest - FAR_FROM_GROUND_M, highest + _BURIED_M
    storeys = [storey for storey in building.storeys if low_m <= storey.height_m <= high_m]
    found = _of_storey(storeys, built, up_m) or _of_piles(built, up_m)
    if found is None or found.height_m - _SHALLOW_M <= lowest <= found.height_m + _SHALLOW_M:
        return _level(np.floor(lowest * 1e3 + 0.05) / 1e3, "the lowest part of the model")
    return found


def terrain_of(elements: Iterable[Element]) -> list[TriangleMesh]:
    """Return the terrain that is the ground of a building; none if what lies around it cannot be its ground.

    Args:
        elements: All elements of the building, in one frame.
    """
    elements = list(elements)
    bounds_m = np.array([one.mesh.bounds_m[:, 2] for one in elements if one.role in BUILT])
    around = _terrain_around(elements)
    if around is not None and not _fits(around, float(bounds_m[:, 0].min()), float(bounds_m[:, 1].max())):
        return []
    return _terrain_in(elements)


def heights_at(terrain: Sequence[TriangleMesh], points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the highest surface at each point on plan; NaN where there is none.

    Args:
        terrain: Its meshes.
        points_m: (N, 2) float64.
    """
    corners = np.concatenate([np.empty((0, 3, 3)), *(mesh.triangles_m for mesh in terrain)])
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (corners[:, n].T for n in range(3))
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    flat = np.flatnonzero(np.abs(area) > 1e-9)
    found = np.full(len(points_m), -np.inf)
    tree = shapely.STRtree(shapely.polygons(corners[flat][:, :, :2]))
    point, nth = tree.query(shapely.points(points_m), predicate="intersects")
    of = flat[nth]
    x, y = points_m[point].T
    u = ((x - ax[of]) * (cy - ay)[of] - (cx - ax)[of] * (y - ay[of])) / area[of]
    v = ((bx - ax)[of] * (y - ay[of]) - (x - ax[of]) * (by - ay)[of]) / area[of]
    np.maximum.at(found, point, az[of] + u * (bz - az)[of] + v * (cz - az)[of])
    return np.where(np.isfinite(found), found, np.nan)


def _level(height_m: float, why: str) -> GroundLevel:
    return GroundLevel(round(float(height_m), 3) + 0.0, why)


def _fits(height_m: float, lowest_m: float, highest_m: float) -> bool:
    """Return whether the ground of a building can have this height; its parts are as low and as high as said."""
    return lowest_m - _BURIED_M <= height_m <= highest_m + _BURIED_M


def _terrain_in(elements: Iterable[Element]) -> list[TriangleMesh]:
    return [element.mesh for element in elements if element.role is Role.GROUND]


def _terrain_around(elements: Sequence[Element]) -> float | None:
    """Return the median height of the terrain around a building, in its frame; None if there is none."""
    built = [element for element in elements if element.role in BUILT]
    terrain = _terrain_in(elements)
    if not (terrain and built):
        return None
    outline = shapely.union_all([hull(element.mesh, PLAN) for element in built]).convex_hull
    ring = outline.buffer(_RING_M[1]).difference(outline.buffer(_RING_M[0]))
    x0, y0, x1, y1 = ring.bounds
    step_m = max(_STEP_M, float(np.sqrt((x1 - x0) * (y1 - y0) / _MOST_POINTS)))
    at = np.stack(np.meshgrid(np.arange(x0, x1, step_m), np.arange(y0, y1, step_m)), axis=-1).reshape(-1, 2)
    at = at[shapely.contains_xy(ring, at)]
    heights_m = heights_at(terrain, at)
    known = heights_m[~np.isnan(heights_m)]
    return float(np.median(known)) if len(known) else None


def _of_storey(storeys: Sequence[Storey], built: list[Element], up_m: float) -> GroundLevel | None:
    ground = [one for one in storeys if _GROUND_ITSELF.search(one.name) and not _BELOW.search(one.name)]
    if ground:
        level = min(ground, key=lambda one: one.height_m)
        return _level(level.height_m, f"the level {level.name!r}")
    storey = _ground_storey(storeys)
    if storey is None:
        return None
    floors = [one for one in built if _is_floor(one)]
    tops_m = [float(one.mesh.bounds_m[1, 2]) + up_m - storey.height_m for one in floors]
    there = [one for one, top_m in zip(floors, tops_m, strict=True) if -_SLAB_UNDER_M <= top_m <= _SLAB_OVER_M]
    best = max(there, key=_area_m2, default=None)
    name = f"storey {storey.name!r}" if storey.name else "the storey at the level 0"
    if best is None:
        return _level(storey.height_m - _FLOOR_M, f"{_FLOOR_M:g} m below {name}, for its floor")
    best = _lowest_under(best, floors)
    return _level(float(best.mesh.bounds_m[0, 2]) + up_m, f"the underside of {best.label}, the floor of {name}")


def _is_floor(element: Element) -> bool:
    low, top = element.mesh.bounds_m[:, 2].tolist()
    is_slab = plain_class(element.ifc_class) in ("IfcSlab", "IfcCovering", "IfcBuildingElementPart")
    return is_slab and top - low <= _THICKEST_M and _area_m2(element) >= _LEAST_M2


def _area_m2(element: Element) -> float:
    return float(np.prod(np.ptp(element.mesh.bounds_m[:, :2], axis=0)))


def _lowest_under(floor: Element, floors: list[Element]) -> Element:
    """Return the lowest of the layers of a floor: the planks under its topping."""
    (low, high), under_m = floor.mesh.bounds_m[:, :2], floor.mesh.bounds_m[0, 2]
    under = [
        one
        for one in floors
        if abs(one.mesh.bounds_m[1, 2] - under_m) <= _LAYER_GAP_M
        and (one.mesh.bounds_m[0, :2] < high).all()
        and (one.mesh.bounds_m[1, :2] > low).all()
    ]
    below = [one for one in under if one.mesh.bounds_m[0, 2] < under_m - _LAYER_GAP_M]
    return _lowest_under(max(below, key=_area_m2), floors) if below else floor


def _ground_storey(storeys: Sequence[Storey]) -> Storey | None:
    """Return the storey at the ground: the lowest one called so, else the one whose stated elevation is 0."""
    there = [storey for storey in storeys if not _BELOW.search(storey.name)]
    named = [storey for storey in there if _GROUND_FLOOR.search(storey.name)]
    zero = [storey for storey in there if abs(storey.elevation_m) < 0.01]
    return min(named or zero, key=lambda storey: storey.height_m, default=None)


def _of_piles(built: list[Element], up_m: float) -> GroundLevel | None:
    tops_m = [float(one.mesh.bounds_m[1, 2]) for one in built if one.judgement.kind is Kind.PILE]
    return _level(max(tops_m) + up_m, "the top of the piles") if tops_m else None
