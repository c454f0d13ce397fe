"""What a crane is sized for: no part of doubtful kind or mass makes it larger than the usual ones.

Concrete that nobody says is precast may as well be cast in place. If only a very large crane lifts such a part, that is
the likelier reading of the model: the part is cast, and the crane is chosen for the others. What else is doubtful, such
as a roof of timber that is drawn in one piece, is not cast: init and plan name it as a part to be set by other means.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

from bimvox.bim.building import Casting, Element
from bimvox.bim.kinds.kind import Confidence
from bimvox.bim.mass_uncertainty import ASSUMED
from bimvox.crane.machine import Machine, carries_most
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError, SelectionError
from bimvox.site.catalogue import catalogue, machines_of
from bimvox.site.config.site_config import ComponentConfig, MeansConfig, Polygon
from bimvox.site.crane_guess import Chosen, Wanted, best_set_up, compare_cranes, fit_here
from bimvox.site.means import SAY_WHAT, beyond_road, cast_alike, may_be_cast

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
class Sized:
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


def proposed_for(
    lifted: Sequence[Element], wanted_for: WantedFor, limits: MeansConfig, stated: Collection[str] = frozenset()
) -> Sized:
    """Return the crane and the yard for parts if nobody asks for a machine: see :func:`sized_for`.

    It is a hammerhead, or of another kind if no hammerhead lifts any of them.

    Raises:
        InputError: If no crane has a place.
        SelectionError: If all parts are cast, or no machine of the catalogue lifts any.
    """
    for machines in (machines_of("hammerhead"), catalogue()):
        sized = sized_for(lifted, machines, wanted_for, limits, stated)
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


def sized_for(
    lifted: Sequence[Element],
    machines: Sequence[Machine],
    wanted_for: WantedFor,
    limits: MeansConfig,
    stated: Collection[str] = frozenset(),
) -> Sized:
    """Return the crane and the yard for parts.

    Args:
        lifted: The parts, in the site frame.
        machines: Machines to choose from. If all are usual, or none is, no part is cast.
        wanted_for: What a crane for some of the parts is chosen for.
        limits: The site file's ``[means]`` table.
        stated: Ids of parts of which the site file says that the crane lifts them.

    Raises:
        InputError: If no crane has a place.
        SelectionError: If all parts are cast.
    """
    usual = [machine for machine in machines if machine.load_moment_tm <= USUAL_TM]
    if not usual or len(usual) == len(machines):
        yards, crane, unserved = _best(machines, *wanted_for(lifted))
        return Sized(yards, crane, serves=len(lifted) - len(unserved))
    is_doubtful = {one.id: one.id not in stated and _is_doubtful(one, limits) for one in lifted}
    yards, crane, unserved = _best(usual, *wanted_for(lifted))
    if not all(is_doubtful[name] for name in unserved):
        # A part of which the model leaves no doubt needs a larger crane; the doubtful ones do not make it larger still.
        sensible = [one for one in lifted if not (one.id in unserved and is_doubtful[one.id])]
        yards, crane, _ = _best(machines, *wanted_for(sensible))
        unserved = _unserved(crane, yards, wanted_for(lifted)[1])
    unlifted = {one.id for one in lifted if one.id in unserved and is_doubtful[one.id] and may_be_cast(one, limits)}
    alike = cast_alike(unlifted, [one for one in lifted if one.id not in stated], limits)
    cast = tuple(one.id for one in lifted if one.id in alike)
    rest = [one for one in lifted if one.id not in cast]
    if not cast:
        return Sized(yards, crane, serves=len(lifted) - len(unserved))
    if not rest:
        raise SelectionError(
            f"nothing to lift: no usual crane (up to {USUAL_TM:g} tm) lifts any of the {len(lifted):,} parts, and "
            "nothing says that they are precast, so they are cast in place",
            hint=f"if they are lifted, give a larger crane, such as --crane {machines[-1].name}; {SAY_WHAT}",
        )
    again = sized_for(rest, machines, wanted_for, limits, stated)
    return replace(again, cast=(*cast, *again.cast))


def with_cast(entries: Sequence[ComponentConfig], cast: Sequence[str]) -> tuple[ComponentConfig, ...]:
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
    """Return the yard with the best set-up, its crane, and the parts that it does not serve; ties: the earlier yard."""
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
    return frozenset(part.component for part in fit_here(wanted.with_yard(yards), crane).unserved)
