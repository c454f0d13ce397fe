"""A model that is placed on the map twice: by its geometry, and by its map conversion."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

_BEGINS = "the model is placed on the map twice"
_FAR_M = 10_000.0
"""Farther from the origin than a site reaches, so these are map coordinates."""
_ALIKE_M = 100_000.0


def placed_twice(georeference: Mapping[str, str | float], middle_m: ArrayLike) -> str | None:
    """Return a note if a model's geometry is in map coordinates already, and its map conversion moves it again.

    A conversion that brings far geometry closer to the origin, such as one between two maps, is no fault.

    Args:
        georeference: ``Building.georeference``.
        middle_m: (3,) middle of the geometry in the file's world coordinates, metres.
    """
    if "eastings_m" not in georeference:
        return None
    at = np.asarray(middle_m, np.float64)[:2]
    by = np.array([float(georeference["eastings_m"]), float(georeference["northings_m"])])
    yaw_rad = float(georeference.get("x_axis_yaw_rad", 0.0))
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    placed = by + np.array([[cos, -sin], [sin, cos]]) @ at
    own, added, total, apart = (float(np.hypot(*point)) for point in (at, by, placed, at - by))
    if min(own, added) < _FAR_M or (total < own / 2.0 and apart > _ALIKE_M):
        return None
    return (
        f"{_BEGINS}: its geometry lies at {_shown(at)} already, and its map conversion adds {_shown(by)}, which makes "
        f"{_shown(placed)}; export it with one of the two, before anything is set out by map coordinates"
    )


def is_about_place(note: str) -> bool:
    """Return whether a note says that a model is placed twice."""
    return note.startswith(_BEGINS)


def _shown(point: ArrayLike) -> str:
    x, y = np.asarray(point).tolist()
    return f"({x:,.1f}, {y:,.1f}) m"
