"""Defaults for the keys that a site file leaves out, from the building: cell size, ground, areas, crane."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import ASSUMED, Building, Casting, Element, Role, TriangleMesh
from bimvox.bim.kinds.kind import Confidence
from bimvox.crane.machine import Machine, carries_most
from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.sectors import capacities_kg, sectors_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import GridTooLargeError, InputError, SelectionError
from bimvox.site.access_guess import proposed_access
from bimvox.site.catalogue import catalogue, machine_called, machines_of
from bimvox.site.config.crane import CraneConfig, SetUpConfig
from bimvox.site.config.gear_file import gear_by_crane
from bimvox.site.config.rules import RulesConfig, YardConfig
from bimvox.site.config.site_config import ComponentConfig, MeansConfig, ModelConfig, Polygon, SiteConfig
from bimvox.site.crane_guess import Chosen, CraneFit, Wanted, best_set_up, compare_cranes, fit_here
from bimvox.site.default_rules import FAR_FROM_GROUND_M, TRUCK_KG
from bimvox.site.demand import hook_above_m, means_by, rigs_of
from bimvox.site.ground import ground_level
from bimvox.site.machine import crane_config, cranes_of, machine_config
from bimvox.site.map_frame import read_from_map
from bimvox.site.means import SAY_WHAT, Means, Reasoned, beyond_road, cast_alike, may_be_cast, nothing_to_lift
from bimvox.site.moving_guess import MovingCrane, best_moving, fit_of_moving, meanwhile
from bimvox.site.parts import entries_by_id
from bimvox.site.placement import built_bounds_m, dominant_yaw_rad, place_building, site_extent, top_m
from bimvox.site.set_ups import ground_plan
from bimvox.site.yard_guess import yard_need, yards_next_to

# What a crane is sized for: no part of doubtful kind or mass makes it larger than the usual ones.
#
# Concrete that nobody says is precast may as well be cast in place. If only a very large crane lifts such a part, that
# is the likelier reading of the model: the part is cast, and the crane is chosen for the others. What else is doubtful,
# such as a roof of timber that is drawn in one piece, is not cast: init and plan name it as a part to be set by other
# means.

USUAL_TM = 300.0
"""Load moment of the largest tower cranes that are usual in building (professional judgement)."""

_CAST_WHY = (
    f"no usual crane (up to {USUAL_TM:g} tm) lifts it, or most of its type: concrete that is not said to be precast is "
    "cast in place"
)

Yards = tuple[Polygon, ...]
WantedFor = Callable[[Sequence[Element]], tuple[Sequence[Yards], Wanted]]
"""Returns candidate yards for parts, and what a crane for them is chosen for."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sized:
    """A crane, its yard, and what it is not sized for.

    Attributes:
        yards: The yard.
        crane: The crane.
        cast: Ids of the parts that are cast in place instead.
        serves: How many of the others it lifts from its place.
    """

    yards: Yards
    crane: TowerCrane
    cast: tuple[str, ...] = ()
    serves: int = 0


def _proposed_for(
    lifted: Sequence[Element], wanted_for: WantedFor, limits: MeansConfig, stated: Collection[str] = frozenset()
) -> _Sized:
    """Return the crane and the yard for parts if nobody asks for a machine.

    It is a hammerhead, or of another kind if no hammerhead lifts any of them.
    """
    for machines in (machines_of("hammerhead"), catalogue()):
        sized = _sized_for(lifted, machines, wanted_for, limits, stated)
        if sized.serves:
            return sized
    rest = [one for one in lifted if one.id not in sized.cast]
    largest = max(catalogue(), key=lambda machine: carries_most(machine.cranes).chart.capacity_kg[0])
    strongest = replace(largest, cranes=(carries_most(largest.cranes),))
    (fit,) = compare_cranes(wanted_for(rest)[1].with_yard(sized.yards), [strongest])
    raise SelectionError(
        f"nothing to lift: no machine of the catalogue lifts any of the {len(rest):,} parts; the largest, "
        f"{fit.machine}, {fit.reason}",
        hint=f"for a larger machine, --crane {fit.machine} writes a site file to put its load chart into; {SAY_WHAT}",
    )


