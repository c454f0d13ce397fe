"""What the packages that bimvox needs take on the disk, and what needs them: the table of docs/install.md.

``python -m supply.sizes`` prints it for the packages of this environment. Files are
counted as packages bring them, by their records. Python adds byte code when it imports them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from importlib.metadata import distribution
from pathlib import Path
from typing import NamedTuple

from packaging.requirements import Requirement

from supply.lock import normalised

_PROJECT = Path(__file__).parents[1] / "pyproject.toml"
_FULL = ("train", "plots", "optimise", "holidays")
_LEAST_MB = 5.0
_WHAT_FOR = {
    "ifcopenshell": "reading IFC, 4D IFC",
    "numba": "voxelizing, planning, proof",
    "scipy": "planning, proof, motion",
    "numpy": "everything",
    "python-fcl": "contacts, proof",
    "mcap": "the log",
    "zstandard": "the log",
    "pillow": "pictures",
    "shapely": "areas, yard",
    "pydantic": "site files",
    "torch": "`train`, `experiment`",
    "matplotlib": "plots of `report`, `crane import`, `experiment`",
    "optuna": "`optimise`",
    "holidays": "`[calendar] country`",
}
"""The act, by the package that bimvox names itself."""


class Row(NamedTuple):
    """One package: its size in MB (10**6 bytes), the extra that it comes with ("" for none), and what needs it."""

    name: str
    size_mb: float
    extra: str
    needed_by: str


def rows_of(project: Mapping[str, object]) -> list[Row]:
    """Return the packages of bimvox and of the extras of ``bimvox[full]``, the largest first.

    A package belongs to the extra that comes first and needs it.

    Raises:
        PackageNotFoundError: If one is not installed here.
    """
    extras = project["optional-dependencies"]
    assert isinstance(extras, dict)
    assert isinstance(project["dependencies"], list)
    rows: dict[str, Row] = {}
    for extra, named in (("", project["dependencies"]), *((extra, extras[extra]) for extra in _FULL)):
        # Breadth first: of what several packages need, the nearest to bimvox is named.
        waiting = [(one, "") for one in sorted(map(_name, named))]
        for name, parent in waiting:
            if name in rows:
                continue
            found = distribution(name)
            size_mb = sum(file.size or 0 for file in found.files or ()) / 1e6
            rows[name] = Row(name, size_mb, extra, parent or _WHAT_FOR.get(name, ""))
            waiting += [(further, name) for further in sorted(_needed(found.requires or ()))]
    return sorted(rows.values(), key=lambda row: -row.size_mb)


def table_of(rows: Iterable[Row]) -> str:
    """Return the rows as a table in Markdown: the large ones, the rest together, and the sums."""
    every = list(rows)
    lines = ["| package | MB | needed by | comes with |", "|---|--:|---|---|"]
    lines += [
        f"| {row.name} | {row.size_mb:.0f} | {row.needed_by} | {_installation(row.extra)} |"
        for row in every
        if row.size_mb >= _LEAST_MB
    ]
    small = [row for row in every if row.size_mb < _LEAST_MB]
    lines.append(f"| {len(small)} others | {sum(row.size_mb for row in small):.0f} | | |")
    for extra in ("", *_FULL):
        size_mb = sum(row.size_mb for row in every if row.extra == extra)
        adds = f"{_installation(extra)} adds" if extra else "`bimvox` alone"
        lines.append(f"| **{adds}** | **{size_mb:.0f}** | | |")
    lines.append(f"| **`bimvox[full]`** | **{sum(row.size_mb for row in every):.0f}** | | |")
    return "\n".join(lines) + "\n"


def _installation(extra: str) -> str:
    return f"`bimvox[{extra}]`" if extra else "`bimvox`"


def _name(requirement: str) -> str:
    return normalised(Requirement(requirement).name)


def _needed(requirements: Iterable[str]) -> set[str]:
    read = [Requirement(text) for text in requirements]
    return {normalised(one.name) for one in read if one.marker is None or one.marker.evaluate({"extra": ""})}


if __name__ == "__main__":
    print(table_of(rows_of(tomllib.loads(_PROJECT.read_text("utf-8"))["project"])), end="")
