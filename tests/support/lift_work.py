"""Parts to lift from a yard, as the estimates of set-ups take them."""

from __future__ import annotations

import numpy as np
import shapely

from bimvox.library.set_up_search.placed import Picks, room_in
from bimvox.library.set_up_search.timed import Ways
from bimvox.site.set_ups import LiftWork


def work_of(places, masses, yard, closed=None) -> LiftWork:
    count = len(places)
    return LiftWork(
        places_m=np.array(places, np.float64).reshape(-1, 2),
        tops_m=np.linspace(1.0, 10.0, count),
        heights_m=np.full(count, 1.0),
        masses_kg=np.array(masses, np.float64),
        standing_s=np.full(count, 600.0),
        yard_m=np.array(yard, np.float64).reshape(-1, 2),
        closed=np.zeros(count, np.bool_) if closed is None else np.array(closed),
        rooms=np.full((count, 2), None),
    )


def ways_of(work: LiftWork, size_m: float = 1.0, **more) -> Ways:
    """Return the ways of parts of a size on plan, picked in a yard around their places of the yard."""
    low, high = work.yard_m.min(axis=0) - 1.0, work.yard_m.max(axis=0) + 1.0
    yard = ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]))
    count = len(work.places_m)
    around_m = np.tile(0.5 * size_m * np.array([[-1.0, -1.0], [1.0, 1.0]]), (count, 1, 1))
    around_m = more.pop("around_m", around_m)
    picks = picks_in(
        (yard,), work.yard_m, around_m, more.pop("taken_m2", np.zeros(count)), turns=more.pop("turns", False)
    )
    far_m = np.array([[-1e3, -1e3], [1e3, 1e3]])
    return Ways(work, picks, around_m, more.pop("bounds_m", far_m), **more)


def picks_in(yard, points_m, around_m, taken_m2, *, turns=False) -> Picks:
    """Return the picks of parts, given by their corners as seen from their hooks, at points of a yard."""
    area = shapely.union_all([shapely.Polygon(one) for one in yard])
    rooms = np.array([[room_in(area, one), room_in(area, turned_m(one) if turns else one)] for one in around_m])
    return Picks(area.area, points_m, rooms, taken_m2)


def turned_m(around_m) -> np.ndarray:
    """Return (2, 2) lowest and highest corner of a part that is turned by a quarter about its hook."""
    (low_x, low_y), (high_x, high_y) = around_m
    return np.array([[-high_y, low_x], [-low_y, high_x]])