def _sized_for(
    lifted: Sequence[Element],
    machines: Sequence[Machine],
    wanted_for: WantedFor,
    limits: MeansConfig,
    stated: Collection[str] = frozenset(),
) -> _Sized:
    """Return the crane and the yard for parts.

    No part is cast if all of the machines are usual, or none is. ``stated`` are the parts of which the site file says
    that the crane lifts them.
    """
    usual = [machine for machine in machines if machine.load_moment_tm <= USUAL_TM]
    if not usual or len(usual) == len(machines):
        yards, crane, unserved = _best(machines, *wanted_for(lifted))
        return _Sized(yards, crane, serves=len(lifted) - len(unserved))
    is_doubtful = {one.id: one.id not in stated and _is_doubtful(one, limits) for one in lifted}
    yards, crane, unserved = _best(usual, *wanted_for(lifted))
    if not all(is_doubtful[name] for name in unserved):
        # A part of which the model leaves no doubt needs a larger crane; the doubtful ones do not make it larger still.
        sensible = [one for one in lifted if not (one.id in unserved and is_doubtful[one.id])]
        yards, crane, _ = _best(machines, *wanted_for(sensible))
        all_of_it = wanted_for(lifted)[1]
        unserved = _unserved(crane, yards, all_of_it.with_whole_chart() or all_of_it)
    unlifted = {one.id for one in lifted if one.id in unserved and is_doubtful[one.id] and may_be_cast(one, limits)}
    alike = cast_alike(unlifted, [one for one in lifted if one.id not in stated], limits)
    cast = tuple(one.id for one in lifted if one.id in alike)
    rest = [one for one in lifted if one.id not in cast]
    if not cast:
        return _Sized(yards, crane, serves=len(lifted) - len(unserved))
    if not rest:
        raise SelectionError(
            f"nothing to lift: no usual crane (up to {USUAL_TM:g} tm) lifts any of the {len(lifted):,} parts, and "
            "nothing says that they are precast, so they are cast in place",
            hint=f"if they are lifted, give a larger crane, such as --crane {machines[-1].name}; {SAY_WHAT}",
        )
    again = _sized_for(rest, machines, wanted_for, limits, stated)
    return replace(again, cast=(*cast, *again.cast))


def _with_cast(entries: Sequence[ComponentConfig], cast: Sequence[str]) -> tuple[ComponentConfig, ...]:
    """Return the site file's tables of parts, with those that are cast in place."""
    known = {entry.global_id for entry in entries}
    values = {"means": "in_situ", "why": _CAST_WHY}
    changed = [entry.model_copy(update=values) if entry.global_id in cast else entry for entry in entries]
    new = (ComponentConfig.model_validate({"global_id": name, **values}) for name in cast if name not in known)
    return (*changed, *new)


def _is_doubtful(element: Element, limits: MeansConfig) -> bool:
    """Return whether a part may not go up in one piece, or may be much lighter than it is taken to be."""
    if element.stated_means is not None:
        return False
    is_guessed = element.volume_guessed and element.mass_uncertainty >= ASSUMED
    if may_be_cast(element, limits) or is_guessed:
        return True
    if element.casting is Casting.PRECAST:
        return False
    return element.judgement.confidence is Confidence.ASSUMED or beyond_road(element, limits) is not None


def _best(
    machines: Sequence[Machine], candidates: Sequence[Yards], wanted: Wanted
) -> tuple[Yards, TowerCrane, frozenset[str]]:
    """Return the yard with the best set-up, its crane, and the parts that it does not serve; ties: the earlier yard.

    Where no set-up serves all parts with the usual share of its chart, the whole chart counts, if the site file leaves
    that open.
    """
    found = _best_by(machines, candidates, wanted)
    if not found[2] or (whole := wanted.with_whole_chart()) is None:
        return found
    return min((found, _best_by(machines, candidates, whole)), key=lambda one: len(one[2]))


