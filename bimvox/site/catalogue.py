"""The catalogue of machines: the files of ``bimvox/crane/catalogue``."""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path

from bimvox.crane.machine import Machine
from bimvox.site.config.machine_file import machine_of


@cache
def catalogue() -> tuple[Machine, ...]:
    """Return all machines of the catalogue, the smallest load moment first."""
    folder = resources.files("bimvox") / "crane" / "catalogue"
    files = sorted((file for file in folder.iterdir() if file.name.endswith(".toml")), key=lambda file: file.name)
    machines = (machine_of(file.read_bytes(), Path(file.name)) for file in files)
    return tuple(sorted(machines, key=lambda machine: machine.load_moment_tm))


def machine_called(name: str | None) -> Machine | None:
    """Return the machine of the catalogue with a name; None if there is none."""
    return next((machine for machine in catalogue() if machine.name == name), None)


def machines_of(kind: str) -> tuple[Machine, ...]:
    """Return the machines of a kind, the smallest load moment first."""
    return tuple(machine for machine in catalogue() if machine.kind == kind)
