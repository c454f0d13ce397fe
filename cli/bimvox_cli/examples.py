"""How commands are added to the command line: their help, with examples at its end."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import typer
from typer.core import TyperArgument, TyperCommand

EXAMPLES = {
    "demo": ("bimvox demo", "bimvox demo -o first-plan"),
    "voxelize": ("bimvox voxelize house.ifc", "bimvox voxelize house.ifc --voxel-size 0.25 -o house.zarr.zip"),
    "inspect": ("bimvox inspect house.ifc", "bimvox inspect house.mcap --json"),
    "init": ("bimvox init house.ifc", "bimvox init yard.glb --crane mobile -o yard.site.toml"),
    "cranes": ("bimvox cranes", "bimvox cranes house.site.toml --crane luffing"),
    "optimise": ("bimvox optimise house.site.toml", "bimvox optimise house.site.toml --crane hammerhead --plans 2"),
    "studio": ("bimvox studio", "bimvox studio house.ifc", "bimvox studio house.site.toml --port 8020 --no-browser"),
    "train": ("bimvox train house.site.toml", "bimvox train house.site.toml --budget 600 --curve tests.csv"),
    "plan": (
        "bimvox plan house.site.toml",
        "bimvox plan house.site.toml --obstructions trucks.json -o today.mcap",
        "bimvox plan sites/a.site.toml sites/b.site.toml -o plans",
    ),
    "sweep": ("bimvox sweep what-if.toml", "bimvox sweep what-if.toml --jobs 4 -o runs"),
    "watch": (
        "bimvox watch trucks.json --site house.site.toml",
        "bimvox watch trucks.json --site house.site.toml --simulate 60 --serve 8765",
    ),
    "export": (
        "bimvox export house.mcap --to csv -o lifts.csv",
        "bimvox export house.mcap --to ifc --model house.ifc --start 2026-03-02T07:00",
        "bimvox export house.zarr.zip --to glb",
    ),
    "verify": ("bimvox verify house.mcap", "bimvox verify house.mcap --site house.site.toml --remarks"),
    "render": (
        "bimvox render house.mcap",
        "bimvox render house.mcap -o house.html",
        "bimvox render house.mcap --lift 12 --time 40% --hide paths,words",
    ),
    "report": ("bimvox report house.mcap", "bimvox report house.mcap -o house.pdf"),
    "schema": ("bimvox schema site", "bimvox schema log"),
    "warm-up": ("bimvox warm-up",),
    "crane import": (
        "bimvox crane import ltx-1060.csv --like mobile-60t",
        "bimvox crane import ltx-1060.kran --like mobile-60t -o ltx-1060.toml",
    ),
    "policy list": ("bimvox policy list", "bimvox policy list --json"),
    "policy show": ("bimvox policy show 3f2a", "bimvox policy show 3f2a --json"),
    "policy remove": ("bimvox policy remove 3f2a",),
    "policy export": ("bimvox policy export 3f2a", "bimvox policy export 3f2a -o house.onnx"),
    "policy import": ("bimvox policy import house.safetensors",),
    "policy score": ("bimvox policy score default --share 0.1", "bimvox policy score mine:values --set slabs --json"),
    "experiment sequence": (
        "bimvox experiment sequence search --set small",
        "bimvox experiment sequence mine.py:order --json",
    ),
    "experiment paper": ("bimvox experiment paper --quick", "bimvox experiment paper --mode ours --seeds 3 -o ours"),
}
"""Command lines by command; a test parses each of them."""


HELP_NAMES = {"help_option_names": ["-h", "--help"], "max_content_width": 110}
"""Settings of every command: -h as well as --help, wider than the default if the terminal is."""


def enlist(app: typer.Typer, *commands: Callable[..., object], group: str = "") -> None:
    """Add commands by the names of their functions, each with its examples at the end of its help."""
    for command in commands:
        name = command.__name__.strip("_").replace("_", "-")
        examples = "\n".join(f"  {line}" for line in EXAMPLES[f"{group} {name}".strip()])
        app.command(name, cls=PlainCommand, context_settings=HELP_NAMES, epilog=f"\b\nExamples:\n{examples}")(command)


# Help that names arguments as people write them: no types, no braces.

_NAME = re.compile(r"[{\[]+(?P<name>[^}\]]*?)(?:\.\.\.)?[}\]]+(?P<more>\.\.\.)?")


class PlainCommand(TyperCommand):
    """A command whose usage reads ``plan [OPTIONS] SITE...`` instead of ``plan [OPTIONS] {SITE...}...``."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        for parameter in self.params:
            if isinstance(parameter, TyperArgument):
                _make_plain(parameter)


def _make_plain(argument: TyperArgument) -> None:
    """Leave type, brackets and "required" out of what an argument says about itself: the usage line says it."""
    record, pieces = argument.get_help_record, argument.get_usage_pieces

    def plain_record(ctx: Any) -> tuple[str, str] | None:
        found = record(ctx)
        if found is None:
            return None
        name = re.sub(r" <[^>]*>$", "", found[0]).strip("[]")
        return name, found[1].removesuffix("[required]").rstrip()

    def plain_pieces(ctx: Any) -> list[str]:
        return [_NAME.sub(_written, piece) for piece in pieces(ctx)]

    def _written(piece: re.Match[str]) -> str:
        name = piece["name"] + ("..." if piece["more"] else "")
        return name if argument.required else f"[{name}]"

    argument.get_help_record = plain_record  # type: ignore[method-assign]
    argument.get_usage_pieces = plain_pieces  # type: ignore[method-assign]
