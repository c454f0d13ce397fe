"""The site file of each set-up, and the table of all."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bimvox.errors import FileError
from bimvox.files import read_input, write_atomically
from bimvox.library.set_up_search.pairs import names_of_two
from bimvox.library.set_up_search.set_up import Tried, why_lost
from bimvox_pipeline.studio.opened import SITE_SUFFIX, Opened
from bimvox_pipeline.studio.saving import as_text
from bimvox_pipeline.studio.setup import CraneSetup, Setup

_NUDGE_M = 1e-3
_STAMP = b"# bimvox optimise wrote the lines above, and may overwrite them while they are as they were: "
_DIGITS = 16
_COLUMNS = (
    "machine", "jib_m", "falls", "load_moment_tm", "x_m", "y_m", "second", "yard", "truckload_kg", "places", "parts",
    "parts_served", "estimated_hours", "estimated_cost", "estimated_utilisation", "currency", "why_lost",
)  # fmt: skip


def base_of(one: Tried) -> tuple[float, float]:
    """Return where the mast of a set-up's first crane stands."""
    assert one.crane is not None
    x, y, _ = one.crane.base_m
    return x, y


def set_up(opened: Opened, one: Tried) -> Setup:
    """Return the site's set-up with other cranes, and another yard and truckload if it has one."""
    (own,) = opened.setup.cranes
    if one.second is None:
        cranes = [CraneSetup(name=own.name, machine=one.machine, base_m=base_of(one), jib_m=one.jib_m, falls=one.falls)]
    else:
        first, second = names_of_two(own.name)
        cranes = [_one_of_two(one, first, own.height_m), _one_of_two(one.second, second, own.height_m)]
    more: dict[str, Any] = {}
    if one.yard is not None:
        more = {"yard": (one.yard.polygon,)}
        if one.yard.truckload_kg != opened.config.rules.truckload_kg:
            more["truckload_kg"] = one.yard.truckload_kg
    return opened.setup.model_copy(update={"cranes": tuple(cranes), **more})


def _one_of_two(one: Tried, name: str, given_m: float | None) -> CraneSetup:
    """Return a crane with its height: one of two may be raised to pass above the other.

    The height of the given crane would count as not set, and another machine would get a height of its own.
    """
    assert one.crane is not None
    height_m = one.crane.jib_height_m if one.crane.luffing is None else None
    if height_m is not None and height_m == given_m:
        height_m += _NUDGE_M
    return CraneSetup(
        name=name, machine=one.machine, base_m=base_of(one), height_m=height_m, jib_m=one.jib_m, falls=one.falls
    )


def written(opened: Opened, one: Tried) -> Path:
    """Write the site file of a set-up next to the given one; one that somebody has edited since is not overwritten.

    Raises:
        FileError: If there is one that was edited.
    """
    stem = opened.site.name.removesuffix(SITE_SUFFIX).removesuffix(".toml")
    which = "-least-used" if one.is_least_used else ""
    if one.yard is not None:
        which += "" if one.yard.number is None else f"-yard-{one.yard.number + 1}"
        which += f"-{one.yard.truckload_kg:g}kg"
    which += f"-place-{one.place}" if one.place else ""
    if one.second is not None:
        which += f"-and-{_rig(one.second)}"
    path = opened.site.with_name(f"{stem}-{_rig(one)}{which}{SITE_SUFFIX}")
    wanted = set_up(opened, one)
    text, _, _ = as_text(opened, opened.with_setup(wanted), wanted, path)
    data = _stamped(text.encode())
    before = read_input(path, may_be_empty=True) if path.exists() else None
    if before == data:
        return path
    if before is not None and _stamped(before) != before:
        raise FileError(path, "exists already and may hold edits", hint="rename it, then optimise again")
    write_atomically(path, data)
    return path


def _stamped(data: bytes) -> bytes:
    """Return a site file with its stamp in the last line: while that is true, nobody has edited the file."""
    lines = [line for line in data.splitlines(keepends=True) if not line.startswith(_STAMP)]
    body = b"".join(lines)
    return body + _STAMP + hashlib.sha256(body).hexdigest()[:_DIGITS].encode() + b"\n"


def _rig(one: Tried) -> str:
    return f"{one.machine}-{one.jib_m:g}m-{one.falls}-falls"


def table_of(found: Sequence[Tried], front: Sequence[Tried], parts: int, currency: str) -> str:
    """Return the table of all set-ups, each machine with its best places, and why each lost."""
    stream = io.StringIO()
    rows = csv.DictWriter(stream, _COLUMNS, lineterminator="\n")
    rows.writeheader()
    for one in sorted(found, key=lambda one: (-one.served, one.crane_s)):
        values: dict[str, Any] = {
            "machine": one.machine,
            "jib_m": f"{one.jib_m:g}",
            "falls": one.falls,
            "load_moment_tm": f"{one.load_moment_tm:.0f}",
            "yard": "given" if one.yard is None or one.yard.number is None else one.yard.number + 1,
            "truckload_kg": "" if one.yard is None else f"{one.yard.truckload_kg:g}",
            "places": len(one.bases_m),
            "parts": parts,
            "parts_served": one.served,
            "currency": currency,
            "why_lost": why_lost(one, front),
        }
        if one.crane is not None:
            x, y = base_of(one)
            values |= {"x_m": f"{x:g}", "y_m": f"{y:g}", "estimated_hours": f"{one.crane_s / 3600.0:.3f}"}
            values |= {"estimated_cost": f"{one.cost:.0f}", "estimated_utilisation": f"{one.highest:.2f}"}
        if one.second is not None:
            values["second"] = "{} at ({:g}, {:g})".format(one.second.words, *base_of(one.second))
        rows.writerow(values)
    return stream.getvalue()
