"""The orders that ``Sequence-v0`` compares with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bimvox.library.site import LoadedSite
from bimvox.planning.all_orders import best_of_all
from bimvox.planning.given_order import Order, PartToOrder

MOST_ORDERS = 5_000
"""``exact`` tries no more orders than this."""

_TRADES = ("IfcFooting", "IfcColumn", "IfcWall", "IfcBeam", "IfcSlab", "IfcStairFlight", "IfcRoof")
_LEVEL_M = 1.5


def trade(parts: tuple[PartToOrder, ...]) -> list[str]:
    """Return the order of a foreman: storey by storey, trade by trade, row by row from the near corner."""

    def turn(part: PartToOrder) -> tuple[float, ...]:
        kind = _TRADES.index(part.ifc_class) if part.ifc_class in _TRADES else len(_TRADES)
        x, y, z = part.target_m
        return (storey_m[part.storey], kind, round(z / _LEVEL_M), round(y), x)

    storey_m: dict[str, float] = {}
    for part in parts:
        storey_m[part.storey] = min(part.target_m[2], storey_m.get(part.storey, part.target_m[2]))
    needs = {part.id: {*part.after, *part.better_after} for part in parts}
    order: list[str] = []
    left = sorted(parts, key=turn)
    while left:
        ready = [part for part in left if needs[part.id].issubset(order)] or [
            part for part in left if set(part.after).issubset(order)
        ]
        order.append(ready[0].id)
        left.remove(ready[0])
    return order


def without_search(site: LoadedSite) -> LoadedSite:
    """Return a site for which the engine keeps its greedy sequence."""
    rules = replace(site.site.rules, order_search=False)
    return replace(site, site=replace(site.site, rules=rules))


Baseline = Callable[[LoadedSite], tuple[LoadedSite, Order | None] | None]
"""A site to the site that is planned and the order that is given (None: the engine's); None: not for this site."""


def _exact(site: LoadedSite) -> tuple[LoadedSite, Order | None] | None:
    best = best_of_all(site.site, MOST_ORDERS) if len(site.cranes) == 1 and len(site.components) <= 10 else None
    return None if best is None else (site, best.ids)


BASELINES: dict[str, Baseline] = {
    "trade": lambda site: (site, trade),
    "greedy": lambda site: (without_search(site), None),
    "search": lambda site: (site, None),
    "exact": _exact,
}
"""By name: the order of a foreman; the engine's greedy order; its local search; the best of all, if there are few."""
