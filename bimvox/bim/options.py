"""Options for reading a building."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from bimvox.bim.kinds.kind import Correction
from bimvox.errors import InputError, SelectionError, shown
from bimvox.processes import processors

MOST_PROCESSES = 4
"""Largest default number of worker processes: with more, the one process that they report to is the bottleneck."""


MESH_SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb", ".gltf", ".3mf")
"""Of the mesh files that are read."""

MOST_SELECT = 10_000
"""The longest selection, in characters: 400 GlobalIds, or any list of classes."""


def default_processes() -> int:
    """Return the default number of geometry processes: one for each usable CPU, at most ``MOST_PROCESSES``."""
    return max(1, min(MOST_PROCESSES, processors()))


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How to read a building.

    Attributes:
        select: What to lift. For IFC an IfcOpenShell selector query (``IfcColumn, IfcBeam``), for meshes names with
            wildcards, separated by commas; at most ``MOST_SELECT`` characters. None selects by class (IFC) or
            everything (meshes).
        unit: Length unit of a mesh file; metres if neither this nor the file states one.
        up: Axis of a mesh file that points up; z if neither this nor the format's standard states one.
        assemblies: ``whole`` lifts an assembly in one piece where that makes sense, ``parts`` lifts each part alone.
        timeout_s: Seconds of processor time that the geometry kernel may spend on one shape.
        processes: Number of geometry workers for an IFC file; it does not change the building.
        corrections: What a person says of parts: it wins over what the file says.

    Raises:
        InputError: If a value is out of range.
        SelectionError: If ``select`` is too long.
    """

    select: str | None = None
    unit: str | None = None
    up: Literal["y", "z"] | None = None
    assemblies: Literal["whole", "parts"] = "whole"
    timeout_s: float = 60.0
    processes: int = field(default_factory=default_processes)
    corrections: tuple[Correction, ...] = ()

    def __post_init__(self) -> None:
        """Check the values."""
        if self.select is not None and len(self.select) > MOST_SELECT:
            said = f"select {shown(self.select)}: has {len(self.select):,} characters, at most {MOST_SELECT:,} are read"
            raise SelectionError(said, hint="select classes, or a property that the parts have in common")
        if self.assemblies not in ("whole", "parts"):
            raise InputError(f"assemblies is {self.assemblies!r}", hint="use 'whole' or 'parts'")
        if self.up not in (None, "y", "z"):
            raise InputError(f"up is {self.up!r}", hint="use 'y' or 'z'")
        if not self.timeout_s > 0:
            raise InputError(f"timeout_s is {self.timeout_s}", hint="give a number of seconds above 0")
        if self.processes < 1:
            raise InputError(f"processes is {self.processes}", hint="give 1 or more")
