"""An erection sequence that the caller gives, as ids or by a function: checked, and with its places in the yard.

With several cranes it may also name the crane of a part.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from bimvox.errors import InputError, cut, listed, shown
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.faster_order import WORTH, busiest_s, travel_of
from bimvox.planning.order.relations import OrderGraph, Precedence, order_graph, precedence
from bimvox.planning.order.sequence import ErectionSequence, Sequencer
from bimvox.planning.preparation import Preparation
from bimvox.planning.stage import could_lift
from bimvox.planning.yard import allocate_yard
from bimvox.progress import Report
from bimvox.records.lift import YardPlace
from bimvox.site.assign import reached_from
from bimvox.site.site import Site


@dataclass(frozen=True, slots=True)
class PartToOrder:
    """A part as a function that makes the order sees it.

    Attributes:
        id: Its id, as the order names it.
        name: Its name in the model.
        ifc_class: For example ``IfcBeam``.
        mass_kg: Its mass.
        target_m: The lowest corner of its box at its place, site metres.
        is_lifted: Whether the crane lifts it; otherwise it is cast, built or set by hand at its turn.
        after: Ids of the parts that must come before it: what it rests on, and what the site file asks for.
        better_after: Ids of the parts that would be in its way if they came before it, or it in theirs: these come
            before it in the engine's order. If they do not, its lift may have no path.
        crane: Name of the crane that lifts it if the order names none; empty if none does.
        cranes: Names of all cranes that may lift it, by radius, capacity and site file.
        storey: Name of its storey in the model; empty if it has none.
    """

    id: str
    name: str
    ifc_class: str
    mass_kg: float
    target_m: tuple[float, float, float]
    is_lifted: bool
    after: tuple[str, ...]
    better_after: tuple[str, ...]
    crane: str = ""
    cranes: tuple[str, ...] = ()
    storey: str = ""


Turn = str | tuple[str, str]
"""The id of a part, or its id and the name of the crane that lifts it."""

Order = Sequence[Turn] | Callable[[tuple[PartToOrder, ...]], Iterable[Turn]]
"""Every part once, first lift first; or a function that returns this."""


def prepare_in_order(
    site: Site, order: Order, progress: Report | None = None, free: Collection[str] = ()
) -> tuple[Site, Preparation]:
    """Return the contacts and the yard of a site for an erection sequence that the caller gives.

    Args:
        site: The site.
        order: The sequence, or what makes it.
        progress: Called with (stage, done, total).
        free: Ids of the components whose crane the sequence may choose.

    Returns:
        The site, in which each part has the crane of the sequence, and what is prepared for it.

    Raises:
        InputError: If it is not every part once, a part comes before what it rests on or the site file asks for, a
            crane cannot lift its part, or the crane moves: its set-ups group the lifts.
        SequenceError: If no order satisfies the site file's ``before`` and ``after``.
    """
    if site.moving is not None:
        raise InputError(
            "order: the crane of this site moves, and its set-ups group the lifts",
            hint="leave the order to bimvox, or give the crane one place",
        )
    report: Report = progress or (lambda stage, done, total: None)
    report("contacts", 0, len(site.components))
    contacts = Contacts(site)
    relations = precedence(site, contacts, lambda done, total: report("order", done, total))
    graph, sequencer = order_graph(site, relations, contacts), Sequencer(site, relations, contacts)
    turns = _made(order, parts_to_order(site, relations, graph, free)) if callable(order) else list(order)
    named = [turn if isinstance(turn, tuple | list) and len(turn) == 2 else (turn, None) for turn in turns]
    chosen = _indices(site, [part for part, _ in named])
    _check_needs(site, relations, chosen)
    wanted = {part: crane for part, crane in zip(chosen, (crane for _, crane in named), strict=True) if crane}
    assigned = _with_cranes(site, wanted, free)
    places = yard_for(assigned, chosen, sequencer.waits_for)
    _check_cranes(site, assigned, places)
    sequence = ErectionSequence(chosen, sequencer.geometry_notes(), _unheld(relations, chosen))
    return assigned, Preparation(contacts, relations, sequence, places)


def _with_cranes(site: Site, wanted: dict[int, str], free: Collection[str]) -> Site:
    """Return a site whose parts have the cranes that an order names.

    Raises InputError: there is no such crane, or the site file names another one for a part.
    """
    number = {crane.name: n for n, crane in enumerate(site.cranes)}
    if unknown := [name for name in wanted.values() if name not in number]:
        raise InputError(
            f"order: no crane has the name {shown(unknown[0])}", hint=f"the cranes are {listed(number, most=5)}"
        )
    other = {part: number[name] for part, name in wanted.items() if site.components[part].crane != number[name]}
    if kept := [site.components[part] for part in other if site.components[part].id not in free]:
        raise InputError(
            f"order: the site file says that {site.cranes[kept[0].crane].name} lifts {kept[0].label}",
            hint="leave out its crane, or take [[component]] crane out of the site file",
        )
    if not other:
        return site
    return replace(
        site, components=tuple(replace(one, crane=other.get(one.index, one.crane)) for one in site.components)
    )


def _check_cranes(site: Site, assigned: Site, places: Sequence[YardPlace | None]) -> None:
    """Raise an InputError if a crane that the order names cannot lift its part from its place in the yard."""
    for before, part, place in zip(site.components, assigned.components, places, strict=True):
        if before.crane != part.crane and place is not None and not could_lift(site, before, place, part.crane):
            raise InputError(
                f"order: {site.cranes[part.crane].name} cannot lift {part.label} from its place in the yard",
                hint="name one of its `cranes` (bimvox.PartToOrder), or none",
            )


def yard_for(site: Site, order: tuple[int, ...], waits_for: Sequence[Sequence[int]]) -> tuple[YardPlace | None, ...]:
    """Return the places in the yard: the first free ones, unless those near the crane are more, or clearly faster."""
    plain = allocate_yard(site, order, waits_for=waits_for)
    if not site.cranes:
        return plain
    travels = [travel_of(site, crane) for crane in site.cranes]
    near = allocate_yard(site, order, *travels, waits_for=waits_for)
    lacking = [sum(place is None for place in places) for places in (plain, near)]
    if lacking[0] != lacking[1]:
        return plain if lacking[0] < lacking[1] else near
    slowest_s = [busiest_s(site, travels, order, places) for places in (plain, near)]
    return plain if slowest_s[0] <= WORTH * slowest_s[1] else near


def parts_to_order(
    site: Site, relations: Precedence, graph: OrderGraph, free: Collection[str] = ()
) -> tuple[PartToOrder, ...]:
    """Return the parts of a site as a function that makes the order sees them."""
    ids = [part.id for part in site.components]
    reached = reached_from(site)[0] if site.has_several_cranes else None

    def named(parts: Iterable[int]) -> tuple[str, ...]:
        return tuple(ids[i] for i in sorted(parts))

    found = []
    for part in site.components:
        needs = {*relations.supports[part.index], *relations.wanted[part.index]}
        x, y, z = part.mesh.bounds_m[0].tolist()
        others = graph.earlier[part.index] - needs
        is_lifted = part.means.value == "crane"
        own = site.cranes[part.crane].name if is_lifted and site.cranes else ""
        others_too = reached is not None and part.id in free
        cranes = [
            one.name
            for n, one in enumerate(site.cranes)
            if others_too and reached is not None and reached[part.index, n]
        ]
        found.append(
            PartToOrder(
                part.id,
                part.name,
                part.ifc_class,
                part.mass_kg,
                (x, y, z),
                is_lifted,
                named(needs),
                named(others),
                own,
                tuple(dict.fromkeys([*([own] if own else []), *(cranes if is_lifted else [])])),
                part.storey or "",
            )
        )
    return tuple(found)


def _made(order: Callable[[tuple[PartToOrder, ...]], Iterable[Turn]], parts: tuple[PartToOrder, ...]) -> list[Turn]:
    try:
        return list(order(parts))
    except Exception as error:  # of anyone's code
        raise InputError(f"order raised {type(error).__name__}: {cut(' '.join(str(error).split()), 200)}") from error


def _indices(site: Site, given: Sequence[object]) -> tuple[int, ...]:
    known = {part.id: part.index for part in site.components}
    hint = "give the id of every part once, as in [lift.component.id for lift in plan.lifts]"
    if unknown := [one for one in given if not isinstance(one, str) or one not in known]:
        raise InputError(f"order: no part has the id {listed(map(shown, unknown), most=5)}", hint=hint)
    if doubled := [str(one) for one in dict.fromkeys(given) if given.count(one) > 1]:
        raise InputError(f"order: more than once: {listed(doubled, most=5)}", hint=hint)
    if missing := [part.label for part in site.components if part.id not in set(given)]:
        raise InputError(
            f"order: {len(missing):,} of {len(known):,} parts missing: {listed(missing, most=5)}", hint=hint
        )
    return tuple(known[str(one)] for one in given)


def _check_needs(site: Site, relations: Precedence, order: Sequence[int]) -> None:
    """Raise an InputError if a part comes before what it rests on, or what the site file asks for."""
    turn = {index: n for n, index in enumerate(order)}
    label = [part.label for part in site.components]
    broken = [
        f"{label[i]} comes before {label[j]}, " + ("on which it rests" if j in on else "as the site file forbids")
        for i, (on, wanted) in enumerate(zip(relations.supports, relations.wanted, strict=True))
        for j in sorted({*on, *wanted})
        if turn[j] > turn[i]
    ]
    if broken:
        raise InputError(
            f"order: {broken[0]}" + (f"; {len(broken) - 1:,} more like this" if len(broken) > 1 else ""),
            hint="a part comes after all of its `after` (bimvox.PartToOrder)",
        )


def _unheld(relations: Precedence, order: Sequence[int]) -> tuple[int, ...]:
    """Return the parts that come before any part that could hold them."""
    done: set[int] = set()
    found = []
    for i in order:
        needs_hold = not relations.supports[i] and not relations.grounded[i] and bool(relations.holds[i])
        if needs_hold and done.isdisjoint(relations.holds[i]):
            found.append(i)
        done.add(i)
    return tuple(found)
