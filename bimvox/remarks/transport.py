"""Parts that are heavier or larger than a lorry carries, and parts that need no crane."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.kept import kept
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about, metres, tonnes
from bimvox.site.component import Component
from bimvox.site.limits import FEW_HANDS_KG, ROAD_HEIGHT_M, ROAD_KG, ROAD_LENGTH_M, ROAD_WIDTH_M
from bimvox.site.upright_box import laid_flat_m
from bimvox.site.yard_rules import INLOADER_M, TRUCK_KG, TRUCK_M

TRANSPORT = "transport"
HAND_LOAD = "hand_load"

HAND_KG = 25.0
"""What one person lifts close to the body: HSE, Manual handling at work (INDG143), figure 1."""


def transport(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that needs an escort, or cannot go by road, or needs no crane."""
    rules = subject.site.rules
    truck_kg, truck_m = rules.truckload_kg or TRUCK_KG, (rules.yard and rules.yard.truck_m) or TRUCK_M
    for component in subject.lifted:
        if (found := _by_road(component, truck_kg, truck_m)) is not None:
            yield found
        if component.mass_kg <= HAND_KG:
            said = f"weighs {component.mass_kg:.0f} kg: one person carries that, yet it has a crane lift of its own"
            yield about(component, HAND_LOAD, Severity.MINOR, said)
        elif component.mass_kg <= FEW_HANDS_KG:
            said = f"weighs {component.mass_kg:.0f} kg: such parts are lifted by the bundle, not one by one"
            yield about(component, HAND_LOAD, Severity.MINOR, said)


def _by_road(component: Component, truck_kg: float, truck_m: tuple[float, float, float]) -> Remark | None:
    """Return a remark about a part that no ordinary lorry carries; it is loaded on the side that suits best."""
    length_m, width_m, height_m = _sizes_m(component.mesh)
    said = []
    panel = length_m <= INLOADER_M[0] and width_m <= INLOADER_M[2] and height_m <= INLOADER_M[1]
    if component.mass_kg > truck_kg:
        said.append(f"weighs {tonnes(component.mass_kg)} (a lorry carries {tonnes(truck_kg)})")
    if length_m > truck_m[0] and not panel:
        said.append(f"is {metres(length_m)} long (a lorry takes {metres(truck_m[0])})")
    if width_m > truck_m[1] and not panel:
        said.append(f"is {metres(width_m)} wide (a lorry takes {metres(truck_m[1])})")
    if height_m > truck_m[2] and not panel:
        said.append(f"is {metres(height_m)} high (a lorry takes {metres(truck_m[2])})")
    if not said:
        return None
    is_beyond = (
        component.mass_kg > ROAD_KG or length_m > ROAD_LENGTH_M or width_m > ROAD_WIDTH_M or height_m > ROAD_HEIGHT_M
    )
    what = ", ".join(said)
    if is_beyond:
        return about(component, TRANSPORT, Severity.SERIOUS, f"{what}: it cannot go by road in one piece")
    return about(component, TRANSPORT, Severity.MINOR, f"{what}: a special transport with a permit")


_sizes_m = kept(laid_flat_m)
