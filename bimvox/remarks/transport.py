"""Parts that are heavier or larger than a lorry carries, and parts that need no crane."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.kept import kept
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about, metres, tonnes
from bimvox.site.component import Component
from bimvox.site.limits import FEW_HANDS_KG, ROAD_HEIGHT_M, ROAD_KG, ROAD_LENGTH_M, ROAD_WIDTH_M
from bimvox.site.upright_box import sizes_m

TRANSPORT = "transport"
HAND_LOAD = "hand_load"

TRUCK_KG = 25_000.0
"""Payload of an articulated lorry: 40 t of Directive 96/53/EC less 14 to 16 t of tractor and trailer."""
TRUCK_LENGTH_M = 13.6
"""Loading length of a semi-trailer within the 16.5 m of Directive 96/53/EC."""
TRUCK_WIDTH_M = 3.0
"""2.55 m by Directive 96/53/EC; up to 3 m goes with a permanent permit and without an escort (German practice)."""
TRUCK_HEIGHT_M = 2.8
"""4.0 m by Directive 96/53/EC less the deck of a semi-trailer at 1.2 m."""
PANEL_HEIGHT_M, PANEL_LENGTH_M, PANEL_WIDTH_M = 3.65, 9.5, 1.5
"""A panel that stands between the wheels of an inloader, whose floor is 0.35 m above the road (data sheets)."""

HAND_KG = 25.0
"""What one person lifts close to the body: HSE, Manual handling at work (INDG143), figure 1."""


def transport(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that needs an escort, or cannot go by road, or needs no crane."""
    for component in subject.lifted:
        if (found := _by_road(component)) is not None:
            yield found
        if component.mass_kg <= HAND_KG:
            said = f"weighs {component.mass_kg:.0f} kg: one person carries that, yet it has a crane lift of its own"
            yield about(component, HAND_LOAD, Severity.MINOR, said)
        elif component.mass_kg <= FEW_HANDS_KG:
            said = f"weighs {component.mass_kg:.0f} kg: such parts are lifted by the bundle, not one by one"
            yield about(component, HAND_LOAD, Severity.MINOR, said)


def _by_road(component: Component) -> Remark | None:
    """Return a remark about a part that no ordinary lorry carries; it is loaded on the side that suits best."""
    length_m, width_m, height_m = _sizes_m(component.mesh)
    said = []
    panel = length_m <= PANEL_LENGTH_M and width_m <= PANEL_HEIGHT_M and height_m <= PANEL_WIDTH_M
    if component.mass_kg > TRUCK_KG:
        said.append(f"weighs {tonnes(component.mass_kg)} (a lorry carries {tonnes(TRUCK_KG)})")
    if length_m > TRUCK_LENGTH_M:
        said.append(f"is {metres(length_m)} long (a lorry takes {metres(TRUCK_LENGTH_M)})")
    if width_m > TRUCK_WIDTH_M and not panel:
        said.append(f"is {metres(width_m)} wide (a lorry takes {metres(TRUCK_WIDTH_M)})")
    if height_m > TRUCK_HEIGHT_M:
        said.append(f"is {metres(height_m)} high (a lorry takes {metres(TRUCK_HEIGHT_M)})")
    if not said:
        return None
    is_beyond = (
        component.mass_kg > ROAD_KG or length_m > ROAD_LENGTH_M or width_m > ROAD_WIDTH_M or height_m > ROAD_HEIGHT_M
    )
    what = ", ".join(said)
    if is_beyond:
        return about(component, TRANSPORT, Severity.SERIOUS, f"{what}: it cannot go by road in one piece")
    return about(component, TRANSPORT, Severity.MINOR, f"{what}: a special transport with a permit")


_sizes_m = kept(sizes_m)
