"""What a caller may choose about reading a building."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Literal

from bimvox.errors import InputError

MOST_PROCESSES = 4
"""Default worker processes at most: beyond that the single process that they report to is what takes the time."""


def default_processes() -> int:
    """Return how many geometry processes are worth running here: one for each CPU that we may use, up to a few."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(MOST_PROCESSES, usable))


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How to read a building.

    Attributes:
        select: What to lift. For IFC an IfcOpenShell selector query (``IfcColumn, IfcBeam``), for meshes names with
            wildcards, separated by commas. None selects by class (IFC) or everything (meshes).
        unit: Length unit of a mesh file; metres are assumed where neither this nor the file says.
        up: Axis of a mesh file that points up; z is assumed where neither this nor the format's standard says.
        assemblies: ``whole`` lifts an assembly in one piece where that makes sense, ``parts`` lifts each part alone.
        timeout_s: Seconds that the geometry kernel may spend on one shape.
        processes: Geometry worker processes for an IFC file; the building does not depend on it.

    Raises:
        InputError: If a value is out of range.
    """

    select: str | None = None
    unit: str | None = None
    up: Literal["y", "z"] | None = None
    assemblies: Literal["whole", "parts"] = "whole"
    timeout_s: float = 60.0
    processes: int = field(default_factory=default_processes)

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        if self.assemblies not in ("whole", "parts"):
            raise InputError(f"assemblies is {self.assemblies!r}", hint="use 'whole' or 'parts'")
        if self.up not in (None, "y", "z"):
            raise InputError(f"up is {self.up!r}", hint="use 'y' or 'z'")
        if not self.timeout_s > 0:
            raise InputError(f"timeout_s is {self.timeout_s}", hint="give a number of seconds above 0")
        if self.processes < 1:
            raise InputError(f"processes is {self.processes}", hint="give 1 or more")
