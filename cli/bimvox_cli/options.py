"""Options and arguments that several commands share: one definition of each, each with its environment variable."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

HELP_NAMES = {"help_option_names": ["-h", "--help"], "max_content_width": 110}
"""Settings of every command: -h beside --help, wider than the default where the terminal is."""


def positive_metres(value: float | None) -> float | None:
    """Check a length given on the command line: finite and above zero."""
    if value is not None and not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value:g} is not a length above 0, in metres")
    return value


Model = Annotated[
    Path,
    typer.Argument(metavar="MODEL", help="An IFC file (.ifc, .ifczip) or a mesh (STL, OBJ, PLY, OFF, GLB, GLTF, 3MF)."),
]
SiteFile = Annotated[Path, typer.Argument(metavar="SITE", help="A site file (TOML), as `bimvox init` writes it.")]
Log = Annotated[Path, typer.Argument(metavar="LOG", help="A log, as `bimvox plan` writes it.")]

Json = Annotated[
    bool, typer.Option("--json", envvar="BIMVOX_JSON", help="Print one JSON document on stdout and nothing else there.")
]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", envvar="BIMVOX_QUIET", help="No progress, notes or summary; errors only.")
]
Seed = Annotated[
    int | None,
    typer.Option(
        "--seed", min=0, metavar="N", envvar="BIMVOX_SEED", help="Seed of everything random; default: the site file's."
    ),
]
Steps = Annotated[
    int | None,
    typer.Option("--steps", min=1, metavar="N", envvar="BIMVOX_STEPS", help="Environment steps to train for at most."),
]
PolicyId = Annotated[
    str | None,
    typer.Option(
        "--policy",
        envvar="BIMVOX_POLICY",
        metavar="ID",
        help="Use this policy of `bimvox policy list`; none: search alone; nearest: that of the most similar site.",
    ),
]
VoxelSize = Annotated[
    float | None,
    typer.Option(
        "--voxel-size",
        envvar="BIMVOX_VOXEL_SIZE",
        metavar="METRES",
        callback=positive_metres,
        help="Edge of a cell. Default: the smallest of 0.05, 0.1, 0.2, 0.25, 0.5 that stays below 20 million cells.",
    ),
]
Select = Annotated[
    str | None,
    typer.Option(
        "--select",
        envvar="BIMVOX_SELECT",
        metavar="QUERY",
        help="What to lift: an IfcOpenShell selector such as 'IfcBeam, IfcColumn'; for a mesh, names of bodies.",
    ),
]
Unit = Annotated[
    str | None,
    typer.Option(
        "--unit",
        envvar="BIMVOX_UNIT",
        metavar="UNIT",
        help="Length unit of a mesh that does not say: m, mm, cm, ft, in.",
    ),
]
Up = Annotated[
    Literal["y", "z"] | None,
    typer.Option(
        "--up", envvar="BIMVOX_UP", help="Axis of a mesh that points up. Default: as its format says (glTF: y), else z."
    ),
]
Assemblies = Annotated[
    Literal["whole", "parts"],
    typer.Option(
        "--assemblies", envvar="BIMVOX_ASSEMBLIES", help="Lift an assembly as one, or each of its parts alone."
    ),
]
Processes = Annotated[
    int | None,
    typer.Option(
        "--processes",
        min=1,
        metavar="N",
        envvar="BIMVOX_PROCESSES",
        help="Processes that mesh an IFC file; any number gives the same grid. Default: one a CPU, at most 4.",
    ),
]
