"""The ground of a site: terrain, the levelled yard, and the excavation around what is set below it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from bimvox.bim.building import BUILT, Building, Element, Role, Storey, TriangleMesh, plain_class
from bimvox.bim.kinds.kind import Kind
from bimvox.crane.kinematics import raised
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import SelectionError
from bimvox.grid.frame import GridFrame, whole_cells
from bimvox.kept import kept
from bimvox.site.areas import PLAN, hull
from bimvox.site.component import Component, IntVec
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.default_rules import FAR_FROM_GROUND_M, ON_GROUND_M
from bimvox.site.machine import follows_foot
from bimvox.site.site import Site

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


class _GroundLevel(NamedTuple):
    """The height of the ground.

    Attributes:
        height_m: In the model's coordinates, metres; to the millimetre.
        why: What it was taken from, for people.
    """

    height_m: float
    why: str


@kept
def ground_level(building: Building) -> _GroundLevel:
    """Return the height that is the top of the ground around a building.

    Evidence in this order: the terrain of the model around the building; the level of the terrain that the file states;
    the storey at the ground, less its floor; the top of the piles; the lowest part. If that is within half a metre of
    the storey's level, it lies on the ground, and so it does in a model without a storey that is called so.

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
    result = _of_storey(storeys, built, up_m) or _of_piles(built, up_m)
    if result is None or result.height_m - _SHALLOW_M <= lowest <= result.height_m + _SHALLOW_M:
        return _level(np.floor(lowest * 1e3 + 0.05) / 1e3, "the lowest part of the model")
    return result


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

    ``points_m``: (N, 2) float64.
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


def _level(height_m: float, why: str) -> _GroundLevel:
    return _GroundLevel(round(float(height_m), 3) + 0.0, why)


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


def _of_storey(storeys: Sequence[Storey], built: list[Element], up_m: float) -> _GroundLevel | None:
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


def _of_piles(built: list[Element], up_m: float) -> _GroundLevel | None:
    tops_m = [float(one.mesh.bounds_m[1, 2]) for one in built if one.judgement.kind is Kind.PILE]
    return _level(max(tops_m) + up_m, "the top of the piles") if tops_m else None


WORKING_SPACE_M = 1.0
"""Around everything that is set below the ground. DIN 4124 asks for 0.5 m at least, beside formwork and shoring."""
_LEVEL_SHARE = 0.2
"""Terrain that reaches less into a layer of cells is level with it."""
_EPS_M = 1e-4
"""As deep may a part reach into the cells below it."""


def lowest_terrain_m(terrain: Sequence[TriangleMesh], low_m: Sequence[float], high_m: Sequence[float]) -> float:
    """Return the height of the lowest terrain in a rectangle on plan, at most 0; its underside does not count.

    ``low_m``: the lowest corner on plan; ``high_m``: the highest corner.
    """
    x, y = (np.linspace(low_m[axis], high_m[axis], 65) for axis in range(2))
    heights_m = _highest(terrain, np.stack(np.meshgrid(x, y), axis=-1))
    return float(np.nanmin(np.append(heights_m, 0.0)))


def natural_ground_m(
    frame: GridFrame, terrain: Sequence[TriangleMesh], level: NDArray[np.bool_]
) -> NDArray[np.float64] | None:
    """Return the height of the ground in every column before anything is dug, (X, Y) float64 metres.

    It is the terrain's, the highest at the column's corners, to whole layers of cells; 0 where there is none. The yard
    and the access of trucks are made level, at the median of their terrain.

    ``level``: (X, Y) the columns of yard and access.

    Returns:
        The heights; None if they are 0 everywhere.
    """
    x, y = (frame.origin_m[axis] + frame.voxel_size_m * np.arange(level.shape[axis] + 1) for axis in range(2))
    at = _highest(terrain, np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1))
    highest = np.fmax.reduce([at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:]])
    found_m: NDArray[np.float64] = np.where(np.isnan(highest), 0.0, _whole(highest, frame))
    if level.any():
        found_m[level] = _whole(np.median(found_m[level]), frame)
    return found_m if found_m.any() else None