def _best_by(
    machines: Sequence[Machine], candidates: Sequence[Yards], wanted: Wanted
) -> tuple[Yards, TowerCrane, frozenset[str]]:
    best: tuple[Chosen, Yards] | None = None
    for yards in candidates:
        found = best_set_up(machines, wanted.with_yard(yards))
        if found is not None and (best is None or found.rank < best[0].rank):
            best = found, yards
    if best is None:
        raise InputError(
            "no crane has a place around the building, clear of the yard and within the plot",
            hint="give [crane] base_m in the site file, or move the yard",
        )
    return best[1], best[0].crane, _unserved(best[0].crane, best[1], wanted)


def _unserved(crane: TowerCrane, yards: Yards, wanted: Wanted) -> frozenset[str]:
    """Return the parts that a crane does not serve from where it stands."""
    return frozenset(part.component for part in fit_here(wanted.with_yard(yards), crane).unserved)


VOXEL_SIZES_M = (0.1, 0.2, 0.25, 0.5, 1.0)
PLANNING_CELLS = 2_500_000
"""Most cells of a site that plans quickly; the finest cell size below this limit is used."""

_BORDER_M = 1.0  # of the construction area around the building
_ROUNDED_M = 2.0**-20  # about a micrometre; no decimal or inch length lies halfway between two multiples


def guess_site(
    building: Building, model: ModelConfig, *, name: str | None = None, machines: Sequence[Machine] = ()
) -> SiteConfig:
    """Return a complete site file for a building.

    Args:
        building: As read with the options of ``model``.
        model: Its ``[model]`` table: the path as the site file is to name it, and the options; the yaw is guessed.
        name: Name of the site; default: the model file's name.
        machines: Machines to choose from; empty: the hammerheads of the catalogue.
    """
    model = model.model_copy(update={"yaw_deg": round(math.degrees(dominant_yaw_rad(building)), 12)})
    rules = RulesConfig(truckload_kg=TRUCK_KG)
    config = SiteConfig(name=name or model.path.stem, model=model, rules=rules, yard=YardConfig())
    files = dict(machine.file for machine in machines if machine.file is not None)
    return complete_config(config.with_machine_files(files), building, machines)


def ground_why(config: SiteConfig, building: Building) -> str:
    """Return what the ground of a complete site file was taken from; empty if it is not what the model says."""
    found = ground_level(building)
    return found.why if config.model.ground_m == found.height_m else ""


def cranes_that_fit(
    config: SiteConfig, building: Building, machines: Sequence[Machine] = ()
) -> tuple[CraneFit | None, tuple[CraneFit, ...]]:
    """Return how the crane of a complete site file serves it, and how each machine would, on its best base.

    ``machines``: the machines to compare; empty: those of the catalogue.

    Returns:
        None for the crane of a site without one. The machines are in the order given, those of the catalogue by size.
    """
    placed, lifted = _placed_and_lifted(config, building)
    size_m = config.model.voxel_size_m or VOXEL_SIZES_M[0]
    height_m, plan = top_m(placed) + 2 * size_m, ground_plan(placed.elements)
    rigs, cranes = rigs_of(config, lifted), cranes_of(config)
    own = None
    if cranes:
        chosen = rigs if gear_by_crane(config, 1)[0] is not None else None
        wanted = Wanted(config, lifted, plan, height_m, chosen)
        if config.moves:
            own = fit_of_moving(cranes, wanted, lifted, *meanwhile(placed.elements, lifted))
        else:
            own = fit_here(wanted, cranes[0])
    return own, tuple(compare_cranes(Wanted(config, lifted, plan, height_m, rigs), machines or catalogue()))


