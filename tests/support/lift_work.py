"""Parts to lift from a yard, as the estimates of set-ups take them."""

from __future__ import annotations

import numpy as np

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
    )