class Ground:
    """How parts lie to the ground of a site: how far it is dug out for them, and which of them stand on it.

    Args:
        frame: Frame of the grid.
        columns: (X, Y) of the grid.
        natural_m: From `natural_ground_m`; None: 0 everywhere.
        parts: What is set, of any means.
    """

    def __init__(
        self,
        frame: GridFrame,
        columns: tuple[int, int],
        natural_m: NDArray[np.float64] | None,
        parts: Sequence[Component],
    ) -> None:
        self._frame, self._parts = frame, parts
        self._natural_m = np.zeros(columns) if natural_m is None else natural_m
        # The height of the lowest part in every column; inf where there is none.
        self._lowest_m = np.full(columns, np.inf)
        for part in parts:
            (x, y), foot_m = _feet(frame, part)
            np.minimum.at(self._lowest_m, (x, y), foot_m)

    @classmethod
    def of(cls, site: Site, parts: Sequence[Component] | None = None) -> Ground:
        """Return the ground of a site with its parts, or with some of them."""
        return cls(site.frame, site.shape[:2], site.natural_ground_m, site.components if parts is None else parts)

    def tops(self) -> NDArray[np.int32]:
        """Return the highest layer that the ground fills in every column once it is dug out, (X, Y) int32.

        It is dug to the underside of each part that is set below it, and around it, with ``WORKING_SPACE_M`` to work
        in, but not from under parts that stand on it.
        """
        ground_m, lowest_m = self._natural_m, self._lowest_m
        below_m = np.where(lowest_m < ground_m - _EPS_M, lowest_m, np.inf)
        if np.isfinite(below_m).any():
            reach = 2 * whole_cells(WORKING_SPACE_M, self._frame.voxel_size_m) + 1
            around_m = minimum_filter(below_m, size=reach, mode="constant", cval=np.inf)
            ground_m = np.minimum(ground_m, np.where(lowest_m <= ground_m + ON_GROUND_M, lowest_m, around_m))
        layers = np.floor((ground_m - self._frame.origin_m[2]) / self._frame.voxel_size_m + 1e-6).astype(np.int32)
        return np.maximum(layers - 1, 0)

    def carries(self, gap_m: float) -> list[bool]:
        """Return which parts stand on the ground: at most ``gap_m`` above its natural height, no part under them."""
        highest_m = np.minimum(self._lowest_m, self._natural_m) + gap_m
        feet = (_feet(self._frame, part) for part in self._parts)
        return [bool((foot_m <= highest_m[x, y]).any()) for (x, y), foot_m in feet]

    def spanning(self) -> list[bool]:
        """Return which parts are as low as the ground and yet over other parts, such as the ceiling of a basement."""
        low = (bool(part.mesh.bounds_m[0, 2] <= ON_GROUND_M) for part in self._parts)
        return [is_low and not stands for is_low, stands in zip(low, self.carries(ON_GROUND_M), strict=True)]


def ground_cells(tops: NDArray[np.int32], shape: IntVec) -> NDArray[np.int32]:
    """Return the (N, 3) int32 cells of the ground: every column up to its top layer."""
    return np.argwhere(np.arange(shape[2], dtype=np.int32) <= tops[:, :, None]).astype(np.int32)


def cranes_on_ground(
    config: SiteConfig, cranes: Sequence[TowerCrane], frame: GridFrame, natural_m: NDArray[np.float64] | None
) -> tuple[TowerCrane, ...]:
    """Return the cranes of a site file, those without a height of their own at the height of their ground.

    ``cranes``: its cranes, from `cranes_of`; ``natural_m``: (X, Y) height of the ground; None: 0 everywhere.
    """
    if natural_m is None or len(config.cranes) != len(cranes):  # a site without a crane has a table that says so
        return tuple(cranes)
    found = []
    for given, crane in zip(config.cranes, cranes, strict=True):
        if given.base_m is None or len(given.base_m) < 3:
            x, y, _ = np.clip(frame.cell_of(crane.base_m), 0, [*(np.array(natural_m.shape) - 1), 0])
            crane = replace(crane, base_m=(*crane.base_m[:2], float(natural_m[x, y])))
            follows = config.moves or follows_foot(config, given)
            crane = raised(crane, crane.base_m[2]) if follows else crane
        found.append(crane)
    return tuple(found)


def _feet(frame: GridFrame, part: Component) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return the columns of a part's cells, (2, N), and the height of each cell; exact for its lowest cells."""
    x, y, z = part.shape.cells.T + np.array(part.target_vox, np.int32)[:, None]
    height_m = frame.origin_m[2] + frame.voxel_size_m * z
    height_m[z == part.target_vox[2]] = part.mesh.bounds_m[0, 2]
    return np.stack([x, y]), height_m


def _highest(terrain: Sequence[TriangleMesh], at_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the highest surface at (..., 2) points on plan; NaN where there is none."""
    return heights_at(terrain, at_m.reshape(-1, 2)).reshape(at_m.shape[:-1])


def _whole(height_m: NDArray[np.float64] | np.floating, frame: GridFrame) -> NDArray[np.float64]:
    return np.ceil(np.asarray(height_m) / frame.voxel_size_m - _LEVEL_SHARE) * frame.voxel_size_m + 0.0