def complete_config(config: SiteConfig, building: Building, machines: Sequence[Machine] = ()) -> SiteConfig:
    """Return a site file with all missing keys filled in.

    ``config``: the site file; its own values stay, in the site's frame; ``machines``: machines to choose from if the
    site file has no crane; empty: the hammerheads of the catalogue.

    Raises:
        SelectionError: If there is nothing to lift.
        ConfigError: If the site file does not fit the building.
        InputError: If no crane can serve the site.
    """
    config = read_from_map(config, building)
    if config.model.ground_m is None:
        config = config.at_ground(ground_level(building).height_m)
    placed, lifted = _placed_and_lifted(config, building)
    _check_ground(config, placed)
    return complete_with_placed(config, placed, lifted, machines)


def _check_ground(config: SiteConfig, placed: Building) -> None:
    low_m, high_m = built_bounds_m(placed.elements)[:, 2].tolist()
    if low_m > FAR_FROM_GROUND_M or high_m < -FAR_FROM_GROUND_M:
        where = f"{low_m:,.0f} m below" if low_m > 0 else f"{-high_m:,.0f} m above"
        raise config.error(
            "model.ground_m",
            f"puts the ground {where} all parts",
            hint="leave it out, or see `bimvox init`, which takes it from the model",
        )


def complete_with_placed(
    config: SiteConfig, placed: Building, lifted: Sequence[Element], machines: Sequence[Machine] = ()
) -> SiteConfig:
    """Return a site file with areas, crane and cell size filled in.

    The same parts give the same choice, also if their coordinates were rounded differently: only their position to
    the micrometre counts.

    Args:
        config: The site file; its own values stay.
        placed: The building in the site frame.
        lifted: Those of its elements that are lifted.
        machines: Cranes to choose from; see `complete_config`.

    Raises:
        SelectionError: If there is nothing to lift.
        ConfigError: If the site file does not fit the building.
        InputError: If no crane can serve the site.
    """
    if config.areas.construction is None or config.areas.yard is None or config.crane is None:
        there = {element.id for element in lifted}
        rounded = replace(placed, elements=tuple(map(_rounded, placed.elements)))
        config = _with_areas_and_crane(config, rounded, [e for e in rounded.elements if e.id in there], machines)
    size_m = config.model.voxel_size_m or _planning_voxel_size_m(config, placed)
    return config.model_copy(update={"model": config.model.model_copy(update={"voxel_size_m": size_m})})


def _rounded(element: Element) -> Element:
    vertices_m = np.round(element.mesh.vertices_m / _ROUNDED_M) * _ROUNDED_M + 0.0
    return replace(element, mesh=TriangleMesh(vertices_m, element.mesh.faces))


def _placed_and_lifted(config: SiteConfig, building: Building) -> tuple[Building, list[Element]]:
    """Return the building in the site frame, and the elements that are lifted."""
    placed = placed_on_site(config, building)
    return placed, lifted_of(config, placed)


def placed_on_site(config: SiteConfig, building: Building) -> Building:
    """Return the building in the site frame; if the site file gives no height of the ground, at that of the model."""
    if config.model.ground_m is None:
        config = config.at_ground(ground_level(building).height_m)
    return place_building(config, building)[0]


def lifted_of(config: SiteConfig, placed: Building) -> list[Element]:
    """Return the elements of a building, in the site frame, that a site file's cranes lift.

    Raises:
        SelectionError: If there are none.
    """
    means = means_on_site(config, placed)
    lifted = [one for one in placed.elements if one.id in means and means[one.id].means is Means.CRANE]
    if not lifted:
        raise nothing_to_lift(list(means.values()))
    return lifted


def means_on_site(config: SiteConfig, placed: Building) -> dict[str, Reasoned]:
    """Return how each part of a building, in the site frame, gets to its place, by id; what is pinned stands there."""
    entries = entries_by_id(config, placed.elements)
    pinned = {element_id for element_id, entry in entries.items() if entry.pinned}
    parts = [one for one in placed.elements if one.role is Role.COMPONENT and one.id not in pinned]
    return means_by(config, parts, entries)


