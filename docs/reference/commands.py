"""One page a command, from what its ``--help`` says."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Set
from typing import Any

import typer
from bimvox_cli.examples import EXAMPLES as HELP_EXAMPLES
from bimvox_cli.main import app

from docs.reference.examples import EXAMPLES, READ_ON
from docs.reference.markdown import prose, table

_WIDTH = 100

_SHARED = frozenset({"--json", "--quiet", "--verbose", "--help"})
"""Options that mean the same in every command: the page of all commands describes them."""

_Row = tuple[str, str, str]
"""An option or argument as shown: names, meaning, environment variable."""


def command_pages() -> dict[str, str]:
    """Return the pages of all commands, and one that lists them, by path in ``docs``."""
    # Typer carries Click's classes inside: they are reached through the objects alone.
    base: Any = typer.main.get_command(app)
    root = base.context_class(base, info_name="bimvox", terminal_width=_WIDTH)
    found = {name: base.get_command(root, name) for name in base.list_commands(root)}
    contexts = {
        name: one.context_class(one, info_name=name, parent=root, terminal_width=_WIDTH) for name, one in found.items()
    }
    counted = Counter(row for name, one in found.items() for row in _rows(one, contexts[name]))
    several = [row for row, count in counted.items() if count > 1 and row[0].startswith("`-")]
    index = [
        "# Commands",
        "",
        prose(base.help),
        "",
        prose(base.epilog),
        "",
        "A fault of bimvox itself ends with 70. What a signal ends has 128 plus its number: 130 after Ctrl-C (`watch`, "
        "`studio` and `render --follow`: 0), 143 after SIGTERM, 129 if the terminal is closed, 141 without a word if "
        "the reader of stdout leaves (`bimvox cranes | head -1`). If stdout is closed or its disk is full, the code is "
        "2; messages that stderr does not take are dropped.",
        "",
        "Every command takes `--json` (`BIMVOX_JSON`: one document on stdout, messages on stderr) and `-h, --help`. "
        "All but `schema` take `-q, --quiet` (`BIMVOX_QUIET`: errors only) and `-v, --verbose` (`BIMVOX_VERBOSE`: "
        "every stage with its time).",
        "",
        *table(
            ("command", "does"),
            [(f"[{name}]({name}.md)", prose(one.help.split("\n\n")[0])) for name, one in found.items()],
        ),
        "",
        "## Options of several commands",
        "",
        *table(("", "", "set by"), several),
    ]
    pages = {"commands/README.md": "\n".join([*index, ""])}
    for name, command in found.items():
        body = _page(name, command, contexts[name], frozenset(several))
        lines = [f"# bimvox {name}", "", *body]
        pages[f"commands/{name}.md"] = "\n".join(lines).rstrip() + "\n"
    return pages


def _page(name: str, command: Any, context: Any, several: Set[_Row]) -> Iterator[str]:
    yield from _body(command, context, several)
    for sub in getattr(command, "commands", {}):
        inner = command.get_command(context, sub)
        yield from [f"## bimvox {name} {sub}", ""]
        of_sub = inner.context_class(inner, info_name=sub, parent=context, terminal_width=_WIDTH)
        yield from _body(inner, of_sub, several)
        yield from ["```text", *HELP_EXAMPLES[f"{name} {sub}"], "```", ""]
    yield from ["## Examples", ""]
    # What runs until it is interrupted has no examples that the tests run.
    run = EXAMPLES[name]
    yield from ["```sh", *run, "```", ""] if run else ["```text", *HELP_EXAMPLES[name], "```", ""]
    links = ["[options of every command](README.md)", *(f"[{title}](../{path})" for title, path in READ_ON[name])]
    yield f"Read on: {', '.join(links)}."


def _body(command: Any, context: Any, several: Set[_Row]) -> Iterator[str]:
    usage = re.sub(r"\s+", " ", command.get_usage(context)).removeprefix("Usage: ").strip()
    yield from [prose(command.help), "", "```text", usage, "```", ""]
    rows = list(_rows(command, context))
    if own := [row for row in rows if row not in several]:
        yield from [*table(("", "", "set by"), own), ""]
    if others := [row[0] for row in rows if row in several]:
        yield from [f"Also, [as elsewhere](README.md#options-of-several-commands): {', '.join(others)}.", ""]


def _rows(command: Any, context: Any) -> Iterator[_Row]:
    """Yield the options and arguments of a command, without those that every command has."""
    own = (one for one in command.get_params(context) if _SHARED.isdisjoint(one.opts))
    for names, text in filter(None, (parameter.get_help_record(context) for parameter in own)):
        yield (f"`{names.strip()}`", *_split(text))


def _split(text: str) -> tuple[str, str]:
    """Return the meaning of an option with its bounds and default, and the environment variable that sets it."""
    meaning, _, extra = text.partition("  [")
    notes = [note for note in extra.rstrip("]").split("; ") if note]
    variable = "".join(f"`{note.removeprefix('env var: ')}`" for note in notes if note.startswith("env var: "))
    rest = "; ".join(note for note in notes if not note.startswith("env var: "))
    return prose(meaning) + (f" ({rest})" if rest else ""), variable
