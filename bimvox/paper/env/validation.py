"""Checks of a site; each message begins with the name of the field."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from bimvox.paper.env.component import AXES, HUNG_LAYER, ComponentKind, PaperComponent, YardPose, above_slab, overlap

if TYPE_CHECKING:
    from bimvox.paper.env.spec import PaperSpec


def check_spec(spec: PaperSpec) -> None:
    """Raise an error for an impossible site.

    Raises:
        ValueError: The message names the field.
    """
    _check_shape(spec)
    _check_obstructions(spec)
    if not spec.components:
        raise ValueError("components: at least one is needed")
    for index, part in enumerate(spec.components):
        _check_component(spec, f"components[{index}]", part)
    for (i, first), (j, second) in combinations(enumerate(spec.components), 2):
        if overlap(first.box_at(first.target_vox), second.box_at(second.target_vox)):
            raise ValueError(f"components[{j}].target_vox: shares a cell with components[{i}]")
        if (
            first.start
            and second.start
            and overlap(first.start.box(first.length_vox), second.start.box(second.length_vox))
        ):
            raise ValueError(f"components[{j}].start: lies on components[{i}]")
    spec.building_order()
    for name in ("step_limit", "max_steps"):
        value = getattr(spec, name)
        if value is not None and value < 1:
            raise ValueError(f"{name}: {value} is less than one step")


def _check_shape(spec: PaperSpec) -> None:
    if len(spec.shape) != 3 or min(spec.shape) < 1 or spec.shape[2] <= HUNG_LAYER:
        raise ValueError(f"shape: {spec.shape} must be three numbers of cells, the last at least {HUNG_LAYER + 1}")
    if len(spec.construction_area) != 4:
        raise ValueError(f"construction_area: {spec.construction_area} must be x0, y0, x1, y1")
    x0, y0, x1, y1 = spec.construction_area
    if not (0 <= x0 < x1 <= spec.shape[0] and 0 <= y0 < y1 <= spec.shape[1]):
        raise ValueError(f"construction_area: {spec.construction_area} is empty or not inside the site {spec.shape}")
    if x1 - x0 == spec.shape[0] and y1 - y0 == spec.shape[1]:
        raise ValueError("construction_area: covers the whole slab and leaves no yard")


def _check_obstructions(spec: PaperSpec) -> None:
    for index, box in enumerate(spec.obstructions):
        low, high = box
        if any(low[a] >= high[a] for a in range(3)):
            raise ValueError(f"obstructions[{index}]: the box {box} is empty")
        if not above_slab(box, spec.shape):
            raise ValueError(f"obstructions[{index}]: the box {box} is not above the slab and inside {spec.shape}")
    drawn = spec.random_obstructions
    if drawn is None:
        return
    if not 0 <= drawn.fewest <= drawn.most:
        raise ValueError(f"random_obstructions: from {drawn.fewest} to {drawn.most} is not a range of numbers")
    if not (1 <= drawn.length_vox <= min(spec.shape[:2]) and 1 <= drawn.height_vox < spec.shape[2]):
        raise ValueError(
            f"random_obstructions: {drawn.length_vox} cells long and {drawn.height_vox} high do not fit into"
            f" {spec.shape}"
        )


def _check_component(spec: PaperSpec, name: str, part: PaperComponent) -> None:
    if part.length_vox < 1:
        raise ValueError(f"{name}.length_vox: {part.length_vox} is less than one cell")
    if part.axis not in AXES:
        raise ValueError(f"{name}.axis: {part.axis!r} is neither 'x' nor 'y'")
    if HUNG_LAYER + part.size_vox[2] > spec.shape[2]:
        raise ValueError(
            f"{name}.length_vox: a column of {part.length_vox} cells, upended and hoisted by one, does not fit under"
            f" the height of {spec.shape[2]} cells"
        )
    target = part.box_at(part.target_vox)
    if not above_slab(target, spec.shape):
        raise ValueError(f"{name}.target_vox: {part.target_vox} is not above the slab and inside {spec.shape}")
    x0, y0, x1, y1 = spec.construction_area
    (low_x, low_y, _), (high_x, high_y, _) = target
    if not (x0 <= low_x and y0 <= low_y and high_x <= x1 and high_y <= y1):
        raise ValueError(f"{name}.target_vox: {part.target_vox} is not over the construction area")
    for index, box in enumerate(spec.obstructions):
        if not spec.random_targets and overlap(target, box):
            raise ValueError(f"obstructions[{index}]: lies on the target of {name}")
    for serial in part.after or ():
        if not 1 <= serial <= spec.count:
            raise ValueError(f"{name}.after: there is no component {serial}; serial numbers go from 1 to {spec.count}")
    places = [part.start] if part.start is not None else _yard_places(spec, part)
    reasons = [why for why in (_why_not(spec, part, place) for place in places) if why]
    if part.start is not None and reasons:
        raise ValueError(f"{name}.start: {part.start} {reasons[0]}")
    if len(reasons) == len(places):
        raise ValueError(f"{name}.start: the yard has no room for {part.length_vox} cells in a row")


def _yard_places(spec: PaperSpec, part: PaperComponent) -> list[YardPose]:
    axes = (part.axis,) if part.kind is ComponentKind.BEAM else AXES
    return [YardPose(x, y, axis) for x in range(spec.shape[0]) for y in range(spec.shape[1]) for axis in axes]


def _why_not(spec: PaperSpec, part: PaperComponent, place: YardPose) -> str:
    """Return why a component cannot lie somewhere; empty if it can."""
    if place.axis not in AXES:
        return f"has an axis {place.axis!r}, which is neither 'x' nor 'y'"
    if part.kind is ComponentKind.BEAM and place.axis != part.axis:
        return f"lies along {place.axis}, but this beam is built in along {part.axis} and is never turned"
    lying = place.box(part.length_vox)
    (x0, y0, _), (x1, y1, _) = lying
    if not all(spec.in_yard(x, y) for x in range(x0, x1) for y in range(y0, y1)):
        return "is not in the yard"
    hung = part.box_at((place.x, place.y, HUNG_LAYER))
    if any(overlap(lying, box) or overlap(hung, box) for box in spec.obstructions):
        return "shares a cell with an obstruction, stored or hoisted by one cell"
    return ""
