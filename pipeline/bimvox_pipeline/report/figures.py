"""The figures of a report as separate files, and their numbers as CSV."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from bimvox.errors import FileError
from bimvox.exporters.text import for_csv
from bimvox.files import reason_of, write_atomically

DATA_FILE = "lifts.csv"
COLUMNS = (
    "number",
    "order",
    "id",
    "global_id",
    "name",
    "ifc_class",
    "status",
    "method",
    "moves",
    "shortest_moves",
    "mass_kg",
    "load_kg",
    "radius_m",
    "capacity_kg",
    "utilisation",
    "governing_time_s",
    "begins_s",
    "ends_s",
    "duration_s",
    "bound_s",
    "hook_travel_m",
    "critical",
    "proven",
)
"""Columns of ``lifts.csv``: the keys of the record, with units in their names."""


def write_figures(folder: Path, record: dict[str, Any]) -> list[str]:
    """Write the figures of a plan's record as PNG and SVG, with their data, and return the sorted names of the files.

    The folder is created if missing.

    Raises:
        FileError: If the folder cannot be used.
    """
    from bimvox.rendering.plots.plan_figures import draw_hook_travel, draw_methods, draw_path_ratios, draw_utilisation

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            folder, f"cannot be used for figures: {reason_of(error)}", hint="choose another folder for --figures"
        ) from error
    lifts, files = record["lifts"], {DATA_FILE: lifts_csv(record)}
    for suffix in ("png", "svg"):
        if any(lift["moves"] for lift in lifts):
            files[f"path-lengths.{suffix}"] = draw_path_ratios(lifts, file_format=suffix)
            files[f"methods.{suffix}"] = draw_methods(lifts, file_format=suffix)
        if any(lift["governs"] for lift in lifts):
            drawn = draw_utilisation(lifts, record["critical_share"], file_format=suffix)
            files[f"utilisation.{suffix}"] = drawn
            files[f"hook-travel.{suffix}"] = draw_hook_travel(lifts, file_format=suffix)
    for name, data in files.items():
        write_atomically(folder / name, data)
    return sorted(files)


def lifts_csv(record: dict[str, Any]) -> bytes:
    """Return every lift as a row of CSV, in order; unknown values are empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for lift in record["lifts"]:
        governs = lift["governs"] or {}
        known = {**{name: lift.get(name) for name in COLUMNS}, **{name: governs.get(name) for name in _GOVERNED}}
        known["governing_time_s"] = governs.get("time_s")
        writer.writerow({name: for_csv(_written(value)) for name, value in known.items()})
    return text.getvalue().encode()


_GOVERNED = ("load_kg", "radius_m", "capacity_kg", "utilisation")


def _written(value: object) -> object:
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else value