def _planning_voxel_size_m(config: SiteConfig, building: Building) -> float:
    """Return the finest usual cell size at which the whole site has at most 2.5 million cells."""
    cranes = cranes_of(config)
    grid = config.grid.model_copy(update={"low_m": config.grid.low_m[:2]}) if config.grid else None
    for size_m in VOXEL_SIZES_M[:-1]:
        model = config.model.model_copy(update={"voxel_size_m": size_m})
        try:
            _, shape = site_extent(config.model_copy(update={"model": model, "grid": grid}), building, *cranes)
        except GridTooLargeError:
            continue
        if shape[0] * shape[1] * shape[2] <= PLANNING_CELLS:
            return size_m
    return VOXEL_SIZES_M[-1]


def _with_areas_and_crane(
    config: SiteConfig, building: Building, lifted: list[Element], machines: Sequence[Machine]
) -> SiteConfig:
    footprint = built_bounds_m(building.elements)[:, :2]
    areas = config.areas
    if areas.construction is None:
        areas = areas.model_copy(update={"construction": _around(footprint)})
    construction = np.array(areas.construction)
    cranes = cranes_of(config)
    wants_crane = config.crane is None
    rough_m = config.model.voxel_size_m or _planning_voxel_size_m(config.model_copy(update={"areas": areas}), building)
    box = np.stack([construction.min(axis=0), construction.max(axis=0)])

    def candidates_for(parts: Sequence[Element]) -> list[tuple[Polygon, ...]]:
        if areas.yard is not None:
            return [areas.yard]
        gap_m = config.yard.gap_m if config.yard else 0.0
        need = yard_need(parts, rough_m, gap_m=gap_m, truckload_kg=config.rules.truckload_kg)
        return [(yard,) for yard in yards_next_to(box, need)]

    if wants_crane:
        with_areas, plan = config.model_copy(update={"areas": areas}), ground_plan(building.elements)
        height_m = top_m(building) + 2 * rough_m

        def wanted_for(parts: Sequence[Element]) -> tuple[list[tuple[Polygon, ...]], Wanted]:
            return candidates_for(parts), Wanted(with_areas, parts, plan, height_m, rigs_of(config, parts))

        entries = entries_by_id(config, building.elements)
        stated = {name for name, entry in entries.items() if entry.means == Means.CRANE.value}
        if machines:
            sized = _sized_for(lifted, machines, wanted_for, config.means, stated)
        else:
            sized = _proposed_for(lifted, wanted_for, config.means, stated)
        yards, crane = sized.yards, sized.crane
        config = config.model_copy(update={"component": _with_cast(config.component, sized.cast)})
        chosen: CraneConfig | tuple[CraneConfig, ...] | None = _table_of(crane, machines, lifted)
        rest = [one for one in lifted if one.id not in sized.cast]
        if crane.kind == "mobile" and sized.serves < len(rest):
            _, wanted = wanted_for(rest)
            beside = meanwhile(building.elements, rest)
            moving = best_moving(machines, wanted, rest, *beside, room_beside_m(config, rough_m))
            if moving is not None and moving.served > sized.serves:
                yards, chosen = moving.yard, table_in_set_ups(moving, machines, rest)
                areas = areas.model_copy(update={"construction": without(areas.construction, yards)})
    else:
        most_used = config.rules.usual_utilisation
        yards = max(
            candidates_for(lifted),
            key=lambda these: min((_reached(crane, these, lifted, most_used) for crane in cranes), default=0),
        )
        chosen = config.crane
    is_guessed = areas.yard is None
    config = _with_areas(config.model_copy(update={"areas": areas, "crane": chosen}), yard=yards)
    if not is_guessed or areas.access is not None:
        return config
    return _with_areas(config, access=proposed_access(config, building, lifted))


def without(construction: Polygon | None, yards: Yards) -> Polygon | None:
    """Return the construction area without what becomes yard: its largest piece, or what it was if that has holes."""
    if construction is None:
        return None
    left = shapely.Polygon(construction).difference(shapely.union_all([shapely.Polygon(one) for one in yards]))
    largest = max(shapely.get_parts(left), key=lambda one: float(one.area), default=shapely.Polygon())
    if largest.is_empty or len(largest.interiors):
        return construction
    return tuple((float(x), float(y)) for x, y in largest.exterior.coords[:-1])


