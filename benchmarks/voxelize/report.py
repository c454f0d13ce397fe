"""Writes the measurements: JSON, and the table of docs/voxelizing.md."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from typing import Any

from benchmarks.voxelize.bars import Bar
from benchmarks.voxelize.result import CaseResult, Row
from benchmarks.voxelize.score import Score


def as_json(cases: Sequence[CaseResult], bars: Sequence[Bar]) -> str:
    """Return all measurements."""
    document = {
        "machine": {
            "system": platform.system(),
            "processor": platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
        },
        "cases": [_case(case) for case in cases],
        "bars": [{"what": bar.what, "found": bar.found, "passed": bar.passed} for bar in bars],
    }
    return json.dumps(document, indent=1) + "\n"


def _case(case: CaseResult) -> dict[str, Any]:
    return {
        "name": case.name,
        "voxel_size_m": case.voxel_size_m,
        "dense": case.dense,
        "parts": case.parts,
        "triangles": case.triangles,
        "cells": case.cells,
        "windows": case.windows,
        "judged_pairs": case.judged_pairs,
        "judged_cells": case.judged_cells,
        "undecided_cells": case.undecided_cells,
        "tools": [_row(case, row) for row in case.rows],
    }


def _row(case: CaseResult, row: Row) -> dict[str, Any]:
    found: dict[str, Any] = {
        "tool": row.tool.title,
        "package": row.tool.distribution,
        "version": row.version,
        "gives": "solid" if row.tool.solid else "surface",
        "labels": row.tool.labels,
    }
    if row.median_s is None:
        return {**found, "failure": row.failure}
    found["median_s"] = round(row.median_s, 5)
    found["cpu_s"] = [round(s, 5) for s in row.cpu_s]
    found["wall_s"] = [round(s, 5) for s in row.wall_s]
    ratio = case.ratio(row.tool.key)
    found["ratio"] = None if ratio is None else round(ratio, 2)
    found["memory_mb"] = round(row.memory_mb, 1)
    if row.solid_cells is not None:
        found["solid_cells"] = row.solid_cells
        found["solid_cells_per_s"] = round(row.solid_cells / row.median_s)
    if row.score is not None:
        score = row.score
        found |= {"filled": score.filled, "missed": score.missed, "extra": score.extra}
        found |= {"missed_share": round(score.missed_share, 6), "extra_share": round(score.extra_share, 6)}
    return found


def as_markdown(cases: Sequence[CaseResult], bars: Sequence[Bar]) -> str:
    """Return the table, a column a case, and the bars that are not met."""
    heads = [f"{case.name} ({case.cells / 1e6:.3g} M cells)" for case in cases]
    lines = [f"| tool | {' | '.join(heads)} |", "|---" * (1 + len(cases)) + "|"]
    titles = {row.tool.key: f"{row.tool.title} {row.version}".rstrip() for case in cases for row in case.rows}
    for key, title in titles.items():
        lines.append(f"| {title} | {' | '.join(_cell(case, key) for case in cases)} |")
    if bars:
        met = sum(bar.passed for bar in bars)
        lines += ["", f"{met} of the {len(bars)} bars of `benchmarks/voxelize/bars.py` are met."]
        lines += [f"- **Not met**: {bar.what}: {bar.found}" for bar in bars if not bar.passed]
    return "\n".join(lines).rstrip() + "\n"


def _cell(case: CaseResult, key: str) -> str:
    """Return our time, or a peer's in multiples of it; missed and extra cells in per cent; or why there is none."""
    row = case.row(key)
    if row is None:
        return ""
    if row.median_s is None:
        return row.failure
    ratio = case.ratio(key)
    if ratio is None or key == "bimvox":
        found = duration(row.median_s)
    else:
        found = f"x{ratio:.2g}" if ratio < 10 else f"x{ratio:,.0f}"
    if row.score is None:
        return found
    return f"{found}, {missed_and_extra(row.score)}"


def missed_and_extra(score: Score) -> str:
    """Return missed and extra cells in per cent."""
    return f"{100 * score.missed_share:.2g}/{100 * score.extra_share:.2g}"


def duration(seconds: float) -> str:
    """Return seconds to three digits."""
    return f"{seconds * 1e3:.3g} ms" if seconds < 0.9995 else f"{seconds:.3g} s"
