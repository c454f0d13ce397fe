"""The proof of each part's place in the yard, and of the order in which deliveries come."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bimvox.proof.moment import Thing, beside
from bimvox.proof.site_rules import check_stored
from bimvox.proof.storage import check_truck, stands_on_something
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.proof import Check
from bimvox.site.component import Component, StoredPose
from bimvox.site.shape import erection_size_vox, stored_shape, turned_hook, turned_shape
from bimvox.site.site import Site


def check_deliveries(check: Check, site: Site, lifts: Sequence[Lift]) -> None:
    """Check that deliveries come in order, and that each fits onto a truck."""
    loads: dict[int, list[Lift]] = {}
    for lift in lifts:
        if lift.place is not None:
            loads.setdefault(lift.place.delivery, []).append(lift)
    for number, load in loads.items():
        check_truck(check, site, number, load)
    delivery = 0
    for lift in lifts:
        if lift.place is not None:
            check.look(
                lift.place.delivery >= delivery,
                f"{site.components[lift.component].id}: comes with an earlier delivery than the lift before",
            )
            delivery = lift.place.delivery
    missing = min(set(range(delivery + 1)) - loads.keys(), default=None) if loads else None
    check.look(missing is None, f"delivery {delivery} comes, but delivery {missing} does not")


def check_place(check: Check, site: Site, component: Component, place: YardPlace, present: Sequence[Thing]) -> None:
    """Check that a part lies in the yard as it may, and that it can be raised, erected and turned there."""
    cells = place.shape.cells + np.array(place.cell_vox)
    turned = stored_shape(component.shape, place.pose, place.turn)
    check.look(np.array_equal(turned.cells, place.shape.cells), f"{component.id}: stored in another shape than its own")
    inside = bool(((cells >= 0) & (cells < site.shape)).all())
    check.look(inside, f"{component.id}: stored outside the site")
    if not inside:
        return
    check.look(
        place.stack > 0 or stands_on_something(site, place),
        f"{component.id}: is stored neither on the ground nor on structure",
    )
    if component.start_vox is not None:
        check.look(
            place.cell_vox == component.start_vox,
            f"{component.id}: is stored at {place.cell_vox}, the site file says {component.start_vox}",
        )
    else:
        check.look(bool(site.yard[tuple(cells[:, :2].T)].all()), f"{component.id}: stored outside the yard")
    check_stored(check, component, place)
    size = np.array(erection_size_vox(turned_shape(component.shape, place.turn), place.pose))
    size[2] += place.rise_vox - 1
    low = np.array(place.cell_vox)
    raised = "erected" if place.pose is not StoredPose.AS_BUILT else "raised"
    first, last = low.tolist(), (low + size - 1).tolist()
    close = beside(present, first, last)
    check.look(True, "", samples=len(present) - len(close))
    for thing in close:
        hit = ((thing.cells >= low) & (thing.cells < low + size)).all(axis=1)
        check.look(not hit.any(), f"{component.id}: meets {thing.name} while it is {raised}")
    _check_turning(check, site, component, place, present)


def _check_turning(check: Check, site: Site, component: Component, place: YardPlace, present: Sequence[Thing]) -> None:
    """Check that the upright, raised part turns freely about its hook: in its corners' circle, at its height."""
    check.look(
        place.rise_vox == 1 or place.turn != 0,
        f"{component.id}: is raised by {place.rise_vox} cells, yet not turned",
    )
    if place.turn == 0:
        return
    shape, hook = component.shape, component.hook_offset_vox
    lies = np.array(place.cell_vox[:2]) + turned_hook(shape, hook, place.turn)[:2]
    axis = np.array(place.transit_start_vox[:2]) + hook[:2]
    check.look(bool((lies == axis).all()), f"{component.id}: does not turn about its hook")
    # The hook need not be at the same place within that column for the part as it lies: it moves first.
    x, y = component.hook_aside_vox
    lain = [(x, y), (-y, x), (-x, -y), (y, -x)][place.turn % 4]
    far = np.abs(shape.cells[:, :2] - np.array(component.hook_line_vox[:2])) + 0.5
    radius = float(np.hypot(*far.T).max() + np.hypot(lain[0] - x, lain[1] - y))
    low = place.cell_vox[2] + place.rise_vox
    high = low + int(shape.cells[:, 2].max()) + 1
    centre = axis + 0.5 + component.hook_aside_vox
    inside = (centre - radius >= -1e-9).all() and (centre + radius <= np.array(site.shape[:2]) + 1e-9).all()
    check.look(bool(inside) and high <= site.shape[2], f"{component.id}: turns beyond the site's boundary")
    # The circle fits into this box of cells.
    reach = int(np.ceil(radius)) + 2
    first, last = [*(axis - reach).tolist(), low], [*(axis + reach).tolist(), high - 1]
    close = beside(present, first, last)
    check.look(True, "", samples=len(present) - len(close))
    for thing in close:
        cells = thing.cells[(thing.cells[:, 2] >= low) & (thing.cells[:, 2] < high)]
        away = np.hypot(*np.maximum(np.abs(cells[:, :2] + 0.5 - centre) - 0.5, 0.0).T)
        check.look(bool((away >= radius - 1e-9).all()), f"{component.id}: meets {thing.name} while it is turned")
