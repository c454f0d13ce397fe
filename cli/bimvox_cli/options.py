"""Options and arguments that several commands share, each with its environment variable."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Concatenate, Literal, ParamSpec

import typer

from bimvox_cli import complete
from bimvox_cli.output import Output, open_output

if TYPE_CHECKING:
    from bimvox.bim.options import ReadOptions

UpAxis = Literal["y", "z"]
Grouping = Literal["whole", "parts"]

_P = ParamSpec("_P")


def command(run: Callable[Concatenate[Output, _P], int]) -> Callable[..., None]:
    """Return a command with --json, --quiet and --verbose, from a function that prints and returns the exit code."""
    signature = inspect.signature(run, eval_str=True)
    flags = {"json": Json, "quiet": Quiet, "verbose": Verbose}
    of_all = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=flag)
        for name, flag in flags.items()
    ]

    @wraps(run)
    def with_output(json: bool, quiet: bool, verbose: bool, **given: Any) -> None:
        with open_output(as_json=json, quiet=quiet, verbose=verbose) as output:
            code = run(output, **given)  # type: ignore[call-arg]
        raise typer.Exit(code)

    own = list(signature.parameters.values())[1:]
    with_output.__signature__ = signature.replace(parameters=[*own, *of_all])  # type: ignore[attr-defined]
    return with_output


def positive_metres(value: float | None) -> float | None:
    """Return a length from the command line, checked to be finite and positive."""
    if value is not None and not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value:g} is not a positive length in metres")
    return value


def read_options(
    select: str | None, unit: str | None, up: UpAxis | None, assemblies: Grouping, processes: int | None = None
) -> ReadOptions:
    """Return the options of reading a model as one value."""
    from bimvox.bim.options import ReadOptions, default_processes

    processes = default_processes() if processes is None else processes
    return ReadOptions(select=select, unit=unit, up=up, assemblies=assemblies, processes=processes)


def to_file(metavar: str, help: str) -> Any:  # noqa: A002  (typer's word)
    """Return the option that names what a command writes."""
    return typer.Option("--output", "-o", metavar=metavar, help=help)


def table_option(names: Sequence[str], more: str = "") -> Any:
    """Return the option that asks for tables of a result, by their names."""

    def known(given: list[str]) -> list[str]:
        """Return the names, several of which may be in one text; an unknown one is an error of usage."""
        found = [name.strip() for text in given for name in text.split(",")]
        if unknown := next((name for name in found if name not in names), None):
            near = get_close_matches(unknown, names, 1)
            meant = f"; did you mean {near[0]}?" if near else ""
            raise typer.BadParameter(f"{unknown!r} is not one of {', '.join(names)}{meant}")
        return found

    return typer.Option(
        "--table",
        metavar="NAME",
        callback=known,
        autocompletion=lambda: list(names),
        help=f"After the verdict, print a table instead of the summary: {', '.join(names)}. Can be repeated. "
        f"{more}".rstrip(),
    )


Model = Annotated[
    Path,
    typer.Argument(metavar="MODEL", help="An IFC file (.ifc, .ifczip) or a mesh (STL, OBJ, PLY, OFF, GLB, GLTF, 3MF)."),
]
SiteFile = Annotated[Path, typer.Argument(metavar="SITE", help="A site file (TOML), as `bimvox init` writes it.")]
Log = Annotated[Path, typer.Argument(metavar="LOG", help="A log, as `bimvox plan` writes it.")]

MachineChoice = Annotated[
    str | None,
    typer.Option(
        "--crane",
        metavar="NAME",
        autocompletion=complete.cranes,
        help="Only a kind (hammerhead, luffing, mobile), or one machine or the file of one. Default: all.",
    ),
]

Json = Annotated[
    bool,
    typer.Option("--json", envvar="BIMVOX_JSON", help="Print one JSON document on stdout, and nothing else there."),
]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", envvar="BIMVOX_QUIET", help="No progress, notes or summary; errors only.")
]
Verbose = Annotated[
    bool,
    typer.Option(
        "--verbose", "-v", envvar="BIMVOX_VERBOSE", help="Print every stage with its time, and a fault with its place."
    ),
]
FullRate = Annotated[
    bool,
    typer.Option(
        "--full-rate",
        help="Show viewers every sample of the motions, in a log of about three times the size. Every log has them for "
        "the proof.",
    ),
]
Programme = Annotated[
    Path | None,
    typer.Option(
        "--programme",
        metavar="FILE",
        help="Existing programme, Microsoft Project XML or Primavera XER, instead of the site file's.",
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(
        "--seed",
        min=0,
        metavar="N",
        envvar="BIMVOX_SEED",
        help="Seed of everything random. Default: from the site file.",
    ),
]
Steps = Annotated[
    int | None,
    typer.Option(
        "--steps", min=1, metavar="N", envvar="BIMVOX_STEPS", help="Train for at most this many environment steps."
    ),
]
Train = Annotated[
    bool,
    typer.Option(
        "--train",
        envvar="BIMVOX_TRAIN",
        help="Train a policy for the site if there is none. --steps does so too. Otherwise nothing is trained.",
    ),
]
PolicyId = Annotated[
    str | None,
    typer.Option(
        "--policy",
        envvar="BIMVOX_POLICY",
        metavar="ID",
        autocompletion=complete.policies,
        help="What proposes paths: greedy (towards the target); none: search only; default: the shipped network; "
        "nearest: the policy of the most similar site; or one of `bimvox policy list`.",
    ),
]
VoxelSize = Annotated[
    float | None,
    typer.Option(
        "--voxel-size",
        envvar="BIMVOX_VOXEL_SIZE",
        metavar="METRES",
        callback=positive_metres,
        help="Edge of a cell. Default: the smallest of 0.05, 0.1, 0.2, 0.25, 0.5 that keeps below 20 million cells.",
    ),
]
Select = Annotated[
    str | None,
    typer.Option(
        "--select",
        envvar="BIMVOX_SELECT",
        metavar="QUERY",
        help="Parts to lift: an IfcOpenShell selector such as 'IfcBeam, IfcColumn'; for a mesh, names of bodies.",
    ),
]
Unit = Annotated[
    str | None,
    typer.Option(
        "--unit",
        envvar="BIMVOX_UNIT",
        metavar="UNIT",
        help="Length unit of a mesh that does not state it: m, mm, cm, ft, in.",
    ),
]
Up = Annotated[
    UpAxis | None,
    typer.Option(
        "--up",
        envvar="BIMVOX_UP",
        help="Axis of a mesh that points up. Default: from its format (glTF: y), otherwise z.",
    ),
]
Assemblies = Annotated[
    Grouping,
    typer.Option(
        "--assemblies", envvar="BIMVOX_ASSEMBLIES", help="Lift an assembly as one load, or each of its parts."
    ),
]
Processes = Annotated[
    int | None,
    typer.Option(
        "--processes",
        min=1,
        metavar="N",
        envvar="BIMVOX_PROCESSES",
        help="Processes that mesh an IFC file; the grid does not depend on it. Default: one per CPU, at most 4.",
    ),
]
