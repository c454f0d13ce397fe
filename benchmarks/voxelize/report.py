"""Writes the measurements: JSON, and the table of docs/voxelizing.md."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from typing import Any

from benchmarks.voxelize.bars import Bar
from benchmarks.voxelize.result import CaseResult, Row


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
    """Return the tables."""
    lines = []
    for case in cases:
        lines += [_headline(case), ""]
        lines += [
            "| tool | time | x ours | memory | missed | extra |",
            "|---|---|---|---|---|---|",
        ]
        lines += [_line(case, row) for row in case.rows]
        lines += [""]
    if bars:
        met = sum(bar.passed for bar in bars)
        lines += [f"{met} of the {len(bars)} bars of `benchmarks/voxelize/bars.py` are met."]
        lines += [f"- **Not met**: {bar.what}: {bar.found}" for bar in bars if not bar.passed]
    return "\n".join(lines).rstrip() + "\n"


def _headline(case: CaseResult) -> str:
    parts = "1 part" if case.parts == 1 else f"{case.parts:,} parts"
    text = f"**{case.name}**: {parts}, {case.triangles:,} triangles, {case.cells / 1e6:.3g} million cells"
    ours = case.row("bimvox")
    if ours is not None and ours.solid_cells is not None and ours.median_s is not None:
        text += f", {ours.solid_cells / 1e6:.3g} million of them in a part"
        if case.dense:
            text += f" (ours: {ours.solid_cells / ours.median_s / 1e6:.0f} million of those a second)"
    return text + f"; {case.judged_cells:,} cells judged."


def _line(case: CaseResult, row: Row) -> str:
    start = f"| {row.tool.title} {row.version}".rstrip() + " |"
    if row.median_s is None:
        return f"{start} {row.failure} | | | | |"
    ratio = case.ratio(row.tool.key)
    missed = extra = "-"
    if row.score is not None:
        missed = counted(row.score.missed, row.score.missed_share)
        extra = counted(row.score.extra, row.score.extra_share)
    times = "" if ratio is None or row.tool.key == "bimvox" else f"{ratio:.2g}" if ratio < 10 else f"{ratio:,.0f}"
    figures = f"{duration(row.median_s)} | {times} | {row.memory_mb:,.0f} MB | {missed} | {extra}"
    return f"{start} {figures} |"


def counted(number: int, share: float) -> str:
    """Return a count with its share, ``0`` alone if there is none."""
    return f"{number:,} ({100 * share:.2g} %)" if number else "0"


def duration(seconds: float) -> str:
    """Return seconds to three digits."""
    return f"{seconds * 1e3:.3g} ms" if seconds < 0.9995 else f"{seconds:.3g} s"
