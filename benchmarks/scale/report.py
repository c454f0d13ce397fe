"""The measurements as JSON, as the tables of docs/scale.md, and as a plot."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.scale.measure import Measured

_WALL_S = {500: 30.0, 1000: 60.0, 5000: 360.0}
"""Most wall time on two quiet cores, by components."""
_MEMORY_MB = {5000: 2000.0}
_LOG_KB = {500: 60.0}
_GROWTH = 1.25  # allowed cost per component of the largest buildings, relative to the smaller ones


class Way(NamedTuple):
    """A method of planning, and its sizes."""

    title: str
    found: tuple[Measured, ...]


class Bar(NamedTuple):
    """A requirement and its measurement."""

    what: str
    found: str
    passed: bool


def bars(found: Sequence[Measured]) -> list[Bar]:
    """Return the bars that the measurements can check."""
    result = []
    for one in found:
        size = one.components
        if size in _WALL_S:
            whole = one.planned == size and one.proven
            result.append(
                Bar(
                    f"{size:,} components planned and proven in under {_WALL_S[size]:g} s",
                    f"{one.planned:,} of {size:,} in {one.wall_s:.0f} s",
                    whole and one.wall_s < _WALL_S[size],
                )
            )
        if size in _MEMORY_MB:
            result.append(
                Bar(
                    f"memory for {size:,} components under {_MEMORY_MB[size] / 1000:g} GB",
                    f"{one.memory_mb / 1000:.2f} GB",
                    one.memory_mb < _MEMORY_MB[size],
                )
            )
        if size in _LOG_KB:
            result.append(
                Bar(
                    f"log of {size:,} components under {_LOG_KB[size]:g} kB a lift",
                    f"{_log_kb(one):.0f} kB",
                    _log_kb(one) < _LOG_KB[size],
                )
            )
    if len(found) > 2:
        few, many = _cost_a_component(found[:-1]), _cost_a_component(found[-2:])
        result.append(
            Bar(
                f"cost linear in components: above {found[-2].components:,} no more than {_GROWTH:g} times "
                "that of a component below",
                f"{many * 1e3:.0f} ms against {few * 1e3:.0f} ms, processor time",
                many <= _GROWTH * few,
            )
        )
    return result


def _log_kb(one: Measured) -> float:
    """Return the bytes of the log a planned lift, 10^3."""
    return 1000.0 * one.log_mb / max(one.planned, 1)


def _cost_a_component(found: Sequence[Measured]) -> float:
    """Return the slope of the line through processor time against components, seconds."""
    return float(np.polyfit([one.components for one in found], [one.cpu_s for one in found], 1)[0])


def as_json(ways: Sequence[Way]) -> str:
    """Return all measurements."""
    machine = {"system": platform.system(), "processor": platform.machine(), "cores": os.cpu_count()}
    document = {
        "machine": machine | {"python": platform.python_version()},
        "ways": [
            {
                "title": way.title,
                "sizes": [one.as_json() for one in way.found],
                "bars": [bar._asdict() for bar in bars(way.found)],
            }
            for way in ways
        ],
    }
    return json.dumps(document, indent=1) + "\n"


def as_markdown(ways: Sequence[Way]) -> str:
    """Return the tables."""
    return "\n".join(f"## {way.title[0].upper()}{way.title[1:]}\n\n{_tables(way.found)}" for way in ways)


def _tables(found: Sequence[Measured]) -> str:
    lines = [
        "| components | planned and proven | wall | processor | processor a component | memory | log | a lift |",
        "|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for one in found:
        proven = f"{one.planned:,}" if one.proven else "NOT PROVEN"
        lines.append(
            f"| {one.components:,} | {proven} | {one.wall_s:.1f} s | {one.cpu_s:.1f} s "
            f"| {one.cpu_s / one.components * 1e3:.0f} ms | {one.memory_mb:.0f} MB | {one.log_mb:.1f} MB "
            f"| {_log_kb(one):.0f} kB |"
        )
    told = bars(found)
    if told:
        lines.append("")
        lines += [f"- {bar.what}: {bar.found}, {'met' if bar.passed else '**not met**'}" for bar in told]
    return "\n".join(lines) + "\n"


def drawing(ways: Sequence[Way]) -> bytes:
    """Return the curves as a PNG: the whole command by each method, and the stages of the first."""
    from benchmarks.plots import Growth, draw_scaling

    series = []
    for way in ways:
        sizes = np.array([one.components for one in way.found], np.float64)
        label = "whole command" if way is ways[0] else "by search alone"
        series.append(Growth(label, sizes, np.array([one.cpu_s for one in way.found])))
    found = ways[0].found
    sizes = np.array([one.components for one in found], np.float64)
    for name in ("plan", "prove", "time", "write"):
        values = np.array([one.seconds[name] for one in found])
        if (values > 0.0).all():
            series.append(Growth(name, sizes, values))
    return draw_scaling(series, size="components", value="seconds", title="Planned and proven")
