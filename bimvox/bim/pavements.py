"""Pavements and yards modelled as one slab around a building: they are the ground that cranes stand on."""

from __future__ import annotations

import numpy as np

from bimvox.bim.building import BUILT, Building, Role

_REACH_M = 50.0
"""From the edge of such a slab, few jibs reach the middle of what stands on it."""
_THICKEST_M = 1.0


def pavements_as_ground(building: Building) -> Building:
    """Return a building whose pavements are ground, with a note.

    A pavement is a thin component that extends further than ``_REACH_M`` in each direction from the middle of all that
    is smaller. A mast next to it would not reach the building.
    """
    built = [n for n, one in enumerate(building.elements) if one.role in BUILT]
    bounds_m = np.array([building.elements[n].mesh.bounds_m for n in built]).reshape(-1, 2, 3)
    wide = (np.ptp(bounds_m, axis=1)[:, :2] > 2.0 * _REACH_M).all(axis=1)
    if not wide.any() or wide.all():
        return building
    middle_m = (bounds_m[~wide, 0].min(axis=0) + bounds_m[~wide, 1].max(axis=0))[:2] / 2.0
    around = (np.abs(bounds_m[:, :, :2] - middle_m) > _REACH_M).all(axis=(1, 2))
    thin = np.ptp(bounds_m, axis=1)[:, 2] <= _THICKEST_M
    found = {n for n, is_one in zip(built, wide & around & thin, strict=True) if is_one}
    found = {n for n in found if building.elements[n].role is Role.COMPONENT}
    if not found:
        return building
    verb = "slabs extend" if len(found) > 1 else "slab extends"
    said = f"{len(found)} {verb} more than {_REACH_M:g} m around the building, so the crane stands on it"
    return building.with_role(found, Role.GROUND, said)
