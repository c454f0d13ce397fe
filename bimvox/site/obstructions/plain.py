"""Entries of an obstruction file without a fault, checked quickly: a file may hold a million of them.

Only what is left goes through the schema, which says what is wrong.
"""

from __future__ import annotations

from itertools import chain
from typing import Any

from bimvox.site.config.validation import MOST
from bimvox.site.obstructions.rows import Gathered
from bimvox.site.site import CRANE_ID, GROUND_ID

LONGEST_ID = 1000
LEAST_INDEX, END_INDEX = -(2**31), 2**31
PLAIN = object()
"""Takes the place of an entry that was gathered."""
_NUMBERS = {int, float}


def is_reserved(name: str) -> bool:
    """Return whether an id is that of something else on a site."""
    return name in (GROUND_ID, CRANE_ID) or name.startswith(f"{CRANE_ID}:")


def plain_or_table(gathered: Gathered, table: dict[str, Any]) -> object:
    """Gather a table that is a box, a cylinder or voxels without a fault, lengths in the file's unit.

    Returns:
        ``PLAIN`` if it is one, otherwise the table.
    """
    name = table.get("id")
    if type(name) is not str or len(table) != 2:
        return table
    if not 0 < len(name) <= LONGEST_ID or is_reserved(name) or not name.isprintable():
        return table
    box: Any = table.get("box")
    one: Any = table.get("cylinder")
    cells: Any = table.get("voxels")
    if _is_box(box):
        gathered.box(name, box["min"], box["max"])
    elif _is_cylinder(one):
        gathered.cylinder(name, one["base"], one["radius"], one["height"])
    elif _are_cells(cells):
        gathered.voxels(name, cells)
    else:
        return table
    return PLAIN


def _is_box(box: Any) -> bool:
    if type(box) is not dict or len(box) != 2:
        return False
    low, high = box.get("min"), box.get("max")
    if type(low) is not list or type(high) is not list or len(low) != 3 or len(high) != 3:
        return False
    if not _NUMBERS.issuperset(map(type, low)) or not _NUMBERS.issuperset(map(type, high)):
        return False
    a, b, c = low
    d, e, f = high
    return bool(-MOST <= a < d <= MOST and -MOST <= b < e <= MOST and -MOST <= c < f <= MOST)


def _is_cylinder(one: Any) -> bool:
    if type(one) is not dict or len(one) != 3:
        return False
    base: Any = one.get("base")
    radius: Any = one.get("radius")
    height: Any = one.get("height")
    if type(base) is not list or len(base) != 3 or not _NUMBERS.issuperset(map(type, (*base, radius, height))):
        return False
    x, y, z = base
    has_place = -MOST <= x <= MOST and -MOST <= y <= MOST and -MOST <= z <= MOST
    return bool(has_place and 0 < radius <= MOST and 0 < height <= MOST)


def _are_cells(cells: Any) -> bool:
    return (
        type(cells) is list
        and set(map(type, cells)) == {list}
        and set(map(len, cells)) == {3}
        and set(map(type, chain.from_iterable(cells))) == {int}
        and min(map(min, cells)) >= LEAST_INDEX
        and max(map(max, cells)) < END_INDEX
    )
