"""One page a command, from what its ``--help`` says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer
from bimvox_cli.examples import EXAMPLES as HELP_EXAMPLES
from bimvox_cli.main import app

from docs.reference.examples import EXAMPLES, READ_ON
from docs.reference.markdown import notice, prose, table

_WIDTH = 100

_SHARED = frozenset({"--json", "--quiet", "--verbose", "--help"})
"""Options that mean the same in every command: the page of all commands describes them."""


def command_pages() -> dict[str, str]:
    """Return the pages of all commands, and one that lists them, by path in ``docs``."""
    # Typer carries Click's classes inside: they are reached through the objects alone.
    base: Any = typer.main.get_command(app)
    root = base.context_class(base, info_name="bimvox", terminal_width=_WIDTH)
    found = {name: base.get_command(root, name) for name in base.list_commands(root)}
    index = [
        "# Commands",
        "",
        notice("the commands' own help"),
        "",
        prose(base.help),
        "",
        prose(base.epilog),
        "",
        "Every command takes `--json` (`BIMVOX_JSON`: one document on stdout, messages on stderr) and `-h, --help`. "
        "All but `schema` take `-q, --quiet` (`BIMVOX_QUIET`: errors only) and `-v, --verbose` (`BIMVOX_VERBOSE`: "
        "every stage with its time).",
        "",
        *table(
            ("command", "does"),
            [(f"[{name}]({name}.md)", prose(one.help.split("\n\n")[0])) for name, one in found.items()],
        ),
    ]
    pages = {"commands/README.md": "\n".join([*index, ""])}
    for name, command in found.items():
        lines = [f"# bimvox {name}", "", notice("the command's own help"), "", *_page(name, command, root)]
        pages[f"commands/{name}.md"] = "\n".join(lines).rstrip() + "\n"
    return pages


def _page(name: str, command: Any, root: Any) -> Iterator[str]:
    context = command.context_class(command, info_name=name, parent=root, terminal_width=_WIDTH)
    yield from _body(command, context)
    for sub in getattr(command, "commands", {}):
        inner = command.get_command(context, sub)
        yield from [f"## bimvox {name} {sub}", ""]
        yield from _body(inner, inner.context_class(inner, info_name=sub, parent=context, terminal_width=_WIDTH))
        yield from ["```text", *HELP_EXAMPLES[f"{name} {sub}"], "```", ""]
    yield from ["## Examples", ""]
    yield from ["```sh", *EXAMPLES[name], "```", ""]
    links = ["[options of every command](README.md)", *(f"[{title}](../{path})" for title, path in READ_ON[name])]
    yield f"Read on: {' · '.join(links)}."


def _body(command: Any, context: Any) -> Iterator[str]:
    usage = re.sub(r"\s+", " ", command.get_usage(context)).removeprefix("Usage: ").strip()
    yield from [prose(command.help), "", "```text", usage, "```", ""]
    own = (one for one in command.get_params(context) if _SHARED.isdisjoint(one.opts))
    records = filter(None, (parameter.get_help_record(context) for parameter in own))
    rows = [(f"`{names.strip()}`", *_split(text)) for names, text in records]
    if rows:
        yield from [*table(("", "", "set by"), rows), ""]


def _split(text: str) -> tuple[str, str]:
    """Return the meaning of an option with its bounds and default, and the environment variable that sets it."""
    meaning, _, extra = text.partition("  [")
    notes = [note for note in extra.rstrip("]").split("; ") if note]
    variable = "".join(f"`{note.removeprefix('env var: ')}`" for note in notes if note.startswith("env var: "))
    rest = "; ".join(note for note in notes if not note.startswith("env var: "))
    return prose(meaning) + (f" ({rest})" if rest else ""), variable
