"""What many runs cost apart from planning, and a million lifts on paper: ``python -m benchmarks.scale.fleet``.

Reads and writes what a fleet does once for all its runs, in this process; times are processor times. The cost of a
million lifts follows from ``docs/data/scale.json`` and assumed prices. Writes both into ``docs/scale.md``.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from bimvox_pipeline.fleet.command import write_page, write_tables
from bimvox_pipeline.fleet.runs import PLANNED, RECORDS, Run, Wish, failed, record_file

from benchmarks.document import put_into
from bimvox.files import sha256_of

T = TypeVar("T")

_DOCS = Path(__file__).parents[2] / "docs"
_RUNS = (200, 2_000, 20_000)
_LIFTS, _HASHED_BYTES = 1_000_000, 500_000_000
_CORE_HOUR, _GB_MONTH = 0.05, 0.02
"""Assumed prices: a virtual core for an hour, a gigabyte of object storage for a month, US dollars."""


def main() -> int:
    """Measure, print the tables, and write them."""
    found = json.loads((_DOCS / "data" / "scale.json").read_bytes())["ways"][0]["sizes"]
    text = "\n".join([*_once_for_all(), "", *on_paper(found)]) + "\n"
    print(text)
    put_into(_DOCS / "scale.md", "bench-fleet", text)
    return 0


def _once_for_all() -> list[str]:
    """Return the table of what a fleet does once for all runs, and the time to hash a log when it is called again."""
    lines = ["| runs | read records | tables | page | its size |", "|---:|---:|---:|---:|---:|"]
    lines += [row(count) for count in _RUNS]
    with tempfile.TemporaryDirectory(prefix="bimvox-fleet-") as scratch:
        log = Path(scratch) / "log"
        log.write_bytes(bytes(_HASHED_BYTES))
        _, hash_s = _timed(lambda: sha256_of(log))
    return [*lines, "", f"Called again, a fleet hashes every log: {_HASHED_BYTES / 1e9 / hash_s:.1f} GB a second."]


def row(count: int) -> str:
    """Return the row of a number of runs."""
    with tempfile.TemporaryDirectory(prefix="bimvox-fleet-") as scratch:
        folder = Path(scratch)
        (folder / RECORDS).mkdir()
        files = [record_file(folder, f"site{n}") for n in range(count)]
        for n, file in enumerate(files):
            file.write_text(json.dumps(_record(n), indent=1), encoding="utf-8")
        records, read_s = _timed(lambda: [json.loads(file.read_bytes()) for file in files])
        _, tables_s = _timed(lambda: write_tables(folder, records))
        page, page_s = _timed(lambda: write_page(folder, records))
        size = f"{page.stat().st_size / 1e6:.1f} MB"
    return f"| {count:,} | {read_s:.2f} s | {tables_s:.2f} s | {page_s:.2f} s | {size} |"


def on_paper(found: list[dict[str, Any]]) -> list[str]:
    """Return the table of a million lifts, from the sizes of ``scale.json``."""
    lines = [
        f"| {_LIFTS:,} lifts as | core hours | at {_CORE_HOUR:g} $ | logs | a month at {_GB_MONTH:g} $ a GB |",
        "|---|---:|---:|---:|---:|",
    ]
    for one in found:
        if one["components"] >= 100:
            sites = _LIFTS // one["components"]
            hours = sites * one["cpu_s"] / 3600.0
            size_gb = sites * one["log_mb"] / 1e3
            lines.append(
                f"| {sites:,} sites of {one['components']:,} | {hours:.1f} | {hours * _CORE_HOUR:.2f} $ "
                f"| {size_gb:,.0f} GB | {size_gb * _GB_MONTH:.2f} $ |"
            )
    return lines


def _record(number: int) -> dict[str, Any]:
    """Return the record of a planned run, of the size of a real one."""
    figures = dict.fromkeys(("moves", "shortest_moves", "crane_hours", "loaded_hours", "hook_travel_m"), 1234.5)
    shares = {"greedy": 1.0, "policy": 0.0, "retrained": 0.0, "search": 0.0}
    planned = {"verified": True, "lifts": 500, "infeasible": 0, "policy": "greedy", "remarks": 0, "serious_remarks": 0}
    run = Run(f"site{number}", Wish(Path(f"site{number}.site.toml")), leads=True)
    whole = figures | {"planned": 500, "shares": shares, "moves_over_shortest": 1.0, "critical_lifts": 7}
    log = {"log": f"site{number}.mcap", "log_sha256": f"{number:064x}", "inputs": f"{number:064x}"}
    return failed(run, "", "", None) | planned | log | {"status": PLANNED, "error": None, "figures": whole}


def _timed(act: Callable[[], T]) -> tuple[T, float]:
    before_s = time.process_time()
    return act(), time.process_time() - before_s


if __name__ == "__main__":
    sys.exit(main())