def room_beside_m(config: SiteConfig, cell_m: float) -> float:
    """Return the room around a part that lies beside a crane: the yard's gap, and what whole cells add."""
    return max(config.yard.gap_m if config.yard else 0.0, cell_m) + cell_m


def table_in_set_ups(moving: MovingCrane, machines: Sequence[Machine], lifted: Sequence[Element]) -> CraneConfig:
    """Return the table of a mobile crane in several set-ups, or in one."""
    tables = [
        machine_config(facing(crane, [lifted[n] for n in own]), machines)
        for crane, own in zip(moving.cranes, moving.parts, strict=True)
    ]
    if len(tables) == 1:
        return tables[0]
    first, alike = tables[0].model_copy(update={"falls": None}), {}
    for key in ("heading_deg", "outriggers", "counterweight_kg", "jib"):
        values = [getattr(table, key) for table in tables]
        alike[key] = values[0] if values.count(values[0]) == len(values) else None
    setup = tuple(
        SetUpConfig(
            name=f"position {number}",
            base_m=table.base_m or (0.0, 0.0),
            boom_m=None if alike["jib"] is not None or table.jib is None else table.jib.length_m,
            **{key: None if value is not None else getattr(table, key) for key, value in alike.items() if key != "jib"},
        )
        for number, table in enumerate(tables, start=1)
    )
    return first.model_copy(update={**alike, "base_m": None, "setup": setup})


def _table_of(crane: TowerCrane, machines: Sequence[Machine], lifted: Sequence[Element]) -> CraneConfig:
    """Return the table of a crane that was chosen, which names its machine or the file of it."""
    if any(one.name == crane.name and one.file is not None for one in machines):
        return machine_config(facing(crane, lifted), machines)
    return crane_config(crane) if machine_called(crane.name) is None else machine_config(crane)


_HEADINGS = 24


def facing(crane: TowerCrane, lifted: Sequence[Element]) -> TowerCrane:
    """Return a mobile crane with sectors on the heading in which the part that uses most of its charts uses least."""
    if not sectors_of(crane) or crane.carrier is None or not lifted:
        return crane
    places = np.array([hook_above_m(element)[:2] for element in lifted]) - np.array(crane.base_m[:2])
    hung_kg = np.array([element.mass_kg for element in lifted]) + crane.tackle_kg
    slew_rad, radius_m = np.arctan2(places[:, 1], places[:, 0]), np.hypot(*places.T)
    turned = [
        replace(crane, carrier=replace(crane.carrier, heading_rad=2.0 * math.pi * n / _HEADINGS))
        for n in range(_HEADINGS)
    ]
    shares = [hung_kg / np.maximum(capacities_kg(one, slew_rad, radius_m), 1.0) for one in turned]
    return turned[min(range(_HEADINGS), key=lambda n: (float(shares[n].max()), float(shares[n].sum()), n))]


def _with_areas(config: SiteConfig, **areas: object) -> SiteConfig:
    return config.model_copy(update={"areas": config.areas.model_copy(update=areas)})


def _reached(crane: TowerCrane, yards: tuple[Polygon, ...], lifted: list[Element], most_used: float) -> int:
    """Return how many corners of a yard a given crane reaches with a typical part."""
    low_m, high_m = allowed_radii_m(crane, float(np.median([element.mass_kg for element in lifted])), most_used)
    radii = np.hypot(*(np.concatenate([np.array(yard) for yard in yards]) - np.array(crane.base_m[:2])).T)
    return int(((radii >= low_m) & (radii <= high_m)).sum())


def _around(footprint: NDArray[np.float64]) -> Polygon:
    """Return the building's bounding box plus 1 m, rounded outwards to half metres."""
    x0, y0 = (float(value) for value in np.floor((footprint[0] - _BORDER_M) * 2 + 1e-6) / 2)
    x1, y1 = (float(value) for value in np.ceil((footprint[1] + _BORDER_M) * 2 - 1e-6) / 2)
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
