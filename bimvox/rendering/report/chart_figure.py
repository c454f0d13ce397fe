"""The load charts of a machine as a figure: capacity over radius, stepped as listed, a line for each length."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from bimvox.crane.load_chart import LoadChart
from bimvox.crane.machine import Machine
from bimvox.crane.sectors import sectors_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.rendering.pictures.plots import LINES, Format, bytes_of, house_style

_MOST_LINES = 18


def draw_charts(machine: Machine, *, file_format: Format = "png") -> bytes:
    """Return the charts of a machine with the reeving that carries most, for each length, set-up and sector."""
    cases = _cases(machine)
    with house_style():
        figure = Figure(figsize=(9.0, 5.2), layout="constrained")
        axes = figure.add_subplot()
        for n, (label, crane, chart) in enumerate(cases[:_MOST_LINES]):
            look = LINES[n % len(LINES)]
            radii = np.array([max(min(crane.min_radius_m, chart.radius_m[0]), 0.0), *chart.radius_m])
            tonnes = np.array([chart.capacity_kg[0], *chart.capacity_kg]) / 1000.0
            axes.plot(
                radii, tonnes, color=look.colour, linestyle=look.dash, marker=look.marker, markersize=3.0,
                drawstyle="steps-pre", label=label,
            )  # fmt: skip
        more = f"; {len(cases) - _MOST_LINES} more are not drawn" if len(cases) > _MOST_LINES else ""
        axes.set_xlabel("radius of the hook, m")
        axes.set_ylabel("load, rigging and hook block, t")
        axes.set_title(f"{machine.name}: between two radii the smaller capacity holds{more}")
        axes.set_ylim(bottom=0.0)
        axes.legend(fontsize=7)
        return bytes_of(figure, file_format)


def _cases(machine: Machine) -> list[tuple[str, TowerCrane, LoadChart]]:
    """Return (label, crane, chart) of each length and set-up with the reeving that carries most, and of its sectors."""
    best: dict[tuple[float, float | None, str | None], TowerCrane] = {}
    for length, crane in zip(machine.jibs_m, machine.cranes, strict=True):
        carrier = crane.carrier
        base = None if carrier is None or carrier.outriggers is None else carrier.outriggers.name
        key = (length, None if carrier is None else carrier.counterweight_kg, base)
        if key not in best or crane.chart.capacity_kg[0] > best[key].chart.capacity_kg[0]:
            best[key] = crane
    several = {key[1:] for key in best}
    cases: list[tuple[str, TowerCrane, LoadChart]] = []
    for (length, weight_kg, base), crane in best.items():
        words = [f"{length:g} m"]
        if len(several) > 1:
            words += [] if weight_kg is None else [f"{weight_kg / 1000:g} t"]
            words += [] if base is None else [base]
        label = ", ".join(words)
        cases.append((label, crane, crane.chart))
        cases += [(f"{label}, {one.name}", crane, one.chart) for one in sectors_of(crane) if one.chart is not None]
    return cases
