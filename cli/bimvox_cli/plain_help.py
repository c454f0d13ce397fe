"""Help that names arguments as people write them: no types, no braces."""

from __future__ import annotations

import re
from typing import Any

from typer.core import TyperArgument, TyperCommand

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
