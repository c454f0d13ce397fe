"""The summary table of a fleet: one row per run, with the same bytes for every backend."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bimvox.files import write_atomically

COLUMNS: dict[str, type] = {
    "run": str,
    "site": str,
    "obstructions": str,
    "seed": int,
    "status": str,
    "error": str,
    "verified": bool,
    "lifts": int,
    "planned": int,
    "infeasible": int,
    "policy": str,
    "policy_share": float,
    "retrained_share": float,
    "search_share": float,
    "moves": int,
    "shortest_moves": int,
    "moves_over_shortest": float,
    "crane_hours": float,
    "loaded_hours": float,
    "hook_travel_m": float,
    "critical_lifts": int,
    "remarks": int,
    "serious_remarks": int,
    "log": str,
    "log_sha256": str,
}
"""Columns and their contents. There are no computation times: the same inputs give the same table."""

CSV_FILE, PARQUET_FILE = "summary.csv", "summary.parquet"


def write_tables(folder: Path, records: Sequence[dict[str, Any]]) -> list[Path]:
    """Write the table as CSV, and as Parquet if pyarrow is installed; return the files."""
    rows = [row_of(record) for record in records]
    files = {CSV_FILE: _as_csv(rows)}
    try:
        files[PARQUET_FILE] = _as_parquet(rows)
    except ImportError:
        # The extra is not installed. The table of an earlier sweep must not remain next to a newer one.
        (folder / PARQUET_FILE).unlink(missing_ok=True)
    for name, data in files.items():
        write_atomically(folder / name, data)
    return [folder / name for name in files]


def row_of(record: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a run; unknown values are None."""
    figures, error = record.get("figures") or {}, record["error"]
    shares = {f"{method}_share": share for method, share in figures.get("shares", {}).items()}
    known = record | figures | shares | {"error": f"{error['code']}: {error['message']}" if error else None}
    return {name: known.get(name) for name in COLUMNS}


def _as_csv(rows: Sequence[dict[str, Any]]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(COLUMNS), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: str(value).lower() if isinstance(value, bool) else value for name, value in row.items()})
    return text.getvalue().encode()


def _as_parquet(rows: Sequence[dict[str, Any]]) -> bytes:
    import pyarrow
    from pyarrow import parquet

    kinds = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64(), bool: pyarrow.bool_()}
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in COLUMNS.items()])
    out = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(list(rows), schema=schema), out)
    return out.getvalue()
