"""From the coordinates of an obstruction file, of the site, the model or the map, into the site frame."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.errors import ObstructionFileError, listed
from bimvox.site.map_frame import NO_CONVERSION, Matrix
from bimvox.site.obstructions.obstruction_set import (
    CYLINDER,
    VOXELS,
    Box,
    Coordinates,
    Cylinder,
    Obstruction,
    ObstructionSet,
    Points,
    Rows,
    Voxels,
)
from bimvox.site.site import Site

_WORDS: dict[Coordinates, str] = {
    "map": "map coordinates",
    "site": "site coordinates",
    "model": "the model's coordinates",
}
"""In the order in which they are tried, after those that are expected."""
_FAR_M = 1000.0
"""Coordinates are taken for others only if that moves things by more than this: a small shift may be no mistake."""
_NAMED = 5
_READ_IN = "read in"
_FACES = np.array(
    [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6],
     [1, 3, 5], [3, 7, 5]], np.int32,
)  # fmt: skip
"""Faces of a box whose corner n has its high x, y, z where bit 0, 1, 2 of n is set; counter-clockwise from outside."""


@dataclass(frozen=True, slots=True)
class Survey:
    """What is known about the coordinates of the obstruction files of a site.

    Attributes:
        ifc_to_map: (4, 4) transform from the model's metres to map metres; None if the model has none.
        coordinates: In which a file is that does not state its own: those of the site file (an IFC or mesh file is in
            the model's).
    """

    ifc_to_map: Matrix | None = None
    coordinates: Coordinates = "site"


def in_site_frame(
    given: ObstructionSet, site: Site, survey: Survey, *, own_map: Matrix | None = None
) -> ObstructionSet:
    """Return the obstructions of a file in the site frame.

    A file that states its coordinates is read so. Of one that does not, an obstruction is read in those of ``survey``.
    If it lies outside the site then, but would lie inside in others that are more than 1 km away, it is read in those,
    and a note says so.

    Args:
        given: As read; ``coordinates`` says what the file states.
        site: The site.
        survey: What is known about the coordinates of its files.
        own_map: The (4, 4) transform from the file's metres to map metres, if it is a model with one of its own.

    Raises:
        ObstructionFileError: If the file is in map coordinates, but the model has no map conversion.
    """
    to_site = _transforms(site, survey)
    if given.coordinates is not None:
        if given.coordinates not in to_site:
            hint = 'add it to the model, or give site coordinates: coordinates = "site"'
            raise ObstructionFileError(given.name, NO_CONVERSION, key="coordinates", hint=hint)
        matrix = to_site[given.coordinates]
        if _is_identity(matrix):
            return given
        return _replaced(given, Rows.of(_moved(one, matrix) for one in given.obstructions))
    words = [survey.coordinates, *(name for name in _WORDS if name != survey.coordinates)]
    readings = [(_WORDS[name], to_site[name]) for name in words if name in to_site]
    if own_map is not None and "map" in to_site:
        readings.insert(0, ("map coordinates by its own map conversion", to_site["map"] @ np.array(own_map)))
    return _as_they_fit(given, site, readings)


def is_about_coordinates(note: str) -> bool:
    """Return whether a note says in which coordinates obstructions are read."""
    return re.match(f"[0-9,]+ obstructions? (is|are) {_READ_IN} ", note) is not None


def _transforms(site: Site, survey: Survey) -> Mapping[Coordinates, NDArray[np.float64]]:
    """Return the (4, 4) transforms into the site frame."""
    into: dict[Coordinates, NDArray[np.float64]] = {"site": np.eye(4), "model": site.site_to_ifc}
    if survey.ifc_to_map is not None:
        into["map"] = np.array(survey.ifc_to_map) @ site.site_to_ifc
    return {name: np.asarray(np.linalg.inv(matrix), np.float64) for name, matrix in into.items()}


def _as_they_fit(
    given: ObstructionSet, site: Site, readings: Sequence[tuple[str, NDArray[np.float64]]]
) -> ObstructionSet:
    """Return obstructions read in the first coordinates in which each meets the site's extent on plan."""
    first = readings[0][1]
    others = [(words, matrix) for words, matrix in readings[1:] if _apart_m(first, matrix, site) > _FAR_M]
    rows = Rows.of(given.obstructions)
    bounds = _bounds_m(rows) if others else np.empty((0, 2, 3))
    left = ~_meets_site(bounds, first, site)
    chosen: dict[int, NDArray[np.float64]] = {}
    notes = []
    for words, matrix in others:
        fits = left & _meets_site(bounds, matrix, site)
        numbers = np.flatnonzero(fits).tolist()
        chosen |= dict.fromkeys(numbers, matrix)
        left &= ~fits
        if numbers:
            names = listed((repr(rows.ids[n]) for n in numbers), _NAMED)
            said = "obstruction is" if len(numbers) == 1 else "obstructions are"
            notes.append(f"{len(numbers):,} {said} {_READ_IN} {words}: far outside the site otherwise: {names}")
    if not chosen and _is_identity(first):
        return _replaced(given, rows)
    moved = Rows.of(_moved(one, chosen.get(n, first)) for n, one in enumerate(rows))
    return replace(_replaced(given, moved), notes=(*given.notes, *notes))


def _replaced(given: ObstructionSet, obstructions: Sequence[Obstruction]) -> ObstructionSet:
    return replace(given, obstructions=obstructions, coordinates="site")


def _is_identity(matrix: NDArray[np.float64]) -> bool:
    return np.array_equal(matrix, np.eye(4))


def _apart_m(one: NDArray[np.float64], other: NDArray[np.float64], site: Site) -> float:
    """Return how far apart two readings put, on plan, what one of them puts at the site."""
    at = np.linalg.solve(one, [*site.frame.origin_m, 1.0])
    return float(np.hypot(*((other - one) @ at)[:2]))


def _meets_site(bounds_m: NDArray[np.float64], matrix: NDArray[np.float64], site: Site) -> NDArray[np.bool_]:
    """Return which of (N, 2, 3) boxes meet the site's extent on plan once they are moved."""
    x, y = bounds_m[:, :, 0], bounds_m[:, :, 1]
    corners = np.stack([x[:, [0, 0, 1, 1]], y[:, [0, 1, 0, 1]]], axis=2) @ matrix[:2, :2].T + matrix[:2, 3]
    low_m, high_m = site.frame.corner_of([0, 0, 0])[:2], site.frame.corner_of(np.array(site.shape))[:2]
    result: NDArray[np.bool_] = ((corners.max(axis=1) > low_m) & (corners.min(axis=1) < high_m)).all(axis=1)
    return result


def _bounds_m(rows: Rows) -> NDArray[np.float64]:
    """Return the (N, 2, 3) boxes around obstructions; NaN, which meets nothing, around those of cells."""
    bounds_m = rows.numbers_m.reshape(-1, 2, 3).copy()
    bounds_m[rows.kinds == VOXELS] = np.nan
    is_cylinder = rows.kinds == CYLINDER
    base_m, (radius_m, height_m) = rows.numbers_m[is_cylinder, :3], rows.numbers_m[is_cylinder, 3:5].T
    bounds_m[is_cylinder, 0] = base_m - np.stack([radius_m, radius_m, 0 * height_m], axis=1)
    bounds_m[is_cylinder, 1] = base_m + np.stack([radius_m, radius_m, height_m], axis=1)
    for n, one in rows.others.items():
        if isinstance(one.form, Points):
            bounds_m[n] = one.form.points_m.min(axis=0), one.form.points_m.max(axis=0)
        elif isinstance(one.form, TriangleMesh):
            bounds_m[n] = one.form.bounds_m
    return bounds_m


def _moved(one: Obstruction, matrix: NDArray[np.float64]) -> Obstruction:
    """Return an obstruction moved by a transform that keeps angles and the direction of z; cells stay what they are."""
    form = one.form
    if isinstance(form, Voxels) or _is_identity(matrix):
        return one
    if isinstance(form, TriangleMesh):
        return replace(one, form=TriangleMesh(_at(form.vertices_m, matrix), form.faces))
    if isinstance(form, Points):
        return replace(one, form=Points(_at(form.points_m, matrix)))
    if isinstance(form, Cylinder):
        scale = float(matrix[2, 2])
        x, y, z = np.round(_at([form.base_m], matrix)[0], 6).tolist()
        return replace(one, form=Cylinder((x, y, z), form.radius_m * scale, form.height_m * scale))
    corners = np.array([[(form.low_m, form.high_m)[n >> axis & 1][axis] for axis in range(3)] for n in range(8)])
    moved = np.round(_at(corners, matrix), 6) + 0.0
    if (np.abs(matrix[:2, :2]).min(axis=1) < 1e-9).all():  # a quarter turn: it stays upright along the axes
        low, high = moved.min(axis=0).tolist(), moved.max(axis=0).tolist()
        return replace(one, form=Box(tuple(low), tuple(high)))
    return replace(one, form=TriangleMesh(moved, _FACES))


def _at(points_m: Sequence[Sequence[float]] | NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 3) points moved by a (4, 4) transform."""
    points = np.c_[points_m, np.ones(len(points_m))]
    moved: NDArray[np.float64] = (points @ matrix.T)[:, :3]
    return moved
