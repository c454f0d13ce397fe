"""A row of panels longer than a mobile crane reaches, with the set-ups from which it sets them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import bimvox
from bimvox.library.plan_value import Plan
from bimvox.library.site import LoadedSite

PLACES = {"west": (4.5, -5.5), "east": (34.5, -5.5)}
"""Where the crane stands for the panels at 0 and at 30 m."""

_CRANE = 'machine = "mobile-60t"\nheading_deg = 0\n'


def panels_at(*lefts_m: float) -> str:
    """Return the OBJ file of panels of 3.0 x 0.25 x 2.0 m in a row along x."""
    panels = (
        box(f"panel-{n + 1}", (left_m + 0.02, 0.0, 0.0), (left_m + 2.98, 0.25, 2.0), 8 * n)
        for n, left_m in enumerate(lefts_m)
    )
    return "".join(panels)


def box(name: str, low: Sequence[float], high: Sequence[float], corners: int) -> str:
    """Return a box as lines of an OBJ file that has so many corners before it."""
    lines = [f"o {name}"]
    lines += [f"v {x} {y} {z}" for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
    for face in ((1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)):
        lines.append("f " + " ".join(str(corners + corner) for corner in face))
    return "\n".join([*lines, ""])


def row_file(
    folder: Path,
    *,
    places: dict[str, tuple[float, ...]] | None = None,
    panels: Sequence[float] = (0.0, 3.0, 6.0, 30.0, 33.0, 36.0),
    crane: str = _CRANE,
    more: str = "",
    setup: str = "",
) -> Path:
    """Write the site file of a row, and its model; ``setup``: more keys of each set-up."""
    (folder / "row.obj").write_text(panels_at(*panels))
    places = PLACES if places is None else places
    tables = [f'[[crane.setup]]\nname = "{name}"\nbase_m = {list(at)}\n{setup}' for name, at in places.items()]
    set_ups = "".join(tables)
    text = f"""
[model]
path = "row.obj"
voxel_size_m = 0.25
ground_m = 0
unit = "m"
up = "z"
kinds = [{{ select = "panel*", kind = "precast" }}]
[areas]
yard = [[[-1, -19], [40, -19], [40, -11], [-1, -11]]]
construction = [[-1, -1], [40, -1], [40, 1], [-1, 1]]
[crane]
{crane}{set_ups}{more}
"""
    path = folder / "row.site.toml"
    path.write_text(text)
    return path


def row(folder: Path, **changes: object) -> LoadedSite:
    """Return the site of a row."""
    return bimvox.load_site(row_file(folder, **changes))  # type: ignore[arg-type]


@cache
def planned_row() -> Plan:
    """Return the plan of the usual row, made once."""
    return bimvox.plan(row(Path(mkdtemp(prefix="bimvox-row-"))), policy="none", jobs=1)
