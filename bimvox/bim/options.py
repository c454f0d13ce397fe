"""What a caller may choose about reading a building."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from bimvox.errors import InputError

Progress = Callable[[str, int, int], None]
"""Called with (stage, done, total) while a file is read."""


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How to read a building.

    Attributes:
        select: What to lift. For IFC an IfcOpenShell selector query (``IfcColumn, IfcBeam``), for meshes names with
            wildcards, separated by commas. None selects by class (IFC) or everything (meshes).
        unit: Length unit of a mesh file; metres are assumed where neither this nor the file says.
        assemblies: ``whole`` lifts an assembly in one piece where that makes sense, ``parts`` lifts each part alone.
        timeout_s: Seconds that the geometry kernel may spend on one product.
        processes: Geometry worker processes.

    Raises:
        InputError: If a value is out of range.
    """

    select: str | None = None
    unit: str | None = None
    assemblies: Literal["whole", "parts"] = "whole"
    timeout_s: float = 60.0
    processes: int = 1

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        if self.assemblies not in ("whole", "parts"):
            raise InputError(f"assemblies is {self.assemblies!r}", hint="use 'whole' or 'parts'")
        if not self.timeout_s > 0:
            raise InputError(f"timeout_s is {self.timeout_s}", hint="give a number of seconds above 0")
        if self.processes < 1:
            raise InputError(f"processes is {self.processes}", hint="give 1 or more")
