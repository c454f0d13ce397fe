"""The content of an obstruction file, as plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox_pipeline.inspect.building import rounded_m

if TYPE_CHECKING:
    from bimvox.site.obstructions.obstruction_set import Obstruction, ObstructionSet, Vec3


def describe_obstruction(obstruction: Obstruction) -> dict[str, Any]:
    """Return an obstruction's form and bounding box: metres in the site's frame, cells for voxels."""
    import numpy as np

    from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Points, Voxels

    form = obstruction.form
    if isinstance(form, Box):  # there may be a million of them
        return {"id": obstruction.id, "form": "box", "low_m": _rounded_m(form.low_m), "high_m": _rounded_m(form.high_m)}
    document: dict[str, Any] = {"id": obstruction.id, "form": type(form).__name__.lower()}
    if isinstance(form, Voxels):
        cells = np.array(form.cells)
        return {
            **document,
            "cells": len(cells),
            "low_vox": cells.min(axis=0).tolist(),
            "high_vox": cells.max(axis=0).tolist(),
        }
    if isinstance(form, Cylinder):
        reach = np.array([form.radius_m, form.radius_m, 0.0])
        low = np.array(form.base_m) - reach
        high = np.array(form.base_m) + reach + np.array([0.0, 0.0, form.height_m])
    elif isinstance(form, Points):
        low, high = form.points_m.min(axis=0), form.points_m.max(axis=0)
        document |= {"points": len(form.points_m)}
    else:
        low, high = form.bounds_m
        document |= {"form": "mesh", "triangles": len(form.faces)}
    return {**document, "low_m": rounded_m(low), "high_m": rounded_m(high)}


def how_read(path: Path, found: ObstructionSet) -> dict[str, Any]:
    """Return the coordinates that a file states, and how a scan is read."""
    from bimvox.site.obstructions.point_file import is_scan, scan_in_words

    stated = found.coordinates or "not stated: those of the site file, or those that put it inside the site"
    read_as = {"read_as": scan_in_words(path)} if is_scan(path) else {}
    return {"coordinates": stated, **read_as}


def extent_of(described: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the box around all obstructions but those of cells, metres in the coordinates of the file."""
    boxes = [(one["low_m"], one["high_m"]) for one in described if "low_m" in one]
    if not boxes:
        return {}
    low = [min(values) for values in zip(*(low for low, _ in boxes), strict=True)]
    high = [max(values) for values in zip(*(high for _, high in boxes), strict=True)]
    return {"low_m": low, "high_m": high}


def _rounded_m(corner_m: Vec3) -> list[float]:
    """Return the same numbers if nothing is to be rounded, which saves memory."""
    x, y, z = corner_m
    rounded = [round(x, 4) + 0.0, round(y, 4) + 0.0, round(z, 4) + 0.0]
    return [x, y, z] if rounded == [x, y, z] and 0.0 not in corner_m else rounded  # -0.0 is rounded too
