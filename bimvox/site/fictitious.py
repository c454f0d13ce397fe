"""Machines that do not exist: the largest hammerhead of the catalogue, scaled. Only for a user who asks for one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from bimvox.crane.load_chart import LoadChart
from bimvox.crane.machine import Machine
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.catalogue import machine_called

FICTITIOUS = "fictitious"
"""Begins the name of a machine that does not exist; also the name by which a user asks for one."""

_SCALED = "hammerhead-75"


@cache
def fictitious_machines() -> tuple[Machine, ...]:
    """Return machines scaled up from the catalogue, by ascending load moment.

    They go up to about the largest tower cranes in existence: a jib of 100 m with 80 t at its end.
    """
    scales = ((reach, capacity) for reach in (0.5, 0.75, 1.0, 1.35) for capacity in (1.5, 2.5, 5.0, 10.0, 20.0))
    ascending = sorted(scales, key=lambda scale: (scale[0] * scale[1], scale[0]))
    return tuple(_machine(*scale) for scale in ascending)


def _machine(reach: float, capacity: float) -> Machine:
    crane = _scaled(reach, capacity)
    about = "fictitious: a machine of the catalogue scaled by calculation; it does not exist"
    return Machine(crane.name, crane.kind, about, (crane.jib_length_m,), (crane,))


def _scaled(reach: float, capacity: float) -> TowerCrane:
    """Return a machine of the catalogue with its jib and load chart scaled."""
    machine = machine_called(_SCALED)
    assert machine is not None
    crane = machine.usual
    chart = LoadChart(
        tuple(round(radius * reach, 2) for radius in crane.chart.radius_m),
        tuple(round(mass * capacity, 0) for mass in crane.chart.capacity_kg),
    )
    return replace(
        crane,
        name=f"{FICTITIOUS} {crane.name} scaled {reach:g} x {capacity:g}",
        jib_length_m=round(crane.jib_length_m * reach, 2),
        chart=chart,
        gears=tuple((round(mass * capacity, 0), rate) for mass, rate in crane.gears),
    )
