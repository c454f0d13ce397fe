"""The catalogue of machines: the generic ones of ``bimvox/crane/catalogue``, and real ones from public figures."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.crane.load_chart import LoadChart
from bimvox.crane.machine import Machine
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import ConfigError, InputError
from bimvox.files import read_beside
from bimvox.site.config.machine_file import MACHINE_FILE, MACHINE_FILES
from bimvox.site.public_machines import public_machines

if TYPE_CHECKING:
    from bimvox.site.config.site_config import SiteConfig


@cache
def catalogue() -> tuple[Machine, ...]:
    """Return the generic machines, the smallest load moment first: what is chosen from, if nobody names a machine."""
    return _ascending(MACHINE_FILES.catalogue())


@cache
def every_machine() -> tuple[Machine, ...]:
    """Return all machines, the real ones from public figures too, the smallest load moment first."""
    return _ascending((*MACHINE_FILES.catalogue(), *public_machines()))


def _ascending(machines: Iterable[Machine]) -> tuple[Machine, ...]:
    return tuple(sorted(machines, key=lambda machine: (machine.load_moment_tm, machine.name)))


def machine_called(name: str | None) -> Machine | None:
    """Return the machine of the catalogue with a name, generic or real; None if there is none."""
    # Most names are generic: the files of the real ones are read only for others.
    some = (machine for machines in (catalogue, public_machines) for machine in machines() if machine.name == name)
    return next(some, None)


def machines_of(kind: str) -> tuple[Machine, ...]:
    """Return the generic machines of a kind, the smallest load moment first."""
    return tuple(machine for machine in catalogue() if machine.kind == kind)


_USUAL = {"hammerhead": "hammerhead-30", "luffing": "luffing-40", "mobile": "mobile-60t"}


def usual_machine(kind: str) -> Machine:
    """Return the machine of a kind that a site file means if it names none."""
    machine = machine_called(_USUAL[kind])
    assert machine is not None
    return machine


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
        stand=None,
        gears=tuple((round(mass * capacity, 0), rate) for mass, rate in crane.gears),
    )


def machine_in(path: Path, site: Path) -> Machine:
    """Return the machine that a file next to a site file describes.

    Raises:
        FileError: If the file cannot be read, or is not next to the site file.
        ConfigError: If it does not describe a machine, or one with a name of the catalogue's.
    """
    text = read_beside(path, site)
    machine = MACHINE_FILES.read(text, path)
    if machine_called(machine.name) is not None:
        raise ConfigError(path, "name", f"{machine.name!r} is known already", hint="give your machine its own name")
    return replace(machine, file=(path.name, text))


def own_machines(config: SiteConfig) -> tuple[Machine, ...]:
    """Return the machines whose files a site file names, or that were added to it."""
    others = {*config.rigging.gear, *config.kind_files}
    return tuple(
        replace(MACHINE_FILES.read(data, config.file.parent / name), file=(name, data))
        for name, data in config.machine_files.items()
        if name.endswith(MACHINE_FILE) and name not in others
    )


def name_of(config: SiteConfig, machine: str) -> str:
    """Return the name of a machine in a site file: that of its file, if it has one of its own."""
    files = {one.name: one.file[0] for one in own_machines(config) if one.file is not None}
    return files.get(machine, machine)


def machines_for(config: SiteConfig, crane: str | None) -> tuple[SiteConfig, tuple[Machine, ...]]:
    """Return a site file with the files of the machines to be tried on it, and these machines.

    ``crane``: as :func:`machines_called` takes it; None: all of the catalogue, and those of the site file's own files.

    Raises:
        BimvoxError: As :func:`machines_called`.
    """
    if crane is None:
        return config, (*catalogue(), *own_machines(config))
    machines = machines_called(crane, config.file)
    return config.with_machine_files(dict(one.file for one in machines if one.file is not None)), machines


KINDS = ("hammerhead", "luffing", "mobile")
PUBLIC = "public"
"""By which a user asks for all real machines from public figures."""


def machines_called(name: str, site: Path | None = None) -> tuple[Machine, ...]:
    """Return the machines of a kind, or the machine with a name, the smallest load moment first.

    Args:
        name: ``hammerhead``, ``luffing``, ``mobile`` (the generic ones), ``public`` (the real ones), the name of a
            machine of the catalogue, or ``fictitious``: the hammerheads, then machines that do not exist. With
            ``site``, also the file of a machine.
        site: The site file next to which the file of a machine lies.

    Raises:
        InputError: If there is no such kind or machine.
        FileError: If the file of a machine cannot be read, or is not next to the site file.
        ConfigError: If it does not describe a machine.
    """
    if site is not None and name.endswith(MACHINE_FILE):
        return (machine_in(Path(name), site),)
    if name in KINDS:
        return machines_of(name)
    if name == FICTITIOUS:
        return (*machines_of("hammerhead"), *fictitious_machines())
    if name == PUBLIC:
        return _ascending(public_machines())
    if (found := machine_called(name)) is not None:
        return (found,)
    names = [machine.name for machine in every_machine()]
    if name.endswith(".toml"):
        raise InputError(
            f"the catalogue has no crane {name!r}", hint="put its file next to the site file: crane.machine"
        )
    near = difflib.get_close_matches(name, [*KINDS, PUBLIC, *names], n=1)
    raise InputError(
        f"the catalogue has no crane {name!r}" + (f"; did you mean {near[0]!r}?" if near else ""),
        hint=f"give a kind ({', '.join(KINDS)}), {PUBLIC} or a machine: {', '.join(names)}",
    )
